//! What can be seen of the vehicle.

use rapier3d_f64::prelude::Vector as Vector3;

use super::World;
use super::tree::FREE;
use crate::observation::{ContactForce, Observation, Pose3};

impl<const N: usize> World<N> {
    /// Turning speed of a wheel against its carrier \[rad/s\].
    pub(super) fn wheel_rad_s(&self, wheel: usize) -> f64 {
        let spec = &self.model.wheels[wheel];
        let axle = self.tree.rotation[spec.body] * spec.axle;
        self.state.spin_rad_s[wheel] - axle.dot(self.tree.omega[spec.body])
    }

    /// Adds the contact forces of a step to each wheel's average.
    pub(super) fn observe_contacts(&self, share: f64, observation: &mut Observation) {
        let per_second = share / self.step_s;
        let mut from = 0;
        for (i, (wheel, seen)) in self.model.wheels.iter().zip(&mut observation.wheels).enumerate() {
            let (mut force, mut normal) = (Vector3::ZERO, Vector3::ZERO);
            let (mut moment, mut size) = (Vector3::ZERO, 0.0);
            while let Some(contact) = self.contacts.get(from).filter(|contact| contact.wheel == i) {
                from += 1;
                force += contact.impulse();
                normal += contact.normal * contact.push;
                moment += (contact.point + self.before_com) * contact.push;
                size += contact.push;
            }
            if size == 0.0 {
                continue;
            }
            let across = self.tree.rotation[wheel.body] * wheel.across_push;
            let along = across.cross(normal).normalize_or_zero();
            seen.add(&ContactForce {
                force_n: (force * per_second).into(),
                normal_n: (normal * per_second).into(),
                along_n: force.dot(along) * per_second,
                moment_m_n: (moment * per_second).into(),
                push_n: size * per_second,
            });
        }
    }

    /// Writes the present poses and velocities.
    pub(super) fn observe_motion(&self, observation: &mut Observation) {
        observation.time_ns = self.time_ns;
        let (tree, com, u) = (&self.tree, self.com(), self.u());
        let [x, y, z, w] = self.state.base;
        observation.pose = Pose3 {
            position_m: (com + tree.origin[0]).into(),
            rotation_xyzw: [x, y, z, w],
        };
        // Velocity of the vehicle's origin, along the base's axes turned about the vertical only: what odometry means.
        let forward = tree.rotation[0] * Vector3::X;
        let level = Vector3::new(forward.x, forward.y, 0.0).normalize_or(Vector3::X);
        let (sin, cos) = (level.y, level.x);
        let v = tree.velocity(0, tree.origin[0], &u);
        observation.twist = omni_core::BodyTwist {
            vx_m_s: cos * v.x + sin * v.y,
            vy_m_s: cos * v.y - sin * v.x,
            wz_rad_s: tree.omega[0].z,
        };
        let angles = observation
            .body_nose_up_rad
            .iter_mut()
            .zip(&mut observation.body_lean_rad);
        for (place, (pitch, lean)) in self.model.place_of.iter().zip(angles) {
            let rotation = tree.rotation[*place];
            *pitch = libm::asin((rotation * Vector3::X).z.clamp(-1.0, 1.0));
            *lean = libm::acos((rotation * Vector3::Z).z.clamp(-1.0, 1.0));
        }
        for (b, body) in self.model.bodies.iter().enumerate() {
            if let Some(hinge) = body.hinge {
                let seen = &mut observation.hinges[hinge];
                (seen.angle_rad, seen.rate_rad_s) = (self.state.angle_rad[b], u[FREE - 1 + b]);
            }
        }
        for (i, (wheel, seen)) in self.model.wheels.iter().zip(&mut observation.wheels).enumerate() {
            let rotation = tree.rotation[wheel.body];
            let centre = tree.origin[wheel.body] + rotation * wheel.centre_m;
            seen.centre_m = (centre + com).into();
            seen.rim_m_s = self.wheel_rad_s(i) * wheel.way_per_rad;
            // In the tangent plane of the contact; the ground's plane while there is none.
            let normal = if seen.touches() {
                Vector3::from(seen.normal)
            } else {
                Vector3::Z
            };
            let along = (rotation * wheel.across_push).cross(normal).normalize_or_zero();
            seen.along_m_s = tree.velocity(wheel.body, centre, &u).dot(along);
        }
        let (rows, wheels) = (&self.rows, &observation.wheels);
        for (row, load_n) in rows.iter().zip(&mut observation.row_loads_n) {
            *load_n = row.iter().map(|w| wheels[*w].force_n[2]).sum();
        }
    }
}
