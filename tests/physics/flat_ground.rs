//! The vehicle on flat ground follows its command.

use omni_core::BodyTwist;
use omni_sim::Simulation;

use crate::engines::{load, on_both_engines};

/// Mean twist over the last second of four, the command held from the start.
fn settled(command: BodyTwist<f64>, policy: &str) -> [f64; 3] {
    let scenario = load("flat", &[])
        .and_then(|s| s.with_policy(policy))
        .expect("built-in scenario");
    let mut simulation = Simulation::new(&scenario).expect("valid scenario");
    let mut sum = [0.0; 3];
    for k in 0..4000 {
        simulation.step(&command).expect("the simulation stays finite");
        if k >= 3000 {
            let twist = simulation.observation().twist.to_array();
            sum = [0, 1, 2].map(|i| sum[i] + twist[i] / 1000.0);
        }
    }
    sum
}

fn follows_within_a_thousandth(command: BodyTwist<f64>) {
    for policy in ["independent", "scale_references"] {
        let got = settled(command, policy);
        let wanted = command.to_array();
        // 0.1 % of each component; what is not asked for stays below 0.1 % of the rest, with 0.3 m as the lever of yaw.
        let scale = wanted[0].hypot(wanted[1]).hypot(0.3 * wanted[2]);
        for (axis, (got, wanted)) in got.iter().zip(wanted).enumerate() {
            let allowed = if wanted == 0.0 {
                1e-3 * scale
            } else {
                1e-3 * wanted.abs()
            };
            assert!(
                (got - wanted).abs() < allowed,
                "{policy}, axis {axis}: {got} instead of {wanted}"
            );
        }
    }
}

fn forward_command_is_followed_within_a_thousandth() {
    follows_within_a_thousandth(BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.0,
        wz_rad_s: 0.0,
    });
}

fn sideways_command_is_followed_within_a_thousandth() {
    follows_within_a_thousandth(BodyTwist {
        vx_m_s: 0.0,
        vy_m_s: 0.3,
        wz_rad_s: 0.0,
    });
}

fn yaw_command_is_followed_within_a_thousandth() {
    follows_within_a_thousandth(BodyTwist {
        vx_m_s: 0.0,
        vy_m_s: 0.0,
        wz_rad_s: 0.5,
    });
}

fn mixed_command_is_followed_within_a_thousandth() {
    follows_within_a_thousandth(BodyTwist {
        vx_m_s: 0.2,
        vy_m_s: -0.1,
        wz_rad_s: 0.3,
    });
}

fn gear_changes_the_actuator_not_the_motion() {
    use omni_sim::config::Override;
    // A 20:1 reduction: actuators turn 20 times faster with a 20th of the torque. Gains follow: k^2 of them.
    let mut overrides: Vec<_> = (0..7)
        .map(|i| Override::new(format!("vehicle.wheel.{i}.gear"), 0.05))
        .collect();
    for (key, direct) in [
        ("motor.stall_torque_n_m", 2.0 * 0.05),
        ("gains.kp_n_m_s_rad", 0.3 * 0.0025),
        ("gains.ki_n_m_rad", 2.0 * 0.0025),
    ] {
        overrides.push(Override::new(format!("vehicle.{key}"), direct));
    }
    let run = |overrides: &[Override]| {
        let scenario = load("flat", overrides).expect("valid");
        omni_sim::run(&scenario).expect("runs")
    };
    let (geared, direct) = (run(&overrides), run(&[]));
    let last = direct.rows() - 1;
    let at = |trace: &omni_sim::Trace, name: &str| trace.column(name).expect("a column")[last];
    // The same motion up to rounding that the contact solver amplifies.
    assert!((at(&geared, "pose_x_m") - at(&direct, "pose_x_m")).abs() < 1e-6);
    let ratio = at(&geared, "wheel_1_measured_rad_s") / at(&direct, "wheel_1_measured_rad_s");
    assert!((ratio - 20.0).abs() < 1e-3, "{ratio}");
}

on_both_engines! {
    forward_command_is_followed_within_a_thousandth,
    sideways_command_is_followed_within_a_thousandth,
    yaw_command_is_followed_within_a_thousandth,
    mixed_command_is_followed_within_a_thousandth,
    gear_changes_the_actuator_not_the_motion,
}
