//! Velocity of the wheels as the accelerometer follows it.

use crate::Real;

/// Deviation of the wheels from the vehicle's velocity that passes for none \[m/s\].
pub(super) const SLIPS_M_S: f64 = 0.02;

/// Velocity of the wheels as the accelerometer follows it \[m/s\]: a slip comes and goes, a bias stays.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Rolling<R> {
    pub(super) velocity: [R; 2],
    /// Of each component, and its covariance with the bias of that axis.
    pub(super) variance: R,
    pub(super) with_bias: R,
}

impl<R: Real> Rolling<R> {
    pub(super) fn at_rest() -> Self {
        Self::at([R::zero(); 2])
    }

    pub(super) fn at(velocity: [R; 2]) -> Self {
        Self {
            velocity,
            variance: R::of(SLIPS_M_S * SLIPS_M_S),
            with_bias: R::zero(),
        }
    }
}
