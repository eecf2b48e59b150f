//! A whole scenario, run from start to end.

use std::ops::ControlFlow;

use omni_core::BodyTwist;

use crate::config::Scenario;
use crate::controller::AnyController;
use crate::trace::{Trace, TraceBuilder};
use crate::wall_clock::WallClock;
use crate::world::ExternalPhysics;
use crate::{Error, Outcome, Simulation, SteppedRun};

/// Control periods between two looks at the clock, each of which may be a system call.
const PERIODS_PER_LOOK: u64 = 64;

/// Runs a scenario from start to end, or until it has climbed if it requests that, and keeps every signal: a [`Run`]
/// with all its defaults.
///
/// # Errors
/// As [`Run::trace`].
///
/// ```
/// use omni_sim::{config::{Override, Scenario}, run};
/// let done = run(&Scenario::load("step", &[Override::new("stop_when_done", true)])?)?;
/// assert!(done.outcome().climbed && done.rows() < 5000); // of the 6000 periods in its duration_s
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn run(scenario: &Scenario) -> Result<Trace, Error> {
    Run::new(scenario).trace()
}

/// A run of a scenario: its controller, command, physics engine and observers. [`Run::trace`] runs it and keeps every
/// signal, [`Run::outcome`] keeps the metrics alone.
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_sim::{Error, Run, config::{Override, Scenario}};
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 2.0)])?;
/// let mut left_m = 0.0;
/// let (outcome, ended) = Run::new(&scenario)
///     .command(|_| Ok(BodyTwist::from_array([0.0, 0.2, 0.0]))) // to the left at 0.2 m/s, whatever the scenario says
///     .watch(|simulation, part| {
///         assert!(part <= 1.0);
///         left_m = simulation.observation().pose.position_m[1];
///         Ok::<(), Error>(())
///     })
///     .outcome()?;
/// assert!(ended.is_none() && outcome.work_j > 0.1 && left_m > 0.2);
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use = "`trace`, `outcome`, `log` or `log_to` runs it"]
pub struct Run<'a, E = Error> {
    scenario: &'a Scenario,
    controller: Option<AnyController>,
    physics: Option<Box<dyn ExternalPhysics>>,
    command: Box<Commanding<'a>>,
    watch: Box<Watch<'a, E>>,
    /// Whether it ends with the scenario's `duration_s`, and within its `time_limit_s`.
    ends: bool,
}

/// The command of the next control period.
type Commanding<'a> = dyn FnMut(&mut Simulation) -> Result<BodyTwist<f64>, Error> + 'a;

/// Called after a control period with the part done, 0 to 1.
type Watch<'a, E> = dyn FnMut(&Simulation, f64) -> Result<ControlFlow<()>, E> + 'a;

impl<'a> Run<'a> {
    /// A run with the scenario's own controller, physics and command.
    pub fn new(scenario: &'a Scenario) -> Self {
        Self {
            scenario,
            controller: None,
            physics: None,
            command: Box::new(|simulation| Ok(simulation.scenario_command())),
            watch: Box::new(|_, _| Ok(ControlFlow::Continue(()))),
            ends: true,
        }
    }
}

impl<'a, E: From<Error> + 'a> Run<'a, E> {
    /// The same with a controller that was made for the scenario and is freshly started.
    pub fn controller(self, controller: AnyController) -> Self {
        Self {
            controller: Some(controller),
            ..self
        }
    }

    /// The same on physics of the caller's, which simulate the scenario's vehicle on its ground in
    /// its physics steps. The energy that contacts and joints dissipate is then unknown: those columns and the
    /// outcome's `energy_residual` are NaN.
    ///
    /// ```
    /// use omni_sim::config::{Engine, Override, Scenario};
    /// use omni_sim::{AxleDrive, Error, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep, Run};
    /// /// A vehicle on a stand.
    /// struct Stand(Vec<f64>);
    /// impl ExternalPhysics for Stand {
    ///     fn engine(&self) -> Engine {
    ///         Engine::Mujoco
    ///     }
    ///     fn start(&mut self, _: f64, _: f64) -> Result<(), ExternalFailure> {
    ///         Ok(())
    ///     }
    ///     fn step(&mut self, axles: &[AxleDrive], shown: &mut ExternalStep) -> Result<(), ExternalFailure> {
    ///         for (i, axle) in axles.iter().enumerate() {
    ///             self.0[i] += axle.torque_n_m * 5e-4 / 0.002178;
    ///             shown.turned_rad[i] += self.0[i] * 5e-4;
    ///         }
    ///         shown.rate_rad_s.copy_from_slice(&self.0);
    ///         Ok(())
    ///     }
    ///     fn observe(&mut self, _: &mut ExternalState) -> Result<(), ExternalFailure> {
    ///         Ok(())
    ///     }
    /// }
    /// let scenario = Scenario::load("flat", &[Override::new("duration_s", 2.0)])?;
    /// let trace = Run::new(&scenario).physics(Box::new(Stand(vec![0.0; 7]))).trace()?;
    /// let measured = trace.wheel("measured_rad_s", 3).expect("wheel 4");
    /// assert!((measured[1999] - 0.3 / 0.066).abs() < 0.05); // 0.3 m/s, said by its wheels
    /// assert_eq!(trace.outcome().engine, Engine::Mujoco);
    /// # Ok::<(), Error>(())
    /// ```
    pub fn physics(self, physics: Box<dyn ExternalPhysics>) -> Self {
        Self {
            physics: Some(physics),
            ..self
        }
    }

    /// The same with another command than the scenario's: what `command` returns, asked before every
    /// control period. It may change the simulation's controller ([`Simulation::take_control`]).
    pub fn command(self, command: impl FnMut(&mut Simulation) -> Result<BodyTwist<f64>, Error> + 'a) -> Self {
        Self {
            command: Box::new(command),
            ..self
        }
    }

    /// Calls `watch` after every control period with the simulation and the completed part, 0 to 1 (0 if the run has no
    /// end of its own: [`Run::until`]), before earlier observers, so that a log also contains the period in which a run
    /// is stopped. An error of `watch` ends the run and is returned, so that a caller can stop it.
    pub fn watch<F: From<E> + 'a>(
        self,
        mut watch: impl FnMut(&Simulation, f64) -> Result<(), F> + 'a,
    ) -> Run<'a, F> {
        self.and_watch(move |simulation, part| watch(simulation, part).map(ControlFlow::Continue))
    }

    /// Goes on until `watch` breaks, beyond the scenario's `duration_s` and `time_limit_s`. If `stop_when_done` is set,
    /// the run also ends as soon as the vehicle is across.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use omni_sim::{Error, Run, config::{Override, Scenario}};
    /// let scenario = Scenario::load("flat", &[Override::new("duration_s", 1.0)])?;
    /// let mut periods = 0;
    /// let (outcome, ended) = Run::new(&scenario)
    ///     .until(|_| {
    ///         periods += 1;
    ///         Ok::<_, Error>(if periods < 3000 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) })
    ///     })
    ///     .outcome()?;
    /// assert!(ended.is_none() && periods == 3000); // of 1 ms, three times the scenario's second
    /// assert!(outcome.work_j > 1.0);
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn until<F: From<E> + 'a>(
        mut self,
        mut watch: impl FnMut(&Simulation) -> Result<ControlFlow<()>, F> + 'a,
    ) -> Run<'a, F> {
        self.ends = false;
        self.and_watch(move |simulation, _| watch(simulation))
    }

    /// Runs, and keeps every signal.
    ///
    /// A run whose physics gained energy is returned like any other: its verdict says so.
    /// Without a clock (`wasm32-unknown-unknown`), `time_limit_s` never expires.
    ///
    /// # Errors
    /// As [`Simulation::new`], [`Simulation::with_physics`] and [`Simulation::step`];
    /// [`Error::OutOfTime`]; whatever a watch returns.
    ///
    /// ```
    /// use omni_sim::{Run, config::{Override, Scenario}, controller::AnyController, run};
    /// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.5)])?;
    /// let same = Run::new(&scenario).controller(AnyController::new(&scenario)?).trace()?;
    /// assert_eq!(same.outcome().work_j, run(&scenario)?.outcome().work_j);
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn trace(self) -> Result<Trace, E> {
        match self.trace_and_end()? {
            (trace, None | Some(Error::GainedEnergy { .. })) => Ok(trace),
            (_, Some(error)) => Err(error.into()),
        }
    }

    /// [`Run::trace`] that also returns the partial trace of a run that the physics ended, and the reason, as
    /// [`Run::outcome`].
    ///
    /// # Errors
    /// As [`Run::outcome`].
    pub fn trace_and_end(mut self) -> Result<(Trace, Option<Error>), E> {
        let simulation = self.start()?;
        let report = simulation.controller().columns();
        let mut trace = TraceBuilder::with_report(self.scenario.vehicle(), report);
        let (outcome, ended) = self.periods(simulation, |simulation| trace.push(simulation.period()))?;
        Ok((trace.finish(outcome), ended))
    }

    /// Runs, and keeps nothing but the metrics.
    ///
    /// If the physics ends the run, the verdict is [`crate::Verdict::Diverged`], if it gains energy
    /// [`crate::Verdict::GainedEnergy`]: the error next to the outcome states the reason.
    ///
    /// # Errors
    /// As [`Run::trace`], but for physics that end the run.
    pub fn outcome(mut self) -> Result<(Outcome, Option<Error>), E> {
        let simulation = self.start()?;
        self.periods(simulation, |_| ())
    }

    fn and_watch<F: From<E> + 'a>(
        self,
        mut first: impl FnMut(&Simulation, f64) -> Result<ControlFlow<()>, F> + 'a,
    ) -> Run<'a, F> {
        let mut watch = self.watch;
        Run {
            scenario: self.scenario,
            controller: self.controller,
            physics: self.physics,
            command: self.command,
            watch: Box::new(move |simulation, part| {
                let flow = first(simulation, part)?;
                Ok(match watch(simulation, part)? {
                    ControlFlow::Continue(()) => flow,
                    ControlFlow::Break(()) => ControlFlow::Break(()),
                })
            }),
            ends: self.ends,
        }
    }

    /// The scenario at its start, at rest.
    fn start(&mut self) -> Result<Simulation, Error> {
        let controller = match self.controller.take() {
            Some(controller) => controller,
            None => AnyController::new(self.scenario)?,
        };
        match self.physics.take() {
            Some(physics) => Simulation::with_physics(self.scenario, controller, physics),
            None => Simulation::with_controller(self.scenario, controller),
        }
    }

    /// Every control period: the command, the step, `keep`, and who watches.
    fn periods(
        mut self,
        simulation: Simulation,
        mut keep: impl FnMut(&Simulation),
    ) -> Result<(Outcome, Option<Error>), E> {
        let scenario = self.scenario;
        let mut run = SteppedRun::of(scenario, simulation);
        let periods = self.ends.then(|| control_periods(scenario));
        let clock = self.ends.then(|| WallClock::start(scenario.time_limit_s));
        for k in 0..periods.unwrap_or(u64::MAX) {
            let command = (self.command)(run.simulation_mut())?;
            if !run.step(&command)? {
                break;
            }
            let done = scenario.stop_when_done && run.is_across();
            let part = if done {
                1.0
            } else {
                periods.map_or(0.0, |periods| (k + 1) as f64 / periods as f64)
            };
            keep(run.simulation());
            if (self.watch)(run.simulation(), part)?.is_break() || done {
                break;
            }
            if k % PERIODS_PER_LOOK == 0 && clock.as_ref().is_some_and(WallClock::has_expired) {
                return Err(E::from(Error::OutOfTime {
                    time_s: run.simulation().time_ns() as f64 * 1e-9,
                    time_limit_s: scenario.time_limit_s,
                }));
            }
        }
        Ok(run.ended())
    }
}

/// Control periods in a scenario.
///
/// ```
/// use omni_sim::{config::{Override, Scenario}, control_periods};
/// assert_eq!(control_periods(&Scenario::load("flat", &[Override::new("duration_s", 1.5)])?), 1500); // of 1 ms
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn control_periods(scenario: &Scenario) -> u64 {
    (scenario.duration_s * 1e6 / scenario.control.period_us as f64).round() as u64
}
