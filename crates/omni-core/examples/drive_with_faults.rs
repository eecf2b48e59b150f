//! A whole drive while an encoder dies: command limits, fault detection, loops and odometry in one step a period.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::drive::{Fault, FaultConfig};
use omni_core::shaping::{AxisLimits, TwistLimits};
use omni_core::{
    BodyTwist, ConfigError, Coordination, Drive, DriveConfig, DriveInput, DriveState, PidConfig, PidGains,
    TorqueLimit, WheelControlConfig, WheelLayout,
};

fn main() -> Result<(), ConfigError> {
    let control = WheelControlConfig {
        pid: PidConfig::new(PidGains::pi(0.3, 2.0), 0.001),
        limits: [TorqueLimit::constant(2.0)?; 7],
        coordination: Coordination::scale_references(),
    };
    let mut config = DriveConfig::new(WheelLayout::chugo7(0.30, 0.23, 0.066)?, control);
    let [vx, vy, wz] = [AxisLimits::symmetric(0.5, 0.5, 0.5, f64::INFINITY); 3]; // 0.5 m/s, reached in 1 s
    config.shaping.limits = TwistLimits::PerAxis { vx, vy, wz };
    let mut faults = FaultConfig::unchecked();
    // An encoder says the same for 100 periods while its wheel turns 1 rad/s faster by what the others say.
    (faults.stuck_periods, faults.stuck_rad_s) = (100, 1.0);
    config.faults = Some(faults);
    let drive = Drive::new(config)?;
    let (mut state, mut twist, mut found) = (DriveState::new(&drive), BodyTwist::ZERO, None);
    for millisecond in 0..2000 {
        let mut wheels = drive.kinematics().inverse(&twist); // a vehicle that moves as the drive wants it to
        if millisecond >= 400 {
            wheels.rad_s[3] = 3.0; // the last that the fourth encoder says
        }
        let command = BodyTwist::from_array([1.0, 0.0, 0.0]); // twice of what is allowed
        let sample = drive.step(&mut state, &DriveInput::measured(&wheels).with_command(command));
        twist = sample.shaped.twist;
        found = found.or(sample.faults[3].map(|fault| (millisecond, fault, sample.mode)));
    }
    let (speed_m_s, way_m) = (twist.vx_m_s, state.odometry.pose().x_m);
    println!("encoder 4 dies at 400 ms; found: {found:?}; after 2 s {speed_m_s:.2} m/s and {way_m:.3} m");
    // 1 rad/s of a wheel of 66 mm takes 132 ms at 0.5 m/s^2, the evidence 100 ms; a ramp of 1 s to 0.5 m/s, then 1 s.
    assert!(found.is_some_and(|(at, fault, _)| fault == Fault::Stuck && (625..640).contains(&at)));
    assert!((speed_m_s - 0.5).abs() < 1e-12 && (way_m - 0.75).abs() < 0.005);
    Ok(())
}
