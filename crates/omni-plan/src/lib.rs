#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod area;
mod chart;
mod edge_lines;
mod error;
mod footprint;
mod grid;
mod ground;
mod map;
mod occupancy;
mod options;
#[cfg(test)]
mod test_charts;

pub use area::Area;
pub use chart::Chart;
pub use error::Error;
pub use footprint::Footprint;
pub use grid::Grid;
pub use map::{Cell, Elevation, Map, PictureScale};
pub use options::{Cost, Options, Speeds};

/// World x and y \[m\].
pub type Point = [f64; 2];
