//! A whole scenario from start to end.

use std::path::PathBuf;

use crate::config::Scenario;
use crate::controller::{AnyController, LinkCounters};
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
    watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    run_with(scenario, AnyController::new(scenario)?, watch)
}

/// [`run_watched`] with a controller that was made for the scenario and is freshly started.
///
/// # Errors
/// As [`Simulation::step`], and whatever `watch` returns.
pub fn run_with<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<Trace, E> {
    let mut simulation = Simulation::with_controller(scenario, controller);
    let mut trace = TraceBuilder::new(scenario.vehicle());
    let periods = control_periods(scenario);
    for k in 0..periods {
        simulation.step(&scenario.command.at(simulation.time_ns() as f64 * 1e-9))?;
        trace.push(simulation.sample(), simulation.observation());
        watch(&simulation, (k + 1) as f64 / periods as f64)?;
    }
    Ok(trace.finish())
}

/// A finished run.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Every signal of every control period.
    pub trace: Trace,
    /// Its figures.
    pub outcome: Outcome,
    /// The log, if one was asked for.
    pub mcap: Option<PathBuf>,
    /// What was lost on the link to the controller, if there is one.
    pub link: Option<LinkCounters>,
}

/// Runs a scenario from start to end, into a log if there is one, calling `watch` after every control period with the
/// part done, 0 to 1. An error of `watch` ends the run; the log carries its final name only if the run went to its end.
///
/// # Errors
/// As [`run`], [`Error::Log`] where the log cannot be written, and whatever `watch` returns.
pub fn record<E: From<Error>>(
    scenario: &Scenario,
    log: Option<RunLog>,
    watch: impl FnMut(f64) -> Result<(), E>,
) -> Result<Record, E> {
    record_with(scenario, AnyController::new(scenario)?, log, watch)
}

/// [`record`] with a controller that was made for the scenario and is freshly started.
///
/// # Errors
/// As [`run_with`], [`Error::Log`] where the log cannot be written, and whatever `watch` returns.
pub fn record_with<E: From<Error>>(
    scenario: &Scenario,
    controller: AnyController,
    mut log: Option<RunLog>,
    mut watch: impl FnMut(f64) -> Result<(), E>,
) -> Result<Record, E> {
    let mut link = controller.link();
    let trace = run_with(scenario, controller, |simulation, part| {
        link = simulation.controller().link();
        if let Some(log) = &mut log {
            log.push(simulation.sample(), simulation.observation())
                .map_err(Error::from)?;
        }
        watch(part)
    })?;
    let outcome = Outcome::of(scenario, &trace);
    let mcap = log
        .map(|log| log.finish(&outcome))
        .transpose()
        .map_err(Error::from)?;
    Ok(Record {
        trace,
        outcome,
        mcap,
        link,
    })
}

/// Control periods in a scenario.
#[must_use]
pub fn control_periods(scenario: &Scenario) -> u64 {
    (scenario.duration_s * 1e6 / scenario.control.period_us as f64).round() as u64
}
