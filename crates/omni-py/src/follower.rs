//! Following a trajectory, over arrays.

use numpy::PyArrayDyn;
use omni_core::geometry::PlanarPose;
use omni_core::path::FollowerConfig;
use pyo3::prelude::*;

use crate::arrays::{Rows, array, each_row, together};
use crate::error::of_core;
use crate::trajectory::TrajectorySample;

/// Follows a trajectory: commands its velocity in the body frame plus a correction proportional to the pose error.
///
/// It is stateless. The velocity correction is limited as a vector; the yaw rate correction follows the shorter turn.
/// The firmware's code, in float64.
///
/// Args:
///     gain_per_s: commanded velocity per distance [m/s per m], 0 to 1000. Its inverse, the time constant of the
///         return, should be several times the time constant of the wheels' loops.
///     heading_gain_per_s: commanded yaw rate per heading error [rad/s per rad], 0 to 1000.
///     limit_m_s: largest correction of the velocity [m/s], 0 to 1000.
///     limit_rad_s: largest correction of the yaw rate [rad/s], 0 to 1000.
///
/// Raises:
///     ConfigError: an argument is out of range.
///
/// Example:
///     >>> import omnistep
///     >>> end = omnistep.Scenario("square").trajectory.at(1e3)  # at the origin, facing +x, at rest
///     >>> follower = omnistep.HolonomicFollower(
///     ...     gain_per_s=2.0, heading_gain_per_s=2.0, limit_m_s=0.2, limit_rad_s=0.5)
///     >>> follower.step(end, [0.0, 0.05, 0.0]).twist.round(9).tolist()  # 5 cm too far to the left
///     [0.0, -0.1, 0.0]
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct HolonomicFollower {
    inner: omni_core::path::HolonomicFollower<f64>,
}

impl HolonomicFollower {
    pub(crate) fn of(inner: omni_core::path::HolonomicFollower<f64>) -> Self {
        Self { inner }
    }
}

#[pymethods]
impl HolonomicFollower {
    #[new]
    #[pyo3(signature = (*, gain_per_s, heading_gain_per_s, limit_m_s, limit_rad_s))]
    fn new(gain_per_s: f64, heading_gain_per_s: f64, limit_m_s: f64, limit_rad_s: f64) -> PyResult<Self> {
        let inner = omni_core::path::HolonomicFollower::new(FollowerConfig {
            gain_per_s,
            heading_gain_per_s,
            limit_m_s,
            limit_rad_s,
        })
        .map_err(|error| of_core(error.parameter, &error))?;
        Ok(Self { inner })
    }

    /// The twist to command, for a vehicle at a pose and the sample as its reference.
    ///
    /// Args:
    ///     sample: of one time or of T.
    ///     pose: pose of the vehicle (x [m], y [m], yaw [rad]), (3,) or (T, 3). If the pose is not finite, there is no
    ///         correction: the result is the trajectory's own twist.
    ///
    /// Raises:
    ///     ConfigError: a shape is wrong, or the lengths differ.
    ///     TypeError: not numbers.
    #[pyo3(signature = (sample, pose, /))]
    fn step(&self, sample: &Bound<'_, TrajectorySample>, pose: &Bound<'_, PyAny>) -> PyResult<Follow> {
        let (py, sample) = (sample.py(), sample.get());
        let poses = Rows::with_gaps("pose", pose, 3)?;
        let count = together("row", ("sample", sample.count), ("pose", poses.count()))?;
        let steps = count.unwrap_or(1);
        let (each, _) = poses.values.as_chunks::<3>();
        let (mut twist, mut error_m, mut error_rad) = (Vec::new(), Vec::new(), Vec::new());
        each_row(py, steps, |i| {
            // What is a single one stays the same.
            let [x_m, y_m, yaw_rad] = each[i.min(each.len() - 1)];
            let at = &sample.samples[i.min(sample.samples.len() - 1)];
            let follow = self.inner.step(at, &PlanarPose { x_m, y_m, yaw_rad });
            twist.extend(follow.twist.to_array());
            error_m.extend(follow.error_m);
            error_rad.push(follow.error_rad);
        })?;
        let shape = |columns: Option<usize>| count.into_iter().chain(columns).collect::<Vec<_>>();
        Ok(Follow {
            twist: array(py, shape(Some(3)), twist)?.unbind(),
            error_m: array(py, shape(Some(2)), error_m)?.unbind(),
            error_rad: array(py, shape(None), error_rad)?.unbind(),
        })
    }

    fn __repr__(&self) -> String {
        let shown = format!("{:?}", self.inner);
        let config = shown.split_once("FollowerConfig ").map_or("", |(_, rest)| rest);
        format!(
            "<omnistep.HolonomicFollower {}>",
            config.trim_end_matches(" }").trim_start_matches("{ ")
        )
    }
}

/// Result of :meth:`HolonomicFollower.step`: the errors and the command, once or T times.
#[pyclass(frozen, get_all, module = "omnistep")]
pub(crate) struct Follow {
    /// The body twist to command (vx, vy [m/s], wz [rad/s]), (3,) or (T, 3).
    twist: Py<PyArrayDyn<f64>>,
    /// Position error in the vehicle frame, forward and left [m], (2,) or (T, 2).
    error_m: Py<PyArrayDyn<f64>>,
    /// Heading error [rad], () or (T,).
    error_rad: Py<PyArrayDyn<f64>>,
}

#[pymethods]
impl Follow {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (twist, error) = (self.twist.bind(py).repr()?, self.error_m.bind(py).repr()?);
        Ok(format!("<omnistep.Follow: twist {twist}, error_m {error}>"))
    }
}
