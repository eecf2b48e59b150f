//! An emergency stop of a whole drive on the chip: does torque end when it is said to, whatever an encoder reads?
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use omni_core::{BodyTwist, DriveInput, DriveState, WheelVelocities};
use omni_firmware::constants::{DEFAULTS, PERIOD_US};
use omni_firmware::platform::exit;
use omni_firmware::say;

/// What is wrong with the encoder of the second wheel.
#[derive(Clone, Copy)]
enum Encoder {
    /// It says what it said last.
    Stuck,
    /// Its counter stands.
    Dead,
    /// Its counter goes up and down by one as the shaft turns: at 1440 counts per turn and 1 ms, 4.4 rad/s each way.
    Toggles,
}

/// An emergency stop of a whole drive while an encoder is wrong. In which period since the references came
/// to 0 the torque ended; none if there was torque after that, or another motor than all was to be shorted.
fn end_of_torque(encoder: Encoder) -> Option<u32> {
    let mut state = DriveState::new(&DEFAULTS);
    let mut readings = WheelVelocities::<f32, 7>::zero();
    let command = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    let (mut rested, mut ended) = (0, None);
    for k in 0..3000_u32 {
        let mut input = DriveInput::measured(&readings).with_command(command);
        input.emergency = k >= 1000;
        let sample = DEFAULTS.step(&mut state, &input);
        let broken = match encoder {
            Encoder::Stuck => readings.rad_s[1],
            Encoder::Dead => 0.0,
            Encoder::Toggles => [4.4, -4.4][(k % 2) as usize],
        };
        let reference = sample.wheels.reference.rad_s;
        // Wheels take 20 ms to follow.
        for (velocity, reference) in readings.rad_s.iter_mut().zip(reference) {
            *velocity += 0.05 * (reference - *velocity);
        }
        if k >= 900 {
            readings.rad_s[1] = broken;
        }
        if k < 1000 {
            continue;
        }
        rested = if reference == [0.0; 7] { rested + 1 } else { 0 };
        let over = sample.wheels.applied.n_m == [0.0; 7]
            && sample.wheels.active == [false; 7]
            && sample.brake == [true; 7];
        match ended {
            None if sample.wheels.ended => ended = over.then_some(rested),
            Some(_) if !over => return None,
            _ => {}
        }
    }
    ended
}

#[entry]
fn main() -> ! {
    // 0.5 s of rest, in which torques fall to 0, and the period after them.
    let bled = 500_000_u32.div_ceil(PERIOD_US);
    let stops = [Encoder::Stuck, Encoder::Dead, Encoder::Toggles]
        .map(end_of_torque)
        .map(|ended| ended == Some(bled + 1));
    let ends = if stops == [true; 3] {
        "it ends in time"
    } else {
        "NOT in time"
    };
    say!(
        "torque in a stop behind an encoder that is stuck, dead or toggles: {}",
        ends
    );
    exit(stops == [true; 3])
}
