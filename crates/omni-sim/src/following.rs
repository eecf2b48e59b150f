//! Path following: the command from the scenario's path and the estimated pose.

use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;
use omni_core::path::{ProgressState, TrajectorySample};
use serde::{Deserialize, Serialize};

use crate::config::{PlannedPath, PoseSource, Scenario};
use crate::localization::{self, Localization};
use crate::observation::Observation;
use crate::report::PathReport;
use crate::{Error, Period, Sensed};

/// A path, its follower and its progress.
pub(crate) struct Following {
    path: PlannedPath,
    progress: ProgressState<f64>,
    /// Of a follower with the estimated pose.
    localization: Option<Localization>,
}

/// What a snapshot keeps.
#[derive(Serialize, Deserialize)]
pub(crate) struct State {
    progress: ProgressState<f64>,
    localization: Option<localization::State>,
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
    /// Of a scenario with a path, whose vehicle starts at a true pose.
    pub(crate) fn new(scenario: &Scenario, start: &PlanarPose<f64>) -> Result<Option<Self>, Error> {
        let Some(path) = scenario.planned_path()? else {
            return Ok(None);
        };
        let localization = match path.pose {
            PoseSource::Estimate => Some(Localization::new(scenario, start, false)?),
            PoseSource::Ground => Some(Localization::new(scenario, start, true)?),
            _ => None,
        };
        Ok(Some(Self {
            path,
            progress: ProgressState::default(),
            localization,
        }))
    }

    /// Goes on to a time \[s\] after the period `last`, with what the sensors say now: where the path wants the
    /// vehicle then.
    pub(crate) fn advance(&mut self, time_s: f64, last: &Period, sensed: &Sensed) -> PathReport {
        if let Some(localization) = &mut self.localization {
            localization.step(&last.control, sensed);
        }
        let seen = &last.observed;
        let mut progress = self.progress;
        let pose = self.at(&mut progress, time_s, seen).pose;
        self.progress = progress;
        PathReport {
            pose,
            waited_s: progress.waited_s(),
            estimated: self.pose(seen),
        }
    }

    /// The twist to command at a time \[s\].
    pub(crate) fn command(&self, time_s: f64, seen: &Observation) -> BodyTwist<f64> {
        let wanted = self.at(&mut self.progress.clone(), time_s, seen);
        self.path.follower.step(&wanted, &self.pose(seen)).twist
    }

    /// Reference pose and motion of the path at a time.
    fn at(
        &self,
        progress: &mut ProgressState<f64>,
        time_s: f64,
        seen: &Observation,
    ) -> TrajectorySample<f64> {
        let trajectory = self.path.trajectory();
        match &self.path.progress {
            Some(waits) => waits.step(progress, &trajectory, time_s, &self.pose(seen)),
            None => trajectory.at(time_s),
        }
    }

    /// The pose that is followed with.
    fn pose(&self, seen: &Observation) -> PlanarPose<f64> {
        match (&self.localization, self.path.pose) {
            (Some(localization), _) => localization.pose(),
            (None, PoseSource::Truth) => true_pose(seen),
            (None, _) => seen.odometry.pose,
        }
    }

    /// What it remembers.
    pub(crate) fn state(&self) -> State {
        State {
            progress: self.progress,
            localization: self.localization.as_ref().map(Localization::state),
        }
    }

    /// Goes on from what another one remembered; false where that followed with another pose.
    pub(crate) fn restore(&mut self, state: &State) -> bool {
        self.progress = state.progress;
        match (&mut self.localization, &state.localization) {
            (Some(localization), Some(state)) => localization.restore(state),
            (None, None) => true,
            _ => false,
        }
    }
}
