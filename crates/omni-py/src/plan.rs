//! Planners of any wheel count.

use omni_core::path::{PathLimits, PathPiece, PathSegment, PlanarInertia, TrajectorySample, Waypoint};
use omni_core::shaping::MotionLimits;
use omni_core::{BodyTwist, ConfigError, Kinematics, TorqueLimit};
use pyo3::prelude::*;

use crate::arrays::sized;
use crate::error::{of_core, refused};

/// Segments and pieces of a trajectory.
pub(crate) type Parts = (Vec<PathSegment<f64>>, Vec<PathPiece<f64>>);

/// What a planner keeps to, with as many numbers as there are wheels.
pub(crate) struct Limits {
    pub(crate) linear: MotionLimits<f64>,
    pub(crate) yaw: MotionLimits<f64>,
    pub(crate) fastest: [f64; 3],
    pub(crate) quickest: [f64; 3],
    pub(crate) body: PlanarInertia<f64>,
    pub(crate) speeds_rad_s: Vec<f64>,
    pub(crate) stall_torque_n_m: Vec<f64>,
    pub(crate) slope_n_m_s_rad: Vec<f64>,
    pub(crate) wheel_kg_m2: Vec<f64>,
    pub(crate) share: f64,
}

/// A planner of any wheel count.
pub(crate) trait Plan: Send + Sync {
    fn plan(&self, waypoints: &[Waypoint<f64>]) -> Result<Parts, ConfigError>;
    /// Actuator velocities of samples, row after row.
    fn velocities(&self, samples: &[TrajectorySample<f64>]) -> Vec<f64>;
    /// Actuator torques of samples, row after row.
    fn torques(&self, samples: &[TrajectorySample<f64>]) -> Vec<f64>;
}

struct Planner<const N: usize>(omni_core::path::TrajectoryPlanner<f64, N>);

impl<const N: usize> Plan for Planner<N> {
    fn plan(&self, waypoints: &[Waypoint<f64>]) -> Result<Parts, ConfigError> {
        let [segments, pieces] = omni_core::path::TrajectoryPlanner::<f64, N>::room(waypoints);
        let mut parts = (vec![PathSegment::EMPTY; segments], vec![PathPiece::EMPTY; pieces]);
        self.0.plan(waypoints, &mut parts.0, &mut parts.1)?;
        Ok(parts)
    }

    fn velocities(&self, samples: &[TrajectorySample<f64>]) -> Vec<f64> {
        samples
            .iter()
            .flat_map(|sample| self.0.velocities(sample).rad_s)
            .collect()
    }

    fn torques(&self, samples: &[TrajectorySample<f64>]) -> Vec<f64> {
        samples
            .iter()
            .flat_map(|sample| self.0.torques(sample).n_m)
            .collect()
    }
}

/// What a parameter of the control library is called here.
fn argument(error: &ConfigError) -> String {
    let name = match error.parameter {
        "linear.velocity" => "velocity[0]",
        "yaw.velocity" => "velocity[1]",
        "linear.acceleration" => "acceleration[0]",
        "yaw.acceleration" => "acceleration[1]",
        "linear.deceleration" => "deceleration[0]",
        "yaw.deceleration" => "deceleration[1]",
        "linear.jerk" => "jerk[0]",
        "yaw.jerk" => "jerk[1]",
        same => same,
    };
    error
        .index
        .map_or(name.into(), |index| format!("{name}[{index}]"))
}

pub(crate) fn planner<const N: usize>(
    kinematics: &Kinematics<f64, N>,
    limits: &Limits,
) -> PyResult<Box<dyn Plan>> {
    let stall = sized::<N>("stall_torque_n_m", &limits.stall_torque_n_m)?;
    let slope = sized::<N>("slope_n_m_s_rad", &limits.slope_n_m_s_rad)?;
    let mut torques = [TorqueLimit::chugo(); N];
    for (i, torque) in torques.iter_mut().enumerate() {
        *torque = TorqueLimit::line(stall[i], slope[i])
            .map_err(|error| of_core(&format!("{}[{i}]", error.parameter), &error))?;
    }
    let mut within = PathLimits::new(
        limits.linear,
        limits.yaw,
        limits.body,
        *sized("speeds_rad_s", &limits.speeds_rad_s)?,
        torques,
    );
    within.fastest = BodyTwist::from_array(limits.fastest);
    within.quickest = BodyTwist::from_array(limits.quickest);
    within.wheel_kg_m2 = *sized("wheel_kg_m2", &limits.wheel_kg_m2)?;
    within.share = limits.share;
    match omni_core::path::TrajectoryPlanner::new(kinematics, within) {
        Ok(planner) => Ok(Box::new(Planner(planner))),
        Err(error) => {
            let name = argument(&error);
            Err(refused(
                &name,
                &format!("{name} = {}, allowed: {}", error.value, error.allowed),
            ))
        }
    }
}
