#![doc = include_str!("../README.md")]
//!
//! # Output streams
//!
//! Results go to standard output, progress and errors to standard error. Exit codes: 0 done, 1 the run failed, 2 the
//! request was wrong, 130 stopped by Ctrl-C, 143 by SIGTERM.

#![forbid(unsafe_code)]

mod args;
#[cfg(feature = "study")]
mod chart;
mod check;
#[cfg(feature = "study")]
mod check_chart;
#[cfg(feature = "climb-limits")]
mod climb_limits;
mod compare;
#[cfg(feature = "live")]
mod drive;
mod error;
mod excitation;
mod export;
mod fault_messages;
mod files;
mod import_map;
mod list;
#[cfg(feature = "live")]
mod live;
mod logs;
mod metrics;
mod motor_bench;
mod notices;
mod output;
#[cfg(feature = "plan")]
mod plan;
mod reasons;
mod retry_state;
mod robots;
mod room;
#[cfg(feature = "ros2")]
mod ros2;
mod ros2_package;
#[cfg(feature = "plan")]
pub mod routes;
mod scenario_or_vehicle;
mod signals;
#[cfg(feature = "study")]
mod study;
mod wheel_ripple;

use std::ffi::OsString;
use std::io::Write;

use args::{Cli, Command, Place, RunArgs};
use check::AskedStep;
use clap::{CommandFactory, Parser};
use compare::Policies;
use omni_config::Engine;
use omni_sim::controller::Firmware;
use output::{each, print, say, say_error};

pub use error::Error;

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
        Err(
            error @ (Error::StudyInterrupted { .. }
            | Error::ChartInterrupted { .. }
            | Error::RunInterrupted { .. }),
        ) => {
            say(&format!("stopped: {error}"));
            signals::exit_code()
        }
        Err(error) => say_error(&error),
    }
}

/// The error of a scenario's file, as the answer to a subcommand.
fn to_command(name: &'static str) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::Simulation(omni_sim::Error::Config(error)) => error.to_command(name).into(),
        other => other,
    }
}

/// The exit code.
fn run(cli: Cli, out: &mut dyn Write) -> Result<u8, Error> {
    let Some(command) = cli.command else {
        return print(out, &Cli::command().render_help().to_string()).map(|()| 0);
    };
    let done = match command {
        Command::Info { logs, json, explain } => return logs::info(&logs, json, explain, out),
        Command::Check {
            files,
            step,
            chart,
            overrides,
            strict,
        } => {
            let overrides = args::parse_overrides(&overrides)?;
            let step = step.map(|height_m| AskedStep { height_m, chart });
            let mut doubtful = false;
            let code = each(&files, |file| {
                doubtful |= check::check(file, step.as_ref(), &overrides, out)?;
                Ok(())
            });
            return Ok(code.max(u8::from(strict && doubtful)));
        }
        Command::Compare { args, engines } => {
            let engines: &[Engine] = if engines { &Engine::ALL } else { &[] };
            compare::compare(&args, Policies::All, engines, None, out).map_err(to_command("compare"))
        }
        Command::Run {
            args,
            policy,
            controller,
            firmware,
            live,
        } => {
            if live.live || live.on_ros2.ros2 {
                return run_live(&args, policy.as_deref(), live, out).map(|()| 0);
            }
            let firmware = (controller == Place::Qemu).then(|| Firmware::new(firmware));
            compare::compare(
                &args,
                Policies::One(policy.as_deref()),
                &[],
                firmware.as_ref(),
                out,
            )
        }
        #[cfg(feature = "live")]
        Command::Drive(args) => drive::drive(args, out),
        Command::MotorBench {
            experiment,
            overrides,
            json,
        } => motor_bench::motor_bench(&experiment, &overrides, json, out),
        #[cfg(feature = "study")]
        Command::Study(args) => study::study(&args, out),
        #[cfg(feature = "study")]
        Command::Chart(args) => chart::chart(&args, out),
        #[cfg(feature = "plan")]
        Command::Plan(args) => plan::plan(&args, out),
        Command::WheelRipple {
            vehicle,
            overrides,
            json,
        } => wheel_ripple::wheel_ripple(&vehicle, &overrides, json, out),
        #[cfg(feature = "climb-limits")]
        Command::ClimbLimits {
            scenario,
            vehicle,
            overrides,
            json,
        } => {
            let overrides = args::with_vehicle(vehicle.as_deref(), &overrides)?;
            climb_limits::climb_limits(&scenario, overrides, json, out)
        }
        Command::Replay {
            log,
            policy,
            overrides,
        } => logs::replayed(&log, policy.as_deref(), &overrides, out),
        Command::Export(args) => export::export(&args, out),
        Command::Import(_) => Err(in_python("import", "import")),
        Command::Resimulate(_) => Err(in_python("resimulate", "plot")),
        Command::Video(_) => Err(in_python("video", "view")),
        Command::Plot(_) => Err(in_python("plot", "plot")),
        Command::Report(_) => Err(in_python("report", "view")),
        Command::Identify(_) => Err(in_python("identify", "identify")),
        Command::Calibrate(_) => Err(in_python("calibrate", "identify")),
        Command::New {
            kind,
            name,
            template,
            vehicle,
        } => files::new(kind, &name, template.as_deref(), vehicle.as_deref(), out),
        Command::Schema { kind } => files::schema(kind, out),
        Command::List { kind } => list::list(kind, out),
        #[cfg(not(all(
            feature = "climb-limits",
            feature = "live",
            feature = "plan",
            feature = "study"
        )))]
        other => Err(not_built(&other)),
    };
    done.map(|()| 0)
}

/// What a command needs that was left out of this program.
#[cfg(not(all(
    feature = "climb-limits",
    feature = "live",
    feature = "plan",
    feature = "study"
)))]
fn not_built(command: &Command) -> Error {
    let (what, feature) = match command {
        Command::Drive(_) => ("drive", "live"),
        Command::Study(_) => ("study", "study"),
        Command::Chart(_) => ("chart", "study"),
        Command::Plan(_) => ("plan", "plan"),
        _ => ("climb-limits", "climb-limits"),
    };
    Error::NotBuilt { what, feature }
}

/// `omnistep run --live` and `omnistep run --ros2`.
#[cfg(feature = "live")]
fn run_live(
    args: &RunArgs,
    policy: Option<&str>,
    live: args::LiveArgs,
    out: &mut dyn Write,
) -> Result<(), Error> {
    if live.on_ros2.ros2 && !cfg!(feature = "ros2") {
        return Err(Error::NotBuilt {
            what: "run --ros2",
            feature: "ros2",
        });
    }
    live::live(args, policy, live, out)
}

#[cfg(not(feature = "live"))]
fn run_live(_: &RunArgs, _: Option<&str>, live: args::LiveArgs, _: &mut dyn Write) -> Result<(), Error> {
    let (what, feature) = if live.on_ros2.ros2 {
        ("run --ros2", "ros2")
    } else {
        ("run --live", "live")
    };
    Err(Error::NotBuilt { what, feature })
}

/// A subcommand that the Python package's `omnistep` has and this program has not.
fn in_python(command: &'static str, extra: &'static str) -> Error {
    Error::Elsewhere { command, extra }
}
