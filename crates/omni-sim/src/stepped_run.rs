//! A run that its caller steps: simulation and metrics together.

use omni_core::BodyTwist;

use crate::config::Scenario;
use crate::controller::AnyController;
use crate::outcome::Meter;
use crate::{Error, Outcome, Simulation};

/// A scenario's run, one control period a call. It has no end of its own but where the physics
/// fail: the caller decides.
///
/// ```
/// use omni_sim::{SteppedRun, config::Scenario, control_periods, controller::AnyController, run};
/// let scenario = Scenario::load("flat", &[])?;
/// let mut stepped = SteppedRun::new(&scenario, AnyController::new(&scenario)?)?;
/// for _ in 0..control_periods(&scenario) {
///     let command = stepped.simulation().scenario_command();
///     assert!(stepped.step(&command)?);
/// }
/// assert_eq!(stepped.outcome().work_j, run(&scenario)?.outcome().work_j);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct SteppedRun {
    simulation: Simulation,
    meter: Meter,
    timestep_s: f64,
    failed: Option<Error>,
}

impl SteppedRun {
    /// The scenario at its start, at rest, with a controller that was made for it and is freshly started.
    ///
    /// # Errors
    /// As [`Simulation::with_controller`].
    pub fn new(scenario: &Scenario, controller: AnyController) -> Result<Self, Error> {
        Ok(Self::of(
            scenario,
            Simulation::with_controller(scenario, controller)?,
        ))
    }

    /// A simulation of the scenario that is at its start.
    pub(crate) fn of(scenario: &Scenario, simulation: Simulation) -> Self {
        let mut meter = Meter::new(scenario);
        if let Some(engine) = simulation.engine() {
            meter.set_external(engine);
        }
        Self {
            simulation,
            meter,
            timestep_s: scenario.physics.timestep_us as f64 / 1e6,
            failed: None,
        }
    }

    /// One control period. False if the physics failed in it, or before: nothing moves any more then, and
    /// [`SteppedRun::failure`] says why.
    ///
    /// # Errors
    /// As [`Simulation::step`], but for failed physics.
    pub fn step(&mut self, command: &BodyTwist<f64>) -> Result<bool, Error> {
        if self.failed.is_some() {
            return Ok(false);
        }
        match self.simulation.step(command) {
            Ok(()) => {
                self.meter.push(self.simulation.period());
                Ok(true)
            }
            Err(error @ (Error::Diverged { .. } | Error::FellApart { .. } | Error::Unsettled { .. })) => {
                self.failed = Some(error);
                Ok(false)
            }
            Err(error) => Err(error),
        }
    }

    /// The simulation as it is now.
    #[must_use]
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    pub(crate) fn simulation_mut(&mut self) -> &mut Simulation {
        &mut self.simulation
    }

    /// Whether every wheel has stood on the ground beyond the obstacle, whatever the verdict.
    #[must_use]
    pub fn is_across(&self) -> bool {
        self.meter.is_across()
    }

    /// The metrics until now.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.meter.outcome(self.failed.is_some())
    }

    /// Why the physics failed, if they did.
    #[must_use]
    pub fn failure(&self) -> Option<&Error> {
        self.failed.as_ref()
    }

    /// The metrics, and why the physics failed or what they gained.
    #[must_use]
    pub fn ended(self) -> (Outcome, Option<Error>) {
        let outcome = self.outcome();
        let gained = || {
            self.meter.gained().map(|gained| Error::GainedEnergy {
                gained_j: gained.gained_j,
                through_j: gained.through_j,
                timestep_s: self.timestep_s,
            })
        };
        (outcome, self.failed.or_else(gained))
    }
}
