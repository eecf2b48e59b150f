//! The torque ranges of motors at their present velocities.

use crate::Real;
use crate::constants::constant_struct;

/// Torque limits of one wheel at its present velocity \[N.m\]; positive drives it in its rolling direction.
///
/// ```
/// use omni_core::motor::TorqueRange;
/// use omni_core::TorqueLimit;
/// // 1 N.m at rest, 0.1 less for every rad/s; braking takes nothing from it.
/// let at_5_rad_s = TorqueLimit::line(1.0, 0.1)?.range(5.0);
/// assert_eq!(at_5_rad_s, TorqueRange { lower_n_m: -1.0, upper_n_m: 0.5 });
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct TorqueRange<R> {
    /// Lowest torque, <= 0.
    pub lower_n_m: R,
    /// Highest torque, >= 0.
    pub upper_n_m: R,
}

constant_struct!(TorqueRange<R> { lower_n_m: R, upper_n_m: R });

impl<R: Real> TorqueRange<R> {
    /// No limits at all: infinite.
    ///
    /// ```
    /// use omni_core::motor::TorqueRange;
    /// let range = TorqueRange::<f32>::unlimited();
    /// assert_eq!(range.clip(-1e30), -1e30);
    /// assert!(!range.exceeded_by(f32::MAX));
    /// ```
    #[must_use]
    pub fn unlimited() -> Self {
        let infinite = R::one() / R::zero();
        Self {
            lower_n_m: -infinite,
            upper_n_m: infinite,
        }
    }

    /// Nothing but 0: a released wheel.
    ///
    /// ```
    /// use omni_core::motor::TorqueRange;
    /// assert_eq!(TorqueRange::none().clip(-0.7), 0.0);
    /// assert!(TorqueRange::none().exceeded_by(1e-9));
    /// ```
    #[must_use]
    pub fn none() -> Self {
        Self {
            lower_n_m: R::zero(),
            upper_n_m: R::zero(),
        }
    }

    /// The range with both ends brought within +-`torque_n_m` >= 0 \[N.m\].
    ///
    /// ```
    /// use omni_core::motor::TorqueRange;
    /// let range = TorqueRange { lower_n_m: -1.0, upper_n_m: 0.5 };
    /// assert_eq!(range.capped(0.7), TorqueRange { lower_n_m: -0.7, upper_n_m: 0.5 }); // only ever narrower
    /// ```
    #[must_use]
    pub fn capped(&self, torque_n_m: R) -> Self {
        Self {
            lower_n_m: self.lower_n_m.limited(-torque_n_m, torque_n_m),
            upper_n_m: self.upper_n_m.limited(-torque_n_m, torque_n_m),
        }
    }

    /// Whether `torque_n_m` \[N.m\] is outside. The limits themselves are inside, and so is NaN.
    ///
    /// ```
    /// use omni_core::motor::TorqueRange;
    /// let range = TorqueRange { lower_n_m: -1.0, upper_n_m: 0.5 };
    /// assert!(!range.exceeded_by(0.5) && range.exceeded_by(0.6));
    /// assert!(!range.exceeded_by(-1.0) && range.exceeded_by(-1.1));
    /// ```
    #[must_use]
    pub fn exceeded_by(&self, torque_n_m: R) -> bool {
        torque_n_m > self.upper_n_m || torque_n_m < self.lower_n_m
    }

    /// `torque_n_m` \[N.m\] cut to the range.
    ///
    /// ```
    /// use omni_core::motor::TorqueRange;
    /// let range = TorqueRange { lower_n_m: -1.0, upper_n_m: 0.5 };
    /// assert_eq!([-3.0, 0.2, 3.0].map(|torque| range.clip(torque)), [-1.0, 0.2, 0.5]);
    /// ```
    #[must_use]
    pub fn clip(&self, torque_n_m: R) -> R {
        torque_n_m.limited(self.lower_n_m, self.upper_n_m)
    }
}

/// Torque limits of `N` wheels at their present velocities \[N.m\], in the layout's order.
///
/// ```
/// use omni_core::motor::TorqueRanges;
/// // Wheel 2 may brake, but not drive.
/// let ranges = TorqueRanges { lower_n_m: [-1.0, -1.0], upper_n_m: [1.0, 0.0] };
/// assert_eq!([0, 1].map(|wheel| ranges.wheel(wheel).clip(0.4)), [0.4, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
#[repr(C)]
pub struct TorqueRanges<R, const N: usize> {
    /// Lowest torque of each, <= 0.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub lower_n_m: [R; N],
    /// Highest torque of each, >= 0.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub upper_n_m: [R; N],
}

impl<R: Real, const N: usize> TorqueRanges<R, N> {
    /// The range of one wheel; nothing but 0 if `index` is not below `N`.
    ///
    /// ```
    /// use omni_core::motor::{TorqueRange, TorqueRanges};
    /// let ranges = TorqueRanges { lower_n_m: [-1.0, -2.0], upper_n_m: [1.0, 2.0] };
    /// assert_eq!(ranges.wheel(1), TorqueRange { lower_n_m: -2.0, upper_n_m: 2.0 });
    /// assert_eq!(ranges.wheel(2).upper_n_m, 0.0); // there is no wheel 3
    /// ```
    #[must_use]
    pub fn wheel(&self, index: usize) -> TorqueRange<R> {
        match (self.lower_n_m.get(index), self.upper_n_m.get(index)) {
            (Some(&lower_n_m), Some(&upper_n_m)) => TorqueRange { lower_n_m, upper_n_m },
            _ => TorqueRange::none(),
        }
    }

    /// No limits at all: infinite.
    ///
    /// ```
    /// use omni_core::motor::TorqueRanges;
    /// let ranges = TorqueRanges::<f64, 7>::unlimited();
    /// assert_eq!((ranges.lower_n_m[0], ranges.upper_n_m[6]), (f64::NEG_INFINITY, f64::INFINITY));
    /// ```
    #[must_use]
    pub fn unlimited() -> Self {
        let infinite = R::one() / R::zero();
        Self {
            lower_n_m: [-infinite; N],
            upper_n_m: [infinite; N],
        }
    }

    /// Sets the range of one wheel; nothing if `index` is not below `N`.
    ///
    /// ```
    /// use omni_core::motor::TorqueRanges;
    /// use omni_core::TorqueLimit;
    /// let mut ranges = TorqueRanges::<f64, 4>::unlimited();
    /// ranges.set(3, &TorqueLimit::constant(0.5)?.range(0.0)); // the fourth motor is hot
    /// assert_eq!((ranges.wheel(3).lower_n_m, ranges.wheel(3).upper_n_m), (-0.5, 0.5));
    /// assert!(ranges.wheel(2).upper_n_m > 1e300); // the others stay as they were
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn set(&mut self, index: usize, range: &TorqueRange<R>) {
        if let (Some(lower), Some(upper)) = (self.lower_n_m.get_mut(index), self.upper_n_m.get_mut(index)) {
            (*lower, *upper) = (range.lower_n_m, range.upper_n_m);
        }
    }

    /// Every range cut to `other`'s; ends of that which are NaN or on the wrong side of 0 stand for 0.
    pub(crate) fn restrict(&mut self, other: &Self) {
        let zero = R::zero();
        for i in 0..N {
            let (lower, upper) = (other.lower_n_m[i], other.upper_n_m[i]);
            let lower = if lower < zero { lower } else { zero };
            let upper = if upper > zero { upper } else { zero };
            self.lower_n_m[i] = if lower > self.lower_n_m[i] {
                lower
            } else {
                self.lower_n_m[i]
            };
            self.upper_n_m[i] = if upper < self.upper_n_m[i] {
                upper
            } else {
                self.upper_n_m[i]
            };
        }
    }

    #[inline]
    pub(crate) fn clip(&self, index: usize, torque: R) -> R {
        torque.limited(self.lower_n_m[index], self.upper_n_m[index])
    }
}

/// The range of a motor with at most `driving` torque along its velocity and `braking` torque against it. A velocity
/// that is NaN has no driving direction; the caller has to handle it.
#[inline]
pub(super) fn four_quadrants<R: Real>(driving: R, braking: R, velocity: R) -> TorqueRange<R> {
    let zero = R::zero();
    let driving = if driving < braking { driving } else { braking };
    let driving = if driving > zero { driving } else { zero };
    TorqueRange {
        lower_n_m: if velocity < zero { -driving } else { -braking },
        upper_n_m: if velocity > zero { driving } else { braking },
    }
}

/// `range`, or nothing if the velocity it is for is NaN.
#[inline]
pub(super) fn known<R: Real>(velocity: R, range: TorqueRange<R>) -> TorqueRange<R> {
    if velocity.partial_cmp(&R::zero()).is_none() {
        TorqueRange::none()
    } else {
        range
    }
}
