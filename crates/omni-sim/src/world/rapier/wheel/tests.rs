//! Contacts of barrels with boxes against a dense search, bearings that part, and a ball on ground that leans.

use rapier3d_f64::parry::shape::{Cuboid, SupportMap};
use rapier3d_f64::prelude::*;

use super::{FreshContacts, Wheel};
use crate::config::{Override, Scenario};
use crate::world::barrel::{BarrelShape, touch_box};

fn scenario() -> Scenario {
    let rollers = Override::new("physics.wheel_model", "rollers");
    Scenario::load("flat", &[rollers]).expect("built in")
}

fn barrel() -> BarrelShape {
    BarrelShape(scenario().rollers(0).expect("rollers").barrel)
}

/// The largest gap that a plane leaves between a box and a barrel at a pose, over planes around the
/// box's edge between x and z.
fn searched(cuboid: &Cuboid, barrel: &BarrelShape, pose: &Pose) -> f64 {
    let gap = |angle: f64| {
        let normal = Vector::new(angle.cos(), 0.0, angle.sin());
        let inward = pose.rotation.inverse() * -normal;
        let nearest = *pose * (barrel.local_support_point(inward) + inward * barrel.0.edge_m());
        let half = cuboid.half_extents;
        nearest.dot(normal) - (normal.x.abs() * half.x + normal.z.abs() * half.z)
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    (0..=100_000)
        .map(|k| gap(quarter * f64::from(k) / 1e5))
        .fold(f64::MIN, f64::max)
}

#[test]
fn a_barrel_touches_faces_and_edges_where_a_dense_search_finds_it_also_deep_inside() {
    let (cuboid, barrel) = (Cuboid::new(Vector::new(0.5, 0.5, 0.5)), barrel());
    let edge = barrel.0.edge_m();
    for (x, z) in [
        (0.2, 0.5061),            // over a face
        (0.2, 0.5 + 0.2 * edge),  // deep in it
        (0.505, 0.504),           // off the edge, in both directions
        (0.5055, 0.49),           // beside it
        (0.5 - edge, 0.5 - edge), // the edge is inside
        (0.52, 0.5),              // its end is over the edge
    ] {
        for (yaw, roll) in [(0.0, 0.0), (0.7, 0.0), (1.3, 0.4), (0.3, -0.9)] {
            let turned = Rotation::from_rotation_z(yaw) * Rotation::from_rotation_y(roll);
            let pose = Pose::from_parts(Vector::new(x, 0.05, z), turned);
            let touch = touch_box(&cuboid, &barrel, &pose);
            let expected = searched(&cuboid, &barrel, &pose);
            // A step of the search is 16 urad: it misses the largest gap by some 5 mm of lever times that squared.
            assert!(
                (touch.distance_m - expected).abs() < 1e-9,
                "({x}, {z}), yaw {yaw}, roll {roll}: {} instead of {expected}",
                touch.distance_m
            );
            // The points are that far apart along the normal, and the normals are opposite.
            let on_barrel = pose * touch.points[1];
            let along = (on_barrel - touch.points[0]).dot(touch.normals[0]);
            assert!((along - touch.distance_m).abs() < 1e-12);
            assert!((pose.rotation * touch.normals[1] + touch.normals[0]).length() < 1e-12);
        }
    }
}

#[test]
fn a_roller_off_its_bearing_is_a_gap_of_its_wheel() {
    let scenario = scenario();
    let mut physics = PhysicsWorld::new();
    let carrier = physics.insert_body(RigidBodyBuilder::dynamic());
    let spec = &scenario.vehicle().wheel[0];
    let wheel = Wheel::insert(
        &mut physics,
        spec,
        scenario.rollers(0).as_ref(),
        200.0,
        carrier,
        Pose::IDENTITY,
    );
    assert!(wheel.gap(&physics) < 1e-12);
    let (roller, _) = wheel.borne[3];
    let moved = physics.bodies[roller].position().translation + Vector::new(0.0, 0.0, 0.01);
    physics.bodies[roller].set_translation(moved, true);
    assert!((wheel.gap(&physics) - 0.01).abs() < 1e-12);
}

/// Part of the acceleration without ground that a torque gives a wheel of a vehicle that is blocked, where
/// the ground rises by an angle towards an azimuth, counter-clockwise from the vehicle's forward \[rad\].
fn turns_though_blocked(vehicle: &str, model: &str, wheel: usize, [rise, azimuth]: [f64; 2]) -> f64 {
    let keys =
        [("vehicle", vehicle), ("physics.wheel_model", model)].map(|(key, value)| Override::new(key, value));
    let scenario = Scenario::load("flat", &keys).expect("built in");
    let spec = &scenario.vehicle().wheel[wheel];
    let rollers = scenario.rollers(wheel);
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::new(0.0, 0.0, -9.81);
    if rollers.is_some() {
        physics.narrow_phase.set_query_dispatcher(FreshContacts);
    }
    let stiffer = rollers.map_or(1.0, |built| (spec.mass_kg / built.roller_mass_kg).sqrt());
    super::super::integrate(
        &mut physics.integration_parameters,
        5e-5,
        8,
        [200.0, 5.0].map(|x| x * stiffer),
    );
    let load = physics.insert_body(
        RigidBodyBuilder::dynamic()
            .locked_axes(
                LockedAxes::ROTATION_LOCKED
                    | LockedAxes::TRANSLATION_LOCKED_X
                    | LockedAxes::TRANSLATION_LOCKED_Y,
            )
            .can_sleep(false)
            .additional_mass_properties(MassProperties::new(Vector::ZERO, 10.0, AngVector::splat(1.0))),
    );
    let wheel = Wheel::insert(&mut physics, spec, rollers.as_ref(), 200.0, load, Pose::IDENTITY);
    let (centre, _) = wheel.centre_world(&physics);
    let turned = Rotation::from_rotation_z(azimuth) * Rotation::from_rotation_y(-rise);
    let ground = Pose::from_parts(
        centre - turned * Vector::new(0.0, 0.0, spec.radius_m + 1.0),
        turned,
    );
    physics.insert_collider(
        ColliderBuilder::cuboid(1.0, 1.0, 1.0)
            .position(ground)
            .friction(1.5)
            .friction_combine_rule(CoefficientCombineRule::Min),
        None,
    );
    // It settles for 0.1 s; then the torque works for as long.
    let (periods, torque) = (2000, 0.3);
    for k in 0..2 * periods {
        for handle in [wheel.driven, load] {
            physics.bodies[handle].reset_torques(false);
        }
        if k >= periods {
            wheel.apply(&mut physics, torque);
        }
        physics.step();
    }
    wheel.wheel_velocity(&physics) / (torque / spec.inertia_kg_m2 * f64::from(periods) * 5e-5)
}

#[test]
fn a_blocked_ball_turns_by_the_squared_sine_of_its_axis_to_the_normal_and_no_roller() {
    let degrees = |angle: f64| angle.to_radians();
    // Free to spin about the normal n alone, a ball driven about a gets tau (a.n)^2 / I: nothing if the normal is in
    // its plane.
    for (vehicle, rise, azimuth) in [
        ("omni3", 0.0, 0.0),
        ("omni3", 40.0, 90.0), // wheel 1 rolls to the left: straight up, and in its plane
        ("omni3", 10.0, 0.0),  // along its axle
        ("omni3", 40.0, 60.0),
        ("mecanum4", 0.0, 0.0),
        ("mecanum4", 40.0, 0.0), // straight ahead: its ball is driven about an axis at 45 degrees to that
        ("mecanum4", 40.0, 90.0),
        ("mecanum4", 10.0, 0.0),
    ] {
        let spec = &Scenario::load("flat", &[Override::new("vehicle", vehicle)])
            .expect("built in")
            .vehicle()
            .wheel[0]
            .clone();
        let [dx, dy] = spec.rolling_direction;
        let driven = dy.atan2(dx) + spec.roller_angle_rad + std::f64::consts::FRAC_PI_2;
        let sine = degrees(rise).sin() * (degrees(azimuth) - driven).cos();
        let part = turns_though_blocked(vehicle, "ball", 0, [rise, azimuth].map(degrees));
        // What the contact gives before it holds is less than a thousandth.
        assert!(
            (part - sine * sine).abs() < 1e-3,
            "{vehicle}, {rise} deg towards {azimuth}: {part}, expected {}",
            sine * sine
        );
    }
    // A roller's spin does not turn its wheel. 40 degrees are from one of nine rollers to the next.
    for (rise, azimuth) in [(0.0, 0.0), (40.0, 0.0)] {
        let part = turns_though_blocked("mecanum4", "rollers", 0, [rise, azimuth].map(degrees));
        assert!(part.abs() < 2e-3, "rollers, {rise} deg towards {azimuth}: {part}");
    }
}
