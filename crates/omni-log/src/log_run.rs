//! A whole scenario, run into a log.

use omni_sim::controller::LinkCounters;
use omni_sim::{Outcome, Run, Simulation, Trace};

use crate::{Error, RunLog};

/// A run that reached its end, or was ended by the physics.
#[derive(Debug)]
#[non_exhaustive]
pub struct Logged {
    /// Its metrics.
    pub outcome: Outcome,
    /// Why the physics ended it early, the verdict is [`omni_sim::Verdict::Diverged`] then; or what they gained, with
    /// [`omni_sim::Verdict::GainedEnergy`].
    pub ended: Option<omni_sim::Error>,
    /// Losses on the link to the controller, if there is one and a control period was completed.
    pub link: Option<LinkCounters>,
}

/// Runs that go into a log.
///
/// ```
/// use omni_log::{Error, LogRun, RunLog};
/// use omni_sim::{Run, config::{Override, Scenario}, controller::AnyController};
/// let path = std::env::temp_dir().join(format!("omnistep-log-run-{}.mcap", std::process::id()));
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
/// let controller = AnyController::new(&scenario)?;
/// let mut log = RunLog::create(&path, &scenario, &controller)?;
/// let run = Run::new(&scenario).controller(controller).log_to::<Error>(&mut log)?;
/// assert_eq!(log.finish(&run.outcome)?.path(), path);
/// # std::fs::remove_file(path).unwrap();
/// # Ok::<(), Error>(())
/// ```
pub trait LogRun<E>: Sized {
    /// Runs into a log of the run's controller. Nothing but the log grows with time.
    ///
    /// The log is not finished here: [`RunLog::finish`] names it, [`RunLog::leave`] leaves the partial log of a stopped
    /// run.
    ///
    /// # Errors
    /// As [`Run::outcome`], and [`Error::Log`] if the log cannot be written.
    fn log_to<F: From<E> + From<omni_sim::Error> + From<Error>>(self, log: &mut RunLog) -> Result<Logged, F>;

    /// Runs into a log, finishes it, and also returns every signal of the run.
    ///
    /// # Errors
    /// As [`LogRun::log_to`] and [`RunLog::finish`]; a run that the physics ended has its log, and is an error.
    fn log<F: From<E> + From<omni_sim::Error> + From<Error>>(self, log: RunLog) -> Result<Trace, F>;
}

impl<'a, E: From<omni_sim::Error> + 'a> LogRun<E> for Run<'a, E> {
    fn log_to<F: From<E> + From<omni_sim::Error> + From<Error>>(self, log: &mut RunLog) -> Result<Logged, F> {
        let mut link = None;
        let run = self.watch(|simulation, _| {
            link = simulation.controller().link_counters();
            push::<F>(log, simulation)
        });
        let (outcome, ended) = run.outcome()?;
        Ok(Logged { outcome, ended, link })
    }

    fn log<F: From<E> + From<omni_sim::Error> + From<Error>>(self, mut log: RunLog) -> Result<Trace, F> {
        let run = self.watch(|simulation, _| push::<F>(&mut log, simulation));
        let (trace, ended) = run.trace_and_end()?;
        log.finish(trace.outcome()).map_err(Error::from)?;
        match ended {
            None | Some(omni_sim::Error::GainedEnergy { .. }) => Ok(trace),
            Some(error) => Err(Error::from(error).into()),
        }
    }
}

/// The last control period into the log.
fn push<F: From<Error>>(log: &mut RunLog, simulation: &Simulation) -> Result<(), F> {
    log.push(simulation.period())
        .map_err(|error| Error::from(error).into())
}
