//! One row a run, whatever happens in it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::plan::fields;
use super::{Cell, Run};
use crate::config::Scenario;
use crate::{Error, Outcome, run_watched};

/// What a run amounts to.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The run's key.
    pub key: String,
    /// Its seed.
    pub seed: u64,
    /// The value of each axis, in the study's order.
    pub axes: Vec<Cell>,
    /// Each figure of the outcome, in the columns' order; all missing where the run failed.
    pub figures: Vec<Cell>,
    /// Why the run failed, in one line.
    pub error: Option<String>,
}

/// The row of a run; none if `stop` was set before the end.
///
/// A run that fails, or panics, is a row with its error.
#[must_use]
pub fn row(run: &Run, stop: &AtomicBool) -> Option<Row> {
    row_with(run, |scenario| simulate(scenario, stop))
}

/// The rows of some runs, on the cores of rayon's current pool; those of runs that `stop` ended are not among them.
#[must_use]
pub fn rows(runs: &[Run], stop: &AtomicBool) -> Vec<Row> {
    runs.par_iter().filter_map(|run| row(run, stop)).collect()
}

/// [`row`] with another way to an outcome; none says that the run was stopped.
///
/// ```
/// use omni_sim::{config::{Override, Study}, study::{Plan, row_with}};
/// let plan = Plan::new(&Study::load("ensemble")?, &[])?;
/// let row = row_with(&plan.runs()[23], |_| panic!("no ground")).expect("not stopped");
/// assert_eq!((row.seed, row.error.as_deref()), (23, Some("panic: no ground")));
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn row_with(run: &Run, outcome: impl FnOnce(&Scenario) -> Result<Option<Outcome>, Error>) -> Option<Row> {
    let scenario = run.scenario();
    // Nothing outlives the closure that a panic could have left half done.
    let done = catch_unwind(AssertUnwindSafe(|| outcome(&scenario)));
    let (figures, error) = match done {
        Ok(Ok(None)) => return None,
        Ok(Ok(Some(outcome))) => figures(run, &outcome),
        Ok(Err(error)) => (Vec::new(), Some(error.to_string())),
        Err(panic) => (Vec::new(), Some(format!("panic: {}", message(&*panic)))),
    };
    let mut figures = figures;
    figures.resize(run.columns.figures.len(), Cell::Missing);
    Some(Row {
        key: run.key.clone(),
        seed: run.seed,
        axes: run.axes.to_vec(),
        figures,
        error: error.map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")),
    })
}

/// The figures in the columns' order, or what does not fit its column.
fn figures(run: &Run, outcome: &Outcome) -> (Vec<Cell>, Option<String>) {
    let mut fields = fields(outcome);
    let mut cells = Vec::new();
    for column in &run.columns.figures {
        let cell = fields.remove(&column.name).unwrap_or(Cell::Missing);
        if cell.kind().is_some_and(|kind| kind != column.kind) {
            let error = format!(
                "{} = {cell} does not fit its column, {:?}",
                column.name, column.kind
            );
            return (Vec::new(), Some(error));
        }
        cells.push(cell);
    }
    (cells, None)
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
}

/// Why a run ended before its end.
enum End {
    Failed(Error),
    Stopped,
}

impl From<Error> for End {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// The outcome; none if `stop` was set before the end.
fn simulate(scenario: &Scenario, stop: &AtomicBool) -> Result<Option<Outcome>, Error> {
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let trace = run_watched(scenario, |_, _| match stop.load(Ordering::Relaxed) {
        true => Err(End::Stopped),
        false => Ok(()),
    });
    match trace {
        Ok(trace) => Ok(Some(Outcome::of(scenario, &trace))),
        Err(End::Failed(error)) => Err(error),
        Err(End::Stopped) => Ok(None),
    }
}
