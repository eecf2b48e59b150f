use super::*;
use crate::{Coordination, Integral, Pid, PidConfig, PidGains, Saturation, TorqueLimit};
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
            assert!((a - b).abs() < 1e-14, "{policy:?}"); // the projection of `load_sharing` rounds
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
        saturation: Saturation::ScaleReference { floor: 0.0 },
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
    let controller = controller(Coordination::load_sharing(), 2.0);
    let mut state = ControlState::default();
    for k in 0..2000 {
        let mut measured = layout_velocities(0.3);
        measured.rad_s[3] -= 2.0 * (1.0 + 0.01 * f64::from(k)).sin(); // wheel 4 disagrees all the time
        controller.step(&mut state, &FORWARD, &measured);
    }
    let integrals = state.pid.map(|pid| pid.integral_n_m);
    let residual = controller.kinematics().residual(&integrals.into()).rad_s;
    let largest = integrals.iter().fold(0.0_f64, |m, i| m.max(i.abs()));
    assert!(largest > 0.01, "the test integrated something: {largest}");
    // 2000 additions, each rounded at 1e-16 of a value below 1.
    assert!(residual.iter().all(|r| r.abs() < 1e-12), "{residual:?}");
}

#[test]
fn shared_integral_without_a_vehicle_is_refused() {
    let error = WheelController::new(config::<3>(Coordination::load_sharing(), 1.0)).expect_err("no layout");
    assert_eq!(error.parameter, "integral");
}

#[test]
fn floor_outside_0_to_1_is_refused() {
    for floor in [-0.1, 1.1, f64::NAN] {
        let policy = Coordination {
            saturation: Saturation::ScaleReference { floor },
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
                    Saturation::ScaleReference { .. } => {
                        // The realised terms are those of a plain PID fed the reduced reference.
                        let pid = Pid::new(PidConfig::new(GAINS, 1e-3)).expect("valid");
                        let reduced = s.common_factor * s.reference.rad_s[i];
                        let alone = pid.step(&mut before.pid[i].clone(), reduced, measured[i]).terms;
                        prop_assert!((alone.sum() - formed).abs() < 1e-9);
                    }
                }
            }
        }
    }
}
