use super::*;
use crate::geometry::BodyDisplacement;
use crate::path::Trajectory;
use proptest::prelude::*;

fn follower<R: Real>(gain: f64, limit: f64) -> HolonomicFollower<R> {
    let [gain, limit] = [gain, limit].map(R::of);
    HolonomicFollower::new(FollowerConfig {
        gain_per_s: gain,
        heading_gain_per_s: gain,
        limit_m_s: limit,
        limit_rad_s: limit,
    })
    .expect("in range")
}

/// To be at the origin with this heading and velocity.
fn sample<R: Real>(yaw_rad: R, velocity: [R; 3]) -> TrajectorySample<R> {
    let mut sample = Trajectory::new(&[], &[]).at(R::ONE);
    sample.pose.yaw_rad = yaw_rad;
    // On the way, unless it rests.
    sample.done = velocity == [R::ZERO; 3];
    let [vx_m_s, vy_m_s, wz_rad_s] = velocity;
    sample.velocity = WorldTwist {
        vx_m_s,
        vy_m_s,
        wz_rad_s,
    };
    sample
}

#[test]
fn a_vehicle_that_moves_as_commanded_comes_back_with_the_time_constant_of_the_gain() {
    let (follower, stay) = (follower(2.0, 100.0), sample(0.4, [0.0; 3]));
    let mut pose = PlanarPose {
        x_m: 0.3,
        y_m: -0.2,
        yaw_rad: 1.4,
    };
    for _ in 0..500 {
        let BodyTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        } = follower.step(&stay, &pose).twist;
        pose = pose.moved_by(&BodyDisplacement::from_array(
            [vx_m_s, vy_m_s, wz_rad_s].map(|v| v * 1e-3),
        ));
    }
    // One time constant of 0.5 s later; Euler's steps of 1 ms are off by a thousandth of the exponent.
    // The heading turns meanwhile, but the way back stays straight: the correction is turned along.
    let left = (-1.0_f64).exp();
    for (found, start) in [(pose.x_m, 0.3), (pose.y_m, -0.2), (pose.yaw_rad - 0.4, 1.0)] {
        assert!((found / (start * left) - 1.0).abs() < 3e-3, "{found} {start}");
    }
}

#[test]
fn after_the_end_a_vehicle_rests_within_5_mm_and_two_seconds_later_within_15() {
    let asked = |over_s: f64, [x_m, y_m, yaw_rad]: [f64; 3]| {
        let end = Trajectory::new(&[], &[]).at(over_s);
        assert_eq!((end.done, end.over_s), (true, over_s));
        let follow = follower(2.0, 1.0).step(&end, &PlanarPose { x_m, y_m, yaw_rad });
        // What it found it says in any case.
        assert_eq!(follow.error_rad, -yaw_rad);
        follow.twist.to_array()
    };
    let rest = [0.0; 3];
    for (over_s, part) in [(0.0, 1.0), (1.99, 1.0), (2.0, 3.0), (1e5, 3.0)] {
        let (near_m, near_rad) = (part * 0.00499, part * 0.00999);
        assert_eq!(asked(over_s, [0.0, -near_m, near_rad]), rest, "{over_s} s");
        assert_eq!(
            asked(over_s, [0.6 * near_m, 0.8 * near_m, -near_rad]),
            rest,
            "{over_s} s"
        );
        let (far_m, far_rad) = (part * 0.00501, part * 0.01001);
        assert_eq!(
            asked(over_s, [-far_m, 0.0, 0.0]),
            [2.0 * far_m, 0.0, 0.0],
            "{over_s} s"
        );
        assert_eq!(
            asked(over_s, [0.0, 0.0, far_rad]),
            [0.0, 0.0, -2.0 * far_rad],
            "{over_s} s"
        );
    }
    // On the way nothing is too near to be corrected.
    let on_the_way = follower::<f64>(2.0, 1.0).step(
        &sample(0.0, [0.3, 0.0, 0.0]),
        &PlanarPose {
            x_m: -1e-4,
            y_m: 0.0,
            yaw_rad: 0.0,
        },
    );
    assert!((on_the_way.twist.vx_m_s - 0.3002).abs() < 1e-12);
}

#[test]
fn the_heading_comes_back_across_the_seam() {
    let follow = follower(2.0, 100.0).step(
        &sample(3.1, [0.0; 3]),
        &PlanarPose {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: -3.1,
        },
    );
    let shorter = 2.0 * 3.1 - core::f64::consts::TAU; // to the right, 0.083 rad
    assert!(
        (follow.error_rad - shorter).abs() < 1e-12 && (follow.twist.wz_rad_s - 2.0 * shorter).abs() < 1e-12
    );
}

#[test]
fn the_trajectory_is_driven_as_it_is_where_the_pose_is_right() {
    let follow = follower(2.0, 1.0).step(
        &sample(0.0, [0.3, -0.1, 0.5]),
        &PlanarPose {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
        },
    );
    assert_eq!(follow.twist.to_array(), [0.3, -0.1, 0.5]);
}

#[test]
fn a_pose_that_is_not_known_corrects_nothing() {
    let there = sample(0.0, [0.3, 0.0, 0.5]);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for k in 0..3 {
            let mut pose = [0.0; 3];
            pose[k] = bad;
            let [x_m, y_m, yaw_rad] = pose;
            let follow = follower(2.0, 1.0).step(&there, &PlanarPose { x_m, y_m, yaw_rad });
            assert_eq!(
                (follow.twist.to_array(), follow.error_m),
                ([0.3, 0.0, 0.5], [0.0; 2]),
                "{bad} {k}"
            );
        }
    }
}

proptest! {
    #[test]
    fn no_pose_makes_the_correction_other_than_finite_and_bounded(x_m in any::<f32>(), y_m in any::<f32>(), yaw_rad in any::<f32>()) {
        let follow = follower(3.0, 0.5).step(&sample(1.0, [0.0; 3]), &PlanarPose { x_m, y_m, yaw_rad });
        let [vx, vy, wz] = follow.twist.to_array();
        // Root, division and turning round three or four times.
        prop_assert!(vx.hypot(vy) <= 0.5 * (1.0 + 8.0 * f32::EPSILON) && wz.abs() <= 0.5, "{:?}", follow);
    }
}
