//! A path to follow, instead of a commanded twist.

use std::fmt;

use garde::{Path, Report, Validate};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::de::{self, Deserializer, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};

use crate::ranges::{
    self, ACCELERATION_M_S2, ACCELERATION_RAD_S2, DISTANCE_ERROR_M, FOLLOW_PER_S, HEADING_ERROR_RAD,
    JERK_M_S3, JERK_RAD_S3, PATH_TIME_S, PLACE_M, REST_BEFORE_S, SHARE, SPEED_M_S, SPEED_RAD_S, SWEEP_RAD,
    TURN_RAD,
};

/// Names of built-in paths.
pub(crate) const PATHS: [&str; 2] = ["square", "figure_eight"];

/// Largest number of waypoints of a path.
pub(crate) const MOST_POINTS: usize = 500;

/// A path: one that is built in, or waypoints.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(untagged)]
#[non_exhaustive]
pub enum PathChoice {
    /// `square`: forward, left, back, right, each by `path_size_m`. `figure_eight`: a circle of that diameter to the
    /// left, then one to the right. Both begin at the vehicle's start and keep its heading.
    Name(String),
    /// From the vehicle's start through these waypoints, 1 to 500.
    Waypoints(#[cfg_attr(feature = "schema", schemars(length(min = 1, max = 500)))] Vec<PathPoint>),
}

impl<'de> Deserialize<'de> for PathChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = PathChoice;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}, or a list of waypoints", PATHS.join(", "))
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<PathChoice, E> {
                Ok(PathChoice::Name(name.into()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<PathChoice, A::Error> {
                let mut points = Vec::new();
                while let Some(point) = list.next_element()? {
                    points.push(point);
                    if points.len() == MOST_POINTS {
                        break;
                    }
                }
                // What is too many is counted and not looked at.
                let mut more = 0;
                while let Some(IgnoredAny) = list.next_element()? {
                    more += 1;
                }
                if more > 0 {
                    let message = format!("{} entries, allowed: 1 to {MOST_POINTS}", points.len() + more);
                    return Err(de::Error::custom(message));
                }
                Ok(PathChoice::Waypoints(points))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl Validate for PathChoice {
    type Context = ();

    fn validate_into(&self, context: &(), parent: &mut dyn FnMut() -> Path, report: &mut Report) {
        if let Self::Waypoints(points) = self {
            points.validate_into(context, parent, report);
        }
    }
}

/// Shape of the path to a waypoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum WayKind {
    /// A straight line. At the place of the waypoint before: a turn on the spot to the heading, or
    /// a wait until the time.
    #[default]
    Line,
    /// Along the circle on which the direction of travel turns by `sweep_rad`.
    Arc,
    /// Smooth through this waypoint and its neighbours.
    Spline,
}

fn is_line(kind: &WayKind) -> bool {
    *kind == WayKind::Line
}

/// A waypoint, in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct PathPoint {
    /// World x \[m\], -100 to 100.
    #[garde(adapt(ranges), range(min = PLACE_M.min, max = PLACE_M.max))]
    pub x_m: f64,
    /// World y \[m\], -100 to 100 (left is +).
    #[garde(adapt(ranges), range(min = PLACE_M.min, max = PLACE_M.max))]
    pub y_m: f64,
    /// Heading there \[rad\], counter-clockwise from world x, -3.2 to 3.2, by the shorter turn;
    /// left out: interpolated towards the next waypoint with a heading, or otherwise kept to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = TURN_RAD.min, max = TURN_RAD.max))]
    pub heading_rad: Option<f64>,
    /// Shape of the path to this waypoint; `line` by default.
    #[serde(default, skip_serializing_if = "is_line")]
    #[garde(skip)]
    pub kind: WayKind,
    /// Turn of the direction of travel on an arc \[rad\], 0.01 to 6.2 to the left, or as much to the right (-).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = SWEEP_RAD.min, max = SWEEP_RAD.max))]
    pub sweep_rad: Option<f64>,
    /// Speed limit on the way to this waypoint \[m/s\], 0.001 to 100; left out: as fast as the limits permit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = SPEED_M_S.min, max = SPEED_M_S.max))]
    pub speed_m_s: Option<f64>,
    /// Time of arrival \[s\], 0.001 to 3600, later than the previous waypoint's time; left out: as early as the limits
    /// allow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = PATH_TIME_S.min, max = PATH_TIME_S.max))]
    pub time_s: Option<f64>,
}

/// Limits for the planning of a path, in addition to the vehicle's own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct PathPlan {
    /// Speed along the path \[m/s\], 0.001 to 100; 1 by default.
    #[garde(adapt(ranges), range(min = SPEED_M_S.min, max = SPEED_M_S.max))]
    pub speed_m_s: f64,
    /// Acceleration, deceleration and centripetal acceleration \[m/s^2\], 0.001 to 1e4; 1 by
    /// default. The plan does not know the friction: use less than friction times gravity.
    #[garde(adapt(ranges), range(min = ACCELERATION_M_S2.min, max = ACCELERATION_M_S2.max))]
    pub acceleration_m_s2: f64,
    /// Jerk along the path \[m/s^3\], 0.001 to 1e5; 10 by default.
    #[garde(adapt(ranges), range(min = JERK_M_S3.min, max = JERK_M_S3.max))]
    pub jerk_m_s3: f64,
    /// Yaw rate \[rad/s\], 0.001 to 1000; 1.5 by default.
    #[garde(adapt(ranges), range(min = SPEED_RAD_S.min, max = SPEED_RAD_S.max))]
    pub yaw_rad_s: f64,
    /// Its change \[rad/s^2\], 0.001 to 1e5; 4 by default.
    #[garde(adapt(ranges), range(min = ACCELERATION_RAD_S2.min, max = ACCELERATION_RAD_S2.max))]
    pub yaw_rad_s2: f64,
    /// The change of that \[rad/s^3\], 0.001 to 1e6; 40 by default.
    #[garde(adapt(ranges), range(min = JERK_RAD_S3.min, max = JERK_RAD_S3.max))]
    pub yaw_rad_s3: f64,
    /// Part of the wheels' speeds and torques that the plan may use, 0.05 to 1; 0.8 by default. The
    /// rest is for the follower.
    #[garde(adapt(ranges), range(min = SHARE.min, max = SHARE.max))]
    pub share: f64,
    /// Whether the plan keeps to the wheels' speeds and torques and to the vehicle's `[limits]`; true by default.
    #[garde(skip)]
    pub wheels: bool,
}

impl Default for PathPlan {
    fn default() -> Self {
        Self {
            speed_m_s: 1.0,
            acceleration_m_s2: 1.0,
            jerk_m_s3: 10.0,
            yaw_rad_s: 1.5,
            yaw_rad_s2: 4.0,
            yaw_rad_s3: 40.0,
            share: 0.8,
            wheels: true,
        }
    }
}

/// Source of the follower's pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PoseSource {
    /// Odometry since the start, as on a real vehicle: the pose of a `[drive]`, or else dead
    /// reckoning with all encoders.
    #[default]
    Odometry,
    /// Odometry in three dimensions, [`omni_core::estimate::GroundOdometry`]: encoders, hinges, gyro and accelerometer,
    /// also where wheels slip or climb. The start is known. [`Odometry`](crate::Odometry) says whether it is reported.
    Estimate,
    /// The true pose, which a real vehicle obtains only from an external measurement.
    Truth,
}

/// Follower of a path: [`omni_core::path::HolonomicFollower`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct PathFollow {
    /// Velocity per distance \[1/s\], 0 to 1000; 2 by default.
    #[garde(adapt(ranges), range(min = FOLLOW_PER_S.min, max = FOLLOW_PER_S.max))]
    pub gain_per_s: f64,
    /// Yaw rate per heading error \[1/s\], 0 to 1000; 2 by default.
    #[garde(adapt(ranges), range(min = FOLLOW_PER_S.min, max = FOLLOW_PER_S.max))]
    pub heading_gain_per_s: f64,
    /// Largest correction of the velocity \[m/s\], 0.001 to 100; 0.3 by default.
    #[garde(adapt(ranges), range(min = SPEED_M_S.min, max = SPEED_M_S.max))]
    pub limit_m_s: f64,
    /// Largest correction of the yaw rate \[rad/s\], 0.001 to 1000; 1 by default.
    #[garde(adapt(ranges), range(min = SPEED_RAD_S.min, max = SPEED_RAD_S.max))]
    pub limit_rad_s: f64,
    /// Source of the pose; `odometry` by default.
    #[garde(skip)]
    pub pose: PoseSource,
    /// Time for which the vehicle stands before it follows \[s\], 0 to 60; 0 by default. An estimator learns the biases
    /// of its inertial unit in 1.5 s.
    #[garde(adapt(ranges), range(min = REST_BEFORE_S.min, max = REST_BEFORE_S.max))]
    pub rest_s: f64,
    /// The path waits for a vehicle that is held up. Without it, the default, its time is the clock's.
    #[garde(dive)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wait: Option<PathWait>,
    /// A vehicle this near the end of its path has arrived \[m\], 0.001 to 100; 0.05 by default.
    #[garde(adapt(ranges), range(min = DISTANCE_ERROR_M.min, max = DISTANCE_ERROR_M.max))]
    pub arrival_m: f64,
    /// The same of its heading \[rad\], 0.001 to 100; 0.05 by default.
    #[garde(adapt(ranges), range(min = HEADING_ERROR_RAD.min, max = HEADING_ERROR_RAD.max))]
    pub arrival_rad: f64,
}

impl Default for PathFollow {
    fn default() -> Self {
        Self {
            gain_per_s: 2.0,
            heading_gain_per_s: 2.0,
            limit_m_s: 0.3,
            limit_rad_s: 1.0,
            pose: PoseSource::Odometry,
            rest_s: 0.0,
            wait: None,
            arrival_m: 0.05,
            arrival_rad: 0.05,
        }
    }
}

/// From which error on a path waits for its vehicle: [`omni_core::path::PathProgress`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct PathWait {
    /// A vehicle that is farther than this from its reference slows the path's time down, and at twice that it stands
    /// \[m\], 0.001 to 100; 0.1 by default. It should be several times the error of a vehicle that is not held up.
    #[garde(adapt(ranges), range(min = DISTANCE_ERROR_M.min, max = DISTANCE_ERROR_M.max))]
    pub lag_m: f64,
    /// The same of its heading \[rad\], 0.001 to 100; 0.3 by default.
    #[garde(adapt(ranges), range(min = HEADING_ERROR_RAD.min, max = HEADING_ERROR_RAD.max))]
    pub lag_rad: f64,
}

impl Default for PathWait {
    fn default() -> Self {
        Self {
            lag_m: 0.1,
            lag_rad: 0.3,
        }
    }
}
