//! What is left of the torques when a stop is over.

use std::vec::Vec;

use super::*;

/// Torques for wheels that cannot turn: driven for 0.3 s, then `stop` until the end.
fn blocked(rest: Rest<f64>, periods: usize, stop: impl Fn(&mut DriveInput<f64, 7>)) -> Vec<[f64; 7]> {
    let drive = Drive::new(DriveConfig { rest, ..config() }).expect("valid");
    let mut state = DriveState::new(&drive);
    let standing = DriveInput::measured(&WheelVelocities::zero());
    let ahead = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    for _ in 0..300 {
        drive.step(&mut state, &standing.with_command(ahead));
    }
    (0..periods)
        .map(|_| {
            let mut input = standing;
            stop(&mut input);
            drive.step(&mut state, &input).wheels.applied.n_m
        })
        .collect()
}

fn largest(torques: &[f64; 7]) -> f64 {
    torques.iter().fold(0.0, |most, torque| torque.abs().max(most))
}

/// A stop: what it does to the input in each period.
type Stop = (&'static str, fn(&mut DriveInput<f64, 7>));

const STOPS: [Stop; 4] = [
    ("time-out", |input| input.command = None),
    ("command of rest", |input| input.command = Some(BodyTwist::ZERO)),
    ("emergency stop", |input| {
        input.emergency = true;
        input.command = Some(COMMAND);
    }),
    // Three readings are left, of wheels that roll ahead alone: they do not determine the motion.
    ("safe stop", |input| {
        input.command = Some(COMMAND);
        for lost in [0, 1, 3, 5] {
            input.readings_rad_s[lost] = None;
        }
    }),
];

#[test]
fn blocked_wheels_are_without_torque_when_a_stop_of_any_kind_is_over() {
    for (name, stop) in STOPS {
        let torques = blocked(Rest::default(), 1500, stop);
        assert!(
            largest(&torques[0]) > 0.5,
            "{name}: they pushed before: {:?}",
            torques[0]
        );
        // 0.1 s of time-out, 0.15 s of deceleration, 20 periods until a safe stop, 0.5 s of bleeding: 0.8 s are enough.
        for torque in &torques[800..] {
            assert_eq!(largest(torque), 0.0, "{name}");
        }
    }
}

#[test]
fn holding_is_a_choice_and_ends_with_its_time_and_with_its_torque_squared() {
    let square = |torques: &[f64; 7]| torques.iter().map(|torque| torque * torque).sum::<f64>();
    // What was given until the torques were gone, and when that was, from the period on in which the references were 0.
    let held = |rest| {
        let torques = blocked(rest, 6000, STOPS[1].1);
        let slowed = 150; // 0.3 m/s at 2 m/s^2
        let over = torques
            .iter()
            .position(|torque| largest(torque) == 0.0)
            .expect("it ends");
        let heat = torques[slowed..over].iter().map(square).sum::<f64>() * DT;
        (square(&torques[400]), heat, (over - slowed) as f64 * DT)
    };
    let (_, _, time) = held(Rest::hold(3.0, 1e9));
    assert!(
        (time - 3.25).abs() < 0.003,
        "held for 3 s, integrals fall for 0.25 s: {time} s"
    );
    let (power, heat, time) = held(Rest::hold(3600.0, 5.0));
    // Torques that fall along a straight line give a third of the heat that they gave before.
    let expected = 5.0 + power * 0.25 / 3.0;
    assert!(
        (heat / expected - 1.0).abs() < 0.01,
        "{heat} N^2.m^2.s, expected {expected}"
    );
    assert!((time - (5.0 / power + 0.25)).abs() < 0.003, "{time} s");
}

#[test]
fn nothing_is_held_in_a_safe_stop_or_an_emergency_stop() {
    for (name, stop) in &STOPS[2..] {
        let torques = blocked(Rest::hold(30.0, 1e9), 1500, stop);
        // As without holding, above.
        assert!(
            torques[800..].iter().all(|torque| largest(torque) == 0.0),
            "{name}"
        );
    }
    // Nor does a stop use up what a slope is held with later.
    let drive = Drive::new(DriveConfig {
        rest: Rest::hold(30.0, 1e9),
        ..config()
    })
    .expect("valid");
    let (mut state, mut last) = (DriveState::new(&drive), None);
    let ahead = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    for k in 0..4000 {
        let command = if k < 3000 { ahead } else { BodyTwist::ZERO };
        let mut standing = DriveInput::measured(&WheelVelocities::zero());
        standing.emergency = (500..2000).contains(&k);
        last = Some(
            drive
                .step(&mut state, &standing.with_command(command))
                .wheels
                .applied
                .n_m,
        );
    }
    assert!(last.is_some_and(|torques| largest(&torques) > 0.5), "{last:?}");
    let torques = blocked(Rest::hold(30.0, 1e9), 1500, STOPS[0].1);
    assert!(
        largest(&torques[1499]) > 0.5,
        "a time-out is held: {:?}",
        torques[1499]
    );
}

#[test]
fn a_wheel_that_is_turned_at_rest_is_braked_until_the_stop_is_over() {
    let short_windings = Rest {
        short_windings: true,
        ..Rest::default()
    };
    for (rest, short) in [(Rest::default(), false), (short_windings, true)] {
        let drive = Drive::new(DriveConfig { rest, ..config() }).expect("valid");
        let mut state = DriveState::new(&drive);
        let turned = DriveInput::measured(&[1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0].into());
        let turned = turned.with_command(BodyTwist::ZERO);
        let samples: Vec<_> = (0..600).map(|_| drive.step(&mut state, &turned)).collect();
        for sample in &samples[..250] {
            // At least kp times 1 rad/s, of motors that have seven times that.
            assert!(
                sample.wheels.applied.n_m[0] <= -0.3,
                "{:?}",
                sample.wheels.applied.n_m
            );
        }
        for (k, sample) in samples.iter().enumerate() {
            let over = k >= 500;
            assert_eq!(
                (sample.wheels.ended, sample.brake),
                (over, [over && short; 7]),
                "{k}"
            );
            assert!(!over || sample.wheels.applied.n_m == [0.0; 7], "{k}");
        }
    }
}

/// What goes wrong with encoders: readings out of true velocities, given those of the period before and the period.
type Encoders = (&'static str, fn(f64, f64, u64) -> f64);

/// Evenly spread in -1 to 1, from a number (splitmix64, Steele et al. 2014).
fn spread(seed: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Counts of a period, as the velocity that they make.
fn counted(true_rad_s: f64, counts: f64, k: u64) -> f64 {
    let count_rad = core::f64::consts::TAU / counts;
    // An angle that is somewhere within a count: rounded up as often as its part says.
    ((true_rad_s * DT / count_rad + 0.5 * spread(k) + 0.5).floor()) * count_rad / DT
}

const ENCODERS: [Encoders; 10] = [
    ("ideal", |now, _, _| now),
    ("stuck at the last reading", |_, before, _| before),
    ("dead", |_, _, _| 0.0),
    ("toggling", |_, _, k| [6.0, -6.0, 0.0][k as usize % 3]),
    ("noisy", |now, _, k| now + 20.0 * spread(k)),
    ("64 counts", |now, _, k| counted(now, 64.0, k)),
    ("4096 counts", |now, _, k| counted(now, 4096.0, k)),
    ("beyond range", |_, _, _| 1e7),
    ("at the end of the range", |_, _, k| [1e6, -1e6][k as usize % 2]),
    ("no number", |_, _, _| f64::NAN),
];

/// A vehicle whose wheels grip is driven for half a second. Then `broken` of its encoders fail, and
/// 0.1 s later it is stopped. Says up to which period after the stop there was a reference, and up
/// to which a torque, within the next three seconds.
fn last_torque<R: Real, const N: usize>(
    config: DriveConfig<R, N>,
    stop: usize,
    encoders: usize,
    broken: &[usize],
) -> [usize; 2] {
    let drive = Drive::new(config).expect("valid");
    let mut state = DriveState::new(&drive);
    let inverse = drive
        .kinematics()
        .inverse_matrix()
        .map(|row| row.map(Real::as_f64));
    let command = BodyTwist::from_array([0.3, 0.1, 0.2].map(R::of));
    let mut twist = [0.0; 3];
    let mut read = [0.0; N];
    let mut last = [0; 2];
    for k in 0..3600 {
        let mut input = DriveInput::measured(&WheelVelocities::zero());
        for i in 0..N {
            let now = (0..3).map(|axis| inverse[i][axis] * twist[axis]).sum();
            let fails = k >= 500 && broken.contains(&i);
            let seed = (k * N + i) as u64;
            read[i] = if fails {
                ENCODERS[encoders].1(now, read[i], seed)
            } else {
                now
            };
            input.readings_rad_s[i] = Some(R::of(read[i]));
        }
        input.command = Some(command);
        if k >= 600 {
            match stop {
                0 => input.command = None,
                1 => input.command = Some(BodyTwist::ZERO),
                2 => input.emergency = true,
                _ => state.stopping = true,
            }
        }
        let sample = drive.step(&mut state, &input);
        let torques = sample.wheels.applied.n_m.map(Real::as_f64);
        if k >= 600 && sample.desaturated.twist != BodyTwist::ZERO {
            last[0] = k - 599;
        }
        if k >= 600 && torques.iter().any(|torque| *torque != 0.0) {
            last[1] = k - 599;
        }
        for axis in 0..3 {
            let force: f64 = (0..N).map(|i| inverse[i][axis] * torques[i]).sum();
            twist[axis] += DT * (force / [20.0, 20.0, 1.0][axis] - 0.1 * twist[axis]);
        }
    }
    last
}

/// A configuration with every part that has a state, in either precision.
fn with_memory<R: Real, const N: usize>(
    layout: WheelLayout<R, N>,
    policy: &str,
    anti_windup: crate::loops::AntiWindup<R>,
) -> DriveConfig<R, N> {
    let gains = PidGains {
        kp_n_m_s_rad: R::of(0.3),
        ki_n_m_rad: R::of(2.0),
        kd_n_m_s2_rad: R::of(0.001),
    };
    let pid = PidConfig {
        anti_windup,
        feed_forward: crate::loops::FeedForward {
            velocity_n_m_s_rad: R::of(0.02),
            acceleration_n_m_s2_rad: R::of(0.01),
            ..crate::loops::FeedForward::none()
        },
        ..PidConfig::new(gains, R::of(DT))
    };
    let mut config = DriveConfig::new(
        layout,
        WheelControlConfig {
            pid,
            limits: [TorqueLimit::line(R::of(2.0), R::of(0.05)).expect("valid"); N],
            coordination: Coordination::preset(policy).expect("a preset"),
        },
    );
    config.shaping.timeout_s = Some(R::of(0.1));
    config.shaping.emergency_deceleration = Some(EmergencyDeceleration {
        linear_m_s2: R::of(2.0),
        yaw_rad_s2: R::of(8.0),
    });
    config
}

/// Every stop of every encoder that fails in its way; what ends too late. `layout` in both precisions.
fn too_late<const N: usize>(
    double: WheelLayout<f64, N>,
    single: WheelLayout<f32, N>,
    broken: &[usize],
) -> Vec<std::string::String> {
    let laws = [
        crate::loops::AntiWindup::None,
        crate::loops::AntiWindup::Conditional,
        crate::loops::AntiWindup::Conditioned,
    ];
    let single_laws = [
        crate::loops::AntiWindup::None,
        crate::loops::AntiWindup::Conditional,
        crate::loops::AntiWindup::Conditioned,
    ];
    let mut late = Vec::new();
    for (which, policy) in Coordination::<f64>::PRESETS.into_iter().enumerate() {
        for stop in 0..4 {
            for (encoders, (encoder, _)) in ENCODERS.into_iter().enumerate() {
                let law = (which + stop + encoders) % 3;
                let double = with_memory(double, policy, laws[law]);
                let single = with_memory(single, policy, single_laws[law]);
                for [reference, torque] in [
                    last_torque(double, stop, encoders, broken),
                    last_torque(single, stop, encoders, broken),
                ] {
                    // A time-out of 0.1 s. A command of rest acts at once, unless unusable readings
                    // began a safe stop 0.09 s before. 0.316 m/s at 2 m/s^2 in a time-out, an emergency
                    // stop or a safe stop. Times in f32 end in the next period.
                    let slowed = [260, 70, 159, 159][stop];
                    // Then 0.5 s of bleeding.
                    if reference > slowed || torque > reference + 500 {
                        late.push(std::format!(
                            "{policy}, {encoder}, stop {stop}: {reference}, {torque}"
                        ));
                    }
                }
            }
        }
    }
    late
}

#[test]
fn every_stop_ends_without_torque_at_its_stated_time_whatever_is_measured() {
    let three = (
        WheelLayout::omni(0.18, 0.0, 0.05).expect("valid"),
        WheelLayout::omni(0.18, 0.0, 0.05).expect("valid"),
    );
    let seven = (
        WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid"),
        WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid"),
    );
    let late = [
        too_late::<3>(three.0, three.1, &[2]),
        too_late::<3>(three.0, three.1, &[0, 1, 2]),
        too_late::<7>(seven.0, seven.1, &[1, 4]),
    ]
    .concat();
    assert!(late.is_empty(), "{} late:\n{}", late.len(), late.join("\n"));
}

#[test]
fn motors_are_shorted_in_a_stop_and_only_those_of_wheels_with_a_fault() {
    let drive = Drive::new(config()).expect("valid");
    let mut state = DriveState::new(&drive);
    // Wheels without a reading, for so many periods: 20 make one faulty, 10 more of an undetermined
    // motion are a safe stop.
    let after_in = |emergency, state: &mut DriveState<f64, 7>, silent: &[usize], periods| {
        let mut input = DriveInput::measured(&WheelVelocities::zero()).with_command(COMMAND);
        input.emergency = emergency;
        for &wheel in silent {
            input.readings_rad_s[wheel] = None;
        }
        let mut last = drive.step(state, &input);
        for _ in 1..periods {
            last = drive.step(state, &input);
        }
        (last.mode, last.brake)
    };
    let after = |state: &mut _, silent: &[usize], periods| after_in(false, state, silent, periods);
    let only = |wheels: &[usize]| core::array::from_fn(|i| wheels.contains(&i));
    let none = [false; 7];
    assert_eq!(after(&mut state, &[], 5), (DriveMode::Normal, none));
    assert_eq!(after(&mut state, &[5], 40), (DriveMode::Degraded, none)); // the others drive on past it
    assert_eq!(
        after_in(true, &mut state, &[5], 1),
        (DriveMode::EmergencyStop, only(&[5]))
    );
    assert_eq!(after(&mut state, &[5], 1), (DriveMode::Degraded, none));
    let four = [0, 1, 3, 5];
    assert_eq!(after(&mut state, &four, 60), (DriveMode::SafeStop, only(&four)));
    // After 100 good readings the loops brake these wheels again until the torque has ended; then all are shorted.
    assert_eq!(after(&mut state, &[], 150), (DriveMode::SafeStop, none));
    assert_eq!(after(&mut state, &[], 500), (DriveMode::SafeStop, [true; 7]));
}
