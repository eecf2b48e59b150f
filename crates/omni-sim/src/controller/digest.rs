//! Which constants a controller was built with, in one number.

use crc::{CRC_32_ISO_HDLC, Crc};

use crate::config::{Precision, Scenario};

/// Digest of everything that a scenario's controller is made of: its vehicle and its control section as TOML, in `f32`
/// whatever the scenario says. A controller at the other end of a link must have been built with the same.
///
/// ```
/// use omni_sim::{config::Scenario, controller::digest};
/// let (step, flat) = (Scenario::load("step", &[])?, Scenario::load("flat", &[])?);
/// assert_eq!(digest(&step), digest(&flat)); // the ground is not the controller's
/// assert_ne!(digest(&step), digest(&step.with_policy("paper")?));
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn digest(scenario: &Scenario) -> u32 {
    let mut control = scenario.control.clone();
    control.precision = Precision::F32;
    // Plain data that was read from TOML can be written as TOML.
    let vehicle = toml::to_string(scenario.vehicle()).unwrap_or_default();
    let control = toml::to_string(&control).unwrap_or_default();
    Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum((vehicle + &control).as_bytes())
}
