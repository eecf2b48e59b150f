//! Target of a vehicle under traction control in a period.

use crate::Real;

/// The vehicle's target in this period.
///
/// ```
/// use omni_core::traction::TractionTarget;
/// let target = TractionTarget::<f64, 4>::at(0.3);
/// assert_eq!((target.speed_m_s, target.climbing, target.square_up), (0.3, [false; 4], false));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct TractionTarget<R, const N: usize> {
    /// Speed along the direction of travel \[m/s\]; below 0 back.
    pub speed_m_s: R,
    /// The wheels of the row that climbs next.
    pub climbing: [bool; N],
    /// Slip that these wheels may have beyond the other wheels' slip \[m/s\], 0 or more.
    pub allowance_m_s: R,
    /// Slip that these are meant to have \[m/s\]: flywheels whose spin keeps friction at its limit
    /// through an impact. 0 is none.
    pub spin_m_s: R,
    /// Gain of that, in multiples of the thrust's.
    pub spin_gain: R,
    /// The vehicle leans on a riser: the heading error is given up, so that it squares up.
    pub square_up: bool,
    /// Another try is on: it backs off, or runs up.
    pub trying: bool,
    /// Every wheel keeps its own loop whatever it does.
    pub own_loops: bool,
}

impl<R: Real, const N: usize> TractionTarget<R, N> {
    /// A speed along the direction of travel \[m/s\], and nothing else.
    ///
    /// ```
    /// assert_eq!(omni_core::traction::TractionTarget::<f64, 4>::at(-0.1).spin_m_s, 0.0);
    /// ```
    #[must_use]
    pub fn at(speed_m_s: R) -> Self {
        Self {
            speed_m_s,
            climbing: [false; N],
            allowance_m_s: R::zero(),
            spin_m_s: R::zero(),
            spin_gain: R::zero(),
            square_up: false,
            trying: false,
            own_loops: false,
        }
    }

    /// It is more than to drive on.
    pub(super) fn is_special(&self) -> bool {
        self.trying || self.spin_m_s > R::zero()
    }
}
