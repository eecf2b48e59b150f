use std::vec::Vec;

use super::*;
use proptest::prelude::*;

const PERIOD_S: f64 = 1e-3;
/// 360 counts per turn.
const COUNT_RAD: f64 = core::f64::consts::TAU / 360.0;

fn estimator<R: Real>(method: VelocityMethod<R>) -> VelocityEstimator<R, LONGEST_WINDOW> {
    let config = VelocityConfig {
        method,
        count_rad: R::of(COUNT_RAD),
        period_s: R::of(PERIOD_S),
    };
    VelocityEstimator::<_, LONGEST_WINDOW>::new(config).expect("valid")
}

fn methods<R: Real>() -> [VelocityMethod<R>; 5] {
    let observer = |bandwidth| VelocityMethod::Observer {
        bandwidth_rad_s: R::of(bandwidth),
    };
    [
        VelocityMethod::default(),
        VelocityMethod::Window { periods: 32 },
        VelocityMethod::Edges,
        observer(1.0),
        observer(1000.0),
    ]
}

/// What is read of an encoder at `angle_rad` over the time, with the age of the last edge found by halving.
fn readings(
    estimator: &VelocityEstimator<f64, LONGEST_WINDOW>,
    periods: u32,
    angle_rad: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let counted = |time_s: f64| (angle_rad(time_s) / COUNT_RAD).floor();
    let mut state = VelocityState::default();
    let mut read = |k: u32| {
        let (start_s, end_s) = (f64::from(k) * PERIOD_S, f64::from(k + 1) * PERIOD_S);
        let counts = counted(end_s) - counted(start_s);
        let [mut before_s, mut after_s] = [start_s, end_s];
        for _ in 0..50 {
            let middle_s = f64::midpoint(before_s, after_s);
            if counted(middle_s) == counted(end_s) {
                after_s = middle_s;
            } else {
                before_s = middle_s;
            }
        }
        estimator.step(&mut state, counts as i32, Some(end_s - after_s))
    };
    (0..periods).map(&mut read).collect()
}

/// The largest deviation from `expected` after the first half.
fn deviation(readings: &[f64], expected: f64) -> f64 {
    let late = readings[readings.len() / 2..].iter();
    late.map(|read| (read - expected).abs()).fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn a_window_is_off_by_less_than_a_count_over_its_time(velocity in -80.0..80.0_f64, periods in 1..=32_u16) {
        let read = readings(&estimator(VelocityMethod::Window { periods }), 200, |t| velocity * t);
        let most = COUNT_RAD / (f64::from(periods) * PERIOD_S);
        prop_assert!(deviation(&read, velocity) < most * (1.0 + 1e-9));
    }

    #[test]
    fn times_of_edges_read_a_steady_velocity_exactly(velocity in prop_oneof![-80.0..-0.26_f64, 0.26..80.0]) {
        // Half of the readings hold two edges at least: 2 * 17 mrad.
        let periods = 200 + (8.0 * COUNT_RAD / velocity.abs() / PERIOD_S) as u32;
        let read = readings(&estimator(VelocityMethod::Edges), periods, |t| velocity * t);
        // Stamps are found to 1e-3 s * 2^-50 and times in seconds to 1e-16: of half a period a part of 1e-12.
        prop_assert!(deviation(&read, velocity) < 1e-11 * velocity.abs());
    }

    #[test]
    fn stamps_that_are_off_cost_their_part_of_the_time_between_edges(
        velocity in 0.5..80.0_f64, error_s in 0.0..2e-5_f64,
    ) {
        let estimator = estimator(VelocityMethod::Edges);
        let mut state = VelocityState::default();
        let counted = |time_s: f64| (velocity * time_s / COUNT_RAD).floor();
        for k in 0..400 {
            let (start_s, end_s) = (f64::from(k) * PERIOD_S, f64::from(k + 1) * PERIOD_S);
            let counts = counted(end_s) - counted(start_s);
            let age_s = end_s - counted(end_s) * COUNT_RAD / velocity;
            // Every second stamp is late: the worst that a clock of that resolution does.
            let late_s = if k % 2 == 0 { error_s.min(age_s) } else { 0.0 };
            let before = state;
            let read = estimator.step(&mut state, counts as i32, Some(age_s - late_s));
            if counts > 0.0 && before.way != 0 && before.quiet != u32::MAX {
                let time_s = counts * COUNT_RAD / velocity;
                let most = velocity * error_s / (time_s - error_s);
                prop_assert!((read - velocity).abs() <= most + 1e-9 * velocity, "{k}: {read}");
            }
        }
    }

    #[test]
    fn an_observer_ripples_by_its_bandwidth_times_a_count_over_e(velocity in -80.0..80.0_f64, bandwidth in 5.0..500.0_f64) {
        let observer = VelocityMethod::Observer { bandwidth_rad_s: bandwidth };
        // Twenty time constants until it is looked at.
        let periods = (40.0 / bandwidth / PERIOD_S) as u32 + 400;
        let read = readings(&estimator(observer), periods, |t| velocity * t);
        // Half a count times the sum of the sizes of its impulse response. That sum is twice the peak of its step
        // response, (1 - p)^2 k p^(k - 1) / T after k periods with both poles at p: 2 bandwidth / e in continuous
        // time, and up to 2 % more here, with few periods in a time constant. 1e-6 of the start is left.
        let pole = (-bandwidth * PERIOD_S).exp();
        let peak = (1..400).map(|k| f64::from(k) * pole.powi(k - 1)).fold(0.0, f64::max);
        let most = COUNT_RAD / PERIOD_S * (1.0 - pole).powi(2) * peak;
        prop_assert!((most / (bandwidth * COUNT_RAD / core::f64::consts::E) - 1.0).abs() < 0.025);
        // A wheel that makes fewer than three counts in the time after which it is taken to stand may read exactly 0.
        let standing = 3.0 * COUNT_RAD / estimator(observer).standing_s();
        let most = if velocity.abs() < standing { most.max(velocity.abs()) } else { most };
        prop_assert!(deviation(&read, velocity) <= most + 1e-6 * velocity.abs(), "{} {most}", deviation(&read, velocity));
    }

    #[test]
    fn nothing_that_goes_in_makes_a_reading_that_is_not_finite(
        counts in prop::collection::vec((prop_oneof![any::<i32>(), -2..3_i32, Just(0), Just(i32::MIN), Just(i32::MAX)], prop::option::of(any::<f64>())), 1..200),
        count_rad in prop_oneof![1e-9..7.0_f64, Just(1e-9), Just(7.0)], period_s in prop_oneof![1e-6..10.0_f64, Just(1e-6), Just(10.0)],
        way in 0..5_usize, steps in prop_oneof![0.001..1.0_f64, Just(1.0)],
    ) {
        let method = match methods()[way] {
            VelocityMethod::Observer { .. } => VelocityMethod::Observer { bandwidth_rad_s: steps / period_s },
            other => other,
        };
        let double = VelocityEstimator::<_, LONGEST_WINDOW>::new(VelocityConfig { method, count_rad, period_s }).expect("valid");
        let single_period_s = (period_s as f32).max(1.001e-6);
        let method = match method {
            VelocityMethod::Observer { .. } => VelocityMethod::Observer { bandwidth_rad_s: steps as f32 / single_period_s },
            VelocityMethod::Window { periods } => VelocityMethod::Window { periods },
            VelocityMethod::Edges => VelocityMethod::Edges,
        };
        let config = VelocityConfig { method, count_rad: (count_rad as f32).max(1.001e-9), period_s: single_period_s };
        let single = VelocityEstimator::<_, LONGEST_WINDOW>::new(config).expect("valid");
        let (mut state, mut single_state) = (VelocityState::default(), VelocityState::default());
        for (counts, since) in counts {
            let read = double.step(&mut state, counts, since);
            prop_assert!(read.is_finite());
            prop_assert!(single.step(&mut single_state, counts, since.map(|s| s as f32)).is_finite());
            // Without a count the wheel turned less than one since.
            if counts == 0 {
                prop_assert!(read.abs() <= count_rad / period_s * (1.0 + 1e-12));
            }
        }
        // And it comes to rest: after k periods at most a count in their time, to the rounding of each type.
        for k in 1..100_u32 {
            let most = count_rad / (f64::from(k) * period_s);
            prop_assert!(double.step(&mut state, 0, None).abs() <= most * (1.0 + 1e-12));
            let most = f64::from(config.count_rad) / (f64::from(k) * f64::from(config.period_s));
            prop_assert!(f64::from(single.step(&mut single_state, 0, None)).abs() <= most * (1.0 + 1e-6));
        }
    }

    #[test]
    fn backwards_is_forwards_with_the_other_sign(ways in prop::collection::vec(-3..=3_i32, 1..100), way in 0..5_usize) {
        // (Of edges only if a wheel does not turn round in between: there the same edge is passed twice.)
        let steady = methods::<f64>()[way] == VelocityMethod::Edges;
        let estimator = estimator(methods()[way]);
        let (mut ahead, mut back) = (VelocityState::default(), VelocityState::default());
        for counts in ways {
            let counts = if steady { counts.abs() } else { counts };
            let read = estimator.step(&mut ahead, counts, Some(1e-4));
            prop_assert_eq!(estimator.step(&mut back, -counts, Some(1e-4)), -read);
        }
    }

    #[test]
    fn single_precision_reads_what_double_does(velocity in -80.0..80.0_f64, way in 0..5_usize) {
        let (double, single) = (estimator::<f64>(methods()[way]), estimator::<f32>(methods()[way]));
        let (mut state, mut single_state) = (VelocityState::default(), VelocityState::default());
        let counted = |k: u32| (velocity * f64::from(k) * PERIOD_S / COUNT_RAD).floor();
        for k in 0..2000 {
            let counts = (counted(k + 1) - counted(k)) as i32;
            let (a, b) = (double.step(&mut state, counts, Some(3e-4)), single.step(&mut single_state, counts, Some(3e-4)));
            // An observer sums 2000 roundings of a rate of up to 100 rad/s, and forgets them with its bandwidth.
            prop_assert!((a - f64::from(b)).abs() < 2e-3, "{k}: {a} {b}");
        }
    }
}

/// What each method reads, period after period, of an encoder that dies while its wheel turns with 6 rad/s.
fn dying<R: Real>(method: VelocityMethod<R>, dead: impl Fn(u32) -> i32) -> Vec<f64> {
    let estimator = estimator::<R>(method);
    let mut state = VelocityState::default();
    let counted = |k: u32| (6.0 * f64::from(k) * PERIOD_S / COUNT_RAD).floor();
    let mut step = |counts| estimator.step(&mut state, counts, Some(R::of(2e-4))).as_f64();
    for k in 0..1000 {
        step((counted(k + 1) - counted(k)) as i32);
    }
    (0..2000).map(|k| step(dead(k))).collect()
}

#[test]
fn a_counter_that_stands_or_toggles_reads_exactly_zero_from_the_stated_time_on() {
    // An open channel: one count to and fro, or two, as often as the shaft turns, and each other period.
    let ways: [fn(u32) -> i32; 4] = [
        |_| 0,
        |k| [1, 0, 0, -1, 0, 0][k as usize % 6],
        |k| [1, -1][k as usize % 2],
        |k| [2, 0, -2, 0, 0, 0, 0][k as usize % 7],
    ];
    // Three counts at 0.25 rad/s.
    let stated = (3.0 * COUNT_RAD / 0.25 / PERIOD_S).round() as usize;
    for (i, dead) in ways.into_iter().enumerate() {
        for (j, method) in methods::<f64>().into_iter().enumerate() {
            let read = dying(method, dead);
            // What the counter stood at when it died belongs to the two counts, or to none of them.
            assert!(
                read[stated..].iter().all(|read| *read == 0.0),
                "way {i}, method {j}"
            );
            let read = dying(methods::<f32>()[j], dead);
            assert!(
                read[stated..].iter().all(|read| *read == 0.0),
                "way {i}, method {j}, f32"
            );
        }
    }
}

#[test]
fn a_wheel_that_turns_slowly_is_read_again_as_soon_as_it_leaves_two_counts() {
    for (j, method) in methods::<f64>().into_iter().enumerate() {
        let estimator = estimator(method);
        let mut state = VelocityState::default();
        for _ in 0..1000 {
            estimator.step(&mut state, 0, None);
        }
        let mut first = None;
        // 2 rad/s: a count in nine periods.
        for k in 0..2000 {
            let read = estimator.step(&mut state, i32::from(k % 9 == 8), Some(0.0));
            if read != 0.0 && first.is_none() {
                first = Some(k);
            }
        }
        assert_eq!(first, Some(3 * 9 - 1), "method {j}");
        assert!(state.stood < 30, "and it stands no more");
    }
}

#[test]
fn no_wheel_faster_than_three_counts_in_the_stated_time_is_ever_taken_for_standing() {
    for method in methods::<f64>() {
        // The slowest that is read throughout, and one count slower in twice the time.
        let read = readings(&estimator(method), 20_000, |t| 0.2551 * t);
        let zeros = |read: &[f64]| read[10_000..].iter().filter(|read| **read == 0.0).count();
        if let VelocityMethod::Window { .. } = method {
            continue; // a window without a count reads 0 by itself
        }
        assert_eq!(zeros(&read), 0, "{method:?}");
        let slower = readings(&estimator(method), 20_000, |t| 0.2 * t);
        assert!(zeros(&slower) > 100, "{method:?}: slower ones are, now and then");
    }
}

#[test]
fn a_wheel_that_trembles_on_an_edge_has_no_velocity_between_its_edges() {
    let edges = estimator::<f64>(VelocityMethod::Edges);
    let mut state = VelocityState::default();
    let read: Vec<f64> = (0..20)
        .map(|k| edges.step(&mut state, [1, -1][k % 2], Some(2e-4)))
        .collect();
    assert_eq!(read, [0.0; 20]);
}

#[test]
fn a_wheel_that_speeds_up_is_read_late_by_the_lag_of_the_method() {
    // 200 rad/s^2 with a thousandth of the count: what is left is lag.
    let (rate, time_s) = (200.0, 0.2);
    let lag_s = |method| {
        let config = VelocityConfig {
            method,
            count_rad: COUNT_RAD / 1000.0,
            period_s: PERIOD_S,
        };
        let estimator = VelocityEstimator::<_, LONGEST_WINDOW>::new(config).expect("valid");
        let mut state = VelocityState::default();
        let counted = |k: u32| (0.5 * rate * (f64::from(k) * PERIOD_S).powi(2) / config.count_rad).floor();
        let mut read = 0.0;
        for k in 0..(time_s / PERIOD_S) as u32 {
            read = estimator.step(&mut state, (counted(k + 1) - counted(k)) as i32, Some(0.0));
        }
        time_s - read / rate
    };
    // A count over the time is 0.017 rad/s in a period, 9e-5 s at this rate; of 8 periods and of the observer less.
    assert!((lag_s(VelocityMethod::Window { periods: 8 }) - 4e-3).abs() < 2e-5);
    assert!((lag_s(VelocityMethod::Edges) - 0.5e-3).abs() < 1e-4);
    // Of poles at p the lag is T (1 + p) / (1 - p), less half a period by which the angle is ahead: 2 / bandwidth.
    let observer = VelocityMethod::Observer {
        bandwidth_rad_s: 100.0,
    };
    assert!((lag_s(observer) - 0.02).abs() < 1e-3);
}

#[test]
fn figures_are_checked_by_name() {
    let config = VelocityConfig {
        method: VelocityMethod::Edges,
        count_rad: 0.01_f32,
        period_s: 1e-3,
    };
    let named = |config| {
        VelocityEstimator::<_, LONGEST_WINDOW>::new(config)
            .expect_err("refused")
            .parameter
    };
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(
            named(VelocityConfig {
                count_rad: bad,
                ..config
            }),
            "count_rad"
        );
        assert_eq!(
            named(VelocityConfig {
                period_s: bad,
                ..config
            }),
            "period_s"
        );
        let method = VelocityMethod::Observer { bandwidth_rad_s: bad };
        assert_eq!(named(VelocityConfig { method, ..config }), "bandwidth_rad_s");
    }
    for periods in [0, 33, u16::MAX] {
        let method = VelocityMethod::Window { periods };
        assert_eq!(named(VelocityConfig { method, ..config }), "periods");
    }
    for bandwidth_rad_s in [1.0_f32, 1000.0] {
        let method = VelocityMethod::Observer { bandwidth_rad_s };
        assert!(
            VelocityEstimator::<_, LONGEST_WINDOW>::new(VelocityConfig { method, ..config }).is_ok(),
            "the ends belong to the range"
        );
    }
}

/// What is read of a wheel that turns with `rad_s` where reading `k` comes `after(k)` periods after
/// the one before; none: the counter cannot be read. With `measures` the time is given, else a
/// period without a reading is said to be one.
fn uneven(
    method: VelocityMethod<f64>,
    rad_s: f64,
    measures: bool,
    after: impl Fn(u32) -> Option<f64>,
) -> Vec<f64> {
    let estimator = estimator(method);
    let counted = |time_s: f64| (rad_s * time_s / COUNT_RAD).floor();
    let (mut state, mut read) = (VelocityState::default(), Vec::new());
    let (mut now_s, mut last_s) = (0.0, 0.0);
    for k in 0..4000 {
        let Some(periods) = after(k) else {
            now_s += PERIOD_S;
            estimator.missed(&mut state);
            continue;
        };
        now_s += periods * PERIOD_S;
        let counts = (counted(now_s) - counted(last_s)) as i32;
        let age_s = now_s - counted(now_s) * COUNT_RAD / rad_s;
        read.push(if measures {
            estimator.step_after(&mut state, counts, now_s - last_s, Some(age_s))
        } else {
            estimator.step(&mut state, counts, Some(age_s))
        });
        last_s = now_s;
    }
    read
}

#[test]
fn every_method_reads_missing_and_uneven_periods_as_even_ones() {
    // By how much a reading is off by its table at 12 rad/s, of even periods.
    let off = |method: VelocityMethod<f64>| match method {
        VelocityMethod::Window { periods } => COUNT_RAD / (f64::from(periods) * PERIOD_S),
        VelocityMethod::Edges => 1e-9,
        VelocityMethod::Observer { bandwidth_rad_s } => {
            // Where p = exp(-bandwidth T) is far from 1, up to the count of a period.
            bandwidth_rad_s
                * COUNT_RAD
                * if bandwidth_rad_s > 100.0 {
                    1.0
                } else {
                    1.0 / core::f64::consts::E
                }
        }
    };
    for method in methods() {
        // The shortest time between readings is 0.7 of a period: what a count makes of it is larger by that.
        let most = 1.02 * off(method) / 0.7 + 1e-9;
        type After = fn(u32) -> Option<f64>;
        let cases: [(bool, After); 3] = [
            (false, |k| (k % 5 != 3 && k % 7 != 2).then_some(1.0)),
            (true, |k| Some([0.7, 1.4, 1.1][k as usize % 3])),
            (true, |k| Some(if k % 100 == 50 { 9.3 } else { 1.0 })),
        ];
        for (case, (measures, after)) in cases.into_iter().enumerate() {
            let read = uneven(method, 12.0, measures, after);
            let deviation = deviation(&read, 12.0);
            // The lowest bandwidth takes its ten seconds to settle; the others have by the half.
            if method != (VelocityMethod::Observer { bandwidth_rad_s: 1.0 }) {
                assert!(
                    deviation <= most,
                    "{method:?}, case {case}: off by {deviation}, at most {most}"
                );
            }
        }
    }
}

#[test]
fn a_missed_period_is_twice_the_time_and_not_twice_the_velocity() {
    for (method, most) in [
        (VelocityMethod::default(), 1e-9),
        (VelocityMethod::Window { periods: 8 }, 1e-9),
        (
            VelocityMethod::Observer {
                bandwidth_rad_s: 100.0,
            },
            1e-9,
        ),
    ] {
        let estimator = estimator::<f64>(method);
        let read = |says: bool| {
            let mut state = VelocityState::default();
            let mut last = 0.0;
            for _ in 0..1000 {
                last = estimator.step(&mut state, 1, None);
            }
            if says {
                estimator.missed(&mut state);
            }
            (last, estimator.step(&mut state, 2, None))
        };
        let (before, after) = read(true);
        assert!((after - before).abs() < most, "{method:?}: {before}, {after}");
        let (before, unsaid) = read(false);
        assert!(unsaid > 1.005 * before, "{method:?}: {before}, {unsaid}");
    }
}

#[test]
fn a_time_that_cannot_be_counts_as_the_period_and_no_number_divides() {
    for method in methods::<f32>() {
        let estimator = estimator(method);
        for time_s in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-7, 1e4] {
            let (mut state, mut even) = (VelocityState::default(), VelocityState::default());
            for counts in [3, 0, -1, 4] {
                let read = estimator.step_after(&mut state, counts, time_s, None);
                assert_eq!(read.to_bits(), estimator.step(&mut even, counts, None).to_bits());
            }
        }
        let mut state = VelocityState::default();
        for k in 0..200_000_u32 {
            let time_s = [1e-6_f32, 2e-3, 900.0, 1e-3][k as usize % 4];
            let counts = [0, i32::MAX, i32::MIN, 1][(k / 3) as usize % 4];
            assert!(
                estimator
                    .step_after(&mut state, counts, time_s, Some(time_s))
                    .is_finite()
            );
            if k % 5 == 0 {
                estimator.missed(&mut state);
            }
        }
    }
}

#[test]
fn a_counter_stands_by_the_time_and_not_by_the_readings() {
    let estimator = estimator::<f64>(VelocityMethod::Edges);
    for periods in [0.4, 1.0, 1.4, 3.0] {
        let mut state = VelocityState::default();
        estimator.step(&mut state, 5, None);
        estimator.step(&mut state, 5, None);
        let mut readings = 1;
        while estimator.step_after(&mut state, 0, periods * PERIOD_S, None) != 0.0 {
            readings += 1;
        }
        let stood_s = f64::from(readings) * periods * PERIOD_S;
        // To a reading.
        assert!(
            (stood_s - estimator.standing_s()).abs() <= (periods + 1.0) * PERIOD_S,
            "{periods}: {stood_s}"
        );
    }
}

#[test]
fn a_state_has_only_the_places_that_its_window_needs() {
    assert_eq!(size_of::<VelocityState<f32>>(), 64);
    assert_eq!(size_of::<VelocityState<f32, 8>>(), 120);
    assert_eq!(size_of::<VelocityState<f32, 32>>(), 312);
    let window = VelocityConfig {
        method: VelocityMethod::Window { periods: 8 },
        count_rad: 0.01_f32,
        period_s: 1e-3,
    };
    assert!(VelocityEstimator::<_, 8>::new(window).is_ok());
    let error = VelocityEstimator::<_, 7>::new(window).expect_err("refused");
    assert_eq!((error.parameter, error.value), ("periods", 8.0));
}
