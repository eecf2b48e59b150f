//! What the command line takes.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use omni_config::Override;
use omni_sim::controller::DEFAULT_FIRMWARE;

use crate::Error;
use crate::list::Listed;

/// Simulates omni-directional vehicles over steps and compares how their wheels are coordinated.
#[derive(Parser)]
#[command(name = "omnistep", version, max_term_width = 110)]
pub(crate) struct Cli {
    /// Without a command: compare step.
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Runs a scenario under every coordination policy, prints one table, writes one MCAP file a policy.
    Compare {
        #[command(flatten)]
        args: RunArgs,
        /// Runs each policy with every physics engine, side by side.
        #[arg(long)]
        engines: bool,
    },
    /// Runs a scenario under the policy it names.
    Run {
        #[command(flatten)]
        args: RunArgs,
        /// Coordination policy instead of the scenario's: independent, paper, synchronised, load_sharing, reach or steady.
        #[arg(long)]
        policy: Option<String>,
        /// Where the controller runs: on this machine, or as firmware in an emulated Cortex-M4F (QEMU), in lock-step
        /// with the physics. The latter computes in f32: as with --set control.precision=f32.
        #[arg(long, value_enum, default_value_t = Place::Host)]
        controller: Place,
        #[command(flatten)]
        live: LiveArgs,
        /// Firmware image for --controller qemu.
        #[arg(long, value_name = "FILE", default_value = DEFAULT_FIRMWARE)]
        firmware: PathBuf,
    },
    /// Runs section 3.3 of the paper: three motors on dampers under three policies.
    Wheels {
        /// The built-in experiment or a .toml file.
        #[arg(default_value = "wheels")]
        experiment: String,
        /// Replaces a key of the experiment, as friction_n_m_s_rad=2e-4; repeat for more.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Prints one JSON object a policy a line and nothing else.
        #[arg(long)]
        json: bool,
    },
    /// Runs a grid of scenarios with many seeds on all cores, writes one row a run as Parquet, prints a map. Started again,
    /// it goes on where it was stopped.
    Study(StudyArgs),
    /// Prints a scenario's controller as constants for firmware: Rust to include, or a C header.
    Constants {
        /// A built-in scenario or a .toml file: its vehicle, policy and control period.
        #[arg(default_value = "step")]
        scenario: String,
        /// Replaces a key, as policy: control.policy=paper, vehicle.gains.kp_n_m_s_rad=0.5; repeat for more.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Language of the constants.
        #[arg(long, value_enum, default_value = "rust")]
        language: ConstantsLanguage,
    },
    /// Prints how round a vehicle's wheels of rollers are: the height of the axle over a turn, the rolling radius.
    Ripple {
        /// A built-in vehicle or a .toml file.
        #[arg(default_value = "chugo7")]
        vehicle: String,
        /// Replaces a key of the vehicle, as rollers.count=8, rollers.crown_m=0; repeat for more.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Prints one JSON object a wheel a line and nothing else.
        #[arg(long)]
        json: bool,
    },
    /// Prints what a step takes at least, from the balance of forces, without a run: torque and run-up of each row of wheels,
    /// and whether the scenario has them.
    Bound {
        /// A built-in scenario or a .toml file, with a step; or a vehicle, on the built-in step.
        #[arg(default_value = "step")]
        scenario: String,
        /// Replaces a key, as terrain.height_m=0.04, vehicle.motor.stall_torque_n_m=1; repeat for more.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Prints one JSON object a row of wheels a line and nothing else.
        #[arg(long)]
        json: bool,
    },
    /// Reads logs from start to end, checks every checksum, prints what they hold and their runs' figures.
    Inspect {
        /// MCAP files, finished or not.
        #[arg(required = true)]
        logs: Vec<PathBuf>,
        /// Prints one JSON object a log a line and nothing else.
        #[arg(long)]
        json: bool,
    },
    /// Feeds a log's measurements to its controller again and shows the first difference: none, bit for bit, unless keys or the
    /// program changed.
    Replay {
        /// An MCAP file.
        log: PathBuf,
        /// Shows what another policy would have commanded: independent, paper, synchronised, load_sharing, reach or steady.
        #[arg(long)]
        policy: Option<String>,
        /// Replaces a key of the logged scenario, as vehicle.gains.kp_n_m_s_rad=0.5; repeat for more.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
    },
    /// Prints a vehicle as URDF, for viewers and other simulators.
    Urdf {
        /// A built-in vehicle or a .toml file.
        #[arg(default_value = "chugo7")]
        vehicle: String,
        /// Replaces a key of the vehicle; repeat for more.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
    },
    /// Makes a log of what was measured on a vehicle, from CSV, Parquet or rosbag2; part of the Python package with its extra
    /// "import".
    Import(PythonArgs),
    /// Drives the simulation with the commands or torques of a log and compares the two; part of the Python package with its
    /// extra "view".
    Resimulate(PythonArgs),
    /// Makes a film or pictures of a logged run; part of the Python package with its extra "view".
    Film(PythonArgs),
    /// Draws a logged run from the side; part of the Python package with its extra "plot".
    Strip(PythonArgs),
    /// Makes one page of logged runs that any browser opens; part of the Python package with its extra "view".
    Report(PythonArgs),
    /// Finds masses, friction, delay and lag from logs, with intervals; part of the Python package with its extra "identify".
    Identify(PythonArgs),
    /// Finds wheel radii, places and directions from runs whose ends were measured; part of the Python package with its extra
    /// "identify".
    Calibrate(PythonArgs),
    /// Checks a vehicle, scenario, experiment or study file without running it, and says what it describes.
    Check {
        /// Files, or names of what is built in.
        #[arg(required = true)]
        files: Vec<String>,
        /// Warns of motors that are too weak for a step of this height.
        #[arg(long, value_name = "HEIGHT_M")]
        step: Option<f64>,
        /// Ends with exit code 1 where anything was warned of.
        #[arg(long)]
        strict: bool,
    },
    /// Writes a commented file to start from: omnistep new vehicle my_robot makes my_robot.toml. A manoeuvre is a scenario whose log
    /// `omnistep identify` makes the most of; a map says which columns of a real log are which signals, for `omnistep import`.
    New {
        /// What the file describes.
        kind: NewKind,
        /// Its name: letters, digits, _ or -.
        name: String,
        /// The built-in one to start from; chugo7, step or climb_map if left out.
        #[arg(long)]
        like: Option<String>,
        /// Of a manoeuvre or a map: a built-in vehicle or a .toml file; chugo7 if left out.
        #[arg(long, conflicts_with = "like")]
        vehicle: Option<String>,
    },
    /// Prints the JSON Schema of a kind of file, for completion in editors:
    /// omnistep schema vehicle > vehicle.schema.json, and "#:schema ./vehicle.schema.json" as the file's first line.
    Schema {
        /// What the files describe.
        kind: FileKindArg,
    },
    /// Lists the built-in scenarios, vehicles, policies and studies; of one kind with a line on each.
    List {
        /// One kind of them, with a line on each.
        kind: Option<Listed>,
    },
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum FileKindArg {
    Vehicle,
    Scenario,
    Experiment,
    Study,
}

#[derive(Clone, Copy, clap::ValueEnum)]
pub(crate) enum ConstantsLanguage {
    Rust,
    C,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum NewKind {
    Vehicle,
    Scenario,
    Study,
    Manoeuvre,
    Map,
}

/// Where the controller of a run is.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Place {
    Host,
    Qemu,
}

#[derive(Args)]
pub(crate) struct RunArgs {
    /// A built-in scenario or a .toml file.
    #[arg(default_value = "step")]
    pub(crate) scenario: String,
    /// Replaces a key of the scenario or, behind "vehicle.", of its vehicle: terrain.friction=0.5,
    /// vehicle.motor.stall_torque_n_m=1; repeat for more.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Seed of the scenario's perturbation, 0 to 9223372036854775807.
    #[arg(long, value_name = "SEED", allow_negative_numbers = true)]
    pub(crate) seed: Option<String>,
    /// Ends a run as soon as every wheel stands beyond the obstacle; as --set stop_when_done=true.
    #[arg(long)]
    pub(crate) stop_when_done: bool,
    /// Folder for the MCAP files; made if missing.
    #[arg(long, default_value = "out")]
    pub(crate) out: PathBuf,
    /// Prints one JSON object a policy a line and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
    /// Shows no progress bar.
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// What a live run takes.
#[derive(Args)]
pub(crate) struct LiveArgs {
    /// Serves the run on 127.0.0.1 while it goes on, in Foxglove's WebSocket protocol, for Foxglove and Lichtblick; writes no
    /// log. Only programs of this machine and known viewers may connect.
    #[arg(long, conflicts_with_all = ["controller", "out"])]
    pub(crate) live: bool,
    /// Port of --live; 0 for any that is free.
    #[arg(long, default_value_t = 8765, requires = "live")]
    pub(crate) port: u16,
    /// Simulated seconds a second of --live; inf for as fast as it goes.
    #[arg(long, default_value_t = 1.0, requires = "live")]
    pub(crate) speed: f64,
    /// Starts --live when the first client subscribes to something.
    #[arg(long, requires = "live")]
    pub(crate) wait: bool,
    /// Clients of --live may change command, policy and torque limit. A command holds for 0.5 s after the last message, and
    /// ends with its client: the vehicle is then told to rest.
    #[arg(long, requires = "live")]
    pub(crate) steer: bool,
    /// Lets web pages of another origin connect to --live, as https://viewer.example; repeat for more. Foxglove's, Lichtblick's
    /// and those of this machine always may.
    #[arg(long = "allow-origin", value_name = "ORIGIN", requires = "live")]
    pub(crate) origins: Vec<String>,
}

/// Whatever follows a subcommand that is not here.
#[derive(Args)]
pub(crate) struct PythonArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub(crate) _rest: Vec<OsString>,
}

#[derive(Args)]
pub(crate) struct StudyArgs {
    /// A built-in study or a .toml file.
    #[arg(default_value = "climb_map")]
    pub(crate) study: String,
    /// Replaces a key of the scenario in every run, as duration_s=4 or vehicle=omni3; repeat for more.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Seeds 0 to N - 1 instead of the study's, 1 to 100000.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(crate) seeds: Option<String>,
    /// Ends each run as soon as every wheel stands beyond the obstacle; as --set stop_when_done=true.
    #[arg(long)]
    pub(crate) stop_when_done: bool,
    /// Folder for the results; out/NAME if left out. Runs whose results are there are not run again.
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Runs at a time; as many as there are cores if left out.
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
    /// Compares with the runs that have this value of an axis, seed by seed: control.policy=independent.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) against: Option<String>,
    /// Runs those again that failed before.
    #[arg(long)]
    pub(crate) retry_errors: bool,
    /// Prints one JSON object a cell of the map a line and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
    /// Shows no progress bar.
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl RunArgs {
    pub(crate) fn overrides(&self) -> Result<Vec<Override>, Error> {
        let mut all = parse_overrides(&self.overrides)?;
        if let Some(seed) = &self.seed {
            const ALLOWED: &str = "a whole number, 0 to 9223372036854775807";
            all.push(Override::new(
                "seed",
                whole("--seed", seed, 0..=i64::MAX, ALLOWED)?,
            ));
        }
        if self.stop_when_done {
            all.push(Override::new("stop_when_done", true));
        }
        Ok(all)
    }
}

/// A whole number out of a range.
pub(crate) fn whole(
    name: &'static str,
    text: &str,
    range: std::ops::RangeInclusive<i64>,
    allowed: &'static str,
) -> Result<i64, Error> {
    let found = text.parse().ok().filter(|number| range.contains(number));
    found.ok_or_else(|| Error::Argument {
        name,
        value: text.into(),
        allowed,
    })
}

pub(crate) fn parse_overrides(texts: &[String]) -> Result<Vec<Override>, Error> {
    texts.iter().map(|text| Ok(Override::parse(text)?)).collect()
}
