//! One PID loop on a motor, with and without anti-windup.
//!
//! Prints the motor's speed on its way from rest to 20 rad/s. At first the loop asks for more torque than there is.
//! Without anti-windup the integral fills up meanwhile, and the speed shoots far over; with it the rest is the gains'.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::loops::{AntiWindup, Pid, PidState};
use omni_core::{ConfigError, PidConfig, PidGains, TorqueLimit};

fn main() -> Result<(), ConfigError> {
    let (period_s, inertia_kg_m2, reference_rad_s) = (0.001, 0.02, 20.0);
    let gains = PidGains::pi(0.2, 2.0);
    let mut config = PidConfig::new(gains, period_s);
    config.output = TorqueLimit::constant(1.0)?.range(0.0); // the motor has 1 N.m either way
    println!("speed [rad/s] at  0.2 s  0.4 s  0.6 s  0.8 s  1.0 s  1.2 s  1.4 s  1.6 s  highest");
    for (anti_windup, expected) in [
        (AntiWindup::None, 30.0..40.0),
        (AntiWindup::Conditioned, 20.0..23.0),
    ] {
        config.anti_windup = anti_windup;
        let pid = Pid::new(config)?;
        let (mut state, mut speed_rad_s, mut highest_rad_s) = (PidState::default(), 0.0, 0.0_f64);
        print!("{:16}", format!("{anti_windup:?}"));
        for period in 1..=1600 {
            let torque_n_m = pid.step(&mut state, reference_rad_s, speed_rad_s).output_n_m;
            speed_rad_s += torque_n_m / inertia_kg_m2 * period_s;
            highest_rad_s = highest_rad_s.max(speed_rad_s);
            if period % 200 == 0 {
                print!("{speed_rad_s:7.2}");
            }
        }
        println!("{highest_rad_s:9.2}");
        assert!(expected.contains(&highest_rad_s));
    }
    Ok(())
}
