//! A vehicle as URDF with the block that ros2_control reads: wheels that are driven over two topics.

use std::io;

use omni_config::{Vehicle, WheelSpec};

use super::robot;
use super::vehicle::{wheel_limits, wheel_link, write_parts};
use crate::xml::{Xml, element, text_of};

/// The wheels' commands where they are driven one by one, as ros2_control does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum JointInterface {
    /// Velocities \[rad/s\], which the vehicle's loops keep.
    Velocity,
    /// Torques at the wheels \[N.m\].
    Effort,
}

impl JointInterface {
    /// Its name in ros2_control.
    ///
    /// ```
    /// assert_eq!(omni_log::JointInterface::Effort.name(), "effort");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Effort => "effort",
        }
    }
}

/// The hardware component: of ros2_control's package `joint_state_topic_hardware_interface`.
const PLUGIN: &str = "joint_state_topic_hardware_interface/JointStateTopicSystem";
/// Its name, and the name of its node, which differs from a run's node.
const NAME: &str = "omnistep_wheels";
/// Its parameters; topics are in the namespace of the controller manager. A command is sent in every period, because a
/// run treats silence as a stop: by itself the component sends only what differs from the state.
const PARAMETERS: [(&str, &str); 3] = [
    ("joint_commands_topic", "joint_commands"),
    ("joint_states_topic", "joint_states"),
    ("trigger_joint_command_threshold", "-1"),
];
/// Controllers fail on a state that is not yet known.
const INITIAL_VALUE: &str = "0.0";

/// The vehicle as URDF with a `<ros2_control>` block: the wheels as joints that are commanded over
/// the topic `joint_commands` and seen on `joint_states`, both in the namespace of the controller
/// manager, by ros2_control's own hardware component.
///
/// Joints are as in [`vehicle_urdf`](crate::vehicle_urdf). Commands are limited to its stated limits. Passive hinges
/// are not in the block: a command of the component names every joint of it, and has no value for one that is not
/// commanded.
///
/// ```
/// use omni_config::Vehicle;
/// use omni_log::{JointInterface, ros2_control_urdf};
/// let urdf = ros2_control_urdf(&Vehicle::load("mecanum4")?, JointInterface::Velocity);
/// assert_eq!(urdf.matches("<command_interface name=\"velocity\">").count(), 4);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn ros2_control_urdf(vehicle: &Vehicle, command: JointInterface) -> String {
    robot(&vehicle.name, |xml| {
        write_parts(xml, vehicle)?;
        let attributes = [("name", NAME), ("type", "system")];
        element(xml, "ros2_control", &attributes, |xml| {
            element(xml, "hardware", &[], |xml| {
                text_of(xml, "plugin", &[], PLUGIN)?;
                let mut parameters = PARAMETERS.iter();
                parameters.try_for_each(|(name, value)| param(xml, name, value))
            })?;
            let mut wheels = vehicle.wheel.iter();
            wheels.try_for_each(|wheel| driven(xml, vehicle, wheel, command))
        })
    })
}

fn param(xml: &mut Xml, name: &str, value: &str) -> io::Result<()> {
    text_of(xml, "param", &[("name", name)], value)
}

fn driven(xml: &mut Xml, vehicle: &Vehicle, wheel: &WheelSpec, command: JointInterface) -> io::Result<()> {
    let [effort, velocity] = wheel_limits(vehicle, wheel);
    let most = match command {
        JointInterface::Velocity => velocity,
        JointInterface::Effort => effort,
    };
    element(xml, "joint", &[("name", &wheel_link(&wheel.name))], |xml| {
        element(xml, "command_interface", &[("name", command.name())], |xml| {
            param(xml, "min", &(-most).to_string())?;
            param(xml, "max", &most.to_string())
        })?;
        states(xml)
    })
}

/// What `/joint_states` says of a joint; the component takes nothing less.
fn states(xml: &mut Xml) -> io::Result<()> {
    ["position", "velocity", "effort"].iter().try_for_each(|name| {
        element(xml, "state_interface", &[("name", name)], |xml| {
            param(xml, "initial_value", INITIAL_VALUE)
        })
    })
}
