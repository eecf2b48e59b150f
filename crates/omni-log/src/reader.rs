//! The messages of a log, read back; every checksum is checked.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use byteorder::LittleEndian;
use mcap::McapError;
use mcap::records::{MessageHeader, Record, Statistics};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use omni_config::{Scenario, Source, open_regular};
use omni_sim::Outcome;
use serde::de::DeserializeOwned;

use crate::ros2::{
    CDR_LE, ControllerSignals, JointState, MarkerArray, Odometry, RosMessage, Sensors, StringMessage,
    TfMessage, TwistStamped, VehicleState,
};
use crate::run_log::{OUTCOME, OWN_CONTROLLER, RECORDED, RUN, SCENARIO};
use crate::{Error, LogError, WORLD_LINK, size_limits, topic};

/// Bytes that are read at a time.
const BLOCK: usize = 1 << 18;
/// Bytes of a footer.
const FOOTER_BYTES: usize = 20;

/// A message of a log, by its topic.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum LogMessage {
    /// `/vehicle_state`.
    VehicleState(VehicleState),
    /// `/sensors`.
    Sensors(Sensors),
    /// `/controller_signals`.
    ControllerSignals(ControllerSignals),
    /// `/tf`.
    Tf(TfMessage),
    /// `/joint_states`.
    JointStates(JointState),
    /// `/odom`: odometry.
    Odom(Box<Odometry>),
    /// `/ground_truth/odom`; and `/odom` in the frame `world`, which was the truth before there was odometry.
    GroundTruth(Box<Odometry>),
    /// `/cmd_vel`.
    CmdVel(TwistStamped),
    /// `/markers`.
    Markers(MarkerArray),
    /// `/robot_description`.
    RobotDescription(StringMessage),
    /// `/terrain/robot_description`.
    Terrain(StringMessage),
}

/// A log's metadata.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LogFile {
    /// Path of the log.
    pub path: PathBuf,
    /// Program version, scenario, vehicle, policy and seed by name, of the metadata `run`.
    pub run: BTreeMap<String, String>,
    /// The controller was the user's own, which is not in the log: the scenario does not say what it did.
    pub own_controller: bool,
    /// It was measured on a vehicle: a [`Recording`](crate::Recording), without an outcome, NaN if it is not known.
    pub recorded: bool,
    /// The scenario as it was run.
    pub scenario: Scenario,
    /// The metrics; none if the run was killed before its end.
    pub outcome: Option<Outcome>,
    /// The log is complete; otherwise its last chunk, at most one simulated second, may be missing.
    pub complete: bool,
    /// Time of the last message \[ns\].
    pub until_ns: u64,
    /// Messages by topic.
    pub counts: BTreeMap<String, u64>,
    /// Messages of topics that this program does not write; they are skipped.
    pub foreign: u64,
}

/// Reads a log from start to end, finished or not, and hands each message with its time \[ns\] to `on`.
///
/// ```
/// use omni_log::{Error, LogMessage, LogRun, RunLog, read_log};
/// use omni_sim::{Run, config::{Override, Scenario}, controller::AnyController};
/// let folder = std::env::temp_dir().join("omnistep-read-log-example");
/// std::fs::create_dir_all(&folder).expect("a folder");
/// let scenario = Scenario::load("step", &[Override::parse("duration_s=0.1")?])?;
/// let controller = AnyController::new(&scenario)?;
/// let log = RunLog::create(folder.join("step.mcap"), &scenario, &controller)?;
/// Run::new(&scenario).controller(controller).log::<Error>(log)?;
/// let mut speed = 0.0;
/// let file = read_log(folder.join("step.mcap"), |_, message| {
///     if let LogMessage::Odom(odom) = message {
///         speed = odom.twist.twist.linear.x;
///     }
///     Ok(())
/// })?;
/// assert!(file.complete && file.scenario == scenario && speed > 0.0);
/// assert_eq!(file.counts["/vehicle_state"], 100); // 0.1 s at 1 kHz
/// # std::fs::remove_dir_all(&folder).ok();
/// # Ok::<(), Error>(())
/// ```
///
/// # Errors
/// [`LogError::Read`], [`LogError::Damaged`] if a checksum or a record is wrong, [`LogError::Lacks`] if it is not a run
/// of this program; what is wrong with its scenario; whatever `on` returns.
pub fn read_log(
    path: impl AsRef<Path>,
    on: impl FnMut(u64, LogMessage) -> Result<(), Error>,
) -> Result<LogFile, Error> {
    read_log_watched(path, |_| true, on)
}

/// [`read_log`] that calls `watch` with the part read, 0 to 1, every quarter of a megabyte, and
/// stops where that says false.
///
/// # Errors
/// As [`read_log`], and [`LogError::Stopped`].
pub(crate) fn read_log_watched(
    path: impl AsRef<Path>,
    watch: impl FnMut(f64) -> bool,
    mut on: impl FnMut(u64, LogMessage) -> Result<(), Error>,
) -> Result<LogFile, Error> {
    let path = path.as_ref();
    let mut reading = Reading::new(path);
    let ending = each_record(path, watch, |record| match reading.take(record)? {
        Some((time, message)) => on(time, message),
        None => Ok(()),
    })?;
    let complete = reading.ended(ending)?;
    reading.log_file(complete)
}

/// End of a file's records.
struct Ending {
    /// Bytes read.
    read: usize,
    /// Bytes of its footer, 0 if there was none.
    footer_bytes: usize,
    /// Are its last bytes those that end a whole file?
    magic: bool,
    /// Its error; none if all of it was read.
    error: Option<McapError>,
}

/// Hands each record of an MCAP file to `on`, and `watch` the part read so far.
fn each_record(
    path: &Path,
    mut watch: impl FnMut(f64) -> bool,
    mut on: impl FnMut(Record<'_>) -> Result<(), Error>,
) -> Result<Ending, Error> {
    let unreadable = |source| LogError::unreadable(path, source);
    let damaged = |reason| LogError::damaged(path, reason);
    let mut file = open_regular(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len().max(1);
    let options = LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_validate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
        .with_record_length_limit(size_limits::largest_record(length));
    let mut reader = LinearReader::new_with_options(options);
    let (mut read, mut last, mut footer_bytes, mut unpacked) = (0, Vec::new(), 0, 0);
    let error = loop {
        match reader.next_event() {
            None => break None,
            Some(Err(error)) => break Some(error),
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                // No more than there is, whatever a record says of its length.
                let left = length.saturating_sub(read as u64);
                let room = reader.insert(wanted.min(left as usize).max(BLOCK));
                let got = file.read(room).map_err(unreadable)?;
                last.extend_from_slice(&room[got.saturating_sub(mcap::MAGIC.len())..got]);
                last.drain(..last.len().saturating_sub(mcap::MAGIC.len()));
                read += got;
                if !watch((read as f64 / length as f64).min(1.0)) {
                    let path = path.to_path_buf();
                    return Err(LogError::Stopped { path }.into());
                }
                reader.notify_read(got);
            }
            Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                if opcode == mcap::records::op::FOOTER {
                    footer_bytes = data.len();
                }
                // Empty records also cost time.
                unpacked += size_limits::HEAD_BYTES + data.len() as u64;
                if unpacked > size_limits::most_unpacked(length) {
                    return Err(
                        damaged(format!("{length} bytes that unpack to more than {unpacked}")).into(),
                    );
                }
                size_limits::fits(opcode, data).map_err(damaged)?;
                on(mcap::parse_record(opcode, data).map_err(|error| damaged(error.to_string()))?)?;
            }
        }
    };
    Ok(Ending {
        read,
        footer_bytes,
        magic: last == mcap::MAGIC,
        error,
    })
}

/// A log while it is read.
struct Reading<'a> {
    path: &'a Path,
    seen: Seen,
    /// Of the first attachment.
    scenario: Option<Result<Scenario, omni_config::Error>>,
    /// What is wrong with it if it is one of ours, which its scenario shows: that may come later.
    doubt: Option<String>,
}

impl<'a> Reading<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            seen: Seen::default(),
            scenario: None,
            doubt: None,
        }
    }

    fn scenario_of(&self, text: &str) -> Result<Scenario, omni_config::Error> {
        let source = Source::embedded(format!("{} ({SCENARIO})", self.path.display()), text);
        Scenario::from_source(&source, &[])
    }

    /// The message that a record is, with its time; none of any other record.
    fn take(&mut self, record: Record<'_>) -> Result<Option<(u64, LogMessage)>, Error> {
        if self.doubt.is_some() && matches!(record, Record::Message { .. }) {
            return Ok(None);
        }
        let message = match self.seen.take(record) {
            Ok(message) => message,
            Err(reason) if self.seen.scenario.is_some() => {
                return Err(LogError::damaged(self.path, reason).into());
            }
            Err(reason) => {
                self.doubt.get_or_insert(reason);
                None
            }
        };
        if let (Some(text), None) = (&self.seen.scenario, &self.scenario) {
            let first = self.scenario_of(text);
            self.seen.expected_wheels = first.as_ref().ok().map(|s| s.vehicle().wheel.len());
            self.scenario = Some(first);
        }
        Ok(message)
    }

    /// Was it finished? Else its last chunk may be missing.
    fn ended(&self, ending: Ending) -> Result<bool, Error> {
        let lacks = |what: &str| Error::from(LogError::lacks(self.path, what));
        match ending.error {
            // No checksum covers that, and nothing that follows would show it.
            None if ending.footer_bytes != FOOTER_BYTES => {
                let reason = format!("a footer of {} bytes", ending.footer_bytes);
                Err(LogError::damaged(self.path, reason).into())
            }
            None => Ok(true),
            Some(McapError::BadMagic | McapError::UnexpectedEof)
                if ending.read <= BLOCK && self.seen.is_empty() =>
            {
                Err(lacks("not an MCAP file, or an empty one"))
            }
            Some(McapError::UnsupportedCompression(name)) => {
                Err(lacks(&format!("compressed with {name:?}: not a log of omnistep")))
            }
            // A killed run ends anywhere, but never with what ends a whole file.
            Some(McapError::UnexpectedEof) if !ending.magic => Ok(false),
            Some(error) => Err(LogError::damaged(self.path, error.to_string()).into()),
        }
    }

    fn log_file(mut self, complete: bool) -> Result<LogFile, Error> {
        let damaged = |reason| LogError::damaged(self.path, reason);
        // Of a log of something else nothing more is said.
        let text = self.seen.scenario.take().ok_or_else(|| {
            let what =
                "no attachment scenario.toml: not a log of omnistep, or of a run that was killed at its start";
            LogError::lacks(self.path, what)
        })?;
        if let Some(reason) = self.doubt {
            return Err(damaged(reason).into());
        }
        if complete {
            self.seen.agrees_with_its_statistics().map_err(damaged)?;
        }
        let scenario = match self.scenario.take() {
            Some(first) if self.seen.scenarios == 1 => first?,
            _ => self.scenario_of(&text)?,
        };
        let seen = self.seen;
        if let Some(found) = seen.wheels {
            // Where the scenario came behind its states.
            fitting_wheels(found, scenario.vehicle().wheel.len()).map_err(damaged)?;
        }
        // It follows from the scenario, also for logs that do not say it.
        let wheel_model_valid = scenario.beyond_balls().is_none();
        let says = |(key, value): (&str, &str)| seen.run.get(key).is_some_and(|said| said == value);
        Ok(LogFile {
            own_controller: says(OWN_CONTROLLER),
            recorded: says(RECORDED),
            run: seen.run,
            outcome: seen.outcome.map(|mut outcome| {
                outcome.wheel_model_valid = wheel_model_valid;
                outcome
            }),
            scenario,
            complete,
            until_ns: seen.until_ns,
            counts: seen.counts,
            foreign: seen.foreign,
            path: self.path.to_path_buf(),
        })
    }
}

/// What was read so far.
#[derive(Default)]
struct Seen {
    scenario: Option<String>,
    run: BTreeMap<String, String>,
    outcome: Option<Outcome>,
    topics: BTreeMap<u16, String>,
    counts: BTreeMap<String, u64>,
    foreign: u64,
    until_ns: u64,
    attachments: u64,
    tables: u64,
    /// Did this program write it?
    ours: bool,
    statistics: Option<Statistics>,
    /// Attachments of a scenario.
    scenarios: u64,
    /// Wheels of the vehicle, once the scenario is there.
    expected_wheels: Option<usize>,
    /// Wheels of every state so far.
    wheels: Option<usize>,
}

/// A state has as many wheels as the vehicle: one of fewer would be columns out of nothing.
fn fitting_wheels(found: usize, expected: usize) -> Result<(), String> {
    if found == expected {
        Ok(())
    } else {
        let topic = topic::VEHICLE_STATE;
        Err(format!(
            "{topic}: a message with {found} wheels, expected {expected}"
        ))
    }
}

impl Seen {
    fn is_empty(&self) -> bool {
        self.scenario.is_none() && self.topics.is_empty()
    }

    /// What was taken out of a whole log shows, even if checksums were left out: at the end it says how much there is.
    fn agrees_with_its_statistics(&self) -> Result<(), String> {
        let Some(said) = &self.statistics else {
            return if self.ours {
                Err("no statistics".into())
            } else {
                Ok(())
            };
        };
        let messages = self.counts.values().sum::<u64>() + self.foreign;
        for (what, here, said) in [
            ("messages", messages, said.message_count),
            ("attachments", self.attachments, said.attachment_count.into()),
            ("metadata records", self.tables, said.metadata_count.into()),
        ] {
            if here != said {
                return Err(format!("{here} {what}, but its statistics count {said}"));
            }
        }
        Ok(())
    }

    fn take(&mut self, record: Record<'_>) -> Result<Option<(u64, LogMessage)>, String> {
        match &record {
            Record::Attachment { .. } => self.attachments += 1,
            Record::Metadata(_) => self.tables += 1,
            _ => {}
        }
        match record {
            Record::Header(header) => self.ours = header.library.starts_with("omnistep "),
            Record::Statistics(statistics) => self.statistics = Some(statistics),
            Record::Attachment { header, data, .. } if header.name == SCENARIO => {
                self.scenarios += 1;
                let text = String::from_utf8(data.into_owned());
                let wrong = text.as_ref().err().map(|error| format!("{SCENARIO}: {error}"));
                self.scenario = Some(text.unwrap_or_default());
                return wrong.map_or(Ok(None), Err);
            }
            Record::Metadata(table) if table.name == RUN => self.run = table.metadata,
            Record::Metadata(table) if table.name == OUTCOME => {
                let value = |text: String| serde_json::from_str(&text).unwrap_or(serde_json::Value::Null);
                let fields = table.metadata.into_iter().map(|(key, text)| (key, value(text)));
                let fields = serde_json::Value::Object(fields.collect());
                let outcome = serde_json::from_value(fields);
                self.outcome = Some(outcome.map_err(|error| format!("metadata {OUTCOME}: {error}"))?);
            }
            Record::Channel(channel) => {
                self.topics.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => return self.message(&header, &data),
            // Where a flipped bit made a chunk of something else, nothing of it would be missed.
            Record::Unknown { opcode, .. } => return Err(format!("a record of unknown kind {opcode:#x}")),
            _ => {}
        }
        Ok(None)
    }

    fn message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<Option<(u64, LogMessage)>, String> {
        let Some(name) = self.topics.get(&header.channel_id) else {
            return Err(format!(
                "a message of channel {}, which does not exist",
                header.channel_id
            ));
        };
        let message = match name.as_str() {
            topic::VEHICLE_STATE => {
                let state: VehicleState = decode(data)?;
                let found = state.wheels.len();
                fitting_wheels(found, self.expected_wheels.or(self.wheels).unwrap_or(found))?;
                self.wheels = Some(found);
                LogMessage::VehicleState(state)
            }
            topic::SENSORS => LogMessage::Sensors(decode(data)?),
            topic::CONTROLLER_SIGNALS => LogMessage::ControllerSignals(decode(data)?),
            topic::TF => LogMessage::Tf(decode(data)?),
            topic::JOINT_STATES => LogMessage::JointStates(decode(data)?),
            topic::ODOM => match Box::<Odometry>::new(decode(data)?) {
                odometry if odometry.header.frame_id == WORLD_LINK => LogMessage::GroundTruth(odometry),
                odometry => LogMessage::Odom(odometry),
            },
            topic::GROUND_TRUTH => LogMessage::GroundTruth(Box::new(decode(data)?)),
            topic::CMD_VEL => LogMessage::CmdVel(decode(data)?),
            topic::MARKERS => LogMessage::Markers(decode(data)?),
            topic::ROBOT_DESCRIPTION => LogMessage::RobotDescription(decode(data)?),
            topic::TERRAIN => LogMessage::Terrain(decode(data)?),
            _ => {
                self.foreign += 1;
                return Ok(None);
            }
        };
        let count = match self.counts.get_mut(name) {
            Some(count) => count,
            None => self.counts.entry(name.clone()).or_default(),
        };
        // Every topic counts from 0: a chunk that is not there shows.
        if u64::from(header.sequence) != *count {
            let sequence = header.sequence;
            return Err(format!("{name}: message {sequence} follows {count} messages"));
        }
        *count += 1;
        self.until_ns = self.until_ns.max(header.log_time);
        Ok(Some((header.log_time, message)))
    }
}

/// A message from little-endian CDR with its encapsulation header.
fn decode<M: RosMessage + DeserializeOwned>(data: &[u8]) -> Result<M, String> {
    let body = data
        .strip_prefix(&CDR_LE)
        .ok_or("a message that is not little-endian CDR")?;
    match cdr_encoding::from_bytes::<M, LittleEndian>(body) {
        Ok((message, used)) if used == body.len() => Ok(message),
        Ok(_) => Err(format!(
            "a message that is not a {} of this version of omnistep",
            M::TYPE
        )),
        Err(error) => Err(format!(
            "a message that is not a {} of this version of omnistep: {error}",
            M::TYPE
        )),
    }
}
