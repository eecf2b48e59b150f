//! One control period of a run.

use serde::{Deserialize, Serialize};

use crate::control_sample::ControlSample;
use crate::observation::Observation;
use crate::sensed::Sensed;

/// A control period: the sensor readings at its start, the controller's result, and the state at its end.
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
    /// The sensor readings at its start.
    pub sensed: Sensed,
    /// The request to the controller, and its result.
    pub control: ControlSample,
    /// The vehicle at the end of the period.
    pub observed: Observation,
}
