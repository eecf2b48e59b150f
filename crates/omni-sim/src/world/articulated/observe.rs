//! Observable state of the vehicle.

use rapier3d_f64::prelude::Vector as Vector3;

use super::World;
use super::tree::FREE;
use crate::observation::{Observation, Pose3};
use crate::world::observed::{ContactSum, along_push, level_twist, load_rows, rim_speed, tilt};

impl<const N: usize> World<N> {
    /// Turning speed of a wheel against its carrier \[rad/s\].
    pub(super) fn wheel_rad_s(&self, wheel: usize) -> f64 {
        let omega = self.tree.omega[self.model.wheels[wheel].body];
        self.state.spin_rad_s[wheel] - self.tree.axle[wheel].dot(omega)
    }

    /// Adds the contact forces of a step to each wheel's average.
    pub(super) fn observe_contacts(&self, share: f64, observation: &mut Observation) {
        let per_second = share / self.step_s;
        let mut from = 0;
        for (i, (wheel, seen)) in self.model.wheels.iter().zip(&mut observation.wheels).enumerate() {
            let mut sum = ContactSum::default();
            while let Some(contact) = self.contacts.get(from).filter(|contact| contact.wheel == i) {
                from += 1;
                let (normal, at) = (
                    contact.normal * contact.normal_impulse,
                    contact.point + self.before_com,
                );
                sum.add(contact.impulse(), normal, at, contact.normal_impulse);
            }
            let across = self.tree.rotation[wheel.body] * wheel.across_push;
            sum.add_to(across, per_second, seen);
        }
    }

    /// Writes the present poses and velocities.
    pub(super) fn observe_motion(&self, observation: &mut Observation) {
        observation.time_ns = self.time_ns;
        let (tree, com) = (&self.tree, self.com());
        let [x, y, z, w] = self.state.base;
        observation.pose = Pose3 {
            position_m: (com + tree.origin[0]).into(),
            rotation_xyzw: [x, y, z, w],
        };
        let velocity = tree.velocity(0, tree.origin[0]);
        (observation.velocity_m_s, observation.rate_rad_s) = (velocity.into(), tree.omega[0].into());
        observation.twist = level_twist(tree.rotation[0] * Vector3::X, velocity, tree.omega[0].z);
        let angles = observation
            .body_nose_up_rad
            .iter_mut()
            .zip(&mut observation.body_lean_rad);
        for (place, (pitch, lean)) in self.model.place_of.iter().zip(angles) {
            let rotation = tree.rotation[*place];
            (*pitch, *lean) = tilt(rotation * Vector3::X, rotation * Vector3::Z);
        }
        for (b, body) in self.model.bodies.iter().enumerate() {
            if let Some(hinge) = body.hinge {
                let seen = &mut observation.hinges[hinge];
                (seen.angle_rad, seen.rate_rad_s) = (self.state.angle_rad[b], self.state.u[FREE - 1 + b]);
            }
        }
        for (i, (wheel, seen)) in self.model.wheels.iter().zip(&mut observation.wheels).enumerate() {
            let (rotation, centre) = (tree.rotation[wheel.body], tree.centre[i]);
            seen.centre_m = (centre + com).into();
            let (across, way_m_s) = (
                rotation * wheel.across_push,
                self.wheel_rad_s(i) * wheel.way_per_rad,
            );
            seen.rim_m_s = rim_speed(way_m_s, wheel.radius_m, across, tree.omega[wheel.body]);
            let velocity = tree.velocity(wheel.body, centre);
            seen.along_m_s = along_push(velocity, across, seen);
        }
        load_rows(&self.rows, observation);
    }
}
