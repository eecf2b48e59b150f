//! Limits from one end of their ranges to the other.

use super::*;
use crate::estimate::estimator::tests::Random;

/// Of numbers between two powers of ten each power as often as any.
fn any<R: Real>(random: &mut Random, low: f64, high: f64) -> R {
    R::of(10.0_f64.powf(low + 0.5 * (random.next() + 1.0) * (high - low)))
}

fn drawn<R: Real>(random: &mut Random) -> PathLimits<R, 4> {
    let mut limits = limits();
    let mut of = || any(random, -3.0, 6.0);
    for motion in [&mut limits.linear, &mut limits.yaw] {
        *motion = MotionLimits {
            velocity: of(),
            acceleration: of(),
            deceleration: of(),
            jerk: of(),
        };
    }
    limits.fastest = BodyTwist::from_array([of(), of(), of()]);
    limits.quickest = BodyTwist::from_array([of(), of(), of()]);
    limits.speeds_rad_s = [of(); 4];
    (limits.body.mass_kg, limits.body.yaw_kg_m2) = (any(random, -300.0, 300.0), any(random, -300.0, 300.0));
    limits
}

/// Every plan ends, and turns no wheel faster than it may: how many there are, and how many were rejected.
fn kept<R: Real>(runs: u32) -> [u32; 2] {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let [mut planned, mut refused] = [0; 2];
    let ways = [(1.0, 0.5), (-2.0, 3.0)].map(|(x, y)| Waypoint::at(R::of(x), R::of(y)));
    let spline = Waypoint {
        shape: WayShape::Spline,
        ..ways[1]
    };
    for _ in 0..runs {
        let limits = drawn::<R>(&mut random);
        let planner = planner_within(limits);
        let plan = match Plan::try_of(&planner, &[Waypoint::at(R::ZERO, R::ZERO), ways[0], spline]) {
            Ok(plan) => plan,
            Err(error) => {
                let said = "up to 1000000: the limits are too small for the way there";
                assert_eq!((error.parameter, error.allowed), ("waypoint.time_s", said));
                refused += 1;
                continue;
            }
        };
        planned += 1;
        let lasts = plan.trajectory().duration_s();
        assert!(lasts > R::ZERO && lasts <= R::of(1e6), "{lasts:?}: {limits:?}");
        for k in 0..=200 {
            let sample = plan.trajectory().at(lasts * R::of(f64::from(k) / 200.0));
            for (turn, most) in planner.velocities(&sample).rad_s.iter().zip(limits.speeds_rad_s) {
                // A share of 0.9 and, between the points that are looked at, a hundredth more.
                assert!(
                    turn.abs() <= R::of(0.91) * most,
                    "{turn:?} of {most:?}: {limits:?}"
                );
            }
        }
    }
    [planned, refused]
}

#[test]
fn whatever_the_limits_a_plan_ends_and_turns_no_wheel_too_fast() {
    let [planned, refused] = kept::<f64>(3000);
    assert!(planned > 500 && refused > 500, "{planned} {refused}");
}

#[test]
fn limits_next_to_nothing_are_refused_with_their_range() {
    let refused = |change: fn(&mut PathLimits<f64, 4>, f64), least: f64| {
        let layout = WheelLayout::mecanum4(0.5, 0.4, 0.076).expect("valid");
        let kinematics = Kinematics::new(&layout).expect("valid");
        let with = |value| {
            let mut limits = limits();
            change(&mut limits, value);
            TrajectoryPlanner::new(&kinematics, limits)
        };
        assert!(with(1e-3).is_ok());
        let error = with(least).expect_err("refused");
        (error.parameter, error.allowed)
    };
    let speed = "0, or 0.001 or more (infinity: no limit)";
    let change = "0.001 or more (infinity: no limit)";
    let finite = "0.001 or more, finite";
    for least in [5e-324, 1.5e-4, -1.0, f64::NAN] {
        for (found, expected) in [
            (
                refused(|l, v| l.linear.velocity = v, least),
                ("linear.velocity", speed),
            ),
            (refused(|l, v| l.yaw.velocity = v, least), ("yaw.velocity", speed)),
            (refused(|l, v| l.fastest.vy_m_s = v, least), ("fastest", speed)),
            (
                refused(|l, v| l.linear.acceleration = v, least),
                ("linear.acceleration", finite),
            ),
            (
                refused(|l, v| l.yaw.deceleration = v, least),
                ("yaw.deceleration", finite),
            ),
            (
                refused(|l, v| l.speeds_rad_s[2] = v, least),
                ("speeds_rad_s", finite),
            ),
            (refused(|l, v| l.linear.jerk = v, least), ("linear.jerk", change)),
            (refused(|l, v| l.yaw.jerk = v, least), ("yaw.jerk", change)),
            (
                refused(|l, v| l.quickest.wz_rad_s = v, least),
                ("quickest", change),
            ),
        ] {
            assert_eq!(found, expected, "{least}");
        }
    }
}
