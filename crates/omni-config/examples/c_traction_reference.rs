//! The steps of firmware/c/example/traction.c on this computer: the C program has to print the same
//! hash. Its argument is the scenario that the constants are of.

mod fnv;

use fnv::{START, take, take_all, take_bytes};
use omni_config::{Error, Scenario};
use omni_core::drive::{BodyReadings, Fault, TractionDriveSample, TractionDriveState};
use omni_core::geometry::PlanarPose;
use omni_core::policy::Imu;
use omni_core::{BodyTwist, DriveInput, WheelVelocities};

/// How each wheel's rolling direction points along x.
const ALONG: [f32; 7] = [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0];

/// The vehicle on flat ground, for 1 ms.
fn rolled(speed_m_s: f32, torques_n_m: &[f32; 7]) -> f32 {
    let mut force_n = -5.0 * speed_m_s;
    for (along, torque_n_m) in ALONG.iter().zip(torques_n_m) {
        force_n += along * torque_n_m / 0.066;
    }
    speed_m_s + force_n * 0.00005
}

/// What arrives in period `k`.
fn input(k: u16, speed_m_s: f32) -> DriveInput<f32, 7> {
    let mut measured = WheelVelocities::zero();
    for (i, rate) in (0_u16..).zip(&mut measured.rad_s) {
        *rate = ALONG[usize::from(i)] * speed_m_s / 0.066 + 0.01 * f32::from((k + 3 * i) % 5);
    }
    if (800..1000).contains(&k) {
        measured.rad_s[0] += 0.02 * f32::from(k - 800);
    }
    let mut input = DriveInput::measured(&measured);
    let commanded = k.is_multiple_of(20) && !(1300..2000).contains(&k);
    input.command = commanded.then_some(BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    });
    if (3400..3600).contains(&k) {
        input.readings_rad_s[3] = None;
    }
    if (3700..3900).contains(&k) {
        input.torque_ranges.lower_n_m[4] = -0.01;
        input.torque_ranges.upper_n_m[4] = 0.01;
    }
    input
}

fn hashed(mut hash: u32, sample: &TractionDriveSample<f32, 7>, supervisor: u8) -> u32 {
    let (drive, law) = (&sample.drive, &sample.traction);
    for i in 0..7 {
        hash = take_all(
            hash,
            &[drive.wheels.applied.n_m[i], law.slip_rad_s[i], law.contact_n_m[i]],
        );
        let fault = drive.faults[i].map_or(0, Fault::number);
        hash = take_bytes(hash, &[fault, u8::from(drive.brake[i])]);
    }
    let wheel = law.speed_wheel.map_or(0, |wheel| wheel as u8 + 1);
    hash = take_bytes(
        hash,
        &[drive.mode.number(), law.loops.number(), supervisor, wheel],
    );
    hash = take_all(hash, &[law.speed_m_s, law.target_m_s, law.thrust_n_m]);
    hash = take_all(hash, &[law.yaw_rad_s, law.heading_rad, law.gyro_zero_rad_s]);
    take_all(hash, &[drive.pose.x_m, drive.pose.y_m, drive.pose.yaw_rad])
}

#[expect(clippy::print_stdout, reason = "an example speaks on standard output")]
fn main() -> Result<(), Error> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "step".into());
    let scenario = Scenario::load(&name, &[])?;
    let Some(drive) = scenario.traction_drive::<f32, 7>()? else {
        println!("{name} has no [drive] with traction control");
        return Ok(());
    };
    let mut state = TractionDriveState::new(&drive);
    let (mut speed_m_s, mut torques_n_m, mut hash) = (0.0_f32, [0.0; 7], START);
    for k in 0..6000_u16 {
        let climbs = (2600..3200).contains(&k);
        speed_m_s = if climbs {
            0.15
        } else {
            rolled(speed_m_s, &torques_n_m)
        };
        let hinges_rad = [
            if climbs {
                -0.0002 * f32::from(k - 2600)
            } else {
                0.0
            },
            0.01,
        ];
        let hinges_rad_s = [if climbs { -0.2 } else { 0.0 }, 0.0];
        let mut bodies = BodyReadings::none();
        if !(5500..6000).contains(&k) {
            (bodies.hinges_rad, bodies.hinges_rad_s, bodies.imu) = (&hinges_rad, &hinges_rad_s, Imu::level());
            bodies.imu.rate_rad_s[2] = 0.002;
            bodies.imu.pitch_rad = 0.02;
        }
        if k == 5000 {
            state.drive.odometry.reset(&PlanarPose {
                x_m: 0.5,
                y_m: 0.1,
                yaw_rad: 0.0,
            });
        }
        let mut input = input(k, speed_m_s);
        input.emergency = (4200..5000).contains(&k);
        let sample = drive.step(&mut state, &input, &bodies);
        torques_n_m = sample.drive.wheels.applied.n_m;
        hash = hashed(hash, &sample, state.supervisor().mode().number());
    }
    let off = state.drive.covariance.standard_deviations();
    println!("{}", off.into_iter().fold(hash, take));
    Ok(())
}
