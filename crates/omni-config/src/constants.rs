//! A scenario's controller as source code for firmware: Rust for a build script, a C header.
//!
//! The numbers are bit-identical to the simulator's controller in `f32`: firmware runs the simulated controller.

mod c;
mod rust;
#[cfg(test)]
mod tests;
mod values;

use omni_core::constants::Constant;

use crate::{Error, Scenario};
use values::Values;

/// A configured value as a Rust expression for a `const` or `static`; it names `omni_core`.
///
/// ```
/// use omni_core::shaping::{AxisLimits, RateLimiter};
/// let limiter = RateLimiter::new(AxisLimits::symmetric(0.5_f32, 2.0, 4.0, f32::INFINITY), 0.25)?;
/// let source = omni_config::rust_expression(&limiter);
/// assert!(source.starts_with("omni_core::parts::RateLimiter::from_constants("));
/// assert!(source.contains("/* min */ -0.5") && source.contains("/* jerk_step */ f32::INFINITY"));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[must_use]
pub fn rust_expression(value: &dyn Constant) -> String {
    rust::expression(value)
}

/// A language that constants can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Language {
    /// Items for `include!`, which name `omni_core`.
    Rust,
    /// A header for `omnistep.h`.
    C,
}

impl Scenario {
    /// The controller's constants in `f32`, as source.
    ///
    /// In Rust: `VEHICLE`, `POLICY`, `WHEELS`, `HINGES`, `PERIOD_US`, [`Scenario::constants_digest`] as `DIGEST`, and
    /// `CONTROLLER`, `LIMITER`, `ODOMETRY`, `MOTORS`, to be used as any other, `DRIVE` if the scenario has a `[drive]`
    /// (under traction control an [`omni_core::drive::TractionDrive`]), `TRACTION` and `SUPERVISOR` if its policy is
    /// traction control, `ENCODER` if it has `sensors.encoder_counts`, `TRAJECTORY` and `FOLLOWER` if its command is a
    /// path. In C the same as `OMNI_...`, except for the separate odometry. Traction control is only in `OMNI_DRIVE`,
    /// which then also exists without a `[drive]`. [`Scenario::estimator`] is `OMNI_ESTIMATOR`.
    ///
    /// # Errors
    /// As [`Scenario::controller`].
    ///
    /// ```
    /// use omni_config::{Language, Scenario};
    /// let source = Scenario::load("step", &[])?.constants(Language::Rust)?;
    /// assert!(source.contains("pub static CONTROLLER: omni_core::Controller<f32, 7> ="));
    /// assert!(source.contains("pub const PERIOD_US: u32 = 1000;"));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn constants(&self, language: Language) -> Result<String, Error> {
        let firmware = self.for_firmware();
        let values = firmware.values()?;
        match language {
            Language::Rust => Ok(rust::source(&firmware, &values, values.digest())),
            Language::C => c::source(&firmware, &values, values.digest()),
        }
    }

    /// CRC-32 of the constants: two controllers with the same digest behave identically. Firmware reports it on
    /// request.
    ///
    /// # Errors
    /// As [`Scenario::controller`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let step = Scenario::load("step", &[])?;
    /// let icy = Scenario::load("step", &[Override::parse("terrain.friction=0.1")?])?;
    /// let weaker = Scenario::load("step", &[Override::parse("vehicle.motor.stall_torque_n_m=1.5")?])?;
    /// assert_eq!(step.constants_digest()?, icy.constants_digest()?); // the controller does not know the friction
    /// assert_ne!(step.constants_digest()?, weaker.constants_digest()?);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn constants_digest(&self) -> Result<u32, Error> {
        Ok(self.for_firmware().values()?.digest())
    }
}

impl Values {
    fn digest(&self) -> u32 {
        let mut text = rust::expression(&*self.controller);
        text.push_str(&rust::expression(&self.limiter));
        if let Some(drive) = &self.drive {
            text.push_str(&rust::expression(&**drive));
        }
        if let Some(traction) = &self.traction {
            text.push_str(&rust::expression(&*traction.supervisor));
            text.push_str(&rust::expression(&*traction.traction));
        }
        crc32fast::hash(text.as_bytes())
    }
}
