//! Dead reckoning of any wheel count, over rows of numbers.

use omni_core::WheelVelocities;
use omni_core::estimate::OdometryState;
use omni_core::geometry::{BodyDisplacement, PlanarPose, WheelAngles};
use pyo3::prelude::*;

use crate::error::of_core;

/// Odometry of any wheel count; one pose is appended a row.
pub(crate) trait Track: Send + Sync {
    fn velocities(&mut self, rows: &[f64], poses: &mut Vec<f64>);
    fn positions(&mut self, rows: &[f64], poses: &mut Vec<f64>);
    fn displacements(&mut self, rows: &[f64], poses: &mut Vec<f64>);
    fn pose(&self) -> [f64; 3];
    /// False if it is not finite.
    fn reset(&mut self, pose: [f64; 3]) -> bool;
    fn forget_positions(&mut self);
}

struct Tracker<const N: usize> {
    kinematics: omni_core::Kinematics<f64, N>,
    odometry: omni_core::estimate::Odometry<f64, N>,
    state: OdometryState<f64, N>,
}

/// Odometry that starts at the origin.
pub(crate) fn track<const N: usize>(
    kinematics: &omni_core::Kinematics<f64, N>,
    period_s: f64,
) -> PyResult<Box<dyn Track>> {
    Ok(Box::new(Tracker {
        kinematics: *kinematics,
        odometry: omni_core::estimate::Odometry::new(period_s)
            .map_err(|error| of_core(error.parameter, &error))?,
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
