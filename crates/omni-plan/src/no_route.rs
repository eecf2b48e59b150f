//! Why there is no route: which edge lacks how much, which gap is too narrow, or what is wrong with start and goal.

use serde::Serialize;

use crate::chart::side_name;

/// Most edges that a message names.
const MOST_NAMED: usize = 3;

/// Start or goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum End {
    /// Pose of the vehicle.
    Start,
    /// The goal.
    Goal,
}

impl End {
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Goal => "goal",
        }
    }
}

/// The obstacle at a start or goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Obstacle {
    /// A wall, an area to keep out of, an unknown cell, or ground that is too steep.
    Closed,
    /// An edge under the vehicle that is no wall.
    Edge,
    /// A wall or an edge nearer than the clearance.
    Near,
}

impl Obstacle {
    fn name(self) -> &'static str {
        match self {
            Self::Closed => {
                "the vehicle would stand in a wall, a keep-out area, unknown ground or on a steep slope"
            }
            Self::Edge => "the vehicle would stand on an edge",
            Self::Near => "walls or edges are nearer than the clearance",
        }
    }
}

/// An edge that is in the way.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LackingEdge {
    /// World x of a place on it \[m\].
    pub x_m: f64,
    /// World y \[m\].
    pub y_m: f64,
    /// Its height \[m\].
    pub height_m: f64,
    /// Is it a step up, on the way that lacks least?
    pub up: bool,
    /// Friction of the ground there.
    pub friction: f64,
    /// Least friction of the charts, where the ground has less: then what follows is 0.
    pub needs_friction: Option<f64>,
    /// Does the chart have such steps of any side? If not, what follows is 0.
    pub charted: bool,
    /// The most that may be planned with, of all sides \[m\].
    pub allowed_m: f64,
    /// The side that has it \[deg\].
    pub side_deg: f64,
    /// That side's limit on the chart \[m\].
    pub limit_m: f64,
    /// Part of the limit that may be planned with.
    pub margin: f64,
}

impl std::fmt::Display for LackingEdge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mm = |length_m: f64| (1e4 * length_m).round() / 10.0;
        let (way, edge) = if self.up { ("up", "step") } else { ("down", "drop") };
        write!(
            f,
            "edge at ({:.2}, {:.2}): {} mm {way}",
            self.x_m,
            self.y_m,
            mm(self.height_m)
        )?;
        if let Some(least) = self.needs_friction {
            let friction = self.friction;
            return write!(
                f,
                ", on ground of friction {friction}, and the chart is for {least} or more (omnistep chart --friction {friction})"
            );
        }
        if !self.charted {
            return write!(
                f,
                ", and the chart has no steps {way} (omnistep chart --edge {edge})"
            );
        }
        write!(
            f,
            ", at most {} mm from {} ({} of {})",
            mm(self.allowed_m),
            side_name(self.side_deg),
            self.margin,
            mm(self.limit_m),
        )
    }
}

/// Why there is no route. Its message is one line.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case", tag = "reason")]
#[non_exhaustive]
pub enum NoRoute {
    /// Start or goal is not on the map, or is no number.
    #[error("{} at ({x_m:.2}, {y_m:.2}) is out of the map, allowed: x {} to {}, y {} to {}", end.name(), x_range_m[0], x_range_m[1], y_range_m[0], y_range_m[1])]
    OutOfMap {
        /// Which of them.
        end: End,
        /// World x \[m\].
        x_m: f64,
        /// World y \[m\].
        y_m: f64,
        /// The map along x, from and to \[m\].
        x_range_m: [f64; 2],
        /// And along y.
        y_range_m: [f64; 2],
    },
    /// The vehicle cannot stand there.
    #[error("{} at ({x_m:.2}, {y_m:.2}): {}", end.name(), by.name())]
    Blocked {
        /// Start or goal.
        end: End,
        /// World x \[m\].
        x_m: f64,
        /// World y \[m\].
        y_m: f64,
        /// By what.
        by: Obstacle,
    },
    /// Every way is over an edge that is too high; these are of the way that lacks least.
    #[error("no way from start to goal: {}", listed(edges))]
    Edges {
        /// The edges, in the order of the way.
        edges: Vec<LackingEdge>,
    },
    /// The chart allows the edges' heights, but there is no room to meet them squarely, or they are not straight.
    #[error(
        "no way from start to goal: edge at ({x_m:.2}, {y_m:.2}): {:.1} mm is allowed, but it cannot be met squarely over the vehicle's width with a run-up of {run_up_m} m",
        1e3 * height_m
    )]
    NoRoom {
        /// World x of a place on the edge \[m\].
        x_m: f64,
        /// World y \[m\].
        y_m: f64,
        /// Its height \[m\].
        height_m: f64,
        /// The run-up that is asked for \[m\].
        run_up_m: f64,
    },
    /// The widest way is narrower than the vehicle.
    #[error(
        "no way from start to goal: at ({x_m:.2}, {y_m:.2}) the way is {width_m:.2} m wide, the vehicle needs {needed_m:.2} m"
    )]
    TooNarrow {
        /// World x of the narrowest place of the widest way \[m\].
        x_m: f64,
        /// World y \[m\].
        y_m: f64,
        /// Its width, to a cell of the map \[m\].
        width_m: f64,
        /// The vehicle's narrowest side with its clearance \[m\].
        needed_m: f64,
    },
    /// The way is wide enough, but the vehicle cannot turn on it as it would have to.
    #[error(
        "no way from start to goal: the way is {width_m:.2} m wide at ({x_m:.2}, {y_m:.2}), too narrow to turn there"
    )]
    NoTurn {
        /// World x of the narrowest place of the widest way \[m\].
        x_m: f64,
        /// World y \[m\].
        y_m: f64,
        /// Its width, to a cell of the map \[m\].
        width_m: f64,
    },
    /// Walls or closed ground lie all around.
    #[error("no way from start to goal: walls or closed ground are all between them")]
    Enclosed,
}

fn listed(edges: &[LackingEdge]) -> String {
    let mut named: Vec<String> = edges.iter().take(MOST_NAMED).map(ToString::to_string).collect();
    if edges.len() > MOST_NAMED {
        named.push(format!("{} more", edges.len() - MOST_NAMED));
    }
    named.join("; ")
}
