//! A wheel as it is written: its parts, its names, and the shapes of its rollers.

use std::io;

use omni_config::{RollerWheel, WheelSpec};

use super::contact::Contact;
use super::numbers::numbers;
use super::roller_shape::{Piece, RollerShape};
use crate::urdf::wheel_link;
use crate::xml::{Xml, leaf};

/// The base's joint.
pub(super) const FREE: &str = "free";

/// A wheel as it is written.
pub(super) struct Wheel<'a> {
    pub(super) spec: &'a WheelSpec,
    pub(super) rollers: RollerWheel,
    pub(super) contact: Contact,
    pub(super) shape: RollerShape,
    /// Offset of its mounting below its radius \[m\].
    pub(super) lower_m: f64,
}

/// The name of a roller's body and joint.
pub(super) fn roller_name(wheel: &WheelSpec, index: usize) -> String {
    format!("{}_roller_{index}", wheel_link(&wheel.name))
}

/// The class of a wheel's rollers.
pub(super) fn class(wheel: &WheelSpec) -> String {
    format!("rollers_{}", wheel.name)
}

/// The name of a wheel's mesh, where its rollers are one.
pub(super) fn mesh(wheel: &WheelSpec) -> String {
    format!("roller_{}", wheel.name)
}

/// The shapes of one roller; its axis is x.
pub(super) fn roller_geoms(xml: &mut Xml, wheel: &Wheel<'_>) -> io::Result<()> {
    match &wheel.shape {
        RollerShape::Mesh(_) => leaf(xml, "geom", &[("type", &"mesh"), ("mesh", &mesh(wheel.spec))]),
        RollerShape::Pieces(pieces, ends) => {
            pieces.iter().try_for_each(|Piece { along_m, across_m }| {
                let size = numbers(&[*along_m, *across_m, *across_m]);
                leaf(xml, "geom", &[("type", &"ellipsoid"), ("size", &size)])
            })?;
            ends.iter().try_for_each(|ends| {
                let size = numbers(&[ends.radius_m, ends.half_length_m]);
                let shape: [(&str, &dyn std::fmt::Display); 3] =
                    [("type", &"cylinder"), ("zaxis", &"1 0 0"), ("size", &size)];
                leaf(xml, "geom", &shape)
            })
        }
    }
}
