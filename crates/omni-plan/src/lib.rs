#![doc = include_str!("../README.md")]
//!
//! # In this crate
//!
//! A [`Planner`] is built from a [`Map`], a [`Chart`], a [`Footprint`] and [`Options`]; [`Planner::plan`] returns a
//! [`Route`] or a [`NoRoute`]. [`Planner::write_costmaps`] writes [`MapFiles`] for Nav2.
#![forbid(unsafe_code)]

mod angles;
mod area;
mod blurred_edges;
mod chart;
mod cost;
mod costmap;
mod diagnosis;
mod edge_line;
mod edge_lines;
mod error;
mod footprint;
mod grid;
mod ground;
mod lattice;
mod map;
mod no_route;
mod occupancy;
mod options;
mod planner;
mod portals;
mod route;
mod scan;
mod search;
#[cfg(test)]
mod test_charts;
mod waypoints;

pub use area::Area;
pub use chart::Chart;
pub use costmap::MapFiles;
pub use error::Error;
pub use footprint::Footprint;
pub use grid::Grid;
pub use map::{Cell, Elevation, Map, PictureScale};
pub use no_route::{End, LackingEdge, NoRoute, Obstacle};
pub use options::{Cost, Options, Speeds};
pub use planner::Planner;
pub use route::{Crossing, CrossingKind, Goal, Pose, Route, RoutePoint};

/// World x and y \[m\].
pub type Point = [f64; 2];
