//! What a page can offer.

use omni_sim::Metric;
use omni_sim::config::{Engine, POLICIES, Scenario, Vehicle, builtin_scenarios, builtin_vehicles};
use serde_json::{Value, json};

/// Scenarios with what can be chosen of each, vehicles, policies, engines, wheel models, and what
/// the metrics mean: a JSON object.
pub fn offer() -> Result<String, String> {
    let scenarios: Result<Vec<_>, _> = builtin_scenarios().into_iter().map(scenario).collect();
    let vehicles: Result<Vec<_>, _> = builtin_vehicles().into_iter().map(vehicle).collect();
    let text = |error: omni_sim::config::Error| error.to_string();
    Ok(json!({
        "version": omni_sim::VERSION,
        "scenarios": scenarios.map_err(text)?,
        "vehicles": vehicles.map_err(text)?,
        "policies": POLICIES,
        "engines": [Engine::Articulated.name(), Engine::Rapier.name()],
        "wheel_models": ["ball", "rollers"],
        "metrics": Metric::ALL.map(metric),
    })
    .to_string())
}

fn scenario(name: &str) -> Result<Value, omni_sim::config::Error> {
    let scenario = Scenario::load(name, &[])?;
    Ok(json!({
        "name": name,
        "vehicle": scenario.vehicle().name,
        "policy": scenario.control.policy,
        "engine": scenario.physics.engine.name(),
    }))
}

fn vehicle(name: &str) -> Result<Value, omni_sim::config::Error> {
    let vehicle = Vehicle::load(name)?;
    Ok(json!({ "name": name, "torque": vehicle.motor.stall_torque_n_m }))
}

fn metric(metric: Metric) -> Value {
    json!({
        "key": metric.key,
        "heading": metric.heading(),
        "meaning": metric.meaning,
        "better": metric.better.name(),
    })
}
