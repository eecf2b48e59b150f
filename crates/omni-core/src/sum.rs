//! Sums that keep what rounding would lose, for long drives and slow ramps.

use crate::Real;

/// A sum and what its rounding left out, carried into the next addition (after Neumaier, 1974).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Sum<R> {
    /// The sum, rounded.
    pub(crate) total: R,
    /// Exact sum less `total`: at most half a unit in its last place.
    pub(crate) rest: R,
}

impl<R: Real> Sum<R> {
    pub(crate) const fn of(total: R) -> Self {
        let rest = R::ZERO;
        Self { total, rest }
    }

    /// Knuth's error of a sum is added to the remainder, then the two are separated again.
    pub(crate) fn plus(self, x: R) -> Self {
        let rounded = self.total + x;
        let taken = rounded - self.total;
        let rest = self.rest + ((self.total - (rounded - taken)) + (x - taken));
        let total = rounded + rest;
        Self {
            total,
            rest: rest - (total - rounded),
        }
    }

    /// Difference from this sum to `target`.
    pub(crate) fn gap(&self, target: R) -> R {
        (target - self.total) - self.rest
    }

    pub(crate) fn is_finite(&self) -> bool {
        (self.total + self.rest).is_finite_real()
    }
}
