//! What is no drive is not called one: runaways, leans and physics that gain energy have verdicts of their own.

use omni_sim::config::{Override, Scenario};
use omni_sim::{Outcome, Verdict, run};

use crate::engines::{load, on_both_engines};

fn scenario(name: &str, overrides: &[&str]) -> Scenario {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    load(name, &overrides).expect("valid")
}

fn outcome(name: &str, overrides: &[&str]) -> Outcome {
    *run(&scenario(name, overrides)).expect("runs").outcome()
}

/// On a slope of 10 degrees every motor fails: the vehicle rolls back with 1.6 m/s^2 and has 1 m/s after 0.3 m.
fn a_vehicle_that_rolls_away_without_motors_ran_away_and_one_that_is_braked_in_time_did_not() {
    let failing = |until_s: &str| {
        let faults: Vec<_> = (1..=7)
            .map(|wheel| format!("{{ kind = \"wheel_lost\", wheel = \"{wheel}\", from_s = 6.0{until_s} }}"))
            .collect();
        let faults = format!("fault=[{}]", faults.join(", "));
        outcome("ramp", &["terrain.length_m=4.0", &faults]).verdict
    };
    assert_eq!(failing(""), Verdict::RanAway);
    // For 0.3 s: 0.48 m/s backwards at the most, 0.1 m/s of it above the bound, and the motors brake at once.
    assert_eq!(failing(", until_s = 6.3"), Verdict::Unfinished);
}

/// The same slope and the same failure, 1.16 m/s at the most: half as fast again as the farthest wheel at the 2 rad/s it is told is more.
fn a_vehicle_that_is_told_to_turn_and_slides_off_ran_away() {
    let faults: Vec<_> = (1..=7)
        .map(|wheel| format!("{{ kind = \"wheel_lost\", wheel = \"{wheel}\", from_s = 4.0 }}"))
        .collect();
    let faults = format!("fault=[{}]", faults.join(", "));
    let turn = "command.then=[{ at_s = 4.0, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 2.0 }]";
    let sliding = outcome("ramp", &["terrain.length_m=4.0", &faults, turn]);
    assert_eq!(sliding.verdict, Verdict::RanAway, "{sliding:?}");
}

fn hills_that_turn_a_vehicle_are_no_runaway_under_any_policy() {
    // Down the hills it goes at 0.4 to 0.5 m/s and turns by 0.24 to 0.46 rad/s; the sum of both was above the bound under load_sharing.
    for policy in ["independent", "paper", "synchronised", "load_sharing"] {
        let policy = format!("control.policy={policy}");
        assert_eq!(
            outcome("height_map", &[&policy]).verdict,
            Verdict::Climbed,
            "{policy}"
        );
    }
}

/// 10 kg half a metre behind its hinge lift the front frame's wheels off the ground, up to the hinge's stop at 0.9 rad: 52 degrees.
fn a_frame_that_stands_at_its_stop_on_flat_ground_leaned_and_did_not_drive() {
    let load = "fault=[{ kind = \"load_added\", body = \"front\", mass_kg = 10.0, at_m = [-0.5, 0.0, 0.3], from_s = 1.0 }]";
    let leaning = outcome("flat", &[load]);
    assert!(leaning.pitch_peak_deg > 45.0, "{leaning:?}");
    assert_eq!(leaning.verdict, Verdict::Leaned);
}

on_both_engines! {
    a_vehicle_that_rolls_away_without_motors_ran_away_and_one_that_is_braked_in_time_did_not,
    a_vehicle_that_is_told_to_turn_and_slides_off_ran_away,
    hills_that_turn_a_vehicle_are_no_runaway_under_any_policy,
    a_frame_that_stands_at_its_stop_on_flat_ground_leaned_and_did_not_drive,
}
