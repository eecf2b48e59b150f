//! Path following: the command from the scenario's path and the estimated pose.

use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;
use omni_core::path::{ProgressState, TrajectorySample};

use crate::Error;
use crate::config::{PlannedPath, PoseSource, Scenario};
use crate::observation::Observation;
use crate::report::PathReport;

/// A path, its follower and its progress.
pub(crate) struct Following {
    path: PlannedPath,
    state: ProgressState<f64>,
}

/// The true pose in the plane.
pub(crate) fn true_pose(seen: &Observation) -> PlanarPose<f64> {
    PlanarPose {
        x_m: seen.pose.position_m[0],
        y_m: seen.pose.position_m[1],
        yaw_rad: seen.pose.yaw_rad(),
    }
}

/// Distance of the vehicle from its reference position \[m\], and its heading minus the reference heading \[rad\].
pub(crate) fn error_of(wanted: &PlanarPose<f64>, seen: &Observation) -> [f64; 2] {
    let is = true_pose(seen);
    let turned = omni_core::Real::wrapped_angle(is.yaw_rad - wanted.yaw_rad);
    [libm::hypot(is.x_m - wanted.x_m, is.y_m - wanted.y_m), turned]
}

impl Following {
    /// Of a scenario with a path.
    pub(crate) fn new(scenario: &Scenario) -> Result<Option<Self>, Error> {
        let start = |path| Self {
            path,
            state: ProgressState::default(),
        };
        Ok(scenario.planned_path()?.map(start))
    }

    /// Goes on to a time \[s\], for a vehicle that looks so: where the path wants it then.
    pub(crate) fn advance(&mut self, time_s: f64, seen: &Observation) -> PathReport {
        let mut state = self.state;
        let pose = self.at(&mut state, time_s, seen).pose;
        self.state = state;
        PathReport {
            pose,
            waited_s: state.waited_s(),
        }
    }

    /// The twist to command at a time \[s\].
    pub(crate) fn command(&self, time_s: f64, seen: &Observation) -> BodyTwist<f64> {
        let wanted = self.at(&mut self.state.clone(), time_s, seen);
        self.path.follower.step(&wanted, &self.pose(seen)).twist
    }

    /// Reference pose and motion of the path at a time.
    fn at(&self, state: &mut ProgressState<f64>, time_s: f64, seen: &Observation) -> TrajectorySample<f64> {
        let trajectory = self.path.trajectory();
        match &self.path.progress {
            Some(progress) => progress.step(state, &trajectory, time_s, &self.pose(seen)),
            None => trajectory.at(time_s),
        }
    }

    /// The pose that is followed with.
    fn pose(&self, seen: &Observation) -> PlanarPose<f64> {
        match self.path.pose {
            PoseSource::Truth => true_pose(seen),
            _ => seen.odometry.pose,
        }
    }

    /// Its state.
    pub(crate) fn state(&self) -> &ProgressState<f64> {
        &self.state
    }

    /// Continues from the state of another one.
    pub(crate) fn restore(&mut self, state: ProgressState<f64>) {
        self.state = state;
    }
}
