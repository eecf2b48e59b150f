//! Path following: the command from the scenario's path and the estimated pose.

use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;

use crate::Error;
use crate::config::{PlannedPath, PoseSource, Scenario};
use crate::observation::Observation;

/// A path, and who follows it.
pub(crate) struct Following {
    path: PlannedPath,
}

/// The true pose in the plane.
pub(crate) fn true_pose(seen: &Observation) -> PlanarPose<f64> {
    PlanarPose {
        x_m: seen.pose.position_m[0],
        y_m: seen.pose.position_m[1],
        yaw_rad: seen.pose.yaw_rad(),
    }
}

/// How far the vehicle is from where a path wants it \[m\], and how far its heading is turned to
/// the left of the path's \[rad\].
pub(crate) fn error_of(wanted: &PlanarPose<f64>, seen: &Observation) -> [f64; 2] {
    let is = true_pose(seen);
    let turned = omni_core::Real::wrapped_angle(is.yaw_rad - wanted.yaw_rad);
    [libm::hypot(is.x_m - wanted.x_m, is.y_m - wanted.y_m), turned]
}

impl Following {
    /// Of a scenario with a path.
    pub(crate) fn new(scenario: &Scenario) -> Result<Option<Self>, Error> {
        Ok(scenario.planned_path()?.map(|path| Self { path }))
    }

    /// The twist to command at a time \[s\].
    pub(crate) fn command(&self, time_s: f64, seen: &Observation) -> BodyTwist<f64> {
        let pose = match self.path.pose {
            PoseSource::Truth => true_pose(seen),
            _ => seen.odometry.pose,
        };
        self.path
            .follower
            .step(&self.path.trajectory().at(time_s), &pose)
            .twist
    }
}
