//! Options of `omnistep export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::CommandInterface;

#[derive(Args)]
pub(crate) struct ExportArgs {
    /// A built-in vehicle, or a .toml file; with --format mjcf, rust and c also a scenario; none with --format
    /// ros2-msgs.
    #[arg(required_if_eq_any = [
        ("format", "mjcf"),
        ("format", "urdf"),
        ("format", "ros2-control"),
        ("format", "rust"),
        ("format", "c"),
    ])]
    pub(crate) name: Option<String>,
    /// Format to write.
    #[arg(long, value_enum)]
    pub(crate) format: Format,
    /// With --format mjcf, rust and c: a vehicle instead of the scenario's, a built-in one or a .toml file.
    #[arg(long)]
    pub(crate) vehicle: Option<String>,
    /// Replaces a key of the vehicle; with --format mjcf, rust and c, a key of the scenario, such as
    /// vehicle.rollers.count=9 for its vehicle; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// With --format urdf: adds a block for ros2_control, whose controllers command this interface
    /// of each wheel over /joint_commands.
    #[arg(long, value_enum, value_name = "INTERFACE")]
    pub(crate) ros2_control: Option<CommandInterface>,
    /// File to write; standard output if left out. With --format ros2-msgs a folder; omnistep_msgs if left out.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Output formats of a vehicle or a scenario.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// A scenario for MuJoCo, with every roller as a separate body, and the ground.
    Mjcf,
    /// A vehicle.
    Urdf,
    /// A vehicle's omni_wheel_drive_controller or mecanum_drive_controller: parameters of a controller manager.
    Ros2Control,
    /// The ROS 2 package omnistep_msgs, which defines the messages of this program: a folder.
    Ros2Msgs,
    /// A scenario's controller as constants for firmware in Rust: its vehicle, policy and control period.
    Rust,
    /// The same constants for firmware in C.
    C,
}

impl ExportArgs {
    /// The vehicle or scenario; empty with the one format that has none.
    pub(crate) fn name(&self) -> &str {
        self.name.as_deref().unwrap_or_default()
    }
}
