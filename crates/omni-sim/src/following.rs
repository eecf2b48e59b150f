//! Path following: the command from the scenario's path and the estimated pose.

use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;
use omni_core::path::ProgressState;
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

/// Distance of the vehicle from its reference position \[m\], and its heading minus the reference heading \[rad\].
pub(crate) fn error_of(wanted: &PlanarPose<f64>, seen: &Observation) -> [f64; 2] {
    let is = seen.pose.planar();
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
            PoseSource::Estimate => Some(Localization::new(scenario, start)?),
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
        let estimated = self.pose(&last.observed);
        let wanted = self.path.step(&mut self.progress, time_s, &estimated);
        PathReport {
            pose: wanted.pose,
            waited_s: self.progress.waited_s(),
            estimated,
        }
    }

    /// The twist to command at a time \[s\].
    pub(crate) fn command(&self, time_s: f64, seen: &Observation) -> BodyTwist<f64> {
        if time_s < self.path.rest_s {
            return BodyTwist::ZERO;
        }
        let pose = self.pose(seen);
        let wanted = self.path.step(&mut self.progress.clone(), time_s, &pose);
        self.path.follower.step(&wanted, &pose).twist
    }

    /// The pose that is followed with.
    fn pose(&self, seen: &Observation) -> PlanarPose<f64> {
        match (&self.localization, self.path.pose) {
            (Some(localization), _) => localization.pose(),
            (None, PoseSource::Truth) => seen.pose.planar(),
            (None, _) => seen.odometry.pose,
        }
    }

    /// Its state.
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
