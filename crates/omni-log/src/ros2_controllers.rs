//! The YAML file for ros2_control's own controllers.
//!
//! Parameters, the order of wheels and the sense of their turning match ros2_controllers 4.42 (Jazzy), 5.17 (Kilted)
//! and 6.9 (Rolling). Nothing is written that would drive the vehicle otherwise than its own kinematics do.

mod comparison;
mod mecanum;
mod omni;

use std::fmt::Write;

use omni_config::{Error, Limits, Vehicle};

use crate::urdf::{BASE_LINK, ODOM_LINK, wheel_link};
use comparison::{PART, refused};
use mecanum::Mecanum;
use omni::Omni;

/// Rate of the controllers and of the plant's joint messages \[Hz\].
const UPDATE_HZ: u32 = 100;
/// Age at which a command is dropped \[s\]; the plant's own is the same.
const TIMEOUT_S: f64 = 0.5;

/// The yaml of ros2_control's controller manager for a vehicle: `omni_wheel_drive_controller` for omni wheels evenly
/// spaced on a circle, `mecanum_drive_controller` for four mecanum wheels, each with a `joint_state_broadcaster`.
///
/// Joints are the URDF's ([`ros2_control_urdf`](crate::ros2_control_urdf)). The controllers command velocities of
/// wheels, not of motors, so that gears do not affect them. Wheels may be 0.1 % off the places and directions that a
/// controller assumes.
///
/// # Errors
/// [`Error::Key`] with the first wheel that neither controller would drive as the vehicle's kinematics
/// do: another place, radius or roller, or a wheel whose joint turns positively the other way.
///
/// ```
/// use omni_config::Vehicle;
/// use omni_log::ros2_controllers;
/// let yaml = ros2_controllers(&Vehicle::load("mecanum4")?)?;
/// assert!(yaml.contains("sum_of_robot_center_projection_on_X_Y_axis: 0.45 ")); // 0.25 m + 0.2 m
/// let error = ros2_controllers(&Vehicle::load("omni3")?).expect_err("turns the other way");
/// assert!(error.to_string().starts_with("vehicle omni3: wheel[0].rolling_direction: [0, 1], allowed: [0, -1]"));
/// # Ok::<(), omni_config::Error>(())
/// ```
pub fn ros2_controllers(vehicle: &Vehicle) -> Result<String, Error> {
    let oblique = |i: &usize| vehicle.wheel[*i].roller_angle_rad.abs() > PART;
    let wheels = 0..vehicle.wheel.len();
    let mut text = String::new();
    // A String takes all that is written.
    let _ = match wheels.clone().find(oblique) {
        None => omni_yaml(&mut text, vehicle, &Omni::of(vehicle)?),
        Some(_) if wheels.len() == 4 && wheels.clone().all(|i| oblique(&i)) => {
            mecanum_yaml(&mut text, vehicle, &Mecanum::of(vehicle)?)
        }
        Some(i) => {
            let angle = vehicle.wheel[i].roller_angle_rad;
            return Err(refused(vehicle, i, "roller_angle_rad", &angle.to_string(), KINDS));
        }
    };
    Ok(text)
}

/// The vehicles of the two controllers.
const KINDS: &str = "either omni wheels evenly spaced on a circle (omni_wheel_drive_controller) or four mecanum wheels (mecanum_drive_controller)";

/// A number that ROS reads as a double: with a point, without an exponent.
fn double(value: f64) -> String {
    let text = (value + 0.0).to_string(); // no negative zero
    if text.contains('.') {
        text
    } else {
        format!("{text}.0")
    }
}

fn joint(vehicle: &Vehicle, wheel: usize) -> String {
    format!("\"{}\"", wheel_link(&vehicle.wheel[wheel].name)) // letters, digits, _ and -
}

/// The controller manager and the broadcaster of joints, for a controller of that package and class.
fn manager(text: &mut String, vehicle: &Vehicle, controller: &str, class: &str) -> std::fmt::Result {
    write!(
        text,
        "\
# ros2_control's controllers for the vehicle {name}. Units are m, rad and s.
controller_manager:
  ros__parameters:
    update_rate: {UPDATE_HZ} # [Hz], the rate of /joint_states and /clock
    use_sim_time: true # the simulation publishes /clock
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    {controller}:
      type: {controller}/{class}

joint_state_broadcaster:
  ros__parameters:
    use_local_topics: true # the hardware component reads /joint_states of the simulation

{controller}:
  ros__parameters:
",
        name = vehicle.name
    )
}

fn frames(text: &mut String) -> std::fmt::Result {
    writeln!(text, "    odom_frame_id: {ODOM_LINK}")?;
    writeln!(text, "    base_frame_id: {BASE_LINK}")
}

fn omni_yaml(text: &mut String, vehicle: &Vehicle, drive: &Omni) -> std::fmt::Result {
    manager(
        text,
        vehicle,
        "omni_wheel_drive_controller",
        "OmniWheelDriveController",
    )?;
    let names: Vec<_> = drive.order.iter().map(|&i| joint(vehicle, i)).collect();
    writeln!(
        text,
        "    wheel_names: [{}] # in counter-clockwise order; positive rotation drives each one clockwise about the origin",
        names.join(", ")
    )?;
    let (offset, reach, radius) = (drive.offset_rad, drive.robot_radius_m, drive.wheel_radius_m);
    writeln!(
        text,
        "    wheel_offset: {} # angle of the first wheel from the forward direction",
        double(offset)
    )?;
    writeln!(
        text,
        "    robot_radius: {} # radius of the circle of the wheels",
        double(reach)
    )?;
    writeln!(text, "    wheel_radius: {}", double(radius))?;
    frames(text)?;
    writeln!(text, "    position_feedback: true # odometry from wheel angles")?;
    writeln!(
        text,
        "    cmd_vel_timeout: {} # this controller has no speed limits",
        double(TIMEOUT_S)
    )
}

fn mecanum_yaml(text: &mut String, vehicle: &Vehicle, drive: &Mecanum) -> std::fmt::Result {
    manager(
        text,
        vehicle,
        "mecanum_drive_controller",
        "MecanumDriveController",
    )?;
    for (corner, &wheel) in mecanum::CORNERS.iter().zip(&drive.wheels) {
        writeln!(
            text,
            "    {}_wheel_command_joint_name: {}",
            corner.name,
            joint(vehicle, wheel)
        )?;
    }
    let [x, y, theta] = drive.base_in_centre.map(double);
    writeln!(text, "    kinematics:")?;
    writeln!(text, "      wheels_radius: {}", double(drive.wheels_radius_m))?;
    writeln!(
        text,
        "      sum_of_robot_center_projection_on_X_Y_axis: {} # half of the sum of wheelbase and track",
        double(drive.reach_m)
    )?;
    writeln!(
        text,
        "      base_frame_offset: {{ x: {x}, y: {y}, theta: {theta} }} # pose of {BASE_LINK} relative to the wheels' middle"
    )?;
    frames(text)?;
    writeln!(text, "    reference_timeout: {}", double(TIMEOUT_S))?;
    vehicle
        .limits
        .as_ref()
        .map_or(Ok(()), |limits| speed_limits(text, limits))
}

/// The vehicle's limits, which only the mecanum controller accepts.
fn speed_limits(text: &mut String, limits: &Limits) -> std::fmt::Result {
    let mut axis = |name: &str, speed: f64, acceleration: Option<f64>| {
        writeln!(text, "{name}")?;
        writeln!(text, "        max_velocity: {}", double(speed))?;
        writeln!(text, "        min_velocity: {}", double(-speed))?;
        acceleration.map_or(Ok(()), |a| {
            // In reverse they are these with the other sign.
            writeln!(text, "        max_acceleration: {}", double(a))?;
            writeln!(text, "        max_deceleration: {}", double(-a))
        })
    };
    axis("    linear:\n      x:", limits.vx_m_s, limits.linear_m_s2)?;
    axis("      y:", limits.vy_m_s, limits.linear_m_s2)?;
    axis("    angular:\n      z:", limits.wz_rad_s, limits.yaw_rad_s2)
}
