//! Everything that can go wrong, each with the file and key concerned, in one line.

use std::path::{Path, PathBuf};

use crate::config::shortened;

/// An error of configuration, simulation or logging. Its message is one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file, a key or a name is not usable.
    #[error(transparent)]
    Config(#[from] crate::config::Error),
    /// A command handed to a running simulation is not usable.
    #[error("{name} = {}, allowed: {allowed}", shortened(value))]
    Argument {
        /// Name of the argument.
        name: &'static str,
        /// The value found.
        value: String,
        /// The range allowed.
        allowed: &'static str,
    },
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A log could not be written or read.
    #[error(transparent)]
    Log(#[from] crate::log::LogError),
    /// A controller at the other end of a link cannot be started, or is not the scenario's.
    #[error("{}: {}", shortened(name), shortened(reason))]
    Firmware {
        /// The image, or what else serves the controller.
        name: String,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// The link to a running controller has stopped; there is no torque any more.
    #[error(
        "the link to the controller stopped at t = {time_s:.3} s: {} ({counters})",
        shortened(reason)
    )]
    Link {
        /// Simulated time \[s\].
        time_s: f64,
        /// Why.
        reason: String,
        /// What was lost until then.
        counters: crate::controller::LinkCounters,
    },
    /// A folder of results cannot be used for this study.
    #[error("{}: {}", folder.display(), shortened(reason))]
    Study {
        /// The folder.
        folder: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// Whoever asked for it does not want it any more.
    #[error("stopped before the end")]
    Stopped,
    /// Ctrl-C ended a study before its end.
    #[error("{done} of {runs} runs are done and kept in {}; the same command goes on", folder.display())]
    Interrupted {
        /// Runs whose rows are written.
        done: usize,
        /// Runs of the study.
        runs: usize,
        /// The folder of results.
        folder: PathBuf,
    },
    /// A signal such as Ctrl-C ended a run before its end.
    #[error("the run ended at {time_s:.2} s of {duration_s} s{}", its_log(part.as_deref()))]
    RunInterrupted {
        /// Simulated time \[s\].
        time_s: f64,
        /// Simulated time that it would have had \[s\].
        duration_s: f64,
        /// The unfinished log; a live run has none.
        part: Option<PathBuf>,
    },
    /// The physics left the finite numbers.
    #[error("the simulation diverged at t = {time_s:.3} s: body {body} has no finite state")]
    Diverged {
        /// Simulated time \[s\].
        time_s: f64,
        /// Name of the first body concerned.
        body: String,
    },
    /// A joint gave way: forces beyond what the physics step can hold.
    #[error("the vehicle fell apart at t = {time_s:.3} s: {part} parted by {:.1} mm", 1e3 * gap_m)]
    FellApart {
        /// Simulated time \[s\].
        time_s: f64,
        /// The joint, as `wheel 4` or `hinge pitch`.
        part: String,
        /// How far it parted \[m\].
        gap_m: f64,
    },
    /// The physics gave back more energy than was put in, beyond what is their error.
    #[error(
        "the physics gained {gained_j:.1} J while {through_j:.1} J went through the vehicle: no figure of this run holds; physics.step_us = \
         {step_us} is too long, the built-in scenarios have 500"
    )]
    GainedEnergy {
        /// So much energy from nowhere \[J\].
        gained_j: f64,
        /// While so much went through the motors, and came of falling \[J\].
        through_j: f64,
        /// The physics step \[us\].
        step_us: u64,
    },
    /// The run took longer on the clock than it may.
    #[error("stopped at t = {time_s:.3} s: the run took longer than wall_clock_s, {wall_clock_s} s")]
    OutOfTime {
        /// Simulated time \[s\].
        time_s: f64,
        /// The time allowed \[s\].
        wall_clock_s: f64,
    },
    /// A live run cannot be served.
    #[error("port {port} on 127.0.0.1: {reason}")]
    Live {
        /// The port.
        port: u16,
        /// What the system said.
        reason: String,
    },
    /// A command that another program has.
    #[error("omnistep {command} is part of the Python package: {how}")]
    Elsewhere {
        /// The command.
        command: &'static str,
        /// How to get it.
        how: &'static str,
    },
    /// A snapshot does not belong to the scenario.
    #[error("the snapshot cannot be resumed: {}", shortened(reason))]
    Snapshot {
        /// What is wrong with it.
        reason: String,
    },
}

/// Where the log of a run that was stopped is, if it has one.
fn its_log(part: Option<&Path>) -> String {
    part.map_or_else(String::new, |part| {
        format!("; its log until then is {}", part.display())
    })
}

impl Error {
    /// Is the request at fault (exit code 2), or did the run fail (exit code 1)?
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Log(error) => {
                use crate::log::LogError::{Busy, Create, Lacks, Read};
                matches!(error, Busy { .. } | Create { .. } | Lacks { .. } | Read { .. })
            }
            Self::Diverged { .. }
            | Self::FellApart { .. }
            | Self::GainedEnergy { .. }
            | Self::OutOfTime { .. }
            | Self::Interrupted { .. }
            | Self::RunInterrupted { .. }
            | Self::Link { .. } => false,
            _ => true,
        }
    }
}
