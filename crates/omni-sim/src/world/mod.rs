//! The plant: a vehicle on the ground, without a controller; one interface to both engines.

mod actuation;
mod articulated;
mod barrel;
mod external_physics;
mod faults;
mod height_field;
mod interface;
mod loads;
mod observed;
mod rapier;

use crate::Error;
use crate::config::{Engine, Scenario};
use crate::error::unknown;
pub use external_physics::{
    AxleDrive, BodyState, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep, Touch,
};
pub(crate) use interface::AnyPlant;
pub use rapier::ground_heights_m;

/// The scenario's vehicle at its start, at rest, `yaw_rad` and `x_m` off the pose that it asks for.
///
/// # Errors
/// Ground, faults or an engine that are unknown here.
pub(crate) fn plant(scenario: &Scenario, x_m: f64, yaw_rad: f64) -> Result<AnyPlant, Error> {
    match scenario.physics.engine {
        Engine::Rapier => Ok(Box::new(rapier::World::new(scenario, x_m, yaw_rad)?)),
        Engine::Articulated => articulated::plant(scenario, x_m, yaw_rad),
        _ => Err(unknown(scenario, "physics.engine", "").into()),
    }
}

/// A plant that is simulated elsewhere, at its start as [`plant`] has it.
///
/// # Errors
/// Faults that are unknown here, masses that are put on a body on the way, and whatever keeps the
/// physics from starting.
pub(crate) fn external(
    scenario: &Scenario,
    physics: Box<dyn ExternalPhysics>,
    x_m: f64,
    yaw_rad: f64,
) -> Result<AnyPlant, Error> {
    Ok(Box::new(external_physics::External::new(
        scenario, physics, x_m, yaw_rad,
    )?))
}
