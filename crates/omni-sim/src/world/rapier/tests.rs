//! One wheel against one step, pushed by its axle: the closed forms of climbing.

use rapier3d_f64::prelude::*;

use super::wheel::Wheel;
use crate::config::{Vehicle, WheelContact};

const R: f64 = 0.066;
const MASS: f64 = 10.0;
const G: f64 = 9.81;

/// The force on its axle at which a wheel under a load of 10 kg leaves the ground at the riser of a step,
/// as the force grows slowly; `torque` turns the wheel. The load slides along x and z and does not turn.
fn lift_off(height: f64, friction: f64, torque: f64, most: f64) -> f64 {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::new(0.0, 0.0, -G);
    super::integrate(&mut physics.integration_parameters, 1e-4, 8, [200.0, 5.0]);
    let slab = |x: f64, top: f64| {
        ColliderBuilder::cuboid(5.0, 5.0, 1.0)
            .translation(Vector::new(x + 5.0, 0.0, top - 1.0))
            .friction(friction)
            .friction_combine_rule(CoefficientCombineRule::Min)
    };
    let ground = physics.insert_collider(slab(-10.0, 0.0), None);
    physics.insert_collider(slab(0.0, height), None);
    let vehicle = Vehicle::load("mecanum4").expect("built in");
    let mut spec = vehicle.wheel[0].clone();
    (spec.name, spec.body) = ("wheel".into(), "load".into());
    (spec.position_m, spec.rolling_direction, spec.roller_angle_rad) = ([0.0; 2], [1.0, 0.0], 0.0);
    (spec.radius_m, spec.width_m, spec.gear) = (R, None, 1.0);
    (spec.mass_kg, spec.inertia_kg_m2) = (0.2 * MASS, 0.1 * MASS * R * R);
    spec.contact = WheelContact::Ball {};
    // It touches ground and edge at once: the edge is level with the wheel at this distance ahead of the axle.
    let ahead = (2.0 * R * height - height * height).sqrt();
    let start = Pose::new(Vector::new(-ahead - 1e-5, 0.0, 0.0), AngVector::ZERO);
    let load = physics.insert_body(
        RigidBodyBuilder::dynamic()
            .pose(start)
            .locked_axes(LockedAxes::ROTATION_LOCKED | LockedAxes::TRANSLATION_LOCKED_Y)
            .can_sleep(false)
            .additional_mass_properties(MassProperties::new(
                Vector::new(0.0, 0.0, R),
                MASS * 0.8,
                AngVector::splat(1.0),
            )),
    );
    let wheel = Wheel::insert(&mut physics, &spec, None, 200.0, load, start);
    let steps = 40_000;
    let (mut since, mut last) = (0, 0.0);
    for k in 0..steps {
        let force = most * f64::from(k) / f64::from(steps);
        physics.bodies[load].reset_forces(false);
        physics.bodies[load].add_force(Vector::new(force, 0.0, 0.0), true);
        for handle in [wheel.driven, load] {
            physics.bodies[handle].reset_torques(false);
        }
        // The torque comes on in the first tenth, long before the wheel lifts off.
        wheel.apply(
            &mut physics,
            torque * (10.0 * f64::from(k) / f64::from(steps)).min(1.0),
        );
        physics.step();
        let pair = physics.contact_pair(wheel.colliders()[0], ground);
        if pair.is_some_and(|pair| pair.total_impulse_magnitude() > 0.0) {
            (since, last) = (0, force);
        } else {
            since += 1;
        }
        // A sliding wheel chatters; 10 ms in the air are no chatter.
        if since > 100 {
            return last;
        }
    }
    f64::NAN
}

#[test]
fn a_wheel_that_is_not_driven_needs_the_force_that_turns_it_about_the_edge() {
    for height in [0.01, 0.02] {
        let expected = MASS * G * (2.0_f64 * R * height - height * height).sqrt() / (R - height);
        let force = lift_off(height, 0.8, 0.0, 2.0 * expected);
        // The edge gives by some micrometres under the load, which shortens the lever: under a hundredth.
        assert!(
            (force / expected - 1.0).abs() < 0.01,
            "{height} m: {force} N, {expected} N"
        );
    }
}

#[test]
fn a_driven_wheel_needs_the_force_that_its_friction_on_the_edge_does_not_give() {
    // F / W = tan(phi - atan mu), cos phi = (r - h) / r, for a torque that lets it slide on the edge.
    for (height, friction) in [(0.03, 0.5), (0.04, 0.7)] {
        let phi = ((R - height) / R).acos();
        let expected = MASS * G * (phi - friction.atan()).tan();
        let force = lift_off(height, friction, 8.0, 2.0 * expected);
        assert!(
            (force / expected - 1.0).abs() < 0.01,
            "{height} m: {force} N, {expected} N"
        );
    }
}
