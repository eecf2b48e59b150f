//! Metrics and trace from control periods that the caller stepped and kept.

use crate::config::Scenario;
use crate::outcome::Meter;
use crate::{Outcome, Period, ReportColumns, Trace, TraceBuilder};

/// The metrics of a scenario's run up to its last period here. `periods` are all of them, from the start.
/// That the physics ended the run they do not say, nor that they were another engine's than the scenario's:
/// [`crate::SteppedRun`] knows both.
///
/// ```
/// use omni_sim::{Simulation, config::Scenario, outcome_of, run};
/// let scenario = Scenario::load("flat", &[])?;
/// let (mut simulation, mut kept) = (Simulation::new(&scenario)?, Vec::new());
/// for _ in 0..4000 {
///     simulation.step(&simulation.scenario_command())?;
///     kept.push(simulation.period().clone());
/// }
/// let outcome = outcome_of(&scenario, &kept);
/// assert_eq!(outcome.work_j, run(&scenario)?.outcome().work_j);
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn outcome_of<'a>(scenario: &Scenario, periods: impl IntoIterator<Item = &'a Period>) -> Outcome {
    let mut meter = Meter::new(scenario);
    for period in periods {
        meter.push(period);
    }
    meter.outcome(false)
}

/// [`outcome_of`] with every signal. `report` is what the controller reports beside the wheels' signals
/// ([`crate::controller::AnyController::columns`]); where it had no part in a period it is NaN.
///
/// ```
/// use omni_sim::{ReportColumns, Simulation, config::Scenario, trace_of};
/// let scenario = Scenario::load("flat", &[])?;
/// let mut simulation = Simulation::new(&scenario)?;
/// simulation.step_torques(&[0.5; 7])?;
/// let report = ReportColumns::own(vec!["effort_n_m".into()]);
/// let trace = trace_of(&scenario, &report, [simulation.period()]);
/// assert_eq!((trace.rows(), trace.wheel("applied_n_m", 6)), (1, Some([0.5].as_slice())));
/// assert!(trace.column("effort_n_m").is_some_and(|effort| effort[0].is_nan()));
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn trace_of<'a>(
    scenario: &Scenario,
    report: &ReportColumns,
    periods: impl IntoIterator<Item = &'a Period>,
) -> Trace {
    let mut meter = Meter::new(scenario);
    let mut trace = TraceBuilder::with_report(scenario.vehicle(), report);
    for period in periods {
        meter.push(period);
        trace.push(period);
    }
    trace.finish(meter.outcome(false))
}
