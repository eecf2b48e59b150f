//! Odometry of a run.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Dimensions of the odometry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum OdometryKind {
    /// In the plane: x, y and yaw by the encoders, or the pose of a `[drive]`.
    #[default]
    Planar,
    /// In three dimensions, by the mean readings of some 5 ms of encoders, hinges and inertial measurement unit:
    /// [`omni_core::estimate::GroundOdometry`]. It adds height, roll, pitch, heights of the wheels' contacts, and edges
    /// of the ground. Let the vehicle stand for some seconds first.
    Ground,
}

/// Odometry of a run: the pose in `/odom` and in the columns `odom_*`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Odometry {
    /// `planar` by default.
    #[garde(skip)]
    pub kind: OdometryKind,
}
