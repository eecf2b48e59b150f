//! A body is no contact, but a run in which one meets the ground says so and does not count as climbed.

use omni_sim::config::{Override, Scenario};
use omni_sim::{Outcome, Simulation, Verdict, run};

use crate::engines::{load, on_the_fast_engine};

fn scenario(name: &str, keys: &[&str]) -> Scenario {
    let keys: Vec<_> = keys
        .iter()
        .map(|key| Override::parse(key).expect("KEY=VALUE"))
        .collect();
    load(name, &keys).expect("valid")
}

fn outcome(name: &str, keys: &[&str]) -> Outcome {
    *run(&scenario(name, keys)).expect("runs").outcome()
}

/// Over an edge of 16 mm, which its wheels of 76 mm climb. Its platform is 0.60 m long and begins
/// 0.30 m ahead of the origin.
const LOW: [&str; 5] = [
    "vehicle=mecanum4",
    "physics.wheel_model=rollers",
    "terrain.height_m=0.016",
    "control.policy=independent",
    "stop_when_done=true",
];

fn a_platform_of_5_mm_clearance_touches_a_step_where_its_front_edge_meets_it() {
    let low = outcome(
        "step",
        &[&LOW[..], &["vehicle.body.0.clearance_m=0.005"]].concat(),
    );
    assert_eq!((low.verdict, low.climbed), (Verdict::Touched, false), "{low:?}");
    assert_eq!((low.crossing_s, low.e_over_mgh), (None, None));
    assert_eq!(low.touched_body.expect("named").as_str(), "platform");
    // Looked at every 10 ms the platform is at most 3 mm beyond the riser, and it is some degrees askew at most.
    let (x_m, y_m) = (low.touched_x_m.expect("where"), low.touched_y_m.expect("where"));
    let at_m = scenario("step", &LOW).terrain.obstacle().expect("a step").from_m;
    assert!((0.0..0.01).contains(&(x_m - at_m)), "{x_m} at {at_m}");
    assert!(y_m.abs() < 0.21, "{y_m}");
    // It is 11 mm lower than the step, less what the wheels have climbed by then: nothing, or less than a millimetre.
    assert!(
        (low.touched_depth_m.expect("how deep") - 0.011).abs() < 1.5e-3,
        "{low:?}"
    );
}

/// Nothing of the physics changes: the rows of the same run are the same in every bit.
fn what_is_said_of_a_body_changes_no_bit_of_a_run() {
    let last = |keys: &[&str]| {
        let mut simulation = Simulation::new(&scenario("step", &[&LOW[..], keys].concat())).expect("starts");
        for _ in 0..3000 {
            simulation.step(&simulation.scenario_command()).expect("runs");
        }
        simulation.observation().clone()
    };
    assert_eq!(last(&[]), last(&["vehicle.body.0.clearance_m=0.005"]));
}

/// With more clearance than the edge is high it passes: the platform overhangs the rear wheels by 5
/// cm of 50, so it is 1.6 mm lower there.
fn a_platform_above_the_edge_does_not_touch_it() {
    let free = outcome("step", &[&LOW[..], &["vehicle.body.0.clearance_m=0.02"]].concat());
    assert_eq!(free.verdict, Verdict::Climbed, "{free:?}");
    assert_eq!(free.touched_body, None);
}

fn on_level_ground_a_body_2_mm_above_does_not_touch_and_one_in_it_has_no_verdict() {
    let low = outcome("flat", &["vehicle=omni3", "vehicle.body.0.clearance_m=0.002"]);
    assert_eq!(
        (low.verdict, low.touched_body),
        (Verdict::Completed, None),
        "{low:?}"
    );
    // Its inertia box is 2 cm longer than twice the height of its centre of mass.
    let deep = outcome(
        "flat",
        &["vehicle=omni3", "vehicle.body.0.inertia_box_m=[0.3, 0.3, 0.18]"],
    );
    assert_eq!(
        (deep.verdict, deep.touched_body),
        (Verdict::Completed, None),
        "{deep:?}"
    );
}

/// A bar of 1 cm height and 2 cm width passes between wheels; its top is 5 mm above the underside.
fn a_narrow_bar_between_the_wheels_is_found() {
    let keys = [
        "vehicle=omni3",
        "physics.wheel_model=rollers",
        "terrain.height_m=0.01",
        "terrain.width_m=0.02",
        "terrain.count=1",
        "control.policy=independent",
        "vehicle.body.0.clearance_m=0.005",
    ];
    let touched = outcome("bumps", &keys);
    assert_eq!(
        touched.touched_body.expect("found").as_str(),
        "base",
        "{touched:?}"
    );
}

/// The box of the front frame of `chugo7` would be 3 cm above the ground. The frame is lifted by 5
/// cm in front and stands on its hinge 0.30 m behind: it would be lower than the edge from 0.12 m
/// ahead of the hinge on, and wheel 4 lifts the hinge only at 0.064 m. tests/physics/terrain.rs
/// says that with the clearances of its file every built-in scenario is passed.
fn frames_as_low_as_their_inertia_boxes_would_touch_the_step() {
    let low = outcome(
        "step",
        &["vehicle.body.front.clearance_m=0.03", "stop_when_done=true"],
    );
    assert_eq!(low.verdict, Verdict::Touched, "{low:?}");
    assert_eq!(low.touched_body.expect("named").as_str(), "front");
    // It is 2 mm below the edge 12 mm behind 0.12 m, and 5.3 mm at the next of its points, which are 2 cm apart.
    assert!(
        low.touched_depth_m
            .is_some_and(|depth_m| (2e-3..5.5e-3).contains(&depth_m)),
        "{low:?}"
    );
}

on_the_fast_engine! {
    a_platform_of_5_mm_clearance_touches_a_step_where_its_front_edge_meets_it,
    what_is_said_of_a_body_changes_no_bit_of_a_run,
    a_platform_above_the_edge_does_not_touch_it,
    on_level_ground_a_body_2_mm_above_does_not_touch_and_one_in_it_has_no_verdict,
    a_narrow_bar_between_the_wheels_is_found,
    frames_as_low_as_their_inertia_boxes_would_touch_the_step,
}
