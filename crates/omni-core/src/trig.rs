//! Sine, cosine and angles in the scalar's own precision.

use crate::Real;

/// Beyond pi/4 by what the choice of the quadrant may be off at the end of the documented range. Only arguments
/// beyond that range reduce to more, and are held here, so that the result stays a point of the unit circle.
const LARGEST_REDUCED_F32: f32 = 0.79;

/// `x - k pi/2`, pi/2 in three parts so that the products with the two leading ones are exact (Cody and Waite, 1980).
fn reduced<R: Real>(x: R, k: R) -> R {
    let [leading, middle, rest] = R::QUARTER_TURN;
    ((x - k * leading) - k * middle) - k * rest
}

/// The integer next to `t`, by pushing its fraction out of the significand. Exact up to a half of what the
/// significand counts, finite beyond.
fn nearest<R: Real>(t: R) -> R {
    (t + R::ROUNDER) - R::ROUNDER
}

/// See [`Real::sine_cosine`]. The polynomials are minimax fits on \[-pi/4, pi/4\] (Remez), rounded to `f32`; their own
/// errors are 1.8e-9 (sine) and 1e-10 (cosine).
pub(crate) fn sine_cosine_f32(x: f32) -> (f32, f32) {
    let pushed = x * core::f32::consts::FRAC_2_PI + 12_582_912.0;
    // The quarter turns are in the lowest bits, negative ones as two's complement.
    let quadrant = pushed.to_bits();
    let r = reduced(x, pushed - 12_582_912.0).limited(-LARGEST_REDUCED_F32, LARGEST_REDUCED_F32);
    let z = r * r;
    let sine = r + r * z * (-0.166_666_51 + z * (0.008_331_977 + z * -0.000_194_953_73));
    let cosine = (1.0 - 0.5 * z) + z * z * (0.041_666_646 + z * (-0.001_388_736_5 + z * 0.000_024_438_174));
    match quadrant & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// See [`Real::wrapped_angle`].
pub(crate) fn wrapped_angle<R: Real>(x: R) -> R {
    let pi = R::pi();
    if x > -pi && x <= pi {
        return x;
    }
    let r = reduced(x, R::of(4.0) * nearest(x / R::two_pi()));
    let r = if r > pi {
        r - R::two_pi()
    } else if r <= -pi {
        r + R::two_pi()
    } else {
        r
    };
    // Far beyond the documented range the remainder is arbitrary, but still an angle.
    let r = r.limited(-pi, pi);
    if r <= -pi { pi } else { r }
}

/// `sin(x) / x`, 1 at 0, for any finite `x` \[rad\].
pub(crate) fn cardinal_sine<R: Real>(x: R) -> R {
    if x.abs() < R::of(0.05) {
        // The next term, x^8 / 362880, is below half a unit in the last place of an f64.
        let z = x * x;
        R::one() - z * (R::of(1.0 / 6.0) - z * (R::of(1.0 / 120.0) - z * R::of(1.0 / 5040.0)))
    } else {
        x.sine_cosine().0 / x
    }
}

/// The derivative of [`cardinal_sine`].
pub(crate) fn cardinal_sine_slope<R: Real>(x: R) -> R {
    if x.abs() < R::of(0.2) {
        // The closed form cancels here. The next term, x^9 / 3991680, is below 2e-13.
        let z = x * x;
        let sum = R::of(1.0 / 30.0) - z * (R::of(1.0 / 840.0) - z * R::of(1.0 / 45_360.0));
        -x * (R::of(1.0 / 3.0) - z * sum)
    } else {
        let (sin, cos) = x.sine_cosine();
        (cos - sin / x) / x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::PI as PI_F32;
    use core::f64::consts::PI;
    use proptest::prelude::*;

    /// Larger error of the two against the `f64` functions.
    fn error_f32(x: f32) -> f64 {
        let (sin, cos) = x.sine_cosine();
        let (sin_f64, cos_f64) = f64::from(x).sine_cosine();
        (f64::from(sin) - sin_f64)
            .abs()
            .max((f64::from(cos) - cos_f64).abs())
    }

    #[test]
    fn single_precision_sine_is_within_one_unit_of_1_over_the_documented_range() {
        let mut worst: f64 = 0.0;
        // A step that is no fraction of a quarter turn; 2.7 million arguments.
        let mut x = -8192.0_f64;
        while x <= 8192.0 {
            worst = worst.max(error_f32(x as f32));
            x += 0.006_123_4;
        }
        for k in -400_000..=400_000_i32 {
            worst = worst.max(error_f32(k as f32 * 1e-5));
        }
        // 9.48e-8 over every f32 from 1e-3 to 8192, at 7102.3276: 0.8 of a unit in the last place of 1.
        assert!(worst < 9.5e-8, "{worst:e}");
        assert!(worst > 1e-8, "the comparison sees rounding: {worst:e}");
    }

    #[test]
    fn single_precision_sine_is_exact_where_it_must_be() {
        assert_eq!(0.0_f32.sine_cosine(), (0.0, 1.0));
        // Small arguments: relative, not absolute accuracy, because sin(x) / x is formed from it.
        for k in 1..30 {
            let x = 0.5_f32.powi(k);
            let (sin, _) = x.sine_cosine();
            assert!((f64::from(sin) / f64::from(x).sin() - 1.0).abs() < f64::from(f32::EPSILON));
            assert_eq!((-x).sine_cosine().0, -sin);
        }
    }

    #[test]
    fn cardinal_sine_and_its_slope_are_smooth_where_series_and_quotient_meet() {
        for edge in [0.05_f64, 0.2] {
            let (below, above) = (edge * (1.0 - 1e-15), edge);
            // A few roundings of 1.1e-16.
            assert!(
                (cardinal_sine(below) - cardinal_sine(above)).abs() < 5e-16,
                "{edge}"
            );
            // The quotient's cancellation, 1.1e-16 / 0.2, and the series' next term, 1.3e-13.
            assert!(
                (cardinal_sine_slope(below) - cardinal_sine_slope(above)).abs() < 2e-13,
                "{edge}"
            );
        }
        assert_eq!(cardinal_sine(0.0_f32), 1.0);
        assert_eq!(cardinal_sine_slope(0.0_f32), 0.0);
    }

    #[test]
    fn angles_at_the_seam_belong_to_its_positive_side() {
        assert_eq!(PI.wrapped_angle(), PI);
        assert_eq!((-PI).wrapped_angle(), PI);
        assert_eq!((-PI_F32).wrapped_angle(), PI_F32);
        assert_eq!(0.0_f64.wrapped_angle(), 0.0);
        // Three times the f64 pi is 7e-16 from an odd number of half turns, on either side.
        assert!((3.0 * PI).wrapped_angle().abs() > PI - 1e-15);
    }

    #[test]
    fn what_is_not_a_number_stays_so() {
        assert!(f32::NAN.sine_cosine().0.is_nan());
        assert!(f32::NAN.wrapped_angle().is_nan() && f64::INFINITY.wrapped_angle().is_nan());
    }

    proptest! {
        #[test]
        fn any_finite_number_has_a_direction_and_a_wrapped_angle(bits in any::<u32>()) {
            let x = f32::from_bits(bits);
            prop_assume!(x.is_finite());
            let (sin, cos) = x.sine_cosine();
            prop_assert!(sin.abs() <= 1.0 && cos.abs() <= 1.0, "{x}: {sin} {cos}");
            // On the unit circle, though beyond the documented range at no particular place.
            prop_assert!((sin * sin + cos * cos - 1.0).abs() < 4.0 * f32::EPSILON);
            for w in [x.wrapped_angle(), x.wrapped_angle().wrapped_angle()] {
                prop_assert!(w > -PI_F32 && w <= PI_F32, "{x}: {w}");
            }
            let w = f64::from(x).wrapped_angle();
            prop_assert!(w > -PI && w <= PI);
        }

        #[test]
        fn wrapping_changes_an_angle_by_whole_turns(x in -8192.0..8192.0_f64) {
            let w = x.wrapped_angle();
            prop_assert!(w > -PI && w <= PI);
            // 1300 turns of a two_pi that is off by 2.4e-16 in `turns * 2 pi`, and its rounding (9e-13).
            let turns = ((x - w) / (2.0 * PI)).round();
            prop_assert!((x - w - turns * 2.0 * PI).abs() < 2e-12, "{x} {w}");
            // The remainder is nearly exact: two roundings of numbers below 2 pi.
            let single = (x as f32).wrapped_angle();
            let same = (f64::from(single) - f64::from(x as f32).wrapped_angle()).abs();
            prop_assert!(same.min(2.0 * PI - same) < 5e-7, "{x} {single}");
        }

        #[test]
        fn cardinal_sine_is_sine_over_x_in_both_precisions(x in -6.0..6.0_f64) {
            prop_assume!(x.abs() > 1e-6);
            prop_assert!((cardinal_sine(x) - x.sin() / x).abs() < 3e-16);
            // Sine within 1.2e-7, divided by at least 0.05 only if the sine is relatively accurate.
            prop_assert!((f64::from(cardinal_sine(x as f32)) - x.sin() / x).abs() < 3e-7);
            let h = 1e-5;
            let difference = (cardinal_sine(x + h) - cardinal_sine(x - h)) / (2.0 * h);
            // Third derivative / 6 * h^2 is 2e-11, cancellation 1.1e-16 / h = 1e-11.
            prop_assert!((cardinal_sine_slope(x) - difference).abs() < 1e-10);
        }
    }
}
