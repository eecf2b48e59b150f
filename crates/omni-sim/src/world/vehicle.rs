//! The vehicle's bodies, hinges and wheels, and what can be seen of them.

use rapier3d_f64::prelude::*;

use super::pose3;
use super::wheel::Wheel;
use crate::config::{Body, Scenario};
use crate::observation::Observation;

struct HingeBodies {
    parent: RigidBodyHandle,
    child: RigidBodyHandle,
    axis: Vector,
}

/// Handles of a vehicle in a world. Every body's local frame is the vehicle's frame as it stands on flat ground.
pub(super) struct VehicleBodies {
    names: Vec<String>,
    bodies: Vec<RigidBodyHandle>,
    hinges: Vec<HingeBodies>,
    pub(super) wheels: Vec<Wheel>,
}

impl VehicleBodies {
    pub(super) fn insert(physics: &mut PhysicsWorld, scenario: &Scenario, start: Pose) -> Self {
        let vehicle = scenario.vehicle();
        let bodies: Vec<_> = vehicle
            .body
            .iter()
            .map(|body| physics.insert_body(rigid_body(body, start)))
            .collect();
        // A loaded vehicle names bodies that exist.
        let find = |name: &str| bodies[vehicle.body.iter().position(|b| b.name == name).unwrap_or(0)];
        let mut hinges = Vec::new();
        for hinge in &vehicle.hinge {
            let axis = Vector::from(hinge.axis).normalize();
            let anchor = Vector::from(hinge.anchor_m);
            let joint = RevoluteJointBuilder::new(axis)
                .local_anchor1(anchor)
                .local_anchor2(anchor)
                .limits([-hinge.limit_rad, hinge.limit_rad])
                .motor_model(MotorModel::ForceBased)
                .motor_velocity(0.0, hinge.damping_n_m_s_rad)
                .contacts_enabled(false);
            let (parent, child) = (find(&hinge.parent), find(&hinge.child));
            physics.insert_impulse_joint(parent, child, joint);
            hinges.push(HingeBodies { parent, child, axis });
        }
        let wheels = vehicle
            .wheel
            .iter()
            .enumerate()
            .map(|(i, w)| Wheel::insert(physics, w, scenario.rollers(i).as_ref(), find(&w.body), start))
            .collect();
        Self {
            names: vehicle.body.iter().map(|b| b.name.clone()).collect(),
            bodies,
            hinges,
            wheels,
        }
    }

    /// Replaces the torques of the last step by these.
    pub(super) fn apply(&self, physics: &mut PhysicsWorld, torques_n_m: &[f64]) {
        for handle in self.bodies.iter().chain(self.wheels.iter().map(|w| &w.driven)) {
            physics.bodies[*handle].reset_torques(false);
        }
        for (wheel, torque) in self.wheels.iter().zip(torques_n_m) {
            wheel.apply(physics, *torque);
        }
    }

    pub(super) fn name_of(&self, handle: RigidBodyHandle) -> &str {
        match self.bodies.iter().position(|b| *b == handle) {
            Some(i) => &self.names[i],
            None => "wheel",
        }
    }

    pub(super) fn observe(&self, physics: &PhysicsWorld, observation: &mut Observation) {
        let base = &physics.bodies[self.bodies[0]];
        observation.pose = pose3(base.position());
        // Velocity of the vehicle's origin, along the base's axes turned about the vertical only: what odometry means.
        let forward = base.rotation() * Vector::X;
        let level = Vector::new(forward.x, forward.y, 0.0).normalize_or(Vector::X);
        let (sin, cos) = (level.y, level.x);
        let v = base.velocity_at_point(base.position().translation);
        observation.twist = omni_core::BodyTwist {
            vx_m_s: cos * v.x + sin * v.y,
            vy_m_s: cos * v.y - sin * v.x,
            wz_rad_s: base.angvel().z,
        };
        for (handle, pitch) in self.bodies.iter().zip(&mut observation.body_nose_up_rad) {
            *pitch = libm::asin(
                (physics.bodies[*handle].rotation() * Vector::X)
                    .z
                    .clamp(-1.0, 1.0),
            );
        }
        for (hinge, seen) in self.hinges.iter().zip(&mut observation.hinges) {
            let (parent, child) = (&physics.bodies[hinge.parent], &physics.bodies[hinge.child]);
            let relative = parent.rotation().inverse() * *child.rotation();
            let along = Vector::new(relative.x, relative.y, relative.z).dot(hinge.axis);
            seen.angle_rad = 2.0 * libm::atan2(along, relative.w);
            seen.rate_rad_s = (child.angvel() - parent.angvel()).dot(parent.rotation() * hinge.axis);
        }
        for (wheel, seen) in self.wheels.iter().zip(&mut observation.wheels) {
            let (centre, velocity) = wheel.centre_world(physics);
            seen.centre_m = centre.into();
            seen.rim_m_s = wheel.wheel_velocity(physics) * wheel.way_per_rad;
            // Along the push, the rolling direction of an omni wheel, in the tangent plane of the contact; the ground's plane while there is none.
            let normal = if seen.touches() {
                Vector::from(seen.normal)
            } else {
                Vector::Z
            };
            seen.along_m_s = velocity.dot(wheel.axle_world(physics).cross(normal).normalize_or_zero());
        }
    }
}

fn rigid_body(body: &Body, start: Pose) -> RigidBodyBuilder {
    let [a, b, c] = body.box_m.map(|edge| edge * edge);
    let inertia = AngVector::new(b + c, a + c, a + b) * (body.mass_kg / 12.0);
    RigidBodyBuilder::dynamic()
        .pose(start)
        .can_sleep(false)
        .additional_mass_properties(MassProperties::new(
            Vector::from(body.com_m),
            body.mass_kg,
            inertia,
        ))
}
