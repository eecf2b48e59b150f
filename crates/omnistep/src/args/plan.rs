//! Options of `omnistep plan`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Usual cells of a scenario's ground \[m\].
pub(crate) const RESOLUTION_M: f64 = 0.05;

/// How far around start and goal it is looked at \[m\].
pub(crate) const AROUND_M: f64 = 3.0;

#[derive(Args)]
pub(crate) struct PlanArgs {
    /// A built-in scenario or a .toml file: its vehicle, its ground and its start pose.
    pub(crate) scenario: String,
    /// Goal in the world: x and y [m], and optionally the final heading [deg].
    #[arg(
        long,
        value_name = "X,Y[,DEG]",
        value_delimiter = ',',
        allow_negative_numbers = true,
        required = true
    )]
    pub(crate) to: Vec<f64>,
    /// The vehicle's climbing limits, a file of omnistep chart; out/chart-VEHICLE-POLICY.toml if left out.
    #[arg(long, value_name = "FILE")]
    pub(crate) chart: Option<PathBuf>,
    /// A map_server map, a .yaml file, instead of the scenario's ground.
    #[arg(long, value_name = "FILE")]
    pub(crate) map: Option<PathBuf>,
    /// Heights of --map: a grey PNG or PGM of the same size.
    #[arg(long, value_name = "FILE", requires = "map")]
    pub(crate) elevation: Option<PathBuf>,
    /// Heights of the elevation's black and white [m], each within 10 km.
    #[arg(
        long,
        value_name = "BLACK,WHITE",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        default_value = "0,1",
        requires = "elevation"
    )]
    pub(crate) elevation_range: Vec<f64>,
    /// Rectangle that the vehicle does not enter, in the world [m]; may be repeated.
    #[arg(long, value_name = "X,X,Y,Y", allow_hyphen_values = true, value_parser = rectangle)]
    pub(crate) keep_out: Vec<[f64; 4]>,
    /// Also writes costmaps for Nav2 into a folder: one, one per heading of 16, and a speed mask.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) costmaps: Option<PathBuf>,
    /// Quantity to minimise: time, energy or risk.
    #[arg(long, value_enum, default_value_t = CostArg::Time)]
    pub(crate) cost: CostArg,
    /// Fraction of the chart's limits that the plan may use, 0.1 to 1.
    #[arg(long, default_value_t = 0.8, allow_negative_numbers = true)]
    pub(crate) margin: f64,
    /// Distance that the vehicle keeps from walls and from edges that it does not cross [m], 0 to 1.
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    pub(crate) clearance: f64,
    /// Cells of the scenario's ground [m], 0.001 to 10.
    #[arg(long, default_value_t = RESOLUTION_M, allow_negative_numbers = true)]
    pub(crate) resolution: f64,
    /// Distance around start and goal to which the scenario's ground is read [m], 1 to 100.
    #[arg(long, default_value_t = AROUND_M, allow_negative_numbers = true)]
    pub(crate) around: f64,
    /// Replaces a key of the scenario or, with "vehicle." in front, of its vehicle; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Writes the route: .json, .csv (its points), or .toml, the scenario with the route as its path.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Prints only JSON: the route in one line.
    #[arg(long)]
    pub(crate) json: bool,
}

/// x from and to, y from and to.
fn rectangle(text: &str) -> Result<[f64; 4], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let four = numbers
        .ok()
        .and_then(|numbers| <[f64; 4]>::try_from(numbers).ok());
    four.ok_or_else(|| "four numbers: x from and to, y from and to [m]".to_owned())
}

/// The quantity that a route minimises.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum CostArg {
    Time,
    Energy,
    Risk,
}
