//! Bounds of single terms of a loop.

use crate::constants::constant_struct;
use crate::error::within;
use crate::{ConfigError, Real};

/// The integral zone and the limit of the proportional term of a loop.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct TermBounds<R> {
    /// One of the two is finite.
    pub(crate) any: bool,
    /// The integral accumulates errors up to this \[rad/s\].
    zone: R,
    /// Largest proportional term \[N.m\].
    proportional: R,
}

constant_struct!(TermBounds<R> { any: bool, zone: R, proportional: R });

impl<R: Real> TermBounds<R> {
    pub(super) fn new(zone: R, proportional: R) -> Result<Self, ConfigError> {
        let from_0 = |name, value| within(name, value, 0.0..=f64::INFINITY, "0 or more");
        let zone = from_0("integral_zone_rad_s", zone)?;
        let proportional = from_0("proportional_limit_n_m", proportional)?;
        Ok(Self {
            any: zone.is_finite_real() || proportional.is_finite_real(),
            zone,
            proportional,
        })
    }

    /// The integral does not count with this error \[rad/s\].
    #[inline]
    pub(crate) fn is_outside_zone(&self, error: R) -> bool {
        error.abs() > self.zone
    }

    /// The proportional term \[N.m\] within its limit.
    #[inline]
    pub(crate) fn proportional(&self, p_n_m: R) -> R {
        p_n_m.limited(-self.proportional, self.proportional)
    }
}
