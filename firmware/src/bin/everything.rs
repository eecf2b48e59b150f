//! What `Drive::step` costs with every option on: limits with jerk, speed limits, faults, slip, covariance, paths, a command
//! point, discretisation.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use omni_core::{BodyTwist, DriveInput, DriveState};
use omni_firmware::constants::DRIVE;
use omni_firmware::counter::Counter;
use omni_firmware::platform::exit;
use omni_firmware::{say, stack};

#[inline(never)]
fn step(state: &mut DriveState<f32, 7>, input: &DriveInput<f32, 7>) {
    black_box(DRIVE.step(state, input));
}

fn input(command: BodyTwist<f32>, readings_rad_s: [f32; 7]) -> DriveInput<f32, 7> {
    let mut input = DriveInput::measured(&readings_rad_s.into());
    input.command = Some(command);
    input
}

#[entry]
fn main() -> ! {
    let command = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    };
    let whole = DRIVE.kinematics().inverse(&command).rad_s;
    let with = |part: f32| whole.map(|v| v * part);
    let mut slipping = with(1.0);
    slipping[0] += 5.0;
    let cases = [
        ("free", with(1.0)),
        ("saturated", with(0.3)),
        ("slipping", slipping),
    ];
    let Some(counter) = Counter::start() else {
        say!("no timer to count instructions with");
        exit(false)
    };
    for (name, readings) in cases {
        let mut state = DriveState::new(&DRIVE);
        let most = counter.most(400, |k| {
            // The readings come in over some periods, as wheels speed up.
            let part = if k < 100 { k as f32 / 100.0 } else { 1.0 };
            let input = input(command, readings.map(|v| v * part));
            step(black_box(&mut state), black_box(&input));
        });
        say!("instructions, everything on, {}: {}", name, most);
    }
    let mut state = DriveState::new(&DRIVE);
    let input = input(command, whole);
    say!(
        "stack of a step with everything on: {} bytes",
        stack::used_by(|| step(&mut state, black_box(&input)))
    );
    exit(true)
}
