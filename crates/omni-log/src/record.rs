//! A whole scenario, run into a log.

use omni_config::Scenario;
use omni_sim::controller::{AnyController, LinkCounters};
use omni_sim::{Outcome, Simulation, Trace, TraceBuilder, drive, own_command};

use crate::{Error, RunLog};

/// A run that went to its end, or to where the physics ended it.
#[derive(Debug)]
#[non_exhaustive]
pub struct Record {
    /// Its figures.
    pub outcome: Outcome,
    /// Why the physics ended it early, the verdict is [`omni_sim::Verdict::Diverged`] then; or what they gained, with
    /// [`omni_sim::Verdict::GainedEnergy`].
    pub ended: Option<omni_sim::Error>,
    /// What was lost on the link to the controller, if there is one.
    pub link: Option<LinkCounters>,
}

/// Runs a scenario from start to end into a log, with a controller that was made for it and is freshly started. Calls `watch`
/// after every control period with the part done, 0 to 1. Nothing but the log grows with time.
///
/// The log is not finished here: [`RunLog::finish`] gives it its name, [`RunLog::leave`] leaves what there is of a run that was stopped.
///
/// # Errors
/// As [`omni_sim::run`], [`Error::Log`] where the log cannot be written, and whatever `watch` returns, which ends the run.
///
/// ```
/// use omni_log::{Error, RunLog, record};
/// use omni_sim::{config::{Override, Scenario}, controller::AnyController};
/// let path = std::env::temp_dir().join(format!("omnistep-record-{}.mcap", std::process::id()));
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
/// let controller = AnyController::new(&scenario)?;
/// let mut log = RunLog::create(&path, &scenario, &controller)?;
/// let run = record(&scenario, controller, &mut log, |_, _| Ok::<(), Error>(()))?;
/// assert_eq!(log.finish(&run.outcome)?.path(), path);
/// # std::fs::remove_file(path).unwrap();
/// # Ok::<(), Error>(())
/// ```
pub fn record<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    log: &mut RunLog,
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Record, E> {
    let mut link = controller.link();
    let ran = drive(scenario, controller, own_command, |simulation, part| {
        link = simulation.controller().link();
        log.push(simulation.period())
            .map_err(|error| End(E::from(error.into())))?;
        watch(simulation, part).map_err(End)
    });
    let (outcome, ended) = ran.map_err(|End(error)| error)?;
    Ok(Record { outcome, ended, link })
}

/// Runs a scenario from start to end into a log, with a controller that was made for it and is freshly started, finishes it, and returns
/// every signal of the run too.
///
/// # Errors
/// As [`record`] and [`RunLog::finish`]; a run that the physics ended has its log, and is an error.
pub fn run_logged<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    mut log: RunLog,
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    let mut trace = TraceBuilder::with_signals(scenario.vehicle(), controller.signal_names());
    let Record { outcome, ended, .. } = record(scenario, controller, &mut log, |simulation, part| {
        trace.push(simulation.period());
        watch(simulation, part)
    })?;
    log.finish(&outcome).map_err(Error::from)?;
    match ended {
        None | Some(omni_sim::Error::GainedEnergy { .. }) => Ok(trace.finish(outcome)),
        Some(error) => Err(Error::from(error).into()),
    }
}

/// Why a run ended early, in the caller's words: what the simulation itself says is turned into them.
pub(crate) struct End<E>(pub(crate) E);

impl<E: From<Error>> From<omni_sim::Error> for End<E> {
    fn from(error: omni_sim::Error) -> Self {
        Self(Error::from(error).into())
    }
}
