//! Dead reckoning over arrays.

use pyo3::prelude::*;

use crate::arrays::{Array, Rows, STEPS_PER_LOOK, array, fixed};
use crate::error::refused;
use crate::kinematics::Kinematics;
use crate::track::Track;

/// Dead reckoning from wheels, with its pose: exact for twists that stay constant over a period.
///
/// Steps accept one row, or T rows at once, and return the pose after each: x [m] and y [m] in the world, yaw [rad],
/// counter-clockwise positive, in (-pi, pi]. A row with NaN or an infinity is ignored; if rows are positions, the next
/// row includes its motion.
///
/// Args:
///     kinematics: the map from wheel velocities to the vehicle's motion.
///     period_s: time between two steps [s], 1e-6 to 10.
///     pose: the initial pose; the origin, facing +x, by default.
///
/// Raises:
///     ConfigError: ``period_s`` is out of range, or the pose is not three finite numbers.
///
/// Example:
///     >>> import math, omnistep
///     >>> layout = omnistep.Layout.omni(wheels=3, circle_radius_m=0.2, wheel_radius_m=0.05)
///     >>> kinematics = omnistep.Kinematics(layout=layout)
///     >>> odometry = omnistep.Odometry(kinematics=kinematics, period_s=0.01)
///     >>> circle = kinematics.inverse([[1.0, 0.0, math.tau]] * 50)  # half a turn to the left
///     >>> poses = odometry.step_velocities(circle)
///     >>> poses.shape, abs(float(odometry.pose[1]) - 1.0 / math.pi) < 1e-9  # a circle of 1 / tau
///     ((50, 3), True)
#[pyclass(module = "omnistep")]
pub(crate) struct Odometry {
    /// The map from wheel velocities to the vehicle's motion.
    kinematics: Py<Kinematics>,
    period_s: f64,
    wheels: usize,
    track: Box<dyn Track>,
}

impl Odometry {
    fn steps<'py>(
        &mut self,
        py: Python<'py>,
        rows: &Rows,
        columns: usize,
        step: fn(&mut dyn Track, &[f64], &mut Vec<f64>),
    ) -> PyResult<Array<'py, f64>> {
        let track = &mut *self.track;
        let poses = py.detach(|| -> PyResult<_> {
            let mut poses = Vec::new();
            for some in rows.values.chunks(STEPS_PER_LOOK * columns) {
                step(track, some, &mut poses);
                Python::attach(|py| py.check_signals())?;
            }
            Ok(poses)
        })?;
        array(py, rows.shape(3), poses)
    }
}

#[pymethods]
impl Odometry {
    #[new]
    #[pyo3(signature = (*, kinematics, period_s, pose = None))]
    fn new(
        kinematics: Bound<'_, Kinematics>,
        period_s: f64,
        pose: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let track = kinematics.get().track(period_s)?;
        let mut odometry = Self {
            wheels: kinematics.get().wheel_count(),
            kinematics: kinematics.unbind(),
            period_s,
            track,
        };
        if let Some(pose) = pose {
            odometry.reset(pose)?;
        }
        Ok(odometry)
    }

    /// The map from wheel velocities to the vehicle's motion.
    #[getter]
    fn kinematics(&self, py: Python<'_>) -> Py<Kinematics> {
        self.kinematics.clone_ref(py)
    }

    /// Time between two steps [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The pose now, (3,).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3], self.track.pose().to_vec())
    }

    /// Integrate one period per row of actuator velocities, each held constant over its period.
    ///
    /// Args:
    ///     velocities: [rad/s], (N,) or (T, N).
    ///
    /// Returns:
    ///     The pose after each, (3,) or (T, 3).
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong.
    ///     TypeError: not numbers.
    fn step_velocities<'py>(&mut self, velocities: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let rows = Rows::with_gaps("velocities", velocities, self.wheels)?;
        self.steps(velocities.py(), &rows, self.wheels, |track, rows, poses| {
            track.velocities(rows, poses)
        })
    }

    /// Integrate the rotation of the actuators since the previous row; the very first row only initialises.
    ///
    /// Args:
    ///     positions: actuator positions [rad], unwrapped, (N,) or (T, N).
    ///
    /// Returns:
    ///     The pose after each, (3,) or (T, 3).
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong.
    ///     TypeError: not numbers.
    fn step_positions<'py>(&mut self, positions: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let rows = Rows::with_gaps("positions", positions, self.wheels)?;
        self.steps(positions.py(), &rows, self.wheels, |track, rows, poses| {
            track.positions(rows, poses)
        })
    }

    /// Integrate displacements along arcs in the body frame, from another source.
    ///
    /// Args:
    ///     displacements: forward [m], left [m], turn [rad], (3,) or (T, 3).
    ///
    /// Returns:
    ///     The pose after each, (3,) or (T, 3).
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong.
    ///     TypeError: not numbers.
    fn step_displacements<'py>(&mut self, displacements: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let rows = Rows::with_gaps("displacements", displacements, 3)?;
        self.steps(displacements.py(), &rows, 3, |track, rows, poses| {
            track.displacements(rows, poses);
        })
    }

    /// Set the pose; the yaw is wrapped. Positions are kept: the next row adds the rotation since the last row.
    ///
    /// Raises:
    ///     ConfigError: not three finite numbers.
    ///     TypeError: not numbers.
    fn reset(&mut self, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        const ALLOWED: &str = "three finite numbers, x [m], y [m], yaw [rad]";
        let pose: [f64; 3] = fixed("pose", pose, ALLOWED)?;
        if self.track.reset(pose) {
            Ok(())
        } else {
            Err(refused("pose", &format!("pose = {pose:?}, allowed: {ALLOWED}")))
        }
    }

    /// Use the next positions only to initialise, as the first: for encoders that were set to zero.
    fn forget_positions(&mut self) {
        self.track.forget_positions();
    }

    fn __repr__(&self) -> String {
        let [x, y, yaw] = self.track.pose();
        format!("<omnistep.Odometry at x {x:.3} m, y {y:.3} m, yaw {yaw:.3} rad>")
    }
}
