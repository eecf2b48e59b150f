//! The command line `omnistep`, also behind the Python package's console script.
//!
//! Results go to standard output, progress and errors to standard error. Exit codes: 0 done, 1 the run failed, 2 the
//! request was wrong, 130 stopped by Ctrl-C, 143 by SIGTERM.

mod compare;
mod files;
mod logs;
mod ripple;
mod signals;
mod study;
mod wheels;

use std::ffi::OsString;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use comfy_table::{CellAlignment, Row, Table, presets};
use omni_core::Coordination;

use crate::Error;
use crate::config::{
    DerivedGains, Language, Override, Scenario, WheelModel, builtin_scenarios, builtin_studies,
    builtin_vehicles, shortened_line,
};
use crate::controller::{DEFAULT_FIRMWARE, Firmware};

/// Simulates omni-directional vehicles over steps and compares how their wheels are coordinated.
#[derive(Parser)]
#[command(name = "omnistep", version, max_term_width = 110)]
struct Cli {
    /// Without a command: compare step.
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Runs a scenario under every coordination policy, prints one table, writes one MCAP file a policy.
    Compare(RunArgs),
    /// Runs a scenario under the policy it names.
    Run {
        #[command(flatten)]
        args: RunArgs,
        /// Coordination policy instead of the scenario's: independent, paper, synchronised or load_sharing.
        #[arg(long)]
        policy: Option<String>,
        /// Where the controller runs: on this machine, or as firmware in an emulated Cortex-M4F (QEMU), in lock-step
        /// with the physics. The latter computes in f32: as with --set control.precision=f32.
        #[arg(long, value_enum, default_value_t = Place::Host)]
        controller: Place,
        /// Serves the run on 127.0.0.1 while it goes on, in Foxglove's WebSocket protocol, for Foxglove and Lichtblick; writes no
        /// log. Only programs of this machine and known viewers may connect.
        #[cfg(feature = "live")]
        #[arg(long, conflicts_with_all = ["controller", "out"])]
        live: bool,
        /// Port of --live; 0 for any that is free.
        #[cfg(feature = "live")]
        #[arg(long, default_value_t = 8765, requires = "live")]
        port: u16,
        /// Simulated seconds a second of --live; inf for as fast as it goes.
        #[cfg(feature = "live")]
        #[arg(long, default_value_t = 1.0, requires = "live")]
        speed: f64,
        /// Starts --live when the first client subscribes to something.
        #[cfg(feature = "live")]
        #[arg(long, requires = "live")]
        wait: bool,
        /// Clients of --live may change command, policy and torque limit. A command holds for 0.5 s after the last message, and
        /// ends with its client: the vehicle is then told to rest.
        #[cfg(feature = "live")]
        #[arg(long, requires = "live")]
        steer: bool,
        /// Lets web pages of another origin connect to --live, as https://viewer.example; repeat for more. Foxglove's, Lichtblick's
        /// and those of this machine always may.
        #[cfg(feature = "live")]
        #[arg(long = "allow-origin", value_name = "ORIGIN", requires = "live")]
        origins: Vec<String>,
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
        /// Shows what another policy would have commanded: independent, paper, synchronised or load_sharing.
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
    /// Makes a film or pictures of a logged run; part of the Python package with its extra "view".
    Film(PythonArgs),
    /// Draws a logged run from the side; part of the Python package with its extra "plot".
    Strip(PythonArgs),
    /// Makes one page of logged runs that any browser opens; part of the Python package with its extra "view".
    Report(PythonArgs),
    /// Checks a vehicle, scenario, experiment or study file without running it, and says what it describes.
    Check {
        /// The files.
        #[arg(required = true)]
        files: Vec<String>,
    },
    /// Writes a commented file to start from: omnistep new vehicle my_robot makes my_robot.toml.
    New {
        /// What the file describes.
        kind: NewKind,
        /// Its name: letters, digits, _ or -.
        name: String,
        /// The built-in one to start from; chugo7, step or climb_map if left out.
        #[arg(long)]
        like: Option<String>,
    },
    /// Prints the JSON Schema of a kind of file, for completion in editors:
    /// omnistep schema vehicle > vehicle.schema.json, and "#:schema ./vehicle.schema.json" as the file's first line.
    Schema {
        /// What the files describe.
        kind: FileKindArg,
    },
    /// Lists the built-in scenarios, vehicles, policies and studies.
    List,
}

#[derive(Clone, Copy, ValueEnum)]
enum FileKindArg {
    Vehicle,
    Scenario,
    Experiment,
    Study,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum ConstantsLanguage {
    Rust,
    C,
}

#[derive(Clone, Copy, ValueEnum)]
enum NewKind {
    Vehicle,
    Scenario,
    Study,
}

/// Where the controller of a run is.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Place {
    Host,
    Qemu,
}

#[derive(Args)]
struct RunArgs {
    /// A built-in scenario or a .toml file.
    #[arg(default_value = "step")]
    scenario: String,
    /// Replaces a key of the scenario or, behind "vehicle.", of its vehicle: terrain.friction=0.5,
    /// vehicle.motor.stall_torque_n_m=1; repeat for more.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Seed of the scenario's perturbation, 0 to 9223372036854775807.
    #[arg(long, value_name = "SEED", allow_negative_numbers = true)]
    seed: Option<String>,
    /// Ends a run as soon as every wheel stands beyond the obstacle; as --set stop_when_done=true.
    #[arg(long)]
    stop_when_done: bool,
    /// Folder for the MCAP files; made if missing.
    #[arg(long, default_value = "out")]
    out: PathBuf,
    /// Prints one JSON object a policy a line and nothing else.
    #[arg(long)]
    json: bool,
    /// Shows no progress bar.
    #[arg(long)]
    quiet: bool,
}

/// Whatever follows a subcommand that is not here.
#[derive(Args)]
struct PythonArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _rest: Vec<OsString>,
}

#[derive(Args)]
struct StudyArgs {
    /// A built-in study or a .toml file.
    #[arg(default_value = "climb_map")]
    study: String,
    /// Replaces a key of the scenario in every run, as duration_s=4 or vehicle=omni3; repeat for more.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Seeds 0 to N - 1 instead of the study's, 1 to 100000.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seeds: Option<String>,
    /// Ends each run as soon as every wheel stands beyond the obstacle; as --set stop_when_done=true.
    #[arg(long)]
    stop_when_done: bool,
    /// Folder for the results; out/NAME if left out. Runs whose results are there are not run again.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Runs at a time; as many as there are cores if left out.
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Runs those again that failed before.
    #[arg(long)]
    retry_errors: bool,
    /// Prints one JSON object a cell of the map a line and nothing else.
    #[arg(long)]
    json: bool,
    /// Shows no progress bar.
    #[arg(long)]
    quiet: bool,
}

impl RunArgs {
    fn overrides(&self) -> Result<Vec<Override>, Error> {
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
fn whole(
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

fn parse_overrides(texts: &[String]) -> Result<Vec<Override>, Error> {
    texts.iter().map(|text| Ok(Override::parse(text)?)).collect()
}

/// Runs the command line `args` (the program's name first) and returns the exit code.
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    signals::survive_full_quota();
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too, with exit code 0. A closed pipe is no reason to fail.
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    let mut out = std::io::stdout().lock();
    match run(cli, &mut out) {
        Ok(code) => code,
        Err(error @ (Error::Interrupted { .. } | Error::RunInterrupted { .. })) => {
            say(&format!("stopped: {error}"));
            signals::exit_code()
        }
        Err(error) => say_error(&error),
    }
}

/// A line on standard error, no longer than somebody reads it: every one goes through here.
fn say(line: &str) {
    // Nobody listening is no reason to fail.
    let _ = writeln!(std::io::stderr(), "{}", shortened_line(line));
}

/// Says what went wrong, in one line; the exit code.
fn say_error(error: &Error) -> u8 {
    say(&format!("error: {error}"));
    if error.is_bad_input() { 2 } else { 1 }
}

/// Does the same with each file, also behind one that is bad: what is wrong with it is said as it comes. The exit code of the worst.
fn each<T>(files: &[T], mut look: impl FnMut(&T) -> Result<(), Error>) -> u8 {
    let code = |file| look(file).map_or_else(|error| say_error(&error), |()| 0);
    files.iter().map(code).max().unwrap_or(0)
}

/// What is doubtful but no error, in one line on standard error.
fn warn(text: &str) {
    say(&format!("warning: {text}"));
}

/// Warns of a scenario that ends before its vehicle can be across, and of encoders of which one count is more than the motor has.
fn warn_of(scenario: &Scenario) {
    for text in scenario.too_short().into_iter().chain(coarse(scenario)) {
        warn(&format!("{}: {text}", scenario.name));
    }
}

/// Why a scenario's encoders are too coarse, where they are.
fn coarse(scenario: &Scenario) -> Option<String> {
    scenario.coarse_encoder().ok().flatten()
}

/// What is said of a scenario before it is run: gains that its vehicle got, and all that is doubtful.
fn announce(scenario: &Scenario) {
    announce_gains(
        &scenario.vehicle().name,
        scenario.period_s(),
        scenario.derived_gains(),
    );
    announce_beyond_balls(scenario);
    warn_of(scenario);
}

/// The error that a scenario's file gave, as the answer to a subcommand.
fn to_command(name: &'static str) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::Config(error) => Error::Config(error.to_command(name)),
        other => other,
    }
}

/// The exit code.
fn run(cli: Cli, out: &mut dyn Write) -> Result<u8, Error> {
    let default = || {
        Command::Compare(RunArgs {
            scenario: "step".into(),
            overrides: Vec::new(),
            seed: None,
            stop_when_done: false,
            out: "out".into(),
            json: false,
            quiet: false,
        })
    };
    let done = match cli.command.unwrap_or_else(default) {
        Command::Inspect { logs, json } => return logs::inspect(&logs, json, out),
        Command::Check { files } => return Ok(each(&files, |file| files::check(file, out))),
        Command::Compare(args) => {
            let policies = Coordination::<f64>::PRESETS.map(Some);
            compare::compare(&args, &policies, None, out).map_err(to_command("compare"))
        }
        Command::Run {
            args,
            policy,
            controller,
            firmware,
            #[cfg(feature = "live")]
            live,
            #[cfg(feature = "live")]
            port,
            #[cfg(feature = "live")]
            speed,
            #[cfg(feature = "live")]
            wait,
            #[cfg(feature = "live")]
            steer,
            #[cfg(feature = "live")]
            origins,
        } => {
            #[cfg(feature = "live")]
            if live {
                let live = crate::Live {
                    port,
                    speed,
                    wait,
                    steer,
                    origins,
                };
                return compare::live(&args, policy.as_deref(), &live, out).map(|()| 0);
            }
            let firmware = (controller == Place::Qemu).then(|| Firmware::new(firmware));
            compare::compare(&args, &[policy.as_deref()], firmware.as_ref(), out)
        }
        Command::Wheels {
            experiment,
            overrides,
            json,
        } => wheels::wheels(&experiment, &overrides, json, out),
        Command::Study(args) => study::study(&args, out),
        Command::Constants {
            scenario,
            overrides,
            language,
        } => {
            let language = match language {
                ConstantsLanguage::Rust => Language::Rust,
                ConstantsLanguage::C => Language::C,
            };
            let scenario = Scenario::load(&scenario, &parse_overrides(&overrides)?)
                .map_err(|error| error.to_command("constants"))?;
            announce_gains(
                &scenario.vehicle().name,
                scenario.period_s(),
                scenario.derived_gains(),
            );
            print(out, &scenario.constants(language)?)
        }
        Command::Ripple {
            vehicle,
            overrides,
            json,
        } => ripple::ripple(&vehicle, &overrides, json, out),
        Command::Replay {
            log,
            policy,
            overrides,
        } => logs::replayed(&log, policy.as_deref(), &overrides, out),
        Command::Urdf { vehicle, overrides } => logs::urdf(&vehicle, &overrides, out),
        Command::Film(_) => Err(in_python("film")),
        Command::Strip(_) => Err(in_python("strip")),
        Command::Report(_) => Err(in_python("report")),
        Command::New { kind, name, like } => files::new(kind, &name, like.as_deref(), out),
        Command::Schema { kind } => files::schema(kind, out),
        Command::List => {
            let lists = [
                ("scenarios:  ", builtin_scenarios()),
                ("vehicles:   ", builtin_vehicles()),
                ("policies:   ", Coordination::<f64>::PRESETS.to_vec()),
                ("studies:    ", builtin_studies()),
                ("experiments:", vec!["wheels (run by `omnistep wheels`)"]),
            ];
            for (kind, names) in lists {
                print(out, &format!("{kind} {}\n", names.join(", ")))?;
            }
            Ok(())
        }
    };
    done.map(|()| 0)
}

/// A subcommand that the Python package's `omnistep` has and this program has not.
fn in_python(command: &'static str) -> Error {
    Error::Elsewhere {
        command,
        how: "in the repository pip install \".[view]\", then the same command with its omnistep",
    }
}

/// Says on standard error which gains a vehicle got whose file gives none.
fn announce_gains(vehicle: &str, period_s: f64, derived: Option<&DerivedGains>) {
    if let Some(derived) = derived {
        let period_ms = 1e3 * period_s;
        say(&format!(
            "{vehicle}: no [gains]; derived for a control period of {period_ms} ms: {derived}"
        ));
    }
}

/// Why balls are not the wheels of a scenario, and what is; nothing where they are.
fn beyond_balls(scenario: &Scenario) -> Option<String> {
    let beyond = scenario.beyond_balls()?;
    let vehicle = scenario.vehicle();
    let wheels = 0..vehicle.wheel.len();
    let instead = if wheels
        .clone()
        .all(|i| vehicle.rollers(i, WheelModel::Rollers).is_some())
    {
        "--set physics.wheel_model=rollers simulates them"
    } else {
        "the vehicle's file has no [rollers] that would be"
    };
    let (name, ground) = (&vehicle.name, scenario.terrain.described());
    Some(format!(
        "{name} {ground}: balls do not stand for its wheels here: {beyond}; {instead}"
    ))
}

/// Says that on standard error.
fn announce_beyond_balls(scenario: &Scenario) {
    if let Some(why) = beyond_balls(scenario) {
        warn(&why);
    }
}

/// What the mark of [`marked`] means.
const BEYOND_BALLS: &str =
    "* on balls that do not stand for its wheels there (docs/physics.md, Where a ball is the wheel)";

/// What a run amounts to, with a mark where its balls do not stand for its wheels.
fn marked(text: String, wheel_model_valid: bool) -> String {
    if wheel_model_valid { text } else { text + " *" }
}

/// A table with `left` columns of words, the others numbers, flush right.
fn aligned<H: Into<Row>, R: Into<Row>>(headings: H, rows: impl IntoIterator<Item = R>, left: usize) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(headings);
    table.add_rows(rows);
    for column in table.column_iter_mut().skip(left) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Writes to standard output; a reader that has gone away is no error of ours.
fn print(out: &mut dyn Write, text: &str) -> Result<(), Error> {
    print_bytes(out, text.as_bytes())
}

/// A file's name as the system has it, also where it is no UTF-8, on a line of its own.
fn print_path(out: &mut dyn Write, path: &Path) -> Result<(), Error> {
    print_bytes(out, &[path.as_os_str().as_encoded_bytes(), b"\n"].concat())
}

fn print_bytes(out: &mut dyn Write, bytes: &[u8]) -> Result<(), Error> {
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::Io {
            path: "standard output".into(),
            source,
        }),
        _ => Ok(()),
    }
}
