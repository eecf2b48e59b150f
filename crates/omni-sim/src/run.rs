//! A whole scenario, run from start to end.

use std::ops::ControlFlow;

use omni_core::BodyTwist;

use crate::config::Scenario;
use crate::controller::AnyController;
use crate::trace::{Trace, TraceBuilder};
use crate::wall_clock::WallClock;
use crate::world::ExternalPhysics;
use crate::{Error, Outcome, Simulation, SteppedRun};

/// Control periods between two looks at the clock.
const PERIODS_PER_LOOK: u64 = 64;

/// Runs a scenario from start to end, or until it has climbed where it asks for that.
///
/// A run whose physics gained energy is returned like any other: its verdict says so.
/// Where there is no clock (`wasm32-unknown-unknown`), `wall_clock_s` never runs out.
///
/// # Errors
/// As [`Simulation::new`] and [`Simulation::step`]; [`Error::OutOfTime`].
///
/// ```
/// use omni_sim::{config::{Override, Scenario}, run};
/// let done = run(&Scenario::load("step", &[Override::new("stop_when_done", true)])?)?;
/// assert!(done.outcome().climbed && done.rows() < 5000); // of the 6000 periods in its duration_s
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn run(scenario: &Scenario) -> Result<Trace, Error> {
    run_with_callback(scenario, |_, _| Ok(()))
}

/// Runs a scenario and calls `watch` after every control period with the simulation and
/// the part done, 0 to 1. An error of `watch` ends the
/// run and is returned: how a caller stops it.
///
/// # Errors
/// As [`run`], and whatever `watch` returns.
///
/// ```
/// use omni_sim::{Error, config::{Override, Scenario}, run_with_callback};
/// let mut highest_m_s = 0.0_f64;
/// let run = run_with_callback::<Error>(&Scenario::load("flat", &[Override::new("duration_s", 1.0)])?, |simulation, part| {
///     highest_m_s = highest_m_s.max(simulation.observation().twist.vx_m_s);
///     assert!(part <= 1.0);
///     Ok(())
/// })?;
/// assert!(run.rows() == 1000 && highest_m_s > 0.1);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn run_with_callback<E: From<Error>>(
    scenario: &Scenario,
    watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    run_with_controller(scenario, AnyController::new(scenario)?, watch)
}

/// [`run_with_callback`] with a controller that was made for the scenario and is freshly started.
///
/// # Errors
/// As [`run`], and whatever `watch` returns.
///
/// ```
/// use omni_sim::{Error, config::{Override, Scenario}, controller::AnyController, run, run_with_controller};
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.5)])?;
/// let same = run_with_controller::<Error>(&scenario, AnyController::new(&scenario)?, |_, _| Ok(()))?;
/// assert_eq!(same.outcome().work_j, run(&scenario)?.outcome().work_j);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn run_with_controller<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    traced(
        scenario,
        Simulation::with_controller(scenario, controller)?,
        watch,
    )
}

/// [`run_with_controller`] on physics of somebody else's, which simulate the scenario's vehicle on its ground in its physics steps. What
/// contacts and joints take of the energy is not known there: those columns and the outcome's `energy_residual` are NaN.
///
/// # Errors
/// As [`Simulation::with_physics`] and [`run`]; [`Error::External`]; whatever `watch` returns.
///
/// ```
/// use omni_sim::config::{Engine, Override, Scenario};
/// use omni_sim::{AxleDrive, Error, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep};
/// use omni_sim::{controller::AnyController, run_external};
/// /// A vehicle whose wheels turn as soon as commanded, on a stand.
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
/// let trace = run_external::<Error>(&scenario, AnyController::new(&scenario)?, Box::new(Stand(vec![0.0; 7])), |_, _| Ok(()))?;
/// let measured = trace.wheel("measured_rad_s", 3).expect("wheel 4");
/// assert!((measured[1999] - 0.3 / 0.066).abs() < 0.05); // 0.3 m/s, said by its wheels
/// assert_eq!(trace.outcome().engine, Engine::Mujoco);
/// # Ok::<(), Error>(())
/// ```
pub fn run_external<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    physics: Box<dyn ExternalPhysics>,
    watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    traced(
        scenario,
        Simulation::with_physics(scenario, controller, physics)?,
        watch,
    )
}

/// Every signal of a run.
fn traced<E: From<Error>>(
    scenario: &Scenario,
    simulation: Simulation,
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    let signals = simulation.controller().signal_names();
    let mut trace = TraceBuilder::with_signals(scenario.vehicle(), signals);
    let (outcome, ended) = steered(scenario, simulation, own_command, |simulation, part| {
        trace.push(simulation.period());
        watch(simulation, part)
    })?;
    match ended {
        None | Some(Error::GainedEnergy { .. }) => Ok(trace.finish(outcome)),
        Some(error) => Err(error.into()),
    }
}

/// The scenario's own command: what [`drive`] is given where no one steers.
///
/// # Errors
/// None.
///
/// ```
/// use omni_sim::{Simulation, config::Scenario, own_command};
/// let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
/// for _ in 0..1000 {
///     let command = own_command(&mut simulation)?;
///     simulation.step(&command)?;
/// }
/// assert_eq!(own_command(&mut simulation)?.vx_m_s, 0.3); // at its end the ramp is over
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn own_command(simulation: &mut Simulation) -> Result<BodyTwist<f64>, Error> {
    Ok(simulation.scenario_command())
}

/// Runs a scenario from start to end and keeps nothing but its figures. Calls `watch` as [`run_with_callback`] does.
///
/// Where the physics end the run, the verdict is [`crate::Verdict::Diverged`], where they gain energy
/// [`crate::Verdict::GainedEnergy`]: the error beside the outcome says why.
///
/// # Errors
/// As [`Simulation::new`]; [`Error::OutOfTime`]; whatever `watch` returns.
///
/// ```
/// use omni_sim::{Error, config::Scenario, measure};
/// let (outcome, ended) = measure(&Scenario::load("flat", &[])?, |_, _| Ok::<(), Error>(()))?;
/// assert!(ended.is_none() && outcome.work_j > 1.0);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn measure<E: From<Error>>(
    scenario: &Scenario,
    watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<(Outcome, Option<Error>), E> {
    drive(scenario, AnyController::new(scenario)?, own_command, watch)
}

/// [`measure`] with a controller that was made for the scenario and is freshly started, and with another command: what `steer`
/// returns, asked before every control period. It may change the simulation's controller ([`Simulation::take_control`]).
///
/// # Errors
/// As [`measure`], and whatever `steer` returns.
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_sim::{Error, config::{Override, Scenario}, controller::AnyController, drive};
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 2.0)])?;
/// let mut left_m = 0.0;
/// let (outcome, ended) = drive::<Error>(
///     &scenario,
///     AnyController::new(&scenario)?,
///     |_| Ok(BodyTwist::from_array([0.0, 0.2, 0.0])), // to the left at 0.2 m/s, whatever the scenario says
///     |simulation, _| {
///         left_m = simulation.observation().pose.position_m[1];
///         Ok(())
///     },
/// )?;
/// assert!(ended.is_none() && outcome.work_j > 0.1 && left_m > 0.2);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn drive<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    steer: impl FnMut(&mut Simulation) -> Result<BodyTwist<f64>, Error>,
    watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<(Outcome, Option<Error>), E> {
    let simulation = Simulation::with_controller(scenario, controller)?;
    steered(scenario, simulation, steer, watch)
}

/// [`drive`] that goes on until `watch` breaks, beyond the scenario's `duration_s` and `wall_clock_s`. Where `stop_when_done` is set it
/// ends, too, as soon as the vehicle is across.
///
/// # Errors
/// As [`drive`], but for [`Error::OutOfTime`].
///
/// ```
/// use std::ops::ControlFlow;
/// use omni_sim::{Error, config::{Override, Scenario}, controller::AnyController, drive_until, own_command};
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 1.0)])?;
/// let mut periods = 0;
/// let (outcome, ended) = drive_until::<Error>(&scenario, AnyController::new(&scenario)?, own_command, |_| {
///     periods += 1;
///     Ok(if periods < 3000 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) })
/// })?;
/// assert!(ended.is_none() && periods == 3000); // of 1 ms, three times the scenario's second
/// assert!(outcome.work_j > 1.0);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn drive_until<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    steer: impl FnMut(&mut Simulation) -> Result<BodyTwist<f64>, Error>,
    mut watch: impl FnMut(&Simulation) -> Result<ControlFlow<()>, E>,
) -> Result<(Outcome, Option<Error>), E> {
    let simulation = Simulation::with_controller(scenario, controller)?;
    run_periods(scenario, simulation, None, steer, |simulation, _| {
        watch(simulation)
    })
}

/// Runs a simulation that is at its start to the end of its scenario.
fn steered<E: From<Error>>(
    scenario: &Scenario,
    simulation: Simulation,
    steer: impl FnMut(&mut Simulation) -> Result<BodyTwist<f64>, Error>,
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<(Outcome, Option<Error>), E> {
    let count = control_periods(scenario);
    run_periods(scenario, simulation, Some(count), steer, |simulation, part| {
        watch(simulation, part).map(ControlFlow::Continue)
    })
}

/// Runs a simulation that is at its start for that many control periods, on the scenario's time, or until `watch` breaks.
fn run_periods<E: From<Error>>(
    scenario: &Scenario,
    simulation: Simulation,
    periods: Option<u64>,
    mut steer: impl FnMut(&mut Simulation) -> Result<BodyTwist<f64>, Error>,
    mut watch: impl FnMut(&Simulation, f64) -> Result<ControlFlow<()>, E>,
) -> Result<(Outcome, Option<Error>), E> {
    let mut run = SteppedRun::of(scenario, simulation);
    let clock = periods.map(|_| WallClock::start(scenario.wall_clock_s));
    for k in 0..periods.unwrap_or(u64::MAX) {
        let command = steer(run.simulation_mut())?;
        if !run.step(&command)? {
            break;
        }
        let done = scenario.stop_when_done && run.is_across();
        let part = if done {
            1.0
        } else {
            periods.map_or(0.0, |periods| (k + 1) as f64 / periods as f64)
        };
        if watch(run.simulation(), part)?.is_break() || done {
            break;
        }
        if k % PERIODS_PER_LOOK == 0 && clock.as_ref().is_some_and(WallClock::has_expired) {
            return Err(E::from(Error::OutOfTime {
                time_s: run.simulation().time_ns() as f64 * 1e-9,
                wall_clock_s: scenario.wall_clock_s,
            }));
        }
    }
    Ok(run.ended())
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
