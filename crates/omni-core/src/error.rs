//! The error of every configuration that cannot be built.

use core::fmt;

/// A configuration value outside its range: the parameter, its index, its value and the allowed range.
///
/// Everything is checked when a configuration is built; running code cannot fail.
///
/// ```
/// use omni_core::{ConfigError, WheelLayout};
/// let error = WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.0).unwrap_err();
/// assert_eq!(error.parameter, "radius_m");
/// assert_eq!(error.index, Some(0));
/// assert_eq!(error.to_string(), "wheel 1: radius_m = 0, allowed: 0.0001 to 100");
/// // A setting of your own:
/// let error = ConfigError::new("wheel count", 9.0, "3 to 8");
/// assert_eq!((error.to_string().as_str(), error.index), ("wheel count = 9, allowed: 3 to 8", None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct ConfigError {
    /// Name of the parameter, with its unit.
    pub parameter: &'static str,
    /// Index of the wheel concerned, of the table's point if `parameter` begins with `point.`, or of the path's
    /// waypoint if it begins with `waypoint.`, from 0; messages count from 1.
    pub index: Option<usize>,
    /// The value found.
    pub value: f64,
    /// The range that would have been accepted, in words.
    pub allowed: &'static str,
}

impl ConfigError {
    /// `parameter` is `value`, but must satisfy the text `allowed`; it belongs to no particular wheel. For who checks
    /// what is handed on to this crate.
    #[must_use]
    pub fn new(parameter: &'static str, value: f64, allowed: &'static str) -> Self {
        Self {
            parameter,
            index: None,
            value,
            allowed,
        }
    }

    pub(crate) fn at(self, index: usize) -> Self {
        Self {
            index: Some(index),
            ..self
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Most lists are wheels; a parameter of a table or a path says so itself.
        let (kind, parameter) = match self.parameter.split_once('.') {
            Some((kind @ ("point" | "waypoint"), parameter)) => (kind, parameter),
            _ => ("wheel", self.parameter),
        };
        if let Some(index) = self.index {
            write!(f, "{kind} {}: ", index + 1)?;
        }
        write!(f, "{parameter} = {}, allowed: {}", self.value, self.allowed)
    }
}

impl core::error::Error for ConfigError {}

/// `value` if it is in `range`, whose ends `allowed` names. NaN is in no range.
pub(crate) fn within<R: crate::Real>(
    parameter: &'static str,
    value: R,
    range: core::ops::RangeInclusive<f64>,
    allowed: &'static str,
) -> Result<R, ConfigError> {
    if value >= R::of(*range.start()) && value <= R::of(*range.end()) {
        Ok(value)
    } else {
        Err(ConfigError::new(parameter, value.as_f64(), allowed))
    }
}

/// [`within`] of several parameters with one range.
pub(crate) fn each_within<R: crate::Real>(
    parameters: &[(&'static str, R)],
    range: &core::ops::RangeInclusive<f64>,
    allowed: &'static str,
) -> Result<(), ConfigError> {
    parameters
        .iter()
        .try_for_each(|(parameter, value)| within(parameter, *value, range.clone(), allowed).map(|_| ()))
}

/// A control period \[s\] that a loop may have.
pub(crate) fn period<R: crate::Real>(value: R) -> Result<R, ConfigError> {
    within("period_s", value, 1e-6..=10.0, "0.000001 to 10")
}

pub(crate) const POSITIVE: &str = "finite and > 0";
pub(crate) const NOT_NEGATIVE: &str = "finite and >= 0";
pub(crate) const FINITE: &str = "finite";

/// `value` if it is finite and above zero.
pub(crate) fn positive<R: crate::Real>(parameter: &'static str, value: R) -> Result<R, ConfigError> {
    if value.is_finite_real() && value > R::zero() {
        Ok(value)
    } else {
        Err(ConfigError::new(parameter, value.as_f64(), POSITIVE))
    }
}

/// `value` if it is finite and not below zero.
pub(crate) fn not_negative<R: crate::Real>(parameter: &'static str, value: R) -> Result<R, ConfigError> {
    if value.is_finite_real() && value >= R::zero() {
        Ok(value)
    } else {
        Err(ConfigError::new(parameter, value.as_f64(), NOT_NEGATIVE))
    }
}

/// `value` if it is finite.
pub(crate) fn finite<R: crate::Real>(parameter: &'static str, value: R) -> Result<R, ConfigError> {
    if value.is_finite_real() {
        Ok(value)
    } else {
        Err(ConfigError::new(parameter, value.as_f64(), FINITE))
    }
}
