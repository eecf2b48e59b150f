//! Constants as a C header: initialisers of the types in `omnistep.h`.

use std::fmt::{Result, Write};

use omni_core::constants::{Constant, Describe, Fields, Piece};

use super::values::Values;
use crate::{Error, PlannedPath, Scenario};

/// The header of a scenario.
pub(super) fn source(
    scenario: &Scenario,
    values: &Values,
    digest: u32,
) -> std::result::Result<String, Error> {
    let (count, period_us) = (scenario.vehicle().wheel.len(), scenario.control.period_us);
    let (vehicle, policy) = (&scenario.vehicle().name, scenario.control.law());
    let hinges = scenario.vehicle().hinge.len();
    let controller = initialiser(&*values.controller);
    let limiter = initialiser(&values.limiter);
    // Traction control is in a drive only: without a `[drive]`, in one that has nothing else.
    let bare = scenario.bare_traction_values()?;
    let drive = values.drive.as_ref().or(bare.as_ref());
    let loops = if drive.is_some() && scenario.has_traction() {
        "/* Kinematics and the wheels' loops; traction control is in OMNI_DRIVE. */\n"
    } else {
        ""
    };
    let drive = drive.map_or_else(String::new, |drive| {
        let kind = if scenario.has_traction() {
            "traction_drive"
        } else {
            "drive"
        };
        let without = if bare.is_some() {
            "/* The scenario has no [drive]: no time-out of commands, no fault monitor. */\n"
        } else {
            ""
        };
        let drive = initialiser(&**drive);
        format!("{without}static const omni{count}_{kind} OMNI_DRIVE = {drive};\n")
    });
    let estimator = values.estimator.as_ref().map_or_else(String::new, |estimator| {
        let estimator = initialiser(&**estimator);
        format!("static const omni{count}_estimator OMNI_ESTIMATOR = {estimator};\n")
    });
    let path = values.path.as_ref().map_or_else(String::new, path);
    let motors = initialiser(&*values.motors);
    let version = env!("CARGO_PKG_VERSION");
    let number = [
        env!("CARGO_PKG_VERSION_MAJOR"),
        env!("CARGO_PKG_VERSION_MINOR"),
        env!("CARGO_PKG_VERSION_PATCH"),
    ];
    let number = number
        .iter()
        .fold(0, |number, part| 1000 * number + part.parse().unwrap_or(0));
    let encoder = values.encoder.as_ref().map_or_else(String::new, |encoder| {
        format!(
            "static const omni_encoder OMNI_ENCODER = {};\n",
            initialiser(encoder)
        )
    });
    Ok(format!(
        "/* Generated from the vehicle file. Do not edit. */\n\
         #ifndef OMNI_CONSTANTS_H\n#define OMNI_CONSTANTS_H\n#include \"omnistep.h\"\n\
         #ifdef __cplusplus\n#pragma GCC system_header /* gcc and clang accept named initialisers before C++20, but would warn */\n\
         #endif\n\
         #if OMNISTEP_VERSION_NUMBER != {number}\n\
         #error \"constants.h is of omnistep {version}, omnistep.h is not: export the constants anew with the command of its version\"\n\
         #endif\n\
         #define OMNI_VEHICLE {vehicle:?}\n#define OMNI_POLICY {policy:?}\n#define OMNI_WHEELS {count}\n#define OMNI_HINGES {hinges} /* of the vehicle file, in its order */\n\
         #define OMNI_PERIOD_US {period_us} /* the step must be called exactly this often */\n\
         #define OMNI_DIGEST {digest:#010x}u\n\
         {loops}static const omni{count}_controller OMNI_CONTROLLER = {controller};\n\
         static const omni_limiter OMNI_LIMITER = {limiter};\n\
         static const omni_motor OMNI_MOTORS[OMNI_WHEELS] = {motors};\n{encoder}{drive}{estimator}{path}\
         #endif\n"
    ))
}

/// A planned path and who follows it.
fn path(path: &PlannedPath) -> String {
    let trajectory = path.trajectory();
    let (segments, pieces) = (trajectory.segments(), trajectory.pieces());
    format!(
        "static const omni_path_segment OMNI_PATH_SEGMENTS[] = {{\n{}}};\n\
         static const omni_path_piece OMNI_PATH_PIECES[] = {{\n{}}};\n\
         static const omni_trajectory OMNI_TRAJECTORY = {{ .segments = OMNI_PATH_SEGMENTS, .pieces = OMNI_PATH_PIECES, \
         .segment_count = {}, .piece_count = {} }};\n\
         static const omni_follower OMNI_FOLLOWER = {};\n",
        list(segments),
        list(pieces),
        segments.len(),
        pieces.len(),
        initialiser(&path.follower)
    )
}

/// Values as items of an array.
fn list<T: Constant>(values: &[T]) -> String {
    let line = |value: &T| initialiser(value) + ",\n";
    values.iter().map(line).collect()
}

/// A value as an initialiser.
pub(super) fn initialiser(value: &dyn Constant) -> String {
    let mut text = Initialiser(String::new());
    match value.describe(&mut text) {
        Ok(()) => text.0,
        // Writing to a string does not fail, and no type of `omnistep.h` is optional.
        Err(_) => unreachable!("a constant that C has no type for"),
    }
}

struct Initialiser(String);

/// `ScaleReferences` as `SCALE_REFERENCES`.
fn screaming(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.push(c.to_ascii_uppercase());
    }
    text
}

impl Initialiser {
    fn fields(&mut self, fields: Fields<'_>) -> Result {
        for (field, value) in fields {
            write!(self.0, ".{field} = ")?;
            value.describe(self)?;
            self.0.push_str(",\n");
        }
        Ok(())
    }

    /// All of C's presets are in `float`.
    fn real(&mut self, value: f64) -> Result {
        if value.is_nan() {
            self.0.write_str("OMNI_NAN")
        } else if value.is_infinite() {
            let sign = if value > 0.0 { "" } else { "-" };
            write!(self.0, "{sign}OMNI_INFINITY")
        } else {
            write!(self.0, "{:?}f", value as f32)
        }
    }
}

impl Describe for Initialiser {
    fn take(&mut self, piece: Piece<'_>) -> Result {
        match piece {
            Piece::Real { value, .. } => self.real(value),
            Piece::Whole(value) => write!(self.0, "{value}"),
            Piece::Flag(value) => write!(self.0, "{value}"),
            Piece::List(items) => {
                self.0.push('{');
                for item in items {
                    item.describe(self)?;
                    self.0.push_str(", ");
                }
                self.0.write_str("}")
            }
            Piece::Struct { fields, .. } => {
                self.0.push_str("{\n");
                self.fields(fields)?;
                self.0.write_str("}")
            }
            Piece::Choice { name, variant } => {
                write!(self.0, "OMNI_{}_{}", screaming(name), screaming(variant))
            }
            Piece::Variant {
                name,
                variant,
                fields,
            } => {
                let variant = screaming(variant);
                write!(self.0, "{{ .tag = OMNI_{}_{variant}, ", screaming(name))?;
                if !fields.is_empty() {
                    write!(self.0, ".{variant} = {{ ")?;
                    self.fields(fields)?;
                    self.0.push_str("} ");
                }
                self.0.write_str("}")
            }
            Piece::Option(_) => Err(std::fmt::Error), // no type of `omnistep.h` has one
        }
    }
}
