//! Final pose of the vehicle, relative to its path and to odometry.

use omni_core::geometry::PlanarPose;

use super::mean::Mean;
use crate::config::Scenario;
use crate::following::error_of;
use crate::observation::Observation;
use crate::report::PathReport;

/// Errors of the vehicle's pose, and its present pose.
pub(super) struct PoseErrors {
    path: Option<PathErrors>,
    /// Where it was after the last period \[m\]; none before the first.
    last: Option<[f64; 2]>,
    /// The true pose after the last period that counts, and the distance from there to where odometry has it.
    end: Option<(PlanarPose<f64>, f64)>,
}

/// Its distance from a path.
struct PathErrors {
    /// When the path is over if it never waits \[s\], and its last pose.
    duration_s: f64,
    end: PlanarPose<f64>,
    /// The vehicle has arrived within these \[m\], \[rad\].
    arrival: [f64; 2],
    errors: Mean,
    peak_m: f64,
    /// Since when it is there \[s\].
    arrived_s: Option<f64>,
}

impl PathErrors {
    /// Adds a period; returns how far the heading is off \[rad\].
    fn push(&mut self, path: &PathReport, seen: &Observation) -> f64 {
        let [error, off_rad] = error_of(&path.pose, seen);
        self.errors.add(error);
        self.peak_m = self.peak_m.max(error);
        let time_s = seen.time_ns as f64 * 1e-9;
        let [from_end_m, turned_rad] = error_of(&self.end, seen);
        let is_there = from_end_m <= self.arrival[0]
            && turned_rad.abs() <= self.arrival[1]
            && time_s - path.waited_s >= self.duration_s;
        self.arrived_s = is_there.then(|| self.arrived_s.unwrap_or(time_s));
        off_rad
    }
}

impl PoseErrors {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let follow = &scenario.command.follow;
        // It was planned when the scenario was loaded.
        let path = scenario.planned_path().ok().flatten().map(|path| {
            let trajectory = path.trajectory();
            PathErrors {
                duration_s: path.duration_s(),
                end: trajectory.at(trajectory.duration_s()).pose,
                arrival: [follow.arrival_m, follow.arrival_rad],
                errors: Mean::default(),
                peak_m: 0.0,
                arrived_s: None,
            }
        });
        Self {
            path,
            last: None,
            end: None,
        }
    }

    /// Adds a period. Returns the heading error relative to the path \[rad\]; 0 without one.
    pub(super) fn push(&mut self, path: Option<&PathReport>, seen: &Observation) -> f64 {
        let both = self.path.as_mut().zip(path);
        let off_rad = both.map_or(0.0, |(errors, path)| errors.push(path, seen));
        let [x_m, y_m, _] = seen.pose.position_m;
        self.last = Some([x_m, y_m]);
        off_rad
    }

    /// A period that counts: of the crossing, or on ground without an obstacle.
    pub(super) fn cross(&mut self, seen: &Observation) {
        let [off_m, _] = error_of(&seen.odometry.pose, seen);
        self.end = Some((seen.pose.planar(), off_m));
    }

    /// Present position of the vehicle \[m\].
    pub(super) fn place(&self) -> [f64; 2] {
        self.last.unwrap_or([f64::NAN; 2])
    }

    /// The true pose at the end of what counts; NaN if nothing did.
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
        self.path.as_ref().map(|path| path.errors.root())
    }

    pub(super) fn path_error_peak_m(&self) -> Option<f64> {
        self.path.as_ref().map(|path| path.peak_m)
    }

    /// Since when the vehicle is at the end of its path \[s\]; none if it is not.
    pub(super) fn arrived_s(&self) -> Option<f64> {
        self.path.as_ref()?.arrived_s
    }
}
