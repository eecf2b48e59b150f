//! The randomised steps that firmware images hash: does the hash notice what it should?

#[path = "../../firmware/src/randomised.rs"]
#[expect(unreachable_pub, reason = "public in the firmware's own library")]
mod randomised;

use omni_sim::config::{Override, Scenario};

fn hash(key: &str) -> u32 {
    let scenario = Scenario::load("step", &[Override::parse(key).expect("valid")]).expect("valid");
    let odometry = omni_core::estimate::Odometry::new(scenario.period_s() as f32).expect("valid");
    let (controller, limiter) = (
        scenario.controller().expect("valid"),
        scenario.limiter().expect("valid"),
    );
    randomised::hash(randomised::STEPS, |memory, command, measured| {
        randomised::step(&controller, &limiter, memory, command, measured);
        randomised::pose(&controller, &odometry, memory);
    })
}

#[test]
fn any_change_of_the_controller_changes_the_hash_of_the_randomised_steps() {
    let own = hash("seed=1"); // which no controller knows of
    assert_eq!(hash("seed=2"), own);
    for key in [
        "vehicle.gains.kp_n_m_s_rad=0.300001",
        "vehicle.gains.kd_n_m_s2_rad=1e-9",
        "vehicle.motor.stall_torque_n_m=1.999",
        "vehicle.limits.wz_rad_s=1.9",
        "vehicle.wheel[6].radius_m=0.0660001",
        "control.policy=\"scale_torques\"",
    ] {
        assert_ne!(hash(key), own, "{key}");
    }
}
