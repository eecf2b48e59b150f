//! The errors of a log.

use std::io;
use std::path::{Path, PathBuf};

use mcap::McapError;
use omni_config::{did_you_mean_file, shortened};

/// A path, cut to a readable length.
fn short(path: &Path) -> String {
    shortened(&path.display().to_string()).into_owned()
}

/// The file beside one that is missing whose name is much like its, in words.
fn meant(path: &Path, source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => did_you_mean_file(path, &[]),
        _ => String::new(),
    }
}

/// Why a log could not be written; every message starts with the file's path.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file could not be created.
    #[error("{}: cannot create the log: {source}", short(path))]
    Create {
        /// File that was to be created.
        path: PathBuf,
        /// The operating system's message.
        source: io::Error,
    },
    /// Another program, or another run of this one, writes the log or has just written it and still reports it.
    #[error(
        "{}: is being written by another run: wait for that one, or name another file or folder",
        short(path)
    )]
    Busy {
        /// The log's name.
        path: PathBuf,
    },
    /// The system failed to write, for example because the disk is full.
    #[error("{}: cannot write the log: {source}", short(path))]
    Io {
        /// File that was written.
        path: PathBuf,
        /// The operating system's message.
        source: io::Error,
    },
    /// The container rejected a record.
    #[error("{}: cannot write the log: {source}", short(path))]
    Mcap {
        /// File that was written.
        path: PathBuf,
        /// The container's message.
        source: McapError,
    },
    /// A message has no CDR form.
    #[error("{}: cannot encode a {type_name} of topic {topic}: {source}", short(path))]
    Encode {
        /// File that was written.
        path: PathBuf,
        /// Topic of the message.
        topic: String,
        /// ROS 2 type of the message.
        type_name: &'static str,
        /// The encoder's message.
        source: cdr_encoding::Error,
    },
    /// A topic was opened with two types.
    #[error(
        "{}: topic {topic} has type {first}, and cannot have {second} as well",
        short(path)
    )]
    TopicType {
        /// File that was written.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// Type it was opened with.
        first: &'static str,
        /// Type it was opened with again.
        second: &'static str,
    },
    /// A channel of one log was used in another.
    #[error("{}: a channel for {type_name} belongs to another log", short(path))]
    ForeignChannel {
        /// File that was written.
        path: PathBuf,
        /// ROS 2 type of the channel.
        type_name: &'static str,
    },
    /// A log could not be opened or read.
    #[error("{}{}: {source}", short(path), meant(path, source))]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's message.
        source: io::Error,
    },
    /// A log's bytes are not what was written.
    #[error("{}: damaged: {}", short(path), shortened(reason))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Which checksum or record is wrong.
        reason: String,
    },
    /// A log lacks the requested content.
    #[error("{}: {}", short(path), shortened(what))]
    Lacks {
        /// The file.
        path: PathBuf,
        /// The missing content, and its usual source.
        what: String,
    },
    /// Reading was stopped by its caller.
    #[error("{}: reading was stopped", short(path))]
    Stopped {
        /// The file.
        path: PathBuf,
    },
    /// The finished log could not be given its final name; it is complete and keeps the name of `part`.
    #[error(
        "{}: the log is complete, but cannot be renamed from {}: {source}",
        short(path),
        short(part)
    )]
    Rename {
        /// Final name.
        path: PathBuf,
        /// Name the log has.
        part: PathBuf,
        /// The operating system's message.
        source: io::Error,
    },
}

impl LogError {
    /// The log concerned.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Create { path, .. }
            | Self::Busy { path }
            | Self::Io { path, .. }
            | Self::Mcap { path, .. }
            | Self::Encode { path, .. }
            | Self::TopicType { path, .. }
            | Self::ForeignChannel { path, .. }
            | Self::Read { path, .. }
            | Self::Damaged { path, .. }
            | Self::Lacks { path, .. }
            | Self::Stopped { path }
            | Self::Rename { path, .. } => path,
        }
    }
}

impl LogError {
    pub(crate) fn unreadable(path: &Path, source: io::Error) -> Self {
        let path = path.to_path_buf();
        Self::Read { path, source }
    }

    pub(crate) fn damaged(path: &Path, reason: String) -> Self {
        let path = path.to_path_buf();
        Self::Damaged { path, reason }
    }

    pub(crate) fn lacks(path: &Path, what: impl Into<String>) -> Self {
        let (path, what) = (path.to_path_buf(), what.into());
        Self::Lacks { path, what }
    }
}
