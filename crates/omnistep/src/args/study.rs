//! Options of `omnistep study`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

#[derive(Args)]
pub(crate) struct StudyArgs {
    /// A built-in study or a .toml file.
    #[arg(default_value = "climb_map")]
    pub(crate) study: String,
    /// Replaces a key of the scenario in every run, such as duration_s=4 or vehicle=omni3; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Number of seeds instead of the study's, 1 to 100000: seeds 0 to N - 1.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(crate) seeds: Option<String>,
    /// Ends each run as soon as every wheel stands beyond the obstacle, like --set stop_when_done=true.
    #[arg(long)]
    pub(crate) stop_when_done: bool,
    /// Folder for the results; out/NAME if left out. Runs whose results it holds are not repeated.
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Number of parallel runs; one for each core if left out.
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
    /// Compares, seed by seed, with the runs that have this value of an axis, such as control.policy=independent.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) baseline: Option<String>,
    /// Repeats the runs that failed before.
    #[arg(long)]
    pub(crate) retry_errors: bool,
    /// Prints only JSON: one line with an object for each cell of the map.
    #[arg(long)]
    pub(crate) json: bool,
    /// Shows no progress bar.
    #[arg(long)]
    pub(crate) quiet: bool,
}
