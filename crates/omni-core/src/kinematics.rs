//! Body twist to wheel velocities and back.
//!
//! The inverse map `A` is built from the layout and is exact (eq. (9)). The forward map is a left inverse of it:
//! least squares by default, the paper's average (7) by name. What the wheels say beyond the three motions of a rigid
//! body is the redundancy residual.

use nalgebra::Matrix3;

use crate::error::ConfigError;
use crate::{BodyTwist, Real, WheelLayout};

/// How a body twist is estimated from more wheel velocities than a body has motions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForwardMap {
    /// `(A^T A)^-1 A^T`: the twist with the smallest sum of squared wheel errors \[rad/s\].
    LeastSquares,
    /// Eq. (7) for any layout: per axis, the mean of what each wheel that the axis turns says alone.
    PaperAverage,
}

/// The two linear maps of one layout. Immutable, no allocation.
///
/// ```
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.066)?)?;
/// let twist = BodyTwist { vx_m_s: 0.3, vy_m_s: -0.1, wz_rad_s: 0.5 };
/// let back = kinematics.forward(&kinematics.inverse(&twist));
/// assert!((back.wz_rad_s - 0.5_f64).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematics<R, const N: usize> {
    inverse: [[R; 3]; N],
    forward: [[R; N]; 3],
}

impl<R: Real, const N: usize> Kinematics<R, N> {
    /// The maps of `layout`, forward by least squares.
    ///
    /// # Errors
    /// Parameter `layout` where the wheels cannot move the vehicle in three directions; the value is the rank reached.
    pub fn new(layout: &WheelLayout<R, N>) -> Result<Self, ConfigError> {
        Self::with_forward(layout, ForwardMap::LeastSquares)
    }

    /// The maps of `layout` with the forward map named.
    ///
    /// # Errors
    /// As [`Kinematics::new`]; parameter `forward_map` where the average is not a left inverse of this layout (the
    /// value is the largest deviation from the identity).
    pub fn with_forward(layout: &WheelLayout<R, N>, map: ForwardMap) -> Result<Self, ConfigError> {
        let inverse = layout.wheels().map(|wheel| wheel.rates_per_twist());
        let forward = match map {
            ForwardMap::LeastSquares => least_squares(&inverse)?,
            ForwardMap::PaperAverage => {
                least_squares(&inverse)?;
                column_average(&inverse)?
            }
        };
        Ok(Self { inverse, forward })
    }

    /// Actuator velocities \[rad/s\] that move the vehicle with `twist`: eqs. (8), (9). The wheels turn `gear` times that.
    #[must_use]
    pub fn inverse(&self, twist: &BodyTwist<R>) -> [R; N] {
        let [vx, vy, wz] = twist.to_array();
        self.inverse.map(|[a, b, c]| a * vx + b * vy + c * wz)
    }

    /// The twist that the actuator velocities `velocities` \[rad/s\] amount to: eq. (6).
    #[must_use]
    pub fn forward(&self, velocities: &[R; N]) -> BodyTwist<R> {
        BodyTwist::from_array(self.forward.map(|row| {
            let mut sum = R::zero();
            for (f, v) in row.iter().zip(velocities) {
                sum += *f * *v;
            }
            sum
        }))
    }

    /// The part of `velocities` \[rad/s\] that some motion of a rigid body explains: `A A+ v`.
    #[must_use]
    pub fn project(&self, velocities: &[R; N]) -> [R; N] {
        self.inverse(&self.forward(velocities))
    }

    /// The rest, `(I - A A+) v` \[rad/s\]: zero where no wheel slips, `N - 3` independent checks.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.35, 0.27, 0.1)?)?;
    /// // Forward at 0.3 m/s, wheel 4 slipping by 1 rad/s: four fifths of it cannot be motion.
    /// let residual = kinematics.residual(&[3.0_f64, 0.0, -3.0, 4.0, 3.0, 0.0, -3.0]);
    /// assert!((residual[3] - 0.8).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn residual(&self, velocities: &[R; N]) -> [R; N] {
        let mut rest = *velocities;
        for (r, p) in rest.iter_mut().zip(self.project(velocities)) {
            *r -= p;
        }
        rest
    }

    /// The inverse map `A`, one row `[1/m, 1/m, 1]` a wheel: the matrix printed as eq. (9).
    #[must_use]
    pub fn inverse_matrix(&self) -> &[[R; 3]; N] {
        &self.inverse
    }

    /// The forward map, one row an axis: J of eq. (7) where [`ForwardMap::PaperAverage`] was chosen.
    #[must_use]
    pub fn forward_matrix(&self) -> &[[R; N]; 3] {
        &self.forward
    }
}

/// `(A^T A)^-1 A^T`, with the columns of `A` scaled to length 1 first, so that metres and radians compare.
fn least_squares<R: Real, const N: usize>(a: &[[R; 3]; N]) -> Result<[[R; N]; 3], ConfigError> {
    let mut scale = [R::zero(); 3];
    for row in a {
        for (s, x) in scale.iter_mut().zip(row) {
            *s += *x * *x;
        }
    }
    // A column of zeros stays zero and shows up in the rank.
    let scale = scale.map(|s| {
        if s > R::zero() {
            R::one() / s.sqrt()
        } else {
            R::zero()
        }
    });
    let mut gram = Matrix3::<R>::zeros();
    for row in a {
        let [x, y, z] = [row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]];
        gram += Matrix3::new(x * x, x * y, x * z, y * x, y * y, y * z, z * x, z * y, z * z);
    }
    let refused = || {
        ConfigError::new(
            "layout",
            f64::from(rank(&gram)),
            "wheels that move the vehicle in 3 directions (rank 3)",
        )
    };
    if rank(&gram) < 3 {
        return Err(refused());
    }
    let inverse = gram.try_inverse().ok_or_else(refused)?;
    let mut forward = [[R::zero(); N]; 3];
    for (j, row) in forward.iter_mut().enumerate() {
        for (f, a) in row.iter_mut().zip(a) {
            let mut sum = R::zero();
            for k in 0..3 {
                sum += inverse[(j, k)] * scale[k] * a[k];
            }
            *f = scale[j] * sum;
        }
    }
    Ok(forward)
}

/// Rank of a 3x3 Gram matrix of unit columns, by its principal minors. Each minor is between 0 (dependent) and 1
/// (orthogonal); below the square root of the precision the inverse would lose half of its digits.
fn rank<R: Real>(gram: &Matrix3<R>) -> u8 {
    let tiny = R::default_epsilon().sqrt();
    let pair = |i: usize, j: usize| gram[(i, i)] * gram[(j, j)] - gram[(i, j)] * gram[(j, i)];
    if gram.determinant() > tiny {
        3
    } else if pair(0, 1) > tiny || pair(0, 2) > tiny || pair(1, 2) > tiny {
        2
    } else {
        u8::from(gram.trace() > tiny)
    }
}

/// Row j: `1 / (n_j A_ij)` over the `n_j` wheels that axis j turns. For the seven-wheel layout this is eq. (7).
fn column_average<R: Real, const N: usize>(a: &[[R; 3]; N]) -> Result<[[R; N]; 3], ConfigError> {
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
        let allowed =
            "a layout whose wheel averages invert eq. (9), as the seven-wheel one; else least squares";
        return Err(ConfigError::new("forward_map", worst.as_f64(), allowed));
    }
    Ok(forward)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wheel;
    use proptest::prelude::*;

    fn chugo7(r1: f64, r2: f64, map: ForwardMap) -> Kinematics<f64, 7> {
        let layout = WheelLayout::chugo7(r1, r2, 0.066).expect("valid layout");
        Kinematics::with_forward(&layout, map).expect("valid maps")
    }

    /// Largest difference between two matrices.
    fn distance(a: &[[f64; 7]; 3], b: &[[f64; 7]; 3]) -> f64 {
        a.iter()
            .flatten()
            .zip(b.iter().flatten())
            .map(|(x, y)| (x - y).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn inverse_map_is_equation_9_as_printed() {
        let (k, r, r1, r2) = (0.05, 0.066, 0.30, 0.23);
        let wheels = WheelLayout::<f64, 7>::chugo7(r1, r2, r)
            .expect("valid")
            .wheels()
            .map(|w| Wheel { gear: k, ..w });
        let kinematics = Kinematics::new(&WheelLayout::new(wheels).expect("valid")).expect("valid");
        let printed = [
            [1.0, 0.0, r2],
            [0.0, -1.0, r1],
            [-1.0, 0.0, r2],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, r2],
            [0.0, 1.0, r1],
            [-1.0, 0.0, r2],
        ];
        for (row, printed) in kinematics.inverse_matrix().iter().zip(printed) {
            for (x, p) in row.iter().zip(printed) {
                // One multiplication and one division: a few units in the last place of values up to 300.
                assert!((x - p / (k * r)).abs() < 1e-12 / k, "{x} {p}");
            }
        }
    }

    #[test]
    fn average_map_is_equation_7_as_printed() {
        let (r, r1, r2) = (0.066, 0.30, 0.23);
        let (x, y, z2, z1) = (r / 5.0, r / 2.0, r / (6.0 * r2), r / (6.0 * r1));
        let printed = [
            [x, 0.0, -x, x, x, 0.0, -x],
            [0.0, -y, 0.0, 0.0, 0.0, y, 0.0],
            [z2, z1, z2, 0.0, z2, z1, z2],
        ];
        assert!(
            distance(
                chugo7(r1, r2, ForwardMap::PaperAverage).forward_matrix(),
                &printed
            ) < 1e-16
        );
    }

    #[test]
    fn average_map_7_times_inverse_map_9_is_the_identity() {
        for (r1, r2) in [(0.30, 0.23), (0.2, 0.2), (0.1, 0.4)] {
            let kinematics = chugo7(r1, r2, ForwardMap::PaperAverage);
            for j in 0..3 {
                let mut unit = [0.0; 3];
                unit[j] = 1.0;
                let back = kinematics
                    .forward(&kinematics.inverse(&BodyTwist::from_array(unit)))
                    .to_array();
                for (got, expected) in back.iter().zip(unit) {
                    assert!((got - expected).abs() < 1e-15, "J * (9) = I: {back:?}");
                }
            }
        }
    }

    #[test]
    fn equation_9_is_the_moore_penrose_inverse_of_7_only_where_r1_equals_r2() {
        let gap = |r1, r2| {
            let least_squares = chugo7(r1, r2, ForwardMap::LeastSquares);
            distance(
                least_squares.forward_matrix(),
                chugo7(r1, r2, ForwardMap::PaperAverage).forward_matrix(),
            )
        };
        // (9) is the pseudo-inverse of (7) exactly where (7) is the pseudo-inverse of (9).
        assert!(gap(0.25, 0.25) < 1e-15);
        // Yaw row, transverse wheels: least squares r R1 / (4 R2^2 + 2 R1^2), average r / (6 R1).
        let (r, r1, r2) = (0.066, 0.30, 0.23);
        let expected: f64 = r * r1 / (4.0 * r2 * r2 + 2.0 * r1 * r1) - r / (6.0 * r1);
        assert!(
            (gap(r1, r2) - expected).abs() < 1e-15,
            "{} {expected}",
            gap(r1, r2)
        );
        assert!(expected > 0.01, "a quarter of the coefficient, not rounding");
    }

    #[test]
    fn residual_is_what_no_rigid_motion_explains() {
        let kinematics = chugo7(0.35, 0.27, ForwardMap::LeastSquares);
        let rigid = kinematics.inverse(&BodyTwist {
            vx_m_s: 0.3,
            vy_m_s: 0.2,
            wz_rad_s: -0.7,
        });
        assert!(kinematics.residual(&rigid).iter().all(|r| r.abs() < 1e-14));
        let mut slipping = rigid;
        slipping[3] += 1.0;
        let norm = kinematics
            .residual(&slipping)
            .iter()
            .map(|r| r * r)
            .sum::<f64>()
            .sqrt();
        assert!((norm - 0.894_427_190_999_915_9).abs() < 1e-12); // sqrt(0.8): wheel 4 is one of five that roll along x
    }

    #[test]
    fn average_is_refused_where_it_is_not_an_inverse() {
        let at = |degrees: f64, reach: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            Wheel {
                position_m: [reach * cos, reach * sin],
                rolling_direction: [-sin, cos],
                roller_angle_rad: 0.0,
                radius_m: 0.05,
                gear: 1.0,
            }
        };
        let layout = WheelLayout::new([at(0.0, 0.2), at(120.0, 0.3), at(240.0, 0.2)]).expect("rank 3");
        let error =
            Kinematics::with_forward(&layout, ForwardMap::PaperAverage).expect_err("not a left inverse");
        assert_eq!(error.parameter, "forward_map");
        assert!(Kinematics::new(&layout).is_ok());
    }

    proptest! {
        #[test]
        fn forward_undoes_inverse_and_f32_follows_f64(
            r1 in 0.05..1.0, r2 in 0.05..1.0, radius in 0.02..0.2, vx in -2.0..2.0, vy in -2.0..2.0, wz in -3.0..3.0,
        ) {
            let twist = BodyTwist { vx_m_s: vx, vy_m_s: vy, wz_rad_s: wz };
            let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(r1, r2, radius).expect("valid")).expect("valid");
            let wheels = kinematics.inverse(&twist);
            let back = kinematics.forward(&wheels);
            for (got, expected) in back.to_array().iter().zip(twist.to_array()) {
                // Condition below 20 after scaling, numbers below 3.
                prop_assert!((got - expected).abs() < 1e-13);
            }
            let layout = WheelLayout::<f32, 7>::chugo7(r1 as f32, r2 as f32, radius as f32).expect("valid");
            let single = Kinematics::new(&layout).expect("valid");
            let wheels32 = single.inverse(&BodyTwist { vx_m_s: vx as f32, vy_m_s: vy as f32, wz_rad_s: wz as f32 });
            for (a, b) in wheels32.iter().zip(wheels) {
                // A dozen roundings of 6e-8 each on sums of up to three terms that may cancel.
                prop_assert!((f64::from(*a) - b).abs() < 1e-6 * (5.0 / radius));
            }
        }
    }
}
