//! A vehicle file as URDF.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Display;
use std::io;

use omni_config::{Body, Hinge, Vehicle, WheelSpec};

use super::{Geometry, Inertial, Place, Shape, at, link, robot};
use crate::xml::{Xml, element, leaf, list};

/// The link of the vehicle's first body, by the name that ROS tools expect.
pub const BASE_LINK: &str = "base_link";
/// The frame of odometry, by the name that ROS tools expect.
pub const ODOM_LINK: &str = "odom";
/// The frame of a map, by the name that ROS tools expect.
pub const MAP_LINK: &str = "map";
/// The frame of the inertial measurement unit, which is on the base and along it.
pub const IMU_LINK: &str = "imu_link";
/// The frame of the ground.
pub const WORLD_LINK: &str = "world";

const BODY: (&str, [f64; 4]) = ("body", [0.35, 0.42, 0.5, 0.6]);
const WHEEL: (&str, [f64; 4]) = ("wheel", [0.9, 0.45, 0.1, 1.0]);
/// Stands for no limit where URDF asks for a speed \[rad/s\].
const UNLIMITED_RAD_S: f64 = 1000.0;

/// The name of a body's link.
///
/// ```
/// use omni_config::Vehicle;
/// use omni_log::{BASE_LINK, link_name};
/// let vehicle = Vehicle::load("chugo7")?;
/// assert_eq!(link_name(&vehicle, &vehicle.body[0].name), BASE_LINK);
/// assert_eq!(link_name(&vehicle, &vehicle.body[1].name), vehicle.body[1].name);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn link_name<'a>(vehicle: &Vehicle, body: &'a str) -> &'a str {
    if vehicle.body.first().is_some_and(|base| base.name == body) {
        BASE_LINK
    } else {
        body
    }
}

/// The name of a wheel's link and of the joint that turns it.
///
/// ```
/// assert_eq!(omni_log::wheel_link("4"), "wheel_4");
/// ```
#[must_use]
pub fn wheel_link(wheel: &str) -> String {
    format!("wheel_{wheel}")
}

/// Origin of a body's link in the vehicle's frame as it stands on flat ground \[m\]: the anchor of
/// the hinge that carries it, the vehicle's own origin for the base.
///
/// ```
/// use omni_config::Vehicle;
/// use omni_log::link_frame_m;
/// let vehicle = Vehicle::load("chugo7")?;
/// assert_eq!(link_frame_m(&vehicle, &vehicle.body[0].name), [0.0; 3]);
/// assert_eq!(link_frame_m(&vehicle, &vehicle.hinge[0].child), vehicle.hinge[0].anchor_m);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn link_frame_m(vehicle: &Vehicle, body: &str) -> [f64; 3] {
    let carrier = vehicle.hinge.iter().find(|hinge| hinge.child == body);
    carrier.map_or([0.0; 3], |hinge| hinge.anchor_m)
}

/// The vehicle as URDF: a link a body and a wheel, a joint a hinge and a wheel.
///
/// Bodies are the boxes that their inertia is of, wheels are cylinders as wide as `width_m` says; their inertia
/// transverse to the axle is half the inertia about it, as for a disc. Hinges have their limits and damping, and mimic
/// each other where they are coupled. Wheels turn without end; their effort is the motor's stall torque behind the
/// gear, their velocity its no-load speed, or 1000 rad/s if there is none. A hinge has no motor: its effort is 0.
///
/// ```
/// use omni_config::Vehicle;
/// use omni_log::vehicle_urdf;
/// let urdf = vehicle_urdf(&Vehicle::load("chugo7")?);
/// assert!(urdf.starts_with("<robot name=\"chugo7\">"));
/// assert_eq!(urdf.matches("<link name=").count(), 3 + 7);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn vehicle_urdf(vehicle: &Vehicle) -> String {
    robot(&vehicle.name, |xml| write_parts(xml, vehicle))
}

/// The links and joints.
pub(super) fn write_parts(xml: &mut Xml, vehicle: &Vehicle) -> io::Result<()> {
    vehicle
        .body
        .iter()
        .try_for_each(|body| of_body(xml, vehicle, body))?;
    vehicle.wheel.iter().try_for_each(|wheel| of_wheel(xml, wheel))?;
    vehicle
        .hinge
        .iter()
        .try_for_each(|hinge| of_hinge(xml, vehicle, hinge))?;
    vehicle
        .wheel
        .iter()
        .try_for_each(|wheel| of_axle(xml, vehicle, wheel))
}

/// Highest effort \[N.m\] and velocity \[rad/s\] of a wheel.
pub(super) fn wheel_limits(vehicle: &Vehicle, wheel: &WheelSpec) -> [f64; 2] {
    let no_load = vehicle.no_load_rad_s().unwrap_or(f64::INFINITY) * wheel.gear;
    [
        vehicle.motor.peak_torque_n_m() / wheel.gear,
        no_load.min(UNLIMITED_RAD_S),
    ]
}

/// From a link's frame to a point of the vehicle's frame.
fn from_link(vehicle: &Vehicle, body: &str, point: [f64; 3]) -> [f64; 3] {
    let origin = link_frame_m(vehicle, body);
    [0, 1, 2].map(|k| point[k] - origin[k])
}

fn of_body(xml: &mut Xml, vehicle: &Vehicle, body: &Body) -> io::Result<()> {
    let place = at(from_link(vehicle, &body.name, body.com_m), [0.0; 3]);
    let inertial = Inertial {
        mass_kg: body.mass_kg,
        place,
        moments_kg_m2: body.inertia_kg_m2(),
    };
    let shape = Shape {
        place,
        geometry: Geometry::Box(body.inertia_box_m),
        colour: BODY,
    };
    link(xml, link_name(vehicle, &body.name), inertial, &[shape])
}

/// Yaw of the axle \[rad\]: the rolling direction turned by a quarter to the left.
fn axle_yaw_rad(wheel: &WheelSpec) -> f64 {
    let [dx, dy] = wheel.rolling_direction;
    libm::atan2(dy, dx) + FRAC_PI_2
}

fn of_wheel(xml: &mut Xml, wheel: &WheelSpec) -> io::Result<()> {
    let (yaw, axial) = (axle_yaw_rad(wheel), wheel.inertia_kg_m2);
    let inertial = Inertial {
        mass_kg: wheel.mass_kg,
        place: at([0.0; 3], [0.0, 0.0, yaw]),
        moments_kg_m2: [axial, axial / 2.0, axial / 2.0],
    };
    let shape = Shape {
        // A cylinder's axis is z: laid down about x it is -y, and then turned by yaw less a quarter.
        place: at([0.0; 3], [FRAC_PI_2, 0.0, yaw - FRAC_PI_2]),
        geometry: Geometry::Cylinder {
            radius_m: wheel.radius_m,
            length_m: wheel.width_m(),
        },
        colour: WHEEL,
    };
    link(xml, &wheel_link(&wheel.name), inertial, &[shape])
}

fn of_hinge(xml: &mut Xml, vehicle: &Vehicle, hinge: &Hinge) -> io::Result<()> {
    let joint = Joint {
        name: &hinge.name,
        kind: "revolute",
        place: at(from_link(vehicle, &hinge.parent, hinge.anchor_m), [0.0; 3]),
        parent: link_name(vehicle, &hinge.parent),
        child: link_name(vehicle, &hinge.child),
        axis: unit(hinge.axis),
        limit: [-hinge.limit_rad, hinge.limit_rad, 0.0, UNLIMITED_RAD_S],
    };
    joint.write(xml, |xml| {
        let dynamics: [(&str, &dyn Display); 2] = [("damping", &hinge.damping_n_m_s_rad), ("friction", &0)];
        leaf(xml, "dynamics", &dynamics)?;
        match vehicle.coupling.iter().find(|c| c.hinge_a == hinge.name) {
            Some(c) => leaf(xml, "mimic", &[("joint", &c.hinge_b), ("multiplier", &-c.ratio)]),
            None => Ok(()),
        }
    })
}

fn of_axle(xml: &mut Xml, vehicle: &Vehicle, wheel: &WheelSpec) -> io::Result<()> {
    let [x, y] = wheel.position_m;
    let yaw = axle_yaw_rad(wheel);
    let [effort, velocity] = wheel_limits(vehicle, wheel);
    let name = wheel_link(&wheel.name);
    let joint = Joint {
        name: &name,
        kind: "continuous",
        place: at(from_link(vehicle, &wheel.body, [x, y, wheel.radius_m]), [0.0; 3]),
        parent: link_name(vehicle, &wheel.body),
        child: &name,
        axis: [libm::cos(yaw), libm::sin(yaw), 0.0],
        limit: [0.0, 0.0, effort, velocity],
    };
    joint.write(xml, |_| Ok(()))
}

/// A joint, and what every kind of it has.
struct Joint<'a> {
    name: &'a str,
    kind: &'a str,
    place: Place,
    parent: &'a str,
    child: &'a str,
    axis: [f64; 3],
    /// Lowest and highest angle \[rad\], highest effort \[N.m\], highest velocity \[rad/s\].
    limit: [f64; 4],
}

impl Joint<'_> {
    fn write(&self, xml: &mut Xml, more: impl FnOnce(&mut Xml) -> io::Result<()>) -> io::Result<()> {
        element(xml, "joint", &[("name", self.name), ("type", self.kind)], |xml| {
            self.place.write(xml)?;
            leaf(xml, "parent", &[("link", &self.parent)])?;
            leaf(xml, "child", &[("link", &self.child)])?;
            leaf(xml, "axis", &[("xyz", &list(&self.axis))])?;
            let [lower, upper, effort, velocity] = self.limit;
            let limit: [(&str, &dyn Display); 4] = [
                ("lower", &lower),
                ("upper", &upper),
                ("effort", &effort),
                ("velocity", &velocity),
            ];
            leaf(xml, "limit", &limit)?;
            more(xml)
        })
    }
}

fn unit(axis: [f64; 3]) -> [f64; 3] {
    let length = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    axis.map(|a| a / length)
}
