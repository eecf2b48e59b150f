//! The arguments of the command line.

mod chart;
mod command_interface;
mod drive;
mod export;
mod plan;
mod study;
mod tf_choice;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use omni_config::Override;
use omni_sim::controller::DEFAULT_FIRMWARE;

use crate::Error;
use crate::list::Listed;
pub(crate) use chart::ChartArgs;
pub(crate) use command_interface::CommandInterface;
pub(crate) use drive::DriveArgs;
pub(crate) use export::{ExportArgs, Format};
#[cfg(feature = "plan")]
pub(crate) use plan::CostArg;
pub(crate) use plan::PlanArgs;
#[cfg(feature = "ros2")]
pub(crate) use plan::{AROUND_M, RESOLUTION_M};
pub(crate) use study::StudyArgs;
pub(crate) use tf_choice::TfChoice;

/// Simulates omni-directional vehicles over steps and compares their control policies.
#[derive(Parser)]
#[command(name = "omnistep", version, max_term_width = 110, after_help = BEGIN)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

/// Below the list of commands: those to begin with.
const BEGIN: &str = "Start here:
  omnistep compare step                       six control policies over a step, one table
  omnistep run flat --vehicle mecanum4        another vehicle; omnistep list names all
  omnistep new vehicle my_robot               a file to describe your own vehicle in
  omnistep compare --help                     the options of a command";

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Runs a scenario under every control policy and prints one table.
    ///
    /// Writes one MCAP log for each policy.
    Compare {
        #[command(flatten)]
        args: RunArgs,
        /// Runs each policy with every physics engine, side by side.
        #[arg(long)]
        engines: bool,
    },
    /// Runs a scenario, prints its metrics and writes its log.
    ///
    /// With --live or --ros2 the run keeps pace with the clock, for viewers and for ROS 2.
    Run {
        #[command(flatten)]
        args: RunArgs,
        /// Coordination policy instead of the scenario's: independent, scale_torques,
        /// scale_references, shared_integral, traction_runup or traction.
        #[arg(long)]
        policy: Option<String>,
        /// Host of the controller: this machine, or firmware in an emulated Cortex-M4F (QEMU), in lock-step with the
        /// physics. The firmware computes in f32, like --set control.precision=f32.
        #[arg(long, value_enum, default_value_t = Place::Host)]
        controller: Place,
        #[command(flatten)]
        live: LiveArgs,
        /// Firmware image for --controller qemu.
        #[arg(long, value_name = "FILE", default_value = DEFAULT_FIRMWARE)]
        firmware: PathBuf,
    },
    /// Lets you drive a vehicle by hand, with the arrow keys or in the browser.
    ///
    /// Ctrl-C ends the run and prints its table.
    Drive(DriveArgs),
    /// Simulates a bench test, three motors on dampers, under three policies.
    ///
    /// Reproduces section 3.3 of the paper.
    MotorBench {
        /// The built-in experiment or a .toml file.
        #[arg(default_value = "motor_bench")]
        experiment: String,
        /// Replaces a key of the experiment, such as friction_n_m_s_rad=2e-4; may be repeated.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Prints only JSON: one line with an object for each policy.
        #[arg(long)]
        json: bool,
    },
    /// Runs a grid of scenarios with many seeds on all cores.
    ///
    /// Writes one Parquet row for each run and prints a map. The same command resumes a study that was stopped.
    Study(StudyArgs),
    /// Finds the largest edges that a vehicle climbs, by direction of travel.
    ///
    /// Sizes increase until one is not climbed, each from several starts. Writes a TOML file that --resume continues,
    /// and prints a table.
    Chart(ChartArgs),
    /// Plans a route over edges that the vehicle climbs only from some sides.
    ///
    /// Reads the vehicle's climbing limits from a chart, and prints the edges that the route crosses.
    Plan(PlanArgs),
    /// Prints the ripple of roller wheels: axle height and rolling radius.
    WheelRipple {
        /// A built-in vehicle or a .toml file.
        #[arg(default_value = "chugo7")]
        vehicle: String,
        /// Replaces a key of the vehicle, such as rollers.count=8 or rollers.crown_m=0; may be repeated.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Prints only JSON: one line with an object for each wheel.
        #[arg(long)]
        json: bool,
    },
    /// Prints the minimum torque and run-up for a step, without simulation.
    ///
    /// The limits come from the balance of forces, for each row of wheels. Verdict `torque`: the
    /// motors' torque suffices at any speed; `run_up`: the row needs the run-up in the last column; `open`: the row may
    /// need it; `impossible`: the run-up is too small.
    ClimbLimits {
        /// A built-in scenario or a .toml file, with a step; or a vehicle, on the built-in step.
        #[arg(default_value = "step")]
        scenario: String,
        /// A vehicle instead of the scenario's: a built-in one or a .toml file; short for --set vehicle=VEHICLE.
        #[arg(long)]
        vehicle: Option<String>,
        /// Replaces a key, such as terrain.height_m=0.04 or vehicle.motor.stall_torque_n_m=1; may be repeated.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Prints only JSON: one line with an object for each row of wheels.
        #[arg(long)]
        json: bool,
    },
    /// Reads logs, checks every checksum, prints their topics and metrics.
    Info {
        /// MCAP files, finished or not.
        #[arg(required = true)]
        logs: Vec<PathBuf>,
        /// Prints only JSON: one line with an object for each log.
        #[arg(long)]
        json: bool,
        /// Explains each metric below the table.
        #[arg(long, conflicts_with = "json")]
        explain: bool,
    },
    /// Replays a log through its controller.
    ///
    /// Prints the first difference. The torques are bit-identical unless keys or the program changed.
    Replay {
        /// An MCAP file.
        log: PathBuf,
        /// Prints what another policy would have commanded: independent, scale_torques,
        /// scale_references, shared_integral, traction_runup or traction.
        #[arg(long)]
        policy: Option<String>,
        /// Replaces a key of the logged scenario, such as vehicle.gains.kp_n_m_s_rad=0.5; may be repeated.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
    },
    /// Writes a vehicle or a scenario for MuJoCo, URDF, ros2_control or firmware.
    ///
    /// NAME is a vehicle; with --format mjcf, rust and c also a scenario, and a vehicle alone
    /// stands on the ground of the scenario flat.
    Export(ExportArgs),
    /// Converts measurements to a log: CSV, Parquet, rosbag2 [Python].
    ///
    /// Part of the Python package with its extra "import".
    Import(PythonArgs),
    /// Drives the simulation with the commands or torques of a log [Python].
    ///
    /// Compares simulation and log. Part of the Python package with its extra "plot".
    Resimulate(PythonArgs),
    /// Makes a video or pictures of a logged run [Python].
    ///
    /// Part of the Python package with its extra "view".
    Video(PythonArgs),
    /// Draws a logged run from the side [Python].
    ///
    /// Part of the Python package with its extra "plot".
    Plot(PythonArgs),
    /// Makes one HTML page of logged runs, with a player and plots [Python].
    ///
    /// Part of the Python package with its extra "view".
    Report(PythonArgs),
    /// Estimates masses, friction, delay, lag from logs, with intervals [Python].
    ///
    /// Part of the Python package with its extra "identify".
    Identify(PythonArgs),
    /// Estimates wheel radii, positions, directions from measured runs [Python].
    ///
    /// The final position of each run has to be measured. Part of the Python package with its extra "identify".
    Calibrate(PythonArgs),
    /// Checks vehicle, scenario, experiment or study files and describes them.
    Check {
        /// Files, or names of built-in scenarios, vehicles, studies and experiments.
        #[arg(required = true)]
        files: Vec<String>,
        /// Warns if the motors are too weak for a step of this height.
        #[arg(long, value_name = "HEIGHT_M")]
        step: Option<f64>,
        /// With --step: states the sides from which the vehicle climbs it, by this chart of omnistep chart.
        #[arg(long, value_name = "FILE", requires = "step")]
        chart: Option<PathBuf>,
        /// Replaces a key of each file, such as control.policy=traction; may be repeated.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        overrides: Vec<String>,
        /// Exits with code 1 if there is any warning.
        #[arg(long)]
        strict: bool,
    },
    /// Writes a commented file to start from: a vehicle, a scenario, a study.
    ///
    /// `omnistep new vehicle my_robot` makes my_robot.toml. An excitation is a scenario that excites every quantity
    /// that `omnistep identify` estimates. An import-map assigns the columns of a real log to signals, for
    /// `omnistep import`.
    New {
        /// Kind of the file.
        kind: NewKind,
        /// Its name: letters, digits, _ or -.
        name: String,
        /// Template: a built-in vehicle, a robot of omnistep list robots or a .toml file of a vehicle; a built-in
        /// scenario or study. If left out: chugo7, step or climb_map.
        #[arg(long)]
        template: Option<String>,
        /// The vehicle of a scenario, an excitation or an import-map: a built-in one or a .toml
        /// file. If left out: the vehicle of the scenario template, otherwise chugo7.
        #[arg(long)]
        vehicle: Option<String>,
    },
    /// Prints the JSON Schema of a kind of file, for completion in editors.
    ///
    /// Run omnistep schema vehicle > vehicle.schema.json, and write "#:schema
    /// ./vehicle.schema.json" as the first line of your file.
    Schema {
        /// Kind of the files.
        kind: FileKindArg,
    },
    /// Lists built-in items, and robots as templates of a vehicle.
    List {
        /// Lists only this kind, with a description of each item.
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

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum NewKind {
    Vehicle,
    Scenario,
    Study,
    Excitation,
    ImportMap,
}

/// Host of a run's controller.
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
    /// A vehicle instead of the scenario's: a built-in one or a .toml file; short for --set vehicle=VEHICLE.
    #[arg(long)]
    pub(crate) vehicle: Option<String>,
    /// Replaces a key of the scenario or, with "vehicle." in front, of its vehicle, such as terrain.friction=0.5
    /// or vehicle.motor.stall_torque_n_m=1; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Seed of the scenario's perturbation, 0 to 9223372036854775807.
    #[arg(long, value_name = "SEED", allow_negative_numbers = true)]
    pub(crate) seed: Option<String>,
    /// Ends a run as soon as every wheel stands beyond the obstacle, like --set stop_when_done=true.
    #[arg(long)]
    pub(crate) stop_when_done: bool,
    /// Folder for the MCAP files; created if missing.
    #[arg(long, default_value = "out")]
    pub(crate) out: PathBuf,
    /// Prints only JSON: one line with an object for each policy.
    #[arg(long)]
    pub(crate) json: bool,
    /// Explains each metric below the table.
    #[arg(long, conflicts_with = "json")]
    pub(crate) explain: bool,
    /// Shows no progress bar.
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// Options of a live run.
#[derive(Args)]
#[command(group(ArgGroup::new("shown").args(["live", "ros2"]).multiple(true)))]
pub(crate) struct LiveArgs {
    /// Serves the run live on 127.0.0.1: a page for browsers, and Foxglove's WebSocket protocol for Foxglove and
    /// Lichtblick. Writes no log without --log. Only programs on this machine and known viewers may connect.
    #[arg(long, conflicts_with_all = ["controller", "out"])]
    pub(crate) live: bool,
    /// Port of --live; 0 for any free port.
    #[arg(long, default_value_t = 8765, requires = "live")]
    pub(crate) port: u16,
    /// Simulated seconds per second of real time with --live and --ros2; inf for as fast as possible.
    #[arg(
        long,
        default_value_t = 1.0,
        requires = "shown",
        allow_negative_numbers = true
    )]
    pub(crate) real_time_factor: f64,
    /// Starts when the first client of --live, or the first node of --ros2, subscribes to a topic.
    #[arg(long, requires = "shown")]
    pub(crate) wait: bool,
    /// Ends --live or --ros2 after this many simulated seconds. Without it --live ends with the
    /// scenario, --ros2 with Ctrl-C.
    #[arg(
        long,
        value_name = "SECONDS",
        requires = "shown",
        allow_negative_numbers = true
    )]
    pub(crate) duration: Option<f64>,
    /// Also writes the log of --live or --ros2 to this file, such as out/drive.mcap.
    #[arg(
        long = "log",
        value_name = "FILE",
        requires = "shown",
        conflicts_with = "allow_control"
    )]
    pub(crate) log: Option<PathBuf>,
    /// Lets clients of --live change command, policy and torque limit, and reset the run. A command expires 0.5 s after
    /// the last message, or when its client disconnects: the vehicle is then commanded to stop.
    #[arg(long, requires = "live")]
    pub(crate) allow_control: bool,
    /// Lets web pages from another origin connect to --live, such as https://viewer.example; may be
    /// repeated. Pages of Foxglove, of Lichtblick and of this machine are always allowed.
    #[arg(long = "allow-origin", value_name = "ORIGIN", requires = "live")]
    pub(crate) origins: Vec<String>,
    #[command(flatten)]
    pub(crate) on_ros2: Ros2Args,
}

/// Options of a ROS 2 run.
#[derive(Args)]
pub(crate) struct Ros2Args {
    /// Runs as a ROS 2 node over DDS, without a ROS installation, in the domain of ROS_DOMAIN_ID. Publishes /clock,
    /// /odom, /tf, /joint_states, /imu, /robot_description and more. Accepts Twist and TwistStamped on /cmd_vel; a
    /// command expires after 0.5 s. Writes no log without --log.
    #[arg(long, conflicts_with_all = ["controller", "out"])]
    pub(crate) ros2: bool,
    /// Namespace of all topics of --ros2 except /clock, /diagnostics and /rosout, such as robot1.
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true,
        requires = "ros2"
    )]
    pub(crate) namespace: String,
    /// Stands before the name of every frame of --ros2 but map, such as robot1/. Puts /tf and /tf_static outside
    /// --namespace, so that several vehicles share them.
    #[arg(
        long,
        value_name = "PREFIX",
        default_value = "",
        hide_default_value = true,
        requires = "ros2"
    )]
    pub(crate) frame_prefix: String,
    /// Rate of a --ros2 topic in simulated time, such as odom=100; 0 turns it off; may be repeated. The defaults are
    /// 100 Hz for clock and imu, 50 Hz for odom, tf, joint_states and vehicle_state, 1 Hz for diagnostics.
    #[arg(long = "topic-rate", value_name = "TOPIC=HZ", requires = "ros2")]
    pub(crate) topic_rates: Vec<String>,
    /// Keeps step with /clock of another run or simulator in the domain instead of publishing it, so that several
    /// vehicles have one time. Waits until it comes; starts again when it does.
    #[arg(long, requires = "ros2", conflicts_with = "real_time_factor")]
    pub(crate) follow_clock: bool,
    /// Also publishes the frame map, like a localisation without error.
    #[arg(long, requires = "ros2")]
    pub(crate) publish_map_frame: bool,
    /// The vehicle's climbing limits, a file of omnistep chart: plans the way to goals on /goal_pose, publishes it on
    /// /plan and drives it. The vehicle stands until a goal or a command comes; a command ends the drive.
    #[arg(long, value_name = "FILE", requires = "publish_map_frame")]
    pub(crate) chart: Option<PathBuf>,
    /// Frames of --ros2 on /tf and /tf_static.
    #[arg(long, value_enum, value_name = "FRAMES", default_value_t = TfChoice::All, requires = "ros2")]
    pub(crate) tf: TfChoice,
    /// Acts as the hardware of ros2_control: accepts wheel velocities or torques on /joint_commands instead of
    /// /cmd_vel.
    #[arg(long, value_enum, value_name = "INTERFACE", requires = "ros2")]
    pub(crate) ros2_control: Option<CommandInterface>,
}

/// The arguments after a subcommand of the Python package.
#[derive(Args)]
pub(crate) struct PythonArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub(crate) _rest: Vec<OsString>,
}

impl RunArgs {
    pub(crate) fn overrides(&self) -> Result<Vec<Override>, Error> {
        let mut all = with_vehicle(self.vehicle.as_deref(), &self.overrides)?;
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

/// A whole number within a range.
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

/// The same with another vehicle.
pub(crate) fn with_vehicle(vehicle: Option<&str>, texts: &[String]) -> Result<Vec<Override>, Error> {
    let mut all: Vec<_> = vehicle
        .map(|name| Override::new("vehicle", name))
        .into_iter()
        .collect();
    all.extend(parse_overrides(texts)?);
    Ok(all)
}

pub(crate) fn parse_overrides(texts: &[String]) -> Result<Vec<Override>, Error> {
    texts.iter().map(|text| Ok(Override::parse(text)?)).collect()
}
