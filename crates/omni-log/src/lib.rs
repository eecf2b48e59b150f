#![doc = include_str!("../README.md")]
//!
//! # In this crate
//!
//! [`RunLog`] writes a run while it goes on, [`record`] and [`run_logged`] run a scenario into one; [`read_log`] and [`LoggedRun`] read
//! it back, [`replay`] feeds its measurements to the controller again; [`Recording`] makes such a log of what was measured on a
//! vehicle. With the feature `live`, `run_live` serves a run to
//! viewers while it goes on.
#![forbid(unsafe_code)]

mod error;
mod frames;
#[cfg(feature = "live")]
mod live;
mod located;
mod logged_run;
mod messages;
mod part_file;
mod reader;
mod record;
mod recording;
mod replay;
pub mod ros2;
mod rotation;
mod run_log;
mod size_limits;
mod track;
mod tree;
mod urdf;
mod writer;

pub use error::Error;
#[cfg(feature = "live")]
pub use live::{Live, run_live};
pub use logged_run::LoggedRun;
pub use messages::topic;
pub use part_file::FinishedLog;
pub use reader::{LogFile, LogMessage, read_log};
pub use record::{Record, record, run_logged};
pub use recording::Recording;
pub use replay::{Difference, Replay, WheelReplay, replay};
pub use run_log::RunLog;
pub use track::Track;
pub use urdf::{
    BASE_LINK, ODOM_LINK, WORLD_LINK, ground_urdf, link_frame_m, link_name, vehicle_urdf, wheel_link,
};
pub use writer::{Channel, LogError, LogWriter};
