//! The scalar of the library: `f32` in firmware, `f64` as the reference.

mod floats;

mod sealed {
    /// Keeps [`super::Real`] closed, and nalgebra out of public signatures.
    pub trait Sealed: nalgebra::RealField + Copy {
        /// pi/2 as a sum. The leading parts are short, so that a few thousand times them is exact.
        const QUARTER_TURN: [Self; 3];
        /// 2 pi less its nearest value of this type.
        const TURN_REST: Self;
        /// 1.5 times the power of two above which the type has no fractions.
        const ROUNDER: Self;
        /// One over the square root of a positive normal number, off by at most two units in the last place.
        fn per_root(self) -> Self;
        /// The whole part, 0 to the largest `u32`; 0 for NaN. Without `f64` for `f32`.
        fn whole_part(self) -> u32;
        /// Bit-identical: compared without the floating-point unit.
        fn same_bits(self, other: Self) -> bool;
    }
}

/// A floating-point scalar: `f32` or `f64`, nothing else.
///
/// ```
/// use omni_core::Real;
/// assert_eq!(<f32 as Real>::of(0.5), 0.5_f32);
/// assert_eq!(0.25_f32.as_f64(), 0.25);
/// ```
pub trait Real: sealed::Sealed {
    /// 0, also in constants.
    ///
    /// ```
    /// use omni_core::Real;
    /// const NOTHING: [f32; 2] = [Real::ZERO; 2];
    /// assert_eq!(NOTHING, [0.0; 2]);
    /// ```
    const ZERO: Self;
    /// 1, also in constants.
    ///
    /// ```
    /// use omni_core::Real;
    /// assert_eq!(<f64 as Real>::ONE, 1.0);
    /// ```
    const ONE: Self;
    /// The nearest value of this type to `x`; infinite if `x` is beyond its range, NaN for NaN.
    ///
    /// ```
    /// use omni_core::Real;
    /// assert_eq!(f32::of(0.1), 0.1_f32); // rounded once
    /// assert!((f32::of(0.1).as_f64() - 0.1).abs() < 0.1 * 2.0_f64.powi(-24)); // half a unit in the last place
    /// assert_eq!(f32::of(1e39), f32::INFINITY);
    /// ```
    fn of(x: f64) -> Self;
    /// This value as `f64`, exactly.
    ///
    /// ```
    /// use omni_core::Real;
    /// assert_eq!(0.1_f32.as_f64(), 13_421_773.0 / 2.0_f64.powi(27)); // what 0.1 is in binary, digit by digit
    /// ```
    fn as_f64(self) -> f64;
    /// Neither infinite nor NaN.
    ///
    /// ```
    /// use omni_core::Real;
    /// assert!(f32::MAX.is_finite_real() && !(2.0 * f32::MAX).is_finite_real());
    /// assert!(!f64::NAN.is_finite_real());
    /// ```
    fn is_finite_real(self) -> bool;
    /// `self` held between `lower` and `upper`; `upper` wins if they cross. Unlike `f32::clamp` it cannot panic. NaN
    /// stays NaN; a bound that is NaN bounds nothing.
    ///
    /// ```
    /// use omni_core::Real;
    /// assert_eq!((-3.0_f32).limited(-1.0, 2.0), -1.0);
    /// assert_eq!(1.5_f32.limited(-1.0, 2.0), 1.5);
    /// assert_eq!(0.0_f32.limited(2.0, 1.0), 1.0); // crossed
    /// ```
    fn limited(self, lower: Self, upper: Self) -> Self {
        let x = if self < lower { lower } else { self };
        if x > upper { upper } else { x }
    }
    /// `(sin, cos)` of `self` \[rad\], in this type's own precision: for `f32` no `f64` is touched.
    ///
    /// `f64`: within a unit in the last place, at any argument. `f32`: off by at most 9.5e-8 for |x| <= 8192 rad, 0.8
    /// of a unit in the last place of 1 (measured at every `f32` of the range from 1e-3 rad on); beyond, still a point
    /// of the unit circle, but the angle decays. Infinity and NaN return NaN. `f32` reduces by pi/2 in three parts
    /// (Cody and Waite, *Software Manual for the Elementary Functions*, 1980) and evaluates minimax polynomials.
    ///
    /// ```
    /// use omni_core::Real;
    /// let (sin, cos) = (core::f32::consts::PI / 6.0).sine_cosine();
    /// assert!((sin - 0.5).abs() < 1e-7);
    /// assert!((cos - 0.866_025_4).abs() < 1e-7);
    /// ```
    #[must_use]
    fn sine_cosine(self) -> (Self, Self);
    /// The same direction as an angle in (-pi, pi] \[rad\], pi being this type's nearest value.
    ///
    /// An angle in that range comes back as it is. Otherwise off by at most 3e-7 (`f32`, |x| <=
    /// 8192 rad) or 1e-15 (`f64`,
    /// |x| <= 1e6 rad); beyond, in the range but at no particular place. Infinity and NaN return NaN.
    ///
    /// ```
    /// use omni_core::Real;
    /// assert!((7.0_f64.wrapped_angle() - (7.0 - core::f64::consts::TAU)).abs() < 1e-15);
    /// assert_eq!((-core::f32::consts::PI).wrapped_angle(), core::f32::consts::PI);
    /// ```
    #[must_use]
    fn wrapped_angle(self) -> Self;
}

/// Finite and at most 1e6 in magnitude: the range of sensors and commands. NaN is not.
#[inline]
pub(crate) fn is_plausible<R: Real>(value: R) -> bool {
    value.abs() <= R::of(1e6)
}

/// Every number is something a sensor or a command can mean.
#[inline]
pub(crate) fn all_plausible<R: Real, const N: usize>(values: &[R; N]) -> bool {
    let mut all = true;
    for &value in values {
        all &= is_plausible(value);
    }
    all
}

/// Follows what is read with this part of the gap.
pub(crate) fn follow<R: Real>(held: &mut R, now: R, part: R) {
    *held += part * (now - *held);
}

/// The larger one; `b` if `a` is NaN.
pub(crate) fn max<R: Real>(a: R, b: R) -> R {
    if a > b { a } else { b }
}

/// The smaller one; `b` if `a` is NaN.
pub(crate) fn min<R: Real>(a: R, b: R) -> R {
    if a < b { a } else { b }
}

/// The largest of sizes, which are >= 0; 0 if there are none.
pub(crate) fn largest<R: Real, const N: usize>(sizes: [R; N]) -> R {
    sizes.into_iter().fold(R::zero(), max)
}
