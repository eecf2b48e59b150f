//! The errors of files, each with its file and key, in one line.

use std::path::PathBuf;

use crate::file_kind::FileKind;
use crate::shortened;
use crate::suggestion::did_you_mean;
use crate::truncate::{fits, short_key};

/// A file, a key or a name that is not usable. Its message is one line, as `Debug` too: what `main`
/// prints of an error. Whatever the file holds, no part of it is longer than [`shortened`] leaves it.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The text is not TOML.
    #[error("{}:{line}: {}", shortened(file), shortened(message))]
    Syntax {
        /// File, or `built-in NAME`.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The parser's expectation.
        message: String,
    },
    /// A key is unknown, missing, of the wrong type or out of range.
    #[error("{}: {}: {}", shortened(file), short_key(key), shortened(message))]
    Key {
        /// File, or `built-in NAME`.
        file: String,
        /// Path of the key, as `wheel[2].radius_m`.
        key: String,
        /// The value found and the range allowed.
        message: String,
    },
    /// No built-in thing and no file of that name.
    #[error("{}", shortened(&format!("unknown {kind} {name:?}{}, allowed: {known}", did_you_mean(name, known.split(", ")))))]
    UnknownName {
        /// Kind of thing: `scenario`, `vehicle`, `policy`.
        kind: &'static str,
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// A file is no text in UTF-8.
    #[error("{}: {reason}", shortened(file))]
    NotText {
        /// The file.
        file: String,
        /// Its actual kind, and the remedy.
        reason: String,
    },
    /// A file describes something else.
    #[error("{}: this is {}, not {}; use: {}", shortened(file), found.called(file), wanted.called(""), found.how_to(command, or_file(file)))]
    OtherKind {
        /// The file.
        file: String,
        /// Its content.
        found: FileKind,
        /// The request.
        wanted: FileKind,
        /// The subcommand that a scenario would be given to, as `run`.
        command: &'static str,
    },
    /// An override is not of the form `key=value`.
    #[error("--set {:?}: {}", short_key(text), shortened(message))]
    Override {
        /// The text given.
        text: String,
        /// Its error.
        message: String,
    },
    /// There is no file of that name.
    #[error("{}{meant}: {source}", shortened(&path.display().to_string()))]
    Missing {
        /// The file.
        path: PathBuf,
        /// The name that may have been meant, or the list of names, as a suffix of the file's name.
        meant: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file could not be read.
    #[error("{}: {source}", shortened(&path.display().to_string()))]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// Most characters of a path that is said a second time.
const MOST_AGAIN: usize = 60;

/// A file as it is to be typed, where that is not long: it was said in full before.
fn or_file(file: &str) -> &str {
    if fits(file, MOST_AGAIN) { file } else { "FILE" }
}

impl Error {
    /// The same error, as the answer to a subcommand that takes a scenario, as `compare`: what it
    /// says to type is of that one.
    #[must_use]
    pub fn to_command(self, name: &'static str) -> Self {
        match self {
            Self::OtherKind {
                file, found, wanted, ..
            } => Self::OtherKind {
                file,
                found,
                wanted,
                command: name,
            },
            other => other,
        }
    }

    /// The error of a table that stands inside another one, under this key.
    pub(crate) fn inside(self, table: &str) -> Self {
        match self {
            Self::Key { file, key, message } => Self::Key {
                file,
                key: match key.as_str() {
                    "top level" => table.to_owned(),
                    key => format!("{table}.{key}"),
                },
                message,
            },
            other => other,
        }
    }
}

impl std::fmt::Debug for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(self, f)
    }
}
