//! Where the vehicle came to: against its path, and against what its wheels say.

use omni_core::geometry::PlanarPose;

use super::mean::Mean;
use crate::config::{PlannedPath, Scenario};
use crate::following::{error_of, true_pose};
use crate::observation::Observation;

/// How far the vehicle was from where it should be, and where it is.
pub(super) struct PoseErrors {
    /// The path that is followed, what its errors are on average, and the largest of them.
    path: Option<(PlannedPath, Mean, f64)>,
    /// Where it was after the last period \[m\]; none before the first.
    last: Option<[f64; 2]>,
    /// The true pose after the last period that counts, and the distance from there to where odometry has it.
    end: Option<(PlanarPose<f64>, f64)>,
}

impl PoseErrors {
    pub(super) fn new(scenario: &Scenario) -> Self {
        // It was planned when the scenario was loaded.
        let path = scenario.planned_path().ok().flatten();
        Self {
            path: path.map(|path| (path, Mean::default(), 0.0)),
            last: None,
            end: None,
        }
    }

    /// Adds a period. Returns how far the heading is off that of the path \[rad\]; 0 without one.
    pub(super) fn push(&mut self, seen: &Observation) -> f64 {
        let mut off_rad = 0.0;
        if let Some((path, errors, peak)) = &mut self.path {
            let [error, turned_rad] = error_of(&path.trajectory().at(seen.time_ns as f64 * 1e-9).pose, seen);
            errors.add(error);
            *peak = peak.max(error);
            off_rad = turned_rad;
        }
        let [x_m, y_m, _] = seen.pose.position_m;
        self.last = Some([x_m, y_m]);
        off_rad
    }

    /// A period that counts: of the crossing, or on ground without an obstacle.
    pub(super) fn cross(&mut self, seen: &Observation) {
        let [off_m, _] = error_of(&seen.odometry.pose, seen);
        self.end = Some((true_pose(seen), off_m));
    }

    /// Where the vehicle is now \[m\].
    pub(super) fn place(&self) -> [f64; 2] {
        self.last.unwrap_or([f64::NAN; 2])
    }

    /// The true pose at the end of what counts; NaN where nothing did.
    pub(super) fn pose(&self) -> PlanarPose<f64> {
        let nowhere = PlanarPose {
            x_m: f64::NAN,
            y_m: f64::NAN,
            yaw_rad: f64::NAN,
        };
        self.end.map_or(nowhere, |(pose, _)| pose)
    }

    pub(super) fn odometry_error_m(&self) -> f64 {
        self.end.map_or(f64::NAN, |(_, off_m)| off_m)
    }

    pub(super) fn path_error_rms_m(&self) -> Option<f64> {
        self.path.as_ref().map(|(_, errors, _)| errors.root())
    }

    pub(super) fn path_error_peak_m(&self) -> Option<f64> {
        self.path.as_ref().map(|(_, _, peak)| *peak)
    }
}
