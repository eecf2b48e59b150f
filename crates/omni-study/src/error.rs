//! The errors of many runs.

use std::path::PathBuf;

use omni_config::shortened;

/// An error of a study. Its message is one line. A run that fails is none: it is a row with its error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The request for the runs is not usable.
    #[error(transparent)]
    Simulation(#[from] omni_sim::Error),
    /// A folder of results cannot be used for this study.
    #[error("{}: {}", folder.display(), shortened(reason))]
    Study {
        /// The folder.
        folder: PathBuf,
        /// The error, and the remedy.
        reason: String,
    },
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The caller does not want it any more.
    #[error("stopped before the end")]
    Stopped,
}

impl From<omni_config::Error> for Error {
    fn from(error: omni_config::Error) -> Self {
        Self::Simulation(error.into())
    }
}

impl Error {
    /// Whether the request is at fault (exit code 2) or the run failed (exit code 1).
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Simulation(error) => error.is_bad_input(),
            _ => true,
        }
    }
}
