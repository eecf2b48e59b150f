use super::*;
use crate::loops::{
    AntiWindup, Coordination, Integral, LastStep, Pid, PidConfig, PidGains, PidState, Saturation,
};
use crate::motor::TorqueLimit;
use proptest::prelude::*;

const GAINS: PidGains<f64> = PidGains {
    kp_n_m_s_rad: 0.3,
    ki_n_m_rad: 2.0,
    kd_n_m_s2_rad: 0.002,
};

fn config<const N: usize>(coordination: Coordination<f64>, limit: f64) -> WheelControlConfig<f64, N> {
    let limits = [TorqueLimit::constant(limit).expect("valid"); N];
    WheelControlConfig {
        pid: PidConfig::new(GAINS, 1e-3),
        limits,
        coordination,
    }
}

fn layout() -> WheelLayout<f64, 7> {
    WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid")
}

fn controller(coordination: Coordination<f64>, limit: f64) -> Controller<f64, 7> {
    Controller::new(&layout(), config(coordination, limit)).expect("valid")
}

const FORWARD: BodyTwist<f64> = BodyTwist {
    vx_m_s: 0.3,
    vy_m_s: 0.0,
    wz_rad_s: 0.0,
};

fn policies() -> [Coordination<f64>; 4] {
    Coordination::<f64>::PRESETS.map(|name| Coordination::preset(name).expect("a preset"))
}

#[test]
fn wheels_3_and_7_are_limited_in_reverse() {
    // Driving forward they turn backwards: eq. (11) as printed would let any negative torque pass.
    for policy in policies() {
        let sample =
            controller(policy, 0.5).step(&mut ControlState::default(), &FORWARD, &WheelVelocities::zero());
        for i in [2, 6] {
            assert!(sample.wheels.requested.n_m[i] < -1.3, "{policy:?}");
            assert!(sample.wheels.saturated[i], "{policy:?}");
            assert!(
                (sample.wheels.applied.n_m[i] + 0.5).abs() < 1e-12,
                "{policy:?}: {:?}",
                sample.wheels.applied.n_m
            );
        }
    }
}

#[test]
fn policies_agree_while_nothing_saturates_and_no_wheel_disagrees() {
    let measured = layout_velocities(0.29);
    let reference = controller(Coordination::independent(), 100.0).step(
        &mut ControlState::default(),
        &FORWARD,
        &measured,
    );
    for policy in policies() {
        let sample = controller(policy, 100.0).step(&mut ControlState::default(), &FORWARD, &measured);
        assert_eq!(sample.wheels.common_factor, 1.0);
        for (a, b) in sample.wheels.applied.n_m.iter().zip(reference.wheels.applied.n_m) {
            assert!((a - b).abs() < 1e-14, "{policy:?}"); // the projection of `shared_integral` rounds
        }
    }
}

fn layout_velocities(vx: f64) -> WheelVelocities<f64, 7> {
    Kinematics::new(&layout()).expect("valid").inverse(&BodyTwist {
        vx_m_s: vx,
        ..FORWARD
    })
}

#[test]
fn ratio_of_references_is_kept_and_nothing_winds_up_while_a_wheel_is_blocked() {
    let policy = Coordination {
        saturation: Saturation::ScaleReferences { floor: 0.0 },
        integral: Integral::PerWheel,
    };
    let wheels = WheelController::new(config::<2>(policy, 1.0)).expect("valid");
    let mut state = ControlState::default();
    let mut last = 0.0;
    for _ in 0..5000 {
        // Wheel 1 is blocked for five seconds; wheel 2 follows the reduced reference at once.
        let sample = wheels.step(&mut state, &[4.0, 8.0].into(), &[0.0, 8.0 * last].into());
        last = sample.common_factor;
        assert!(
            sample.applied.n_m[0] <= 1.0 && sample.i_n_m[0] <= 1.0 + 1e-9,
            "{sample:?}"
        );
    }
    assert!(last < 0.01, "the other wheel was brought down with it: {last}");
    // Free again and at the reference: the torque falls below the limit at once, where a wound-up integral of
    // ki * 4 rad/s * 5 s = 40 N.m would hold it there for many seconds.
    let sample = wheels.step(&mut state, &[4.0, 8.0].into(), &[4.2, 8.0].into());
    assert!(sample.applied.n_m[0] < 1.0, "{sample:?}");
}

#[test]
fn shared_integral_never_leaves_the_range_of_the_kinematics() {
    let controller = controller(Coordination::shared_integral(), 2.0);
    let mut state = ControlState::default();
    for k in 0..2000 {
        let mut measured = layout_velocities(0.3);
        measured.rad_s[3] -= 2.0 * (1.0 + 0.01 * f64::from(k)).sin(); // wheel 4 disagrees all the time
        controller.step(&mut state, &FORWARD, &measured);
    }
    let integrals = state.integral_n_m;
    let residual = controller.kinematics().residual(&integrals.into()).rad_s;
    let largest = integrals.iter().fold(0.0_f64, |m, i| m.max(i.abs()));
    assert!(largest > 0.01, "the test integrated something: {largest}");
    // 2000 additions, each rounded at 1e-16 of a value below 1.
    assert!(residual.iter().all(|r| r.abs() < 1e-12), "{residual:?}");
}

/// Largest forward velocity over the commanded one, less 1, after 30 s against `force_n` (infinite:
/// a wall) have ended. A vehicle of 20 kg whose wheels grip.
fn vehicle_overshoot(config: WheelControlConfig<f64, 7>, force_n: f64) -> f64 {
    let controller = Controller::new(&layout(), config).expect("valid");
    let (mut state, mut vx, mut peak) = (ControlState::default(), 0.3, 0.0_f64);
    for k in 0..60_000 {
        let sample = controller.step(&mut state, &FORWARD, &layout_velocities(vx));
        let torque: f64 = [0, 3, 4]
            .iter()
            .map(|&i| sample.wheels.applied.n_m[i])
            .sum::<f64>()
            - [2, 6].iter().map(|&i| sample.wheels.applied.n_m[i]).sum::<f64>();
        let against = if k < 30_000 { force_n } else { 0.0 };
        vx += 1e-3 * (torque / 0.066 - 2.0 * vx - if against.is_finite() { against } else { 0.0 }) / 20.0;
        if against.is_infinite() {
            vx = 0.0;
        }
        if k >= 30_000 {
            peak = peak.max(vx / 0.3 - 1.0);
        }
    }
    peak
}

#[test]
fn a_vehicle_released_from_a_wall_overshoots_no_more_than_without_limits() {
    let gains = PidGains {
        kd_n_m_s2_rad: 0.0,
        ..GAINS
    };
    let make = |saturation, integral, anti_windup, limit| WheelControlConfig {
        pid: PidConfig {
            anti_windup,
            ..PidConfig::new(gains, 1e-3)
        },
        limits: [TorqueLimit::constant(limit).expect("valid"); 7],
        coordination: Coordination { saturation, integral },
    };
    let most = 5.0 / 0.066; // five wheels of 1 N.m
    for integral in [Integral::PerWheel, Integral::Shared] {
        let yardstick = vehicle_overshoot(
            make(Saturation::Clip, integral, AntiWindup::None, 1e6),
            most - 2.0 * 0.3,
        );
        assert!(yardstick > 0.05, "{yardstick}");
        let limited = [
            (Saturation::ScaleReferences { floor: 0.0 }, AntiWindup::None),
            (Saturation::ScaleReferences { floor: 0.3 }, AntiWindup::None),
            (Saturation::Clip, AntiWindup::Clamp { limit_n_m: 1.0 }),
            (Saturation::Clip, AntiWindup::Conditional),
            (
                Saturation::Clip,
                AntiWindup::BackCalculation {
                    tracking_time_s: 0.15,
                },
            ),
            (Saturation::Clip, AntiWindup::Conditioned),
        ];
        for (saturation, anti_windup) in limited {
            for force in [1.05 * most, f64::INFINITY] {
                let peak = vehicle_overshoot(make(saturation, integral, anti_windup, 1.0), force);
                assert!(
                    peak <= 1.05 * yardstick,
                    "{integral:?} {saturation:?} {anti_windup:?}: {peak} {yardstick}"
                );
            }
        }
        let wound_up = vehicle_overshoot(
            make(Saturation::Clip, integral, AntiWindup::None, 1.0),
            f64::INFINITY,
        );
        assert!(
            wound_up > 2.0 * yardstick,
            "{wound_up} {yardstick}: this test can fail"
        );
    }
}

#[test]
fn a_conditional_shared_integral_stops_as_a_whole() {
    let config = WheelControlConfig {
        pid: PidConfig {
            anti_windup: AntiWindup::Conditional,
            ..PidConfig::new(
                PidGains {
                    kd_n_m_s2_rad: 0.0,
                    ..GAINS
                },
                1e-3,
            )
        },
        ..config(Coordination::shared_integral(), 0.5)
    };
    let controller = Controller::new(&layout(), config).expect("valid");
    let mut state = ControlState::default();
    // Blocked: side wheels ask for 1.36 N.m of 0.5 from the first step on, the transverse wheels for nothing.
    for _ in 0..20_000 {
        controller.step(&mut state, &FORWARD, &WheelVelocities::zero());
    }
    // A limit counts from its eighth period on: the seven before take in 2 N.m/rad times 4.55
    // rad/s, 0.064 N.m together.
    assert!(
        state.integral_n_m.iter().all(|i| i.abs() < 0.065),
        "{:?}",
        state.integral_n_m
    );
}

#[test]
fn clamped_shared_integrals_stay_in_the_range_of_the_kinematics() {
    let clamp = PidConfig {
        anti_windup: AntiWindup::Clamp { limit_n_m: 0.5 },
        ..PidConfig::new(GAINS, 1e-3)
    };
    let controller = Controller::new(
        &layout(),
        WheelControlConfig {
            pid: clamp,
            ..config(Coordination::shared_integral(), 9.0)
        },
    )
    .expect("valid");
    let mut state = ControlState::default();
    let command = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    };
    for _ in 0..5000 {
        controller.step(&mut state, &command, &WheelVelocities::zero());
    }
    let integrals = WheelVelocities {
        rad_s: state.integral_n_m,
    };
    let largest = integrals.rad_s.iter().fold(0.0_f64, |m, i| m.max(i.abs()));
    assert!(
        (largest - 0.5).abs() < 1e-12,
        "the fullest wheel is at the clamp: {largest}"
    );
    // Scaled by one factor, not cut wheel by wheel.
    assert!(
        controller
            .kinematics()
            .residual(&integrals)
            .rad_s
            .iter()
            .all(|r| r.abs() < 1e-12)
    );
}

#[test]
fn shared_integral_without_a_vehicle_is_refused() {
    let error =
        WheelController::new(config::<3>(Coordination::shared_integral(), 1.0)).expect_err("no layout");
    assert_eq!(error.parameter, "integral");
}

#[test]
fn floor_outside_0_to_1_is_refused() {
    for floor in [-0.1, 1.1, f64::NAN] {
        let policy = Coordination {
            saturation: Saturation::ScaleReferences { floor },
            integral: Integral::PerWheel,
        };
        assert_eq!(
            Controller::new(&layout(), config(policy, 1.0))
                .expect_err("refused")
                .parameter,
            "floor"
        );
    }
}

proptest! {
    #[test]
    fn applied_torque_is_within_limits_and_the_law_is_affine_in_the_common_factor(
        vx in -1.0..1.0_f64, vy in -1.0..1.0_f64, wz in -2.0..2.0_f64, limit in 0.05..3.0_f64,
        measured in prop::collection::vec(prop::array::uniform7(-20.0..20.0_f64), 1..20), which in 0..4_usize,
    ) {
        let policy = policies()[which];
        let controller = controller(policy, limit);
        let command = BodyTwist { vx_m_s: vx, vy_m_s: vy, wz_rad_s: wz };
        let mut state = ControlState::default();
        for measured in measured {
            let before = state;
            let s = controller.step(&mut state, &command, &measured.into()).wheels;
            for i in 0..7 {
                prop_assert!(s.applied.n_m[i].abs() <= limit);
                let formed = s.p_n_m[i] + s.i_n_m[i] + s.d_n_m[i];
                match policy.saturation {
                    Saturation::Clip => prop_assert_eq!(s.applied.n_m[i], formed.limited(-limit, limit)),
                    Saturation::ScaleTorques => prop_assert!((s.applied.n_m[i] - s.common_factor * formed).abs() < 1e-12),
                    Saturation::ScaleReferences { .. } => {
                        // The realised terms are those of a plain PID fed the reduced reference.
                        let pid = Pid::new(PidConfig::new(GAINS, 1e-3)).expect("valid");
                        let reduced = s.common_factor * s.reference.rad_s[i];
                        let last = LastStep {
                            reference_rad_s: before.last_reference_rad_s[i],
                            measured_rad_s: before.last_measured_rad_s[i],
                        };
                        let mut one = PidState {
                            integral_n_m: before.integral_n_m[i],
                            derivative_n_m: before.derivative_n_m[i],
                            last: before.started[i].then_some(last),
                        };
                        let alone = pid.step(&mut one, reduced, measured[i]).terms;
                        prop_assert!((alone.sum() - formed).abs() < 1e-9);
                    }
                }
            }
        }
    }
}
