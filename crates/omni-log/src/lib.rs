#![doc = include_str!("../README.md")]
//!
//! # In this crate
//!
//! [`RunLog`] writes a run in progress, [`LogRun`] runs a scenario into a log; [`read_log`] and [`LoggedRun`] read it
//! back, [`replay`] replays its measurements through the controller; [`Recording`] writes measurements on a vehicle as
//! such a log. With the feature `live`, `run_live` serves a run in progress to viewers, with `ros2` also to a ROS 2
//! graph.
#![forbid(unsafe_code)]

mod base_pose;
mod error;
mod frames;
mod ground_around;
mod in_memory;
#[cfg(feature = "live")]
mod live;
mod log_error;
mod log_run;
mod logged_run;
mod message_rates;
mod messages;
mod mjcf;
mod part_file;
mod reader;
mod recording;
mod recovered;
mod replay;
pub mod ros2;
mod ros2_controllers;
mod ros2_package;
mod rotation;
mod run_log;
mod scene;
mod size_limits;
pub mod topic;
mod track;
mod tree;
mod twist_covariance;
mod urdf;
mod writer;
mod xml;

pub use error::Error;
pub use in_memory::InMemory;
#[cfg(feature = "ros2")]
pub use live::{GoalPlanner, Ros2, TfFrames};
#[cfg(feature = "live")]
pub use live::{Live, Opened, Pilot, Until, run_live};
pub use log_error::LogError;
pub use log_run::{LogRun, Logged};
pub use logged_run::LoggedRun;
pub use mjcf::mjcf;
pub use part_file::{FinishedLog, PartFile, Place};
pub use reader::{LogFile, LogMessage, read_log};
pub use recording::Recording;
pub use recovered::recover;
pub use replay::{Difference, Replay, WheelReplay, replay};
pub use ros2_controllers::ros2_controllers;
pub use ros2_package::ros2_messages;
pub use run_log::RunLog;
pub use scene::{View, driving_pace, logged_scene};
pub use track::Track;
pub use urdf::{
    BASE_LINK, IMU_LINK, JointInterface, MAP_LINK, ODOM_LINK, WORLD_LINK, ground_urdf, link_frame_m,
    link_name, ros2_control_urdf, vehicle_urdf, wheel_link,
};
pub use writer::{Channel, LogWriter};
