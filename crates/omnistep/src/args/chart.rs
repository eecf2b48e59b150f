//! Options of `omnistep chart`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
#[cfg(feature = "study")]
use omni_study::Edge;

#[derive(Args)]
pub(crate) struct ChartArgs {
    /// A built-in vehicle or a .toml file.
    pub(crate) vehicle: String,
    /// Coordination policy: independent, scale_torques, scale_references, shared_integral,
    /// traction_runup or traction; the best that the vehicle allows if left out.
    #[arg(long)]
    pub(crate) policy: Option<String>,
    /// Kinds of obstacle: step, drop, bar, slope or gap, several with commas.
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "EDGE",
        default_values_t = [EdgeArg::Step, EdgeArg::Drop]
    )]
    pub(crate) edge: Vec<EdgeArg>,
    /// Directions of travel in the vehicle's axes [deg], -180 to 180, several with commas: 0 is forward, 90 is left.
    /// Every 15 degrees if left out; 0 to 180 for a vehicle with equal left and right sides.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "DEG",
        allow_negative_numbers = true
    )]
    pub(crate) side: Vec<f64>,
    /// Directions of travel off the edge's normal [deg], -80 to 80, several with commas; each for every side.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "DEG",
        default_values_t = [0.0],
        allow_negative_numbers = true
    )]
    pub(crate) skew: Vec<f64>,
    /// Coulomb friction coefficient between wheels and ground, 0 to 2.
    #[arg(long, default_value_t = 0.7, allow_negative_numbers = true)]
    pub(crate) friction: f64,
    /// Commanded speed [m/s], 0.01 to 10.
    #[arg(long, default_value_t = 0.3, allow_negative_numbers = true)]
    pub(crate) speed: f64,
    /// Fraction of the limit that a plan may use, 0.1 to 1.
    #[arg(long, default_value_t = 0.8, allow_negative_numbers = true)]
    pub(crate) margin: f64,
    /// Number of starts from which each size has to be climbed, 3 to 100. They differ in the
    /// wheels' phase and in the heading.
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub(crate) starts: usize,
    /// Replaces a key of every run or, with "vehicle." in front, of the vehicle, such as
    /// physics.engine=rapier; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// The chart's TOML file; out/chart-VEHICLE-POLICY.toml if left out.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Keeps the cells of the file, and adds the missing cells.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Number of parallel runs; one for each core if left out.
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
    /// Prints only JSON: one line with an object for each cell.
    #[arg(long)]
    pub(crate) json: bool,
    /// Shows no progress bar.
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// The obstacle.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum EdgeArg {
    Step,
    Drop,
    Bar,
    Slope,
    Gap,
}

#[cfg(feature = "study")]
impl From<EdgeArg> for Edge {
    fn from(edge: EdgeArg) -> Self {
        match edge {
            EdgeArg::Step => Self::Step,
            EdgeArg::Drop => Self::Drop,
            EdgeArg::Bar => Self::Bar,
            EdgeArg::Slope => Self::Slope,
            EdgeArg::Gap => Self::Gap,
        }
    }
}
