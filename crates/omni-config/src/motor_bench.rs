//! The experiment of section 3.3: motors on dampers, in the units of the paper's tables.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::file_kind::FileKind;
use crate::load::{Source, read};
use crate::override_key::Override;
#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{self, DAMPING_N_M_S_RAD, DURATION_S, INERTIA_KG_M2, SPEED_RPM, TIME_S, is_name};
use crate::vehicle::Gains;

/// Three motors, each with an inertia, a friction and dampers that act for a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct MotorBench {
    /// Version of the file format; always 1.
    #[garde(skip)] // checked before anything else is read
    #[cfg_attr(feature = "schema", schemars(range(min = crate::SCHEMA_VERSION, max = crate::SCHEMA_VERSION)))]
    pub schema_version: u32,
    /// Name in messages.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// Reference and initial velocity of every wheel \[rpm\], 0.001 to 100000.
    #[garde(adapt(ranges), range(min = SPEED_RPM.min, max = SPEED_RPM.max))]
    pub speed_rpm: f64,
    /// Simulated time \[s\], 0.01 to 3600.
    #[garde(adapt(ranges), range(min = DURATION_S.min, max = DURATION_S.max))]
    pub duration_s: f64,
    /// Control period \[us\], 1 to 100 000. A file has it in seconds.
    #[serde(
        rename = "period_s",
        deserialize_with = "crate::microseconds::period",
        serialize_with = "crate::microseconds::write"
    )]
    #[garde(skip)]
    #[cfg_attr(feature = "schema", schemars(with = "f64", description = "Control period [s]: whole microseconds, 1e-6 to 0.1.", range(min = crate::ranges::PERIOD_S.min, max = crate::ranges::PERIOD_S.max)))]
    pub period_us: u64,
    /// Inertia of a wheel \[kg.m^2\], 1e-10 to 1e6.
    #[garde(adapt(ranges), range(min = INERTIA_KG_M2.min, max = INERTIA_KG_M2.max))]
    pub inertia_kg_m2: f64,
    /// Viscous friction of every wheel besides the loads \[N.m.s/rad\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max))]
    pub friction_n_m_s_rad: f64,
    /// Gains of every wheel's loop.
    #[garde(dive)]
    pub gains: Gains,
    /// The dampers.
    #[garde(adapt(ranges), length(max = 1000), dive)]
    pub load: Vec<DamperLoad>,
}

/// A damper on one wheel for a while.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct DamperLoad {
    /// `A`, `B` or `C`.
    #[garde(custom(wheel_letter))]
    #[cfg_attr(feature = "schema", schemars(extend("enum" = LETTERS)))]
    pub wheel: String,
    /// Coefficient \[N.m.s/rad\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max))]
    pub damper_n_m_s_rad: f64,
    /// Applied from this time \[s\], 0 to 3600.
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub from_s: f64,
    /// Until this time \[s\], 0 to 3600.
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub until_s: f64,
}

/// The wheels' names, in order.
pub(crate) const LETTERS: [&str; 3] = ["A", "B", "C"];

fn wheel_letter(value: &str, _: &()) -> garde::Result {
    if LETTERS.contains(&value) {
        Ok(())
    } else {
        Err(garde::Error::new(format!("{value:?}, allowed: A, B, C")))
    }
}

impl MotorBench {
    /// The built-in experiment (`motor_bench`) or the file of that name, with some keys replaced.
    ///
    /// # Errors
    /// Its first error, in one line.
    pub fn load(name: &str, overrides: &[Override]) -> Result<Self, Error> {
        Self::from_source(&Source::wheels(name)?, overrides)
    }

    /// The experiment that a source describes, with some keys replaced.
    ///
    /// # Errors
    /// As [`MotorBench::load`].
    pub fn from_source(source: &Source, overrides: &[Override]) -> Result<Self, Error> {
        let mut table = source.table()?;
        source.expect(FileKind::Experiment, &table)?;
        for each in overrides {
            each.apply(source, &mut table)?;
        }
        read(source, table)
    }

    /// Damper coefficients on the three wheels at a time \[s\], loads only \[N.m.s/rad\].
    #[must_use]
    pub fn loads_at(&self, time_s: f64) -> [f64; 3] {
        LETTERS.map(|letter| {
            let applies = |l: &&DamperLoad| l.wheel == letter && time_s >= l.from_s && time_s < l.until_s;
            self.load.iter().filter(applies).map(|l| l.damper_n_m_s_rad).sum()
        })
    }
}
