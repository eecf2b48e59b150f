//! A run as an MCAP file.
//!
//! The scenario as resolved, its vehicle inside, is the attachment `scenario.toml`; policy, seed
//! and version are the metadata `run`, which says `controller = own` too where that is the user's
//! own, the metrics at the end the metadata `outcome`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use omni_config::Scenario;
use omni_sim::Outcome;
use omni_sim::Period;
use omni_sim::controller::AnyController;

use crate::in_memory::InMemory;
use crate::messages::{Messages, Sink};
use crate::part_file::{PartFile, Place};
use crate::ros2::RosMessage;
use crate::{FinishedLog, LogError, LogWriter};

/// Name of the attachment that holds the scenario.
pub(crate) const SCENARIO: &str = "scenario.toml";
/// Key and value of the metadata of a run whose controller is not the scenario's.
pub(crate) const OWN_CONTROLLER: (&str, &str) = ("controller", "own");
/// Those of a log that was not simulated.
pub(crate) const RECORDED: (&str, &str) = ("controller", "recorded");
/// Name of the attachment that says how a recording was read.
pub(crate) const MAP: &str = "map.toml";
/// Names of the metadata records.
pub(crate) const RUN: &str = "run";
pub(crate) const OUTCOME: &str = "outcome";

/// Writes a run in progress; the file receives its name when [`RunLog::finish`] has succeeded.
pub struct RunLog<P: Place = PartFile> {
    writer: LogWriter<P>,
    messages: Messages,
}

impl<P: Place> Sink for LogWriter<P> {
    type Error = LogError;

    fn send<M: RosMessage>(
        &mut self,
        topic: &'static str,
        time_ns: u64,
        message: &M,
    ) -> Result<(), LogError> {
        let channel = self.channel::<M>(topic)?;
        self.write(&channel, time_ns, message)
    }
}

impl RunLog {
    /// Starts the log of a scenario's run at `path`, with the controller that it will have.
    ///
    /// # Errors
    /// As [`LogWriter::create`] and [`LogWriter::metadata`].
    pub fn create(
        path: impl AsRef<Path>,
        scenario: &Scenario,
        controller: &AnyController,
    ) -> Result<Self, LogError> {
        Self::begin(LogWriter::create(&path)?, path.as_ref(), scenario, controller)
    }

    /// Adds the outcome and completes the file.
    ///
    /// # Errors
    /// As [`LogWriter::finish`].
    pub fn finish(mut self, outcome: &Outcome) -> Result<FinishedLog, LogError> {
        self.writer.metadata(OUTCOME, table(outcome))?;
        self.writer.finish()
    }

    /// Ends the log of a run that was stopped: all of it until now stays in its `.part` file, whose name is returned.
    ///
    /// # Errors
    /// As [`LogWriter::leave`].
    pub fn leave(self) -> Result<PathBuf, LogError> {
        self.writer.leave()
    }
}

impl RunLog<InMemory> {
    /// The same in memory, without files.
    ///
    /// ```
    /// use omni_log::RunLog;
    /// use omni_sim::{SteppedRun, config::{Override, Scenario}, controller::AnyController};
    /// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
    /// let controller = AnyController::new(&scenario)?;
    /// let mut log = RunLog::in_memory(&scenario, &controller)?;
    /// let mut run = SteppedRun::new(&scenario, controller)?;
    /// for _ in 0..100 {
    ///     run.step(&run.simulation().scenario_command())?;
    ///     log.push(run.simulation().period())?;
    /// }
    /// let mut bytes = log.take();
    /// bytes.extend(log.finish(&run.outcome())?);
    /// assert_eq!((&bytes[..5], &bytes[bytes.len() - 8..]), (&b"\x89MCAP"[..], &b"\x89MCAP0\r\n"[..]));
    /// # Ok::<(), omni_log::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`LogWriter::in_memory`] and [`LogWriter::metadata`].
    pub fn in_memory(scenario: &Scenario, controller: &AnyController) -> Result<Self, LogError> {
        let name = scenario.name.as_str();
        Self::begin(LogWriter::in_memory(name)?, Path::new(name), scenario, controller)
    }

    /// As [`LogWriter::take`].
    pub fn take(&mut self) -> Vec<u8> {
        self.writer.take()
    }

    /// Adds the outcome and returns the last piece of the file.
    ///
    /// # Errors
    /// As [`LogWriter::finish`].
    pub fn finish(mut self, outcome: &Outcome) -> Result<Vec<u8>, LogError> {
        self.writer.metadata(OUTCOME, table(outcome))?;
        self.writer.finish()
    }
}

/// The metadata `outcome`.
fn table(outcome: &Outcome) -> BTreeMap<String, String> {
    match serde_json::to_value(outcome) {
        Ok(serde_json::Value::Object(fields)) => {
            fields.into_iter().map(|(k, v)| (k, v.to_string())).collect()
        }
        _ => BTreeMap::new(),
    }
}

impl<P: Place> RunLog<P> {
    fn begin(
        mut writer: LogWriter<P>,
        path: &Path,
        scenario: &Scenario,
        controller: &AnyController,
    ) -> Result<Self, LogError> {
        let mut facts = vec![
            ("omnistep", omni_sim::VERSION.to_owned()),
            ("scenario", scenario.name.clone()),
            ("vehicle", scenario.vehicle().name.clone()),
            ("policy", controller.policy().to_owned()),
            ("engine", scenario.physics.engine.name().into()),
            ("seed", scenario.seed.to_string()),
        ];
        if controller.is_own() {
            let (key, value) = OWN_CONTROLLER;
            facts.push((key, value.into()));
        }
        writer.metadata(RUN, facts.into_iter().map(|(k, v)| (k.to_owned(), v)).collect())?;
        // Whole, with the vehicle inside. Only a seed that TOML's integers cannot hold is rejected here.
        let text = scenario.to_resolved_toml().map_err(|error| LogError::Io {
            path: path.to_path_buf(),
            source: std::io::Error::other(error),
        })?;
        writer.attachment(SCENARIO, "application/toml", text.as_bytes())?;
        let messages = Messages::new(scenario, controller);
        messages.describe(None, &mut writer)?;
        Ok(Self { writer, messages })
    }

    /// Adds one control period.
    ///
    /// # Errors
    /// As [`LogWriter::write`].
    pub fn push(&mut self, period: &Period) -> Result<(), LogError> {
        self.messages.push(period, &mut self.writer)
    }
}
