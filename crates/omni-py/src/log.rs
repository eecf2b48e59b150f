//! Logs back into Python.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use omni_log::{LoggedRun, Recording, Track};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{exception, looked};
use crate::outcome::Outcome;
use crate::scenario::{ScenarioArg, load};
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
    recorded: bool,
    scenario: String,
    /// Every control period: the columns of the run's trace that its log holds, and the commands before limits.
    ///
    /// These are the controller's inputs, estimates and outputs, and the torques and forces at the wheels; ``asked_*``
    /// are additional columns. A log, and therefore this trace, lacks these columns: ``command_*``, ``twist_*``,
    /// ``pose_*``, ``body_*``, ``hinge_*``, ``row_*``, ``force_*_n``, the energies (``*_j``) and ``newton_residual_n``;
    /// for each wheel ``residual_rad_s``, ``rim_m_s``, ``along_m_s``, ``normal_*``, ``contact_*`` and their positions
    /// ``x_m``, ``y_m``, ``z_m``. Poses are in :attr:`frames`; plots that show positions require the log itself.
    /// ``omnistep.run(omnistep.Scenario.from_toml(log.scenario_toml))`` recomputes every column.
    trace: Py<Trace>,
    outcome: Option<Outcome>,
    frame_time_s: Vec<f64>,
    frames: BTreeMap<String, Vec<[f64; 7]>>,
    odometry: Track,
    ground_truth: Track,
    urdf: String,
    terrain_urdf: String,
}

/// Read an MCAP log: :func:`omnistep.read_mcap` without a progress bar.
///
/// Args:
///     path: as in :func:`omnistep.read_mcap`.
///     on_progress: called with the completed part, 0 to 1, every few milliseconds; an exception in it ends the
///         reading.
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
    let scenario = file.scenario.to_toml().unwrap_or_default();
    let policy = file
        .run
        .get("policy")
        .filter(|_| file.own_controller || file.recorded);
    let policy = policy.cloned().unwrap_or_else(|| file.scenario.control.law());
    Ok(Log {
        path: file.path,
        run: file.run,
        complete: file.complete,
        recorded: file.recorded,
        scenario,
        outcome: file.outcome.map(Outcome::new),
        trace: Py::new(py, Trace::new(file.scenario, policy, logged.trace))?,
        frame_time_s: logged.frame_time_s,
        frames: logged.frames,
        odometry: logged.odometry,
        ground_truth: logged.ground_truth,
        urdf: logged.urdf,
        terrain_urdf: logged.terrain_urdf,
    })
}

/// Write the intact part of a truncated MCAP file of any program as a complete file; return its length [s].
///
/// Args:
///     path: the truncated file.
///     out: the file to write.
///
/// Raises:
///     LogError: the file cannot be read or written, or is damaged in another way.
#[pyfunction]
pub(crate) fn recover(py: Python<'_>, path: PathBuf, out: PathBuf) -> PyResult<f64> {
    py.detach(|| omni_log::recover(path, out)).map_err(exception)
}

/// Write measurements on a vehicle as a log.
///
/// Args:
///     path: the log.
///     scenario: vehicle, control period, and the commands for a simulation.
///     columns: one number for each control period, NaN if unknown, by the column names of a trace.
///     facts: metadata of the log, by name.
///     map: the column map, as TOML text.
///
/// Raises:
///     LogError: columns differ in length or have a name that is not valid, or the file cannot be written.
#[pyfunction]
pub(crate) fn write_recording(
    py: Python<'_>,
    path: PathBuf,
    scenario: ScenarioArg,
    columns: BTreeMap<String, PyReadonlyArray1<'_, f64>>,
    facts: BTreeMap<String, String>,
    map: String,
) -> PyResult<()> {
    let scenario = load(scenario, None, None, None)?;
    let columns = columns
        .into_iter()
        .map(|(name, column)| (name, column.as_array().to_vec()));
    let mut recording = Recording::new(columns.collect());
    (recording.facts, recording.map) = (facts, map);
    py.detach(|| recording.write(&path, &scenario))
        .map_err(exception)?;
    Ok(())
}

/// Times and poses by name.
fn track<'py>(py: Python<'py>, track: &Track, names: [&str; 3]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("time_s", PyArray1::from_slice(py, &track.time_s))?;
    for (k, name) in names.into_iter().enumerate() {
        let column = track.poses.iter().map(|pose| pose[k]);
        dict.set_item(name, PyArray1::from_iter(py, column))?;
    }
    Ok(dict)
}

#[pymethods]
impl Log {
    /// Path of the log.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// Program version, scenario, vehicle, policy and seed by name.
    #[getter]
    fn run(&self) -> BTreeMap<String, String> {
        self.run.clone()
    }

    /// The log is complete; otherwise its last chunk, at most one simulated second, may be missing.
    #[getter]
    fn complete(&self) -> bool {
        self.complete
    }

    /// The log was measured on a vehicle (:func:`omnistep.import_log`); unmeasured values are NaN.
    ///
    /// There is no outcome, and the scenario holds the recorded commands for a simulation.
    #[getter]
    fn recorded(&self) -> bool {
        self.recorded
    }

    /// The scenario of the run as a scenario file that includes the vehicle; derived gains are written out.
    #[getter]
    fn scenario_toml(&self) -> &str {
        &self.scenario
    }

    /// Every control period: the columns of the run's trace that its log holds, and the commands before limits.
    ///
    /// These are the controller's inputs, estimates and outputs, and the torques and forces at the wheels; ``asked_*``
    /// are additional columns. A log, and therefore this trace, lacks these columns: ``command_*``, ``twist_*``,
    /// ``pose_*``, ``body_*``, ``hinge_*``, ``row_*``, ``force_*_n``, the energies (``*_j``) and ``newton_residual_n``;
    /// for each wheel ``residual_rad_s``, ``rim_m_s``, ``along_m_s``, ``normal_*``, ``contact_*`` and their positions
    /// ``x_m``, ``y_m``, ``z_m``. Poses are in :attr:`frames`; plots that show positions require the log itself.
    /// ``omnistep.run(omnistep.Scenario.from_toml(log.scenario_toml))`` recomputes every column.
    #[getter]
    fn trace(&self, py: Python<'_>) -> Py<Trace> {
        self.trace.clone_ref(py)
    }

    /// The metrics; None if the run was killed before its end, or was not simulated.
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

    /// Odometry pose from ``/odom``; each array has shape (O,).
    ///
    /// ``time_s``, and the columns ``odom_*`` of a run's trace.
    #[getter]
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = track(py, &self.odometry, ["odom_x_m", "odom_y_m", "odom_yaw_rad"])?;
        let names = [
            "odom_var_x_m2",
            "odom_cov_xy_m2",
            "odom_var_y_m2",
            "odom_var_yaw_rad2",
        ];
        for (k, name) in names.into_iter().enumerate() {
            let column = self.odometry.variances.iter().map(|row| row[k]);
            dict.set_item(name, PyArray1::from_iter(py, column))?;
        }
        Ok(dict)
    }

    /// True pose from ``/ground_truth/odom``; each array has shape (O,).
    ///
    /// ``time_s``, ``pose_x_m``, ``pose_y_m``, ``pose_yaw_rad``.
    #[getter]
    fn ground_truth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        track(py, &self.ground_truth, ["pose_x_m", "pose_y_m", "pose_yaw_rad"])
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

    /// The vehicle and the ground around the run's path, for the player in ``web/player``.
    ///
    /// ``web/player/README.md`` describes ``bodies``, ``wheels``, ``ground`` and ``patches``, in metres and radians.
    /// ``frames`` maps numbers to frame names. Everything is derived from the scenario in the log.
    ///
    /// >>> import omnistep, pathlib, tempfile
    /// >>> with tempfile.TemporaryDirectory() as folder:
    /// ...     path = pathlib.Path(folder) / "step.mcap"
    /// ...     trace = omnistep.run("step", overrides={"duration_s": 0.1}, mcap=path)
    /// ...     scene = omnistep.read_mcap(path).scene()
    /// >>> floor, step = scene["ground"]
    /// >>> round(step["at_m"][2] + step["half_m"][2], 6)  # how high its upper side is [m]
    /// 0.05
    /// >>> scene["frames"][scene["wheels"][3]["frame"]]
    /// 'wheel_4'
    fn scene<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scene = omni_log::logged_scene(self.trace.bind(py).get().whole_scenario());
        py.import("json")?.call_method1("loads", (scene,))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let trace = self.trace.bind(py).get();
        let end = match (self.recorded, self.complete) {
            (true, _) => "recorded",
            (false, true) => "complete",
            (false, false) => "not finished",
        };
        format!(
            "<omnistep.Log {}: {}, {end}>",
            self.path.display(),
            trace.described()
        )
    }
}
