//! Logs back into Python.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use omni_sim::log::LoggedRun;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{exception, looked};
use crate::trace::{Outcome, Trace};

/// A run read back from its log.
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Log {
    path: PathBuf,
    run: BTreeMap<String, String>,
    complete: bool,
    scenario: String,
    trace: Py<Trace>,
    outcome: Option<Outcome>,
    frame_time_s: Vec<f64>,
    frames: BTreeMap<String, Vec<[f64; 7]>>,
    urdf: String,
    terrain_urdf: String,
}

/// Reads an MCAP log of a run; `on_progress` is told the part done, 0 to 1, every some milliseconds.
#[pyfunction]
#[pyo3(signature = (path, *, on_progress = None))]
pub(crate) fn read_mcap(py: Python<'_>, path: PathBuf, on_progress: Option<Py<PyAny>>) -> PyResult<Log> {
    let mut interrupted = None;
    let logged = py.detach(|| {
        LoggedRun::read_watched(&path, |part| {
            interrupted = Python::attach(|py| looked(py, on_progress.as_ref(), part)).err();
            interrupted.is_none()
        })
    });
    if let Some(interrupted) = interrupted {
        return Err(interrupted);
    }
    let logged = logged.map_err(|error| exception(&error))?;
    let file = logged.file;
    // Plain data, which was read from such a text.
    let scenario = toml::to_string(&file.scenario).unwrap_or_default();
    Ok(Log {
        path: file.path,
        run: file.run,
        complete: file.complete,
        scenario,
        outcome: file.outcome.map(Outcome::new),
        trace: Py::new(py, Trace::new(file.scenario, logged.trace))?,
        frame_time_s: logged.frame_time_s,
        frames: logged.frames,
        urdf: logged.urdf,
        terrain_urdf: logged.terrain_urdf,
    })
}

#[pymethods]
impl Log {
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    #[getter]
    fn run(&self) -> BTreeMap<String, String> {
        self.run.clone()
    }

    #[getter]
    fn complete(&self) -> bool {
        self.complete
    }

    #[getter]
    fn scenario_toml(&self) -> &str {
        &self.scenario
    }

    #[getter]
    fn trace(&self, py: Python<'_>) -> Py<Trace> {
        self.trace.clone_ref(py)
    }

    #[getter]
    fn outcome(&self) -> Option<Outcome> {
        self.outcome.clone()
    }

    #[getter]
    fn frame_time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.frame_time_s)
    }

    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, poses) in &self.frames {
            let flat: Bound<'py, PyArray1<f64>> = PyArray1::from_slice(py, poses.as_flattened());
            let rows: Bound<'py, PyArray2<f64>> = flat.reshape([poses.len(), 7])?;
            dict.set_item(name, rows)?;
        }
        Ok(dict)
    }

    #[getter]
    fn urdf(&self) -> &str {
        &self.urdf
    }

    #[getter]
    fn terrain_urdf(&self) -> &str {
        &self.terrain_urdf
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let trace = self.trace.bind(py).get();
        let end = if self.complete { "complete" } else { "not finished" };
        format!(
            "<omnistep.Log {}: {}, {end}>",
            self.path.display(),
            trace.described()
        )
    }
}
