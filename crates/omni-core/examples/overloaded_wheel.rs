//! What wheels do together when one has more load than its motor can turn: two coordination policies.
//!
//! Prints the speeds that three wheels settle at. Under `independent` the other two go on as told, and a vehicle on them
//! would leave its course; under `synchronised` all slow down alike.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::{ConfigError, ControlState, Coordination, PidConfig, PidGains, TorqueLimit};
use omni_core::{WheelControlConfig, WheelController, WheelVelocities};

const PERIOD_S: f64 = 0.001;
const INERTIA_KG_M2: f64 = 0.02;
/// A brake on each wheel [N.m per rad/s]. The second one needs 2 N.m at 10 rad/s, and the motors have 1 N.m.
const BRAKES: [f64; 3] = [0.02, 0.2, 0.02];

fn main() -> Result<(), ConfigError> {
    let gains = PidGains {
        kp_n_m_s_rad: 0.3,
        ki_n_m_rad: 2.0,
        kd_n_m_s2_rad: 0.0,
    };
    let reference = WheelVelocities::from([10.0, 10.0, 5.0]);
    println!("asked for     {:5.1?} rad/s", reference.rad_s);
    for (name, coordination, expected) in [
        ("independent", Coordination::independent(), [10.0, 5.0, 5.0]),
        ("synchronised", Coordination::synchronised(), [5.0, 5.0, 2.5]),
    ] {
        let wheels = WheelController::new(WheelControlConfig {
            pid: PidConfig::new(gains, PERIOD_S),
            limits: [TorqueLimit::constant(1.0)?; 3],
            coordination,
        })?;
        let (mut state, mut speeds) = (ControlState::default(), WheelVelocities::zero());
        for _ in 0..5000 {
            let torques = wheels.step(&mut state, &reference, &speeds).applied;
            for i in 0..3 {
                let left_n_m = torques.n_m[i] - BRAKES[i] * speeds.rad_s[i];
                speeds.rad_s[i] += left_n_m / INERTIA_KG_M2 * PERIOD_S;
            }
        }
        println!("{name:14}{:5.1?} rad/s", speeds.rad_s);
        for (speed, expected) in speeds.rad_s.into_iter().zip(expected) {
            assert!((speed - expected).abs() < 0.05, "{speed} is not {expected}");
        }
    }
    Ok(())
}
