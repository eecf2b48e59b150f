//! Logs as MCAP files of ROS 2 messages: the same messages give the same bytes, and a killed run leaves a log that
//! can be read up to its last full second.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, BufWriter};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions, records};
use omni_config::shortened;

use crate::part_file::{FinishedLog, PartFile};
use crate::ros2::{self, RosMessage};

/// Uncompressed size a chunk is closed at \[bytes\]: what a killed run can lose between two flushes.
const CHUNK_BYTES: u64 = 256 * 1024;
/// Channels a file may have: below the format's 65535, where the counter of the `mcap` crate would overflow.
const MAX_CHANNELS: usize = 60_000;
const SECOND_NS: u64 = 1_000_000_000;

/// A path, no longer than somebody reads it.
fn short(path: &Path) -> String {
    shortened(&path.display().to_string()).into_owned()
}

/// Why a log could not be written; every message starts with the file's path.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file could not be created.
    #[error("{}: cannot create the log: {source}", path.display())]
    Create {
        /// File that was to be created.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another program, or another run of this one, writes the log or has just written it and still tells of it.
    #[error("{}: is being written by another run: wait for that one, or name another file or folder", path.display())]
    Busy {
        /// The log's name.
        path: PathBuf,
    },
    /// The system refused to write, for instance because the disk is full.
    #[error("{}: cannot write the log: {source}", path.display())]
    Io {
        /// File that was written.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The container refused a record.
    #[error("{}: cannot write the log: {source}", path.display())]
    Mcap {
        /// File that was written.
        path: PathBuf,
        /// What the container said.
        source: McapError,
    },
    /// A message has no CDR form.
    #[error("{}: cannot encode a {type_name} of topic {topic}: {source}", path.display())]
    Encode {
        /// File that was written.
        path: PathBuf,
        /// Topic of the message.
        topic: String,
        /// ROS 2 type of the message.
        type_name: &'static str,
        /// What the encoder said.
        source: cdr_encoding::Error,
    },
    /// A topic was opened with two types.
    #[error("{}: topic {topic} has type {first}, and cannot have {second} as well", path.display())]
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
    #[error("{}: a channel for {type_name} belongs to another log", path.display())]
    ForeignChannel {
        /// File that was written.
        path: PathBuf,
        /// ROS 2 type of the channel.
        type_name: &'static str,
    },
    /// A log could not be opened or read.
    #[error("{}: {source}", short(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
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
    /// A log has not what it is asked for.
    #[error("{}: {}", short(path), shortened(what))]
    Lacks {
        /// The file.
        path: PathBuf,
        /// What is missing, and where it would come from.
        what: String,
    },
    /// Reading was stopped by whoever watched it.
    #[error("{}: reading was stopped", path.display())]
    Stopped {
        /// The file.
        path: PathBuf,
    },
    /// The finished log could not be given its final name; it is complete and keeps the name of `part`.
    #[error("{}: the log is complete, but cannot be renamed from {}: {source}", path.display(), part.display())]
    Rename {
        /// Final name.
        path: PathBuf,
        /// Name the log has.
        part: PathBuf,
        /// What the system said.
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

/// A topic of one log, for messages of type `M`; made by [`LogWriter::channel`].
pub struct Channel<M> {
    writer: u64,
    index: usize,
    message: PhantomData<fn(&M)>,
}

impl<M> Clone for Channel<M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for Channel<M> {}

impl<M: RosMessage> fmt::Debug for Channel<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Channel")
            .field("type", &M::TYPE)
            .field("index", &self.index)
            .finish()
    }
}

/// What the log knows of a channel.
struct Topic {
    name: String,
    type_name: &'static str,
    id: u16,
    sequence: u32,
}

/// Writes one log: `<path>.part` while it grows, `path` once [`finish`](Self::finish) has succeeded.
///
/// A writer dropped without `finish` removes its `.part` file, unless the thread is panicking; then, as when the
/// process is killed, the file stays as evidence. Nothing in the file depends on the clock or the machine.
pub struct LogWriter {
    // Dropped in this order. Dropping the container closes it, which writes and ignores errors; the file goes after.
    writer: mcap::Writer<NoSeek<BufWriter<File>>>,
    part: PartFile,
    number: u64,
    topics: Vec<Topic>,
    second: Option<u64>,
    buffer: Vec<u8>,
}

impl LogWriter {
    /// Starts a log that will be called `path`; a `.part` file that a killed run has left is replaced.
    ///
    /// # Errors
    /// [`LogError::Busy`] where another run writes that log, [`LogError::Create`] where `<path>.part` cannot be created,
    /// [`LogError::Io`] where it cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let part = PartFile::create(path.as_ref())?;
        let file = part.writer()?;
        Self::over(part, file)
    }

    fn over(part: PartFile, file: File) -> Result<Self, LogError> {
        // Tells this process's logs apart, so that no channel is used with the wrong one; never written.
        static WRITERS: AtomicU64 = AtomicU64::new(0);
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("omnistep ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(1) // faster than the default for two per cent more bytes
            .compression_threads(0) // with threads, bytes depend on how many cores there are
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true) // a chunk reaches the file whole or not at all
            .calculate_chunk_crcs(true)
            .calculate_data_section_crc(true)
            .calculate_summary_section_crc(true)
            .calculate_attachment_crcs(true);
        let writer = mcap::Writer::with_options(NoSeek::new(BufWriter::new(file)), options)
            .map_err(|source| mcap_error(&part, source))?;
        let number = WRITERS.fetch_add(1, Ordering::Relaxed);
        Ok(Self {
            writer,
            part,
            number,
            topics: Vec::new(),
            second: None,
            buffer: Vec::new(),
        })
    }

    /// Opens `topic` for messages of type `M`; opening it again with the same type gives the same channel.
    ///
    /// # Errors
    /// [`LogError::TopicType`] where the topic has another type already, [`LogError::Io`] or [`LogError::Mcap`]
    /// where it cannot be written.
    pub fn channel<M: RosMessage>(&mut self, topic: &str) -> Result<Channel<M>, LogError> {
        let channel = |index| Channel {
            writer: self.number,
            index,
            message: PhantomData,
        };
        if let Some(index) = self.topics.iter().position(|known| known.name == topic) {
            let first = self.topics[index].type_name;
            if first == M::TYPE {
                return Ok(channel(index));
            }
            let path = self.part.path().to_owned();
            return Err(LogError::TopicType {
                path,
                topic: topic.to_owned(),
                first,
                second: M::TYPE,
            });
        }
        if self.topics.len() >= MAX_CHANNELS {
            return Err(mcap_error(&self.part, McapError::TooManyChannels));
        }
        let id = self
            .writer
            .add_schema(M::TYPE, "ros2msg", M::schema().as_bytes())
            .and_then(|schema| self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new()))
            .map_err(|source| mcap_error(&self.part, source))?;
        self.topics.push(Topic {
            name: topic.to_owned(),
            type_name: M::TYPE,
            id,
            sequence: 0,
        });
        Ok(channel(self.topics.len() - 1))
    }

    /// Adds a message at `time_ns` \[ns\] of simulated time, its log time and publish time.
    ///
    /// The first message of each simulated second has all earlier ones handed to the system first, so that they
    /// outlive this process (not a power cut).
    ///
    /// # Errors
    /// [`LogError::ForeignChannel`] for a channel of another log, [`LogError::Encode`] where the message has no CDR
    /// form, [`LogError::Io`] or [`LogError::Mcap`] where it cannot be written.
    pub fn write<M: RosMessage>(
        &mut self,
        channel: &Channel<M>,
        time_ns: u64,
        message: &M,
    ) -> Result<(), LogError> {
        let topic = match self.topics.get_mut(channel.index) {
            Some(topic) if channel.writer == self.number => topic,
            _ => {
                let path = self.part.path().to_owned();
                return Err(LogError::ForeignChannel {
                    path,
                    type_name: M::TYPE,
                });
            }
        };
        ros2::encode_into(message, &mut self.buffer).map_err(|source| LogError::Encode {
            path: self.part.path().to_owned(),
            topic: topic.name.clone(),
            type_name: M::TYPE,
            source,
        })?;
        let second = time_ns / SECOND_NS;
        if self.second.is_some_and(|last| second > last) {
            self.writer
                .flush()
                .map_err(|source| mcap_error(&self.part, source))?;
        }
        self.second = self.second.max(Some(second));
        let header = records::MessageHeader {
            channel_id: topic.id,
            sequence: topic.sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        topic.sequence = topic.sequence.wrapping_add(1);
        self.writer
            .write_to_known_channel(&header, &self.buffer)
            .map_err(|source| mcap_error(&self.part, source))
    }

    /// Adds a named table, such as seed and versions, and hands all so far to the system.
    ///
    /// # Errors
    /// [`LogError::Io`] or [`LogError::Mcap`] where it cannot be written.
    pub fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> Result<(), LogError> {
        self.writer
            .write_metadata(&records::Metadata {
                name: name.to_owned(),
                metadata,
            })
            .and_then(|()| self.writer.flush())
            .map_err(|source| mcap_error(&self.part, source))
    }

    /// Adds a file, such as the scenario, of a MIME type such as `application/toml`, with time 0, and hands all so
    /// far to the system.
    ///
    /// # Errors
    /// [`LogError::Io`] or [`LogError::Mcap`] where it cannot be written.
    pub fn attachment(&mut self, name: &str, media_type: &str, bytes: &[u8]) -> Result<(), LogError> {
        let attachment = mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(bytes),
        };
        self.writer
            .attach(&attachment)
            .and_then(|()| self.writer.flush())
            .map_err(|source| mcap_error(&self.part, source))
    }

    /// Completes the log and gives it its final name, replacing a file that has it. For as long as the result lives, no other run
    /// gets that name.
    ///
    /// # Errors
    /// [`LogError::Io`] or [`LogError::Mcap`] where the rest cannot be written (nothing is left then),
    /// [`LogError::Rename`] where only the final name is refused (the complete `.part` file is left).
    pub fn finish(self) -> Result<FinishedLog, LogError> {
        let Self { mut writer, part, .. } = self;
        writer.finish().map_err(|source| mcap_error(&part, source))?;
        let file = writer.into_inner().into_inner().into_inner();
        let file = file.map_err(|error| part.io_error(error.into_error()))?;
        part.complete(file)
    }

    /// Ends a log that is not whole: hands all so far to the system and returns the name of its `.part` file, which stays.
    ///
    /// # Errors
    /// [`LogError::Io`] or [`LogError::Mcap`] where the rest cannot be written; nothing is left then.
    pub fn leave(self) -> Result<PathBuf, LogError> {
        let Self { mut writer, part, .. } = self;
        writer.flush().map_err(|source| mcap_error(&part, source))?;
        // Taken apart, not dropped: that would close the log, which then looked whole.
        let file = writer.into_inner().into_inner().into_inner();
        file.map_err(|error| part.io_error(error.into_error()))?;
        Ok(part.leave())
    }
}

/// What the container says, with the log's name.
fn mcap_error(part: &PartFile, source: McapError) -> LogError {
    match source {
        McapError::Io(source) => part.io_error(source), // its own message leaves out the reason
        source => LogError::Mcap {
            path: part.path().to_owned(),
            source,
        },
    }
}

impl fmt::Debug for LogWriter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LogWriter")
            .field("path", &self.part.path())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
#[path = "writer_tests.rs"]
mod tests;
