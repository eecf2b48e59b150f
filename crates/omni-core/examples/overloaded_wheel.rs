//! What wheels do together when one has more load than its motor can turn: two coordination policies.
//!
//! Under `independent` two of three wheels go on as commanded, and a vehicle on them would leave
//! its course; under `scale_references` all slow down alike.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::loops::WheelController;
use omni_core::{ConfigError, ControlState, Coordination, PidConfig, PidGains, TorqueLimit};
use omni_core::{WheelControlConfig, WheelVelocities};

fn main() -> Result<(), ConfigError> {
    // A brake on each wheel [N.m per rad/s]. The second one needs 2 N.m at 10 rad/s, and the motors have 1 N.m.
    let brakes = [0.02, 0.2, 0.02];
    let (inertia_kg_m2, period_s) = (0.02, 0.001);
    let reference = WheelVelocities::from([10.0, 10.0, 5.0]);
    for (coordination, expected) in [
        (Coordination::independent(), [10.0_f64, 5.0, 5.0]),
        (Coordination::scale_references(), [5.0, 5.0, 2.5]),
    ] {
        println!("{coordination:?}");
        let wheels = WheelController::new(WheelControlConfig {
            pid: PidConfig::new(PidGains::pi(0.3, 2.0), period_s),
            limits: [TorqueLimit::constant(1.0)?; 3],
            coordination,
        })?;
        let (mut state, mut speeds) = (ControlState::default(), WheelVelocities::zero());
        for _ in 0..5000 {
            let torques = wheels.step(&mut state, &reference, &speeds).applied;
            for i in 0..3 {
                let left_n_m = torques.n_m[i] - brakes[i] * speeds.rad_s[i];
                speeds.rad_s[i] += left_n_m / inertia_kg_m2 * period_s;
            }
        }
        println!(
            "    {:5.1?} rad/s where {:5.1?} were asked for",
            speeds.rad_s, reference.rad_s
        );
        assert!((0..3).all(|i| (speeds.rad_s[i] - expected[i]).abs() < 0.05));
    }
    Ok(())
}
