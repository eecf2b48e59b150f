//! One PID loop on a motor, with and without anti-windup.
//!
//! Prints the motor's speed over time on its way from rest to 20 rad/s. At first the loop asks for more torque than there
//! is. Without anti-windup the integral fills up meanwhile, and the speed shoots far over; with it the rest is the gains'.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::{AntiWindup, ConfigError, Pid, PidConfig, PidGains, PidState, TorqueLimit};

const PERIOD_S: f64 = 0.001;
const REFERENCE_RAD_S: f64 = 20.0;
const INERTIA_KG_M2: f64 = 0.02;

fn main() -> Result<(), ConfigError> {
    let gains = PidGains {
        kp_n_m_s_rad: 0.2,
        ki_n_m_rad: 2.0,
        kd_n_m_s2_rad: 0.0,
    };
    let mut config = PidConfig::new(gains, PERIOD_S);
    config.output = TorqueLimit::constant(1.0)?.range(0.0); // the motor has 1 N.m either way
    println!("speed [rad/s] at  0.2 s  0.4 s  0.6 s  0.8 s  1.0 s  1.2 s  1.4 s  1.6 s  highest");
    for (name, anti_windup, expected) in [
        ("none", AntiWindup::None, 30.0..40.0),
        ("conditioned", AntiWindup::Conditioned, 20.0..23.0),
    ] {
        config.anti_windup = anti_windup;
        let pid = Pid::new(config)?;
        let (mut state, mut speed_rad_s, mut highest_rad_s) = (PidState::default(), 0.0, 0.0_f64);
        print!("{name:16}");
        for period in 1..=1600 {
            let torque_n_m = pid.step(&mut state, REFERENCE_RAD_S, speed_rad_s).output_n_m;
            speed_rad_s += torque_n_m / INERTIA_KG_M2 * PERIOD_S;
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
