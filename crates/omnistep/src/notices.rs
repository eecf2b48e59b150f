//! Notices about a scenario before it runs: derived gains, and everything doubtful.

use omni_config::{DerivedGains, Scenario, Vehicle, WheelModel};

use crate::output::{say, warn};

/// Doubts about a scenario: it ends before its vehicle can be across or at the end of its path, its command exceeds the
/// vehicle's limits, one encoder count requests more than the motor's torque, its drive finds false faults, or its
/// traction control lacks inputs.
pub(crate) fn doubts_of(scenario: &Scenario) -> Vec<String> {
    let doubts = scenario.too_short().into_iter().chain(coarse(scenario));
    let of_command = scenario.command_doubts().unwrap_or_default();
    doubts
        .chain(of_command)
        .chain(scenario.drive_doubts())
        .chain(scenario.traction_notes())
        .chain(scenario.unseen_encoders())
        .collect()
}

/// Warns of that.
fn warn_of(scenario: &Scenario) {
    for text in doubts_of(scenario) {
        warn(&format!("{}: {text}", scenario.name));
    }
}

/// Warns of sensors and motors that policies lack, for policies other than the scenario's own.
pub(crate) fn warn_of_policies(scenario: &Scenario, runs: &[Scenario]) {
    let others = || {
        let named = scenario.auto_policy().is_none();
        let other = move |run: &&Scenario| !(named && run.control.policy == scenario.control.policy);
        runs.iter().filter(other)
    };
    for text in others().flat_map(Scenario::traction_notes) {
        warn(&format!("{}: {text}", scenario.name));
    }
}

/// Reason why a scenario's encoders are too coarse, if they are.
pub(crate) fn coarse(scenario: &Scenario) -> Option<String> {
    scenario.coarse_encoder().ok().flatten()
}

/// Notices about a scenario before it is run: derived gains of its vehicle, and all doubts.
pub(crate) fn announce(scenario: &Scenario) {
    announce_vehicle(scenario);
    warn_of(scenario);
}

/// The notices that concern the vehicle, regardless of its command.
pub(crate) fn announce_vehicle(scenario: &Scenario) {
    announce_assumed(scenario.vehicle(), scenario.period_s(), scenario.derived_gains());
    if scenario.wheel_model() == WheelModel::Rollers && scenario.vehicle().rollers.is_none() {
        say(&format!(
            "{}: no [rollers]; nine a row, of a fifth of the wheel's radius",
            scenario.vehicle().name
        ));
    }
    announce_beyond_balls(scenario);
}

/// Reports on standard error the values that a vehicle's file leaves out: derived gains, and other assumptions.
pub(crate) fn announce_assumed(vehicle: &Vehicle, period_s: f64, derived: Option<&DerivedGains>) {
    let name = &vehicle.name;
    if let Some(derived) = derived {
        let period_ms = 1e3 * period_s;
        say(&format!(
            "{name}: no [gains]; derived for a control period of {period_ms} ms: {derived}"
        ));
    }
    for assumption in vehicle.assumptions() {
        say(&format!("{name}: {assumption}"));
    }
}

/// Reason why balls do not represent a scenario's wheels, and the remedy; nothing if they do.
pub(crate) fn beyond_balls(scenario: &Scenario) -> Option<String> {
    let beyond = scenario.beyond_balls()?;
    let vehicle = scenario.vehicle();
    let wheels = 0..vehicle.wheel.len();
    let instead = if wheels
        .clone()
        .all(|i| vehicle.rollers(i, WheelModel::Rollers).is_some())
    {
        "leave physics.wheel_model out"
    } else {
        "the vehicle's wheels have no rollers that fit"
    };
    let (name, ground) = (&vehicle.name, scenario.terrain.described());
    Some(format!(
        "{name} {ground}: balls are not a valid wheel model here, so the result is not valid: {beyond}; {instead}"
    ))
}

/// Says that on standard error.
pub(crate) fn announce_beyond_balls(scenario: &Scenario) {
    if let Some(why) = beyond_balls(scenario) {
        warn(&why);
    }
}
