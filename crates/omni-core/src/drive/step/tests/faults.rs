//! Lost wheels, silent and faulty encoders: their wheels are released, and the others drive on.

use super::*;
use crate::drive::Fault;
use crate::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};

#[test]
fn any_one_wheel_with_any_fault_is_released_and_the_others_drive_on() {
    type Spoil = fn(&mut DriveInput<f64, 7>, usize);
    let faults: [(Fault, Spoil); 5] = [
        (Fault::NotANumber, |input, i| {
            input.readings_rad_s[i] = Some(f64::NAN)
        }),
        (Fault::NotANumber, |input, i| {
            input.readings_rad_s[i] = Some(f64::INFINITY)
        }),
        (Fault::Silent, |input, i| input.readings_rad_s[i] = None),
        (Fault::Jump, |input, i| {
            input.readings_rad_s[i] = input.readings_rad_s[i].map(|v| v + 50.0)
        }),
        (Fault::Stuck, |input, i| input.readings_rad_s[i] = Some(0.25)),
    ];
    for wheel in 0..7 {
        for (fault, spoil) in faults {
            let mut vehicle = Vehicle::new(config());
            // Slowly turning, so that no wheel happens to rest at its stuck reading.
            let command = twist(0.2, 0.2, 0.3);
            vehicle.run(1000, command, |_| {});
            if fault == Fault::Stuck {
                // An encoder cannot stick without a jump first, unless it sticks where it is.
                let here = vehicle.drive.kinematics().inverse(&vehicle.twist).rad_s[wheel];
                let slower = twist(-0.2, -0.1, -0.3);
                vehicle.run(4000, slower, |input| input.readings_rad_s[wheel] = Some(here));
                let sample = vehicle.run(1, slower, |input| input.readings_rad_s[wheel] = Some(here));
                assert_eq!(sample.faults[wheel], Some(Fault::Stuck), "wheel {}", wheel + 1);
                assert_eq!(
                    (sample.mode, sample.wheels.applied.n_m[wheel]),
                    (DriveMode::Degraded, 0.0)
                );
                assert!(
                    follows(&vehicle, slower),
                    "wheel {}: {:?}",
                    wheel + 1,
                    vehicle.twist
                );
                continue;
            }
            let sample = vehicle.run(1500, command, |input| spoil(input, wheel));
            assert_eq!(sample.faults[wheel], Some(fault), "wheel {}", wheel + 1);
            assert_eq!(sample.faults.iter().filter(|f| f.is_some()).count(), 1);
            assert_eq!(
                (sample.mode, sample.wheels.applied.n_m[wheel]),
                (DriveMode::Degraded, 0.0)
            );
            assert!(
                follows(&vehicle, command),
                "wheel {} {fault:?}: {:?}",
                wheel + 1,
                vehicle.twist
            );
            assert!((sample.slip.estimated.vx_m_s - vehicle.twist.vx_m_s).abs() < 1e-3);
            // Well again, it drives again.
            let sample = vehicle.run(500, command, |_| {});
            assert_eq!(
                (sample.mode, sample.faults[wheel]),
                (DriveMode::Normal, None),
                "wheel {}",
                wheel + 1
            );
        }
    }
}

#[test]
fn a_lost_wheel_has_no_torque_whatever_policy_and_the_vehicle_keeps_its_course() {
    for name in Coordination::<f64>::PRESETS {
        let coordination = Coordination::preset(name).expect("a preset");
        for wheel in 0..7 {
            let mut vehicle = Vehicle::new(DriveConfig {
                control: loops(coordination),
                ..config()
            });
            let lost = core::array::from_fn(|i| i == wheel);
            vehicle.state.faults.declare_lost(&lost);
            let sample = vehicle.run(3000, COMMAND, |_| {});
            assert_eq!(
                (sample.faults[wheel], sample.wheels.applied.n_m[wheel]),
                (Some(Fault::Lost), 0.0),
                "{name}"
            );
            assert!(
                follows(&vehicle, COMMAND),
                "{name} wheel {}: {:?}",
                wheel + 1,
                vehicle.twist
            );
        }
    }
}

#[test]
fn too_few_wheels_lead_to_a_safe_stop_that_holds_until_released() {
    let mut vehicle = Vehicle::new(config());
    vehicle.run(1000, COMMAND, |_| {});
    // Both transverse wheels go silent: no wheel measures lateral motion.
    let silent = |input: &mut DriveInput<f64, 7>| {
        input.readings_rad_s[1] = None;
        input.readings_rad_s[5] = None;
    };
    // 20 periods until they count as silent, 10 more until the motion counts as undetermined.
    assert_eq!(vehicle.run(29, COMMAND, silent).mode, DriveMode::Degraded);
    let sample = vehicle.run(2, COMMAND, silent);
    assert!(!sample.motion_known);
    assert_eq!(
        (sample.mode, sample.shaped.status),
        (DriveMode::SafeStop, CommandStatus::EmergencyStop)
    );
    let stopped = vehicle.run(1000, COMMAND, silent);
    assert_eq!(stopped.shaped.twist, BodyTwist::ZERO);
    assert!(
        vehicle.twist.vx_m_s.abs() < 5e-3 && vehicle.twist.wz_rad_s.abs() < 5e-3,
        "{:?}",
        vehicle.twist
    );
    // Odometry waits: what too few wheels say is no motion.
    let waits = vehicle.state.odometry.pose();
    vehicle.run(10, COMMAND, silent);
    assert_eq!(vehicle.state.odometry.pose(), waits);
    // The wheels are back, the stop stays; released, commands are followed.
    assert_eq!(vehicle.run(1000, COMMAND, |_| {}).mode, DriveMode::SafeStop);
    vehicle.state.release_safe_stop();
    assert_eq!(vehicle.run(3000, COMMAND, |_| {}).mode, DriveMode::Normal);
    assert!(follows(&vehicle, COMMAND));
}

#[test]
fn with_every_wheel_lost_nothing_is_applied() {
    let mut vehicle = Vehicle::new(config());
    vehicle.run(500, COMMAND, |_| {});
    vehicle.state.faults.declare_lost(&[true; 7]);
    let sample = vehicle.run(11, COMMAND, |_| {});
    assert_eq!(
        (sample.mode, sample.wheels.applied.n_m),
        (DriveMode::SafeStop, [0.0; 7])
    );
}

#[test]
fn without_detection_a_missing_reading_still_lets_its_wheel_go() {
    let mut vehicle = Vehicle::new(DriveConfig {
        faults: None,
        slip: None,
        ..config()
    });
    let sample = vehicle.run(3000, COMMAND, |input| {
        input.readings_rad_s[2] = None;
        input.readings_rad_s[6] = Some(f64::NAN);
    });
    assert_eq!(
        (sample.faults[2], sample.faults[6]),
        (Some(Fault::Silent), Some(Fault::NotANumber))
    );
    assert!(follows(&vehicle, COMMAND), "{:?}", vehicle.twist);
}

/// The drive of any layout with everything on.
fn drive_of<const N: usize>(layout: WheelLayout<f64, N>) -> Drive<f64, N> {
    let DriveConfig {
        shaping,
        slip,
        faults,
        ..
    } = config();
    let coordination = Coordination::scale_references();
    Drive::new(DriveConfig {
        shaping,
        slip,
        faults,
        ..DriveConfig::new(layout, loops(coordination))
    })
    .expect("valid")
}

#[test]
fn a_dead_encoder_takes_no_healthy_wheel_with_it() {
    // With and without slip detection; encoders in steps of 0.05 rad/s, so that healthy readings
    // stay the same for long.
    for slip in [None, config().slip] {
        let mut vehicle = Vehicle::new(DriveConfig { slip, ..config() });
        let dead = |input: &mut DriveInput<f64, 7>| {
            for reading in input.readings_rad_s.iter_mut().flatten() {
                *reading = (*reading / 0.05).round() * 0.05;
            }
            input.readings_rad_s[3] = Some(0.0);
        };
        let forward = twist(0.4, 0.0, 0.0);
        for _ in 0..3 {
            let moving = vehicle.run(3000, forward, dead);
            assert_eq!(moving.faults.iter().flatten().count(), 1);
            assert_eq!(
                (moving.faults[3], moving.mode),
                (Some(Fault::Stuck), DriveMode::Degraded)
            );
            // At rest it reads what the others imply, and is not accepted for that.
            let resting = vehicle.run(2000, BodyTwist::ZERO, dead);
            assert_eq!(
                (resting.faults[3], resting.wheels.applied.n_m[3]),
                (Some(Fault::Stuck), 0.0)
            );
        }
    }
}

#[test]
fn a_steady_slip_of_no_certain_wheel_stops_none() {
    let drive = drive_of(WheelLayout::mecanum4(0.6, 0.4, 0.1).expect("valid"));
    let mut state = DriveState::new(&drive);
    let command = twist(0.3, 0.0, 0.0);
    let mut wheels = drive.kinematics().inverse(&command);
    wheels.rad_s[2] += 2.0;
    for _ in 0..5000 {
        let sample = drive.step(&mut state, &DriveInput::measured(&wheels).with_command(command));
        assert_eq!((sample.mode, sample.slip.unattributed), (DriveMode::Normal, true));
    }
}

#[test]
fn three_wheels_survive_a_missing_sample_and_recover_at_rest() {
    let layout = WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05).expect("valid");
    let plain = Drive::new(DriveConfig::new(layout, loops(Coordination::independent()))).expect("valid");
    for drive in [plain, drive_of(layout)] {
        let mut state = DriveState::new(&drive);
        let whole = DriveInput::measured(&WheelVelocities::zero());
        drive.step(&mut state, &whole);
        let mut missing = whole;
        missing.readings_rad_s[1] = None;
        drive.step(&mut state, &missing);
        assert_eq!(drive.step(&mut state, &whole).mode, DriveMode::Normal);
        // One NaN: released after a stop, the vehicle is there again at once, and without it after
        // enough good readings.
        let mut nonsense = whole;
        nonsense.readings_rad_s[1] = Some(f64::NAN);
        drive.step(&mut state, &nonsense);
        for _ in 0..200 {
            drive.step(&mut state, &whole);
        }
        state.release_safe_stop();
        assert_eq!(drive.step(&mut state, &whole).mode, DriveMode::Normal);
    }
}

/// A vehicle whose wheels grip, with encoders on timers of so many counts per turn. While it cruises the counter of its
/// second wheel comes to stand, or to toggle as the shaft turns. Says which wheels were called faulty, in which period
/// after that, and what became of the drive.
fn dies<R: Real, const N: usize>(
    layout: WheelLayout<R, N>,
    method: VelocityMethod<R>,
    toggles: bool,
    period_s: f64,
    stuck_torque_n_m: f64,
) -> ([Option<(Fault, u32)>; N], DriveMode) {
    let gains = PidGains {
        kp_n_m_s_rad: R::of(0.3),
        ki_n_m_rad: R::of(2.0),
        kd_n_m_s2_rad: R::zero(),
    };
    let control = WheelControlConfig {
        pid: PidConfig::new(gains, R::of(period_s)),
        limits: [TorqueLimit::line(R::of(2.0), R::of(0.06)).expect("valid"); N],
        coordination: Coordination::scale_references(),
    };
    let mut faults = FaultConfig::unchecked();
    (faults.stuck_rad_s, faults.stuck_torque_n_m) = (R::one(), R::of(stuck_torque_n_m));
    (
        faults.stuck_periods,
        faults.silent_periods,
        faults.recovery_periods,
    ) = (100, 20, 200);
    let drive = Drive::new(DriveConfig {
        faults: Some(faults),
        ..DriveConfig::new(layout, control)
    })
    .expect("valid");
    let count_rad = core::f64::consts::TAU / 1440.0;
    let estimator = VelocityEstimator::<_, 32>::new(VelocityConfig {
        method,
        count_rad: R::of(count_rad),
        period_s: R::of(period_s),
    })
    .expect("valid");
    let inverse = drive
        .kinematics()
        .inverse_matrix()
        .map(|row| row.map(Real::as_f64));
    let mut state = DriveState::new(&drive);
    let mut velocities = [VelocityState::default(); N];
    let (mut angle, mut counter, mut twist) = ([0.0; N], [0_i32; N], [0.0; 3]);
    let (mut found, mut mode) = ([None; N], DriveMode::Normal);
    let ahead = BodyTwist::from_array([0.3, 0.05, 0.1].map(R::of));
    let dead_from = (2.0 / period_s) as u32;
    for k in 0..dead_from + 3000 {
        let mut read = WheelVelocities::zero();
        for i in 0..N {
            let velocity: f64 = (0..3).map(|axis| inverse[i][axis] * twist[axis]).sum();
            angle[i] += velocity * period_s;
            let turned = (angle[i] / count_rad).floor() as i32;
            let now = match (i == 1 && k >= dead_from, toggles) {
                (false, _) => turned,
                (true, false) => counter[i],
                // From where it stood, up and down again with each other edge.
                (true, true) => counter[i].div_euclid(2) * 2 + turned.rem_euclid(2),
            };
            let age = R::of(0.3 * period_s);
            read.rad_s[i] = estimator.step(&mut velocities[i], now - counter[i], Some(age));
            counter[i] = now;
        }
        let sample = drive.step(&mut state, &DriveInput::measured(&read).with_command(ahead));
        for i in 0..N {
            if let Some(fault) = sample.faults[i]
                && found[i].is_none()
            {
                found[i] = Some((fault, k.wrapping_sub(dead_from)));
            }
        }
        mode = sample.mode;
        let torques = sample.wheels.applied.n_m.map(Real::as_f64);
        for axis in 0..3 {
            let force: f64 = (0..N).map(|i| inverse[i][axis] * torques[i]).sum();
            twist[axis] += period_s * (force / [9.6, 9.6, 0.4][axis] - 0.3 * twist[axis]);
        }
    }
    (found, mode)
}

/// Both precisions, every way to read a velocity, both ways to die, two periods; then who was
/// blamed and how long it took.
fn every_death<const N: usize>(
    double: WheelLayout<f64, N>,
    single: WheelLayout<f32, N>,
    stuck_torque_n_m: f64,
    ends: DriveMode,
    periods: f64,
) {
    let of = |periods| VelocityMethod::Window { periods };
    let of_f32 = |periods| VelocityMethod::Window { periods };
    let doubles = [
        of(1),
        of(8),
        VelocityMethod::Edges,
        VelocityMethod::Observer {
            bandwidth_rad_s: 60.0,
        },
    ];
    let singles = [
        of_f32(1),
        of_f32(8),
        VelocityMethod::Edges,
        VelocityMethod::Observer {
            bandwidth_rad_s: 60.0_f32,
        },
    ];
    for (double_method, single_method) in doubles.into_iter().zip(singles) {
        for toggles in [false, true] {
            for period_s in [1e-3, 5e-3] {
                for (found, mode) in [
                    dies(double, double_method, toggles, period_s, stuck_torque_n_m),
                    dies(single, single_method, toggles, period_s, stuck_torque_n_m),
                ] {
                    let case = std::format!(
                        "{double_method:?}, toggles {toggles}, {period_s} s: {found:?}, {mode:?}"
                    );
                    let blamed: std::vec::Vec<_> = (0..N).filter(|i| found[*i].is_some()).collect();
                    assert_eq!((blamed, mode), (std::vec![1], ends), "{case}");
                    let (fault, after) = found[1].expect("it was");
                    // 0.1 s until the counter stands, and then the evidence.
                    assert!(
                        fault == Fault::Stuck && f64::from(after) * period_s < 0.1 + periods * period_s,
                        "{case}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_cut_encoder_wire_is_found_by_any_velocity_method_and_blames_no_healthy_wheel() {
    let three = WheelLayout::omni(0.18, 0.0, 0.05).expect("valid");
    every_death::<3>(
        three,
        WheelLayout::omni(0.18, 0.0, 0.05).expect("valid"),
        1.0,
        DriveMode::SafeStop,
        250.0, // 100, and what the integral needs to get to 1 N.m
    );
    // Four wheels determine the motion: the other three keep the vehicle on its course against the
    // fourth, so that their readings do not change.
    let four = WheelLayout::mecanum4(0.22, 0.26, 0.0485).expect("valid");
    let single = WheelLayout::mecanum4(0.22, 0.26, 0.0485).expect("valid");
    every_death::<4>(four, single, f64::INFINITY, DriveMode::Degraded, 1050.0);
}
