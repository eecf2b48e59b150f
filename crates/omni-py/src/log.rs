//! Logs back into Python.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use omni_log::LoggedRun;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{exception, looked};
use crate::outcome::Outcome;
use crate::trace::Trace;

/// A run read back from its log.
///
/// >>> import omnistep, pathlib, tempfile
/// >>> with tempfile.TemporaryDirectory() as folder:
/// ...     path = pathlib.Path(folder) / "flat.mcap"
/// ...     trace = omnistep.run("flat", overrides={"duration_s": 0.5}, mcap=path)
/// ...     log = omnistep.read_mcap(path)
/// >>> bool((log.trace.wheels("applied_n_m") == trace.wheels("applied_n_m")).all())
/// True
/// >>> log.frames["base_link"].shape
/// (26, 7)
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Log {
    path: PathBuf,
    run: BTreeMap<String, String>,
    complete: bool,
    scenario: String,
    /// Every control period: the columns of the run's own trace that its log has, and what was asked for.
    ///
    /// These are what the controller was told, estimated and did, and the torques and forces at the wheels;
    /// ``asked_*`` and ``gyro_rad_s`` are there in addition. A log does not hold, and so this trace lacks:
    /// ``command_*``, ``twist_*``, ``pose_*``, ``body_*``, ``hinge_*``, ``row_*``, ``force_*_n``, the
    /// energies (``*_j``) and ``newton_residual_n``; of the wheels ``residual_rad_s``, ``rim_m_s``, ``along_m_s``,
    /// ``normal_*``, ``contact_*`` and their places ``x_m``, ``y_m``, ``z_m``. Poses are in :attr:`frames`; figures
    /// that show places take the log itself. ``omnistep.run(omnistep.Scenario.from_toml(log.scenario_toml))`` has
    /// every column again.
    trace: Py<Trace>,
    outcome: Option<Outcome>,
    frame_time_s: Vec<f64>,
    frames: BTreeMap<String, Vec<[f64; 7]>>,
    urdf: String,
    terrain_urdf: String,
}

/// Read an MCAP log: :func:`omnistep.read_mcap` without a progress bar.
///
/// Args:
///     path: as there.
///     on_progress: called with the part done, 0 to 1, every few milliseconds; what it raises ends the reading.
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
    let logged = logged.map_err(exception)?;
    let file = logged.file;
    // Plain data, which was read from such a text.
    let scenario = toml::to_string(&file.scenario).unwrap_or_default();
    let policy = file.run.get("policy").filter(|_| file.own_controller);
    let policy = policy.cloned().unwrap_or_else(|| file.scenario.control.law());
    Ok(Log {
        path: file.path,
        run: file.run,
        complete: file.complete,
        scenario,
        outcome: file.outcome.map(Outcome::new),
        trace: Py::new(py, Trace::new(file.scenario, policy, logged.trace))?,
        frame_time_s: logged.frame_time_s,
        frames: logged.frames,
        urdf: logged.urdf,
        terrain_urdf: logged.terrain_urdf,
    })
}

#[pymethods]
impl Log {
    /// Where it was read.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// Program version, scenario, vehicle, policy and seed by name.
    #[getter]
    fn run(&self) -> BTreeMap<String, String> {
        self.run.clone()
    }

    /// Was it finished? Else its last chunk, at most a simulated second, may be missing.
    #[getter]
    fn complete(&self) -> bool {
        self.complete
    }

    /// The scenario as it was run, its vehicle inside, as a scenario file has it; derived gains are written out.
    #[getter]
    fn scenario_toml(&self) -> &str {
        &self.scenario
    }

    /// Every control period: the columns of the run's own trace that its log has, and what was asked for.
    ///
    /// These are what the controller was told, estimated and did, and the torques and forces at the wheels;
    /// ``asked_*`` and ``gyro_rad_s`` are there in addition. A log does not hold, and so this trace lacks:
    /// ``command_*``, ``twist_*``, ``pose_*``, ``body_*``, ``hinge_*``, ``row_*``, ``force_*_n``, the
    /// energies (``*_j``) and ``newton_residual_n``; of the wheels ``residual_rad_s``, ``rim_m_s``, ``along_m_s``,
    /// ``normal_*``, ``contact_*`` and their places ``x_m``, ``y_m``, ``z_m``. Poses are in :attr:`frames`; figures
    /// that show places take the log itself. ``omnistep.run(omnistep.Scenario.from_toml(log.scenario_toml))`` has
    /// every column again.
    #[getter]
    fn trace(&self, py: Python<'_>) -> Py<Trace> {
        self.trace.clone_ref(py)
    }

    /// The figures; None where the run was killed before its end.
    #[getter]
    fn outcome(&self) -> Option<Outcome> {
        self.outcome.clone()
    }

    /// Times of the frames [s], (F,).
    #[getter]
    fn frame_time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.frame_time_s)
    }

    /// Frames in the world by name, (F, 7): x, y, z [m] and the unit quaternion x, y, z, w.
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

    /// The vehicle as URDF.
    #[getter]
    fn urdf(&self) -> &str {
        &self.urdf
    }

    /// The ground as URDF.
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
