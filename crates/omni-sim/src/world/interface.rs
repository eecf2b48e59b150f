//! The interface that the plant of every engine has.

use crate::Error;
use crate::config::Engine;
use crate::observation::Observation;

/// Operations of every engine.
pub(crate) trait Plant {
    /// The physics engine, if it is not the scenario's.
    fn engine(&self) -> Option<Engine> {
        None
    }

    /// Actuator velocities as ideal encoders see them \[rad/s\], one per wheel.
    fn measure(&self, velocities_rad_s: &mut Vec<f64>);

    /// Angles that the actuators have turned since the start \[rad\], one per wheel.
    fn angles_rad(&self) -> &[f64];

    /// Shorts the windings of these motors from now on, one per wheel, and of no other; none for an empty list.
    fn brake(&mut self, motors: &[bool]);

    /// Holds actuator torques \[N.m\], one per wheel, for one control period; contact forces are averaged over it.
    fn step(&mut self, torques_n_m: &[f64], observation: &mut Observation) -> Result<(), Error>;

    /// The physics alone: see [`crate::Simulation::advance_physics`].
    fn advance(&mut self, torques_n_m: &[f64]);

    /// The energies at the start; nothing has moved yet.
    fn start_energy_balance(&mut self, observation: &mut Observation);

    /// Writes the present poses and velocities; leaves the contact averages alone.
    fn observe(&self, observation: &mut Observation);

    /// Nanoseconds since the start.
    fn time_ns(&self) -> u64;

    /// Everything that [`Plant::restore`] needs to continue from here bit-identically.
    fn save(&self) -> Result<Vec<u8>, postcard::Error>;

    /// Goes on from what was saved of a plant that was made of the same scenario.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), postcard::Error>;
}

/// A plant of whichever engine.
pub(crate) type AnyPlant = Box<dyn Plant + Send + Sync>;
