//! The scalar the library is generic over: `f32` in firmware, `f64` as the oracle.

mod sealed {
    /// Keeps [`super::Real`] closed, and nalgebra out of public signatures.
    pub trait Sealed: nalgebra::RealField + Copy {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A floating-point scalar: `f32` or `f64`, nothing else.
///
/// ```
/// use omni_core::Real;
/// assert_eq!(<f32 as Real>::of(0.5), 0.5_f32);
/// assert_eq!(0.25_f32.as_f64(), 0.25);
/// ```
pub trait Real: sealed::Sealed {
    /// The nearest value of this type to `x`.
    fn of(x: f64) -> Self;
    /// This value as `f64`, exactly.
    fn as_f64(self) -> f64;
    /// Neither infinite nor NaN.
    fn is_finite_real(self) -> bool;
    /// `self` held between `lower` and `upper`; `upper` wins where they cross. Unlike `f32::clamp` it cannot panic.
    fn limited(self, lower: Self, upper: Self) -> Self {
        let x = if self < lower { lower } else { self };
        if x > upper { upper } else { x }
    }
}

macro_rules! real {
    ($t:ty) => {
        impl Real for $t {
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn as_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn is_finite_real(self) -> bool {
                self.is_finite()
            }
        }
    };
}
real!(f32);
real!(f64);
