//! The errors of a run that is logged, read or served.

/// An error of a log, of a live view or of the simulation. Its message is one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The run failed, or what was asked of it.
    #[error(transparent)]
    Simulation(#[from] omni_sim::Error),
    /// A log could not be written or read.
    #[error(transparent)]
    Log(#[from] crate::LogError),
    /// A live run cannot be served.
    #[error("port {port} on 127.0.0.1: {reason}")]
    Live {
        /// The port.
        port: u16,
        /// The operating system's message.
        reason: String,
    },
    /// A live run cannot be on ROS 2.
    #[cfg(feature = "ros2")]
    #[error("ROS 2, domain {domain}: {reason}")]
    Ros2 {
        /// The domain.
        domain: u16,
        /// The operating system's message.
        reason: String,
    },
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
        use crate::LogError::{Busy, Create, Lacks, Read};
        match self {
            Self::Simulation(error) => error.is_bad_input(),
            Self::Log(error) => {
                matches!(error, Busy { .. } | Create { .. } | Lacks { .. } | Read { .. })
            }
            Self::Live { .. } => true,
            #[cfg(feature = "ros2")]
            Self::Ros2 { .. } => true,
        }
    }
}
