//! Wheel speeds of a mecanum vehicle from the motion of its body, and the motion back from the wheel speeds.
//!
//! Prints how fast each wheel turns [rad/s] for four motions, and the motion that this gives [m/s, m/s, rad/s].
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::{BodyTwist, ConfigError, Kinematics, WheelLayout};

fn main() -> Result<(), ConfigError> {
    // 0.6 m from axle to axle, 0.4 m from left to right, wheels of 0.1 m radius.
    let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
    println!("                     front left  front right  rear left  rear right    back:   vx    vy    wz");
    for (motion, twist) in [
        ("0.5 m/s forward", [0.5, 0.0, 0.0]),
        ("0.5 m/s to the left", [0.0, 0.5, 0.0]),
        ("1 rad/s to the left", [0.0, 0.0, 1.0]),
        ("all three at once", [0.5, 0.5, 1.0]),
    ] {
        let wheels = kinematics.inverse(&BodyTwist::from_array(twist));
        let back = kinematics.forward(&wheels).to_array();
        let [front_left, front_right, rear_left, rear_right] = wheels.rad_s;
        let [vx, vy, wz] = back;
        print!("{motion:20}{front_left:11.1}{front_right:13.1}{rear_left:11.1}{rear_right:12.1}");
        println!("{vx:15.1}{vy:6.1}{wz:6.1}");
        for (back, asked) in back.into_iter().zip(twist) {
            assert!((back - asked).abs() < 1e-12, "{back} is not {asked}");
        }
    }
    Ok(())
}
