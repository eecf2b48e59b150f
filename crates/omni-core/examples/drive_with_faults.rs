//! A whole drive while an encoder dies: command limits, fault detection, loops and odometry in one step a period.
//!
//! Prints when the drive notices, and how far off its odometry is at the end: the wheel of the dead encoder is let go, and
//! the other six tell the way.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::{
    AxisLimits, BodyTwist, ConfigError, Coordination, Drive, DriveConfig, DriveInput, DriveState, Fault,
    FaultConfig, PidConfig, PidGains, TorqueLimit, TwistLimits, WheelControlConfig, WheelLayout,
};

fn main() -> Result<(), ConfigError> {
    let gains = PidGains {
        kp_n_m_s_rad: 0.3,
        ki_n_m_rad: 2.0,
        kd_n_m_s2_rad: 0.0,
    };
    let control = WheelControlConfig {
        pid: PidConfig::new(gains, 0.001),
        limits: [TorqueLimit::constant(2.0)?; 7],
        coordination: Coordination::synchronised(),
    };
    let mut config = DriveConfig::new(WheelLayout::chugo7(0.30, 0.23, 0.066)?, control);
    let [vx, vy, wz] = [AxisLimits::symmetric(0.5, 0.5, 0.5, f64::INFINITY); 3]; // 0.5 m/s, reached in 1 s
    config.shaping.limits = TwistLimits::PerAxis { vx, vy, wz };
    let mut faults = FaultConfig::unchecked();
    // An encoder that says the same for so long, while its wheel turns so much faster by what the others say.
    (faults.stuck_periods, faults.stuck_rad_s) = (100, 1.0);
    config.faults = Some(faults);
    let drive = Drive::new(config)?;

    // A vehicle that moves just as the drive wants it to.
    let (mut state, mut twist, mut way_m) = (DriveState::new(&drive), BodyTwist::ZERO, 0.0);
    let mut found = None;
    for millisecond in 0..2000 {
        way_m += twist.vx_m_s * 0.001;
        let mut wheels = drive.kinematics().inverse(&twist);
        if millisecond >= 400 {
            wheels.rad_s[3] = 3.0; // the last that the fourth encoder says
        }
        let command = BodyTwist::from_array([1.0, 0.0, 0.0]); // twice of what is allowed
        let sample = drive.step(&mut state, &DriveInput::measured(&wheels).with_command(command));
        twist = sample.shaped.twist;
        if found.is_none()
            && let Some(fault) = sample.faults[3]
        {
            found = Some((millisecond, fault));
            println!(
                "{millisecond} ms: encoder 4 is {fault:?}, the drive is {:?}",
                sample.mode
            );
        }
    }
    let off_mm = 1e3 * (state.odometry.pose().x_m - way_m);
    println!(
        "2000 ms: {:.2} m/s, {way_m:.3} m gone, odometry {off_mm:+.1} mm off",
        twist.vx_m_s
    );
    // 1 rad/s of a wheel of 66 mm takes 132 ms at 0.5 m/s^2, the evidence 100 ms.
    assert!(found.is_some_and(|(at, fault)| fault == Fault::Stuck && (625..640).contains(&at)));
    assert!((twist.vx_m_s - 0.5).abs() < 1e-12 && off_mm.abs() < 5.0);
    Ok(())
}
