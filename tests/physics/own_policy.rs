//! The example crate examples/own-policy, which knows nothing of the simulation, in the simulation.

use omni_core::{Policy, Readings};
use omni_sim::config::{Override, Scenario};
use omni_sim::controller::AnyController;
use omni_sim::{Error, Run, Trace, run};

#[path = "../../examples/own-policy/src/lib.rs"]
#[expect(unreachable_pub, reason = "a crate of its own")]
mod example;
use example::MotionControl;

fn scenario(name: &str, overrides: &[&str]) -> Scenario {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    Scenario::load(name, &overrides).expect("valid")
}

fn run_own(scenario: &Scenario, policy: impl Policy<f64> + Send + Sync + 'static) -> Result<Trace, Error> {
    let controller = AnyController::own(scenario, Box::new(policy))?;
    Run::new(scenario).controller(controller).trace()
}

#[test]
fn a_crate_of_ones_own_drives_a_vehicle_and_has_columns_of_its_own() {
    let scenario = scenario(
        "flat",
        &["vehicle=mecanum4", "duration_s=3.0", "physics.engine=articulated"],
    );
    let kinematics = *scenario.controller::<f64, 4>().expect("valid").kinematics();
    let trace = run_own(&scenario, MotionControl::new(kinematics)).expect("runs");
    let speed = trace.column("twist_vx_m_s").expect("a column");
    // Without an integral a little lacks: what the rollers' friction takes.
    assert!((speed[2999] - 0.3).abs() < 0.01, "{}", speed[2999]);
    let lack = trace.column("lack_m_s").expect("its own signal");
    assert!(
        lack[0] < 1e-3 && lack[150] > lack[2999],
        "{} {}",
        lack[150],
        lack[2999]
    );
    assert!(trace.wheel("p_n_m", 0).expect("a signal")[10].is_nan()); // what is inside is not known
}

/// omni-core's loops as the user's own policy.
struct BuiltIn(omni_core::loops::ControllerPolicy<f64, 7>);

impl Policy<f64> for BuiltIn {
    fn reset(&mut self) {
        self.0.reset();
    }
    fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
        self.0.step(readings, torques_n_m);
    }
}

#[test]
fn the_built_in_law_as_somebodys_own_is_the_built_in_law_in_every_bit() {
    let scenario = scenario(
        "step",
        &[
            "duration_s=2.5",
            "control.policy=scale_references",
            "physics.engine=articulated",
            "sensors.encoder_counts=4096",
        ],
    );
    let policy = omni_core::loops::ControllerPolicy::new(
        scenario.limiter().expect("valid"),
        scenario.controller().expect("valid"),
    );
    let (own, built_in) = (
        run_own(&scenario, BuiltIn(policy)).expect("runs"),
        run(&scenario).expect("runs"),
    );
    for signal in [
        "applied_n_m",
        "measured_rad_s",
        "reference_rad_s",
        "force_normal_n",
    ] {
        assert_eq!(own.wheels(signal), built_in.wheels(signal), "{signal}");
    }
    assert_eq!(own.outcome().work_j, built_in.outcome().work_j);
}

/// Gives what is no torque from a period on.
struct Breaks(u32);

impl Policy<f64> for Breaks {
    fn reset(&mut self) {}
    fn step(&mut self, _: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
        self.0 += 1;
        torques_n_m.fill(if self.0 > 20 { f64::NAN } else { 99.0 });
    }
}

#[test]
fn torques_are_brought_within_the_motors_and_nan_ends_the_run_with_its_period() {
    let scenario = scenario("flat", &["duration_s=1.0"]);
    let error = run_own(&scenario, Breaks(0)).expect_err("a NaN");
    assert_eq!(
        error.to_string(),
        "policy own: it returned NaN N.m for wheel 1 in period 20, t = 0.020 s, allowed: finite torques"
    );
    let trace = run_own(&self::scenario("flat", &["duration_s=0.02"]), Breaks(0)).expect("runs");
    assert_eq!(trace.wheel("requested_n_m", 2).expect("a signal"), [99.0; 20]);
    assert_eq!(trace.wheel("applied_n_m", 2).expect("a signal"), [2.0; 20]);
    assert_eq!(trace.wheel("saturated", 2).expect("a signal"), [1.0; 20]);
}
