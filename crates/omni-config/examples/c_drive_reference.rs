//! The steps of firmware/c/example/drive.c on this computer: the C program has to print the same
//! hash. Its argument is the scenario that the constants are of.

mod fnv;

use fnv::{START, take, take_all, take_bytes};
use omni_config::{Error, Scenario};
use omni_core::drive::{DriveSample, Fault};
use omni_core::geometry::{PathFactors, PlanarPose};
use omni_core::{BodyTwist, DriveInput, DriveState, WheelVelocities};

/// What arrives in period `k`.
fn input(k: u32, wheels: &WheelVelocities<f32, 7>) -> DriveInput<f32, 7> {
    let mut measured = *wheels;
    if (2450..2550).contains(&k) {
        measured.rad_s[4] += 5.0;
    }
    let mut input = DriveInput::measured(&measured);
    let commanded = k.is_multiple_of(20) && !(1000..1600).contains(&k);
    input.command = commanded.then_some(BodyTwist {
        vx_m_s: if k == 3900 { f32::NAN } else { 0.6 },
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    });
    if (3200..3300).contains(&k) {
        input.readings_rad_s = [None; 7];
    }
    if (2000..2200).contains(&k) {
        input.readings_rad_s[2] = None;
    }
    input.lifted[6] = (2560..2590).contains(&k);
    if (1600..1800).contains(&k) {
        input.torque_ranges.lower_n_m[0] = -0.5;
        input.torque_ranges.upper_n_m[0] = 0.0;
    }
    if (1850..1900).contains(&k) {
        input.path = PathFactors::or_flat([1.0, 1.0, 1.0, 1.2, 1.0, 1.0, 1.0]);
    }
    input
}

fn hashed(mut hash: u32, sample: &DriveSample<f32, 7>) -> u32 {
    for i in 0..7 {
        hash = take(hash, sample.wheels.applied.n_m[i]);
        let fault = sample.faults[i].map_or(0, Fault::number);
        let marks = [sample.slip.excluded[i], sample.brake[i]].map(u8::from);
        hash = take_bytes(hash, &[fault, marks[0], marks[1]]);
    }
    hash = take_bytes(hash, &[sample.mode.number(), u8::from(sample.motion_known)]);
    let PlanarPose { x_m, y_m, yaw_rad } = sample.pose;
    take_all(hash, &[x_m, y_m, yaw_rad])
}

#[expect(clippy::print_stdout, reason = "an example speaks on standard output")]
fn main() -> Result<(), Error> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "flat".into());
    let scenario = Scenario::load(&name, &[])?;
    let Some(drive) = scenario.drive::<f32, 7>()? else {
        println!("{name} has no [drive]");
        return Ok(());
    };
    let mut state = DriveState::new(&drive);
    let (mut wheels, mut references) = (WheelVelocities::zero(), WheelVelocities::<f32, 7>::zero());
    let (mut active, mut hash) = ([false; 7], START);
    for k in 0..5500 {
        match k {
            3700 => state.release_safe_stop(),
            3800 => {
                state.odometry.reset(&PlanarPose {
                    x_m: 1.0,
                    y_m: 2.0,
                    yaw_rad: 0.5,
                });
            }
            _ => {}
        }
        // Wheels take 20 ms to follow; a released one rolls on.
        for i in 0..7 {
            if active[i] {
                wheels.rad_s[i] += 0.05 * (references.rad_s[i] - wheels.rad_s[i]);
            }
        }
        let mut input = input(k, &wheels);
        input.emergency = (2600..3000).contains(&k) || k >= 4400;
        let sample = drive.step(&mut state, &input);
        (references, active) = (sample.wheels.reference, sample.wheels.active);
        hash = hashed(hash, &sample);
    }
    hash = state
        .covariance
        .standard_deviations()
        .into_iter()
        .fold(hash, take);
    println!("{hash}");
    Ok(())
}
