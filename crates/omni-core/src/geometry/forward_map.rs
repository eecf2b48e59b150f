//! The left inverses of an inverse map: least squares and the paper's average.

use super::matrix3::{self, Rows};
use crate::error::finite;
use crate::{ConfigError, Real};

/// Largest condition number of the inverse map that a layout may have: above it, wheel noise is amplified more than a
/// hundredfold in some direction of motion. Yaw is measured at the wheels' mean lever first, so that metres and radians
/// compare; 1 is the best there is.
pub const CONDITION_LIMIT: f64 = 100.0;

/// `A^T W A`, the normal equations of least squares. The columns of `A` for vx and vy are scaled by one number and that
/// for wz by another first, so that metres and radians compare: the trace is 3.
pub(super) struct Gram<R: Real> {
    matrix: Rows<R>,
    scale: [R; 3],
}

impl<R: Real> Gram<R> {
    /// Of rows that are finite and separate the three motions.
    pub(super) fn checked<const N: usize>(a: &[[R; 3]; N], weights: &[R; N]) -> Result<Self, ConfigError> {
        for (index, row) in a.iter().enumerate() {
            for &rate in row {
                finite("rates_per_twist", rate).map_err(|error| error.at(index))?;
            }
        }
        let gram = Self::new(a, weights);
        gram.check()?;
        Ok(gram)
    }

    pub(super) fn new<const N: usize>(a: &[[R; 3]; N], weights: &[R; N]) -> Self {
        let mut squares = [R::zero(); 3];
        for (row, &weight) in a.iter().zip(weights) {
            for (s, x) in squares.iter_mut().zip(row) {
                *s += weight * *x * *x;
            }
        }
        // Columns of zeros stay zero and show up in the rank.
        let per_length = |square: R| {
            if square > R::zero() {
                R::one() / square.sqrt()
            } else {
                R::zero()
            }
        };
        let [x, y, z] = squares;
        let (plane, yaw) = (per_length((x + y) * R::of(0.5)), per_length(z));
        let scale = [plane, plane, yaw];
        let mut matrix = [[R::zero(); 3]; 3];
        for (row, &weight) in a.iter().zip(weights) {
            let scaled = [row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]];
            for (sums, &x) in matrix.iter_mut().zip(&scaled) {
                for (sum, &y) in sums.iter_mut().zip(&scaled) {
                    *sum += x * y * weight;
                }
            }
        }
        Self { matrix, scale }
    }

    /// `(A^T W A)^-1 A^T W`. All zeros where the Gram matrix is singular: call a check first.
    pub(super) fn forward<const N: usize>(&self, a: &[[R; 3]; N], weights: &[R; N]) -> [[R; N]; 3] {
        let inverse = matrix3::inverse(&self.matrix).unwrap_or([[R::zero(); 3]; 3]);
        // One Newton step: what `forward` leaves of `A x = A x` falls from the square of the Gram matrix's condition to
        // the condition itself, times the precision.
        let inverse = matrix3::refined(&inverse, &self.matrix);
        let mut forward = [[R::zero(); N]; 3];
        for (j, row) in forward.iter_mut().enumerate() {
            for ((f, a), &weight) in row.iter_mut().zip(a).zip(weights) {
                let mut sum = R::zero();
                for ((i, s), a) in inverse[j].iter().zip(&self.scale).zip(a) {
                    sum += *i * *s * *a;
                }
                *f = self.scale[j] * sum * weight;
            }
        }
        forward
    }

    /// Rank, by the principal minors: each is between 0 (dependent) and about 1 (orthogonal); what
    /// rounding may leave of a zero is well below the thresholds.
    fn rank(&self) -> u8 {
        let ([[xx, xy, xz], [_, yy, yz], [_, _, zz]], tiny) = (self.matrix, R::default_epsilon().sqrt());
        if matrix3::determinant(&self.matrix) > tiny * tiny.sqrt() {
            3
        } else if xx * yy - xy * xy > tiny || xx * zz - xz * xz > tiny || yy * zz - yz * yz > tiny {
            2
        } else {
            u8::from(xx + yy + zz > tiny)
        }
    }

    /// Square root of the largest over the smallest eigenvalue: the condition number of the scaled `A` itself. Infinite
    /// if singular.
    pub(super) fn condition_number(&self) -> R {
        let [least, most] = matrix3::eigenvalues(&self.matrix);
        if least > R::zero() {
            (most / least).sqrt()
        } else {
            R::one() / R::zero()
        }
    }

    fn check(&self) -> Result<(), ConfigError> {
        let rank = self.rank();
        if rank < 3 {
            let allowed = "rank 3: wheels that move the vehicle in 3 directions";
            return Err(ConfigError::new("layout", f64::from(rank), allowed));
        }
        let condition = self.condition_number().as_f64();
        if condition.is_nan() || condition > CONDITION_LIMIT {
            let allowed = "1 to 100: turn or move wheels, or move the origin towards their middle";
            return Err(ConfigError::new("condition_number", condition, allowed));
        }
        Ok(())
    }

    /// Condition below [`CONDITION_LIMIT`] for certain, without eigenvalues: with trace 3 the two larger eigenvalues
    /// multiply to at most 9/4, so that the square of the condition is at most `3 * 9/4 / determinant`.
    pub(super) fn is_well_conditioned(&self) -> bool {
        matrix3::determinant(&self.matrix) > R::of(3.0 * 2.25 / (CONDITION_LIMIT * CONDITION_LIMIT))
    }
}

/// Row j: `1 / (n_j A_ij)` over the `n_j` wheels that axis j turns. For the seven-wheel layout this is eq. (7).
pub(super) fn column_average<R: Real, const N: usize>(a: &[[R; 3]; N]) -> Result<[[R; N]; 3], ConfigError> {
    let precision = R::default_epsilon().sqrt();
    let mut forward = [[R::zero(); N]; 3];
    for (j, row) in forward.iter_mut().enumerate() {
        let mut largest = R::zero();
        for wheel in a {
            largest = if wheel[j].abs() > largest {
                wheel[j].abs()
            } else {
                largest
            };
        }
        let turned = |wheel: &[R; 3]| wheel[j].abs() > largest * precision;
        let mut count = R::zero();
        for wheel in a {
            count += if turned(wheel) { R::one() } else { R::zero() };
        }
        for (f, wheel) in row.iter_mut().zip(a) {
            if turned(wheel) {
                *f = R::one() / (count * wheel[j]);
            }
        }
    }
    let mut worst = R::zero();
    for (j, row) in forward.iter().enumerate() {
        for k in 0..3 {
            let mut product = if j == k { -R::one() } else { R::zero() };
            for (f, wheel) in row.iter().zip(a) {
                product += *f * wheel[k];
            }
            worst = if product.abs() > worst {
                product.abs()
            } else {
                worst
            };
        }
    }
    if worst > precision {
        let allowed = "a layout whose wheel averages invert eq. (9), such as the seven-wheel one; otherwise use least squares";
        return Err(ConfigError::new("forward_map", worst.as_f64(), allowed));
    }
    Ok(forward)
}
