//! Path following: the command from the scenario's path and the estimated pose.

use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;
use omni_core::path::ProgressState;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::config::{PlannedPath, PoseSource, Scenario};
use crate::observation::Observation;
use crate::report::PathReport;

/// A path, its follower and its progress.
pub(crate) struct Following {
    path: PlannedPath,
    state: State,
}

/// What a snapshot keeps.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct State {
    progress: ProgressState<f64>,
    /// The pose by odometry in three dimensions, if that is followed with.
    estimated: PlanarPose<f64>,
}

/// Distance of the vehicle from its reference position \[m\], and its heading minus the reference heading \[rad\].
pub(crate) fn error_of(wanted: &PlanarPose<f64>, seen: &Observation) -> [f64; 2] {
    let is = seen.pose.planar();
    let turned = omni_core::Real::wrapped_angle(is.yaw_rad - wanted.yaw_rad);
    [libm::hypot(is.x_m - wanted.x_m, is.y_m - wanted.y_m), turned]
}

impl Following {
    /// Of a scenario with a path, whose vehicle starts at a true pose.
    pub(crate) fn new(scenario: &Scenario, start: &PlanarPose<f64>) -> Result<Option<Self>, Error> {
        let state = State {
            progress: ProgressState::default(),
            estimated: *start,
        };
        Ok(scenario.planned_path()?.map(|path| Self { path, state }))
    }

    /// Goes on to a time \[s\], with what is seen then, and with the estimated pose if there is one: where the path
    /// wants the vehicle.
    pub(crate) fn advance(
        &mut self,
        time_s: f64,
        seen: &Observation,
        estimated: Option<PlanarPose<f64>>,
    ) -> PathReport {
        if let Some(estimated) = estimated {
            self.state.estimated = estimated;
        }
        let pose = self.pose(seen);
        let wanted = self.path.step(&mut self.state.progress, time_s, &pose);
        PathReport {
            pose: wanted.pose,
            waited_s: self.state.progress.waited_s(),
            estimated: pose,
        }
    }

    /// The twist to command at a time \[s\].
    pub(crate) fn command(&self, time_s: f64, seen: &Observation) -> BodyTwist<f64> {
        if time_s < self.path.rest_s {
            return BodyTwist::ZERO;
        }
        let pose = self.pose(seen);
        let wanted = self.path.step(&mut self.state.progress.clone(), time_s, &pose);
        self.path.follower.step(&wanted, &pose).twist
    }

    /// The pose that is followed with.
    fn pose(&self, seen: &Observation) -> PlanarPose<f64> {
        match self.path.pose {
            PoseSource::Estimate => self.state.estimated,
            PoseSource::Truth => seen.pose.planar(),
            _ => seen.odometry.pose,
        }
    }

    /// Its state.
    pub(crate) fn state(&self) -> State {
        self.state
    }

    /// Goes on from what another one remembered.
    pub(crate) fn restore(&mut self, state: State) {
        self.state = state;
    }
}
