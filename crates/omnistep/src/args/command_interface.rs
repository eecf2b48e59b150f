//! What ros2_control commands of a wheel.

use clap::ValueEnum;

/// What ros2_control commands of a wheel.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CommandInterface {
    Velocity,
    Effort,
}
