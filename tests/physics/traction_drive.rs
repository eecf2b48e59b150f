//! Traction control inside the firmware's whole step: what the drive is for holds, and it climbs as it does alone.

use omni_sim::config::{Engine, Override, Scenario};
use omni_sim::{Trace, run};

use crate::engines::{load, on_the_fast_engine};

/// The step in a drive with every default.
fn scenario(keys: &[&str]) -> Scenario {
    let all: Vec<_> = [
        "control.policy=traction",
        "drive.faults={}",
        "stop_when_done=true",
        "duration_s=12",
    ]
    .iter()
    .chain(keys)
    .map(|text| Override::parse(text).expect("KEY=VALUE"))
    .collect();
    load("step", &all).expect("valid")
}

fn column<'a>(trace: &'a Trace, name: &str) -> &'a [f64] {
    trace.column(name).unwrap_or_else(|| panic!("no column {name}"))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// Every torque of a trace from a row on.
fn torque_from(trace: &Trace, row: usize) -> f64 {
    let wheels = (0..7).map(|wheel| largest(&trace.wheel("torque_n_m", wheel).expect("a signal")[row..]));
    wheels.fold(0.0, f64::max)
}

fn in_a_drive_it_climbs_as_it_does_alone() {
    let whole = run(&scenario(&[])).expect("runs");
    let mut alone = scenario(&[]);
    alone.drive = None;
    let alone = run(&alone).expect("runs");
    let [whole_s, alone_s] = [&whole, &alone].map(|trace| trace.outcome().crossing_s.expect("it climbs"));
    // The same law: only the shaping of the command and a monitor that finds nothing are between.
    assert!((whole_s / alone_s - 1.0).abs() < 0.02, "{whole_s} s, {alone_s} s");
    assert!(
        column(&whole, "traction_loops").contains(&1.0),
        "it is traction control that climbs"
    );
    assert_eq!(largest(column(&whole, "drive_mode")), 0.0);
}

fn an_emergency_stop_on_the_riser_ends_without_torque_and_nothing_is_tried() {
    // At 1.4 s the front wheels are on the riser. Half a second after the reference has come to
    // rest (0.15 s) no torque is left.
    let stop = "fault=[{kind='emergency_stop',from_s=1.4}]";
    let trace = run(&scenario(&[stop, "stop_when_done=false", "duration_s=5"])).expect("runs");
    assert!(
        column(&trace, "traction_loops")[..1400].contains(&1.0),
        "it had begun to climb"
    );
    assert_eq!(torque_from(&trace, 1400 + 150 + 500 + 2), 0.0);
    assert_eq!(
        largest(&column(&trace, "traction_mode")[1400..]),
        0.0,
        "no back-off, no run-up"
    );
    // Nothing drives it on: at most the way of its last speed over the time of the stop.
    let ahead = column(&trace, "twist_vx_m_s");
    assert!(
        ahead[1400..].iter().all(|speed| *speed < 0.45),
        "{}",
        largest(&ahead[1400..])
    );
}

fn a_stop_while_it_backs_off_does_not_drive_it_on() {
    // 9 cm is more than it can do: it backs off, again and again.
    let keys = ["terrain.height_m=0.09", "stop_when_done=false", "duration_s=12"];
    let free = run(&scenario(&keys)).expect("runs");
    let mode = column(&free, "traction_mode");
    let backs = mode.iter().position(|mode| *mode == 1.0).expect("it backs off") + 200;
    assert_eq!(mode[backs], 1.0);
    let stop = format!(
        "fault=[{{kind='emergency_stop',from_s={:.3}}}]",
        backs as f64 * 1e-3
    );
    let trace = run(&scenario(&[&keys[..], &[stop.as_str()]].concat())).expect("runs");
    assert_eq!(torque_from(&trace, backs + 150 + 500 + 2), 0.0);
    let target = &column(&trace, "traction_target_m_s")[backs + 1..];
    assert_eq!(
        largest(target),
        0.0,
        "it neither backs off any longer nor drives on ahead"
    );
}

fn a_lost_connection_ends_a_climb() {
    let lost = "fault=[{kind='command_lost',from_s=1.4}]";
    let trace = run(&scenario(&[lost, "stop_when_done=false", "duration_s=5"])).expect("runs");
    // Time-out 0.5 s, deceleration of the vehicle's limits 0.3 s, bleed 0.5 s.
    assert_eq!(torque_from(&trace, 1400 + 500 + 300 + 500 + 2), 0.0);
}

fn a_wheel_whose_encoder_dies_is_released_and_the_others_drive_on() {
    // One of the front. Of the rear, none climbs; plain loops of their own run away along the riser with either.
    let dies = "fault=[{kind='encoder_dead',wheel='1',from_s=0.3}]";
    let trace = run(&scenario(&[dies, "sensors.encoder_counts=4096"])).expect("runs");
    let fault = column(&trace, "drive_fault_1");
    // The law lets it go two slip times after the counter is known to stand, which takes 0.1 s.
    let torque = trace.wheel("torque_n_m", 0).expect("a signal");
    assert!(largest(&torque[..300]) > 0.0);
    assert_eq!(largest(&torque[300 + 200..]), 0.0);
    // A wheel without torque may turn or stand: the monitor is sure of it once the others are seen to move.
    assert!(fault[..300].iter().all(|fault| *fault == 0.0) && fault.iter().any(|fault| *fault != 0.0));
    // On rapier the rest slides along the riser in five tries and does not climb: docs/drive.md.
    let outcome = trace.outcome();
    assert_eq!(
        outcome.climbed,
        outcome.engine == Engine::Articulated,
        "{outcome:?}"
    );
}

on_the_fast_engine! {
    in_a_drive_it_climbs_as_it_does_alone,
    an_emergency_stop_on_the_riser_ends_without_torque_and_nothing_is_tried,
    a_stop_while_it_backs_off_does_not_drive_it_on,
    a_lost_connection_ends_a_climb,
    a_wheel_whose_encoder_dies_is_released_and_the_others_drive_on,
}
