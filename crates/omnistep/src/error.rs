//! The errors that end a command, in one line.

use std::path::{Path, PathBuf};

use omni_config::shortened;

/// An error of a command. Its message is one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The run failed, or what was asked of it.
    #[error(transparent)]
    Simulation(#[from] omni_sim::Error),
    /// A log, or a live view.
    #[error(transparent)]
    Log(#[from] omni_log::Error),
    /// A study.
    #[cfg(feature = "study")]
    #[error(transparent)]
    Study(#[from] omni_study::Error),
    /// A map, a chart or an option of a plan.
    #[cfg(feature = "plan")]
    #[error(transparent)]
    Plan(omni_plan::Error),
    /// There is no way.
    #[cfg(feature = "plan")]
    #[error(transparent)]
    NoRoute(omni_plan::NoRoute),
    /// What the vehicle climbs is not known.
    #[cfg(feature = "plan")]
    #[error(
        "there is no chart of {vehicle} under {policy}: {} does not exist; make it with omnistep chart VEHICLE --policy {policy}, or name another with --chart",
        file.display()
    )]
    NoChart {
        /// The file that was looked for.
        file: PathBuf,
        /// The vehicle.
        vehicle: String,
        /// The scenario's policy.
        policy: String,
    },
    /// Minimum torque and run-up of a climb.
    #[cfg(feature = "climb-limits")]
    #[error(transparent)]
    ClimbLimits(omni_bound::Error),
    /// An argument is not usable.
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
    /// Ctrl-C ended a study before its end.
    #[error("{done} of {runs} runs are done and kept in {}; run the same command again to continue", folder.display())]
    StudyInterrupted {
        /// Runs whose rows are written.
        done: usize,
        /// Runs of the study.
        runs: usize,
        /// The folder of results.
        folder: PathBuf,
    },
    /// Ctrl-C ended a chart before its end.
    #[error("{done} of {cells} cells are done and kept in {}; run the same command with --resume to continue", file.display())]
    ChartInterrupted {
        /// Cells that were added to the file.
        done: usize,
        /// Cells that it lacked.
        cells: usize,
        /// The chart's file.
        file: PathBuf,
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
    /// A command that another program has.
    #[error(
        "omnistep {command} is part of the Python package: install that with its extra \"{extra}\" (in a clone of the repository: pip install \
         \".[{extra}]\"), then run the same command with the omnistep of that package"
    )]
    Elsewhere {
        /// The command.
        command: &'static str,
        /// The extra that it needs there.
        extra: &'static str,
    },
    /// A command that this program was built without.
    #[error(
        "omnistep {what}: this program was built without the feature {feature}; build it with --features full (in a clone of the \
         repository: cargo run --release --features full -- {what}), or use the omnistep of the Python package"
    )]
    NotBuilt {
        /// The request.
        what: &'static str,
        /// The feature that has it.
        feature: &'static str,
    },
}

impl From<omni_config::Error> for Error {
    fn from(error: omni_config::Error) -> Self {
        Self::Simulation(error.into())
    }
}

#[cfg(feature = "climb-limits")]
impl From<omni_bound::Error> for Error {
    fn from(error: omni_bound::Error) -> Self {
        match error {
            omni_bound::Error::Config(error) => error.into(),
            other => Self::ClimbLimits(other),
        }
    }
}

#[cfg(feature = "plan")]
impl From<omni_plan::Error> for Error {
    fn from(error: omni_plan::Error) -> Self {
        match error {
            omni_plan::Error::File(error) => error.into(),
            other => Self::Plan(other),
        }
    }
}

impl From<omni_log::LogError> for Error {
    fn from(error: omni_log::LogError) -> Self {
        Self::Log(error.into())
    }
}

/// Path of the log of a stopped run, if it has one.
fn its_log(part: Option<&Path>) -> String {
    part.map_or_else(String::new, |part| {
        format!("; its log until then is {}", part.display())
    })
}

impl Error {
    /// Whether the request is at fault (exit code 2) or the run failed (exit code 1).
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Simulation(error) => error.is_bad_input(),
            Self::Log(error) => error.is_bad_input(),
            #[cfg(feature = "study")]
            Self::Study(error) => error.is_bad_input(),
            #[cfg(feature = "climb-limits")]
            Self::ClimbLimits(error) => error.is_bad_input(),
            #[cfg(feature = "plan")]
            Self::NoRoute(reason) => {
                matches!(
                    reason,
                    omni_plan::NoRoute::OutOfMap { .. } | omni_plan::NoRoute::Blocked { .. }
                )
            }
            Self::StudyInterrupted { .. } | Self::ChartInterrupted { .. } | Self::RunInterrupted { .. } => {
                false
            }
            _ => true,
        }
    }
}
