//! The integral zone and the limit of the proportional term.

use super::*;
use std::vec;

/// Five laws, with a tracking time of kp / ki of the gains here.
const ALL_LAWS: [AntiWindup<f64>; 5] = [AntiWindup::None, LAWS[0], LAWS[1], LAWS[2], LAWS[3]];

#[test]
fn beyond_the_zone_a_loop_has_no_integral_gain_and_within_it_starts_afresh() {
    for order in [IntegrationOrder::BeforeOutput, IntegrationOrder::AfterOutput] {
        let config = PidConfig {
            order,
            ..PidConfig::new(gains(0.3, 2.0, 0.0), DT)
        };
        let (zoned, free) = (pid(config.with_integral_zone(2.0)), pid(config));
        let proportional = pid(PidConfig::new(gains(0.3, 0.0, 0.0), DT));
        let (mut a, mut b) = (PidState::default(), PidState::default());
        let mut changes = 0;
        let mut within = false;
        for k in 0..2000 {
            let reference = 4.0 * (0.01 * f64::from(k)).sin();
            let expected = if reference.abs() > 2.0 {
                b = PidState::default();
                proportional.step(&mut PidState::default(), reference, 0.0)
            } else {
                free.step(&mut b, reference, 0.0)
            };
            assert_eq!(zoned.step(&mut a, reference, 0.0), expected, "{order:?} {k}");
            changes += i32::from(within != (reference.abs() <= 2.0));
            within = reference.abs() <= 2.0;
        }
        // In at the start, out and in again in each of six half waves of 314 periods, and out in the seventh.
        assert_eq!(changes, 14);
    }
}

#[test]
fn an_error_of_exactly_the_zone_counts_and_a_zone_of_0_takes_in_none() {
    let at = |zone: f64| {
        let pid = pid(PidConfig::new(gains(0.0, 1.0, 0.0), 1.0).with_integral_zone(zone));
        pid.step(&mut PidState::default(), -2.0, 0.0).output_n_m
    };
    assert_eq!([at(2.0), at(1.999_999), at(0.0)], [-2.0, 0.0, 0.0]);
}

#[test]
fn a_zone_keeps_the_integral_out_of_the_way_to_a_new_speed() {
    // A wheel of 0.01 kg.m2 without friction, from rest to 10 rad/s: with the zone it overshoots less.
    let peak = |zone| {
        let config = PidConfig::new(gains(0.3, 2.0, 0.0), DT).with_integral_zone(zone);
        let (pid, mut state) = (pid(config), PidState::default());
        let (mut w, mut peak) = (0.0, 0.0_f64);
        for _ in 0..3000 {
            w += pid.step(&mut state, 10.0, w).output_n_m * DT / 0.01;
            peak = peak.max(w);
        }
        assert!((w - 10.0).abs() < 1e-6, "it settles where it shall: {w}");
        peak - 10.0
    };
    // s^2 + 30 s + 200 has its poles at -10 and -20: 1.25 rad/s over without a zone (the zero of 2
    // / 0.3), and in proportion to the error that the integral starts with: 1 instead of 10.
    let (without, with) = (peak(f64::INFINITY), peak(1.0));
    assert!((without - 1.25).abs() < 0.03, "{without}");
    assert!((with - 0.125).abs() < 0.006, "{with}");
}

#[test]
fn only_the_proportional_term_is_held_within_its_limit() {
    let config = PidConfig::new(gains(0.3, 2.0, 0.01), DT);
    let (limited, free) = (pid(config.with_proportional_limit(0.6)), pid(config));
    let (mut a, mut b) = (PidState::default(), PidState::default());
    for k in 0..500 {
        let reference = 4.0 * (0.02 * f64::from(k)).sin();
        let (ours, all) = (
            limited.step(&mut a, reference, 0.0),
            free.step(&mut b, reference, 0.0),
        );
        let mut expected = all.terms;
        expected.p_n_m = expected.p_n_m.limited(-0.6, 0.6);
        assert_eq!(ours.terms, expected, "{k}");
        assert_eq!(ours.output_n_m, expected.sum());
    }
}

#[test]
fn the_integral_settles_at_the_limit_of_the_output_and_not_beyond_it() {
    // Blocked for long with an error of 10 rad/s, of which the proportional term shows 0.3 of 3 N.m. A law
    // that compared what is asked for with what is given, and no more, would settle at 1 - 0.3 + 3 N.m.
    for limit in [0.0, 0.3, 1.5] {
        let config = within_limits(1.0, PidConfig::new(gains(0.3, 2.0, 0.0), DT));
        // Back-calculation leaves room for the 0.02 N.m that a period adds, which are in the output already.
        for (anti_windup, settled) in [(LAWS[2], 0.98), (LAWS[3], 1.0)] {
            let config = PidConfig {
                anti_windup,
                ..config
            };
            let pid = pid(config.with_proportional_limit(limit));
            for sign in [-1.0, 1.0] {
                let mut state = PidState::default();
                for _ in 0..20_000 {
                    pid.step(&mut state, 10.0 * sign, 0.0);
                }
                let off = (sign * state.integral_n_m - settled).abs();
                // 20 s are 133 times kp / ki; 20 000 roundings of 1 N.m.
                assert!(off < 1e-9, "{anti_windup:?} {limit}: {off}");
            }
        }
    }
}

#[test]
fn a_blocked_wheel_winds_nothing_up_with_a_limit_of_its_proportional_term() {
    let limited =
        |limit, config: PidConfig<f64>| peak_after_release(config.with_proportional_limit(limit), 50.0);
    let config = within_limits(1.0, PidConfig::new(gains(0.3, 2.0, 0.0), DT));
    for limit in [0.2, 0.6] {
        // Released from the limit of the output, without any limit of it: what the loop does by itself.
        let yardstick = {
            let pid = pid(PidConfig::new(gains(0.3, 2.0, 0.0), DT).with_proportional_limit(limit));
            let mut state = PidState {
                integral_n_m: 1.0,
                ..PidState::default()
            };
            let (mut w, mut peak) = (0.0, 0.0_f64);
            for _ in 0..20_000 {
                w += pid.step(&mut state, 10.0, w).output_n_m * DT / 0.01;
                peak = peak.max(w);
            }
            peak
        };
        for anti_windup in LAWS {
            let peak = limited(
                limit,
                PidConfig {
                    anti_windup,
                    ..config
                },
            );
            // A per cent: the output's limit holds after the release too.
            assert!(
                peak <= 1.01 * yardstick,
                "{anti_windup:?} {limit}: {peak}, {yardstick}"
            );
        }
        assert!(limited(limit, config) > 5.0 * yardstick, "it can fail");
    }
}

#[test]
fn conditioned_with_a_limited_proportional_term_is_the_loop_of_a_feasible_reference() {
    for (limit, b, kd) in [
        (0.5, 1.0, 0.0),
        (0.5, 1.0, 0.01),
        (0.3, 0.4, 0.0),
        (2.0, 1.0, 0.002),
        (0.2, 0.0, 0.0),
    ] {
        let config = PidConfig {
            proportional_weight: b,
            ..PidConfig::new(gains(0.3, 2.0, kd), DT).with_proportional_limit(limit)
        };
        let saturated = pid(PidConfig {
            anti_windup: AntiWindup::Conditioned,
            ..within_limits(1.0, config)
        });
        let free = pid(config);
        let (mut a, mut b) = (PidState::default(), PidState::default());
        let (mut saturations, mut limits) = (0, 0);
        for k in 0..2000 {
            let t = 0.01 * f64::from(k);
            let (reference, measured) = (12.0 * (0.7 * t).sin(), 3.0 * (5.0 * t).sin());
            let sample = saturated.step(&mut a, reference, measured);
            // The reference with which the other loop gives just that, by halving: its output grows with the reference.
            let mut ends = [reference - 1e4, reference + 1e4];
            let mut realised = reference;
            for _ in 0..200 {
                let output = free.step(&mut b.clone(), realised, measured).output_n_m;
                if !sample.saturated {
                    break;
                }
                ends[usize::from(output > sample.output_n_m)] = realised;
                realised = 0.5 * (ends[0] + ends[1]);
            }
            let same = free.step(&mut b, realised, measured);
            // Halved down to 1e4 * 2^-52 rad/s, times slopes of up to 10 N.m per rad/s.
            assert!(
                (same.output_n_m - sample.output_n_m).abs() < 1e-9,
                "{limit} {k}: {same:?} {sample:?}"
            );
            assert!((a.integral_n_m - b.integral_n_m).abs() < 1e-9, "{limit} {k}");
            saturations += i32::from(sample.saturated);
            limits += i32::from(sample.terms.p_n_m.abs() == limit);
        }
        assert!(
            saturations > 300 && limits > 300,
            "{limit}: both were tried: {saturations} {limits}"
        );
    }
}

proptest! {
    #[test]
    fn bounds_that_nothing_reaches_change_no_bit(
        readings in prop::collection::vec((-20.0..20.0_f64, -20.0..20.0_f64), 1..60), kd in 0.0..0.01_f64, law in 0..5_usize, after: bool,
        b in 0.0..1.0_f64,
    ) {
        let config = PidConfig {
            anti_windup: ALL_LAWS[law],
            proportional_weight: b,
            order: if after { IntegrationOrder::AfterOutput } else { IntegrationOrder::BeforeOutput },
            ..within_limits(1.0, PidConfig::new(gains(0.3, 2.0, kd), DT))
        };
        let (plain, bounded) = (pid(config), pid(config.with_integral_zone(1e9).with_proportional_limit(1e9)));
        let (mut a, mut c) = (PidState::default(), PidState::default());
        for (reference, measured) in readings {
            prop_assert_eq!(plain.step(&mut a, reference, measured), bounded.step(&mut c, reference, measured));
            prop_assert_eq!(a, c);
        }
    }

    #[test]
    fn whatever_the_bounds_outputs_are_finite_and_integrals_do_not_wind_up(
        readings in prop::collection::vec((any::<f32>(), any::<f32>()), 1..40), kp in 0.0..1e3_f32, ki in 0.0..1e3_f32,
        kd in prop::sample::select(vec![0.0, 1e-3_f32]), law in 0..5_usize, zone in 0.0..1e3_f32, limit in 0.0..10.0_f32, b in 0.0..1.0_f32,
    ) {
        let laws = [AntiWindup::None, AntiWindup::Clamp { limit_n_m: 1.0 }, AntiWindup::Conditional,
            AntiWindup::BackCalculation { tracking_time_s: 0.1 }, AntiWindup::Conditioned];
        let gains = PidGains { kp_n_m_s_rad: kp, ki_n_m_rad: ki, kd_n_m_s2_rad: kd };
        let pid = Pid::<f32>::new(PidConfig {
            anti_windup: laws[law],
            proportional_weight: b,
            output: TorqueRange { lower_n_m: -2.0, upper_n_m: 3.0 },
            ..PidConfig::new(gains, 1e-3).with_integral_zone(zone).with_proportional_limit(limit)
        }).expect("valid");
        let mut state = PidState::default();
        for (reference, measured) in readings {
            let sample = pid.step(&mut state, reference, measured);
            prop_assert!((-2.0..=3.0).contains(&sample.output_n_m) && sample.terms.p_n_m.abs() <= limit);
            prop_assert!(state.integral_n_m.is_finite() && state.derivative_n_m.is_finite());
            if (reference - measured).abs() > zone && reference.abs() <= 1e6 && measured.abs() <= 1e6 {
                prop_assert_eq!(state.integral_n_m, 0.0);
            }
        }
    }
}
