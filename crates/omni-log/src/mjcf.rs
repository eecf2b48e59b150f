//! Vehicle and ground as MJCF, MuJoCo's files: every roller is a body with its own bearing.
//!
//! Bodies and joints have the names that they have as URDF. Choices for MuJoCo that follow from no file of omnistep
//! have their reasons in the written file; docs/mujoco.md lists the measurements.

mod contact;
mod ground;
mod mobility;
mod numbers;
mod roller_shape;
mod vehicle;
mod wheel;

use std::collections::BTreeSet;
use std::io;

use omni_config::{Error, Scenario, WheelModel};

use crate::urdf::wheel_link;
use crate::xml::{Xml, comment, document, element, leaf};
use contact::Contact;
use mobility::mobilities_per_kg;
use numbers::{number, numbers};
use roller_shape::RollerShape;
use wheel::{FREE, Wheel, class, mesh, roller_name};

/// Ratio of the resistances of the soft constraints along and across a contact.
const IMPRATIO: f64 = 10.0;
/// Tolerance and iterations of finding the points where curved shapes meet.
const CCD: (f64, u32) = (1e-10, 100);

/// A scenario's vehicle at its start, on its ground, as MJCF: the rollers of the vehicle file on every wheel, whatever
/// `physics.wheel_model` says.
///
/// Joints: `free` of the base, the vehicle's hinges, `wheel_NAME` and `wheel_NAME_roller_K`. Actuators: `wheel_NAME`,
/// with the actuator's torque \[N.m\] as control, limited to what it has at rest. A motor's torque-speed line, lag,
/// faults and the efficiency of a gear are the controller's to keep: MJCF has no word for them.
///
/// # Errors
/// [`Error::Key`] for a wheel without rollers, for names that MJCF would have twice, and for
/// friction patches on ground that is not level.
///
/// ```
/// use omni_config::Scenario;
/// let mjcf = omni_log::mjcf(&Scenario::load("step", &[])?)?;
/// assert!(mjcf.starts_with("<mujoco model=\"step\">"));
/// assert_eq!(mjcf.matches("<joint name=\"wheel_4_roller_").count(), 12); // twelve rollers a wheel
/// # Ok::<(), omni_config::Error>(())
/// ```
pub fn mjcf(scenario: &Scenario) -> Result<String, Error> {
    let wheels = wheels(scenario)?;
    check_names(scenario, &wheels)?;
    let ground = ground::parts(scenario)?;
    let friction = scenario.terrain.friction();
    Ok(document("mujoco", &[("model", &scenario.name)], |xml| {
        options(xml, scenario)?;
        defaults(xml, &wheels, friction)?;
        element(xml, "asset", &[], |xml| {
            ground::assets(xml, &ground)?;
            meshes(xml, &wheels)
        })?;
        element(xml, "worldbody", &[], |xml| {
            leaf(
                xml,
                "light",
                &[("pos", &"0 0 4"), ("dir", &"0 0 -1"), ("directional", &true)],
            )?;
            wheels
                .first()
                .map_or(Ok(()), |wheel| ground::write(xml, &ground, &wheel.contact))?;
            vehicle::write(xml, scenario, &wheels)
        })?;
        vehicle::couplings(xml, scenario.vehicle())?;
        vehicle::actuators(xml, scenario.vehicle())
    }))
}

/// The wheels, with what of them is chosen here.
fn wheels(scenario: &Scenario) -> Result<Vec<Wheel<'_>>, Error> {
    let vehicle = scenario.vehicle();
    let rollers = vehicle.wheel.iter().enumerate().map(|(i, spec)| {
        let missing = || Error::Key {
            file: format!("vehicle {}", vehicle.name),
            key: format!("wheel[{i}].contact"),
            message: format!(
                "no rollers for wheel {:?}, allowed in MJCF: [rollers], or contact = {{ kind = \"rollers\", ... }} for every wheel",
                spec.name
            ),
        };
        vehicle.rollers(i, WheelModel::Rollers).ok_or_else(missing)
    });
    let rollers = rollers.collect::<Result<Vec<_>, _>>()?;
    let step_s = scenario.physics.timestep_us as f64 * 1e-6;
    let mobilities = mobilities_per_kg(vehicle, &rollers);
    let wheels = vehicle.wheel.iter().zip(rollers).zip(mobilities);
    Ok(wheels
        .map(|((spec, rollers), mobility)| {
            let stiffness = spec.contact_stiffness_n_m(scenario.physics.contact_frequency_hz);
            let damping = 2.0 * scenario.physics.contact_damping_ratio * (stiffness * spec.mass_kg).sqrt();
            Wheel {
                spec,
                contact: Contact::new([stiffness, damping], mobility, step_s),
                shape: RollerShape::of(&rollers),
                lower_m: spec.preload_n / stiffness,
                rollers,
            }
        })
        .collect())
}

/// Wheels and rollers are bodies and joints, and no two of either may be called alike; `free` is the base's joint.
fn check_names(scenario: &Scenario, wheels: &[Wheel<'_>]) -> Result<(), Error> {
    let vehicle = scenario.vehicle();
    let refuse = |key: String, name: &str| {
        Err(Error::Key {
            file: format!("vehicle {}", vehicle.name),
            key,
            message: format!(
                "{name:?}, allowed in MJCF: any name except \"free\" and the names of wheels and rollers (wheel_NAME, wheel_NAME_roller_K)"
            ),
        })
    };
    let mut taken = BTreeSet::new();
    for (i, wheel) in wheels.iter().enumerate() {
        let rollers = (0..wheel.rollers.places().count()).map(|k| roller_name(wheel.spec, k));
        for name in rollers.chain([wheel_link(&wheel.spec.name)]) {
            if !taken.insert(name) {
                return refuse(format!("wheel[{i}].name"), &wheel.spec.name);
            }
        }
    }
    let joint = |name: &str| name == FREE || taken.contains(name);
    if let Some(i) = vehicle.hinge.iter().position(|hinge| joint(&hinge.name)) {
        return refuse(format!("hinge[{i}].name"), &vehicle.hinge[i].name);
    }
    if let Some(i) = vehicle.body.iter().position(|body| taken.contains(&body.name)) {
        return refuse(format!("body[{i}].name"), &vehicle.body[i].name);
    }
    Ok(())
}

fn options(xml: &mut Xml, scenario: &Scenario) -> io::Result<()> {
    comment(
        xml,
        "SI units; x forward, y left, z up. Written by omnistep. Its page about MuJoCo has comparisons with this model.",
    )?;
    leaf(xml, "compiler", &[("angle", &"radian"), ("autolimits", &true)])?;
    comment(
        xml,
        "timestep: the scenario's physics step. cone: a pyramid's friction would \
         depend on its orientation. impratio: friction is stiffer than the normal direction, or else \
         a wheel creeps under load. ccd_*: MuJoCo's default tolerance of 1e-6 is a tenth of the depth of a contact under a wheel's load. \
         integrator: it evaluates the dampers of hinges and bearings at the end of a step.",
    )?;
    let (tolerance, iterations) = CCD;
    leaf(
        xml,
        "option",
        &[
            ("timestep", &number(scenario.physics.timestep_us as f64 * 1e-6)),
            ("gravity", &numbers(&[0.0, 0.0, -scenario.physics.gravity_m_s2])),
            ("integrator", &"implicitfast"),
            ("cone", &"elliptic"),
            ("impratio", &IMPRATIO),
            ("iterations", &100),
            ("tolerance", &"1e-10"),
            ("ccd_tolerance", &format!("{tolerance:e}")),
            ("ccd_iterations", &iterations),
        ],
    )?;
    element(xml, "visual", &[], |xml| {
        leaf(xml, "global", &[("offwidth", &1920), ("offheight", &1080)])
    })
}

/// Classes of similar elements: rollers, and the rollers of each wheel.
fn defaults(xml: &mut Xml, wheels: &[Wheel<'_>], friction: f64) -> io::Result<()> {
    element(xml, "default", &[], |xml| {
        element(xml, "default", &[("class", "seen")], |xml| {
            leaf(
                xml,
                "geom",
                &[("contype", &0), ("conaffinity", &0), ("group", &1), ("mass", &0)],
            )
        })?;
        element(xml, "default", &[("class", "roller")], |xml| {
            comment(
                xml,
                "Rollers touch the ground but not each other (conaffinity 0). Their contact parameters apply, not the \
                 ground's (priority). condim 3: sliding friction in two directions. Torsional and rolling friction (4, 6) would brake the rollers.",
            )?;
            let pressed: [(&str, &dyn std::fmt::Display); 6] = [
                ("contype", &1),
                ("conaffinity", &0),
                ("priority", &1),
                ("condim", &3),
                ("friction", &numbers(&[friction, 0.0, 0.0])),
                ("rgba", &"0.16 0.16 0.18 1"),
            ];
            leaf(xml, "geom", &pressed)?;
            comment(
                xml,
                "solref < 0 is the contact's stiffness and damping as an acceleration per metre and per metre per second. With \
                 solimp and the inverse mass that MuJoCo uses for a roller they equal the spring and damper of the vehicle's contact, N/m and N.s/m. solimp is constant: the spring does not depend on the depth.",
            )?;
            wheels.iter().try_for_each(|wheel| {
                element(xml, "default", &[("class", &class(wheel.spec))], |xml| {
                    let [solref, solimp] = wheel.contact.words();
                    leaf(xml, "geom", &[("solref", &solref), ("solimp", &solimp)])?;
                    leaf(
                        xml,
                        "joint",
                        &[("damping", &number(wheel.rollers.friction_n_m_s_rad))],
                    )
                })
            })
        })
    })
}

fn meshes(xml: &mut Xml, wheels: &[Wheel<'_>]) -> io::Result<()> {
    for wheel in wheels {
        if let RollerShape::Mesh(points) = &wheel.shape {
            comment(
                xml,
                "This roller's crown does not follow the wheel's rim, so it is a polyhedron. Its facets move a rolling wheel \
                 up and down by some micrometres.",
            )?;
            let points: Vec<f64> = points.iter().flatten().copied().collect();
            leaf(
                xml,
                "mesh",
                &[("name", &mesh(wheel.spec)), ("vertex", &numbers(&points))],
            )?;
        }
    }
    Ok(())
}
