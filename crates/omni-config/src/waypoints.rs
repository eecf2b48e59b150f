//! The waypoints of a command's path, and what of its keys does not fit together.

use std::f64::consts::{FRAC_PI_2, PI};

use omni_core::path::WayShape;

use crate::command::{Command, Start};
use crate::path::{MOST_POINTS, PATHS, PathChoice, PathPoint, WayKind};
use crate::suggestion::did_you_mean;

/// Side of a square, diameter of a circle \[m\], if none is set.
const SIZE_M: f64 = 1.0;

impl Command {
    /// The path's waypoints, the start first; none without a path.
    pub(crate) fn waypoints(&self, start: &Start) -> Option<Vec<omni_core::path::Waypoint<f64>>> {
        let first = PathPoint {
            heading_rad: Some(start.heading_rad),
            ..point(start.x_m, start.y_m)
        };
        let size_m = self.path_size_m.unwrap_or(SIZE_M);
        let points = match self.path.as_ref()? {
            PathChoice::Waypoints(points) => points.clone(),
            PathChoice::Name(name) => built_in(name, size_m, start),
        };
        Some(
            std::iter::once(first)
                .chain(points)
                .map(PathPoint::waypoint)
                .collect(),
        )
    }

    /// The key and its error, if a path's keys are inconsistent.
    pub(crate) fn path_refusal(&self) -> Option<(String, String)> {
        let Some(path) = &self.path else {
            let size_m = self.path_size_m?;
            return Some((
                "command.path_size_m".into(),
                format!("{size_m}, allowed: only with a built-in path"),
            ));
        };
        match path {
            PathChoice::Name(name) if !PATHS.contains(&name.as_str()) => {
                let meant = did_you_mean(name, PATHS);
                let message = format!(
                    "{name:?}{meant}, allowed: {}, or a list of waypoints",
                    PATHS.join(", ")
                );
                Some(("command.path".into(), message))
            }
            PathChoice::Name(_) => None,
            PathChoice::Waypoints(points) => {
                if !(1..=MOST_POINTS).contains(&points.len()) {
                    let message = format!("{} entries, allowed: 1 to {MOST_POINTS}", points.len());
                    return Some(("command.path".into(), message));
                }
                if let Some(size_m) = self.path_size_m {
                    return Some((
                        "command.path_size_m".into(),
                        format!("{size_m}, allowed: only with a built-in path"),
                    ));
                }
                points.iter().enumerate().find_map(|(i, point)| {
                    let key = format!("command.path[{i}].sweep_rad");
                    match (point.kind, point.sweep_rad) {
                        (WayKind::Arc, None) => Some((
                            key,
                            "left out, allowed with kind = \"arc\": 0.01 to 6.2, or -6.2 to -0.01".into(),
                        )),
                        (WayKind::Arc, Some(sweep)) if sweep.abs() < 0.01 => {
                            Some((key, format!("{sweep}, allowed: 0.01 to 6.2, or -6.2 to -0.01")))
                        }
                        (WayKind::Arc, _) | (_, None) => None,
                        (_, Some(sweep)) => {
                            Some((key, format!("{sweep}, allowed: only with kind = \"arc\"")))
                        }
                    }
                })
            }
        }
    }
}

fn point(x_m: f64, y_m: f64) -> PathPoint {
    PathPoint {
        x_m,
        y_m,
        heading_rad: None,
        kind: WayKind::Line,
        sweep_rad: None,
        speed_m_s: None,
        time_s: None,
    }
}

impl PathPoint {
    fn waypoint(self) -> omni_core::path::Waypoint<f64> {
        let mut waypoint = omni_core::path::Waypoint::at(self.x_m, self.y_m);
        waypoint.heading_rad = self.heading_rad;
        waypoint.speed_m_s = self.speed_m_s;
        waypoint.time_s = self.time_s;
        waypoint.shape = match self.kind {
            WayKind::Line => WayShape::Line,
            // An arc without a sweep was rejected before.
            WayKind::Arc => WayShape::Arc {
                sweep_rad: self.sweep_rad.unwrap_or(FRAC_PI_2),
            },
            WayKind::Spline => WayShape::Spline,
        };
        waypoint
    }
}

/// A built-in path from the vehicle's pose.
fn built_in(name: &str, size_m: f64, start: &Start) -> Vec<PathPoint> {
    let (sin, cos) = (libm::sin(start.heading_rad), libm::cos(start.heading_rad));
    let at = |ahead: f64, left: f64| {
        let (ahead, left) = (ahead * size_m, left * size_m);
        point(
            start.x_m + cos * ahead - sin * left,
            start.y_m + sin * ahead + cos * left,
        )
    };
    let arc = |left: f64, sweep: f64| PathPoint {
        kind: WayKind::Arc,
        sweep_rad: Some(sweep),
        ..at(0.0, left)
    };
    if name == "square" {
        [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
            .map(|(x, y)| at(x, y))
            .into()
    } else {
        vec![arc(1.0, PI), arc(0.0, PI), arc(-1.0, -PI), arc(0.0, -PI)]
    }
}
