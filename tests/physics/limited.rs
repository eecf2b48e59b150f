//! A run that stalls says what limited it.

use omni_sim::config::Override;
use omni_sim::{LimitedBy, Outcome, Verdict, run};

use crate::engines::{load, on_the_fast_engine};

/// `chugo7` at its step of 5 cm.
fn at_the_step(keys: &[&str]) -> Outcome {
    let keys: Vec<_> = keys
        .iter()
        .map(|key| Override::parse(key).expect("KEY=VALUE"))
        .collect();
    *run(&load("step", &keys).expect("valid")).expect("runs").outcome()
}

/// Its climb takes 1.3 N.m (`omnistep climb-limits step`).
fn motors_of_half_the_torque_that_a_step_takes_are_limited_by_torque() {
    for policy in ["independent", "scale_torques", "traction"] {
        let policy = format!("control.policy={policy}");
        let weak = at_the_step(&[&policy, "vehicle.motor.stall_torque_n_m=0.6"]);
        assert_eq!(
            (weak.verdict, weak.limited_by),
            (Verdict::Stalled, Some(LimitedBy::Torque)),
            "{policy}: {weak:?}"
        );
        assert!(weak.limited_wheels.is_some_and(|wheels| wheels >= 1), "{weak:?}");
    }
}

/// Statics of an upright edge nearly as high as the axle want a friction of 0.4 and more.
fn wheels_on_ice_at_a_step_are_limited_by_friction() {
    for policy in ["independent", "scale_torques", "traction"] {
        let policy = format!("control.policy={policy}");
        let icy = at_the_step(&[&policy, "terrain.friction=0.2"]);
        assert_eq!(
            (icy.verdict, icy.limited_by),
            (Verdict::Stalled, Some(LimitedBy::Friction)),
            "{policy}: {icy:?}"
        );
        assert!(icy.limited_wheels.is_some_and(|wheels| wheels >= 3), "{icy:?}");
    }
}

/// On its way, it needs some seconds more. And a loop without an integral that gives a twentieth of
/// the torque: no wheel slips, no motor is at its limit.
fn too_little_time_and_a_loop_below_its_torque_are_limited_by_time() {
    let short = at_the_step(&["duration_s=1.5"]);
    assert_eq!(
        (short.verdict, short.limited_by, short.limited_wheels),
        (Verdict::Unfinished, Some(LimitedBy::Time), None),
        "{short:?}"
    );
    let slow = at_the_step(&[
        "control.policy=independent",
        "vehicle.gains={ kp_n_m_s_rad = 0.03, ki_n_m_rad = 0.003 }",
    ]);
    assert_eq!(
        (slow.verdict, slow.limited_by, slow.limited_wheels),
        (Verdict::Stalled, Some(LimitedBy::Time), None),
        "{slow:?}"
    );
}

fn a_run_that_climbs_or_drives_is_limited_by_nothing() {
    let climb = at_the_step(&["stop_when_done=true"]);
    assert_eq!(
        (climb.verdict, climb.limited_by),
        (Verdict::Climbed, None),
        "{climb:?}"
    );
}

on_the_fast_engine! {
    motors_of_half_the_torque_that_a_step_takes_are_limited_by_torque,
    wheels_on_ice_at_a_step_are_limited_by_friction,
    too_little_time_and_a_loop_below_its_torque_are_limited_by_time,
    a_run_that_climbs_or_drives_is_limited_by_nothing,
}
