//! The vehicle's bodies, hinges and wheels, and what can be seen of them.

use rapier3d_f64::prelude::*;

use super::wheel::Wheel;
use crate::config::{Body, CouplingSpring, RollerWheel, Scenario};
use crate::observation::{Observation, Pose3};
use crate::world::observed::{along_push, level_twist, load_rows, rim_speed, tilt};

struct HingeBodies {
    name: String,
    parent: RigidBodyHandle,
    child: RigidBodyHandle,
    axis: Vector,
    anchor: Vector,
}

impl HingeBodies {
    /// The axis in the world.
    fn axis_world(&self, physics: &PhysicsWorld) -> Vector {
        physics.bodies[self.parent].rotation() * self.axis
    }

    /// Angle of the child against the parent \[rad\] and its rate \[rad/s\].
    fn angle_and_rate(&self, physics: &PhysicsWorld) -> (f64, f64) {
        let (parent, child) = (&physics.bodies[self.parent], &physics.bodies[self.child]);
        let relative = parent.rotation().inverse() * *child.rotation();
        let along = Vector::new(relative.x, relative.y, relative.z).dot(self.axis);
        let angle = 2.0 * libm::atan2(along, relative.w);
        let rate = (child.angvel() - parent.angvel()).dot(self.axis_world(physics));
        (angle, rate)
    }

    /// Adds a torque \[N.m\] on the child about the axis, and the opposite one on the parent.
    fn add_torque(&self, physics: &mut PhysicsWorld, torque: f64) {
        let torque = self.axis_world(physics) * torque;
        physics.bodies[self.child].add_torque(torque, true);
        physics.bodies[self.parent].add_torque(-torque, true);
    }
}

/// Two hinges held at `angle_a + ratio * angle_b = 0` by a spring and a damper. rapier has no joint between joints.
struct CoupledHinges {
    a: usize,
    b: usize,
    ratio: f64,
    spring: CouplingSpring,
}

impl CoupledHinges {
    /// Adds the torques of this step. As much work is done on hinge b as the coupling's angle moves
    /// with it: hence the ratio.
    fn apply(&self, physics: &mut PhysicsWorld, hinges: &[HingeBodies]) {
        let (angle_a, rate_a) = hinges[self.a].angle_and_rate(physics);
        let (angle_b, rate_b) = hinges[self.b].angle_and_rate(physics);
        let (off, rate) = (angle_a + self.ratio * angle_b, rate_a + self.ratio * rate_b);
        let torque = -self.spring.stiffness_n_m_rad * off - self.spring.damping_n_m_s_rad * rate;
        hinges[self.a].add_torque(physics, torque);
        hinges[self.b].add_torque(physics, self.ratio * torque);
    }
}

/// Handles of a vehicle in a world. Every body's local frame is the vehicle's frame as it stands on flat ground.
pub(super) struct VehicleBodies {
    names: Vec<String>,
    /// In the vehicle file's order.
    pub(super) bodies: Vec<RigidBodyHandle>,
    hinges: Vec<HingeBodies>,
    rows: Vec<Vec<usize>>,
    /// What a joint may part by before the vehicle counts as broken \[m\].
    most_gap_m: f64,
    couplings: Vec<CoupledHinges>,
    pub(super) wheels: Vec<Wheel>,
}

impl VehicleBodies {
    /// `rollers` has an entry per wheel, none for a ball.
    pub(super) fn insert(
        physics: &mut PhysicsWorld,
        scenario: &Scenario,
        rollers: &[Option<RollerWheel>],
        start: Pose,
    ) -> Self {
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
                .contacts_enabled(false);
            // The engine would treat a motor without stiffness and damping as rigid: it locks the hinge.
            let joint = if hinge.damping_n_m_s_rad > 0.0 {
                joint
                    .motor_model(MotorModel::ForceBased)
                    .motor_velocity(0.0, hinge.damping_n_m_s_rad)
            } else {
                joint
            };
            let (parent, child) = (find(&hinge.parent), find(&hinge.child));
            physics.insert_impulse_joint(parent, child, joint);
            hinges.push(HingeBodies {
                name: hinge.name.clone(),
                parent,
                child,
                axis,
                anchor,
            });
        }
        let hinge = |name: &str| vehicle.hinge.iter().position(|h| h.name == name).unwrap_or(0);
        let couplings = vehicle.coupling.iter().map(|c| CoupledHinges {
            a: hinge(&c.hinge_a),
            b: hinge(&c.hinge_b),
            ratio: c.ratio,
            spring: vehicle.coupling_spring(c),
        });
        let wheels = vehicle
            .wheel
            .iter()
            .zip(rollers)
            .map(|(w, rollers)| {
                let contact_frequency_hz = scenario.physics.contact_frequency_hz;
                let wheel = Wheel::insert(
                    physics,
                    w,
                    rollers.as_ref(),
                    contact_frequency_hz,
                    find(&w.body),
                    start,
                );
                // A loaded vehicle's figures are in range.
                match vehicle.motor.gear_friction(w.gear) {
                    Ok(Some(_)) => wheel.with_friction(physics),
                    _ => wheel,
                }
            })
            .collect();
        Self {
            names: vehicle.body.iter().map(|b| b.name.clone()).collect(),
            rows: vehicle.rows().into_iter().map(|row| row.wheels).collect(),
            most_gap_m: vehicle
                .wheel
                .iter()
                .map(|w| 0.1 * w.radius_m)
                .fold(f64::INFINITY, f64::min),
            bodies,
            hinges,
            couplings: couplings.collect(),
            wheels,
        }
    }

    /// The joint that has parted, and by how much \[m\].
    pub(super) fn torn(&self, physics: &PhysicsWorld) -> Option<(String, f64)> {
        let hinges = self.hinges.iter().map(|hinge| {
            let at = |handle: RigidBodyHandle| physics.bodies[handle].position() * hinge.anchor;
            (
                "hinge",
                &hinge.name,
                (at(hinge.parent) - at(hinge.child)).length(),
            )
        });
        let wheels = self
            .wheels
            .iter()
            .map(|wheel| ("wheel", &wheel.name, wheel.gap(physics)));
        hinges
            .chain(wheels)
            .find(|(_, _, gap_m)| *gap_m > self.most_gap_m)
            .map(|(kind, name, gap_m)| (format!("{kind} {name}"), gap_m))
    }

    /// Takes the torques of the last step off and puts on those that hinges hold each other with.
    pub(super) fn reset(&self, physics: &mut PhysicsWorld) {
        for handle in self.bodies.iter().chain(self.wheels.iter().map(|w| &w.driven)) {
            physics.bodies[*handle].reset_torques(false);
        }
        for coupling in &self.couplings {
            coupling.apply(physics, &self.hinges);
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
        let velocity = base.velocity_at_point(base.position().translation);
        (observation.velocity_m_s, observation.rate_rad_s) = (velocity.into(), base.angvel().into());
        observation.twist = level_twist(base.rotation() * Vector::X, velocity, base.angvel().z);
        let angles = observation
            .body_nose_up_rad
            .iter_mut()
            .zip(&mut observation.body_lean_rad);
        for (handle, (pitch, lean)) in self.bodies.iter().zip(angles) {
            let rotation = physics.bodies[*handle].rotation();
            (*pitch, *lean) = tilt(rotation * Vector::X, rotation * Vector::Z);
        }
        for (hinge, seen) in self.hinges.iter().zip(&mut observation.hinges) {
            (seen.angle_rad, seen.rate_rad_s) = hinge.angle_and_rate(physics);
        }
        for (wheel, seen) in self.wheels.iter().zip(&mut observation.wheels) {
            let (centre, velocity) = wheel.centre_world(physics);
            seen.centre_m = centre.into();
            let (across, way_m_s) = (
                wheel.across_push_world(physics),
                wheel.wheel_velocity(physics) * wheel.way_per_rad,
            );
            seen.rim_m_s = rim_speed(way_m_s, wheel.radius_m, across, wheel.carrier_rad_s(physics));
            seen.along_m_s = along_push(velocity, across, seen);
        }
        load_rows(&self.rows, observation);
    }
}

fn rigid_body(body: &Body, start: Pose) -> RigidBodyBuilder {
    let inertia = AngVector::from(body.inertia_kg_m2());
    RigidBodyBuilder::dynamic()
        .pose(start)
        .can_sleep(false)
        .additional_mass_properties(MassProperties::new(
            Vector::from(body.com_m),
            body.mass_kg,
            inertia,
        ))
}

fn pose3(pose: &Pose) -> Pose3 {
    let (t, q) = (pose.translation, pose.rotation);
    Pose3 {
        position_m: t.into(),
        rotation_xyzw: [q.x, q.y, q.z, q.w],
    }
}
