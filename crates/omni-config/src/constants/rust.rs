//! Constants as Rust source.

use std::fmt::{Result, Write};

use omni_core::constants::{Constant, Describe, Piece};

use super::Values;
use crate::Scenario;

/// Every item of a scenario.
pub(super) fn source(scenario: &Scenario, values: &Values, digest: u32) -> String {
    let (count, period_us) = (scenario.vehicle().wheel.len(), scenario.control.period_us);
    let (vehicle, policy) = (&scenario.vehicle().name, scenario.control.law());
    let controller = expression(&*values.controller);
    let limiter = expression(&values.limiter);
    let period_s = expression(&(scenario.period_s() as f32));
    let drive = values.drive.as_ref().map_or_else(String::new, |drive| {
        format!(
            "/// Everything in one step.\npub static DRIVE: omni_core::Drive<f32, {count}> = {};\n",
            expression(&**drive)
        )
    });
    let traction = values.traction.as_ref().map_or_else(String::new, |traction| {
        format!(
            "/// Traction control.\npub static TRACTION: omni_core::Traction<f32, {count}> = {};\n\
             /// What chooses its target speed.\npub static SUPERVISOR: omni_core::Supervisor<f32, {count}> = {};\n",
            expression(&*traction.traction),
            expression(&*traction.supervisor)
        )
    });
    format!(
        "// Generated from the vehicle file; not to be edited.\n\
         /// The vehicle.\npub const VEHICLE: &str = {vehicle:?};\n\
         /// The coordination policy.\npub const POLICY: &str = {policy:?};\n\
         /// The number of wheels.\npub const WHEELS: usize = {count};\n\
         /// The control period \\[us\\]: the step must be called exactly this often.\npub const PERIOD_US: u32 = {period_us};\n\
         /// CRC-32 of the constants.\npub const DIGEST: u32 = {digest:#010x};\n\
         /// Kinematics and loops.\npub static CONTROLLER: omni_core::Controller<f32, {count}> = {controller};\n\
         /// The limits of the command.\npub static LIMITER: omni_core::TwistLimiter<f32> = {limiter};\n\
         /// Dead reckoning.\npub static ODOMETRY: omni_core::Odometry<f32, {count}> = \
         omni_core::parts::Odometry::from_constants(({period_s},));\n{drive}{traction}"
    )
}

/// A value as a constant expression.
pub(super) fn expression(value: &dyn Constant) -> String {
    let mut text = Expression(String::new());
    // Writing to a string does not fail.
    let _ = value.describe(&mut text);
    text.0
}

struct Expression(String);

impl Expression {
    fn real(&mut self, value: f64, single: bool) -> Result {
        let scalar = if single { "f32" } else { "f64" };
        if value.is_nan() {
            write!(self.0, "{scalar}::NAN")
        } else if value.is_infinite() {
            let sign = if value > 0.0 { "" } else { "NEG_" };
            write!(self.0, "{scalar}::{sign}INFINITY")
        } else if single {
            // The shortest digits that read back as the same number.
            write!(self.0, "{:?}", value as f32)
        } else {
            write!(self.0, "{value:?}")
        }
    }
}

impl Describe for Expression {
    fn take(&mut self, piece: Piece<'_>) -> Result {
        match piece {
            Piece::Real { value, single } => self.real(value, single),
            Piece::Whole(value) => write!(self.0, "{value}"),
            Piece::Flag(value) => write!(self.0, "{value}"),
            Piece::List(items) => {
                self.0.push('[');
                for item in items {
                    item.describe(self)?;
                    self.0.push_str(", ");
                }
                self.0.write_str("]")
            }
            Piece::Struct { name, fields } => {
                write!(self.0, "omni_core::parts::{name}::from_constants((")?;
                for (field, value) in fields {
                    write!(self.0, "/* {field} */ ")?;
                    value.describe(self)?;
                    self.0.push_str(",\n");
                }
                self.0.write_str("))")
            }
            Piece::Choice { name, variant } => write!(self.0, "omni_core::parts::{name}::{variant}"),
            Piece::Variant {
                name,
                variant,
                fields,
            } => {
                write!(self.0, "omni_core::parts::{name}::{variant} {{ ")?;
                for (field, value) in fields {
                    write!(self.0, "{field}: ")?;
                    value.describe(self)?;
                    self.0.push_str(", ");
                }
                self.0.write_str("}")
            }
            Piece::Option(None) => self.0.write_str("None"),
            Piece::Option(Some(value)) => {
                self.0.push_str("Some(");
                value.describe(self)?;
                self.0.write_str(")")
            }
        }
    }
}
