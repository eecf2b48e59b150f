//! Where a vehicle is, from nothing but the counts of its encoders.
//!
//! Drives a circle of 1 m radius to the left and prints the pose at every quarter; the last is where it began.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::estimate::{Odometry, OdometryState};
use omni_core::{BodyTwist, ConfigError, Kinematics, WheelLayout};
use std::f64::consts::TAU;

const RAD_PER_COUNT: f64 = TAU / 4096.0;
const READINGS: u32 = 1000;

fn main() -> Result<(), ConfigError> {
    // Three omni wheels of 50 mm radius, each 0.2 m from the middle.
    let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    let odometry = Odometry::new(0.01)?;
    let mut state = OdometryState::default();

    let wheels = kinematics.inverse(&BodyTwist::from_array([1.0, 0.0, 1.0])); // 1 m/s and 1 rad/s: 1 m radius
    for reading in 0..=READINGS {
        let time_s = TAU * f64::from(reading) / f64::from(READINGS);
        let counts = wheels.rad_s.map(|rad_s| (rad_s * time_s / RAD_PER_COUNT).round()); // whole ones
        let angles_rad = counts.map(|count| count * RAD_PER_COUNT);
        odometry.step_positions(&mut state, &kinematics, &angles_rad.into());
        if reading % (READINGS / 4) == 0 {
            let pose = state.pose();
            let heading_deg = pose.yaw_rad.to_degrees();
            println!(
                "{time_s:4.2} s: x {:7.4} m, y {:7.4} m, heading {heading_deg:6.1} deg",
                pose.x_m, pose.y_m
            );
        }
    }
    let off_m = state.pose().x_m.hypot(state.pose().y_m);
    println!("{:.2} mm off after {TAU:.2} m", 1e3 * off_m);
    assert!(off_m < 1e-3); // a count is 0.08 mm at the rim
    Ok(())
}
