//! Traces to MCAP with ROS 2 messages: the only room that names mcap.

pub mod ros2;
mod run_log;
mod writer;

pub use run_log::RunLog;
pub use writer::{Channel, LogError, LogWriter};
