//! Contacts of barrels with boxes against a dense search, and bearings that part.

use rapier3d_f64::parry::shape::{Cuboid, SupportMap};
use rapier3d_f64::prelude::*;

use super::Wheel;
use super::barrel::{BarrelShape, touch_box};
use crate::config::{Override, Scenario};

fn scenario() -> Scenario {
    let rollers = Override::new("physics.wheel_model", "rollers");
    Scenario::load("flat", &[rollers]).expect("built in")
}

fn barrel() -> BarrelShape {
    BarrelShape(scenario().rollers(0).expect("rollers").barrel)
}

/// The largest gap that a plane leaves between a box and a barrel at a pose, over planes around the box's edge between x and z.
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
    let frame = physics.insert_body(RigidBodyBuilder::dynamic());
    let spec = &scenario.vehicle().wheel[0];
    let wheel = Wheel::insert(
        &mut physics,
        spec,
        scenario.rollers(0).as_ref(),
        frame,
        Pose::IDENTITY,
    );
    assert!(wheel.gap(&physics) < 1e-12);
    let (roller, _) = wheel.borne[3];
    let moved = physics.bodies[roller].position().translation + Vector::new(0.0, 0.0, 0.01);
    physics.bodies[roller].set_translation(moved, true);
    assert!((wheel.gap(&physics) - 0.01).abs() < 1e-12);
}
