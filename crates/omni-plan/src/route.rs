//! A route: the points of a path, and the edges that it crosses; as JSON and as CSV.

use serde::{Deserialize, Serialize};

use crate::Error;
use crate::angles::remainder;
use crate::error::check_argument;

/// Most points of a path that is sampled.
const MOST_POINTS: f64 = 1e6;
/// Angles to turn by are sampled in steps of this \[rad\].
const TURN_SAMPLE_RAD: f64 = 0.1;

/// Pose of a vehicle: its origin, and its yaw counter-clockwise from the world's x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Pose {
    /// World x \[m\].
    pub x_m: f64,
    /// World y \[m\].
    pub y_m: f64,
    /// Yaw \[rad\].
    pub yaw_rad: f64,
}

impl Pose {
    /// A pose.
    #[must_use]
    pub fn new(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self { x_m, y_m, yaw_rad }
    }
}

/// A goal: a position, and optionally a yaw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Goal {
    /// World x \[m\].
    pub x_m: f64,
    /// World y \[m\].
    pub y_m: f64,
    /// Yaw \[rad\]; none for any.
    pub yaw_rad: Option<f64>,
}

impl Goal {
    /// A place, with any yaw.
    #[must_use]
    pub fn place(x_m: f64, y_m: f64) -> Self {
        Self {
            x_m,
            y_m,
            yaw_rad: None,
        }
    }

    /// A place with a yaw.
    #[must_use]
    pub fn pose(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self {
            x_m,
            y_m,
            yaw_rad: Some(yaw_rad),
        }
    }
}

/// Direction of the ground's change at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CrossingKind {
    /// A step up.
    Up,
    /// A step down.
    Down,
    /// Up and down at once: a sill, a cable.
    Over,
}

/// An edge that a route crosses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Crossing {
    /// World x at which the vehicle's origin crosses it \[m\].
    pub x_m: f64,
    /// World y \[m\].
    pub y_m: f64,
    /// The edge's normal, in the direction of travel, counter-clockwise from the world's x \[rad\].
    pub normal_rad: f64,
    /// The side that leads, as direction of travel in the vehicle's axes \[deg\]: 0 the front, 90 the left.
    pub side_deg: f64,
    /// Up, down or over.
    pub kind: CrossingKind,
    /// Height of the edge \[m\].
    pub height_m: f64,
    /// The height that may be planned with there: the chart's limit times the margin \[m\].
    pub allowed_m: f64,
    /// Speed of travel \[m/s\].
    pub speed_m_s: f64,
    /// When the vehicle's origin crosses it \[s\].
    pub time_s: f64,
}

/// A point of a path. Between two points the vehicle travels straight without turning, or turns in place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RoutePoint {
    /// World x \[m\].
    pub x_m: f64,
    /// World y \[m\].
    pub y_m: f64,
    /// Yaw \[rad\], over -pi to pi.
    pub yaw_rad: f64,
    /// Speed on the way to this point \[m/s\]; 0 if the way is a turn in place.
    pub speed_m_s: f64,
    /// Time of arrival at constant speeds \[s\].
    pub time_s: f64,
    /// Whether the segment to this point crosses edges.
    pub crosses: bool,
}

/// A route.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Route {
    /// The path.
    pub points: Vec<RoutePoint>,
    /// The edges that it crosses, in this order.
    pub crossings: Vec<Crossing>,
    /// Length of the path \[m\].
    pub length_m: f64,
    /// Its duration at constant speeds \[s\].
    pub duration_s: f64,
    /// Its cost before it was straightened: \[s\], \[J/kg\], or risk.
    pub cost: f64,
    /// Number of poses that the search expanded.
    pub expanded: usize,
}

impl Route {
    /// The route as JSON, in one line.
    ///
    /// # Errors
    /// If a number cannot be written.
    pub fn to_json(&self) -> Result<String, Error> {
        serde_json::to_string(self).map_err(|error| written(&error))
    }

    /// The path as CSV: a line for each point, `x_m,y_m,yaw_rad,speed_m_s,time_s,crosses`.
    ///
    /// # Errors
    /// If a number cannot be written.
    pub fn points_to_csv(&self) -> Result<String, Error> {
        to_csv(&self.points)
    }

    /// The crossings as CSV: a line for each, with a header.
    ///
    /// # Errors
    /// If a number cannot be written.
    pub fn crossings_to_csv(&self) -> Result<String, Error> {
        to_csv(&self.crossings)
    }

    /// The path with a point at least every `step_m` (0.001 to 100 m) and every 0.1 rad, as ROS's
    /// `nav_msgs/Path` is used.
    ///
    /// # Errors
    /// If the step is out of its range, or too small for the path.
    pub fn sampled(&self, step_m: f64) -> Result<Vec<RoutePoint>, Error> {
        check_argument("step_m", step_m, 1e-3, 100.0)?;
        check_argument("points", self.length_m / step_m, 0.0, MOST_POINTS)?;
        let mut sampled: Vec<RoutePoint> = Vec::new();
        for point in &self.points {
            let Some(before) = sampled.last().copied() else {
                sampled.push(*point);
                continue;
            };
            let way_m = (point.x_m - before.x_m).hypot(point.y_m - before.y_m);
            let turn_rad = remainder(point.yaw_rad - before.yaw_rad);
            let steps = (way_m / step_m)
                .max(turn_rad.abs() / TURN_SAMPLE_RAD)
                .ceil()
                .max(1.0) as usize;
            for step in 1..steps {
                let part = step as f64 / steps as f64;
                let between = |one: f64, other: f64| one + part * (other - one);
                sampled.push(RoutePoint {
                    x_m: between(before.x_m, point.x_m),
                    y_m: between(before.y_m, point.y_m),
                    yaw_rad: remainder(before.yaw_rad + part * turn_rad),
                    time_s: between(before.time_s, point.time_s),
                    ..*point
                });
            }
            sampled.push(*point);
        }
        Ok(sampled)
    }
}

fn to_csv<T: Serialize>(rows: &[T]) -> Result<String, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|error| written(&error))?;
    }
    let bytes = writer.into_inner().map_err(|error| written(&error.error()))?;
    String::from_utf8(bytes).map_err(|error| written(&error))
}

fn written(error: &dyn std::fmt::Display) -> Error {
    Error::Argument {
        name: "route",
        value: error.to_string(),
        allowed: "numbers that can be written".into(),
    }
}
