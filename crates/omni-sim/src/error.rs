//! Everything that can go wrong, each with the file and key concerned, in one line.

use std::path::PathBuf;

/// An error of configuration, simulation or logging. Its message is one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The text is not TOML.
    #[error("{file}:{line}: {message}")]
    Syntax {
        /// File, or `built-in NAME`.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What the parser expected.
        message: String,
    },
    /// A key is unknown, missing, of the wrong type or out of range.
    #[error("{file}: {key}: {message}")]
    Config {
        /// File, or `built-in NAME`.
        file: String,
        /// Path of the key, as `wheel[2].radius_m`.
        key: String,
        /// The value found and the range allowed.
        message: String,
    },
    /// No built-in thing and no file of that name.
    #[error("unknown {kind} {name:?}, allowed: {known}")]
    UnknownName {
        /// Kind of thing: `scenario`, `vehicle`, `policy`.
        kind: &'static str,
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// An override is not of the form `key=value`.
    #[error("--set {text:?}: {message}")]
    Override {
        /// The text given.
        text: String,
        /// What is wrong with it.
        message: String,
    },
    /// A command handed to a running simulation is not usable.
    #[error("{name} = {value}, allowed: {allowed}")]
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
    /// The log could not be written.
    #[error(transparent)]
    Log(#[from] crate::log::LogError),
    /// The physics left the finite numbers.
    #[error("the simulation diverged at t = {time_s:.3} s: body {body} has no finite state")]
    Diverged {
        /// Simulated time \[s\].
        time_s: f64,
        /// Name of the first body concerned.
        body: String,
    },
}

impl Error {
    /// Is the request at fault (exit code 2), or did the run fail (exit code 1)?
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Log(error) => matches!(error, crate::log::LogError::Create { .. }),
            Self::Diverged { .. } => false,
            _ => true,
        }
    }
}
