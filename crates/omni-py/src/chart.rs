//! Climb charts as the text of their files. The Python functions are in `omnistep/charts.py`.

use std::num::NonZeroUsize;
use std::sync::Mutex;

use omni_study::{Approach, Chart, ChartPlan, ChartSetup, ChartStart, Edge};
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyType};
use toml::{Table, Value};

use crate::error::{exception, refused};
use crate::interruptible::interruptible;
use crate::values;
use crate::vehicle::VehicleArg;

/// The runs of a climb chart, checked, for :mod:`omnistep.charts`.
#[pyclass(frozen, module = "omnistep._omnistep")]
pub(crate) struct ChartRuns {
    plan: ChartPlan,
}

#[pymethods]
impl ChartRuns {
    /// The runs of a chart; the arguments are as in :func:`omnistep.climb_chart`.
    ///
    /// Raises:
    ///     ConfigError: a name, key or value is wrong.
    #[new]
    #[pyo3(signature = (
        vehicle, *, policy, edges, sides_deg, skews_deg, friction, speed_m_s, margin, starts, overrides
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a function")]
    fn new(
        vehicle: VehicleArg,
        policy: Option<String>,
        edges: Vec<String>,
        sides_deg: Vec<f64>,
        skews_deg: Vec<f64>,
        friction: f64,
        speed_m_s: f64,
        margin: f64,
        starts: i64,
        overrides: Option<&Bound<'_, PyMapping>>,
    ) -> PyResult<Self> {
        // Plain data read from TOML: it can be written as TOML.
        let vehicle = Table::try_from(vehicle.load().map_err(exception)?).unwrap_or_default();
        let setup = ChartSetup {
            overrides: values::overrides(overrides)?,
            policy,
            friction,
            speed_m_s,
            margin,
            starts: usize::try_from(starts)
                .map_err(|_| refused("starts", &format!("starts: {starts}, allowed: 3 to 100")))?,
            edges: edges.iter().map(|name| edge(name)).collect::<PyResult<_>>()?,
            sides_deg,
            skews_deg,
            ..ChartSetup::new(Value::Table(vehicle))
        };
        let plan = ChartPlan::new(&setup).map_err(exception)?;
        Ok(Self { plan })
    }

    /// The scenario of one run of the chart, as a file with its vehicle.
    ///
    /// Args:
    ///     edge: the obstacle.
    ///     size_m: its size [m].
    ///     side_deg: direction of travel in the vehicle's axes [deg].
    ///     skew_deg: direction of travel off the edge's normal [deg].
    ///     x_m: start of the run, world x [m].
    ///     heading_deg: heading relative to the approach [deg].
    ///
    /// Raises:
    ///     ConfigError: a value is out of range.
    #[pyo3(signature = (edge, size_m, side_deg, *, skew_deg = 0.0, x_m = 0.0, heading_deg = 0.0))]
    fn scenario(
        &self,
        edge: &str,
        size_m: f64,
        side_deg: f64,
        skew_deg: f64,
        x_m: f64,
        heading_deg: f64,
    ) -> PyResult<String> {
        let approach = Approach::new(self::edge(edge)?, side_deg, skew_deg);
        let start = ChartStart::new(x_m, heading_deg);
        let scenario = self.plan.scenario(&approach, size_m, &start).map_err(exception)?;
        scenario.to_toml().map_err(exception)
    }

    /// The text of the chart's file, with the cells of the text ``done``.
    ///
    /// Args:
    ///     done: text of the file of a chart that was begun; None to begin.
    ///     file: the name of that file in messages.
    ///     jobs: runs at the same time, one for each core by default.
    ///     keep: called with the text after each cell.
    ///
    /// Raises:
    ///     ConfigError: the chart that was begun holds other runs.
    #[pyo3(signature = (*, done = None, file = "chart", jobs = None, keep = None))]
    fn compute(
        &self,
        py: Python<'_>,
        done: Option<&str>,
        file: &str,
        jobs: Option<NonZeroUsize>,
        keep: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        let done = match done {
            Some(text) => Chart::from_toml(file, text).map_err(exception)?,
            None => self.plan.empty(),
        };
        let raised = Mutex::new(None);
        let made = interruptible(py, |stop| {
            let keep = |chart: &Chart| {
                let Some(keep) = &keep else { return Ok(()) };
                let text = chart.to_toml()?;
                Python::attach(|py| keep.call1(py, (text,)))
                    .map(|_| ())
                    .map_err(|error| {
                        if let Ok(mut raised) = raised.lock() {
                            *raised = Some(error);
                        }
                        omni_study::Error::Stopped
                    })
            };
            omni_study::chart(&self.plan, &done, jobs, stop, keep)
        });
        if let Ok(Some(error)) = raised.into_inner() {
            return Err(error);
        }
        made?.to_toml().map_err(exception)
    }

    /// Check the text of a chart's file.
    ///
    /// Raises:
    ///     ConfigError: the text is not a chart; the message names file, key and value.
    #[classmethod]
    fn check(_: &Bound<'_, PyType>, file: &str, text: &str) -> PyResult<()> {
        Chart::from_toml(file, text).map(|_| ()).map_err(exception)
    }
}

fn edge(name: &str) -> PyResult<Edge> {
    let found = Edge::ALL.into_iter().find(|edge| edge.name() == name);
    found.ok_or_else(|| {
        let names = Edge::ALL.map(Edge::name).join(", ");
        refused("edges", &format!("edges: {name:?}, allowed: {names}"))
    })
}
