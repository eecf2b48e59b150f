//! Frames of a ROS 2 run.

use clap::ValueEnum;

/// Frames that a ROS 2 run publishes.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TfChoice {
    /// odom, base_link, world, hinges, wheels and imu_link.
    All,
    /// The same without hinges and wheels, which a robot_state_publisher then publishes.
    Odom,
    /// None.
    None,
}
