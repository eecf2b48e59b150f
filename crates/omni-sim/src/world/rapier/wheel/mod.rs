//! Wheels in the world, whichever way their rollers are modelled.
//!
//! Both models are a body that is driven about an axle, and colliders that touch the ground: one
//! ball on the driven body itself ([`ball`]), or rollers on bearings around it ([`rollers`]).

mod ball;
mod contacts;
mod insert;
mod rollers;
#[cfg(test)]
mod tests;

use rapier3d_f64::prelude::*;

pub(super) use contacts::FreshContacts;

use crate::config::WheelSpec;

/// A wheel in the world.
pub(super) struct Wheel {
    /// Its name in the vehicle file.
    pub(super) name: String,
    /// The driven body: the ball, or the hub that carries the rollers.
    pub(super) driven: RigidBodyHandle,
    /// What the driven body bears, and where in its frame \[m\]: rollers.
    borne: Vec<(RigidBodyHandle, Vector)>,
    /// All that may touch the ground.
    colliders: Vec<ColliderHandle>,
    /// The body that carries it.
    carrier: RigidBodyHandle,
    /// What the driven body is driven about, in the carrier's frame.
    drive_axis: Vector,
    /// Across the push, in the carrier's frame: the axle, turned by the roller angle.
    across_push: Vector,
    /// Bearing of the driven body, in the carrier's frame \[m\].
    seat: Vector,
    /// Centre of the axle in the carrier's frame \[m\].
    centre: Vector,
    /// From the axle to the ground \[m\].
    pub(super) radius_m: f64,
    /// Way along the push per wheel turn \[m/rad\]: the rolling radius, times the cosine of the roller angle.
    pub(super) way_per_rad: f64,
    /// Turns of the driven body per wheel turn.
    driven_per_wheel: f64,
    /// Wheel velocity over actuator velocity.
    gear: f64,
    /// The joint that is its gear's dry friction, where it has some.
    friction: Option<ImpulseJointHandle>,
}

impl Wheel {
    /// How far the driven body, or what it bears, has come off its seat \[m\].
    pub(super) fn gap(&self, physics: &PhysicsWorld) -> f64 {
        let off = |carrier: RigidBodyHandle, seat: Vector, body: RigidBodyHandle| {
            let seat = physics.bodies[carrier].position() * seat;
            (physics.bodies[body].position().translation - seat).length()
        };
        let borne = self
            .borne
            .iter()
            .map(|(body, seat)| off(self.driven, *seat, *body));
        borne.fold(off(self.carrier, self.seat, self.driven), f64::max)
    }

    /// Makes a world as it was read out of a snapshot whole again, with the shapes of one that was
    /// built of the same scenario.
    ///
    /// The engine's files hold neither shapes of ours nor who finds their contacts. What else depends on a
    /// shape is in them, and must not be found anew: so the engine does not know of the change. Its marks of it
    /// stay on the colliders and in later snapshots; they are not read as long as contacts are not recycled, no
    /// collider is changed while a world runs, and bodies do not move continuously (CCD): all three hold.
    pub(super) fn put_rollers_back(&self, physics: &mut PhysicsWorld, built: &ColliderSet) {
        if self.borne.is_empty() {
            return;
        }
        physics.narrow_phase.set_query_dispatcher(FreshContacts);
        for handle in &self.colliders {
            physics.colliders[*handle].set_shape(built[*handle].shared_shape().clone());
        }
        physics.colliders.take_modified();
    }

    /// All that may touch the ground.
    pub(super) fn colliders(&self) -> &[ColliderHandle] {
        &self.colliders
    }

    /// The axis across the push, in the world: the axle, or of a mecanum wheel the horizontal axis across its push.
    pub(super) fn across_push_world(&self, physics: &PhysicsWorld) -> Vector {
        physics.bodies[self.carrier].rotation() * self.across_push
    }

    /// Turning speed of the wheel against its carrier \[rad/s\].
    pub(super) fn wheel_velocity(&self, physics: &PhysicsWorld) -> f64 {
        let relative = physics.bodies[self.driven].angvel() - physics.bodies[self.carrier].angvel();
        relative.dot(self.drive_axis_world(physics)) / self.driven_per_wheel
    }

    /// Angular velocity of the carrier \[rad/s\], in the world.
    pub(super) fn carrier_rad_s(&self, physics: &PhysicsWorld) -> Vector {
        physics.bodies[self.carrier].angvel()
    }

    /// Turning speed of the actuator \[rad/s\].
    pub(super) fn actuator_velocity(&self, physics: &PhysicsWorld) -> f64 {
        self.wheel_velocity(physics) / self.gear
    }

    /// Gives its gear dry friction, [`Wheel::hold`]: a motor that wants no turning, and has only so much torque.
    pub(super) fn with_friction(self, physics: &mut PhysicsWorld) -> Self {
        let along = Pose::from_parts(
            Vector::ZERO,
            Rotation::from_rotation_arc(Vector::X, self.drive_axis),
        );
        // No stiffness and no damping: the engine treats it as rigid.
        let joint = GenericJointBuilder::new(JointAxesMask::empty())
            .local_frame1(along)
            .contacts_enabled(false)
            .motor_velocity(JointAxis::AngX, 0.0, 0.0)
            .motor_max_force(JointAxis::AngX, 0.0);
        let friction = physics.insert_impulse_joint(self.carrier, self.driven, joint);
        Self {
            friction: Some(friction),
            ..self
        }
    }

    /// Sets the dry friction between carrier and wheel \[N.m\], about the axle, of one that has some.
    pub(super) fn hold(&self, physics: &mut PhysicsWorld, most_n_m: f64) {
        let most_n_m = most_n_m / self.driven_per_wheel;
        let Some(handle) = self.friction else {
            return;
        };
        let is = |joint: &ImpulseJoint| joint.data.motors[JointAxis::AngX as usize].max_force == most_n_m;
        if physics.impulse_joints.get(handle).is_some_and(is) {
            return; // a change makes the engine set up all joints anew
        }
        if let Some(joint) = physics.impulse_joints.get_mut(handle, false) {
            joint.data.set_motor_max_force(JointAxis::AngX, most_n_m);
        }
    }

    /// Adds an actuator torque \[N.m\] between carrier and wheel. User torques persist in rapier:
    /// the caller resets them.
    pub(super) fn apply(&self, physics: &mut PhysicsWorld, actuator_torque: f64) {
        let on_driven =
            self.drive_axis_world(physics) * (actuator_torque / self.gear / self.driven_per_wheel);
        physics.bodies[self.driven].add_torque(on_driven, true);
        physics.bodies[self.carrier].add_torque(-on_driven, true);
    }

    /// Position \[m\] and velocity \[m/s\] of the axle's centre.
    pub(super) fn centre_world(&self, physics: &PhysicsWorld) -> (Vector, Vector) {
        let carrier = &physics.bodies[self.carrier];
        let point = carrier.position() * self.centre;
        (point, carrier.velocity_at_point(point))
    }

    fn drive_axis_world(&self, physics: &PhysicsWorld) -> Vector {
        physics.bodies[self.carrier].rotation() * self.drive_axis
    }
}

/// How much lower than the others a wheel is mounted \[m\], so that its contact presses by its preload more.
fn lower_m(spec: &WheelSpec, contact_frequency_hz: f64) -> f64 {
    spec.preload_n / spec.contact_stiffness_n_m(contact_frequency_hz)
}

/// A wheel's rolling direction and push, unit vectors in the carrier's frame.
fn directions(spec: &WheelSpec) -> [Vector; 2] {
    let [dx, dy] = spec.rolling_direction;
    let (sin, cos) = (libm::sin(spec.roller_angle_rad), libm::cos(spec.roller_angle_rad));
    let rolling = Vector::new(dx, dy, 0.0).normalize();
    let push = Vector::new(cos * dx - sin * dy, sin * dx + cos * dy, 0.0).normalize();
    [rolling, push]
}

/// What every part that touches the ground has in common.
fn touching(shape: ColliderBuilder) -> ColliderBuilder {
    shape
        .density(0.0)
        .friction(f64::MAX) // the ground's coefficient counts: the rule is the smaller of the two
        .friction_combine_rule(CoefficientCombineRule::Min)
}
