//! The plant: a vehicle on the ground, without a controller; one interface to both engines.

mod actuation;
mod articulated;
mod barrel;
mod external_physics;
mod height_field;
mod loads;
mod observed;
mod rapier;

use crate::Error;
use crate::config::{Engine, Fault, Scenario};
use crate::error::unknown;
use crate::observation::Observation;
pub use external_physics::{
    AxleDrive, BodyState, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep, Touch,
};
pub use rapier::ground_heights_m;

/// What every engine does.
pub(crate) trait Plant {
    /// What simulates it, where that is not the scenario's engine.
    fn engine(&self) -> Option<Engine> {
        None
    }

    /// Actuator velocities as ideal encoders see them \[rad/s\], one a wheel.
    fn measure(&self, velocities_rad_s: &mut Vec<f64>);

    /// Angles that the actuators have turned since the start \[rad\], one a wheel.
    fn angles_rad(&self) -> &[f64];

    /// Shorts the windings of these motors from now on, one a wheel, and of no other; none for an empty list.
    fn brake(&mut self, motors: &[bool]);

    /// Holds actuator torques \[N.m\], one a wheel, for one control period; contact forces are averaged over it.
    fn step(&mut self, torques_n_m: &[f64], observation: &mut Observation) -> Result<(), Error>;

    /// The physics alone: see [`crate::Simulation::advance_physics`].
    fn advance(&mut self, torques_n_m: &[f64]);

    /// The energies at the start; nothing has moved yet.
    fn start_energy_balance(&mut self, observation: &mut Observation);

    /// Writes the present poses and velocities; leaves the contact averages alone.
    fn observe(&self, observation: &mut Observation);

    /// Nanoseconds since the start.
    fn time_ns(&self) -> u64;

    /// Everything that [`Plant::restore`] needs to go on from here, bit for bit.
    fn save(&self) -> Result<Vec<u8>, postcard::Error>;

    /// Goes on from what was saved of a plant that was made of the same scenario.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), postcard::Error>;
}

/// A plant of whichever engine.
pub(crate) type AnyPlant = Box<dyn Plant + Send + Sync>;

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
/// Faults that are unknown here, masses that are put on a body on the way, and whatever keeps the physics from starting.
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

/// A kind of fault that is not made to happen here is refused: a run without it would be another.
fn check_faults(scenario: &Scenario) -> Result<(), Error> {
    let is_known = |fault: &Fault| {
        matches!(
            fault,
            Fault::WheelLost(_)
                | Fault::WheelDrag(_)
                | Fault::MotorWeak(_)
                | Fault::SupplySag(_)
                | Fault::EncoderStuck(_)
                | Fault::EncoderDead(_)
                | Fault::EncoderToggles(_)
                | Fault::EncoderSlips(_)
                | Fault::EncoderSilent(_)
                | Fault::CommandLost(_)
                | Fault::EmergencyStop(_)
                | Fault::LoadAdded(_)
        )
    };
    match scenario.fault.iter().position(|fault| !is_known(fault)) {
        Some(k) => Err(unknown(scenario, &format!("fault[{k}].kind"), "").into()),
        None => Ok(()),
    }
}
