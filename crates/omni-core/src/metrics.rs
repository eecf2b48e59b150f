//! Ratios of wheel slip and disturbance: as in the paper, and in forms that are defined at rest.

use crate::Real;

/// Disturbed ratio of eq. (14) as printed, `(reference - velocity) / velocity`: infinite or NaN at rest.
///
/// ```
/// use omni_core::metrics::disturbed_ratio_literal;
/// assert_eq!(disturbed_ratio_literal(10.0, 8.0), 0.25);
/// assert!(disturbed_ratio_literal(0.0, 0.0_f64).is_nan()); // wheels 2 and 6 driving straight
/// ```
pub fn disturbed_ratio_literal<R: Real>(reference_rad_s: R, velocity_rad_s: R) -> R {
    (reference_rad_s - velocity_rad_s) / velocity_rad_s
}

/// Slip ratio of eq. (15) as printed, `(r w - v) / (r w)`: infinite or NaN at rest.
///
/// ```
/// use omni_core::metrics::slip_ratio_literal;
/// assert_eq!(slip_ratio_literal(0.5, 0.375), 0.25); // a quarter of the rim's way is lost
/// assert_eq!(slip_ratio_literal(0.25, 0.5), -1.0); // sliding faster than it turns
/// ```
pub fn slip_ratio_literal<R: Real>(rim_m_s: R, along_m_s: R) -> R {
    (rim_m_s - along_m_s) / rim_m_s
}

/// `(wanted - got) / max(|wanted|, |got|, floor)`, positive if `got` lags behind `wanted`: always within -2..=2.
///
/// The sign follows the direction of `wanted` (of `got` if nothing is wanted). `floor` > 0 is the speed under which a
/// difference counts as noise.
fn bounded_ratio<R: Real>(wanted: R, got: R, floor: R) -> R {
    let max = |a: R, b: R| if a > b { a } else { b };
    let scale = max(max(wanted.abs(), got.abs()), floor);
    let direction = if wanted != R::zero() { wanted } else { got };
    let difference = (wanted - got) / scale;
    if direction < R::zero() {
        -difference
    } else {
        difference
    }
}

/// Disturbed ratio, defined at rest: `(reference - velocity) / max(|reference|, |velocity|, floor)`, positive if the
/// wheel lags, within -2..=2. Equals eq. (14) to first order for small differences.
///
/// `floor_rad_s` > 0: velocity under which differences count as noise; [`DISTURBED_FLOOR_RAD_S`] by default.
///
/// ```
/// use omni_core::metrics::{DISTURBED_FLOOR_RAD_S, disturbed_ratio};
/// assert_eq!(disturbed_ratio(10.0, 8.0, DISTURBED_FLOOR_RAD_S), 0.2);
/// assert_eq!(disturbed_ratio(-10.0, -8.0, DISTURBED_FLOOR_RAD_S), 0.2); // backwards: it lags all the same
/// assert_eq!(disturbed_ratio(0.0, 0.0, DISTURBED_FLOOR_RAD_S), 0.0);
/// assert_eq!(disturbed_ratio(4.0, 0.0, DISTURBED_FLOOR_RAD_S), 1.0); // blocked
/// ```
pub fn disturbed_ratio<R: Real>(reference_rad_s: R, velocity_rad_s: R, floor_rad_s: R) -> R {
    bounded_ratio(reference_rad_s, velocity_rad_s, floor_rad_s)
}

/// Slip ratio, defined at rest: `(rim - along) / max(|rim|, |along|, floor)`, positive if the wheel spins faster than
/// it moves, within -2..=2.
///
/// `rim_m_s` is r w, w against the world (an encoder reads it against a frame that may pitch); `along_m_s` the
/// velocity of the wheel's centre along its rolling direction in the tangent plane of its contact (not the body's
/// velocity: a wheel on an edge rolls a longer path). `floor_m_s` > 0 as above; [`SLIP_FLOOR_M_S`] by default.
///
/// ```
/// use omni_core::metrics::{SLIP_FLOOR_M_S, slip_ratio};
/// assert_eq!(slip_ratio(0.5, 0.375, SLIP_FLOOR_M_S), 0.25);
/// assert_eq!(slip_ratio(0.3, 0.0, SLIP_FLOOR_M_S), 1.0); // spins on the spot
/// assert_eq!(slip_ratio(0.0, 0.3, SLIP_FLOOR_M_S), -1.0); // slides blocked
/// ```
pub fn slip_ratio<R: Real>(rim_m_s: R, along_m_s: R, floor_m_s: R) -> R {
    bounded_ratio(rim_m_s, along_m_s, floor_m_s)
}

/// Default floor of [`disturbed_ratio`]: 0.1 rad/s, a fiftieth of the wheels' velocity at 0.3 m/s.
pub const DISTURBED_FLOOR_RAD_S: f64 = 0.1;

/// Default floor of [`slip_ratio`]: 0.01 m/s.
pub const SLIP_FLOOR_M_S: f64 = 0.01;

/// Shape error `w - ref (ref . w) / (ref . ref)` \[rad/s\]: the part of the velocities that no common factor on the
/// references explains. All of `w` if every reference is zero. Zero when all wheels slow down together.
///
/// ```
/// use omni_core::metrics::shape_error;
/// assert_eq!(shape_error(&[4.0, -4.0], &[2.0, -2.0]), [0.0, 0.0]);
/// assert_eq!(shape_error(&[4.0, -4.0], &[3.0, -1.0]), [1.0, 1.0]);
/// ```
pub fn shape_error<R: Real, const N: usize>(reference_rad_s: &[R; N], velocity_rad_s: &[R; N]) -> [R; N] {
    let (mut along, mut square) = (R::zero(), R::zero());
    for (&r, &w) in reference_rad_s.iter().zip(velocity_rad_s) {
        along += r * w;
        square += r * r;
    }
    let factor = if square > R::zero() {
        along / square
    } else {
        R::zero()
    };
    let mut error = *velocity_rad_s;
    for (e, &r) in error.iter_mut().zip(reference_rad_s) {
        *e -= factor * r;
    }
    error
}

/// Standard deviation of `velocity / reference` over the wheels with a reference of at least `floor_rad_s`: 0 when they
/// keep the commanded ratios, whatever their common speed. 0 if fewer than two wheels have one.
///
/// ```
/// use omni_core::metrics::speed_ratio_std;
/// assert_eq!(speed_ratio_std(&[4.0, -4.0, 0.0], &[2.0, -2.0, 0.3], 0.1), 0.0);
/// assert_eq!(speed_ratio_std(&[4.0, -4.0, 0.0], &[4.0, -2.0, 0.3], 0.1), 0.25);
/// ```
pub fn speed_ratio_std<R: Real, const N: usize>(
    reference_rad_s: &[R; N],
    velocity_rad_s: &[R; N],
    floor_rad_s: R,
) -> R {
    let driven = |r: R| r.abs() >= floor_rad_s;
    let (mut count, mut sum) = (R::zero(), R::zero());
    for (&r, &w) in reference_rad_s.iter().zip(velocity_rad_s) {
        if driven(r) {
            count += R::one();
            sum += w / r;
        }
    }
    if count < R::of(2.0) {
        return R::zero();
    }
    let mean = sum / count;
    let mut square = R::zero();
    for (&r, &w) in reference_rad_s.iter().zip(velocity_rad_s) {
        if driven(r) {
            square += (w / r - mean) * (w / r - mean);
        }
    }
    (square / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn literal_forms_are_equations_14_and_15_and_singular_at_rest() {
        for (velocity, d) in [(8.0, 0.25_f64), (10.0, 0.0), (12.5, -0.2)] {
            assert!((disturbed_ratio_literal(10.0, velocity) - d).abs() < 1e-15);
        }
        assert!(disturbed_ratio_literal(1.0, 0.0_f64).is_infinite());
        assert!(slip_ratio_literal(0.0, 0.0_f64).is_nan());
        assert!((slip_ratio_literal(0.30, 0.24_f64) - 0.2).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn safe_forms_are_bounded_and_meet_the_literal_ones_for_small_differences(
            wanted in -30.0..30.0_f64, got in -30.0..30.0_f64, small in -1e-3..1e-3_f64,
        ) {
            let d = disturbed_ratio(wanted, got, DISTURBED_FLOOR_RAD_S);
            prop_assert!(d.abs() <= 2.0);
            if wanted.abs() > 0.2 {
                let near = wanted * (1.0 + small);
                let gap = disturbed_ratio(wanted, near, DISTURBED_FLOOR_RAD_S) - disturbed_ratio_literal(wanted, near);
                prop_assert!(gap.abs() < 1.1 * small * small); // the denominators differ by `small`
            }
            let at_rest = disturbed_ratio(0.0, got * 1e-9, DISTURBED_FLOOR_RAD_S);
            prop_assert!(at_rest.abs() < 1e-6);
        }

        #[test]
        fn shape_error_is_orthogonal_to_the_reference(
            reference in prop::array::uniform7(-5.0..5.0_f64), velocity in prop::array::uniform7(-5.0..5.0_f64),
        ) {
            let error = shape_error(&reference, &velocity);
            let dot: f64 = error.iter().zip(reference).map(|(e, r)| e * r).sum();
            prop_assert!(dot.abs() < 1e-11); // 14 products of up to 25
        }
    }
}
