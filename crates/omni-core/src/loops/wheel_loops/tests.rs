mod bounds;

use super::*;
use crate::loops::{AntiWindup, PidConfig, PidGains, Saturation};
use crate::motor::TorqueLimit;
use proptest::prelude::*;
use std::vec;

const DT: f64 = 1e-3;

/// Wheels with inertia and friction, the plant of section 3.3; a load is a torque against the motion.
struct Plant<const N: usize> {
    inertia: f64,
    friction: f64,
    velocity: [f64; N],
}

impl<const N: usize> Plant<N> {
    /// One period, semi-implicit: friction of the new velocity. `blocked` wheels stand still.
    fn advance(&mut self, torque: &[f64; N], load: &[f64; N], blocked: &[bool; N]) {
        for i in 0..N {
            let free = self.velocity[i] + DT / self.inertia * (torque[i] - load[i]);
            self.velocity[i] = if blocked[i] {
                0.0
            } else {
                free / (1.0 + DT / self.inertia * self.friction)
            };
        }
    }
}

fn controller<const N: usize>(
    config: PidConfig<f64>,
    limit: f64,
    saturation: Saturation<f64>,
) -> WheelController<f64, N> {
    let coordination = Coordination {
        saturation,
        integral: Integral::PerWheel,
    };
    let limits = [TorqueLimit::constant(limit).expect("valid"); N];
    WheelController::new(WheelControlConfig {
        pid: config,
        limits,
        coordination,
    })
    .expect("valid")
}

/// Every way of keeping torques within limits.
fn saturations<R: Real>(floor: R) -> [Saturation<R>; 3] {
    [
        Saturation::Clip,
        Saturation::ScaleTorques,
        Saturation::ScaleReferences { floor },
    ]
}

fn gains(kp: f64, ki: f64) -> PidConfig<f64> {
    PidConfig::new(
        PidGains {
            kp_n_m_s_rad: kp,
            ki_n_m_rad: ki,
            kd_n_m_s2_rad: 0.0,
        },
        DT,
    )
}

const REFERENCE: [f64; 3] = [10.0, 10.0, 5.0];
/// Torque limit of the release experiments \[N.m\].
const LIMIT: f64 = 1.0;

/// Largest velocity of wheel 1 above its reference, over its reference, after a load on it is released.
fn overshoot(controller: &WheelController<f64, 3>, load: impl Fn(usize) -> Option<f64>) -> f64 {
    let mut plant = Plant {
        inertia: 0.01,
        friction: 0.002,
        velocity: REFERENCE,
    };
    let mut state = ControlState::default();
    let mut peak = 0.0_f64;
    for k in 0..60_000 {
        let sample = controller.step(&mut state, &REFERENCE.into(), &plant.velocity.into());
        let (blocked, torque) = match load(k) {
            Some(torque) => (torque.is_infinite(), torque),
            None => (false, 0.0),
        };
        let against = if blocked { 0.0 } else { torque };
        plant.advance(
            &sample.applied.n_m,
            &[against, 0.0, 0.0],
            &[blocked, false, false],
        );
        if load(k).is_none() && k > 30_000 {
            peak = peak.max(plant.velocity[0] / REFERENCE[0] - 1.0);
        }
    }
    peak
}

/// The laws that must not wind up, under every way of keeping torques within limits.
fn laws(tracking_time_s: f64) -> [(Saturation<f64>, AntiWindup<f64>); 11] {
    let conditioned = AntiWindup::Conditioned;
    let back = AntiWindup::BackCalculation { tracking_time_s };
    let clamp = AntiWindup::Clamp { limit_n_m: LIMIT };
    [
        (Saturation::ScaleReferences { floor: 0.0 }, AntiWindup::None),
        (Saturation::ScaleReferences { floor: 0.3 }, AntiWindup::None),
        (Saturation::ScaleReferences { floor: 1.0 }, AntiWindup::None),
        (Saturation::Clip, clamp),
        (Saturation::Clip, AntiWindup::Conditional),
        (Saturation::Clip, back),
        (Saturation::Clip, conditioned),
        (Saturation::ScaleTorques, clamp),
        (Saturation::ScaleTorques, AntiWindup::Conditional),
        (Saturation::ScaleTorques, back),
        (Saturation::ScaleTorques, conditioned),
    ]
}

/// Under every law a released wheel overshoots no more than a loop without limit that is released
/// from the same torque: by how much that is.
fn overshoots_no_more(config: PidConfig<f64>, tracking_s: f64, overloads: &[f64]) -> f64 {
    // Loaded with exactly the limit, 30 s are enough to settle at the reference with that torque.
    let free = controller::<3>(config, 1e6, Saturation::Clip);
    let friction = 0.002 * REFERENCE[0];
    let yardstick = overshoot(&free, |k| (k < 30_000).then_some(LIMIT - friction));
    assert!(yardstick > 0.01, "the loop as such overshoots: {yardstick}");
    for (saturation, anti_windup) in laws(tracking_s) {
        let limited = controller::<3>(
            PidConfig {
                anti_windup,
                ..config
            },
            LIMIT,
            saturation,
        );
        for overload in overloads {
            let peak = overshoot(&limited, |k| (k < 30_000).then_some(overload * LIMIT));
            assert!(
                1.0 + peak <= 1.05 * (1.0 + yardstick) && peak <= 1.05 * yardstick,
                "{config:?} {saturation:?} {anti_windup:?} overload {overload}: {peak} against {yardstick}"
            );
        }
    }
    yardstick
}

#[test]
fn a_released_wheel_overshoots_no_more_than_a_loop_without_limit() {
    for (kp, ki) in [(0.3, 2.0), (0.1, 2.0), (0.05, 0.2)] {
        let config = gains(kp, ki);
        let yardstick = overshoots_no_more(config, kp / ki, &[1.05, 2.0, f64::INFINITY]);
        // The laws as printed wind up: this test can fail.
        for saturation in [Saturation::Clip, Saturation::ScaleTorques] {
            let peak = overshoot(&controller(config, LIMIT, saturation), |k| {
                (k < 30_000).then_some(2.0 * LIMIT)
            });
            assert!(
                peak > 2.0 * yardstick,
                "{saturation:?}: {peak} against {yardstick}"
            );
        }
    }
}

#[test]
fn a_wheel_without_a_usable_measurement_is_released_and_the_others_drive_on() {
    for saturation in saturations(0.0) {
        let controller = controller::<3>(gains(0.3, 2.0), 100.0, saturation);
        let mut state = ControlState::default();
        controller.step(&mut state, &REFERENCE.into(), &[9.0, 9.0, 4.0].into());
        for nonsense in [f64::NAN, f64::INFINITY, 1e7] {
            let sample = controller.step(&mut state, &REFERENCE.into(), &[9.0, nonsense, 4.0].into());
            assert_eq!(sample.active, [true, false, true]);
            assert_eq!((sample.applied.n_m[1], sample.measured.rad_s[1]), (0.0, 0.0));
            assert_eq!(sample.common_factor, 1.0, "{saturation:?}");
            assert!(sample.applied.n_m[0] > 0.3 && sample.applied.n_m[2] > 0.3);
        }
        let back = controller.step(&mut state, &REFERENCE.into(), &[9.0, 9.0, 4.0].into());
        assert!(
            (back.applied.n_m[1] - (0.3 + 2.0 * DT)).abs() < 1e-12,
            "its loop starts afresh"
        );
    }
}

#[test]
fn a_scaled_wheel_forgets_its_lack_when_a_third_wheel_comes_to_its_limit() {
    let mut config = gains(1.0, 0.1);
    config.anti_windup = AntiWindup::BackCalculation { tracking_time_s: 0.1 };
    let controller = controller::<3>(config, 1.0, Saturation::ScaleTorques);
    let forgotten = |third: f64| {
        let mut state = ControlState::default();
        for _ in 0..8 {
            controller.step(&mut state, &[4.0, 0.8, 0.9].into(), &[0.0; 3].into());
        }
        assert_eq!(state.overload.wheels(), 1);
        let before = state.integral_n_m[1];
        controller.step(&mut state, &[4.0, 0.8, third].into(), &[0.0; 3].into());
        before - state.integral_n_m[1]
    };
    // It gets a quarter of 0.8 N.m: 0.6 N.m too little, of which DT / 0.1 s are forgotten in a
    // period; its own error adds 1e-4 of that.
    let expected = 0.6 * DT / 0.1;
    for third in [0.9, 1.01] {
        let forgotten = forgotten(third);
        assert!(
            (forgotten / expected - 1.0).abs() < 0.03,
            "{third}: {forgotten}, expected {expected}"
        );
    }
}

#[test]
fn a_state_set_to_nonsense_is_healed_in_one_step() {
    for saturation in saturations(0.0) {
        let controller = controller::<3>(gains(0.3, 2.0), 100.0, saturation);
        let mut state = ControlState::default();
        state.integral_n_m[1] = f64::NAN;
        let sample = controller.step(&mut state, &REFERENCE.into(), &[9.0, 9.0, 4.0].into());
        assert_eq!((sample.applied.n_m[1], sample.active[1]), (0.0, false));
        assert_eq!(sample.saturated, [false; 3]);
        assert!(
            sample.applied.n_m[0] > 0.3 && sample.common_factor == 1.0,
            "{saturation:?}"
        );
        let next = controller.step(&mut state, &REFERENCE.into(), &[9.0, 9.0, 4.0].into());
        assert!((next.applied.n_m[1] - (0.3 + 2.0 * DT)).abs() < 1e-12);
    }
}

#[test]
fn a_reference_that_is_not_a_number_is_rest_for_all() {
    let controller = controller::<3>(gains(0.3, 0.0), 100.0, Saturation::Clip);
    let sample = controller.step(
        &mut ControlState::default(),
        &[10.0, f64::NAN, 5.0].into(),
        &REFERENCE.into(),
    );
    assert_eq!(sample.reference.rad_s, [0.0; 3]);
    assert!(sample.applied.n_m.iter().all(|t| *t < 0.0), "they brake");
}

proptest! {
    #[test]
    fn torque_is_finite_and_within_each_wheel_s_limit_for_any_number_at_all(
        readings in prop::collection::vec((prop::array::uniform3(any::<f32>()), prop::array::uniform3(any::<f32>())), 1..30),
        limits in prop::array::uniform3(0.01..5.0_f32), which in 0..4_usize, law in 0..5_usize, filter in 0.0..0.01_f32,
    ) {
        let saturation = [Saturation::Clip, Saturation::ScaleTorques, Saturation::ScaleReferences { floor: 0.0 },
            Saturation::ScaleReferences { floor: 0.3 }][which];
        let anti_windup = [AntiWindup::None, AntiWindup::Clamp { limit_n_m: 1.0 }, AntiWindup::Conditional,
            AntiWindup::BackCalculation { tracking_time_s: 0.1 }, AntiWindup::Conditioned][law];
        let gains = PidGains { kp_n_m_s_rad: 0.3, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.01 };
        let pid = PidConfig { anti_windup, derivative_filter_s: filter, ..PidConfig::new(gains, 1e-3_f32) };
        let controller = WheelController::new(WheelControlConfig {
            pid,
            limits: limits.map(|l| TorqueLimit::constant(l).expect("valid")),
            coordination: Coordination { saturation, integral: Integral::PerWheel },
        }).expect("valid");
        let mut state = ControlState::default();
        for (reference, measured) in readings {
            let sample = controller.step(&mut state, &reference.into(), &measured.into());
            for i in 0..3 {
                prop_assert!(sample.applied.n_m[i].abs() <= limits[i]);
                prop_assert!(sample.requested.n_m[i].is_finite() && sample.common_factor.is_finite());
                prop_assert!(sample.p_n_m[i].is_finite() && sample.i_n_m[i].is_finite() && sample.d_n_m[i].is_finite());
            }
        }
    }

    #[test]
    fn no_loop_winds_up_or_swings_without_bound_whatever_its_gains(
        kp in prop::sample::select(vec![0.0, 1e-40, 1e-12, 1e-4, 0.3, 1e3_f32]), ki in 1.0..1e3_f32, kd in prop::sample::select(vec![0.0, 1e-3_f32]),
        b in prop::sample::select(vec![0.0, 0.005, 1.0_f32]), dt in prop::sample::select(vec![1e-3, 0.02, 1.0_f32]), after: bool, which in 0..3_usize,
        reference in (0.2..60.0_f32, prop::sample::select(vec![-1.0, 1.0])).prop_map(|(size, sign)| size * sign),
    ) {
        // The slowest integral, of 1 N.m/rad and 0.2 rad/s, comes to the limit of 1 N.m after 5000
        // periods, and swings there for as long.
        const HALF: usize = 12_000;
        let saturation = saturations(0.3)[which];
        let order = if after { crate::loops::IntegrationOrder::AfterOutput } else { crate::loops::IntegrationOrder::BeforeOutput };
        let gains = PidGains { kp_n_m_s_rad: kp, ki_n_m_rad: ki, kd_n_m_s2_rad: kd };
        let pid = PidConfig { order, proportional_weight: b, anti_windup: AntiWindup::Conditioned, ..PidConfig::new(gains, dt) };
        let controller = WheelController::new(WheelControlConfig {
            pid,
            limits: [TorqueLimit::constant(1.0).expect("valid"); 2],
            coordination: Coordination { saturation, integral: Integral::PerWheel },
        }).expect("valid");
        let mut state = ControlState::default();
        let mut fullest = [0.0_f32; 2];
        for k in 0..2 * HALF {
            let sample = controller.step(&mut state, &[reference, 1.0].into(), &[0.0, 1.0].into());
            for i in 0..2 {
                prop_assert!(sample.applied.n_m[i].abs() <= 1.0 && sample.requested.n_m[i].is_finite());
                let half = &mut fullest[k / HALF];
                *half = half.max(state.integral_n_m[i].abs());
            }
        }
        // What the first half of the time reached, the second does not pass, but for an integral
        // that is still on its way to making up for a proportional term of kp times 1 rad/s.
        prop_assert!(fullest[1] <= (1.01 * fullest[0]).max(1.0 + kp + 2.0 * ki * dt * 60.0), "{fullest:?}");
    }

    #[test]
    fn torques_and_integrals_are_zero_after_rest_for_the_time_of_bleeding(
        before in prop::collection::vec(prop::array::uniform3(-20.0..20.0_f32), 1..40), bleed_s in 0.0..0.05_f32,
        during in prop::array::uniform3(-20.0..20.0_f32), which in 0..3_usize, law in 0..4_usize,
    ) {
        let anti_windup = [AntiWindup::None, AntiWindup::Clamp { limit_n_m: 1.0 }, AntiWindup::Conditional,
            AntiWindup::Conditioned][law];
        let gains = PidGains { kp_n_m_s_rad: 0.3, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
        let wheels = WheelController::new(WheelControlConfig {
            pid: PidConfig { anti_windup, ..PidConfig::new(gains, 1e-3_f32) },
            limits: [TorqueLimit::constant(1.0).expect("valid"); 3],
            coordination: Coordination { saturation: saturations(0.3)[which], integral: Integral::PerWheel },
        }).expect("valid").with_rest(Rest { bleed_s, ..Rest::default() }).expect("valid");
        let mut state = ControlState::default();
        for measured in before {
            wheels.step(&mut state, &[5.0, -3.0, 0.0].into(), &measured.into());
        }
        // The time in whole periods, rounded; whatever is read meanwhile.
        let periods = (bleed_s * 1e3).round().max(1.0) as usize;
        for k in 0..periods + 20 {
            let sample = wheels.step(&mut state, &WheelVelocities::zero(), &during.into());
            prop_assert!(state.integral_n_m.iter().all(|i| i.is_finite()));
            prop_assert_eq!(sample.ended, k >= periods, "{}", k);
            prop_assert!(!sample.ended || sample.applied.n_m == [0.0; 3], "{:?}", sample.applied);
        }
        prop_assert_eq!(state.integral_n_m, [0.0; 3]);
        // And they are there again as soon as something is asked for.
        wheels.step(&mut state, &[1.0; 3].into(), &[0.0; 3].into());
        prop_assert!(state.integral_n_m.iter().all(|i| *i == 2.0 * 1e-3));
    }

    #[test]
    fn the_energy_of_a_passive_load_never_grows_at_rest(
        start in prop::array::uniform3(-20.0..20.0_f64), kp in 0.01..0.5_f64, which in 0..3_usize, limit in 0.05..5.0_f64,
    ) {
        // A proportional loop holding rest is a damper, however it is limited: kinetic energy falls
        // every period as long as kp dt / J < 1.
        let saturation = saturations(0.0)[which];
        let controller = controller::<3>(gains(kp, 0.0), limit, saturation);
        let mut plant = Plant { inertia: 0.01, friction: 0.0, velocity: start };
        let mut state = ControlState::default();
        let energy = |p: &Plant<3>| p.velocity.iter().map(|w| 0.5 * p.inertia * w * w).sum::<f64>();
        let mut last = energy(&plant);
        for _ in 0..500 {
            let sample = controller.step(&mut state, &WheelVelocities::zero(), &plant.velocity.into());
            plant.advance(&sample.applied.n_m, &[0.0; 3], &[false; 3]);
            prop_assert!(energy(&plant) <= last);
            last = energy(&plant);
        }
    }

    #[test]
    fn single_precision_follows_double(
        reference in prop::array::uniform3(-10.0..10.0_f32), measured in prop::collection::vec(prop::array::uniform3(-10.0..10.0_f32), 50),
        which in 0..3_usize,
    ) {
        // A common factor answers to rounding of a torque by 1 / (0.3 r): references near nothing are another matter.
        let reference = reference.map(|r| if r < 0.0 { r - 0.5 } else { r + 0.5 });
        let make = |saturation| controller::<3>(gains(0.3, 2.0), 2.0, saturation);
        let double = make(saturations(0.3)[which]);
        let pid = PidConfig::new(PidGains { kp_n_m_s_rad: 0.3_f32, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 }, 1e-3);
        let saturation = saturations(0.3)[which];
        let limits = [TorqueLimit::constant(2.0_f32).expect("valid"); 3];
        let coordination = Coordination { saturation, integral: Integral::PerWheel };
        let single = WheelController::new(WheelControlConfig { pid, limits, coordination }).expect("valid");
        let (mut a, mut b) = (ControlState::default(), ControlState::default());
        for m in measured {
            let s = single.step(&mut a, &reference.into(), &m.into());
            let d = double.step(&mut b, &reference.map(f64::from).into(), &m.map(f64::from).into());
            for i in 0..3 {
                // Fifty steps of sums up to 6 N.m with a relative error of 6e-8 each, an order of magnitude for the
                // quotient that sets the factor.
                prop_assert!((f64::from(s.applied.n_m[i]) - d.applied.n_m[i]).abs() < 3e-5);
            }
        }
    }
}
