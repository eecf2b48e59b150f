//! Quantity of a wheel that ros2_control commands.

use clap::ValueEnum;

/// Quantity of a wheel that ros2_control commands.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CommandInterface {
    Velocity,
    Effort,
}
