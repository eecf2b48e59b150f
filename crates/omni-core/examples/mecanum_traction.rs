//! Four mecanum wheels under traction control: encoders and an inertial measurement unit in, torques out.
//!
//! `cargo run --release -p omnistep-core --example mecanum_traction`
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::drive::{BodyReadings, FaultConfig, TractionDrive};
use omni_core::drive::{TractionDriveSample, TractionDriveState};
use omni_core::linkage::{CarriedWheel, Linkage};
use omni_core::policy::Imu;
use omni_core::traction::{
    Supervisor, SupervisorConfig, Traction, TractionConfig, TractionLoops, TractionWheel,
};
use omni_core::{BodyTwist, ConfigError, Coordination, Drive, DriveConfig, DriveInput, DriveMode};
use omni_core::{Kinematics, PidConfig, PidGains, TorqueLimit, WheelControlConfig, WheelLayout};

const PERIOD_S: f32 = 0.001;
/// Front axle to rear axle, left to right wheels, and radius of a wheel \[m\].
const WHEELBASE_M: f32 = 0.336;
const TRACK_M: f32 = 0.40;
const RADIUS_M: f32 = 0.048;
/// Torque of the gear motor at rest \[N.m\], and what a rad/s takes of it.
const STALL_N_M: f32 = 1.2;
const SLOPE_N_M_S_RAD: f32 = 0.0367;
/// Wheel, gear and rotor at the axle \[kg.m^2\]: the rotor's inertia times the square of the gear ratio.
const INERTIA_KG_M2: f32 = 0.0013;
/// Gains of a wheel's velocity loop, as `omnistep check my_robot.toml` prints them.
const GAINS: PidGains<f32> = PidGains {
    kp_n_m_s_rad: 0.0637,
    ki_n_m_rad: 0.159,
    kd_n_m_s2_rad: 0.0,
};

/// Once, before the first period.
fn traction_drive() -> Result<TractionDrive<f32, 4>, ConfigError> {
    let layout = WheelLayout::mecanum4(WHEELBASE_M, TRACK_M, RADIUS_M)?;
    let limit = TorqueLimit::line(STALL_N_M, SLOPE_N_M_S_RAD)?;
    let control = WheelControlConfig {
        pid: PidConfig::new(GAINS, PERIOD_S),
        limits: [limit; 4],
        coordination: Coordination::independent(),
    };
    let mut config = DriveConfig::new(layout, control);
    config.shaping.timeout_s = Some(0.2); // without a command for this time: come to rest
    config.faults = Some(FaultConfig::usual(PERIOD_S));

    // Front left, front right, rear left, rear right; all on the base, which is body 0.
    let (x, y) = (WHEELBASE_M / 2.0, TRACK_M / 2.0);
    let places = [[x, y], [x, -y], [-x, y], [-x, -y]];
    let carried = places.map(|[x, y]| CarriedWheel {
        body: 0,
        centre_m: [x, y, RADIUS_M],
    });
    let wheels = places.map(|place_m| TractionWheel {
        limit,
        inertia_kg_m2: INERTIA_KG_M2,
        carrier: [1.0, 0.0], // a wheel that rolls forward
        place_m,
    });
    let traction = Traction::new(
        Kinematics::new(&layout)?,
        Linkage::new(&[], &carried)?,
        wheels,
        TractionConfig::traction(GAINS.kp_n_m_s_rad, GAINS.ki_n_m_rad, PERIOD_S),
    )?;
    let supervisor = Supervisor::new(&places, SupervisorConfig::traction(PERIOD_S))?;
    TractionDrive::new(Drive::new(config)?, supervisor, traction)
}

/// Takes in a gyro and an accelerometer that are mounted along the base's axes: x forward, y left, z up. False if they
/// cannot be used.
fn read_unit(imu: &mut Imu<f32>, gyro_deg_s: [f32; 3], accelerometer_g: [f32; 3]) -> bool {
    imu.rate_rad_s = gyro_deg_s.map(f32::to_radians);
    imu.specific_force_m_s2 = accelerometer_g.map(|g| 9.81 * g);
    imu.update_angles(PERIOD_S)
}

/// Every period; `None` for what did not arrive.
fn every_period(
    drive: &TractionDrive<f32, 4>,
    state: &mut TractionDriveState<f32, 4>,
    encoders_rad_s: [Option<f32>; 4],
    command: Option<BodyTwist<f32>>,
    imu: Option<Imu<f32>>,
) -> TractionDriveSample<f32, 4> {
    let mut input = DriveInput::measured(&[0.0; 4].into());
    input.readings_rad_s = encoders_rad_s;
    input.command = command;
    let mut bodies = BodyReadings::none();
    bodies.imu = imu.unwrap_or(Imu::silent());
    drive.step(state, &input, &bodies)
}

fn main() -> Result<(), ConfigError> {
    // Nose up by 30 degrees: the accelerometer reads half of g along x. After 10 s, with a gyro whose zero is off:
    let mut tilted = Imu::silent();
    for _ in 0..10_000 {
        assert!(read_unit(&mut tilted, [0.0, 0.1, 0.0], [0.5, 0.0, 0.866]));
    }
    assert!((tilted.pitch_rad - 30_f32.to_radians()).abs() < 0.01);
    assert_eq!(tilted.roll_rad, 0.0);
    assert!(!read_unit(&mut tilted, [f32::NAN; 3], [0.5, 0.0, 0.866]));

    // The front wheels stand at a step: every wheel reads 0.
    let drive = traction_drive()?;
    let mut state = TractionDriveState::new(&drive);
    let ahead = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    let step = |state: &mut _, imu| every_period(&drive, state, [Some(0.0); 4], Some(ahead), imu);
    let first = step(&mut state, Some(Imu::level()));
    assert_eq!(first.traction.loops, TractionLoops::Plain);
    // Plain loops first have the time in which they would push with all that the motors have.
    let mut pushed = first;
    for _ in 0..900 {
        pushed = step(&mut state, Some(Imu::level()));
    }
    println!("held up: {:?} N.m", pushed.drive.wheels.applied.n_m);
    assert_eq!(pushed.traction.loops, TractionLoops::Traction);
    assert!(pushed.drive.wheels.applied.n_m.iter().all(|&n_m| n_m > 0.5));
    // Without the unit it goes on by the encoders alone.
    let blind = step(&mut state, None);
    assert!(blind.drive.wheels.applied.n_m.iter().all(|n_m| n_m.is_finite()));
    // A silent encoder is a fault within 0.1 s: its wheel gets no torque.
    let encoders = [Some(0.0), Some(0.0), Some(0.0), None];
    let mut lost = blind;
    for _ in 0..100 {
        lost = every_period(&drive, &mut state, encoders, Some(ahead), None);
    }
    assert_eq!(
        (lost.drive.mode, lost.drive.wheels.applied.n_m[3]),
        (DriveMode::Degraded, 0.0)
    );
    Ok(())
}
