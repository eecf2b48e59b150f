use super::*;
use crate::shaping::limits::tests::wild;
use proptest::prelude::*;
use std::vec::Vec;

const NONE: f64 = f64::INFINITY;
const PERIOD: f64 = 0.1;

fn twist<R: Real>(components: [f64; 3]) -> BodyTwist<R> {
    BodyTwist::from_array(components.map(R::of))
}

fn motion<R: Real>(limits: MotionLimits<f64>) -> MotionLimits<R> {
    MotionLimits {
        velocity: R::of(limits.velocity),
        acceleration: R::of(limits.acceleration),
        deceleration: R::of(limits.deceleration),
        jerk: R::of(limits.jerk),
    }
}

fn along<R: Real>([linear, yaw]: [MotionLimits<f64>; 2]) -> TwistLimiter<R> {
    let limits = TwistLimits::AlongMotion {
        linear: motion(linear),
        yaw: motion(yaw),
    };
    TwistLimiter::new(limits, R::of(PERIOD)).expect("valid")
}

/// Follows `targets`, each for `hold` periods, and returns all twists from the start on, which is steady.
fn follow<R: Real>(
    limiter: &TwistLimiter<R>,
    start: [f64; 3],
    targets: &[[f64; 3]],
    hold: usize,
) -> Vec<[f64; 3]> {
    let mut state = TwistLimiterState::at(&twist(start));
    let mut twists = Vec::from([state.twist()]);
    for target in targets {
        twists.extend((0..hold).map(|_| limiter.step(&mut state, &twist(*target))));
    }
    twists.into_iter().map(|t| t.to_array().map(R::as_f64)).collect()
}

fn epsilon<R: Real>() -> f64 {
    R::default_epsilon().as_f64()
}

fn length<const N: usize>(v: [f64; N]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn minus<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    core::array::from_fn(|i| a[i] - b[i])
}

/// Are speeds, steps and changes of steps of one group within its limits?
fn group_within_limits<R: Real, const N: usize>(
    limits: MotionLimits<f64>,
    velocities: &[[f64; N]],
) -> Result<(), TestCaseError> {
    let largest = velocities.iter().map(|v| length(*v)).fold(0.0, f64::max);
    // A step is safe to 64 units in the last place; a velocity is rounded by one, differences of differences by four.
    let rounding = |limit: f64| epsilon::<R>() * (64.0 * limit + 4.0 * largest);
    let (up, down) = (limits.acceleration * PERIOD, limits.deceleration * PERIOD);
    let mut last = [0.0; N];
    for pair in velocities.windows(2) {
        let step = minus(pair[1], pair[0]);
        let growth = length(pair[1]) - length(pair[0]);
        prop_assert!(
            length(pair[1]) <= limits.velocity + rounding(limits.velocity),
            "{pair:?}"
        );
        prop_assert!(
            growth <= up + rounding(up),
            "{pair:?} grows by {growth}, {up} allowed"
        );
        prop_assert!(
            -growth <= down + rounding(down),
            "{pair:?} shrinks by {growth}, {down} allowed"
        );
        // A period that turns round does part of its step at either limit.
        prop_assert!(length(step) <= up.max(down) + rounding(up.max(down)), "{pair:?}");
        let jerk = length(minus(step, last)) / PERIOD / PERIOD;
        let rounding = rounding(limits.jerk * PERIOD * PERIOD) / PERIOD / PERIOD;
        prop_assert!(
            jerk <= limits.jerk + rounding,
            "{pair:?} after a step {last:?}: {jerk}"
        );
        last = step;
    }
    Ok(())
}

fn within_limits<R: Real>(
    limits: [MotionLimits<f64>; 2],
    targets: &[[f64; 3]],
    hold: usize,
) -> Result<(), TestCaseError> {
    let twists = follow(&along::<R>(limits), [0.0; 3], targets, hold);
    let linear: Vec<_> = twists.iter().map(|[x, y, _]| [*x, *y]).collect();
    let yaw: Vec<_> = twists.iter().map(|[_, _, w]| [*w]).collect();
    group_within_limits::<R, 2>(limits[0], &linear)?;
    group_within_limits::<R, 1>(limits[1], &yaw)
}

/// From rest to `target`: along its direction, never back, never beyond, and there at last.
fn keeps_direction<R: Real>(limits: [MotionLimits<f64>; 2], target: [f64; 3]) -> Result<(), TestCaseError> {
    let twists = follow(&along::<R>(limits), [0.0; 3], &[target], 700);
    let end = twists[700];
    let size = length(end);
    // The target is scaled by one rounded factor.
    let factor = size / length(target);
    let rounding = 4.0 * epsilon::<R>() * size;
    for i in 0..3 {
        prop_assert!(
            (end[i] - factor * target[i]).abs() <= rounding,
            "{end:?} is not along {target:?}"
        );
    }
    let at_limit = [(limits[0], length([end[0], end[1]])), (limits[1], end[2].abs())]
        .iter()
        .any(|(limits, speed)| (speed - limits.velocity).abs() <= rounding);
    prop_assert!(
        at_limit || (factor - 1.0).abs() <= 4.0 * epsilon::<R>(),
        "stays at {end:?}"
    );
    let mut before = 0.0;
    for twist in &twists {
        let along: f64 = (0..3).map(|i| twist[i] * end[i]).sum::<f64>() / size;
        let aside = length::<3>(core::array::from_fn(|i| twist[i] - along * end[i] / size));
        prop_assert!(aside <= rounding, "{twist:?} is not along {end:?}");
        prop_assert!(
            along >= before - rounding && along <= size + rounding,
            "{along} after {before}"
        );
        before = along;
    }
    Ok(())
}

fn any_motion() -> impl Strategy<Value = MotionLimits<f64>> {
    let rate = || prop_oneof![5 => 0.1..5.0_f64, 1 => Just(NONE)];
    let jerk = prop_oneof![3 => 0.1..10.0_f64, 1 => Just(NONE)];
    (
        prop_oneof![5 => 0.1..2.0_f64, 1 => Just(NONE)],
        rate(),
        rate(),
        jerk,
    )
        .prop_map(|(velocity, acceleration, deceleration, jerk)| MotionLimits {
            velocity,
            acceleration,
            deceleration,
            jerk,
        })
}

fn any_limits() -> impl Strategy<Value = [MotionLimits<f64>; 2]> {
    [any_motion(), any_motion()]
}

/// Components of 0.01 to 3 or exactly 0: a group that hardly moves would leave nothing but rounding to compare.
fn any_twist() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(prop_oneof![
        1 => Just(0.0),
        4 => (0.01..3.0_f64, any::<bool>()).prop_map(|(x, minus)| if minus { -x } else { x }),
    ])
}

fn stays_finite<R: Real>(
    limiter: &TwistLimiter<R>,
    start: [f64; 3],
    targets: &[[f64; 3]],
) -> Result<(), TestCaseError> {
    let twists = follow(limiter, start, targets, 3);
    prop_assert!(twists.iter().flatten().all(|v| v.is_finite()), "{twists:?}");
    Ok(())
}

#[test]
fn parameters_out_of_range_are_named_with_their_axis() {
    let named = |limits| {
        TwistLimiter::<f64>::new(limits, 0.1)
            .expect_err("refused")
            .parameter
    };
    let (free, axis) = (MotionLimits::unlimited(), AxisLimits::unlimited());
    let per_axis = TwistLimits::PerAxis {
        vx: axis,
        vy: AxisLimits { jerk: 0.0, ..axis },
        wz: axis,
    };
    assert_eq!(named(per_axis), "vy.jerk");
    let along = |linear, yaw| TwistLimits::AlongMotion { linear, yaw };
    for bad in [f64::NAN, -1.0] {
        assert_eq!(
            named(along(
                MotionLimits {
                    velocity: bad,
                    ..free
                },
                free
            )),
            "linear.velocity"
        );
        assert_eq!(
            named(along(
                MotionLimits {
                    deceleration: bad,
                    ..free
                },
                free
            )),
            "linear.deceleration"
        );
        assert_eq!(
            named(along(
                free,
                MotionLimits {
                    acceleration: bad,
                    ..free
                }
            )),
            "yaw.acceleration"
        );
        assert_eq!(named(along(free, MotionLimits { jerk: bad, ..free })), "yaw.jerk");
    }
    assert_eq!(
        TwistLimiter::new(along(free, free), 0.0)
            .expect_err("refused")
            .parameter,
        "period_s"
    );
}

#[test]
fn a_period_that_turns_round_is_shared_between_braking_and_accelerating() {
    let linear = MotionLimits {
        acceleration: 1.0,
        deceleration: 4.0,
        ..MotionLimits::unlimited()
    };
    let limits = TwistLimits::AlongMotion {
        linear,
        yaw: MotionLimits::unlimited(),
    };
    let limiter = TwistLimiter::<f64>::new(limits, 0.5).expect("valid");
    let mut state = TwistLimiterState::at(&twist([0.0, 1.0, 0.0]));
    // 2.0 a period while braking: half a period to rest, then half a period at 1.0.
    assert_eq!(
        limiter.step(&mut state, &twist([0.0, -3.0, 0.0])),
        twist([0.0, -0.25, 0.0])
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn a_motion_started_from_rest_keeps_its_direction_and_ends_there(
        limits in any_limits(), target in any_twist(),
    ) {
        prop_assume!(length(target) > 0.0);
        keeps_direction::<f64>(limits, target)?;
        keeps_direction::<f32>(limits, target)?;
    }

    #[test]
    fn no_limit_is_exceeded_whenever_the_target_changes(
        limits in any_limits(), targets in prop::collection::vec(any_twist(), 1..30), hold in 1..20_usize,
    ) {
        within_limits::<f64>(limits, &targets, hold)?;
        within_limits::<f32>(limits, &targets, hold)?;
    }

    #[test]
    fn a_target_is_reached_from_any_acceleration_too(
        limits in any_limits(), targets in prop::collection::vec(any_twist(), 1..10),
    ) {
        let limiter = along::<f32>(limits);
        let mut state = TwistLimiterState::default();
        for target in &targets {
            for _ in 0..7 {
                limiter.step(&mut state, &twist(*target));
            }
        }
        for _ in 0..3000 {
            limiter.step(&mut state, &twist([0.05, -0.02, 0.03]));
        }
        prop_assert_eq!(state.twist(), twist([0.05, -0.02, 0.03]));
    }

    #[test]
    fn a_start_outside_the_limits_is_brought_in_without_growing(
        limits in any_limits(), start in any_twist(), target in any_twist(),
    ) {
        let start = start.map(|v| 5.0 * v);
        for twists in [
            follow(&along::<f64>(limits), start, &[target], 3000),
            follow(&along::<f32>(limits), start, &[target], 3000),
        ] {
            let arrived = follow(&along::<f64>(limits), [0.0; 3], &[target], 3000)[3000];
            // The goal is scaled by one rounded factor.
            prop_assert!(length(minus(twists[3000], arrived)) <= 4.0 * epsilon::<f32>() * length(arrived));
            // A ramp is known to a few units in the last place of the whole change.
            let rounding = 4.0 * epsilon::<f32>() * (length(start) + length(target));
            let outside = |t: &[f64; 3]| length([t[0], t[1]]).max(limits[0].velocity);
            prop_assert!(twists.windows(2).all(|t| outside(&t[1]) <= outside(&t[0]) + rounding));
        }
    }

    #[test]
    fn left_and_right_mirror_each_other(
        limits in any_limits(), targets in prop::collection::vec(any_twist(), 1..10), start in any_twist(),
    ) {
        let mirror = |[x, y, w]: [f64; 3]| [x, -y, -w];
        let opposite: Vec<_> = targets.iter().copied().map(mirror).collect();
        let there = follow(&along::<f32>(limits), start, &targets, 5);
        let back = follow(&along::<f32>(limits), mirror(start), &opposite, 5);
        prop_assert!(there.iter().zip(&back).all(|(a, b)| *a == mirror(*b)));
    }

    #[test]
    fn without_limits_a_target_passes_unchanged(start in any_twist(), target in any_twist()) {
        let free = along::<f64>([MotionLimits::unlimited(); 2]);
        prop_assert_eq!(follow(&free, start, &[target], 1)[1], target);
    }

    #[test]
    fn per_axis_is_one_rate_limiter_an_axis(
        velocity in 0.1..2.0_f64, rate in 0.1..5.0_f64, jerk in 0.1..10.0_f64,
        targets in prop::collection::vec(any_twist(), 1..10),
    ) {
        let axes = [
            AxisLimits::symmetric(velocity, rate, 2.0 * rate, NONE),
            AxisLimits::symmetric(velocity, rate, 2.0 * rate, jerk),
            AxisLimits { min_velocity: 0.0, ..AxisLimits::symmetric(velocity, NONE, rate, jerk) },
        ];
        let [vx, vy, wz] = axes;
        let limiter = TwistLimiter::new(TwistLimits::PerAxis { vx, vy, wz }, PERIOD).expect("valid");
        let twists = follow(&limiter, [0.0; 3], &targets, 7);
        for i in 0..3 {
            let alone = RateLimiter::new(axes[i], PERIOD).expect("valid");
            let mut state = RateLimiterState::default();
            for (k, twist) in twists.iter().skip(1).enumerate() {
                prop_assert_eq!(twist[i], alone.step(&mut state, targets[k / 7][i]));
            }
        }
    }

    #[test]
    fn nothing_makes_the_twist_infinite(
        limits in any_limits(), start in prop::array::uniform3(wild()),
        targets in prop::collection::vec(prop::array::uniform3(wild()), 1..20),
    ) {
        stays_finite(&along::<f64>(limits), start, &targets)?;
        stays_finite(&along::<f32>(limits), start, &targets)?;
    }
}
