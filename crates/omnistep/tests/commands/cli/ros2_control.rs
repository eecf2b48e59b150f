//! The configuration of ros2_control's controllers for a vehicle, against what they do with it.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, TAU};
use std::path::Path;

use omni_config::Vehicle;
use omni_core::{BodyTwist, Kinematics};

use super::{omnistep, refused, stdout, words};

/// Forward, sideways and about, all at once: the largest is of the order of 1, so wheels turn at some 10 rad/s.
const TWISTS: [[f64; 3]; 3] = [[0.7, -0.4, 0.9], [-0.3, 0.8, -1.3], [0.05, 0.6, 0.2]];
/// Rounding of a dozen operations at 50 rad/s is 1e-14; the numbers are written with all their digits.
const ROUNDING_RAD_S: f64 = 1e-12;

fn yaml(folder: &Path, vehicle: &str) -> String {
    stdout(&omnistep(
        folder,
        &["export", vehicle, "--format", "ros2-control"],
    ))
}

/// The value of a key that there is once, without its comment.
fn value<'a>(yaml: &'a str, key: &str) -> &'a str {
    let mut lines = yaml
        .lines()
        .filter_map(|line| line.trim().strip_prefix(key)?.strip_prefix(": "));
    let found = lines.next().unwrap_or_else(|| panic!("{key} in {yaml}"));
    assert!(lines.next().is_none(), "{key} twice");
    found.split(" #").next().unwrap()
}

fn number(yaml: &str, key: &str) -> f64 {
    let text = value(yaml, key);
    assert!(
        text.contains('.') && !text.contains('e'),
        "{key}: ROS takes {text} for no double"
    );
    text.parse().unwrap()
}

fn unquoted(name: &str) -> String {
    name.trim_matches('"').to_owned()
}

/// `OmniWheelDriveController::compute_and_set_wheel_velocities`: what it commands each joint [rad/s].
fn omni_wheel_drive_controller(yaml: &str, [vx, vy, wz]: [f64; 3]) -> BTreeMap<String, f64> {
    let names = value(yaml, "wheel_names").trim_matches(['[', ']']).split(", ");
    let names: Vec<_> = names.map(unquoted).collect();
    let between = TAU / names.len() as f64;
    let [offset, reach, radius] =
        ["wheel_offset", "robot_radius", "wheel_radius"].map(|key| number(yaml, key));
    assert!(
        reach > 0.0 && radius > 0.0,
        "it takes no others: there is no sign to turn wheels round"
    );
    let velocity = |i: usize| {
        let theta = between * i as f64 + offset;
        (theta.sin() * vx - theta.cos() * vy - wz * reach) / radius
    };
    names
        .into_iter()
        .enumerate()
        .map(|(i, name)| (name, velocity(i)))
        .collect()
}

struct MecanumParameters {
    offset: [f64; 3],
    lever: f64,
    radius: f64,
}

impl MecanumParameters {
    fn of(yaml: &str) -> Self {
        let offset = value(yaml, "base_frame_offset").trim_matches(['{', '}', ' ']);
        let mut parts = offset.split(", ").zip(["x", "y", "theta"]).map(|(part, key)| {
            let text = part.strip_prefix(key).unwrap().strip_prefix(": ").unwrap();
            assert!(text.contains('.'));
            text.parse().unwrap()
        });
        Self {
            offset: std::array::from_fn(|_| parts.next().unwrap()),
            lever: number(yaml, "sum_of_robot_center_projection_on_X_Y_axis"),
            radius: number(yaml, "wheels_radius"),
        }
    }
}

/// `MecanumDriveController::update_and_write_commands`: what it commands each joint [rad/s].
fn mecanum_drive_controller(yaml: &str, [vx, vy, wz]: [f64; 3]) -> BTreeMap<String, f64> {
    let given = MecanumParameters::of(yaml);
    let [x, y, theta] = given.offset;
    let (sin, cos) = theta.sin_cos();
    let vx_centre = cos * vx - sin * vy + y * wz;
    let vy_centre = sin * vx + cos * vy - x * wz;
    let corner = |name: &str, side: f64, turn: f64| {
        let joint = unquoted(value(yaml, &format!("{name}_wheel_command_joint_name")));
        (
            joint,
            (vx_centre + side * vy_centre + turn * given.lever * wz) / given.radius,
        )
    };
    BTreeMap::from([
        corner("front_left", -1.0, -1.0),
        corner("front_right", 1.0, 1.0),
        corner("rear_right", -1.0, 1.0),
        corner("rear_left", 1.0, -1.0),
    ])
}

/// `mecanum_drive_controller::Odometry::update`: the twist of the base.
fn mecanum_odometry(yaml: &str, wheels: &BTreeMap<String, f64>) -> [f64; 3] {
    let given = MecanumParameters::of(yaml);
    let [fl, fr, rr, rl] = ["front_left", "front_right", "rear_right", "rear_left"]
        .map(|name| wheels[&unquoted(value(yaml, &format!("{name}_wheel_command_joint_name")))]);
    let quarter = 0.25 * given.radius;
    let vx = quarter * (fl + rl + rr + fr);
    let vy = quarter * (-fl + rl - rr + fr);
    let wz = quarter / given.lever * (-fl - rl + rr + fr);
    let (sin, cos) = (-given.offset[2]).sin_cos();
    let turned = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
    let [vx, vy] = turned([vx, vy]);
    let [x, y] = turned([-given.offset[0], -given.offset[1]]);
    [vx + y * wz, vy - x * wz, wz]
}

/// What this project's kinematics have each joint turn at: the wheel itself, behind its gear.
fn kinematics<const N: usize>(vehicle: &Vehicle, twist: [f64; 3]) -> BTreeMap<String, f64> {
    let kinematics = Kinematics::new(&vehicle.layout::<f64, N>().unwrap()).unwrap();
    let actuators = kinematics.inverse(&BodyTwist::from_array(twist)).rad_s;
    let wheels = vehicle.wheel.iter().zip(actuators);
    wheels
        .map(|(wheel, rad_s)| (format!("wheel_{}", wheel.name), rad_s * wheel.gear))
        .collect()
}

fn same(theirs: &BTreeMap<String, f64>, ours: &BTreeMap<String, f64>, within_rad_s: f64) {
    assert!(theirs.keys().eq(ours.keys()), "{theirs:?} {ours:?}");
    for (joint, velocity) in ours {
        let off = (theirs[joint] - velocity).abs();
        assert!(
            off <= within_rad_s,
            "{joint}: {} rad/s there, {velocity} here",
            theirs[joint]
        );
    }
}

/// Writes a vehicle to a file and has its yaml.
fn written(folder: &Path, vehicle: &Vehicle) -> String {
    std::fs::write(folder.join("v.toml"), toml::to_string(vehicle).unwrap()).unwrap();
    yaml(folder, "v.toml")
}

/// A vehicle of omni wheels, evenly spaced, each turning positively clockwise, in an order of its own and behind gears.
fn omni_wheels(count: usize, offset_rad: f64) -> Vehicle {
    let mut vehicle = Vehicle::load("omni3").unwrap();
    let pattern = vehicle.wheel[0].clone();
    vehicle.wheel = (0..count)
        .map(|i| {
            // From wheel to wheel clockwise, twice as far: neither the controller's order nor its
            // start. An even count goes on by one.
            let step = if count.is_multiple_of(2) { 1 } else { 2 };
            let (sin, cos) = (offset_rad - (i * step) as f64 * TAU / count as f64).sin_cos();
            let mut wheel = pattern.clone();
            wheel.name = format!("w-{i}");
            wheel.position_m = [0.21 * cos, 0.21 * sin];
            wheel.rolling_direction = [sin, -cos];
            wheel.gear = 0.05;
            wheel
        })
        .collect();
    vehicle
}

#[test]
fn the_omni_controller_turns_every_joint_as_our_kinematics_do() {
    let folder = tempfile::tempdir().unwrap();
    fn held<const N: usize>(folder: &Path, offset_rad: f64, first: &str) {
        let vehicle = omni_wheels(N, offset_rad);
        let yaml = written(folder, &vehicle);
        assert!(value(&yaml, "wheel_names").starts_with(&format!("[\"{first}\"")));
        for twist in TWISTS {
            let theirs = omni_wheel_drive_controller(&yaml, twist);
            same(&theirs, &kinematics::<N>(&vehicle, twist), ROUNDING_RAD_S);
        }
    }
    held::<3>(folder.path(), 0.0, "wheel_w-0");
    held::<4>(folder.path(), FRAC_PI_4, "wheel_w-0");
    held::<4>(folder.path(), -0.3, "wheel_w-3"); // the first to the left of forward is the last of the file
    held::<5>(folder.path(), 0.2, "wheel_w-0");
}

#[test]
fn omni3_is_refused_for_its_sense_and_fits_turned_round() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["export", "omni3", "--format", "ros2-control"];
    assert_eq!(
        refused(folder.path(), &args),
        "error: vehicle omni3: wheel[0].rolling_direction: [0, 1], allowed: [0, -1], clockwise about the origin, \
         the direction that omni_wheel_drive_controller uses; docs/ros2-control.md shows how to reverse a wheel\n"
    );
    let mut vehicle = Vehicle::load("omni3").unwrap();
    let as_it_was = vehicle.clone();
    for wheel in &mut vehicle.wheel {
        wheel.rolling_direction = wheel.rolling_direction.map(|part| -part);
    }
    let yaml = written(folder.path(), &vehicle);
    for twist in TWISTS {
        let theirs = omni_wheel_drive_controller(&yaml, twist);
        // The file gives places to 1e-9 m and directions to 5e-10: at 1 m/s on wheels of 50 mm that is 2e-8 rad/s.
        same(&theirs, &kinematics::<3>(&vehicle, twist), 5e-8);
        // As the built-in file has it every joint turns the other way.
        let negative = kinematics::<3>(&as_it_was, twist)
            .into_iter()
            .map(|(name, rad_s)| (name, -rad_s));
        same(&theirs, &negative.collect(), 5e-8);
    }
}

#[test]
fn the_mecanum_controller_agrees_with_our_kinematics() {
    let folder = tempfile::tempdir().unwrap();
    // As built in; with the origin elsewhere and gears; driving to the left; all joints reversed.
    for (turn_rad, shift_m, gear) in [
        (0.0, [0.0, 0.0], 1.0),
        (0.0, [0.12, -0.03], 0.05),
        (2.0 * FRAC_PI_4, [0.0, 0.1], 1.0),
        (4.0 * FRAC_PI_4, [0.0, 0.0], 1.0),
        (0.4, [-0.2, 0.05], 1.0),
    ] {
        let mut vehicle = Vehicle::load("mecanum4").unwrap();
        let (sin, cos) = f64::sin_cos(turn_rad);
        for wheel in &mut vehicle.wheel {
            let turned = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
            let [x, y] = turned(wheel.position_m);
            wheel.position_m = [x + shift_m[0], y + shift_m[1]];
            wheel.rolling_direction = turned(wheel.rolling_direction);
            wheel.roller_angle_rad = FRAC_PI_4.copysign(wheel.roller_angle_rad); // the file's has ten digits
            wheel.gear = gear;
        }
        vehicle.wheel.rotate_left(1); // in an order of its own
        let yaml = written(folder.path(), &vehicle);
        for twist in TWISTS {
            let ours = kinematics::<4>(&vehicle, twist);
            same(&mecanum_drive_controller(&yaml, twist), &ours, ROUNDING_RAD_S);
            // And what it takes for the motion is the motion.
            let known = mecanum_odometry(&yaml, &ours);
            assert!(
                (0..3).all(|k| (known[k] - twist[k]).abs() < ROUNDING_RAD_S),
                "{known:?}"
            );
        }
    }
}

#[test]
fn the_yaml_of_mecanum4_is_short_and_takes_its_limits() {
    let folder = tempfile::tempdir().unwrap();
    let text = yaml(folder.path(), "mecanum4");
    for (key, expected) in [
        ("front_left_wheel_command_joint_name", "\"wheel_front_left\""),
        ("front_right_wheel_command_joint_name", "\"wheel_front_right\""),
        ("rear_right_wheel_command_joint_name", "\"wheel_rear_right\""),
        ("rear_left_wheel_command_joint_name", "\"wheel_rear_left\""),
        ("wheels_radius", "0.076"),
        ("sum_of_robot_center_projection_on_X_Y_axis", "0.45"),
        ("base_frame_offset", "{ x: 0.0, y: 0.0, theta: 0.0 }"),
        ("base_frame_id", "base_link"),
        ("odom_frame_id", "odom"),
        ("reference_timeout", "0.5"),
        ("update_rate", "100"),
    ] {
        assert_eq!(value(&text, key), expected, "{key}");
    }
    let tail = "    linear:\n      x:\n        max_velocity: 1.0\n        min_velocity: -1.0\n      y:\n        max_velocity: 0.8\n        \
                min_velocity: -0.8\n    angular:\n      z:\n        max_velocity: 2.0\n        min_velocity: -2.0\n";
    assert!(text.ends_with(tail), "{text}");
    let slower = stdout(&omnistep(
        folder.path(),
        &words("export mecanum4 --format ros2-control --set limits.yaw_rad_s2=4"),
    ));
    assert!(slower.ends_with("        max_acceleration: 4.0\n        max_deceleration: -4.0\n"));
}

#[test]
fn a_vehicle_that_no_controller_drives_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let said = |vehicle: &str, set: &[&str]| {
        let mut args = vec!["export", vehicle, "--format", "ros2-control"];
        set.iter().for_each(|set| args.extend(["--set", set]));
        refused(folder.path(), &args)
    };
    assert_eq!(
        said("chugo7", &[]),
        "error: vehicle chugo7: wheel[0].position_m: [-0.3, -0.23], allowed: 7 omni wheels every 51.429 degrees on a circle about the \
         origin (omni_wheel_drive_controller), or four mecanum wheels\n"
    );
    assert!(
        said("rocker_bogie6", &[]).contains("6 omni wheels every 60 degrees on a circle about the origin")
    );
    assert_eq!(
        said("mecanum4", &["wheel.2.radius_m=0.08"]),
        "error: vehicle mecanum4: wheel[2].radius_m: 0.08, allowed: 0.076, that of wheel[0]: the controllers use one radius for all \
         wheels\n"
    );
    assert_eq!(
        said("mecanum4", &["wheel.1.rolling_direction=[-1.0, 0.0]"]),
        "error: vehicle mecanum4: wheel[1].rolling_direction: [-1, 0], allowed: [1, 0], that of wheel[0]: \
         mecanum_drive_controller needs the same positive direction for all wheels\n"
    );
    assert_eq!(
        said("mecanum4", &["wheel.3.position_m=[-0.25, -0.21]"]),
        "error: vehicle mecanum4: wheel[1].position_m: [0.25, -0.2], allowed: a corner of a rectangle along the rolling direction, one \
         wheel at each corner (mecanum_drive_controller)\n"
    );
    assert_eq!(
        said("mecanum4", &["wheel.3.roller_angle_rad=-0.7"]),
        "error: vehicle mecanum4: wheel[3].roller_angle_rad: -0.7, allowed: -0.7853981633974483, 45 degrees, as rear_right of \
         mecanum_drive_controller\n"
    );
    assert_eq!(
        said("omni3", &["wheel.2.roller_angle_rad=0.2"]),
        "error: vehicle omni3: wheel[2].roller_angle_rad: 0.2, allowed: either omni wheels evenly spaced on a \
         circle (omni_wheel_drive_controller) or four mecanum wheels (mecanum_drive_controller)\n"
    );
}
