//! A vehicle file as URDF.

use std::f64::consts::FRAC_PI_2;

use urdf_rs::{Axis, Dynamics, Geometry, Joint, JointLimit, JointType, LinkName, Mimic, Vec3};

use super::{at, inertial, link, robot, text, visual};
use crate::config::{Body, Hinge, Vehicle, WheelSpec};

/// The link of the vehicle's first body, by the name that ROS tools expect.
pub const BASE_LINK: &str = "base_link";
/// The frame of the ground.
pub const WORLD_LINK: &str = "world";

const BODY: (&str, [f64; 4]) = ("body", [0.35, 0.42, 0.5, 0.6]);
const WHEEL: (&str, [f64; 4]) = ("wheel", [0.9, 0.45, 0.1, 1.0]);
/// Stands for no limit where URDF asks for a speed \[rad/s\].
const UNLIMITED_RAD_S: f64 = 1000.0;

/// The name of a body's link.
#[must_use]
pub fn link_name<'a>(vehicle: &Vehicle, body: &'a str) -> &'a str {
    if vehicle.body.first().is_some_and(|base| base.name == body) {
        BASE_LINK
    } else {
        body
    }
}

/// The name of a wheel's link and of the joint that turns it.
#[must_use]
pub fn wheel_link(wheel: &str) -> String {
    format!("wheel_{wheel}")
}

/// Origin of a body's link in the vehicle's frame as it stands on flat ground \[m\]: the anchor of the hinge that carries it,
/// the vehicle's own origin for the base.
#[must_use]
pub fn link_frame_m(vehicle: &Vehicle, body: &str) -> [f64; 3] {
    let carrier = vehicle.hinge.iter().find(|hinge| hinge.child == body);
    carrier.map_or([0.0; 3], |hinge| hinge.anchor_m)
}

/// The vehicle as URDF: a link a body and a wheel, a joint a hinge and a wheel.
///
/// Bodies are the boxes that their inertia is of, wheels are cylinders as wide as `width_m` says; their inertia across the axle is
/// taken for half of that about it, a disc's. Hinges have their limits and damping, and mimic each other where they are coupled.
/// Wheels turn without end; their effort is the motor's stall torque behind the gear, their velocity its no-load speed, or
/// 1000 rad/s where there is none. A hinge has no motor: its effort is 0.
///
/// ```
/// use omni_sim::{config::Vehicle, vehicle_urdf};
/// let urdf = vehicle_urdf(&Vehicle::load("chugo7")?);
/// assert!(urdf.starts_with("<robot name=\"chugo7\">"));
/// assert_eq!(urdf.matches("<link name=").count(), 3 + 7);
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn vehicle_urdf(vehicle: &Vehicle) -> String {
    let bodies = vehicle.body.iter().map(|body| of_body(vehicle, body));
    let wheels = vehicle.wheel.iter().map(of_wheel);
    let hinges = vehicle.hinge.iter().map(|hinge| of_hinge(vehicle, hinge));
    let axles = vehicle.wheel.iter().map(|wheel| of_axle(vehicle, wheel));
    text(&robot(
        &vehicle.name,
        bodies.chain(wheels).collect(),
        hinges.chain(axles).collect(),
    ))
}

/// From a link's frame to a point of the vehicle's frame.
fn from_link(vehicle: &Vehicle, body: &str, point: [f64; 3]) -> [f64; 3] {
    let origin = link_frame_m(vehicle, body);
    [0, 1, 2].map(|k| point[k] - origin[k])
}

fn of_body(vehicle: &Vehicle, body: &Body) -> urdf_rs::Link {
    let centre = from_link(vehicle, &body.name, body.com_m);
    let shape = Geometry::Box {
        size: Vec3(body.box_m),
    };
    link(
        link_name(vehicle, &body.name),
        inertial(body.mass_kg, centre, body.inertia_kg_m2(), 0.0),
        vec![visual(at(centre, [0.0; 3]), shape, BODY)],
    )
}

/// Yaw of the axle \[rad\]: the rolling direction turned by a quarter to the left.
fn axle_yaw_rad(wheel: &WheelSpec) -> f64 {
    let [dx, dy] = wheel.rolling_direction;
    libm::atan2(dy, dx) + FRAC_PI_2
}

fn of_wheel(wheel: &WheelSpec) -> urdf_rs::Link {
    let (yaw, axial) = (axle_yaw_rad(wheel), wheel.inertia_kg_m2);
    let shape = Geometry::Cylinder {
        radius: wheel.radius_m,
        length: wheel.width_m(),
    };
    // A cylinder's axis is z: laid down about x it is -y, and then turned by yaw less a quarter.
    let lying = at([0.0; 3], [FRAC_PI_2, 0.0, yaw - FRAC_PI_2]);
    link(
        &wheel_link(&wheel.name),
        inertial(wheel.mass_kg, [0.0; 3], [axial, axial / 2.0, axial / 2.0], yaw),
        vec![visual(lying, shape, WHEEL)],
    )
}

fn of_hinge(vehicle: &Vehicle, hinge: &Hinge) -> Joint {
    let coupled = vehicle.coupling.iter().find(|c| c.hinge_a == hinge.name);
    Joint {
        name: hinge.name.clone(),
        joint_type: JointType::Revolute,
        origin: at(from_link(vehicle, &hinge.parent, hinge.anchor_m), [0.0; 3]),
        parent: name(link_name(vehicle, &hinge.parent)),
        child: name(link_name(vehicle, &hinge.child)),
        axis: Axis {
            xyz: Vec3(unit(hinge.axis)),
        },
        limit: JointLimit {
            lower: -hinge.limit_rad,
            upper: hinge.limit_rad,
            effort: 0.0,
            velocity: UNLIMITED_RAD_S,
            ..JointLimit::default()
        },
        dynamics: Some(Dynamics {
            damping: hinge.damping_n_m_s_rad,
            friction: 0.0,
        }),
        mimic: coupled.map(|c| Mimic {
            joint: c.hinge_b.clone(),
            multiplier: Some(-c.ratio),
            offset: None,
        }),
        calibration: None,
        safety_controller: None,
    }
}

fn of_axle(vehicle: &Vehicle, wheel: &WheelSpec) -> Joint {
    let [x, y] = wheel.position_m;
    let yaw = axle_yaw_rad(wheel);
    let motor = &vehicle.motor;
    let no_load = motor.stall_torque_n_m / motor.slope_n_m_s_rad * wheel.gear;
    Joint {
        name: wheel_link(&wheel.name),
        joint_type: JointType::Continuous,
        origin: at(from_link(vehicle, &wheel.body, [x, y, wheel.radius_m]), [0.0; 3]),
        parent: name(link_name(vehicle, &wheel.body)),
        child: name(&wheel_link(&wheel.name)),
        axis: Axis {
            xyz: Vec3([libm::cos(yaw), libm::sin(yaw), 0.0]),
        },
        limit: JointLimit {
            effort: motor.stall_torque_n_m / wheel.gear,
            velocity: no_load.min(UNLIMITED_RAD_S),
            ..JointLimit::default()
        },
        dynamics: None,
        mimic: None,
        calibration: None,
        safety_controller: None,
    }
}

fn name(link: &str) -> LinkName {
    LinkName {
        link: link.to_owned(),
    }
}

fn unit(axis: [f64; 3]) -> [f64; 3] {
    let length = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    axis.map(|a| a / length)
}
