//! Traces to MCAP with ROS 2 messages, and back: the only room that names mcap.

mod bounds;
mod frames;
mod logged_run;
mod messages;
mod part_file;
mod reader;
pub mod ros2;
mod run_log;
mod turn;
mod writer;

pub use logged_run::LoggedRun;
pub use messages::topic;
#[cfg(feature = "live")]
pub(crate) use messages::{Messages, Sink};
pub use part_file::FinishedLog;
pub use reader::{LogFile, LogMessage, read_log};
pub use run_log::RunLog;
pub use writer::{Channel, LogError, LogWriter};
