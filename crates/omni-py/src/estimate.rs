//! The estimator of any wheel count, over rows of numbers.

use omni_core::WheelVelocities;
use omni_core::estimate::{EstimatorConfig, EstimatorInput, EstimatorState, PoseCovariance};
use omni_core::geometry::PlanarPose;
use pyo3::prelude::*;

use crate::error::of_core;

/// What a row has beside its wheels.
pub(crate) struct Beside {
    pub(crate) yaw_rate_rad_s: f64,
    pub(crate) acceleration_m_s2: [f64; 2],
    pub(crate) commanded_rest: bool,
}

/// What a row led to.
pub(crate) struct Estimated {
    pub(crate) pose: [f64; 3],
    pub(crate) nis: f64,
    pub(crate) readings: usize,
}

/// An estimator of any wheel count.
pub(crate) trait Estimate: Send + Sync {
    /// One row; `wheels` are as many as there are.
    fn step(&mut self, wheels: &[f64], beside: &Beside) -> Estimated;
    fn pose(&self) -> [f64; 3];
    fn twist(&self) -> [f64; 3];
    fn slip(&self) -> [f64; 3];
    fn bias(&self) -> f64;
    fn accelerometer_bias(&self) -> [f64; 2];
    fn covariance(&self) -> [[f64; 3]; 3];
    /// False if a pose is not finite; variances that are none are an error.
    fn reset(&mut self, pose: [f64; 3], deviations: [f64; 3]) -> PyResult<bool>;
}

struct Filter<const N: usize> {
    estimator: omni_core::estimate::Estimator<f64, N>,
    state: EstimatorState<f64, N>,
}

/// An estimator that starts at the origin.
pub(crate) fn estimate<const N: usize>(
    kinematics: &omni_core::Kinematics<f64, N>,
    config: EstimatorConfig<f64>,
) -> PyResult<Box<dyn Estimate>> {
    let estimator = omni_core::estimate::Estimator::new(config, kinematics)
        .map_err(|error| of_core(error.parameter, &error))?;
    let state = estimator.start();
    Ok(Box::new(Filter { estimator, state }))
}

impl<const N: usize> Estimate for Filter<N> {
    fn step(&mut self, wheels: &[f64], beside: &Beside) -> Estimated {
        let mut rad_s = [f64::NAN; N];
        for (to, from) in rad_s.iter_mut().zip(wheels) {
            *to = *from;
        }
        let mut input = EstimatorInput::new(&WheelVelocities { rad_s });
        input.yaw_rate_rad_s = beside.yaw_rate_rad_s;
        input.acceleration_m_s2 = beside.acceleration_m_s2;
        input.commanded_rest = beside.commanded_rest;
        let step = self.estimator.step(&mut self.state, &input);
        Estimated {
            pose: self.pose(),
            nis: step.nis,
            readings: step.readings,
        }
    }

    fn pose(&self) -> [f64; 3] {
        let pose = self.state.pose();
        [pose.x_m, pose.y_m, pose.yaw_rad]
    }

    fn twist(&self) -> [f64; 3] {
        self.state.twist().to_array()
    }

    fn slip(&self) -> [f64; 3] {
        self.state.slip().to_array()
    }

    fn bias(&self) -> f64 {
        self.state.gyro_bias_rad_s()
    }

    fn accelerometer_bias(&self) -> [f64; 2] {
        self.state.accelerometer_bias_m_s2()
    }

    fn covariance(&self) -> [[f64; 3]; 3] {
        *self.state.covariance().matrix()
    }

    fn reset(&mut self, [x_m, y_m, yaw_rad]: [f64; 3], deviations: [f64; 3]) -> PyResult<bool> {
        let known = PoseCovariance::diagonal(deviations.map(|d| d * d))
            .map_err(|error| of_core("pose_deviations", &error))?;
        Ok(self.state.reset(&PlanarPose { x_m, y_m, yaw_rad }, &known))
    }
}
