//! Section 3.3 of the paper: three motors on dampers.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2};
use omni_sim::ByWheel;
use omni_sim::config::MotorBench;
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::error::exception;
use crate::values;

/// Speeds and loads of wheels A, B and C, one row every 0.1 s.
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct MotorBenchTrace {
    inner: omni_sim::MotorBenchTrace,
}

fn columns<'py>(py: Python<'py>, series: &ByWheel) -> Bound<'py, PyArray2<f64>> {
    let array =
        numpy::ndarray::Array2::from_shape_fn((series.a.len(), 3), |(row, wheel)| series.row(row)[wheel]);
    PyArray2::from_owned_array(py, array)
}

#[pymethods]
impl MotorBenchTrace {
    /// Name of the coordination policy.
    #[getter]
    fn policy(&self) -> &str {
        &self.inner.policy
    }

    /// Time [s], (T,).
    #[getter]
    fn t_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.t_s)
    }

    /// Velocities [rpm], (T, 3).
    #[getter]
    fn speed_rpm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        columns(py, &self.inner.speed_rpm)
    }

    /// Applied torques [N.m], (T, 3).
    #[getter]
    fn torque_n_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        columns(py, &self.inner.torque_n_m)
    }

    /// Dampers applied [N.m.s/rad], (T, 3).
    #[getter]
    fn load_n_m_s_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        columns(py, &self.inner.load_n_m_s_rad)
    }

    /// Common factor of the policy, (T,).
    #[getter]
    fn common_factor<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.common_factor)
    }

    fn __len__(&self) -> usize {
        self.inner.t_s.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<omnistep.MotorBenchTrace of {}: {} rows>",
            self.inner.policy,
            self.inner.t_s.len()
        )
    }
}

/// Run section 3.3 of the paper: three motors on dampers, torque limited by eq. (13).
///
/// Args:
///     policy: ``independent``, ``scale_torques`` or ``scale_references``.
///     overrides: keys of the experiment and their new values: ``{"friction_n_m_s_rad": 2e-4}``.
///     experiment: the built-in ``motor_bench``, the default, or the path of a .toml file.
///
/// Returns:
///     One row every 0.1 s, or every control period if that is longer.
///
/// Raises:
///     ConfigError: a name, key or value is wrong.
///
/// Example:
///     >>> import omnistep
///     >>> trace = omnistep.run_motor_bench("scale_references")
///     >>> trace.speed_rpm.shape, float(trace.t_s[-1])
///     ((651, 3), 65.0)
#[pyfunction]
#[pyo3(signature = (policy = "scale_references", *, overrides = None, experiment = PathBuf::from("motor_bench")))]
pub(crate) fn run_motor_bench(
    py: Python<'_>,
    policy: &str,
    overrides: Option<&Bound<'_, PyMapping>>,
    experiment: PathBuf,
) -> PyResult<MotorBenchTrace> {
    let overrides = values::overrides(overrides)?;
    let experiment = experiment.to_string_lossy();
    let run = || omni_sim::run_motor_bench(&MotorBench::load(&experiment, &overrides)?, policy);
    let inner = py.detach(run).map_err(exception)?;
    Ok(MotorBenchTrace { inner })
}
