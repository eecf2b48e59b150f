//! The ball model of an omni wheel.
//!
//! A ball on a spherical joint, driven about the axle only: about the axle it is a wheel, about the rolling direction
//! it turns freely like the rollers on a rim. Exact omni kinematics with one contact and isotropic Coulomb friction.
//!
//! A wheel that meets obstacles laterally presents a roller to them: a ball of the rollers' radius rho, centred (r -
//! rho) below the axle and geared by rho / r, so that rim speed, thrust and effective mass at the rim are the wheel's.
//! Its thrust acts lower on the frame by (r - rho), and the reaction torque is smaller by just that moment.
//!
//! A mecanum wheel pushes along the axis of the roller on the ground, at an angle gamma to its rolling
//! direction. Its ball is driven about the horizontal axis across that push, and turns with cos(gamma) of
//! the wheel's velocity: thrust, reaction (rolling moment included) and effective mass are the wheel's
//! again: on level ground. On an edge a ball spins about a normal that leans towards its driven axis instead
//! of pushing: docs/physics.md says where a ball is the wheel, `config::Scenario::beyond_balls` where not.

use rapier3d_f64::prelude::*;

use super::{Wheel, directions, lower_m, touching};
use crate::config::WheelSpec;

/// Adds a wheel to its carrier, whose local frame is the vehicle's.
pub(super) fn insert(
    physics: &mut PhysicsWorld,
    spec: &WheelSpec,
    contact_frequency_hz: f64,
    carrier: RigidBodyHandle,
    start: Pose,
) -> Wheel {
    let ball_radius = spec.contact_radius_m();
    let [x, y] = spec.position_m;
    let way_per_rad = spec.radius_m * libm::cos(spec.roller_angle_rad);
    let ball_per_wheel = way_per_rad / ball_radius;
    let lower_m = lower_m(spec, contact_frequency_hz);
    let ball_centre = Vector::new(x, y, ball_radius - lower_m);
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
    let (ball, collider) = physics.insert(body, touching(ColliderBuilder::ball(ball_radius)));
    let joint = SphericalJointBuilder::new()
        .local_anchor1(ball_centre)
        .local_anchor2(Vector::ZERO)
        .contacts_enabled(false);
    physics.insert_impulse_joint(carrier, ball, joint);
    let [_, push] = directions(spec);
    let across_push = Vector::Z.cross(push);
    Wheel {
        name: spec.name.clone(),
        seat: ball_centre,
        driven: ball,
        borne: Vec::new(),
        colliders: vec![collider],
        carrier,
        drive_axis: across_push,
        across_push,
        centre: Vector::new(x, y, spec.radius_m - lower_m),
        radius_m: spec.radius_m,
        way_per_rad,
        driven_per_wheel: ball_per_wheel,
        gear: spec.gear,
        friction: None,
    }
}
