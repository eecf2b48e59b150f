//! Integral zones and limits of proportional terms of coordinated wheels.

use super::*;
use crate::geometry::{BodyTwist, WheelLayout};
use crate::loops::Controller;

#[test]
fn a_released_wheel_overshoots_no_more_with_a_limit_of_its_proportional_term() {
    let (kp, ki) = (0.3, 2.0);
    for bound in [0.3, 0.8] {
        let config = gains(kp, ki).with_proportional_limit(bound);
        let yardstick = overshoots_no_more(config, kp / ki, &[1.05, f64::INFINITY]);
        let wound_up = overshoot(&controller(config, LIMIT, Saturation::Clip), |k| {
            (k < 30_000).then_some(2.0 * LIMIT)
        });
        assert!(
            wound_up > 2.0 * yardstick,
            "it can fail: {wound_up} against {yardstick}"
        );
    }
}

#[test]
fn one_error_beyond_the_zone_clears_a_shared_integral_and_a_wheel_s_own_only() {
    let layout = WheelLayout::mecanum4(0.6, 0.4, 0.1).expect("valid");
    let build = |integral| {
        let coordination = Coordination {
            saturation: Saturation::Clip,
            integral,
        };
        Controller::new(
            &layout,
            WheelControlConfig {
                pid: gains(0.3, 2.0).with_integral_zone(2.0),
                limits: [TorqueLimit::constant(100.0).expect("valid"); 4],
                coordination,
            },
        )
        .expect("valid")
    };
    let ahead = BodyTwist {
        vx_m_s: 0.1,
        ..BodyTwist::ZERO
    };
    let integrals = |integral, second: f64| {
        let (controller, mut state) = (build(integral), ControlState::default());
        controller.step(&mut state, &ahead, &[0.0; 4].into());
        assert!(state.integral_n_m.iter().all(|i| (i - 2.0 * DT).abs() < 1e-15)); // 1 rad/s each
        let sample = controller.step(&mut state, &ahead, &[0.0, second, 0.0, 0.0].into());
        assert_eq!(sample.wheels.i_n_m, state.integral_n_m); // taken in before the output
        state.integral_n_m.map(|i| i > 0.0)
    };
    assert_eq!(integrals(Integral::PerWheel, -1.5), [true, false, true, true]);
    assert_eq!(integrals(Integral::PerWheel, -0.5), [true; 4]);
    // Projected on what a vehicle can do, a wheel's error is three quarters of it: 1 + 0.75 * 1.2
    // is within the zone, 1 + 0.75 * 1.5 is beyond.
    assert_eq!(integrals(Integral::Shared, -1.2), [true; 4]);
    assert_eq!(integrals(Integral::Shared, -1.5), [false; 4]);
}

proptest! {
    #[test]
    fn with_all_references_reduced_torques_are_those_of_the_reduced_references(
        reference in prop::array::uniform3(-20.0..20.0_f64), measured in prop::array::uniform3(-10.0..10.0_f64),
        integral in prop::array::uniform3(-0.8..0.8_f64), bound in 0.0..2.0_f64, b in 0.0..1.0_f64, floor in 0.0..0.5_f64,
        zone in prop::sample::select(vec![5.0, f64::INFINITY]),
    ) {
        let config = PidConfig { proportional_weight: b, ..gains(0.3, 200.0).with_proportional_limit(bound).with_integral_zone(zone) };
        let scaled = controller::<3>(config, 1.0, Saturation::ScaleReferences { floor });
        let state = || ControlState { integral_n_m: integral, ..ControlState::default() };
        let sample = scaled.step(&mut state(), &reference.into(), &measured.into());
        let s = sample.common_factor;
        prop_assert!((floor..=1.0).contains(&s));
        // Which errors are within the zone is asked of the whole references.
        let mut torques = [0.0; 3];
        let mut at_limit = false;
        let mut beyond = false;
        for i in 0..3 {
            let counts = (reference[i] - measured[i]).abs() <= zone;
            let torque = |s: f64| {
                let p = (0.3 * (b * s * reference[i] - measured[i])).clamp(-bound, bound);
                p + if counts { integral[i] + 0.2 * (s * reference[i] - measured[i]) } else { 0.0 }
            };
            torques[i] = torque(s);
            // Towards its own reference: the other limit is left to the final cut.
            let towards = |s: f64| torque(s) * reference[i].signum();
            beyond |= towards(1.0) > 1.0 + 1e-9 && towards(1.0) > towards(0.0) + 1e-9;
            at_limit |= towards(s) >= 1.0 - 1e-9;
            prop_assert!((sample.applied.n_m[i] - torques[i].clamp(-1.0, 1.0)).abs() < 1e-9, "{i} {torques:?} {sample:?}");
            prop_assert!(s <= floor || towards(s) <= 1.0 + 1e-9, "{i} {torques:?} {sample:?}");
        }
        // The largest such factor: some wheel is at its limit with it.
        prop_assert!((s < 1.0 || !beyond) && (s == 1.0 || at_limit), "{s} {torques:?}");
    }

    #[test]
    fn bounds_that_nothing_reaches_change_nothing(
        readings in prop::collection::vec((prop::array::uniform3(-20.0..20.0_f64), prop::array::uniform3(-20.0..20.0_f64)), 1..40),
        which in 0..11_usize, kd in prop::sample::select(vec![0.0, 1e-3_f64]),
    ) {
        let (saturation, anti_windup) = laws(0.15)[which];
        let mut config = PidConfig { anti_windup, ..gains(0.3, 2.0) };
        config.gains.kd_n_m_s2_rad = kd;
        let plain = controller::<3>(config, LIMIT, saturation);
        let bounded = controller::<3>(config.with_integral_zone(1e9).with_proportional_limit(1e9), LIMIT, saturation);
        let (mut a, mut b) = (ControlState::default(), ControlState::default());
        for (reference, measured) in readings {
            let expected = plain.step(&mut a, &reference.into(), &measured.into());
            let sample = bounded.step(&mut b, &reference.into(), &measured.into());
            for i in 0..3 {
                // Sums of up to 40 N.m in another order.
                prop_assert!((sample.applied.n_m[i] - expected.applied.n_m[i]).abs() < 1e-12);
                prop_assert!((a.integral_n_m[i] - b.integral_n_m[i]).abs() < 1e-12);
            }
        }
    }
}
