//! Studies and sweeps: plans, folders of results, rows. The Python functions are in `omnistep/ensembles.py`.

use std::collections::BTreeMap;
use std::fs::File;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;

use omni_sim::config::{Override, Scenario, Seeds, Study};
use omni_study::{Batch, Cell, Kind, Row, Run, cells_of, compute};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyList, PyMapping};

use crate::error::{about, exception, refused};
use crate::interruptible::{interruptible, with_progress};
use crate::policy::{Packed, of_study};
use crate::scenario::{ScenarioArg, load};
use crate::values;

/// The runs of a study or a sweep, every scenario checked, for :mod:`omnistep.ensembles`.
#[pyclass(frozen, module = "omnistep._omnistep")]
pub(crate) struct Plan {
    inner: omni_study::Plan,
}

#[pymethods]
impl Plan {
    /// The runs of a study by built-in name or path.
    ///
    /// Raises:
    ///     ConfigError: a name, key or value is wrong.
    #[staticmethod]
    #[pyo3(signature = (study, *, overrides = None, seeds = None))]
    fn of_study(
        py: Python<'_>,
        study: PathBuf,
        overrides: Option<&Bound<'_, PyMapping>>,
        seeds: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let overrides = without_seed(overrides)?;
        let seeds = seeds.map(checked_seeds).transpose()?;
        let mut study = Study::load(&study.to_string_lossy()).map_err(exception)?;
        study.seeds = seeds.unwrap_or(study.seeds);
        let is_axis = |key: &str| study.axis.iter().any(|axis| axis.key == key);
        if let Some(each) = overrides.iter().find(|each| is_axis(each.key())) {
            let (key, file) = (each.key(), study.file());
            let message = format!("overrides: {key} is an axis of {file}, allowed: any other key");
            return Err(refused(key, &message));
        }
        let inner = interruptible(py, |stop| omni_study::Plan::new_until(&study, &overrides, stop))?;
        Ok(Self { inner })
    }

    /// The runs of a scenario with the keys of each point replaced, all seeds of a point together.
    ///
    /// Args:
    ///     points: the keys of each.
    ///     scenario: as in :func:`omnistep.sweep`.
    ///     policy: a coordination policy instead of the scenario's.
    ///     overrides: keys to replace in every run.
    ///     seeds: number of seeds, or a list of them.
    ///     own: a controller of your own instead: its name, the identifier of its control law, its pickle.
    ///
    /// Raises:
    ///     ConfigError: a name, key or value is wrong; the message names the point.
    #[staticmethod]
    #[pyo3(signature = (
        points, *, scenario = ScenarioArg::default(), policy = None, overrides = None, seeds, own = None
    ))]
    fn of_points(
        points: Vec<Bound<'_, PyMapping>>,
        scenario: ScenarioArg,
        policy: Option<&str>,
        overrides: Option<&Bound<'_, PyMapping>>,
        seeds: &Bound<'_, PyAny>,
        own: Option<Packed<'_>>,
    ) -> PyResult<Self> {
        let py = seeds.py();
        let own = own.map(of_study).transpose()?;
        let seeds = checked_seeds(seeds)?;
        without_seed(overrides)?;
        omni_study::Plan::check_size("sweep", points.len(), &seeds).map_err(exception)?;
        let mut scenarios = Vec::with_capacity(points.len());
        for (i, point) in points.iter().enumerate() {
            let own = || -> PyResult<(Vec<_>, Scenario)> {
                let all = PyDict::new(py);
                if let Some(overrides) = overrides {
                    all.update(overrides)?;
                }
                all.update(point)?;
                let scenario = load(scenario.clone(), policy, Some(all.as_mapping()), None)?;
                Ok((values::overrides(Some(point))?, scenario))
            };
            scenarios.push(own().map_err(|error| about(py, &format!("points[{i}]"), error))?);
            // Many points take seconds: meanwhile Ctrl-C is handled, and other threads of Python go on.
            py.detach(|| ());
            py.check_signals()?;
        }
        let plan =
            |stop: &AtomicBool| omni_study::Plan::of_scenarios_until("sweep", scenarios, seeds, own, stop);
        let inner = interruptible(py, plan)?;
        Ok(Self { inner })
    }

    /// Largest number of points of a study or a sweep.
    #[classattr]
    const MOST_POINTS: usize = Study::MOST_POINTS;

    /// Name of the study, or ``sweep``.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.study().name
    }

    /// Varied keys.
    #[getter]
    fn axes(&self) -> Vec<String> {
        self.inner
            .study()
            .axis
            .iter()
            .map(|axis| axis.key.clone())
            .collect()
    }

    /// Names of the metrics of a row that are numbers or booleans.
    #[getter]
    fn metrics(&self) -> Vec<&str> {
        let columns = self.inner.columns().metrics.iter();
        let numbers = columns.filter(|column| column.kind != Kind::Text);
        numbers.map(|column| column.name.as_str()).collect()
    }

    /// Notes, one per line: inputs that traction control lacks, and runs whose policy is not the usual default.
    fn policy_notes(&self) -> Vec<String> {
        self.inner.policy_notes()
    }

    fn __len__(&self) -> usize {
        self.inner.runs().len()
    }
}

/// A folder of results, locked against other programs until it is closed.
#[pyclass(module = "omnistep._omnistep")]
pub(crate) struct Store {
    plan: Py<Plan>,
    store: omni_study::Store,
    lock: Option<File>,
}

#[pymethods]
impl Store {
    #[new]
    fn new(folder: PathBuf, plan: Py<Plan>) -> PyResult<Self> {
        let opened = || {
            let store = omni_study::Store::new(folder, &plan.get().inner)?;
            let lock = store.lock()?;
            Ok::<_, omni_study::Error>((store, lock))
        };
        let (store, lock) = opened().map_err(exception)?;
        Ok(Self {
            plan,
            store,
            lock: Some(lock),
        })
    }

    /// Unlock the folder.
    fn close(&mut self) {
        self.lock = None;
    }

    /// Remove the rows with an error, so that their runs are missing again; return how many.
    fn forget_errors(&self, py: Python<'_>) -> PyResult<usize> {
        interruptible(py, |stop| self.store.forget_errors_until(stop))
    }

    /// Every existing row of the plan.
    ///
    /// Raises:
    ///     ConfigError: the folder holds results of another study or version.
    ///     StudyError: the folder cannot be read.
    fn read(&self, py: Python<'_>) -> PyResult<Rows> {
        let plan = &self.plan.get().inner;
        let (rows, missing, damaged) = interruptible(py, |stop| {
            let found = self.store.read_until(stop)?;
            let missing = plan.missing(&found);
            let mut by_key: BTreeMap<String, Row> =
                found.rows.into_iter().map(|row| (row.key.clone(), row)).collect();
            let rows = plan.runs().iter().filter_map(|run| by_key.remove(&run.key));
            Ok::<_, omni_study::Error>((rows.collect(), missing, found.damaged))
        })?;
        Ok(Rows {
            plan: self.plan.clone_ref(py),
            rows,
            missing,
            damaged,
        })
    }

    /// Compute the rows that ``rows`` lacks and write each as soon as it is done.
    ///
    /// Args:
    ///     rows: the existing rows.
    ///     jobs: threads; as many as there are cores by default.
    ///     watch: called a few times per second with the number of completed rows and the number of failed ones.
    ///
    /// Returns:
    ///     Both numbers at the end.
    ///
    /// Raises:
    ///     StudyError: the folder cannot be written.
    ///     KeyboardInterrupt: Ctrl-C was pressed; finished rows are written.
    #[pyo3(signature = (rows, *, jobs = None, watch = None))]
    fn compute(
        &self,
        py: Python<'_>,
        rows: &Bound<'_, Rows>,
        jobs: Option<NonZeroUsize>,
        watch: Option<Py<PyAny>>,
    ) -> PyResult<(usize, usize)> {
        let missing = &rows.get().missing;
        let computed = with_progress(py, watch, |stop, rows| {
            compute(missing, &self.store, jobs, stop, reporting(rows))
        })?;
        Ok((computed.rows, computed.errors))
    }
}

/// Check the bytes of a Parquet file of results.
///
/// Args:
///     path: the file; any Parquet file.
///
/// Returns:
///     The damage, or None; None for a file that omnistep has not written.
///
/// Raises:
///     StudyError: it cannot be read.
#[pyfunction]
pub(crate) fn damage(py: Python<'_>, path: PathBuf) -> PyResult<Option<&'static str>> {
    py.detach(|| omni_study::damage(&path)).map_err(exception)
}

/// Compute the missing rows of a batch in the folder, each row written as soon as it is done.
///
/// Args:
///     batch: one text of :meth:`Rows.batches`.
///     folder: the folder of results, which a :class:`Store` holds open.
///     jobs: threads; as many as there are cores by default.
///     own: the plan's own controller.
///
/// Returns:
///     Number of computed rows, and number of these that failed.
///
/// Raises:
///     ConfigError: the folder belongs to another study, or the batch to another version of omnistep.
///     StudyError: the folder cannot be written.
///     KeyboardInterrupt: Ctrl-C was pressed; finished rows are written.
#[pyfunction]
#[pyo3(signature = (batch, folder, *, jobs = None, own = None))]
pub(crate) fn compute_batch(
    py: Python<'_>,
    batch: &str,
    folder: PathBuf,
    jobs: Option<NonZeroUsize>,
    own: Option<Packed<'_>>,
) -> PyResult<(usize, usize)> {
    let own = own.map(of_study).transpose()?;
    let batch = Batch::from_text(batch).and_then(|batch| batch.with_policy(own));
    let batch = batch.map_err(exception)?;
    let computed = interruptible(py, |stop| batch.compute(folder, jobs, stop, |_| ()))?;
    Ok((computed.rows, computed.errors))
}

/// Sends of each row whether it failed.
fn reporting(rows: Sender<bool>) -> impl FnMut(&Row) {
    move |row| {
        // The receiver lives for as long as this closure.
        let _ = rows.send(row.error.is_some());
    }
}

/// Rows of a plan in the order of its runs.
#[pyclass(frozen, module = "omnistep._omnistep")]
pub(crate) struct Rows {
    plan: Py<Plan>,
    rows: Vec<Row>,
    missing: Vec<Run>,
    damaged: Vec<(PathBuf, String)>,
}

impl Rows {
    fn columns(&self) -> Vec<omni_study::Column> {
        self.plan.get().inner.columns().all()
    }
}

#[pymethods]
impl Rows {
    /// Number of runs without a row.
    #[getter]
    fn missing(&self) -> usize {
        self.missing.len()
    }

    /// Files that could not be read and were set aside, and why.
    #[getter]
    fn damaged(&self) -> Vec<(PathBuf, String)> {
        self.damaged.clone()
    }

    /// The runs without a row as texts for :func:`compute_batch`, at most ``size`` runs each.
    fn batches(&self, py: Python<'_>, size: NonZeroUsize) -> PyResult<Vec<String>> {
        let plan = &self.plan.get().inner;
        interruptible(py, |stop| {
            let text = |runs: &[Run]| {
                if stop.load(Ordering::Relaxed) {
                    return Err(omni_study::Error::Stopped);
                }
                Ok(Batch::new(plan, runs)?.to_text())
            };
            self.missing.chunks(size.get()).map(text).collect()
        })
    }

    /// Kind of each column by name.
    #[getter]
    fn kinds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for column in self.columns() {
            let kind = match column.kind {
                Kind::Bool => "bool",
                Kind::Integer => "int",
                Kind::Float => "float",
                Kind::Text => "str",
            };
            dict.set_item(column.name, kind)?;
        }
        Ok(dict)
    }

    /// One dictionary per row; None if nothing was measured.
    fn to_dicts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let columns = self.columns();
        let list = PyList::empty(py);
        for row in &self.rows {
            let dict = PyDict::new(py);
            for (column, cell) in columns.iter().zip(row.cells()) {
                dict.set_item(&column.name, value(py, &cell)?)?;
            }
            list.append(dict)?;
        }
        Ok(list)
    }

    /// One dictionary per combination: each axis by its column, counts of runs, mean and interval of each metric.
    ///
    /// Args:
    ///     metrics: names of metrics; the map's by default.
    ///
    /// Raises:
    ///     ConfigError: a name is not a metric.
    #[pyo3(signature = (metrics = None))]
    fn cells<'py>(&self, py: Python<'py>, metrics: Option<Vec<String>>) -> PyResult<Bound<'py, PyList>> {
        let plan = &self.plan.get().inner;
        let metrics = metrics.as_ref().unwrap_or(&plan.study().map.metrics);
        let list = PyList::empty(py);
        for cell in cells_of(plan, &self.rows, metrics).map_err(exception)? {
            let dict = PyDict::new(py);
            for (column, axis) in plan.columns().axes.iter().zip(&cell.axes) {
                dict.set_item(&column.name, value(py, axis)?)?;
            }
            dict.set_item("runs", cell.runs)?;
            dict.set_item("errors", cell.errors)?;
            dict.set_item("unfinished", cell.unfinished)?;
            dict.set_item("beyond_balls", cell.beyond_balls)?;
            for (i, metric) in metrics.iter().enumerate() {
                let (low, high) = ends(cell.intervals[i]);
                dict.set_item(metric, cell.mean(i))?;
                dict.set_item(format!("{metric}_low"), low)?;
                dict.set_item(format!("{metric}_high"), high)?;
            }
            list.append(dict)?;
        }
        Ok(list)
    }

    /// One dictionary per combination with another value: its metric minus the given value's metric, seed by seed.
    ///
    /// Raises:
    ///     ConfigError: the key does not vary, no run has the value, or the name is not a metric.
    fn paired<'py>(
        &self,
        py: Python<'py>,
        key: &str,
        baseline: &Bound<'py, PyAny>,
        metric: &str,
    ) -> PyResult<Bound<'py, PyList>> {
        let plan = &self.plan.get().inner;
        let baseline = Override::new(key, values::from_python("baseline", "baseline", baseline)?);
        let list = PyList::empty(py);
        for cell in omni_study::paired(plan, &self.rows, &baseline, &[metric.into()]).map_err(exception)? {
            let dict = PyDict::new(py);
            for (column, axis) in plan.columns().axes.iter().zip(&cell.axes) {
                dict.set_item(&column.name, value(py, axis)?)?;
            }
            for pair in &cell.metrics {
                let (low, high) = ends(pair.interval);
                dict.set_item("pairs", pair.pairs)?;
                dict.set_item("difference", pair.mean)?;
                dict.set_item("low", low)?;
                dict.set_item("high", high)?;
                if let Some([here, there]) = pair.only {
                    dict.set_item("only_here", here)?;
                    dict.set_item("only_there", there)?;
                }
            }
            list.append(dict)?;
        }
        Ok(list)
    }

    fn __len__(&self) -> usize {
        self.rows.len()
    }

    /// The rows by the Arrow PyCapsule interface.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema; // the interface lets a producer ignore it
        crate::arrow::of_rows(py, &self.columns(), &self.rows)
    }
}

/// The ends of an interval, where there is one.
fn ends(interval: Option<[f64; 2]>) -> (Option<f64>, Option<f64>) {
    interval.map(|[low, high]| (low, high)).unzip()
}

/// Return the 95 % Wilson score interval of a rate; None without a run.
#[pyfunction]
pub(crate) fn wilson(yes: usize, runs: usize) -> Option<(f64, f64)> {
    omni_study::wilson(yes, runs).map(|[low, high]| (low, high))
}

/// Return the mean and its 95 % interval by Student's t; no interval for one measurement, None for none.
#[pyfunction]
pub(crate) fn mean_interval(measured: Vec<f64>) -> Option<(f64, Option<(f64, f64)>)> {
    let (mean, interval) = omni_study::mean_interval(&measured)?;
    Some((mean, interval.map(|[low, high]| (low, high))))
}

fn value<'py>(py: Python<'py>, cell: &Cell) -> PyResult<Bound<'py, PyAny>> {
    match cell {
        Cell::Missing => Ok(py.None().into_bound(py)),
        Cell::Bool(value) => Ok(value.into_pyobject(py)?.to_owned().into_any()),
        Cell::Integer(value) => Ok(value.into_pyobject(py)?.into_any()),
        Cell::Float(value) => Ok(value.into_pyobject(py)?.into_any()),
        Cell::Text(text) => Ok(text.into_pyobject(py)?.into_any()),
    }
}

/// How many seeds, or which.
fn checked_seeds(seeds: &Bound<'_, PyAny>) -> PyResult<Seeds> {
    let value = values::from_python("seeds", "seeds", seeds)?;
    Seeds::from_value(value).map_err(|message| refused("seeds", &format!("seeds: {message}")))
}

/// Overrides of every run: a seed among them would be in none.
fn without_seed(overrides: Option<&Bound<'_, PyMapping>>) -> PyResult<Vec<Override>> {
    let overrides = values::overrides(overrides)?;
    if overrides.iter().any(|each| each.key() == "seed") {
        let message = "overrides: seed, allowed: any other key; set the seeds with seeds";
        return Err(refused("seed", message));
    }
    Ok(overrides)
}
