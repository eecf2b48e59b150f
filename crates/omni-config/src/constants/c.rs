//! Constants as a C header: initialisers of the types in `omnistep.h`.

use std::fmt::{Result, Write};

use omni_core::constants::{Constant, Describe};

use super::Values;
use crate::{Error, Scenario};

/// Wheel counts that `omnistep.h` has types for.
const COUNTS: [usize; 3] = [3, 4, 7];

/// The header of a scenario.
pub(super) fn source(
    scenario: &Scenario,
    values: &Values,
    digest: u32,
) -> std::result::Result<String, Error> {
    let (count, period_us) = (scenario.vehicle().wheel.len(), scenario.control.period_us);
    let (vehicle, policy) = (&scenario.vehicle().name, &scenario.control.policy);
    if !COUNTS.contains(&count) {
        return Err(Error::Key {
            file: format!("vehicle {vehicle}"),
            key: "wheel".into(),
            message: format!("{count} wheels, allowed for C: 3, 4 or 7"),
        });
    }
    let controller = initialiser(&*values.controller);
    Ok(format!(
        "/* Generated from the vehicle file; not to be edited. */\n\
         #ifndef OMNI_CONSTANTS_H\n#define OMNI_CONSTANTS_H\n#include \"omnistep.h\"\n\
         #define OMNI_VEHICLE {vehicle:?}\n#define OMNI_POLICY {policy:?}\n#define OMNI_WHEELS {count}\n\
         #define OMNI_PERIOD_US {period_us} /* the step must be called exactly this often */\n\
         #define OMNI_DIGEST {digest:#010x}u\n\
         static const omni{count}_controller OMNI_CONTROLLER = {controller};\n\
         #endif\n"
    ))
}

/// A value as an initialiser.
pub(super) fn initialiser(value: &dyn Constant) -> String {
    let mut text = Initialiser(String::new());
    // Writing to a string does not fail.
    let _ = value.describe(&mut text);
    text.0
}

struct Initialiser(String);

impl Initialiser {
    fn fields(&mut self, fields: &[(&'static str, &dyn Constant)]) -> Result {
        for (field, value) in fields {
            write!(self.0, ".{field} = ")?;
            value.describe(self)?;
            self.0.push_str(",\n");
        }
        Ok(())
    }
}

/// `ScaleReference` as `scale_reference`.
fn snake_case(name: &str) -> String {
    let mut snake = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.push(c.to_ascii_lowercase());
    }
    snake
}

impl Describe for Initialiser {
    fn real(&mut self, value: f64, _: bool) -> Result {
        // All of C's presets are in `float`.
        if value.is_nan() {
            self.0.push_str("__builtin_nanf(\"\")");
            Ok(())
        } else if value.is_infinite() {
            // <math.h> is not there without a C library; gcc and clang have these.
            let sign = if value > 0.0 { "" } else { "-" };
            write!(self.0, "{sign}__builtin_inff()")
        } else {
            write!(self.0, "{:?}f", value as f32)
        }
    }

    fn whole(&mut self, value: u32) -> Result {
        write!(self.0, "{value}")
    }

    fn flag(&mut self, value: bool) -> Result {
        write!(self.0, "{value}")
    }

    fn list(&mut self, items: &mut dyn Iterator<Item = &dyn Constant>) -> Result {
        self.0.push('{');
        for item in items {
            item.describe(self)?;
            self.0.push_str(", ");
        }
        self.0.push('}');
        Ok(())
    }

    fn structure(&mut self, _: &'static str, fields: &[(&'static str, &dyn Constant)]) -> Result {
        self.0.push_str("{\n");
        self.fields(fields)?;
        self.0.push('}');
        Ok(())
    }

    fn choice(&mut self, name: &'static str, variant: &'static str) -> Result {
        write!(
            self.0,
            "OMNI_{}_{}",
            snake_case(name).to_uppercase(),
            snake_case(variant).to_uppercase()
        )
    }

    fn variant(
        &mut self,
        name: &'static str,
        variant: &'static str,
        fields: &[(&'static str, &dyn Constant)],
    ) -> Result {
        self.0.push_str("{ .tag = ");
        self.choice(name, variant)?;
        self.0.push_str(", ");
        if !fields.is_empty() {
            write!(self.0, ".{} = {{ ", snake_case(variant).to_uppercase())?;
            self.fields(fields)?;
            self.0.push_str("} ");
        }
        self.0.push('}');
        Ok(())
    }

    fn option(&mut self, _: Option<&dyn Constant>) -> Result {
        Err(std::fmt::Error) // no type of `omnistep.h` has one
    }
}
