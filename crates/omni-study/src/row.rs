//! One row for each run, whatever its outcome.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use omni_config::Scenario;
use omni_sim::Outcome;
use omni_sim::controller::AnyController;
use rayon::prelude::*;

use crate::columns::fields;
use crate::{Cell, Kind, OwnPolicy, Run};

/// Summary of a run.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Row {
    /// The run's key.
    pub key: String,
    /// Its seed.
    pub seed: u64,
    /// The value of each axis, in the study's order.
    pub axes: Vec<Cell>,
    /// Each metric of the outcome, in the columns' order. If the physics ended the run, the metrics up to that time;
    /// all missing if it failed for another reason.
    pub metrics: Vec<Cell>,
    /// Why the run failed, in one line.
    pub error: Option<String>,
}

impl Row {
    /// A value for each of [`Columns::all`](crate::Columns::all).
    ///
    /// ```
    /// use omni_config::Study;
    /// use omni_study::{Cell, Plan, row_with};
    /// let plan = Plan::new(&Study::load("ensemble")?, &[])?;
    /// let cells = row_with(&plan.runs()[2], |_| panic!("no ground")).expect("not stopped").cells();
    /// assert_eq!(cells.len(), plan.columns().all().len());
    /// assert_eq!(cells[1], Cell::Integer(2)); // the seed
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    #[must_use]
    pub fn cells(&self) -> Vec<Cell> {
        // A seed comes from TOML, whose integers end at 2^63 - 1.
        let seed = i64::try_from(self.seed).map_or(Cell::Missing, Cell::Integer);
        let mut cells = vec![Cell::Text(self.key.clone()), seed];
        cells.extend(self.axes.iter().chain(&self.metrics).cloned());
        cells.push(self.error.clone().map_or(Cell::Missing, Cell::Text));
        cells
    }
}

/// The row of a run; none if `stop` was set before the end.
///
/// A run that fails, or panics, is a row with its error.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::{Plan, row};
/// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("duration_s", 0.2)])?;
/// let row = row(&plan.runs()[1], &false.into()).expect("not stopped");
/// assert_eq!((row.seed, row.error), (1, None));
/// # Ok::<(), omni_study::Error>(())
/// ```
#[must_use]
pub fn row(run: &Run, stop: &AtomicBool) -> Option<Row> {
    row_with(run, |scenario| simulate(run, scenario, stop))
}

/// The rows of some runs, on the cores of rayon's current pool; those of runs that `stop` ended are not among them.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::{Plan, rows};
/// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("duration_s", 0.1)])?;
/// let some = rows(&plan.runs()[..3], &false.into());
/// assert_eq!(some.iter().map(|row| row.seed).collect::<Vec<_>>(), [0, 1, 2]); // in the runs' order
/// # Ok::<(), omni_study::Error>(())
/// ```
#[must_use]
pub fn rows(runs: &[Run], stop: &AtomicBool) -> Vec<Row> {
    runs.par_iter().filter_map(|run| row(run, stop)).collect()
}

/// An outcome, and why the run ended early if it did.
pub type Ended = (Outcome, Option<omni_sim::Error>);

/// [`row`] with another way to an outcome; none says that the run was stopped.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::{Plan, row_with};
/// let plan = Plan::new(&Study::load("ensemble")?, &[])?;
/// let row = row_with(&plan.runs()[23], |_| panic!("no ground")).expect("not stopped");
/// assert_eq!((row.seed, row.error.as_deref()), (23, Some("panic: no ground")));
/// # Ok::<(), omni_study::Error>(())
/// ```
pub fn row_with(
    run: &Run,
    outcome: impl FnOnce(&Scenario) -> Result<Option<Ended>, omni_sim::Error>,
) -> Option<Row> {
    let scenario = run.scenario();
    // Nothing outlives the closure that a panic could have left half done.
    let done = catch_unwind(AssertUnwindSafe(|| outcome(&scenario)));
    let (metrics, error) = match done {
        Ok(Ok(None)) => return None,
        Ok(Ok(Some((outcome, ended)))) => match metrics(run, &outcome) {
            Ok(metrics) => (metrics, ended.map(|error| error.to_string())),
            Err(misfit) => (Vec::new(), Some(misfit)),
        },
        Ok(Err(error)) => (Vec::new(), Some(error.to_string())),
        Err(panic) => (Vec::new(), Some(format!("panic: {}", message(&*panic)))),
    };
    let mut metrics = metrics;
    metrics.resize(run.columns.metrics.len(), Cell::Missing);
    Some(Row {
        key: run.key.clone(),
        seed: run.seed,
        axes: run.axes.to_vec(),
        metrics,
        error: error.map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")),
    })
}

/// The metrics in the columns' order, or what does not fit its column.
fn metrics(run: &Run, outcome: &Outcome) -> Result<Vec<Cell>, String> {
    let mut fields = fields(outcome);
    let columns = run.columns.metrics.iter();
    columns
        .map(|column| {
            let cell = fields.remove(&column.name).unwrap_or(Cell::Missing);
            match (cell, column.kind) {
                (Cell::Integer(value), Kind::Float) => Ok(Cell::Float(value as f64)),
                (cell, kind) if cell.kind().is_none_or(|own| own == kind) => Ok(cell),
                (cell, kind) => Err(format!(
                    "{} = {cell} is no {kind:?}, as its column is",
                    column.name
                )),
            }
        })
        .collect()
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
}

/// Why a run ended before its end.
enum End {
    Failed(omni_sim::Error),
    Stopped,
}

impl From<omni_sim::Error> for End {
    fn from(error: omni_sim::Error) -> Self {
        Self::Failed(error)
    }
}

fn simulate(run: &Run, scenario: &Scenario, stop: &AtomicBool) -> Result<Option<Ended>, omni_sim::Error> {
    ended(scenario, run.own_policy(), stop)
}

/// The outcome of a scenario under a controller of one's own or its own; none if `stop` was set before the end.
pub(crate) fn ended(
    scenario: &Scenario,
    own: Option<&OwnPolicy>,
    stop: &AtomicBool,
) -> Result<Option<Ended>, omni_sim::Error> {
    let look = || {
        if stop.load(Ordering::Relaxed) {
            Err(End::Stopped)
        } else {
            Ok(())
        }
    };
    let controller = || match own {
        Some(own) => own.controller(scenario),
        None => AnyController::new(scenario),
    };
    let simulated = || {
        omni_sim::Run::new(scenario)
            .controller(controller()?)
            .watch(|_, _| look())
            .outcome()
    };
    match look().and_then(|()| simulated()) {
        Ok(ended) => Ok(Some(ended)),
        Err(End::Failed(error)) => Err(error),
        Err(End::Stopped) => Ok(None),
    }
}
