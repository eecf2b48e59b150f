//! The spring and damper of a coupling, as simulated.

use super::{Body, Coupling, Vehicle};

/// Swing of the coupled bodies against each other, were they held by nothing else \[Hz\]: far above what a vehicle does
/// (some Hz), and still resolved by twenty physics steps of the usual 0.5 ms.
const DEFAULT_HZ: f64 = 100.0;
/// Of critical damping: a swing dies within one period.
const DEFAULT_DAMPING_RATIO: f64 = 0.5;

/// A coupling's spring and damper, as simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CouplingSpring {
    /// Inertia that the coupled bodies oppose to `angle_a + ratio * angle_b` when nothing else holds them \[kg.m^2\].
    pub inertia_kg_m2: f64,
    /// Torque on hinge a per angle \[N.m/rad\].
    pub stiffness_n_m_rad: f64,
    /// Torque on hinge a per rate \[N.m.s/rad\].
    pub damping_n_m_s_rad: f64,
}

impl CouplingSpring {
    /// The longest physics step that resolves it \[s\].
    ///
    /// Torques of a step follow from the angles before it: `J x'' + c x' + k x = 0` then stays bounded while
    /// `k dt^2 + 2 c dt < 4 J`. Half of that is allowed. Hinges and wheels only add to J.
    #[must_use]
    pub fn longest_step_s(&self) -> f64 {
        let (j, k, c) = (self.inertia_kg_m2, self.stiffness_n_m_rad, self.damping_n_m_s_rad);
        // The positive root of k dt^2 + 2 c dt = 2 J, in the form that keeps its digits.
        2.0 * j / (c + (c * c + 2.0 * j * k).sqrt())
    }
}

impl Vehicle {
    /// The spring and damper of one of its couplings, keys that were left out resolved.
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("rocker_bogie6")?;
    /// let spring = vehicle.coupling_spring(&vehicle.coupling[0]);
    /// let swing_hz = (spring.stiffness_n_m_rad / spring.inertia_kg_m2).sqrt() / std::f64::consts::TAU;
    /// assert!((swing_hz - 100.0).abs() < 1e-9);
    /// assert!(spring.longest_step_s() > 500e-6); // the usual physics step resolves it
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn coupling_spring(&self, coupling: &Coupling) -> CouplingSpring {
        // A unit torque of the coupling turns every body by the sum of its shares over the body's inertia.
        let mut shares = vec![[0.0; 3]; self.body.len()];
        for (name, factor) in [(&coupling.hinge_a, 1.0), (&coupling.hinge_b, coupling.ratio)] {
            let Some(hinge) = self.hinge.iter().find(|hinge| hinge.name == *name) else {
                continue; // a loaded vehicle names hinges that exist
            };
            let [x, y, z] = hinge.axis;
            let length = (x * x + y * y + z * z).sqrt();
            for (body, sign) in [(&hinge.child, 1.0), (&hinge.parent, -1.0)] {
                if let Some(i) = self.body.iter().position(|b| b.name == *body) {
                    for (share, axis) in shares[i].iter_mut().zip(hinge.axis) {
                        *share += sign * factor * axis / length;
                    }
                }
            }
        }
        let mobility = |(body, share): (&Body, &[f64; 3])| {
            let inertia = body.inertia_kg_m2();
            (0..3)
                .map(|axis| share[axis] * share[axis] / inertia[axis])
                .sum::<f64>()
        };
        let inertia_kg_m2 = 1.0 / self.body.iter().zip(&shares).map(mobility).sum::<f64>();
        let swing = std::f64::consts::TAU * DEFAULT_HZ;
        CouplingSpring {
            inertia_kg_m2,
            stiffness_n_m_rad: coupling
                .stiffness_n_m_rad
                .unwrap_or(inertia_kg_m2 * swing * swing),
            damping_n_m_s_rad: coupling
                .damping_n_m_s_rad
                .unwrap_or(2.0 * DEFAULT_DAMPING_RATIO * inertia_kg_m2 * swing),
        }
    }
}
