//! The ball model of an omni wheel.
//!
//! A ball on a spherical joint, driven about the axle only: about the axle it is a wheel, about the rolling direction it
//! turns freely like the rollers on a rim. Exact omni kinematics with one contact and isotropic Coulomb friction.
//!
//! A wheel that meets obstacles sideways shows them a roller: a ball of the rollers' radius rho, centred (r - rho) below
//! the axle and geared by rho / r, so that rim speed, thrust and effective mass at the rim are the wheel's. Its thrust
//! acts lower on the frame by (r - rho), and the reaction torque is smaller by just that moment.
//!
//! A mecanum wheel pushes along the axis of the roller on the ground, at an angle gamma to its rolling direction. Its ball is
//! driven about the horizontal axis across that push, and turns with cos(gamma) of the wheel's velocity: thrust, reaction
//! (rolling moment included) and effective mass are the wheel's again.

use rapier3d_f64::prelude::*;

use crate::config::{WheelContact, WheelSpec};

/// A wheel in the world.
pub(super) struct BallWheel {
    /// Its name in the vehicle file.
    pub(super) name: String,
    /// The ball.
    pub(super) ball: RigidBodyHandle,
    /// Its collider.
    pub(super) collider: ColliderHandle,
    /// The body that carries it.
    pub(super) frame: RigidBodyHandle,
    /// What the ball is driven about, in the carrier's frame: the axle, turned by the roller angle.
    axle: Vector,
    /// Centre of the axle in the carrier's frame \[m\].
    pub(super) centre: Vector,
    /// Way along the push per wheel turn \[m/rad\]: the rolling radius, times the cosine of the roller angle.
    pub(super) way_per_rad: f64,
    /// Centre of the ball in the carrier's frame \[m\].
    ball_centre: Vector,
    /// Ball turns per wheel turn, that way over the ball's radius.
    ball_per_wheel: f64,
    /// Wheel velocity over actuator velocity.
    gear: f64,
}

impl BallWheel {
    /// Adds a wheel to its carrier, whose local frame is the vehicle's.
    pub(super) fn insert(
        physics: &mut PhysicsWorld,
        spec: &WheelSpec,
        frame: RigidBodyHandle,
        start: Pose,
    ) -> Self {
        let ball_radius = match spec.contact {
            WheelContact::Ball {} => spec.radius_m,
            WheelContact::Roller { radius_m } => radius_m,
        };
        let [x, y] = spec.position_m;
        let (sin, cos) = (libm::sin(spec.roller_angle_rad), libm::cos(spec.roller_angle_rad));
        let way_per_rad = spec.radius_m * cos;
        let ball_per_wheel = way_per_rad / ball_radius;
        let ball_centre = Vector::new(x, y, ball_radius);
        // One inertia for all axes: about the axle it is the wheel's, seen through the gearing.
        let inertia = spec.inertia_kg_m2 / (ball_per_wheel * ball_per_wheel);
        let body = RigidBodyBuilder::dynamic()
            .pose(Pose::from_parts(start * ball_centre, start.rotation))
            .can_sleep(false)
            .additional_mass_properties(MassProperties::new(
                Vector::ZERO,
                spec.mass_kg,
                AngVector::splat(inertia),
            ));
        let shape = ColliderBuilder::ball(ball_radius)
            .density(0.0)
            .friction(f64::MAX) // the ground's coefficient counts: the rule is the smaller of the two
            .friction_combine_rule(CoefficientCombineRule::Min);
        let (ball, collider) = physics.insert(body, shape);
        let joint = SphericalJointBuilder::new()
            .local_anchor1(ball_centre)
            .local_anchor2(Vector::ZERO)
            .contacts_enabled(false);
        physics.insert_impulse_joint(frame, ball, joint);
        let [dx, dy] = spec.rolling_direction;
        let (push_x, push_y) = (cos * dx - sin * dy, sin * dx + cos * dy);
        let axle = Vector::new(-push_y, push_x, 0.0).normalize(); // up x push
        let centre = Vector::new(x, y, spec.radius_m);
        Self {
            name: spec.name.clone(),
            ball_centre,
            ball,
            collider,
            frame,
            axle,
            centre,
            way_per_rad,
            ball_per_wheel,
            gear: spec.gear,
        }
    }

    /// How far it has come off its axle \[m\].
    pub(super) fn gap(&self, physics: &PhysicsWorld) -> f64 {
        let axle = physics.bodies[self.frame].position() * self.ball_centre;
        (physics.bodies[self.ball].position().translation - axle).length()
    }

    /// The axle in the world.
    pub(super) fn axle_world(&self, physics: &PhysicsWorld) -> Vector {
        physics.bodies[self.frame].rotation() * self.axle
    }

    /// Turning speed of the wheel against its carrier \[rad/s\].
    pub(super) fn wheel_velocity(&self, physics: &PhysicsWorld) -> f64 {
        let relative = physics.bodies[self.ball].angvel() - physics.bodies[self.frame].angvel();
        relative.dot(self.axle_world(physics)) / self.ball_per_wheel
    }

    /// Turning speed of the actuator \[rad/s\].
    pub(super) fn actuator_velocity(&self, physics: &PhysicsWorld) -> f64 {
        self.wheel_velocity(physics) / self.gear
    }

    /// Adds an actuator torque \[N.m\] between carrier and wheel. User torques persist in rapier: the caller resets them.
    pub(super) fn apply(&self, physics: &mut PhysicsWorld, actuator_torque: f64) {
        let on_ball = self.axle_world(physics) * (actuator_torque / self.gear / self.ball_per_wheel);
        physics.bodies[self.ball].add_torque(on_ball, true);
        physics.bodies[self.frame].add_torque(-on_ball, true);
    }

    /// Position \[m\] and velocity \[m/s\] of the axle's centre.
    pub(super) fn centre_world(&self, physics: &PhysicsWorld) -> (Vector, Vector) {
        let frame = &physics.bodies[self.frame];
        let point = frame.position() * self.centre;
        (point, frame.velocity_at_point(point))
    }
}
