//! What the engine in reduced coordinates promises beyond the laws that both engines keep.

use omni_sim::config::{Override, Scenario, builtin_scenarios};
use omni_sim::{Error, Simulation, Trace, run};

use crate::engines;

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
    assert!(values.iter().all(|value| value.is_finite()), "{column}");
    values.iter().fold(0.0_f64, |most, value| most.max(value.abs()))
}

#[test]
fn the_time_over_the_step_does_not_depend_on_the_physics_step() {
    // 1 ms to 0.125 ms; a control period is 1 ms, and a crossing lasts a whole number of them.
    let crossing_s = |step_us: u64| {
        let step = format!("physics.timestep_s={step_us}e-6");
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
        let trace = run(&load(name, &["control.policy=scale_references"])).expect("runs");
        let residual = trace.outcome().energy_residual;
        assert!(
            residual.abs() < 1e-5,
            "{name}: {residual} of what went through the motors"
        );
    }
}

#[test]
fn every_built_in_scenario_is_passed_as_its_file_has_it() {
    for name in builtin_scenarios() {
        let scenario = load(name, &[]);
        let outcome = *run(&scenario).expect("runs").outcome();
        assert_eq!(outcome.verdict, engines::passed(&scenario), "{name}");
    }
}

#[test]
fn every_built_in_scenario_is_passed_on_rollers() {
    // The hard step is there because plain loops stall at it.
    for name in builtin_scenarios()
        .into_iter()
        .filter(|name| *name != "hard_step")
    {
        let trace = run(&load(
            name,
            &["physics.wheel_model=rollers", "control.policy=independent"],
        ))
        .expect("runs");
        let outcome = trace.outcome();
        let passed = outcome.climbed || scenario_is_level(name);
        assert!(passed, "{name}: {}", outcome.verdict.name());
        // Rollers that come to the ground do so within a step: ten times what balls leave.
        assert!(
            outcome.energy_residual.abs() < 1e-4,
            "{name}: {}",
            outcome.energy_residual
        );
    }
}

#[test]
fn contacts_whose_friction_pushes_them_into_the_ground_settle() {
    // The middle wheel between the riser and the ground, at a friction of 0.85: push and friction follow each
    // other in a circle. It took one step in a hundred until t = 3.85 s, and the run ended with an error.
    let keys = [
        "seed=7103",
        "control.policy=scale_references",
        "physics.wheel_model=rollers",
        "terrain.friction=0.85",
        "vehicle.motor.stall_torque_n_m=1.4",
        "perturbation.yaw_rad=0.03",
        "perturbation.start_m=0.02",
    ];
    let trace = run(&load("step", &keys)).expect("settles");
    // As on every ground, see above: what does not settle has impulses that fit no velocities.
    assert!(trace.outcome().energy_residual.abs() < 1e-4);
}

/// Is there nothing to climb?
fn scenario_is_level(name: &str) -> bool {
    load(name, &[]).terrain.obstacle().is_none()
}

#[test]
fn friction_in_the_bearings_takes_from_the_vehicle_what_it_takes_from_rollers() {
    // Coasting sideways on rollers that turn with the ground: m' v' = -4 d v / rho^2 for the
    // rollers in touch, one a wheel, of the five wheels that roll ahead; the two that roll sideways
    // turn with the way, and are driven by nothing.
    let damping = 2e-6;
    let key = format!("vehicle.rollers.friction_n_m_s_rad={damping}");
    let lost_j = |keys: &[&str]| {
        let mut simulation = Simulation::new(&load("flat", keys)).expect("valid");
        for _ in 0..300 {
            simulation
                .step_torques(&[0.0, -0.3, 0.0, 0.0, 0.0, 0.3, 0.0])
                .expect("finite");
        }
        let before = simulation.observation().energy;
        for _ in 0..1000 {
            simulation.step_torques(&[0.0; 7]).expect("finite");
        }
        let after = simulation.observation().energy;
        assert!(
            after.residual_j().abs() < 1e-4 * after.turnover_j,
            "{}",
            after.residual_j()
        );
        assert!(simulation.observation().newton_residual_n < 1e-8);
        (
            before.kinetic_j - after.kinetic_j,
            after.joint_loss_j - before.joint_loss_j,
        )
    };
    let (without_j, _) = lost_j(&["physics.wheel_model=rollers"]);
    let (with_j, taken_j) = lost_j(&["physics.wheel_model=rollers", &key]);
    // What the vehicle loses more is what the bearings took; rollers that come and go take the same in both.
    assert!(taken_j > 0.0, "{taken_j}");
    assert!(
        (with_j - without_j) / taken_j > 0.7,
        "{with_j}, {without_j}, {taken_j}"
    );
}

#[test]
fn contact_forces_are_all_that_accelerates_a_vehicle_on_its_way_over_the_step() {
    for model in ["ball", "rollers"] {
        let trace = run(&load("step", &[&format!("physics.wheel_model={model}")])).expect("runs");
        // Forces of 200 N in double precision, over periods of a millisecond.
        let residual = worst(&trace, "newton_residual_n");
        assert!(residual < 1e-8, "{model}: {residual} N");
    }
}

#[test]
fn the_same_run_leaves_the_same_bits() {
    for model in ["ball", "rollers"] {
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
        "built-in step: physics.solver_iterations: 8, allowed: only with physics.engine = \"rapier\"; \"articulated\" iterates until the contacts converge"
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
        Err(Error::Snapshot { reason }) => assert_eq!(reason, "it belongs to another scenario"),
        other => panic!("{:?}", other.map(|_| "resumed")),
    }
}
