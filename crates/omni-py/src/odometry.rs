//! Dead reckoning over arrays.

use omni_core::{BodyDisplacement, OdometryState, PlanarPose, WheelAngles, WheelVelocities};
use pyo3::prelude::*;

use crate::arrays::{Array, Rows, STEPS_PER_LOOK, array, fixed};
use crate::error::{of_core, refused};
use crate::kinematics::Kinematics;

/// Odometry of any wheel count; one pose is appended a row.
pub(crate) trait Track: Send + Sync {
    fn velocities(&mut self, rows: &[f64], poses: &mut Vec<f64>);
    fn positions(&mut self, rows: &[f64], poses: &mut Vec<f64>);
    fn displacements(&mut self, rows: &[f64], poses: &mut Vec<f64>);
    fn pose(&self) -> [f64; 3];
    /// False where it is not finite.
    fn reset(&mut self, pose: [f64; 3]) -> bool;
    fn forget_positions(&mut self);
}

struct Tracker<const N: usize> {
    kinematics: omni_core::Kinematics<f64, N>,
    odometry: omni_core::Odometry<f64, N>,
    state: OdometryState<f64, N>,
}

/// Odometry that starts at the origin.
pub(crate) fn track<const N: usize>(
    kinematics: &omni_core::Kinematics<f64, N>,
    period_s: f64,
) -> PyResult<Box<dyn Track>> {
    Ok(Box::new(Tracker {
        kinematics: *kinematics,
        odometry: omni_core::Odometry::new(period_s).map_err(|error| of_core(error.parameter, &error))?,
        state: OdometryState::new(),
    }))
}

impl<const N: usize> Tracker<N> {
    /// Every row of `C` numbers through `step`.
    fn each<const C: usize>(
        &mut self,
        rows: &[f64],
        poses: &mut Vec<f64>,
        step: impl Fn(&mut Self, [f64; C]),
    ) {
        for &row in rows.as_chunks().0 {
            step(self, row);
            poses.extend(self.pose());
        }
    }
}

impl<const N: usize> Track for Tracker<N> {
    fn velocities(&mut self, rows: &[f64], poses: &mut Vec<f64>) {
        self.each(rows, poses, |at, rad_s| {
            let velocities = WheelVelocities { rad_s };
            at.odometry
                .step_velocities(&mut at.state, &at.kinematics, &velocities);
        });
    }

    fn positions(&mut self, rows: &[f64], poses: &mut Vec<f64>) {
        self.each(rows, poses, |at, rad| {
            let positions = WheelAngles { rad };
            at.odometry
                .step_positions(&mut at.state, &at.kinematics, &positions);
        });
    }

    fn displacements(&mut self, rows: &[f64], poses: &mut Vec<f64>) {
        self.each(rows, poses, |at, [dx_m, dy_m, dyaw_rad]| {
            let displacement = BodyDisplacement { dx_m, dy_m, dyaw_rad };
            at.odometry.step_displacement(&mut at.state, &displacement);
        });
    }

    fn pose(&self) -> [f64; 3] {
        let pose = self.state.pose();
        [pose.x_m, pose.y_m, pose.yaw_rad]
    }

    fn reset(&mut self, [x_m, y_m, yaw_rad]: [f64; 3]) -> bool {
        self.state.reset(&PlanarPose { x_m, y_m, yaw_rad })
    }

    fn forget_positions(&mut self) {
        self.state.forget_positions();
    }
}

/// Where the wheels say that the vehicle is.
#[pyclass(module = "omnistep")]
pub(crate) struct Odometry {
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
            wheels: kinematics.get().wheels(),
            kinematics: kinematics.unbind(),
            period_s,
            track,
        };
        if let Some(pose) = pose {
            odometry.reset(pose)?;
        }
        Ok(odometry)
    }

    /// The maps.
    #[getter]
    fn kinematics(&self, py: Python<'_>) -> Py<Kinematics> {
        self.kinematics.clone_ref(py)
    }

    /// Time between two steps [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The pose now (x [m], y [m], yaw [rad]), (3,).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3], self.track.pose().to_vec())
    }

    /// Steps at actuator velocities [rad/s], each held for one period.
    fn step_velocities<'py>(&mut self, velocities: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let rows = Rows::with_gaps("velocities", velocities, self.wheels)?;
        self.steps(velocities.py(), &rows, self.wheels, |track, rows, poses| {
            track.velocities(rows, poses)
        })
    }

    /// Steps to actuator positions [rad].
    fn step_positions<'py>(&mut self, positions: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let rows = Rows::with_gaps("positions", positions, self.wheels)?;
        self.steps(positions.py(), &rows, self.wheels, |track, rows, poses| {
            track.positions(rows, poses)
        })
    }

    /// Steps by displacements in the body's frame.
    fn step_displacements<'py>(&mut self, displacements: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let rows = Rows::with_gaps("displacements", displacements, 3)?;
        self.steps(displacements.py(), &rows, 3, |track, rows, poses| {
            track.displacements(rows, poses);
        })
    }

    /// Sets the pose.
    fn reset(&mut self, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        const ALLOWED: &str = "three finite numbers, x [m], y [m], yaw [rad]";
        let pose: [f64; 3] = fixed("pose", pose, ALLOWED)?;
        if self.track.reset(pose) {
            Ok(())
        } else {
            Err(refused("pose", &format!("pose = {pose:?}, allowed: {ALLOWED}")))
        }
    }

    /// The next positions only start, as the first did.
    fn forget_positions(&mut self) {
        self.track.forget_positions();
    }

    fn __repr__(&self) -> String {
        let [x, y, yaw] = self.track.pose();
        format!("<omnistep.Odometry at x {x:.3} m, y {y:.3} m, yaw {yaw:.3} rad>")
    }
}
