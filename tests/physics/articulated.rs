//! What the engine in reduced coordinates promises beyond the laws that both engines keep.

use omni_sim::config::{Override, Scenario, builtin_scenarios};
use omni_sim::{Error, Simulation, Trace, run};

fn load(name: &str, overrides: &[&str]) -> Scenario {
    let engine = std::iter::once("physics.engine=articulated");
    let keys = engine.chain(overrides.iter().copied());
    let keys: Vec<_> = keys
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    Scenario::load(name, &keys).expect("valid")
}

fn worst(trace: &Trace, column: &str) -> f64 {
    let values = trace.column(column).expect("a column");
    values.iter().fold(0.0_f64, |most, value| most.max(value.abs()))
}

#[test]
fn the_time_over_the_step_does_not_depend_on_the_physics_step() {
    // 1 ms to 0.125 ms; a control period is 1 ms, and a crossing lasts a whole number of them.
    let crossing_s = |step_us: u64| {
        let step = format!("physics.step_us={step_us}");
        let trace = run(&load("step", &[&step, "control.policy=independent"])).expect("runs");
        trace.outcome().crossing_s.expect("climbed")
    };
    let finest = crossing_s(125);
    for step_us in [1000, 500, 250] {
        let crossing = crossing_s(step_us);
        // The study found 0.1 %; a period of the control is 0.04 %.
        assert!(
            (crossing / finest - 1.0).abs() < 0.002,
            "{step_us} us: {crossing} s, 125 us: {finest} s"
        );
    }
}

#[test]
fn energy_closes_within_a_hundred_thousandth_on_every_built_in_scenario() {
    for name in builtin_scenarios() {
        let trace = run(&load(name, &[])).expect("runs");
        let residual = trace.outcome().energy_residual;
        assert!(
            residual.abs() < 1e-5,
            "{name}: {residual} of what went through the motors"
        );
    }
}

#[test]
fn contact_forces_are_all_that_accelerates_a_vehicle_on_its_way_over_the_step() {
    for model in ["contact", "rollers"] {
        let trace = run(&load("step", &[&format!("physics.wheel_model={model}")])).expect("runs");
        // Forces of 200 N in double precision, over periods of a millisecond.
        let residual = worst(&trace, "newton_residual_n");
        assert!(residual < 1e-8, "{model}: {residual} N");
    }
}

#[test]
fn the_same_run_leaves_the_same_bits() {
    for model in ["contact", "rollers"] {
        let scenario = load(
            "rough",
            &[&format!("physics.wheel_model={model}"), "duration_s=2.0"],
        );
        let bits = || {
            let trace = run(&scenario).expect("runs");
            let column = |name: &str| trace.column(name).expect("a column").to_vec();
            [column("pose_x_m"), column("pose_z_m"), column("pose_yaw_rad")]
        };
        assert_eq!(bits(), bits(), "{model}");
    }
}

#[test]
fn keys_that_the_engine_cannot_honour_are_refused_by_name() {
    let keys = ["physics.engine=articulated", "physics.solver_iterations=8"];
    let keys = keys.map(|text| Override::parse(text).expect("KEY=VALUE"));
    let error = Scenario::load("step", &keys).expect_err("refused").to_string();
    assert_eq!(
        error,
        "built-in step: physics.solver_iterations: 8, allowed: only with physics.engine = \"rapier\"; \"articulated\" solves contacts to the end"
    );
}

#[test]
fn a_snapshot_of_one_engine_is_not_taken_for_the_others() {
    let scenario = load("step", &[]);
    let bytes = Simulation::new(&scenario)
        .and_then(|made| made.save(&scenario))
        .expect("saved");
    let other = Scenario::load("step", &[]).expect("built in");
    match Simulation::resume(&other, &bytes) {
        Err(Error::Snapshot { reason }) => assert_eq!(reason, "it is of another scenario"),
        other => panic!("{:?}", other.map(|_| "resumed")),
    }
}
