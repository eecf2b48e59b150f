//! The energy of the run-up that remains after an impact on the edge.

use nalgebra::{Matrix4, Vector4};

use crate::climb_path::{Posture, dot, less, moment};
use crate::linkage::Linkage;

/// Parts of the run-up's kinetic energy, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kept {
    /// At most: nothing but the edge pushes, along its normal, and the climbing row alone has to give way.
    pub(crate) at_most: f64,
    /// If every row stays on the ground and every wheel rolls at once: the motion along the path.
    pub(crate) on_path: f64,
}

impl Linkage {
    /// The state right after a row's first touch, with the vehicle driving at one speed until then.
    pub(crate) fn kept(&self, row: usize, posture: &Posture) -> Kept {
        let driving = self.driving_mass_kg();
        let normal = posture.normals[row];
        // Speed towards the edge for each m/s of the run-up.
        let towards = -dot(normal, [1.0, 0.0]);
        let lost = self.mass_at(row, posture) * towards * towards / driving;

        // Momentum of the run-up along the path, for each m/s.
        let frames = self.frames.iter().zip(posture.centres);
        let ahead: f64 = frames.map(|(frame, centre)| frame.mass_kg * centre.rate[0]).sum();
        let spins = self.rows.iter().enumerate();
        let spins =
            spins.map(|(each, wheels)| wheels.spin_kg_m2 * self.spin(posture, each) / wheels.radius_m);
        let momentum = ahead + spins.sum::<f64>();
        let on_path = momentum.max(0.0).powi(2) / (self.path_inertia(posture) * driving);
        Kept {
            at_most: 1.0 - lost,
            on_path,
        }
    }

    /// Mass \[kg\] with which the axle of a row resists a push along its contact's normal, where nothing else touches.
    fn mass_at(&self, row: usize, posture: &Posture) -> f64 {
        // Velocities: of the hinge forward and up, of each frame nose up.
        let moved = |arm: [f64; 2], frame: usize, way: [f64; 2]| {
            let mut by = Vector4::new(way[0], way[1], 0.0, 0.0);
            by[2 + frame] = moment(arm, way);
            by
        };
        let hinge = posture.hinge.at;
        let mut inertia = Matrix4::<f64>::zeros();
        for (frame, spec) in self.frames.iter().enumerate() {
            let arm = less(posture.centres[frame].at, hinge);
            for way in [[1.0, 0.0], [0.0, 1.0]] {
                let by = moved(arm, frame, way);
                inertia += by * by.transpose() * spec.mass_kg;
            }
            inertia[(2 + frame, 2 + frame)] += spec.inertia_kg_m2;
        }
        let by = moved(
            less(posture.axles[row].at, hinge),
            self.rows[row].frame,
            posture.normals[row],
        );
        // Masses and inertias are positive, so that this matrix has an inverse.
        inertia.cholesky().map_or(0.0, |of| 1.0 / by.dot(&of.solve(&by)))
    }
}
