//! A run's columns as NumPy arrays on the trace's own memory.

use std::sync::Arc;

use numpy::ndarray::{ArrayView1, ArrayView2, Dimension, ViewRepr};
use numpy::{PyArray, PyArray1, PyArray2, PyArrayMethods};
use omni_sim::config::{Scenario, Source, shortened};
use pyo3::exceptions::{PyImportError, PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict};

use crate::arrays::numbers;
use crate::error::{damaged_pickle, exception};
use crate::outcome::Outcome;
use crate::values::Pickled;

/// A finished run: named columns of float64, one row per control period.
///
/// ``trace["time_s"]`` and ``trace.wheels("measured_rad_s")`` are read-only NumPy arrays on the trace's own memory:
/// nothing is copied, and the arrays keep the trace alive. ``docs/columns.md`` lists the columns.
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Trace {
    scenario: Scenario,
    policy: String,
    trace: Arc<omni_sim::Trace>,
    outcome: Outcome,
}

impl Trace {
    /// `policy` is what its controller is called.
    pub(crate) fn new(scenario: Scenario, policy: String, trace: omni_sim::Trace) -> Self {
        Self {
            scenario,
            policy,
            outcome: Outcome::new(*trace.outcome()),
            trace: Arc::new(trace),
        }
    }

    /// The scenario that was run: `scenario` is its name.
    pub(crate) fn whole_scenario(&self) -> &Scenario {
        &self.scenario
    }
}

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
    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, (String, String, Bound<'py, PyBytes>)> {
        let text = self.scenario.to_toml().unwrap_or_default(); // a scenario that ran has a seed that TOML can hold
        let state = postcard::to_allocvec(&*self.trace);
        let state = state.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let made_by = py.get_type::<Self>().getattr("_of_state")?;
        Ok((made_by, (text, self.policy.clone(), PyBytes::new(py, &state))))
    }

    /// A trace out of its pickle.
    #[staticmethod]
    fn _of_state(scenario: String, policy: String, state: &[u8]) -> PyResult<Self> {
        let source = Source::embedded("pickle", scenario);
        let scenario = Scenario::from_source(&source, &[]).map_err(exception)?;
        let trace = postcard::from_bytes(state).map_err(damaged_pickle)?;
        Ok(Self::new(scenario, policy, trace))
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

    /// Names that :meth:`wheels` accepts.
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

    /// The ground: ``kind``, ``friction``, and for a step ``height_m`` and ``start_x_m``.
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

    /// Height of the ground [m] at positions x_m [m], (M,), along the line y_m [m].
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

    /// Name of the coordination policy, with its replaced parts, or of a controller of your own.
    #[getter]
    fn policy(&self) -> &str {
        &self.policy
    }

    /// Seed of the perturbation.
    #[getter]
    fn seed(&self) -> u64 {
        self.scenario.seed
    }

    /// The metrics of the run.
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

    /// A ``pyarrow.Table`` on the trace's own memory.
    ///
    /// >>> import omnistep
    /// >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
    /// >>> trace.to_arrow().num_rows
    /// 500
    ///
    /// Raises:
    ///     ImportError: pyarrow is not installed.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        extra(slf.py(), "pyarrow")?.call_method1("table", (slf,))
    }

    /// A ``polars.DataFrame`` on the trace's own memory.
    ///
    /// >>> import omnistep
    /// >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
    /// >>> trace.to_polars().shape == (500, len(trace.names))
    /// True
    ///
    /// Raises:
    ///     ImportError: polars is not installed.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        extra(slf.py(), "polars")?.call_method1("DataFrame", (slf,))
    }

    /// A ``pandas.DataFrame``: a copy, because pandas keeps its own memory.
    ///
    /// Raises:
    ///     ImportError: pandas is not installed.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        extra(slf.py(), "pandas")?.call_method1("DataFrame", (Self::columns(slf)?,))
    }

    /// The metrics of the run by name, as :meth:`Outcome.to_dict`.
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
    PyKeyError::new_err(format!("no {kind} {}{hint}", shortened(&format!("{name:?}"))))
}
