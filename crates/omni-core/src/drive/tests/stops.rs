//! What is left of the torques when a stop is over.

use std::vec::Vec;

use super::*;

/// Torques for wheels that cannot turn: driven for 0.3 s, then `stop` until the end.
fn blocked(
    rest: Rest<f64>,
    periods: usize,
    stop: impl Fn(&mut DriveState<f64, 7>, &mut DriveInput<f64, 7>),
) -> Vec<[f64; 7]> {
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
            stop(&mut state, &mut input);
            drive.step(&mut state, &input).wheels.applied.n_m
        })
        .collect()
}

fn largest(torques: &[f64; 7]) -> f64 {
    torques.iter().fold(0.0, |most, torque| torque.abs().max(most))
}

/// A stop: what it does to state and input in each period.
type Stop = (&'static str, fn(&mut DriveState<f64, 7>, &mut DriveInput<f64, 7>));

const STOPS: [Stop; 4] = [
    ("time-out", |_, input| input.command = None),
    ("command of rest", |_, input| {
        input.command = Some(BodyTwist::ZERO)
    }),
    ("emergency stop", |state, input| {
        state.emergency_stop();
        input.command = Some(COMMAND);
    }),
    // Three readings are left, of wheels that roll ahead alone: they do not tell the motion.
    ("safe stop", |_, input| {
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
fn holding_is_a_choice_and_ends_with_its_time_and_with_its_heat() {
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
        (time - 3.5).abs() < 0.003,
        "held for 3 s, bled for 0.5 s: {time} s"
    );
    let (power, heat, time) = held(Rest::hold(3600.0, 5.0));
    // Torques that fall along a straight line give a third of the heat that they gave before.
    let expected = 5.0 + power * 0.5 / 3.0;
    assert!(
        (heat / expected - 1.0).abs() < 0.01,
        "{heat} N^2.m^2.s, expected {expected}"
    );
    assert!((time - (5.0 / power + 0.5)).abs() < 0.003, "{time} s");
}

#[test]
fn a_wheel_that_is_turned_at_rest_is_braked() {
    let drive = Drive::new(config()).expect("valid");
    let mut state = DriveState::new(&drive);
    let turned = DriveInput::measured(&[1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0].into());
    for _ in 0..2000 {
        drive.step(&mut state, &turned.with_command(BodyTwist::ZERO));
    }
    // kp times 1 rad/s, and no integral that would have grown to the limit meanwhile.
    let sample = drive.step(&mut state, &turned.with_command(BodyTwist::ZERO));
    assert!(
        (sample.wheels.applied.n_m[0] + 0.3).abs() < 0.003,
        "{:?}",
        sample.wheels.applied.n_m
    );
}

#[test]
fn motors_are_shorted_in_a_stop_and_only_those_of_wheels_with_a_fault() {
    let drive = Drive::new(config()).expect("valid");
    let mut state = DriveState::new(&drive);
    // Wheels that cannot be heard, for so many periods: 20 make one faulty, 10 more of a motion that nobody tells are a safe stop.
    let after = |state: &mut DriveState<f64, 7>, silent: &[usize], periods| {
        let mut input = DriveInput::measured(&WheelVelocities::zero()).with_command(COMMAND);
        for &wheel in silent {
            input.readings_rad_s[wheel] = None;
        }
        let mut last = drive.step(state, &input);
        for _ in 1..periods {
            last = drive.step(state, &input);
        }
        (last.mode, last.brake)
    };
    let only = |wheels: &[usize]| core::array::from_fn(|i| wheels.contains(&i));
    let none = [false; 7];
    assert_eq!(after(&mut state, &[], 5), (DriveMode::Normal, none));
    assert_eq!(after(&mut state, &[5], 40), (DriveMode::Degraded, none)); // the others drive on past it
    state.emergency_stop();
    assert_eq!(after(&mut state, &[5], 1), (DriveMode::EmergencyStop, only(&[5])));
    state.release_emergency_stop();
    assert_eq!(after(&mut state, &[5], 1), (DriveMode::Degraded, none));
    let four = [0, 1, 3, 5];
    assert_eq!(after(&mut state, &four, 60), (DriveMode::SafeStop, only(&four)));
    // Wheels that are believed again, 100 good readings later, are braked by their loops.
    assert_eq!(after(&mut state, &[], 150), (DriveMode::SafeStop, none));
}
