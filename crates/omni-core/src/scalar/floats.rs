//! `f32` and `f64` as scalars of the library.

use super::Real;
use super::sealed::Sealed;
use crate::trig;

impl Sealed for f32 {
    const QUARTER_TURN: [Self; 3] = [1.570_312_5, 0.000_483_751_3, 7.549_79e-8];
    const TURN_REST: Self = -1.748_455_5e-7;
    const ROUNDER: Self = 12_582_912.0;
    /// Processors without an operating system compute a root only in software, with 50 instructions: this needs a third
    /// of them. Half of the exponent and a line through the fraction are off by 3.4 %; each step of Newton's method
    /// squares that.
    #[inline(always)]
    fn per_root(self) -> Self {
        let half = 0.5 * self;
        let mut y = Self::from_bits(0x5f37_5a86_u32.wrapping_sub(self.to_bits() >> 1));
        y *= 1.5 - half * y * y;
        y *= 1.5 - half * y * y;
        y *= 1.5 - half * y * y;
        y
    }
    #[inline(always)]
    fn whole_part(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn same_bits(self, other: Self) -> bool {
        self.to_bits() == other.to_bits()
    }
}

impl Sealed for f64 {
    const QUARTER_TURN: [Self; 3] = [
        1.570_796_326_734_125_6,
        6.077_100_506_303_966e-11,
        2.022_266_248_795_950_6e-21,
    ];
    const TURN_REST: Self = 2.449_293_598_294_706_4e-16;
    const ROUNDER: Self = 6_755_399_441_055_744.0;
    #[inline(always)]
    fn per_root(self) -> Self {
        1.0 / nalgebra::ComplexField::sqrt(self)
    }
    #[inline(always)]
    fn whole_part(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn same_bits(self, other: Self) -> bool {
        self.to_bits() == other.to_bits()
    }
}

macro_rules! real {
    ($t:ty, $sine_cosine:path) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
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
            #[inline]
            fn sine_cosine(self) -> (Self, Self) {
                $sine_cosine(self)
            }
            #[inline]
            fn wrapped_angle(self) -> Self {
                trig::wrapped_angle(self)
            }
        }
    };
}
real!(f32, trig::sine_cosine_f32);
real!(f64, nalgebra::ComplexField::sin_cos);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_over_a_root_is_that_to_two_units_in_the_last_place() {
        // Every exponent, and fractions on both sides of an even one.
        for exponent in -126..=127 {
            for part in 0..1000_u16 {
                let x = (1.0 + f32::from(part) / 1000.0) * 2.0_f32.powi(exponent);
                let exact = 1.0 / f64::from(x).sqrt();
                let off = (f64::from(x.per_root()) / exact - 1.0).abs();
                assert!(off < 2.0 * f64::from(f32::EPSILON), "{x}: {off}");
                assert!((f64::from(x).per_root() / exact - 1.0).abs() < 3e-16);
            }
        }
    }
}
