//! What a step of a `Drive` costs: instructions in several situations, and stack.

use core::hint::black_box;

use omni_core::drive::DriveSample;
use omni_core::{BodyTwist, Drive, DriveInput, DriveState};

use crate::counter::Counter;
use crate::platform::exit;
use crate::{say, stack};

/// A step of the drive of the image, in which the compiler knows its constants, into a sample.
pub type Step = fn(&mut DriveState<f32, 7>, &DriveInput<f32, 7>, &mut DriveSample<f32, 7>);

fn input(command: BodyTwist<f32>, readings_rad_s: [f32; 7]) -> DriveInput<f32, 7> {
    let mut input = DriveInput::measured(&readings_rad_s.into());
    input.command = Some(command);
    input
}

/// Says what `step` costs, by `name`, and ends the program.
pub fn report(name: &str, drive: &Drive<f32, 7>, step: Step) -> ! {
    let command = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    };
    let whole = drive.kinematics().inverse(&command).rad_s;
    let with = |part: f32| whole.map(|v| v * part);
    let mut slipping = with(1.0);
    slipping[0] += 5.0;
    let cases = [
        ("free", with(1.0)),
        ("saturated", with(0.3)),
        ("slipping", slipping),
    ];
    let mut sample = DriveSample::zero();
    let Some(counter) = Counter::start() else {
        say!("no timer to count instructions with");
        exit(false)
    };
    for (case, readings) in cases {
        let mut state = DriveState::new(drive);
        let most = counter.most(400, |k| {
            // The readings come in over some periods, as wheels speed up.
            let part = if k < 100 { k as f32 / 100.0 } else { 1.0 };
            let input = input(command, readings.map(|v| v * part));
            step(black_box(&mut state), black_box(&input), black_box(&mut sample));
        });
        say!("instructions, {}, {}: {}", name, case, most);
    }
    // A wheel that falls silent: the motion is to be estimated from the others, by a matrix that is inverted anew.
    let mut state = DriveState::new(drive);
    let silent = counter.most(10, |k| {
        let mut input = input(command, whole);
        if k >= 5 {
            input.readings_rad_s[2] = None;
        }
        step(black_box(&mut state), black_box(&input), black_box(&mut sample));
    });
    say!("instructions, {}, a wheel lost: {}", name, silent);
    let mut state = DriveState::new(drive);
    let input = input(command, whole);
    say!(
        "stack of a step with {}: {} bytes",
        name,
        stack::used_by(|| step(&mut state, black_box(&input), &mut sample))
    );
    exit(true)
}
