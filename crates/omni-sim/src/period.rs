//! One control period of a run.

use serde::{Deserialize, Serialize};

use crate::controller::ControlSample;
use crate::observation::Observation;

/// A control period: what the controller did in it, and what came of it at its end.
///
/// ```
/// use omni_sim::{Simulation, config::Scenario};
/// let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
/// simulation.step(&simulation.scenario_command())?;
/// let period = simulation.period();
/// assert_eq!(period.observed.time_ns, 1_000_000);
/// assert_eq!(period.control.wheels.len(), period.observed.wheels.len());
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Period {
    /// What the controller was given, and what it did.
    pub control: ControlSample,
    /// The vehicle at the end of the period.
    pub observed: Observation,
}
