//! A whole scenario from start to end.

use omni_core::BodyTwist;

use crate::config::Scenario;
use crate::controller::AnyController;
use crate::outcome::Meter;
use crate::trace::{Trace, TraceBuilder};
use crate::wall_clock::WallClock;
use crate::{Error, Outcome, Simulation};

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
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    let mut trace = TraceBuilder::with_signals(scenario.vehicle(), controller.signal_names());
    let (outcome, ended) = drive(scenario, controller, own_command, |simulation, part| {
        trace.push(simulation.sample(), simulation.observation());
        watch(simulation, part)
    })?;
    match ended {
        None | Some(Error::GainedEnergy { .. }) => Ok(trace.finish(outcome)),
        Some(error) => Err(error.into()),
    }
}

/// The scenario's own command: what [`drive`] is given where nobody steers.
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
    mut steer: impl FnMut(&mut Simulation) -> Result<BodyTwist<f64>, Error>,
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<(Outcome, Option<Error>), E> {
    let mut simulation = Simulation::with_controller(scenario, controller)?;
    let mut meter = Meter::new(scenario);
    let periods = control_periods(scenario);
    let clock = WallClock::start(scenario.wall_clock_s);
    for k in 0..periods {
        let command = steer(&mut simulation)?;
        match simulation.step(&command) {
            Ok(()) => {}
            Err(error @ (Error::Diverged { .. } | Error::FellApart { .. } | Error::Unsettled { .. })) => {
                return Ok((meter.outcome(true), Some(error)));
            }
            Err(error) => return Err(error.into()),
        }
        meter.push(simulation.sample(), simulation.observation());
        let done = scenario.stop_when_done && meter.is_across();
        let part = if done {
            1.0
        } else {
            (k + 1) as f64 / periods as f64
        };
        watch(&simulation, part)?;
        if done {
            break;
        }
        if k % PERIODS_PER_LOOK == 0 && clock.has_expired() {
            return Err(E::from(Error::OutOfTime {
                time_s: simulation.time_ns() as f64 * 1e-9,
                wall_clock_s: scenario.wall_clock_s,
            }));
        }
    }
    let gained = meter.gained().map(|gained| Error::GainedEnergy {
        gained_j: gained.gained_j,
        through_j: gained.through_j,
        step_us: scenario.physics.step_us,
    });
    Ok((meter.outcome(false), gained))
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
