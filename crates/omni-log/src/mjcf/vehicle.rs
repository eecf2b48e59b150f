//! Bodies, hinges, wheels and rollers, what couples and drives them.

use std::fmt::Display;
use std::io;

use nalgebra::Vector3;
use omni_config::{Body, Hinge, Scenario, Vehicle};

use super::numbers::{number, numbers};
use super::wheel::{FREE, Wheel, class, roller_geoms, roller_name};
use crate::urdf::{link_frame_m, link_name, wheel_link};
use crate::xml::{Xml, comment, element, leaf};

const BODY: &str = "0.35 0.42 0.5 0.5";
const HUB: &str = "0.9 0.45 0.1 1";
/// Time constant of a hinge's stop, critically damped \[s\]: the other engines' 632 rad/s.
const STOP_S: f64 = 1.0 / 632.0;

/// The vehicle at its start.
pub(super) fn write(xml: &mut Xml, scenario: &Scenario, wheels: &[Wheel<'_>]) -> io::Result<()> {
    let start = &scenario.start;
    let half = 0.5 * start.heading_rad;
    let place = [
        ("pos", numbers(&[start.x_m, start.y_m, 0.0])),
        ("quat", numbers(&[libm::cos(half), 0.0, 0.0, libm::sin(half)])),
    ];
    let vehicle = scenario.vehicle();
    // A loaded vehicle has a base.
    vehicle
        .body
        .first()
        .map_or(Ok(()), |base| body(xml, vehicle, wheels, base, None, &place))
}

/// A body with all that it carries.
fn body(
    xml: &mut Xml,
    vehicle: &Vehicle,
    wheels: &[Wheel<'_>],
    of: &Body,
    hinge: Option<&Hinge>,
    place: &[(&str, String)],
) -> io::Result<()> {
    let origin = Vector3::from(link_frame_m(vehicle, &of.name));
    let here = |point: [f64; 3]| numbers((Vector3::from(point) - origin).as_slice());
    let mut attributes = vec![("name", link_name(vehicle, &of.name))];
    attributes.extend(place.iter().map(|(key, value)| (*key, value.as_str())));
    element(xml, "body", &attributes, |xml| {
        match hinge {
            None => leaf(xml, "freejoint", &[("name", &FREE)])?,
            Some(hinge) => leaf(
                xml,
                "joint",
                &[
                    ("name", &hinge.name),
                    ("type", &"hinge"),
                    ("axis", &numbers(Vector3::from(hinge.axis).normalize().as_slice())),
                    ("range", &numbers(&[-hinge.limit_rad, hinge.limit_rad])),
                    ("damping", &number(hinge.damping_n_m_s_rad)),
                    ("solreflimit", &format!("{} 1", number(STOP_S))),
                ],
            )?,
        }
        leaf(
            xml,
            "inertial",
            &[
                ("pos", &here(of.com_m)),
                ("mass", &number(of.mass_kg)),
                ("diaginertia", &numbers(&of.inertia_kg_m2())),
            ],
        )?;
        leaf(
            xml,
            "geom",
            &[
                ("class", &"seen"),
                ("type", &"box"),
                ("pos", &here(of.com_m)),
                ("size", &numbers(&of.inertia_box_m.map(|edge| 0.5 * edge))),
                ("rgba", &BODY),
            ],
        )?;
        for wheel in wheels.iter().filter(|wheel| wheel.spec.body == of.name) {
            let [x, y] = wheel.spec.position_m;
            let centre = here([x, y, wheel.spec.radius_m - wheel.lower_m]);
            self::wheel(xml, vehicle, wheel, &centre)?;
        }
        for hinge in vehicle.hinge.iter().filter(|hinge| hinge.parent == of.name) {
            if let Some(child) = vehicle.body.iter().find(|body| body.name == hinge.child) {
                let place = [("pos", here(hinge.anchor_m))];
                body(xml, vehicle, wheels, child, Some(hinge), &place)?;
            }
        }
        Ok(())
    })
}

/// Masses and inertias of a wheel's parts: of the wheel's own, three tenths of the mass are its
/// rollers' unless its file says otherwise.
struct Parts {
    hub_kg: f64,
    /// About the axle and across it \[kg.m^2\].
    hub_kg_m2: [f64; 2],
    /// Of a roller, about its axis and across it \[kg.m^2\].
    roller_kg_m2: [f64; 2],
}

impl Parts {
    fn of(wheel: &Wheel<'_>) -> Self {
        let (built, spec) = (&wheel.rollers, wheel.spec);
        let (mass, radius) = (built.roller_mass_kg, built.barrel.radius_m());
        let length = 2.0 * built.barrel.half_length_m();
        let axial = 0.5 * mass * radius * radius;
        let across = mass * (3.0 * radius * radius + length * length) / 12.0;
        let (sin, cos) = libm::sincos(built.roller_angle_rad);
        let each =
            mass * built.pitch_radius_m * built.pitch_radius_m + axial * sin * sin + across * cos * cos;
        let mut rollers = [0.0; 2];
        for (_, along) in built.places() {
            let arm = built.pitch_radius_m * built.pitch_radius_m + along * along;
            let trace = 2.0 * mass * arm + axial + 2.0 * across;
            rollers[0] += each;
            rollers[1] += 0.5 * (trace - each);
        }
        let about = spec.inertia_kg_m2 - rollers[0];
        Self {
            hub_kg: spec.mass_kg - mass * (built.count * built.rows) as f64,
            // Together with its rollers the wheel is a disc; no body is flatter than one.
            hub_kg_m2: [about, (0.5 * spec.inertia_kg_m2 - rollers[1]).max(0.5 * about)],
            roller_kg_m2: [axial, across],
        }
    }
}

/// A wheel and its rollers. Its frame: x is the rolling direction, y the axle, z up.
fn wheel(xml: &mut Xml, vehicle: &Vehicle, wheel: &Wheel<'_>, centre: &str) -> io::Result<()> {
    let (spec, built) = (wheel.spec, &wheel.rollers);
    let name = wheel_link(&spec.name);
    let [dx, dy] = spec.rolling_direction;
    let half = 0.5 * libm::atan2(dy, dx);
    let quat = numbers(&[libm::cos(half), 0.0, 0.0, libm::sin(half)]);
    let parts = Parts::of(wheel);
    let attributes = [("name", &*name), ("pos", centre), ("quat", &*quat)];
    element(xml, "body", &attributes, |xml| {
        let motor = &vehicle.motor;
        leaf(
            xml,
            "joint",
            &[
                ("name", &name),
                ("axis", &"0 1 0"),
                ("damping", &number(motor.viscous_n_m_s_rad)),
                ("frictionloss", &number(motor.gear_friction_n_m)),
                // Hard: as MuJoCo has it by default, a wheel creeps that its gear holds.
                ("solreffriction", &"0.002 1"),
                ("solimpfriction", &"0.9999 0.9999 0.001"),
            ],
        )?;
        let [about, across] = parts.hub_kg_m2;
        leaf(
            xml,
            "inertial",
            &[
                ("pos", &"0 0 0"),
                ("mass", &number(parts.hub_kg)),
                ("diaginertia", &numbers(&[across, about, across])),
            ],
        )?;
        let radius = built.pitch_radius_m - built.barrel.radius_m();
        leaf(
            xml,
            "geom",
            &[
                ("class", &"seen"),
                ("type", &"cylinder"),
                ("size", &numbers(&[radius, 0.5 * spec.width_m()])),
                ("zaxis", &"0 1 0"),
                ("rgba", &HUB),
            ],
        )?;
        built.places().enumerate().try_for_each(|(k, (angle, along))| {
            roller(xml, wheel, &parts, &roller_name(spec, k), [angle, along])
        })
    })
}

fn roller(
    xml: &mut Xml,
    wheel: &Wheel<'_>,
    parts: &Parts,
    name: &str,
    [angle, along]: [f64; 2],
) -> io::Result<()> {
    let built = &wheel.rollers;
    let ((sin, cos), (tilt, level)) = (libm::sincos(angle), libm::sincos(built.roller_angle_rad));
    let axis = Vector3::new(level * cos, tilt, -level * sin);
    let out = Vector3::new(-sin, 0.0, -cos);
    let middle = out * built.pitch_radius_m + Vector3::new(0.0, along, 0.0);
    let axes = [axis.as_slice(), out.cross(&axis).as_slice()].concat();
    let class = class(wheel.spec);
    let (middle, axes) = (numbers(middle.as_slice()), numbers(&axes));
    let attributes = [
        ("name", name),
        ("pos", &*middle),
        ("xyaxes", &*axes),
        ("childclass", &*class),
    ];
    element(xml, "body", &attributes, |xml| {
        leaf(xml, "joint", &[("name", &name), ("axis", &"1 0 0")])?;
        let [axial, across] = parts.roller_kg_m2;
        leaf(
            xml,
            "inertial",
            &[
                ("pos", &"0 0 0"),
                ("mass", &number(built.roller_mass_kg)),
                ("diaginertia", &numbers(&[axial, across, across])),
            ],
        )?;
        roller_geoms(xml, wheel)
    })
}

/// Hinges that turn together.
pub(super) fn couplings(xml: &mut Xml, vehicle: &Vehicle) -> io::Result<()> {
    if vehicle.coupling.is_empty() {
        return Ok(());
    }
    element(xml, "equality", &[], |xml| {
        comment(
            xml,
            "The coupling's stiffness and damping as a time constant and a damping ratio: its bodies oscillate as the vehicle file says.",
        )?;
        vehicle.coupling.iter().try_for_each(|coupling| {
            let spring = vehicle.coupling_spring(coupling);
            let swing = (spring.stiffness_n_m_rad / spring.inertia_kg_m2).sqrt();
            let ratio = 0.5 * spring.damping_n_m_s_rad / (spring.inertia_kg_m2 * swing);
            let ratio = ratio.max(0.05); // a swing for ever is none that a step of finite length has
            leaf(
                xml,
                "joint",
                &[
                    ("name", &coupling.name),
                    ("joint1", &coupling.hinge_a),
                    ("joint2", &coupling.hinge_b),
                    ("polycoef", &numbers(&[0.0, -coupling.ratio, 0.0, 0.0, 0.0])),
                    ("solref", &numbers(&[1.0 / (swing * ratio), ratio])),
                    ("solimp", &"0.99 0.99 0.001"),
                ],
            )
        })
    })
}

/// A motor a wheel, with the actuator's own torque as control.
pub(super) fn actuators(xml: &mut Xml, vehicle: &Vehicle) -> io::Result<()> {
    element(xml, "actuator", &[], |xml| {
        comment(
            xml,
            "ctrl is the torque of the actuator, N.m, before the wheel's gear. The range is that at rest; the controller \
             must apply the lower limit at speed.",
        )?;
        vehicle.wheel.iter().try_for_each(|wheel| {
            let name = wheel_link(&wheel.name);
            let stall = vehicle.motor.peak_torque_n_m();
            let attributes: [(&str, &dyn Display); 4] = [
                ("name", &name),
                ("joint", &name),
                ("gear", &number(1.0 / wheel.gear)),
                ("ctrlrange", &numbers(&[-stall, stall])),
            ];
            leaf(xml, "motor", &attributes)
        })
    })
}
