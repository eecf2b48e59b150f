use super::*;
use proptest::prelude::*;
use std::vec::Vec;

const NONE: f64 = f64::INFINITY;

fn limiter<R: Real>(limits: AxisLimits<f64>, period_s: f64) -> RateLimiter<R> {
    let limits = AxisLimits {
        min_velocity: R::of(limits.min_velocity),
        max_velocity: R::of(limits.max_velocity),
        acceleration: R::of(limits.acceleration),
        deceleration: R::of(limits.deceleration),
        reverse_acceleration: R::of(limits.reverse_acceleration),
        reverse_deceleration: R::of(limits.reverse_deceleration),
        jerk: R::of(limits.jerk),
    };
    RateLimiter::new(limits, R::of(period_s)).expect("valid")
}

/// First velocity from `start` towards `target` with a period of 0.5 s.
fn first(limits: AxisLimits<f64>, start: f64, target: f64) -> f64 {
    limiter(limits, 0.5).step(&mut RateLimiterState::at(start), target)
}

fn unlimited() -> AxisLimits<f64> {
    AxisLimits::unlimited()
}

#[test]
fn single_steps_are_those_worked_out_by_hand() {
    let velocity = AxisLimits {
        min_velocity: -0.5,
        max_velocity: 1.0,
        ..unlimited()
    };
    assert_eq!(first(velocity, 0.0, 10.0), 1.0);
    assert_eq!(first(velocity, 0.0, -10.0), -0.5);
    let gentle = AxisLimits {
        acceleration: 1.0,
        reverse_acceleration: 0.5,
        ..velocity
    };
    assert_eq!(first(gentle, 0.0, 10.0), 0.5);
    assert_eq!(first(gentle, 0.0, -10.0), -0.25);
    assert_eq!(first(AxisLimits { jerk: 5.0, ..gentle }, 0.0, 10.0), 0.5); // acceleration binds
    assert_eq!(first(AxisLimits { jerk: 1.0, ..gentle }, 0.0, 10.0), 0.25); // jerk binds
    assert_eq!(
        first(
            AxisLimits {
                jerk: 5.0,
                ..unlimited()
            },
            0.0,
            10.0
        ),
        1.25
    );
    let uneven = AxisLimits {
        acceleration: 1.0,
        deceleration: 5.0,
        reverse_deceleration: 10.0,
        ..unlimited()
    };
    assert_eq!(first(uneven, 5.0, 10.0), 5.5);
    assert_eq!(first(uneven, -5.0, 10.0), 0.0);
    assert_eq!(first(uneven, -2.5, 10.0), 0.25); // half the period brakes, half accelerates
    assert_eq!(first(uneven, 5.0, 0.0), 2.5);
}

/// Periods of 1 ms until `velocity` is exactly zero.
fn periods_to_rest<R: Real>(limits: AxisLimits<f64>, velocity: f64) -> u32 {
    let limiter = limiter::<R>(limits, 0.001);
    let mut state = RateLimiterState::at(R::of(velocity));
    (1..2000)
        .find(|_| limiter.step(&mut state, R::zero()) == R::zero())
        .expect("stops")
}

#[test]
fn stopping_takes_speed_over_deceleration() {
    let limits = AxisLimits {
        deceleration: 4.0,
        reverse_deceleration: 10.0,
        ..unlimited()
    };
    // One period more where the rounding of 250 subtractions leaves a last bit over.
    for (periods, exact) in [
        (periods_to_rest::<f64>(limits, 1.0), 250),
        (periods_to_rest::<f64>(limits, -1.0), 100),
        (periods_to_rest::<f32>(limits, 1.0), 250),
        (periods_to_rest::<f32>(limits, -1.0), 100),
    ] {
        assert!(
            periods == exact || periods == exact + 1,
            "{periods} periods, {exact} expected"
        );
    }
}

#[test]
fn parameters_out_of_range_are_named() {
    let named = |limits, period| {
        RateLimiter::<f64>::new(limits, period)
            .expect_err("refused")
            .parameter
    };
    let inverted = AxisLimits {
        min_velocity: 1.0,
        max_velocity: -1.0,
        ..unlimited()
    };
    assert_eq!(named(inverted, 0.1), "min_velocity");
    for bad in [f64::NAN, -1.0] {
        assert_eq!(
            named(
                AxisLimits {
                    max_velocity: bad,
                    ..unlimited()
                },
                0.1
            ),
            "max_velocity"
        );
    }
    assert_eq!(
        named(
            AxisLimits {
                min_velocity: f64::NAN,
                ..unlimited()
            },
            0.1
        ),
        "min_velocity"
    );
    for bad in [f64::NAN, -1.0, 0.0] {
        assert_eq!(
            named(
                AxisLimits {
                    acceleration: bad,
                    ..unlimited()
                },
                0.1
            ),
            "acceleration"
        );
        assert_eq!(
            named(
                AxisLimits {
                    deceleration: bad,
                    ..unlimited()
                },
                0.1
            ),
            "deceleration"
        );
        let reverse = AxisLimits {
            reverse_acceleration: bad,
            ..unlimited()
        };
        assert_eq!(named(reverse, 0.1), "reverse_acceleration");
        let reverse = AxisLimits {
            reverse_deceleration: bad,
            ..unlimited()
        };
        assert_eq!(named(reverse, 0.1), "reverse_deceleration");
        assert_eq!(
            named(
                AxisLimits {
                    jerk: bad,
                    ..unlimited()
                },
                0.1
            ),
            "jerk"
        );
        assert_eq!(named(unlimited(), bad), "period_s");
    }
    assert_eq!(named(unlimited(), NONE), "period_s");
}

/// Follows `targets`, each for `hold` periods, and returns all velocities from the start on, at which it is steady.
fn follow<R: Real>(limiter: &RateLimiter<R>, start: f64, targets: &[f64], hold: usize) -> Vec<R> {
    let mut state = RateLimiterState::at(R::of(start));
    let mut velocities = Vec::from([state.velocity()]);
    for &target in targets {
        velocities.extend((0..hold).map(|_| limiter.step(&mut state, R::of(target))));
    }
    velocities
}

/// Are the velocities, steps and changes of steps within the limits?
fn within_limits<R: Real>(
    limits: AxisLimits<f64>,
    period: f64,
    velocities: &[R],
) -> Result<(), TestCaseError> {
    let v: Vec<f64> = velocities.iter().map(|v| v.as_f64()).collect();
    let largest = v.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    // A velocity is rounded by half a unit in the last place, a difference of differences by two, the limits by one.
    let rounding = |limit: f64| (4.0 * largest + 4.0 * limit) * R::default_epsilon().as_f64();
    for pair in v.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        prop_assert!(
            b <= R::of(limits.max_velocity).as_f64() && b >= R::of(limits.min_velocity).as_f64(),
            "{b}"
        );
        // Time needed for the change by itself, its parts on either side of rest added up.
        let [up, down] = if b > a {
            [limits.acceleration, limits.reverse_deceleration]
        } else {
            [limits.reverse_acceleration, limits.deceleration]
        };
        if up.min(down) == NONE {
            continue;
        }
        let sign = (b - a).signum();
        let [a, b] = [sign * a, sign * b];
        let time = (b.max(0.0) - a.max(0.0)) / up + (b.min(0.0) - a.min(0.0)) / down;
        prop_assert!(
            time <= period + rounding(up.min(down) * period) / up.min(down),
            "{a} to {b}"
        );
    }
    if limits.jerk == NONE {
        return Ok(());
    }
    let jerk_step = limits.jerk * period * period;
    // The first change of step starts from steady motion.
    let first = (v[1] - v[0]).abs();
    let changes = v.windows(3).map(|v| (v[2] - v[1] - (v[1] - v[0])).abs());
    for change in changes.chain([first]) {
        prop_assert!(
            change <= jerk_step + rounding(jerk_step),
            "{change} above {jerk_step}"
        );
    }
    Ok(())
}

fn reaches_without_overshoot<R: Real>(velocities: &[R], target: f64) -> Result<(), TestCaseError> {
    let (start, target) = (velocities[0], R::of(target));
    let sign = if target < start { -R::one() } else { R::one() };
    // Steps are known to a unit in the last place of their sum.
    let rounding = R::of(4.0) * R::default_epsilon() * (start.abs() + target.abs());
    for v in velocities {
        prop_assert!(sign * (*v - target) <= rounding, "{v} beyond {target}");
    }
    prop_assert_eq!(velocities.last().copied(), Some(target));
    Ok(())
}

/// Limits of every kind; velocity steps of 0.01 to 0.5 and jerk steps of 1e-3 to 0.1 with the period of 0.1.
fn any_limits() -> impl Strategy<Value = AxisLimits<f64>> {
    let rate = || prop_oneof![5 => 0.1..5.0_f64, 1 => Just(NONE)];
    let jerk = prop_oneof![3 => 0.1..10.0_f64, 1 => Just(NONE)];
    (
        -2.0..0.0_f64,
        0.0..2.0_f64,
        [rate(), rate(), rate(), rate()],
        jerk,
    )
        .prop_map(|(min, max, rates, jerk)| {
            let [
                acceleration,
                deceleration,
                reverse_acceleration,
                reverse_deceleration,
            ] = rates;
            AxisLimits {
                min_velocity: min,
                max_velocity: max,
                acceleration,
                deceleration,
                reverse_acceleration,
                reverse_deceleration,
                jerk,
            }
        })
}

/// The same limits seen by a vehicle that calls its rear the front.
fn mirrored(limits: AxisLimits<f64>) -> AxisLimits<f64> {
    AxisLimits {
        min_velocity: -limits.max_velocity,
        max_velocity: -limits.min_velocity,
        acceleration: limits.reverse_acceleration,
        deceleration: limits.reverse_deceleration,
        reverse_acceleration: limits.acceleration,
        reverse_deceleration: limits.deceleration,
        jerk: limits.jerk,
    }
}

/// Numbers of every magnitude, the ends of both precisions and what is none.
pub(crate) fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>(),
        (-38.0..38.0_f64).prop_map(|e| 10.0_f64.powf(e)),
        prop::sample::select(std::vec![NONE, -NONE, f64::NAN, 0.0, f64::MAX, 3.4e38, -3.4e38]),
        -2.0..2.0_f64,
    ]
}

fn stays_finite<R: Real>(limits: AxisLimits<f64>, start: f64, targets: &[f64]) -> Result<(), TestCaseError> {
    let velocities = follow(&limiter::<R>(limits, 0.1), start, targets, 3);
    prop_assert!(velocities.iter().all(|v| v.is_finite_real()), "{velocities:?}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn no_limit_is_exceeded_whenever_the_target_changes(
        limits in any_limits(), targets in prop::collection::vec(-3.0..3.0_f64, 1..30), hold in 1..20_usize,
    ) {
        within_limits(limits, 0.1, &follow(&limiter::<f64>(limits, 0.1), 0.0, &targets, hold))?;
        within_limits(limits, 0.1, &follow(&limiter::<f32>(limits, 0.1), 0.0, &targets, hold))?;
    }

    #[test]
    fn a_constant_target_is_reached_exactly_and_never_overshot(
        limits in any_limits(), start in 0.0..1.0_f64, target in 0.0..1.0_f64,
    ) {
        let velocity = |share: f64| limits.min_velocity + share * (limits.max_velocity - limits.min_velocity);
        let (start, target) = (velocity(start), velocity(target));
        // At most 4.0 at 0.1 takes 400 periods; a jerk of 0.1 adds 2 sqrt(4.0 / 0.001) periods, twice to turn round.
        let hold = 400 + 2 * 130;
        reaches_without_overshoot(&follow(&limiter::<f64>(limits, 0.1), start, &[target], hold), target)?;
        reaches_without_overshoot(&follow(&limiter::<f32>(limits, 0.1), start, &[target], hold), target)?;
    }

    #[test]
    fn a_target_is_reached_from_any_acceleration_too(
        limits in any_limits(), targets in prop::collection::vec(-3.0..3.0_f64, 1..10), target in -3.0..3.0_f64,
    ) {
        let target = target.limited(limits.min_velocity, limits.max_velocity);
        let mut state = RateLimiterState::default();
        let limiter = limiter::<f32>(limits, 0.1);
        for target in targets {
            for _ in 0..7 {
                limiter.step(&mut state, target as f32);
            }
        }
        for _ in 0..1000 {
            limiter.step(&mut state, target as f32);
        }
        prop_assert_eq!(state.velocity(), target as f32);
    }

    #[test]
    fn a_jerk_limited_ramp_ends_where_the_period_is_far_below_the_resolution(
        jerk in 0.5..50.0_f64, start in -5.0..5.0_f64, target in -5.0..5.0_f64,
    ) {
        // 20 kHz: a jerk step of 1e-9 to 1e-7 against 2.4e-7, the spacing of f32 numbers from 2 to 4.
        let limits = AxisLimits { acceleration: 50.0, reverse_acceleration: 50.0, jerk, ..unlimited() };
        let hold = 250_000; // 2 sqrt(10 / 0.5) = 9 s are 180 000 periods
        let velocities = follow(&limiter::<f32>(limits, 5e-5), start, &[target], hold);
        reaches_without_overshoot(&velocities, target)?;
    }

    #[test]
    fn forward_and_reverse_mirror_each_other(
        limits in any_limits(), targets in prop::collection::vec(-3.0..3.0_f64, 1..10), start in -1.0..1.0_f64,
    ) {
        let there = follow(&limiter::<f32>(limits, 0.1), start, &targets, 5);
        let opposite: Vec<f64> = targets.iter().map(|t| -t).collect();
        let back = follow(&limiter::<f32>(mirrored(limits), 0.1), -start, &opposite, 5);
        prop_assert!(there.iter().zip(&back).all(|(a, b)| *a == -*b));
    }

    #[test]
    fn without_limits_any_finite_target_passes_unchanged(start in any::<f64>(), target in any::<f64>()) {
        prop_assume!(target.is_finite());
        prop_assert_eq!(first(unlimited(), start, target), target);
    }

    #[test]
    fn nothing_makes_the_velocity_infinite(
        limits in any_limits(), free in any::<bool>(), start in wild(), targets in prop::collection::vec(wild(), 1..20),
    ) {
        let limits = if free {
            AxisLimits { min_velocity: -NONE, max_velocity: NONE, ..limits }
        } else {
            limits
        };
        stays_finite::<f64>(limits, start, &targets)?;
        stays_finite::<f32>(limits, start, &targets)?;
    }

    #[test]
    fn a_target_that_is_not_finite_holds_a_steady_velocity(limits in any_limits(), start in -1.0..1.0_f64) {
        for target in [f64::NAN, NONE, -NONE] {
            let velocities = follow(&limiter::<f64>(limits, 0.1), start, &[target], 5);
            prop_assert!(velocities.iter().all(|v| *v == start));
        }
    }
}
