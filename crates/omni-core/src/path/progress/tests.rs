use super::*;
use crate::examples::planner;
use crate::geometry::{BodyDisplacement, BodyTwist};
use crate::path::{FollowerConfig, HolonomicFollower, PathPiece, PathSegment, Waypoint};
use proptest::prelude::*;
use std::vec::Vec;

const PERIOD_S: f64 = 1e-3;

const ROOM: ([PathSegment<f64>; 1], [PathPiece<f64>; 1]) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);

/// Three metres ahead.
fn straight((segments, pieces): &mut ([PathSegment<f64>; 1], [PathPiece<f64>; 1])) -> Trajectory<'_, f64> {
    let way = [Waypoint::at(0.0, 0.0), Waypoint::at(3.0, 0.0)];
    let planner = planner().expect("in range");
    planner.plan(&way, segments, pieces).expect("a straight way")
}

fn progress() -> PathProgress<f64> {
    PathProgress::new(ProgressConfig {
        lag_m: 0.1,
        lag_rad: 0.3,
    })
    .expect("in range")
}

/// A vehicle that does what is commanded, but for a wall in its way until a time: where it is after
/// each period, and the state.
fn driven(wall_m: f64, until_s: f64, duration_s: f64) -> (Vec<[f64; 3]>, ProgressState<f64>) {
    let mut room = ROOM;
    let path = straight(&mut room);
    let follower = HolonomicFollower::new(FollowerConfig {
        gain_per_s: 2.0,
        heading_gain_per_s: 2.0,
        limit_m_s: 0.3,
        limit_rad_s: 1.0,
    })
    .expect("in range");
    let progress = progress();
    let mut state = ProgressState::default();
    let mut pose = PlanarPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let mut seen = Vec::new();
    for period in 0..(duration_s / PERIOD_S) as usize {
        let time_s = PERIOD_S * period as f64;
        let sample = progress.step(&mut state, &path, time_s, &pose);
        let BodyTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        } = follower.step(&sample, &pose).twist;
        pose = pose.moved_by(&BodyDisplacement::from_array(
            [vx_m_s, vy_m_s, wz_rad_s].map(|v| v * PERIOD_S),
        ));
        if time_s < until_s {
            pose.x_m = pose.x_m.min(wall_m);
        }
        seen.push([sample.pose.x_m, pose.x_m, vx_m_s]);
    }
    (seen, state)
}

#[test]
fn a_vehicle_that_keeps_up_has_the_trajectory_in_every_bit() {
    let mut room = ROOM;
    let path = straight(&mut room);
    let progress = progress();
    let mut state = ProgressState::default();
    for period in 0..5000 {
        let time_s = PERIOD_S * f64::from(period);
        let planned = path.at(time_s);
        // 9 cm behind is not held up.
        let pose = PlanarPose {
            x_m: planned.pose.x_m - 0.09,
            ..planned.pose
        };
        assert_eq!(progress.step(&mut state, &path, time_s, &pose), planned);
    }
    assert_eq!(state.waited_s(), 0.0);
}

#[test]
fn it_waits_twenty_centimetres_ahead_of_a_wall_and_goes_on_without_a_jump() {
    let (seen, state) = driven(1.0, 8.0, 20.0);
    let ahead = seen.iter().map(|[wanted, is, _]| wanted - is).fold(0.0, f64::max);
    // From twice the lag on it stands; what it rolls on while its rate falls within 0.2 s from 1 m/s is 10 cm at most.
    assert!((0.15..0.31).contains(&ahead), "{ahead}");
    // It then comes to its end, and no command is more than the path's speed and the follower's limit.
    assert!((seen.last().expect("periods")[1] - 3.0).abs() < 0.006);
    let fastest = seen.iter().map(|[_, _, vx]| *vx).fold(0.0, f64::max);
    assert!(fastest < 1.31, "{fastest}");
    // It was held up for most of the 7 s at the wall, and is as late as that.
    assert!((5.0..8.0).contains(&state.waited_s()), "{}", state.waited_s());
    assert_eq!((state.held_up_s(), state.rate()), (0.0, 1.0));
}

#[test]
fn a_vehicle_that_is_stuck_for_good_is_held_up_for_ever() {
    let (seen, state) = driven(1.0, f64::INFINITY, 20.0);
    assert!(state.held_up_s() > 15.0, "{}", state.held_up_s());
    // It pushes on by the follower's correction alone.
    assert!(seen.last().expect("periods")[2] < 0.31);
}

#[test]
fn without_a_pose_it_is_the_trajectory_and_time_that_goes_back_stands() {
    let mut room = ROOM;
    let path = straight(&mut room);
    let progress = progress();
    let lost = PlanarPose {
        x_m: f64::NAN,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let mut state = ProgressState::default();
    assert_eq!(progress.step(&mut state, &path, 1.5, &lost), path.at(1.5));
    assert_eq!(progress.step(&mut state, &path, 1.0, &lost), path.at(1.5));
    assert_eq!(progress.step(&mut state, &path, f64::NAN, &lost), path.at(1.5));
}

proptest! {
    #[test]
    fn whatever_comes_its_time_never_goes_back_nor_beyond_the_clock(
        steps in prop::collection::vec((0.0..0.5_f64, -5.0..5.0_f64, -4.0..4.0_f64), 1..60)
    ) {
        let mut room = ROOM;
        let (path, progress) = (straight(&mut room), progress());
        let (mut state, mut clock_s, mut before_s) = (ProgressState::default(), 0.0, 0.0);
        for (passed_s, x_m, yaw_rad) in steps {
            clock_s += passed_s;
            let sample = progress.step(&mut state, &path, clock_s, &PlanarPose { x_m, y_m: 0.0, yaw_rad });
            // A step of rounding: 60 sums of numbers below 30.
            prop_assert!(sample.time_s >= before_s - 1e-12 && sample.time_s <= clock_s + 1e-12);
            prop_assert!((0.0..=1.0).contains(&state.rate()) && state.waited_s() >= 0.0);
            before_s = sample.time_s;
        }
    }
}
