//! A whole scenario from start to end.

use std::path::PathBuf;

use crate::config::Scenario;
use crate::log::RunLog;
use crate::trace::{Trace, TraceBuilder};
use crate::{Error, Outcome, Simulation};

/// Runs a scenario from start to end.
///
/// # Errors
/// As [`Simulation::new`] and [`Simulation::step`].
pub fn run(scenario: &Scenario) -> Result<Trace, Error> {
    run_watched(scenario, |_, _| Ok(()))
}

/// Runs a scenario and calls `watch` after every control period with the simulation and
/// the part done, 0 to 1. An error of `watch` ends the
/// run and is returned: how a caller stops it.
///
/// # Errors
/// As [`run`], and whatever `watch` returns.
pub fn run_watched<E: From<Error>>(
    scenario: &Scenario,
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    let mut simulation = Simulation::new(scenario)?;
    let mut trace = TraceBuilder::new(scenario.vehicle());
    let periods = control_periods(scenario);
    for k in 0..periods {
        simulation.step(&scenario.command.at(simulation.time_ns() as f64 * 1e-9))?;
        trace.push(simulation.sample(), simulation.observation());
        watch(&simulation, (k + 1) as f64 / periods as f64)?;
    }
    Ok(trace.finish())
}

/// Runs a scenario into a log, calling `progress` with the part done, 0 to 1; returns the trace, its figures and the
/// log's path. The log carries its final name only if the run went to its end.
///
/// # Errors
/// As [`run`], and [`Error::Log`] where the log cannot be written.
pub fn record(
    scenario: &Scenario,
    mut log: RunLog,
    progress: impl Fn(f64),
) -> Result<(Trace, Outcome, PathBuf), Error> {
    let trace = run_watched(scenario, |simulation, part| {
        log.push(simulation.sample(), simulation.observation())?;
        progress(part);
        Ok::<(), Error>(())
    })?;
    let outcome = Outcome::of(scenario, &trace);
    let path = log.finish(&outcome)?;
    Ok((trace, outcome, path))
}

/// Control periods in a scenario.
#[must_use]
pub fn control_periods(scenario: &Scenario) -> u64 {
    (scenario.duration_s * 1e6 / scenario.control.period_us as f64).round() as u64
}
