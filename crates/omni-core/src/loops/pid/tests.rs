mod bounds;

use super::*;
use proptest::prelude::*;

const DT: f64 = 1e-3;

fn gains(kp: f64, ki: f64, kd: f64) -> PidGains<f64> {
    PidGains {
        kp_n_m_s_rad: kp,
        ki_n_m_rad: ki,
        kd_n_m_s2_rad: kd,
    }
}

fn pid(config: PidConfig<f64>) -> Pid<f64> {
    Pid::new(config).expect("valid")
}

/// Output limits of +-`limit`.
fn within_limits(limit: f64, config: PidConfig<f64>) -> PidConfig<f64> {
    PidConfig {
        output: TorqueRange {
            lower_n_m: -limit,
            upper_n_m: limit,
        },
        ..config
    }
}

#[test]
fn output_is_equation_10_of_a_ramp_error() {
    let (kp, ki, kd) = (0.3, 2.0, 0.01);
    let pid = pid(PidConfig::new(gains(kp, ki, kd), DT));
    let mut state = PidState::default();
    let slope = 5.0;
    let mut terms = pid.step(&mut state, 0.0, 0.0).terms;
    let steps = 1000;
    for k in 1..=steps {
        terms = pid.step(&mut state, slope * DT * f64::from(k), 0.0).terms;
    }
    let t = DT * f64::from(steps);
    assert!((terms.p_n_m - kp * slope * t).abs() < 1e-12);
    // The right-hand rectangle rule overestimates the integral of a ramp by half a step of its last height.
    assert!((terms.i_n_m - ki * slope * t * (t + DT) / 2.0).abs() < 1e-12);
    assert!((terms.d_n_m - kd * slope).abs() < 1e-12);
}

#[test]
fn integral_after_the_output_acts_one_period_late() {
    let config = PidConfig::new(gains(0.0, 2.0, 0.0), DT);
    let before = pid(config);
    let after = pid(PidConfig {
        order: IntegrationOrder::AfterOutput,
        ..config
    });
    let (mut a, mut b) = (PidState::default(), PidState::default());
    let mut last = 0.0;
    for k in 0..20 {
        let reference = f64::from(k * k % 7) - 2.0;
        let late = after.step(&mut b, reference, 0.0).output_n_m;
        assert_eq!(late, last);
        last = before.step(&mut a, reference, 0.0).output_n_m;
    }
    assert!(last != 0.0);
}

#[test]
fn first_step_has_no_derivative_kick() {
    let pid = pid(PidConfig::new(gains(0.0, 0.0, 1.0), DT));
    let mut state = PidState::default();
    assert_eq!(pid.step(&mut state, 7.0, 0.0).output_n_m, 0.0);
    assert!((pid.step(&mut state, 7.5, 0.0).output_n_m - 500.0).abs() < 1e-9);
}

#[test]
fn filtered_derivative_of_a_ramp_approaches_it_with_the_filter_s_time_constant() {
    let (filter, slope) = (0.02, 3.0);
    let config = PidConfig {
        derivative_filter_s: filter,
        ..PidConfig::new(gains(0.0, 0.0, 1.0), DT)
    };
    let pid = pid(config);
    let mut state = PidState::default();
    pid.step(&mut state, 0.0, 0.0);
    for k in 1..=100 {
        let t = f64::from(k) * DT;
        let d = pid.step(&mut state, slope * t, 0.0).terms.d_n_m;
        // Backward Euler: (1 + dt / T)^-k instead of exp(-t / T).
        let exact = slope * (1.0 - (1.0 + DT / filter).powi(-k));
        assert!((d - exact).abs() < 1e-12, "{t}: {d} {exact}");
    }
}

#[test]
fn weights_take_the_reference_out_of_a_term_and_leave_the_measurement_in() {
    let config = PidConfig {
        proportional_weight: 0.25,
        ..PidConfig::new(gains(2.0, 0.0, 1.0), DT)
    };
    let pid = pid(config.with_derivative_on_measurement());
    let mut state = PidState::default();
    pid.step(&mut state, 0.0, 0.0);
    let kicked = pid.step(&mut state, 4.0, 0.0);
    assert_eq!((kicked.terms.p_n_m, kicked.terms.d_n_m), (2.0, 0.0));
    let moved = pid.step(&mut state, 4.0, 0.001);
    assert!((moved.terms.d_n_m + 1.0).abs() < 1e-12 && (moved.terms.p_n_m - (2.0 - 0.002)).abs() < 1e-12);
}

#[test]
fn feed_forward_alone_drives_its_own_motor_exactly() {
    // ka w' = u - kv w with u held for a period, solved exactly: the reference must be met at every sample.
    let (kv, ka, dt) = (0.02, 0.004, 0.01_f64);
    for (kv, ka) in [(kv, ka), (0.0, ka), (1e-9, ka)] {
        let ff = FeedForward {
            static_n_m: 0.0,
            velocity_n_m_s_rad: kv,
            acceleration_n_m_s2_rad: ka,
        };
        let pid = pid(PidConfig {
            feed_forward: ff,
            ..PidConfig::new(gains(0.0, 0.0, 0.0), dt)
        });
        let mut state = PidState::default();
        pid.step(&mut state, 0.0, 0.0);
        let mut w = 0.0;
        for k in 1..50 {
            let reference = 3.0 * (0.3 * f64::from(k)).sin();
            let u = pid.step(&mut state, reference, w).output_n_m;
            let decay = (-kv * dt / ka).exp();
            let gain = if kv > 0.0 {
                -(-kv * dt / ka).exp_m1() / kv
            } else {
                dt / ka
            };
            w = decay * w + gain * u;
            assert!((w - reference).abs() < 1e-9, "{w} {reference}");
        }
    }
    let friction = FeedForward {
        static_n_m: 0.5,
        ..FeedForward::none()
    };
    let pid = pid(PidConfig {
        feed_forward: friction,
        ..PidConfig::new(gains(0.0, 0.0, 0.0), dt)
    });
    let at = |r| pid.step(&mut PidState::default(), r, 0.0).output_n_m;
    assert_eq!([at(-1.0), at(0.0), at(2.0)], [-0.5, 0.0, 0.5]);
}

/// Every law but none, with numbers that suit a limit of 1 N.m and the gains of the tests.
const LAWS: [AntiWindup<f64>; 4] = [
    AntiWindup::Clamp { limit_n_m: 1.0 },
    AntiWindup::Conditional,
    AntiWindup::BackCalculation {
        tracking_time_s: 0.15,
    },
    AntiWindup::Conditioned,
];

/// A wheel of inertia 0.01 kg.m2 held for `blocked_s`, then released: the largest velocity afterwards.
fn peak_after_release(config: PidConfig<f64>, blocked_s: f64) -> f64 {
    let pid = pid(config);
    let (mut state, mut w, mut peak) = (PidState::default(), 0.0, 0.0_f64);
    let blocked = (blocked_s / DT).round() as usize;
    for k in 0..blocked + 10_000 {
        let u = pid.step(&mut state, 10.0, w).output_n_m;
        if k >= blocked {
            w += u * DT / 0.01;
            peak = peak.max(w);
        }
    }
    peak
}

#[test]
fn a_blocked_wheel_overshoots_with_its_time_at_the_limit_only_without_anti_windup() {
    let config = within_limits(1.0, PidConfig::new(gains(0.3, 2.0, 0.0), DT));
    // Wound up to 100 N.m, then 100 rad/s faster every second: back below the limit when 100 t^2 +
    // 30 t = 100, t = 0.86 s.
    assert!(peak_after_release(config, 5.0) > 80.0);
    for anti_windup in LAWS {
        let config = PidConfig {
            anti_windup,
            ..config
        };
        let (short, long) = (peak_after_release(config, 1.0), peak_after_release(config, 50.0));
        // The integral has settled after one second (0.15 s is the slowest time constant), so that more time changes
        // nothing.
        assert!((short - long).abs() < 0.02, "{anti_windup:?}: {short} {long}");
        assert!(long < 17.0, "{anti_windup:?}: {long}");
    }
}

#[test]
fn conditioned_output_is_that_of_the_reference_the_loop_could_follow() {
    let config = within_limits(1.0, PidConfig::new(gains(0.3, 2.0, 0.01), DT));
    let saturated = pid(PidConfig {
        anti_windup: AntiWindup::Conditioned,
        ..config
    });
    let free = pid(PidConfig {
        output: TorqueRange::unlimited(),
        ..config
    });
    let (mut a, mut b) = (PidState::default(), PidState::default());
    for k in 0..200 {
        let measured = 0.5 * (0.1 * f64::from(k)).sin();
        let slope = free.term_slopes(b.last.is_some()).sum();
        let sample = saturated.step(&mut a, 10.0, measured);
        let realised = 10.0 + (sample.output_n_m - sample.terms.sum()) / slope;
        let same = free.step(&mut b, realised, measured);
        assert!((same.output_n_m - sample.output_n_m).abs() < 1e-9, "{k}");
        assert!((a.integral_n_m - b.integral_n_m).abs() < 1e-9, "{k}");
    }
}

#[test]
fn conditioned_without_a_slope_holds_the_integral() {
    // A pure integrator that acts one period late: the reference moves nothing at once.
    let config = PidConfig {
        order: IntegrationOrder::AfterOutput,
        anti_windup: AntiWindup::Conditioned,
        ..within_limits(1.0, PidConfig::new(gains(0.0, 2.0, 0.0), DT))
    };
    let mut state = PidState::default();
    for _ in 0..5000 {
        pid(config).step(&mut state, 10.0, 0.0);
    }
    assert!(
        state.integral_n_m < 1.03,
        "one period past the limit at most: {}",
        state.integral_n_m
    );
}

#[test]
fn tracking_makes_new_gains_and_automatic_mode_start_where_the_output_was() {
    let manual = 0.42;
    for order in [IntegrationOrder::BeforeOutput, IntegrationOrder::AfterOutput] {
        let config = PidConfig {
            order,
            derivative_filter_s: 0.01,
            ..PidConfig::new(gains(0.7, 1.5, 0.02), DT)
        };
        let pid = pid(config);
        let mut state = PidState::default();
        for k in 0..10 {
            pid.track(&mut state, manual, 3.0, 0.1 * f64::from(k));
        }
        let output = pid.step(&mut state, 3.0, 0.9).output_n_m;
        assert!((output - manual).abs() < 1e-12, "{order:?}: {output}");
    }
    // No integral, nothing to set; nonsense sets nothing.
    let proportional = pid(PidConfig::new(gains(0.7, 0.0, 0.0), DT));
    let mut state = PidState::default();
    proportional.track(&mut state, manual, 3.0, 0.0);
    assert_eq!(state.integral_n_m, 0.0);
    pid(PidConfig::new(gains(0.7, 1.0, 0.0), DT)).track(&mut state, f64::NAN, 3.0, 0.0);
    assert_eq!(state.integral_n_m, 0.0);
}

#[test]
fn every_parameter_is_checked_by_name() {
    let good = PidConfig::new(gains(0.3, 2.0, 0.01), DT);
    let named = |config| Pid::<f64>::new(config).expect_err("refused").parameter;
    let with = |g: PidGains<f64>| PidConfig { gains: g, ..good };
    assert_eq!(named(with(gains(-1.0, 0.0, 0.0))), "kp_n_m_s_rad");
    assert_eq!(named(with(gains(0.0, f64::NAN, 0.0))), "ki_n_m_rad");
    assert_eq!(named(with(gains(0.0, 0.0, f64::INFINITY))), "kd_n_m_s2_rad");
    assert_eq!(
        named(PidConfig {
            period_s: 0.0,
            ..good
        }),
        "period_s"
    );
    assert_eq!(
        named(PidConfig {
            proportional_weight: 1.1,
            ..good
        }),
        "proportional_weight"
    );
    assert_eq!(
        named(PidConfig {
            derivative_weight: -0.1,
            ..good
        }),
        "derivative_weight"
    );
    assert_eq!(
        named(PidConfig {
            derivative_filter_s: -0.1,
            ..good
        }),
        "derivative_filter_s"
    );
    let ff = |f: FeedForward<f64>| PidConfig {
        feed_forward: f,
        ..good
    };
    let none = FeedForward::none();
    assert_eq!(
        named(ff(FeedForward {
            static_n_m: -1.0,
            ..none
        })),
        "static_n_m"
    );
    assert_eq!(
        named(ff(FeedForward {
            velocity_n_m_s_rad: f64::NAN,
            ..none
        })),
        "velocity_n_m_s_rad"
    );
    assert_eq!(
        named(ff(FeedForward {
            acceleration_n_m_s2_rad: -1.0,
            ..none
        })),
        "acceleration_n_m_s2_rad"
    );
    let law = |anti_windup| PidConfig { anti_windup, ..good };
    assert_eq!(named(law(AntiWindup::Clamp { limit_n_m: -1.0 })), "limit_n_m");
    assert_eq!(
        named(law(AntiWindup::BackCalculation {
            tracking_time_s: DT / 2.0
        })),
        "tracking_time_s"
    );
    let output = |lower_n_m, upper_n_m| PidConfig {
        output: TorqueRange { lower_n_m, upper_n_m },
        ..good
    };
    assert_eq!(named(good.with_integral_zone(-0.1)), "integral_zone_rad_s");
    assert_eq!(
        named(good.with_proportional_limit(f64::NAN)),
        "proportional_limit_n_m"
    );
    assert_eq!(named(output(0.1, 1.0)), "output.lower_n_m");
    assert_eq!(named(output(-1.0, f64::NAN)), "output.upper_n_m");
}

#[test]
fn nonsense_changes_nothing_and_yields_the_integral_alone() {
    let pid = pid(PidConfig::new(gains(1.0, 1.0, 1.0), DT));
    let mut state = PidState {
        integral_n_m: 0.25,
        ..PidState::default()
    };
    for (reference, measured) in [(f64::NAN, 0.0), (0.0, f64::INFINITY), (1e300, 0.0)] {
        let before = state;
        assert_eq!(pid.step(&mut state, reference, measured).output_n_m, 0.25);
        assert_eq!(state, before);
    }
}

#[test]
fn an_infinite_state_starts_afresh_without_output_limits_too() {
    let pid = pid(PidConfig::new(gains(1.0, 1.0, 1.0), DT));
    for infinite in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        for mut state in [
            PidState {
                integral_n_m: infinite,
                ..PidState::default()
            },
            PidState {
                derivative_n_m: infinite,
                ..PidState::default()
            },
        ] {
            let unread = pid.step(&mut { state }, 1.0, f64::NAN).output_n_m;
            assert!(unread.is_finite(), "{infinite}: {unread} without a measurement");
            let first = pid.step(&mut state, 1.0, 0.0).output_n_m;
            let second = pid.step(&mut state, 1.0, 0.0).output_n_m;
            assert!(
                first.is_finite() && second.is_finite(),
                "{infinite}: {first}, {second}"
            );
        }
    }
}

proptest! {
    #[test]
    fn output_is_finite_and_within_limits_for_any_number_at_all(
        readings in prop::collection::vec((any::<f32>(), any::<f32>()), 1..40),
        kp in 0.0..1e6_f32, ki in 0.0..1e6_f32, kd in 0.0..1e6_f32, law in 0..5_usize,
    ) {
        let laws = [
            AntiWindup::None,
            AntiWindup::Clamp { limit_n_m: 1.0 },
            AntiWindup::Conditional,
            AntiWindup::BackCalculation { tracking_time_s: 0.1 },
            AntiWindup::Conditioned,
        ];
        let gains = PidGains { kp_n_m_s_rad: kp, ki_n_m_rad: ki, kd_n_m_s2_rad: kd };
        let pid = Pid::<f32>::new(PidConfig {
            anti_windup: laws[law],
            output: TorqueRange { lower_n_m: -2.0, upper_n_m: 3.0 },
            ..PidConfig::new(gains, 1e-3)
        }).expect("valid");
        let mut state = PidState::default();
        for (reference, measured) in readings {
            let output = pid.step(&mut state, reference, measured).output_n_m;
            prop_assert!((-2.0..=3.0).contains(&output));
            prop_assert!(state.integral_n_m.is_finite() && state.derivative_n_m.is_finite());
        }
    }

    #[test]
    fn an_unsaturated_loop_is_linear(
        a in prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64), 20), b in prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64), 20),
        k in -3.0..3.0_f64,
    ) {
        let ff = FeedForward { static_n_m: 0.0, velocity_n_m_s_rad: 0.1, acceleration_n_m_s2_rad: 0.01 };
        let config = PidConfig { derivative_filter_s: 0.005, proportional_weight: 0.7, derivative_weight: 0.3,
            feed_forward: ff, ..PidConfig::new(gains(0.5, 3.0, 0.001), DT) };
        let pid = pid(config);
        let run = |inputs: &dyn Fn(usize) -> (f64, f64)| {
            let mut state = PidState::default();
            (0..20).map(|i| { let (r, y) = inputs(i); pid.step(&mut state, r, y).output_n_m }).fold(0.0, |_, u| u)
        };
        let (ua, ub) = (run(&|i| a[i]), run(&|i| b[i]));
        let sum = run(&|i| (a[i].0 + k * b[i].0, a[i].1 + k * b[i].1));
        // Twenty steps of terms up to 0.01 / DT * 10 = 100 N.m, rounded at 1e-16 each.
        prop_assert!((sum - (ua + k * ub)).abs() < 1e-10);
    }
}
