//! Vehicles and ground as URDF, for viewers and other simulators.
//!
//! A link's frame is where the joint that carries it is, as URDF has it; the base's is the vehicle's.
//! Frames of a log's `/tf` and joints of its `/joint_states` have the same names and places.

mod ground;
mod ros2_control;
mod vehicle;

use std::fmt::Display;
use std::io;

use crate::xml::{Xml, document, element, leaf, list};
pub use ground::ground_urdf;
pub use ros2_control::{JointInterface, ros2_control_urdf};
pub use vehicle::{
    BASE_LINK, IMU_LINK, MAP_LINK, ODOM_LINK, WORLD_LINK, link_frame_m, link_name, vehicle_urdf, wheel_link,
};

/// A robot: what `parts` writes into it.
fn robot(name: &str, parts: impl FnOnce(&mut Xml) -> io::Result<()>) -> String {
    document("robot", &[("name", name)], parts)
}

/// A place \[m\], and roll, pitch and yaw \[rad\] about the parent's axes.
#[derive(Clone, Copy)]
struct Place {
    xyz: [f64; 3],
    rpy: [f64; 3],
}

impl Place {
    fn write(self, xml: &mut Xml) -> io::Result<()> {
        leaf(
            xml,
            "origin",
            &[("xyz", &list(&self.xyz)), ("rpy", &list(&self.rpy))],
        )
    }
}

fn at(xyz: [f64; 3], rpy: [f64; 3]) -> Place {
    Place { xyz, rpy }
}

/// What a link weighs: its mass \[kg\], where its centre is, the moments about it \[kg.m2\] along its axes.
#[derive(Clone, Copy)]
struct Inertial {
    mass_kg: f64,
    place: Place,
    moments_kg_m2: [f64; 3],
}

impl Inertial {
    fn write(self, xml: &mut Xml) -> io::Result<()> {
        element(xml, "inertial", &[], |xml| {
            let [ixx, iyy, izz] = self.moments_kg_m2;
            self.place.write(xml)?;
            leaf(xml, "mass", &[("value", &self.mass_kg)])?;
            let moments: [(&str, &dyn Display); 6] = [
                ("ixx", &ixx),
                ("ixy", &0),
                ("ixz", &0),
                ("iyy", &iyy),
                ("iyz", &0),
                ("izz", &izz),
            ];
            leaf(xml, "inertia", &moments)
        })
    }
}

#[derive(Clone, Copy)]
enum Geometry {
    /// Its edges \[m\].
    Box([f64; 3]),
    /// About z.
    Cylinder { radius_m: f64, length_m: f64 },
}

/// A shape that is seen and touched, with the name of its colour and red, green, blue, opacity, 0 to 1.
struct Shape {
    place: Place,
    geometry: Geometry,
    colour: (&'static str, [f64; 4]),
}

impl Shape {
    fn write(&self, xml: &mut Xml) -> io::Result<()> {
        self.place.write(xml)?;
        element(xml, "geometry", &[], |xml| match self.geometry {
            Geometry::Box(edges_m) => leaf(xml, "box", &[("size", &list(&edges_m))]),
            Geometry::Cylinder { radius_m, length_m } => {
                leaf(xml, "cylinder", &[("radius", &radius_m), ("length", &length_m)])
            }
        })
    }
}

/// A link whose shapes are seen and touched alike.
fn link(xml: &mut Xml, name: &str, inertial: Inertial, shapes: &[Shape]) -> io::Result<()> {
    element(xml, "link", &[("name", name)], |xml| {
        inertial.write(xml)?;
        for shape in shapes {
            element(xml, "visual", &[], |xml| {
                shape.write(xml)?;
                let (name, rgba) = shape.colour;
                element(xml, "material", &[("name", name)], |xml| {
                    leaf(xml, "color", &[("rgba", &list(&rgba))])
                })
            })?;
        }
        for shape in shapes {
            element(xml, "collision", &[], |xml| shape.write(xml))?;
        }
        Ok(())
    })
}
