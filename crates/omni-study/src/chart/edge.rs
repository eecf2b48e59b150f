//! The obstacles of a chart, and their ground.

use omni_config::{Vehicle, WheelSpec};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// Level length of a slope \[m\]: its size is how high it gets on it.
const SLOPE_M: f64 = 1.0;
/// The steepest slope that is tried rises by so much on that length \[mm\]: 45 degrees.
const STEEPEST_MM: u32 = 1000;

/// Metres of whole millimetres, as short as a file can say them.
pub(super) fn size_m(size_mm: u32) -> f64 {
    f64::from(size_mm) / 1000.0
}

/// The obstacle. Each has a size in metres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Edge {
    /// A step up, of that height.
    Step,
    /// A step down, of that height.
    Drop,
    /// A half-round bar of that height, twice as wide: up and down at once.
    Bar,
    /// A slope that rises by that height on 1 m, measured level.
    Slope,
    /// A gap of that width, deeper than the largest wheel is high.
    Gap,
}

impl Edge {
    /// All of them, in the order of a chart.
    pub const ALL: [Self; 5] = [Self::Step, Self::Drop, Self::Bar, Self::Slope, Self::Gap];

    /// The name in files and tables, as `step`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Drop => "drop",
            Self::Bar => "bar",
            Self::Slope => "slope",
            Self::Gap => "gap",
        }
    }

    /// The difference between neighbouring sizes that are tried \[mm\].
    pub(super) fn grid_mm(self) -> u32 {
        match self {
            Self::Step | Self::Drop | Self::Bar => 1,
            Self::Gap => 2,
            Self::Slope => 10,
        }
    }

    /// The largest size that is tried \[mm\]: a wheel's diameter, into which a wheel falls that does not span it.
    pub(super) fn largest_mm(self, vehicle: &Vehicle) -> u32 {
        match self {
            Self::Slope => STEEPEST_MM,
            _ => (1e3 * diameter_m(vehicle)).clamp(1.0, 1000.0) as u32,
        }
    }

    /// How far it reaches along x \[m\].
    pub(super) fn length_m(self, size_m: f64) -> f64 {
        match self {
            Self::Step | Self::Drop => 0.0,
            Self::Bar => 2.0 * size_m,
            Self::Slope => SLOPE_M,
            Self::Gap => size_m,
        }
    }

    /// The ground, as a scenario has it.
    pub(super) fn terrain(self, size_m: f64, friction: f64, start_x_m: f64, vehicle: &Vehicle) -> Value {
        let (kind, keys) = match self {
            Self::Step => ("step", vec![("height_m", size_m)]),
            Self::Drop => ("step_down", vec![("height_m", size_m)]),
            Self::Bar => (
                "bumps",
                vec![
                    ("height_m", size_m),
                    ("width_m", 2.0 * size_m),
                    ("spacing_m", 1.0),
                ],
            ),
            Self::Slope => (
                "ramp",
                vec![("slope_rad", (size_m / SLOPE_M).atan()), ("length_m", SLOPE_M)],
            ),
            Self::Gap => (
                "ditch",
                vec![("width_m", size_m), ("depth_m", 1.1 * diameter_m(vehicle))],
            ),
        };
        let mut table = Table::new();
        table.insert("kind".into(), kind.into());
        if self == Self::Bar {
            table.insert("count".into(), 1.into());
        }
        let all = [("friction", friction), ("start_x_m", start_x_m)];
        for (key, value) in all.into_iter().chain(keys) {
            table.insert(key.into(), value.into());
        }
        Value::Table(table)
    }
}

fn diameter_m(vehicle: &Vehicle) -> f64 {
    let diameter = |wheel: &WheelSpec| 2.0 * wheel.radius_m;
    vehicle.wheel.iter().map(diameter).fold(0.0, f64::max)
}
