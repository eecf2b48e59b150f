//! Every signal of a period of traction control.

use super::loops::TractionLoops;
use crate::Real;
use crate::geometry::BodyTwist;
use crate::loops::WheelSample;

/// Every signal of a step of [`super::Traction`].
///
/// ```
/// let sample = omni_core::traction::TractionSample::<f64, 7>::zero();
/// assert_eq!((sample.speed_wheel, sample.wheels.common_factor), (None, 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TractionSample<R, const N: usize> {
    /// The command.
    pub command: BodyTwist<R>,
    /// The wheels' signals. For driven wheels `p_n_m` is the common thrust, and `d_n_m` its change by slip, heading and
    /// level control; for transverse wheels `p_n_m` and `i_n_m` are the terms of their own loops. No reference is
    /// reduced: the common factor is 1.
    pub wheels: WheelSample<R, N>,
    /// The control mode of the wheels.
    pub loops: TractionLoops,
    /// Measured speed over the commanded, -1 to 1; 1 if none is commanded.
    pub factor: R,
    /// Measured speed along the direction of travel \[m/s\].
    pub speed_m_s: R,
    /// The target that it follows \[m/s\].
    pub target_m_s: R,
    /// Common thrust \[N.m\].
    pub thrust_n_m: R,
    /// The wheel that determines the measured speed: the slowest driving wheel, or the fastest if all brake.
    pub speed_wheel: Option<usize>,
    /// Yaw rate \[rad/s\].
    pub yaw_rad_s: R,
    /// Speed across the direction of travel, to the left \[m/s\].
    pub drift_m_s: R,
    /// Heading error \[rad\], counter-clockwise positive.
    pub heading_rad: R,
    /// The gyro's zero \[rad/s\].
    pub gyro_zero_rad_s: R,
    /// Slip of each driven wheel along the direction of travel \[rad/s\]; 0 for other wheels.
    pub slip_rad_s: [R; N],
    /// Torque of each driven wheel that the ground transmits \[N.m\], by the wheel's own estimate; 0 for other wheels.
    pub contact_n_m: [R; N],
}

impl<R: Real, const N: usize> TractionSample<R, N> {
    /// At rest.
    #[must_use]
    pub const fn zero() -> Self {
        Self {
            command: BodyTwist::ZERO,
            wheels: WheelSample::zero(),
            loops: TractionLoops::Plain,
            factor: R::ONE,
            speed_m_s: R::ZERO,
            target_m_s: R::ZERO,
            thrust_n_m: R::ZERO,
            speed_wheel: None,
            yaw_rad_s: R::ZERO,
            drift_m_s: R::ZERO,
            heading_rad: R::ZERO,
            gyro_zero_rad_s: R::ZERO,
            slip_rad_s: [R::ZERO; N],
            contact_n_m: [R::ZERO; N],
        }
    }
}

impl<R: Real, const N: usize> TractionSample<R, N> {
    /// No torque for a wheel that is not usable.
    #[inline(always)]
    pub(super) fn released(&mut self, i: usize) {
        (self.slip_rad_s[i], self.contact_n_m[i]) = (R::zero(), R::zero());
        let (zero, wheels) = (R::zero(), &mut self.wheels);
        (wheels.active[i], wheels.saturated[i]) = (false, false);
        wheels.reference.rad_s[i] = zero;
        (wheels.p_n_m[i], wheels.i_n_m[i], wheels.d_n_m[i]) = (zero, zero, zero);
        (wheels.requested.n_m[i], wheels.applied.n_m[i]) = (zero, zero);
    }
}
