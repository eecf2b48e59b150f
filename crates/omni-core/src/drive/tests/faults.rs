//! Wheels that are lost, silent or lie: they are let go, and the others carry on.

use super::*;
use crate::Fault;

#[test]
fn any_one_wheel_with_any_fault_is_let_go_and_the_others_carry_on() {
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
    // Both transverse wheels go silent: nobody tells sideways motion.
    let silent = |input: &mut DriveInput<f64, 7>| {
        input.readings_rad_s[1] = None;
        input.readings_rad_s[5] = None;
    };
    // 20 periods until they count as silent, 10 more until the vehicle counts as blind.
    assert_eq!(vehicle.run(29, COMMAND, silent).mode, DriveMode::Degraded);
    let sample = vehicle.run(2, COMMAND, silent);
    assert!(!sample.motion_known);
    assert_eq!(
        (sample.mode, sample.shaped.status),
        (DriveMode::SafeStop, CommandStatus::EmergencyStop)
    );
    let stopped = vehicle.run(1000, COMMAND, silent);
    assert_eq!(stopped.shaped.twist, BodyTwist::zero());
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
    let coordination = Coordination::synchronised();
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
    // With and without slip detection; encoders in steps of 0.05 rad/s, so that healthy readings stay the same for long.
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
            // At rest it reads what the others say, and is not believed for that.
            let resting = vehicle.run(2000, BodyTwist::zero(), dead);
            assert_eq!(
                (resting.faults[3], resting.wheels.applied.n_m[3]),
                (Some(Fault::Stuck), 0.0)
            );
        }
    }
}

#[test]
fn a_steady_slip_that_nobody_can_attribute_stops_nobody() {
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
        // One NaN: released after a stop, the vehicle is there again at once, and without it after enough good readings.
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
