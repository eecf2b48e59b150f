//! A run's columns as NumPy arrays on the trace's own memory.

use std::sync::Arc;

use numpy::ndarray::{ArrayView1, ArrayView2, Dimension, ViewRepr};
use numpy::{PyArray, PyArray1, PyArray2, PyArrayMethods};
use omni_sim::config::{Scenario, Source};
use pyo3::exceptions::{PyImportError, PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict};

use crate::arrays::numbers;
use crate::error::exception;

/// A finished run: named columns of float64, one row a control period.
///
/// ``trace["time_s"]`` and ``trace.wheels("measured_rad_s")`` are read-only NumPy arrays on the trace's own memory:
/// nothing is copied, and the arrays keep the trace alive. ``docs/conventions.md`` lists the columns.
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Trace {
    scenario: Scenario,
    trace: Arc<omni_sim::Trace>,
    outcome: Outcome,
}

impl Trace {
    pub(crate) fn new(scenario: Scenario, trace: omni_sim::Trace) -> Self {
        Self {
            scenario,
            outcome: Outcome::new(*trace.outcome()),
            trace: Arc::new(trace),
        }
    }
}

/// Who makes a thing again, and of what.
type Pickled<'py, A> = PyResult<(Bound<'py, PyAny>, A)>;

/// An array on memory that `owner` keeps; it cannot be written to.
fn borrow<'py, D: Dimension>(
    owner: &Bound<'py, Trace>,
    view: &numpy::ndarray::ArrayBase<ViewRepr<&f64>, D>,
) -> Bound<'py, PyArray<f64, D>> {
    #[expect(unsafe_code, reason = "the one zero-copy borrow")]
    // SAFETY: the view is of the frozen owner's data, which is never changed, moved or freed before the owner, and the
    // array holds a reference to the owner.
    let array = unsafe { PyArray::borrow_from_array(view, owner.clone().into_any()) };
    array.readwrite().make_nonwriteable();
    array
}

#[pymethods]
impl Trace {
    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, (String, Bound<'py, PyBytes>)> {
        let text = self.scenario.to_toml().unwrap_or_default(); // a scenario that ran has a seed that TOML can hold
        let state = postcard::to_allocvec(&*self.trace);
        let state = state.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let made_by = py.get_type::<Self>().getattr("_of_state")?;
        Ok((made_by, (text, PyBytes::new(py, &state))))
    }

    /// A trace out of its pickle.
    #[staticmethod]
    fn _of_state(scenario: String, state: &[u8]) -> PyResult<Self> {
        let source = Source::text("pickle", scenario);
        let scenario = Scenario::from_source(&source, &[]).map_err(|error| exception(&error.into()))?;
        let trace = postcard::from_bytes(state);
        let trace =
            trace.map_err(|error| PyValueError::new_err(format!("the pickle is damaged: {error}")))?;
        Ok(Self::new(scenario, trace))
    }

    /// Names of the columns.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.trace.names().to_vec()
    }

    /// Names of the N wheels, in the order of every array over wheels.
    #[getter]
    fn wheel_names(&self) -> Vec<String> {
        self.trace.wheel_names().to_vec()
    }

    /// Names that :meth:`wheels` takes.
    #[getter]
    fn wheel_signals(&self) -> Vec<String> {
        self.trace.wheel_signals().to_vec()
    }

    /// Rolling radii of the wheels [m], (N,).
    #[getter]
    fn wheel_radius_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(
            py,
            self.scenario.vehicle().wheel.iter().map(|wheel| wheel.radius_m),
        )
    }

    /// The ground: ``kind``, ``friction``, and for a step ``height_m`` and ``at_m``.
    #[getter]
    fn terrain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        // The terrain as a file would say it. Plain data: it can be written as JSON.
        let terrain = serde_json::to_value(&self.scenario.terrain).unwrap_or_default();
        let dict = PyDict::new(py);
        for (key, value) in terrain.as_object().into_iter().flatten() {
            match value {
                serde_json::Value::String(text) => dict.set_item(key, text)?,
                serde_json::Value::Number(number) if number.is_u64() => {
                    dict.set_item(key, number.as_u64())?
                }
                other => dict.set_item(key, other.as_f64())?,
            }
        }
        Ok(dict)
    }

    /// Height of the ground [m] at places x_m [m], (M,), along the line y_m [m].
    #[pyo3(signature = (x_m, *, y_m = 0.0))]
    fn ground_m<'py>(
        &self,
        py: Python<'py>,
        x_m: &Bound<'py, PyAny>,
        y_m: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let x_m = numbers("x_m", x_m, "numbers")?;
        let places: Vec<[f64; 2]> = x_m.into_iter().map(|x| [x, y_m]).collect();
        let heights = py.detach(|| omni_sim::ground_heights_m(&self.scenario, &places));
        Ok(PyArray1::from_vec(py, heights))
    }

    /// Name of the scenario.
    #[getter]
    fn scenario(&self) -> &str {
        &self.scenario.name
    }

    /// Name of the vehicle.
    #[getter]
    fn vehicle(&self) -> &str {
        &self.scenario.vehicle().name
    }

    /// Name of the coordination policy.
    #[getter]
    fn policy(&self) -> &str {
        &self.scenario.control.policy
    }

    /// Seed of the perturbation.
    #[getter]
    fn seed(&self) -> u64 {
        self.scenario.seed
    }

    /// The figures of the run.
    #[getter]
    fn outcome(&self) -> Outcome {
        self.outcome.clone()
    }

    /// A signal of all wheels, (T, N), without a copy.
    ///
    /// Raises:
    ///     KeyError: there is no such signal; the message suggests the nearest.
    fn wheels<'py>(slf: &Bound<'py, Self>, signal: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let trace = &slf.get().trace;
        let shape = (trace.wheel_names().len(), trace.rows());
        let view = trace
            .wheels(signal)
            .and_then(|data| ArrayView2::from_shape(shape, data).ok());
        let view = view.ok_or_else(|| unknown(slf.py(), "signal", signal, &slf.get().wheel_signals()))?;
        Ok(borrow(slf, &view.reversed_axes()))
    }

    /// Every column by name, each (T,), without a copy.
    fn columns<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(slf.py());
        for name in slf.get().trace.names() {
            dict.set_item(name, Self::__getitem__(slf, name)?)?;
        }
        Ok(dict)
    }

    /// A column, (T,), without a copy.
    ///
    /// Raises:
    ///     KeyError: there is no such column; the message suggests the nearest.
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let trace = &slf.get().trace;
        let column = trace
            .column(name)
            .ok_or_else(|| unknown(slf.py(), "column", name, trace.names()))?;
        Ok(borrow(slf, &ArrayView1::from(column)))
    }

    /// The columns as an Arrow stream without a copy: ``pyarrow.table(trace)``, ``duckdb.sql("from trace")``.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema; // the interface lets a producer ignore it
        crate::arrow::stream(py, &self.trace)
    }

    /// Every column side by side in the order of ``names``, (T, C), without a copy; read-only.
    fn to_numpy<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let trace = &slf.get().trace;
        let shape = (trace.names().len(), trace.rows());
        let view = ArrayView2::from_shape(shape, trace.data());
        let view = view.map_err(|error| PyKeyError::new_err(error.to_string()))?;
        Ok(borrow(slf, &view.reversed_axes()))
    }

    /// A ``polars.DataFrame`` on the trace's own memory.
    ///
    /// >>> import omnistep
    /// >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
    /// >>> trace.to_polars().shape == (500, len(trace.names))
    /// True
    ///
    /// Raises:
    ///     ImportError: polars is not there.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        extra(slf.py(), "polars")?.call_method1("DataFrame", (slf,))
    }

    /// A ``pandas.DataFrame``: a copy, as pandas keeps its own memory.
    ///
    /// Raises:
    ///     ImportError: pandas is not there.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        extra(slf.py(), "pandas")?.call_method1("DataFrame", (Self::columns(slf)?,))
    }

    /// The figures of the run by name, as :meth:`Outcome.to_dict`.
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.outcome.to_dict(py)
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> bool {
        // As in a dict: whatever is not a name is not in it.
        name.extract::<&str>()
            .is_ok_and(|name| self.trace.column(name).is_some())
    }

    fn __len__(&self) -> usize {
        self.trace.rows()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.names().into_pyobject(py)?.call_method0("__iter__")
    }

    fn __repr__(&self) -> String {
        format!("<omnistep.Trace of {}>", self.described())
    }
}

impl Trace {
    /// For a `repr`.
    pub(crate) fn described(&self) -> String {
        let (rows, columns) = (self.trace.rows(), self.trace.names().len());
        let (scenario, policy) = (self.scenario(), self.policy());
        let outcome = self.outcome.summary();
        format!("{scenario}, {policy}: {rows} rows, {columns} columns, {outcome}")
    }
}

/// A package that is not ours to require.
fn extra<'py>(py: Python<'py>, package: &str) -> PyResult<Bound<'py, PyAny>> {
    match py.import(package) {
        Ok(module) => Ok(module.into_any()),
        Err(error) => {
            let missing = PyImportError::new_err(format!("this needs {package}: pip install {package}"));
            missing.set_cause(py, Some(error));
            Err(missing)
        }
    }
}

/// A `KeyError` that suggests the nearest names.
fn unknown(py: Python<'_>, kind: &str, name: &str, known: &[impl AsRef<str>]) -> PyErr {
    let near = || -> PyResult<Vec<String>> {
        let known: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
        py.import("difflib")?
            .call_method1("get_close_matches", (name, known))?
            .extract()
    };
    let hint = match near() {
        Ok(near) if !near.is_empty() => format!("; did you mean {}?", near.join(", ")),
        _ => format!(
            "; {kind} names are in trace.{}",
            if kind == "column" {
                "names"
            } else {
                "wheel_signals"
            }
        ),
    };
    PyKeyError::new_err(format!("no {kind} {name:?}{hint}"))
}

/// Figures of a run; where there is an obstacle, over the crossing (docs/conventions.md).
///
/// A figure that was not measured, because nothing crossed or the run was killed, is NaN, or None where it says so.
#[pyclass(frozen, eq, module = "omnistep")]
#[derive(Clone, PartialEq)]
pub(crate) struct Outcome {
    inner: omni_sim::Outcome,
}

impl Outcome {
    pub(crate) fn new(inner: omni_sim::Outcome) -> Self {
        Self { inner }
    }

    fn summary(&self) -> String {
        match self.inner.crossing_s {
            Some(seconds) => format!("climbed in {seconds:.2} s"),
            None => self.inner.verdict.name().into(),
        }
    }
}

#[pymethods]
impl Outcome {
    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, (String,)> {
        let state =
            serde_json::to_string(&self.inner).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok((py.get_type::<Self>().getattr("_of_state")?, (state,)))
    }

    /// Figures out of their pickle.
    #[staticmethod]
    fn _of_state(state: &str) -> PyResult<Self> {
        let inner = serde_json::from_str(state);
        let inner =
            inner.map_err(|error| PyValueError::new_err(format!("the pickle is damaged: {error}")))?;
        Ok(Self::new(inner))
    }

    /// How it ended; `driven` on flat ground.
    #[getter]
    fn verdict(&self) -> &'static str {
        self.inner.verdict.name()
    }

    /// Every wheel stands on the ground beyond the obstacle; False on flat ground.
    #[getter]
    fn climbed(&self) -> bool {
        self.inner.climbed
    }

    /// From the foremost wheel's touch to the last wheel's stand [s]; None unless climbed.
    #[getter]
    fn crossing_s(&self) -> Option<f64> {
        self.inner.crossing_s
    }

    /// World x of the base where it stalled [m]; None unless stalled.
    #[getter]
    fn stalled_at_m(&self) -> Option<f64> {
        self.inner.stalled_at_m
    }

    /// The foremost row that had not passed the obstacle then, 1 is the front row; None unless stalled.
    #[getter]
    fn stalled_row(&self) -> Option<usize> {
        self.inner.stalled_row
    }

    /// Largest nose-up angle of any body [deg].
    #[getter]
    fn pitch_peak_deg(&self) -> f64 {
        self.inner.pitch_peak_deg
    }

    /// Heading less the heading commanded, at the end of the crossing [deg]; left is positive.
    #[getter]
    fn yaw_error_deg(&self) -> f64 {
        self.inner.yaw_error_deg
    }

    /// Root mean square of the slip ratio over driven wheels that touch the ground.
    #[getter]
    fn slip_rms(&self) -> f64 {
        self.inner.slip_rms
    }

    /// Root mean square of the disturbed ratio over driven wheels.
    #[getter]
    fn disturbed_rms(&self) -> f64 {
        self.inner.disturbed_rms
    }

    /// Root mean square of the spread of velocity over reference.
    #[getter]
    fn spread_rms(&self) -> f64 {
        self.inner.spread_rms
    }

    /// Root mean square of the part of the velocities that no common factor on the references explains [rad/s].
    #[getter]
    fn shape_error_rms_rad_s(&self) -> f64 {
        self.inner.shape_error_rms_rad_s
    }

    /// Sum over wheels of the time integral of torque squared [N^2.m^2.s].
    #[getter]
    fn heat_n2m2s(&self) -> f64 {
        self.inner.heat_n2m2s
    }

    /// Work of the motors [J].
    #[getter]
    fn work_j(&self) -> f64 {
        self.inner.work_j
    }

    /// That work over weight times way; None where it went less than 1 cm.
    #[getter]
    fn cost_of_transport(&self) -> Option<f64> {
        self.inner.cost_of_transport
    }

    /// That work over weight times height gained; None unless climbed to a higher place.
    #[getter]
    fn e_over_mgh(&self) -> Option<f64> {
        self.inner.e_over_mgh
    }

    /// Friction that the wheels called for in 95 of 100 averages of 10 ms.
    #[getter]
    fn required_friction(&self) -> f64 {
        self.inner.required_friction
    }

    /// Energy that the book cannot place, over all that went through the motors.
    #[getter]
    fn energy_residual(&self) -> f64 {
        self.inner.energy_residual
    }

    /// The figures by name.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("verdict", self.verdict())?;
        dict.set_item("climbed", self.inner.climbed)?;
        dict.set_item("crossing_s", self.inner.crossing_s)?;
        dict.set_item("stalled_at_m", self.inner.stalled_at_m)?;
        dict.set_item("stalled_row", self.inner.stalled_row)?;
        dict.set_item("pitch_peak_deg", self.inner.pitch_peak_deg)?;
        dict.set_item("yaw_error_deg", self.inner.yaw_error_deg)?;
        dict.set_item("slip_rms", self.inner.slip_rms)?;
        dict.set_item("disturbed_rms", self.inner.disturbed_rms)?;
        dict.set_item("spread_rms", self.inner.spread_rms)?;
        dict.set_item("shape_error_rms_rad_s", self.inner.shape_error_rms_rad_s)?;
        dict.set_item("heat_n2m2s", self.inner.heat_n2m2s)?;
        dict.set_item("work_j", self.inner.work_j)?;
        dict.set_item("cost_of_transport", self.inner.cost_of_transport)?;
        dict.set_item("e_over_mgh", self.inner.e_over_mgh)?;
        dict.set_item("required_friction", self.inner.required_friction)?;
        dict.set_item("energy_residual", self.inner.energy_residual)?;
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let o = &self.inner;
        format!(
            "<omnistep.Outcome: {}, pitch {:.2} deg, slip {:.3}, disturbed {:.3}, spread {:.3}, heat {:.1} N2m2s>",
            self.summary(),
            o.pitch_peak_deg,
            o.slip_rms,
            o.disturbed_rms,
            o.spread_rms,
            o.heat_n2m2s
        )
    }
}
