//! Logs as MCAP files of ROS 2 messages; equal messages produce equal bytes.
//!
//! A killed run leaves a log that can be read up to its last full second.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::io::BufWriter;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, records};

use crate::in_memory::InMemory;
use crate::log_error::LogError;
use crate::part_file::{FinishedLog, PartFile, Place};
use crate::ros2::{self, RosMessage};

/// Uncompressed size at which a chunk is closed \[bytes\]: the loss of a killed run between two flushes.
const CHUNK_BYTES: u64 = 256 * 1024;
/// Channels a file may have: below the format's 65535, where the counter of the `mcap` crate would overflow.
const MAX_CHANNELS: usize = 60_000;
const SECOND_NS: u64 = 1_000_000_000;

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

/// The log's state of a channel.
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
///
/// [`LogWriter::in_memory`] makes one where there are no files.
pub struct LogWriter<P: Place = PartFile> {
    // Dropped in this order. Dropping the container closes it, which writes and ignores errors; the file goes after.
    writer: mcap::Writer<NoSeek<BufWriter<P::Sink>>>,
    part: P,
    number: u64,
    topics: Vec<Topic>,
    second: Option<u64>,
    buffer: Vec<u8>,
}

impl LogWriter {
    /// Starts a log that will be called `path`; a `.part` file that a killed run has left is replaced.
    ///
    /// # Errors
    /// [`LogError::Busy`] if another run writes that log, [`LogError::Create`] if `<path>.part` cannot be created,
    /// [`LogError::Io`] if it cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let part = PartFile::create(path.as_ref())?;
        let file = part.writer()?;
        Self::over(part, file)
    }

    /// Completes the log and renames it to its final name, replacing an existing file. As long as the result exists, no
    /// other run receives that name.
    ///
    /// # Errors
    /// [`LogError::Io`] or [`LogError::Mcap`] if the remaining data cannot be written (no file is left then),
    /// [`LogError::Rename`] if only the final name is rejected (the complete `.part` file is left).
    pub fn finish(self) -> Result<FinishedLog, LogError> {
        let Self { mut writer, part, .. } = self;
        writer.finish().map_err(|source| mcap_error(&part, source))?;
        let file = writer.into_inner().into_inner().into_inner();
        let file = file.map_err(|error| part.io_error(error.into_error()))?;
        part.complete(file)
    }

    /// Ends a log that is not whole: hands all so far to the system and returns the name of its
    /// `.part` file, which stays.
    ///
    /// # Errors
    /// [`LogError::Io`] or [`LogError::Mcap`] if the remaining data cannot be written; no file is left then.
    pub fn leave(self) -> Result<PathBuf, LogError> {
        let Self { mut writer, part, .. } = self;
        writer.flush().map_err(|source| mcap_error(&part, source))?;
        // Taken apart, not dropped: that would close the log, which then looked whole.
        let file = writer.into_inner().into_inner().into_inner();
        file.map_err(|error| part.io_error(error.into_error()))?;
        Ok(part.leave())
    }
}

impl LogWriter<InMemory> {
    /// Starts a log in memory that messages call `name`.
    ///
    /// # Errors
    /// [`LogError::Mcap`] if the container rejects it.
    pub fn in_memory(name: &str) -> Result<Self, LogError> {
        let bytes = InMemory::new(name);
        Self::over(bytes.clone(), bytes)
    }

    /// Bytes written since the last call: the concatenation of these pieces, up to the piece of
    /// [`finish`](Self::finish), is the file.
    pub fn take(&mut self) -> Vec<u8> {
        self.part.take()
    }

    /// Completes the log and returns the last piece.
    ///
    /// # Errors
    /// [`LogError::Mcap`] if the container rejects it.
    pub fn finish(self) -> Result<Vec<u8>, LogError> {
        let Self { mut writer, part, .. } = self;
        writer.finish().map_err(|source| mcap_error(&part, source))?;
        drop(writer); // hands on what it held back
        Ok(part.take())
    }
}

/// How logs are written.
fn options() -> WriteOptions {
    let options = WriteOptions::new()
        .profile("ros2")
        .library(concat!("omnistep ", env!("CARGO_PKG_VERSION")))
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true) // a chunk reaches the file whole or not at all
        .calculate_chunk_crcs(true)
        .calculate_data_section_crc(true)
        .calculate_summary_section_crc(true)
        .calculate_attachment_crcs(true);
    #[cfg(feature = "zstd")]
    let options = options
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(1) // faster than the default for two per cent more bytes
        .compression_threads(0); // with threads, bytes depend on how many cores there are
    options
}

impl<P: Place> LogWriter<P> {
    fn over(part: P, sink: P::Sink) -> Result<Self, LogError> {
        // Separates this process's logs, so that no channel is used with the wrong one; never written.
        static WRITERS: AtomicU64 = AtomicU64::new(0);
        let writer = mcap::Writer::with_options(NoSeek::new(BufWriter::new(sink)), options())
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

    /// Opens `topic` for messages of type `M`; opening it again with the same type returns the same channel.
    ///
    /// # Errors
    /// [`LogError::TopicType`] if the topic has another type already, [`LogError::Io`] or [`LogError::Mcap`] if it
    /// cannot be written.
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
    /// [`LogError::ForeignChannel`] for a channel of another log, [`LogError::Encode`] if the message has no CDR form,
    /// [`LogError::Io`] or [`LogError::Mcap`] if it cannot be written.
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
    /// [`LogError::Io`] or [`LogError::Mcap`] if it cannot be written.
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
    /// [`LogError::Io`] or [`LogError::Mcap`] if it cannot be written.
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
}

/// The container's message, with the log's name.
fn mcap_error(part: &impl Place, source: McapError) -> LogError {
    match source {
        McapError::Io(source) => part.io_error(source), // its own message leaves out the reason
        source => LogError::Mcap {
            path: part.path().to_owned(),
            source,
        },
    }
}

impl<P: Place> fmt::Debug for LogWriter<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LogWriter")
            .field("path", &self.part.path())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
#[path = "writer_tests.rs"]
mod tests;
