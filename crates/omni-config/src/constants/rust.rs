//! Constants as Rust source.

use std::fmt::{Result, Write};

use omni_core::constants::{Constant, Describe, Piece};

use super::values::Values;
use crate::Scenario;

/// Every item of a scenario.
pub(super) fn source(scenario: &Scenario, values: &Values, digest: u32) -> String {
    let (count, period_us) = (scenario.vehicle().wheel.len(), scenario.control.period_us);
    let (vehicle, policy) = (&scenario.vehicle().name, scenario.control.law());
    let hinges = scenario.vehicle().hinge.len();
    let controller = expression(&*values.controller);
    let loops = if scenario.has_traction() {
        "Kinematics and the wheels' loops, without `POLICY`, which is in `TRACTION`."
    } else {
        "Kinematics and loops."
    };
    let limiter = expression(&values.limiter);
    let period_s = expression(&(scenario.period_s() as f32));
    let drive = values.drive.as_ref().map_or_else(String::new, |drive| {
        let kind = if scenario.has_traction() { "drive::TractionDrive" } else { "Drive" };
        format!(
            "/// The complete drive: one step each control period.\npub static DRIVE: omni_core::{kind}<f32, {count}> = {};\n",
            expression(&**drive)
        )
    });
    let traction = values.traction.as_ref().map_or_else(String::new, |traction| {
        format!(
            "/// Traction control.\npub static TRACTION: omni_core::traction::Traction<f32, {count}> = {};\n\
             /// Chooses the target speed of traction control.\npub static SUPERVISOR: omni_core::traction::Supervisor<f32, {count}> = {};\n",
            expression(&*traction.traction),
            expression(&*traction.supervisor)
        )
    });
    let motors = expression(&*values.motors);
    let encoder = values.encoder.as_ref().map_or_else(String::new, |encoder| {
        let window = scenario.velocity_window();
        format!(
            "/// A wheel's velocity from its encoder's counter, of 16 bits or more.\n\
             pub static ENCODER: omni_core::estimate::Encoder<f32, ENCODER_WINDOW> = {};\n\
             /// Readings that its state holds the counts of.\npub const ENCODER_WINDOW: usize = {window};\n",
            expression(encoder)
        )
    });
    let path = values.path.as_ref().map_or_else(String::new, |path| {
        let trajectory = path.trajectory();
        let progress = path.progress.as_ref().map_or_else(String::new, |progress| {
            format!(
                "/// Makes the trajectory wait for the vehicle.\npub static PROGRESS: omni_core::path::PathProgress<f32> = {};\n",
                single(progress)
            )
        });
        format!(
            "/// The planned trajectory.\npub static TRAJECTORY: omni_core::path::Trajectory<'static, f32> = \
             omni_core::path::Trajectory::new(&[{}], &[{}]);\n\
             /// Follows the trajectory.\npub static FOLLOWER: omni_core::path::HolonomicFollower<f32> = {};\n{progress}",
            list(trajectory.segments()),
            list(trajectory.pieces()),
            single(&path.follower)
        )
    });
    let items = format!(
        "// Generated from the vehicle file. Do not edit.\n\
         /// The vehicle.\npub const VEHICLE: &str = {vehicle:?};\n\
         /// The coordination policy.\npub const POLICY: &str = {policy:?};\n\
         /// The number of wheels.\npub const WHEELS: usize = {count};\n\
         /// The number of hinges.\npub const HINGES: usize = {hinges};\n\
         /// The control period \\[us\\]: the step must be called exactly this often.\npub const PERIOD_US: u32 = {period_us};\n\
         /// CRC-32 of the constants.\npub const DIGEST: u32 = {digest:#010x};\n\
         /// {loops}\npub static CONTROLLER: omni_core::Controller<f32, {count}> = {controller};\n\
         /// The limits of the command.\npub static LIMITER: omni_core::shaping::TwistLimiter<f32> = {limiter};\n\
         /// Dead reckoning.\npub static ODOMETRY: omni_core::estimate::Odometry<f32, {count}> = \
         omni_core::parts::Odometry::from_constants(({period_s},));\n\
         /// What each wheel's motor gives, and its duty for a torque.\n\
         pub static MOTORS: [omni_core::TorqueLimit<f32>; {count}] = {motors};\n{encoder}{drive}{traction}{path}"
    );
    // No program needs all of them.
    items
        .replace("\npub const ", "\n#[allow(dead_code)]\npub const ")
        .replace("\npub static ", "\n#[allow(dead_code)]\npub static ")
}

/// Values made in `f64` as items of an array in `f32`.
fn list<T: Constant>(values: &[T]) -> String {
    let items: Vec<_> = values.iter().map(|value| single(value)).collect();
    items.join(",\n")
}

/// A value made in `f64` as a constant expression of the same type in `f32`: every number is the nearest.
fn single(value: &dyn Constant) -> String {
    text(value, true)
}

/// A value as a constant expression.
pub(super) fn expression(value: &dyn Constant) -> String {
    text(value, false)
}

fn text(value: &dyn Constant, single: bool) -> String {
    let mut expression = Expression {
        text: String::new(),
        single,
    };
    // Writing to a string does not fail.
    let _ = value.describe(&mut expression);
    expression.text
}

struct Expression {
    text: String,
    /// In `f32`, whatever the value is in.
    single: bool,
}

impl Expression {
    fn real(&mut self, value: f64, single: bool) -> Result {
        let scalar = if single { "f32" } else { "f64" };
        if value.is_nan() {
            write!(self.text, "{scalar}::NAN")
        } else if value.is_infinite() {
            let sign = if value > 0.0 { "" } else { "NEG_" };
            write!(self.text, "{scalar}::{sign}INFINITY")
        } else if single {
            // The shortest digits that read back as the same number.
            write!(self.text, "{:?}", value as f32)
        } else {
            write!(self.text, "{value:?}")
        }
    }
}

impl Describe for Expression {
    fn take(&mut self, piece: Piece<'_>) -> Result {
        match piece {
            Piece::Real { value, single } => self.real(value, single || self.single),
            Piece::Whole(value) => write!(self.text, "{value}"),
            Piece::Flag(value) => write!(self.text, "{value}"),
            Piece::List(items) => {
                self.text.push('[');
                for item in items {
                    item.describe(self)?;
                    self.text.push_str(", ");
                }
                self.text.write_str("]")
            }
            Piece::Struct { name, fields } => {
                write!(self.text, "omni_core::parts::{name}::from_constants((")?;
                for (field, value) in fields {
                    write!(self.text, "/* {field} */ ")?;
                    value.describe(self)?;
                    self.text.push_str(",\n");
                }
                self.text.write_str("))")
            }
            Piece::Choice { name, variant } => write!(self.text, "omni_core::parts::{name}::{variant}"),
            Piece::Variant {
                name,
                variant,
                fields,
            } => {
                write!(self.text, "omni_core::parts::{name}::{variant} {{ ")?;
                for (field, value) in fields {
                    write!(self.text, "{field}: ")?;
                    value.describe(self)?;
                    self.text.push_str(", ");
                }
                self.text.write_str("}")
            }
            Piece::Option(None) => self.text.write_str("None"),
            Piece::Option(Some(value)) => {
                self.text.push_str("Some(");
                value.describe(self)?;
                self.text.write_str(")")
            }
        }
    }
}
