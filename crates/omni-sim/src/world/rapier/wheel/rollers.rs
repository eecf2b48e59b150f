//! The reference model of an omni or mecanum wheel: a hub, and every roller a body on a bearing of its own.
//!
//! Rollers touch the ground, and wheels that are balls, but not each other. The hub has what the
//! rollers leave of the wheel's mass and inertia, and touches nothing.

use rapier3d_f64::prelude::*;

use super::{Wheel, directions, lower_m, touching};
use crate::config::{RollerWheel, WheelSpec};
use crate::world::barrel::BarrelShape;

/// Rollers are in this group and touch whatever is not.
const ROLLERS: Group = Group::GROUP_2;

/// Adds a wheel to its carrier, whose local frame is the vehicle's.
pub(super) fn insert(
    physics: &mut PhysicsWorld,
    spec: &WheelSpec,
    built: &RollerWheel,
    contact_frequency_hz: f64,
    carrier: RigidBodyHandle,
    start: Pose,
) -> Wheel {
    let [x, y] = spec.position_m;
    let [rolling, push] = directions(spec);
    let axle = Vector::Z.cross(rolling);
    let centre = Vector::new(x, y, spec.radius_m - lower_m(spec, contact_frequency_hz));
    let hub =
        physics.insert_body(hub(spec, built, axle).pose(Pose::from_parts(start * centre, start.rotation)));
    let bearing = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
        .local_axis1(axle)
        .local_axis2(axle)
        .local_anchor1(centre)
        .local_anchor2(Vector::ZERO)
        .contacts_enabled(false);
    physics.insert_impulse_joint(carrier, hub, bearing);

    let [axial, across] = built.roller_inertia_kg_m2();
    let shape = SharedShape::new(BarrelShape(built.barrel));
    let collider = touching(ColliderBuilder::new(shape)).collision_groups(InteractionGroups::new(
        ROLLERS,
        !ROLLERS,
        InteractionTestMode::And,
    ));
    // The roller on the ground has its axis along the push; the others are turned about the axle.
    let on_ground = turn(Vector::Z, libm::atan2(push.y, push.x));
    let (mut colliders, mut borne) = (Vec::new(), Vec::new());
    for (angle, along) in built.places() {
        let about_axle = turn(axle, angle);
        let middle = about_axle * Vector::new(0.0, 0.0, -built.pitch_radius_m) + axle * along;
        let local = Pose::from_parts(middle, about_axle * on_ground);
        let body = RigidBodyBuilder::dynamic()
            .pose(start * Pose::from_parts(centre, Rotation::IDENTITY) * local)
            .can_sleep(false)
            .additional_mass_properties(MassProperties::new(
                Vector::ZERO,
                built.roller_mass_kg,
                AngVector::new(axial, across, across),
            ));
        let (roller, handle) = physics.insert(body, collider.clone());
        let mut bearing = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
            .local_frame1(local)
            .local_frame2(Pose::IDENTITY)
            .contacts_enabled(false);
        if built.friction_n_m_s_rad > 0.0 {
            bearing = bearing
                .motor_model(JointAxis::AngX, MotorModel::ForceBased)
                .motor_velocity(JointAxis::AngX, 0.0, built.friction_n_m_s_rad);
        }
        physics.insert_impulse_joint(hub, roller, bearing);
        colliders.push(handle);
        borne.push((roller, middle));
    }
    Wheel {
        name: spec.name.clone(),
        seat: centre,
        driven: hub,
        borne,
        colliders,
        carrier,
        drive_axis: axle,
        across_push: Vector::Z.cross(push),
        centre,
        radius_m: spec.radius_m,
        way_per_rad: spec.radius_m * libm::cos(spec.roller_angle_rad),
        driven_per_wheel: 1.0,
        gear: spec.gear,
        friction: None,
    }
}

/// What the rollers leave of the wheel: a thin disc.
fn hub(spec: &WheelSpec, built: &RollerWheel, axle: Vector) -> RigidBodyBuilder {
    let rollers = (built.count * built.rows) as f64;
    let about_axle = spec.inertia_kg_m2 - built.rollers_inertia_kg_m2();
    // The y axis of a frame turned about the vertical is the axle.
    let frame = turn(Vector::Z, libm::atan2(-axle.x, axle.y));
    RigidBodyBuilder::dynamic()
        .can_sleep(false)
        .additional_mass_properties(MassProperties::with_principal_inertia_frame(
            Vector::ZERO,
            spec.mass_kg - rollers * built.roller_mass_kg,
            AngVector::new(0.5 * about_axle, about_axle, 0.5 * about_axle),
            frame,
        ))
}

/// A turn about a unit vector by an angle \[rad\], the same on every machine.
fn turn(axis: Vector, angle: f64) -> Rotation {
    let (sin, cos) = (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
    Rotation::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos)
}
