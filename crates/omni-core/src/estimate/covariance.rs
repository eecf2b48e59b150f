//! The covariance of the pose by odometry, propagated to first order.

use crate::constants::constant_struct;
use crate::error::not_negative;
use crate::geometry::{BodyDisplacement, Kinematics, PlanarPose, WheelAngles};
use crate::trig::{cardinal_sine, cardinal_sine_slope};
use crate::{ConfigError, Real};

/// Covariance of a pose: symmetric 3x3 in x, y and yaw of the world frame.
///
/// ```
/// use omni_core::estimate::PoseCovariance;
/// // 2 cm in x, 1 cm in y, a tenth of a radian.
/// let start = PoseCovariance::diagonal([4e-4_f64, 1e-4, 1e-2])?;
/// assert_eq!(start.matrix()[0], [4e-4, 0.0, 0.0]);
/// assert_eq!(start.standard_deviations()[0], 0.02);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PoseCovariance<R> {
    matrix: [[R; 3]; 3],
}

impl<R: Real> Default for PoseCovariance<R> {
    /// The pose is known exactly.
    fn default() -> Self {
        Self {
            matrix: [[R::zero(); 3]; 3],
        }
    }
}

impl<R: Real> PoseCovariance<R> {
    /// Independent uncertainties with the variances `[x, y, yaw]` >= 0 \[m^2, m^2, rad^2\].
    ///
    /// # Errors
    /// Parameter `x_m2`, `y_m2` or `yaw_rad2` if it is negative or not finite.
    ///
    /// ```
    /// use omni_core::estimate::PoseCovariance;
    /// let error = PoseCovariance::diagonal([1e-4, 1e-4, -0.1]).unwrap_err(); // a variance has no sign
    /// assert_eq!((error.parameter, error.value), ("yaw_rad2", -0.1));
    /// ```
    pub fn diagonal([x_m2, y_m2, yaw_rad2]: [R; 3]) -> Result<Self, ConfigError> {
        let zero = R::zero();
        Ok(Self {
            matrix: [
                [not_negative("x_m2", x_m2)?, zero, zero],
                [zero, not_negative("y_m2", y_m2)?, zero],
                [zero, zero, not_negative("yaw_rad2", yaw_rad2)?],
            ],
        })
    }

    /// Of a matrix that is one.
    pub(crate) fn of(matrix: [[R; 3]; 3]) -> Self {
        Self { matrix }
    }

    /// The symmetric 3 x 3 matrix, rows and columns x, y, yaw \[m^2, m rad, rad^2\]: entries 0, 1, 5, 6, 7, 11, 30, 31,
    /// 35 of the 6x6 of a ROS 2 `PoseWithCovariance`.
    #[must_use]
    pub fn matrix(&self) -> &[[R; 3]; 3] {
        &self.matrix
    }

    /// Standard deviations of x, y and yaw, each on its own \[m, m, rad\].
    ///
    /// ```
    /// use omni_core::estimate::PoseCovariance;
    /// let covariance = PoseCovariance::diagonal([0.25, 0.0625, 1.0])?;
    /// assert_eq!(covariance.standard_deviations(), [0.5, 0.25, 1.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn standard_deviations(&self) -> [R; 3] {
        let [[x, _, _], [_, y, _], [_, _, yaw]] = self.matrix;
        // Rounding may leave a variance of nothing just below zero.
        [x, y, yaw].map(|v| if v > R::zero() { v.sqrt() } else { R::zero() })
    }
}

/// How wrong a wheel's increment is held to be: its variance is `q = k^2 |dphi| + g rho^2` \[rad^2\], dphi being the
/// increment and rho its residual ([`Kinematics::increment_residual`]). Checked by [`CovarianceGrowth::new`].
///
/// ```
/// use omni_core::estimate::{CovarianceGrowth, OdometryNoise, PoseCovariance};
/// use omni_core::geometry::PlanarPose;
/// let growth = CovarianceGrowth::new(OdometryNoise { wheel_rad_per_sqrt_rad: 0.1_f64, residual_gain: 2.0 })?;
/// let mut covariance = PoseCovariance::default();
/// // A single wheel, a metre a radian: 4 rad back, of which 0.3 rad were slip.
/// growth.step_by(&mut covariance, &PlanarPose::origin(), &[[1.0], [0.0], [0.0]], &[-4.0].into(), &[0.3].into());
/// assert!((covariance.matrix()[0][0] - (0.1 * 0.1 * 4.0 + 2.0 * 0.3 * 0.3)).abs() < 1e-15); // back is as bad as ahead
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OdometryNoise<R> {
    /// k >= 0: standard deviation of a wheel's angle after it turned by a radian \[rad per root of rad\]. Uneven
    /// ground, rollers. Errors of different steps are independent, so that the variance grows in proportion to the
    /// distance.
    pub wheel_rad_per_sqrt_rad: R,
    /// g >= 0: variance per squared residual of a step, the part of the increment that no motion of the vehicle
    /// explains. Slip. A lasting slip s \[rad/s\] adds g s^2 dt^2 each step: its effect is proportional to the period.
    pub residual_gain: R,
}

/// Grows a [`PoseCovariance`] along with the pose. Immutable.
///
/// `P' = F P F^T + G (J diag(q) J^T) G^T`, F and G being the derivatives of the exact step by the pose and by the
/// displacement, and J the forward map.
///
/// Limits: it has no model of bias. A wrong wheel radius, a wrong layout, a bent axle or a wheel that always slips in
/// one direction cause errors that grow with the distance, not with its root, and are not included. Wheels are assumed
/// independent. To first order: beyond a yaw deviation of some 0.3 rad the true distribution is no longer an ellipse.
/// It only grows; including a measurement is the task of a filter.
///
/// In `f32` the sums are plain: 100,000 steps at 0.3 m/s and 100 Hz leave it 0.5 % from `f64`, and the increment of a
/// step is lost once it is below 6e-8 of the sum, after some ten million steps. If that matters, step it every tenth
/// period, with the increments summed.
///
/// The usual name: first-order propagation of errors, the prediction of an extended Kalman filter.
///
/// ```
/// use omni_core::estimate::{CovarianceGrowth, OdometryNoise, PoseCovariance};
/// use omni_core::geometry::PlanarPose;
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.1)?)?;
/// let growth = CovarianceGrowth::new(OdometryNoise { wheel_rad_per_sqrt_rad: 0.05_f64, residual_gain: 1.0 })?;
/// let mut covariance = PoseCovariance::default();
/// // 0.3 m ahead in one step: five wheels of 0.1 m turn by 3 rad, each good for a fifth of the way.
/// let turned = [3.0, 0.0, -3.0, 3.0, 3.0, 0.0, -3.0].into();
/// growth.step(&mut covariance, &PlanarPose::origin(), &kinematics, &turned);
/// let variance_m2 = 5.0 * (0.1 / 5.0_f64).powi(2) * 0.05_f64.powi(2) * 3.0;
/// assert!((covariance.matrix()[0][0] - variance_m2).abs() < 1e-18);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct CovarianceGrowth<R> {
    /// k^2 \[rad\].
    per_rad: R,
    /// g.
    per_residual: R,
}

constant_struct!(CovarianceGrowth<R> { per_rad: R, per_residual: R });

impl<R: Real> OdometryNoise<R> {
    /// Placeholder if there is none: wheels without error.
    pub(crate) fn none() -> Self {
        Self {
            wheel_rad_per_sqrt_rad: R::zero(),
            residual_gain: R::zero(),
        }
    }
}

impl<R: Real> CovarianceGrowth<R> {
    /// Growth by the noise given.
    ///
    /// # Errors
    /// Parameter `wheel_rad_per_sqrt_rad` or `residual_gain` if it is negative or not finite.
    pub fn new(noise: OdometryNoise<R>) -> Result<Self, ConfigError> {
        let k = not_negative("wheel_rad_per_sqrt_rad", noise.wheel_rad_per_sqrt_rad)?;
        Ok(Self {
            per_rad: k * k,
            per_residual: not_negative("residual_gain", noise.residual_gain)?,
        })
    }

    /// One step from `start`, the estimated pose before it, with the actuator increments `increments` \[rad\]
    /// ([`Odometry::increments`](crate::estimate::Odometry::increments), or velocities times the period).
    ///
    /// False, and nothing changed, if the result would not be finite.
    ///
    /// ```
    /// use omni_core::estimate::{CovarianceGrowth, OdometryNoise, PoseCovariance};
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::omni(0.5, 0.0, 0.1)?)?;
    /// let growth = CovarianceGrowth::new(OdometryNoise { wheel_rad_per_sqrt_rad: 0.1, residual_gain: 1.0 })?;
    /// let mut covariance = PoseCovariance::default();
    /// // On the spot: four wheels turn by 4 rad, each good for 0.1 / 0.5 / 4 of the yaw and off by 0.1 * sqrt(4) rad.
    /// assert!(growth.step(&mut covariance, &PlanarPose::origin(), &kinematics, &[4.0; 4].into()));
    /// let yaw_rad = 4.0_f64.sqrt() * (0.1 / 0.5 / 4.0) * (0.1 * 2.0); // independent: their squares add up
    /// assert!((covariance.standard_deviations()[2] - yaw_rad).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step<const N: usize>(
        &self,
        covariance: &mut PoseCovariance<R>,
        start: &PlanarPose<R>,
        kinematics: &Kinematics<R, N>,
        increments: &WheelAngles<R, N>,
    ) -> bool {
        let residuals = kinematics.increment_residual(increments);
        self.step_by(
            covariance,
            start,
            kinematics.forward_matrix(),
            increments,
            &residuals,
        )
    }

    /// As [`CovarianceGrowth::step`] with a forward map `forward`, one row per axis \[m, m, 1\], and residuals
    /// `residuals` of the caller's. An excluded wheel has a column of zeros.
    ///
    /// ```
    /// use omni_core::estimate::{CovarianceGrowth, OdometryNoise, PoseCovariance};
    /// use omni_core::geometry::PlanarPose;
    /// let growth = CovarianceGrowth::new(OdometryNoise { wheel_rad_per_sqrt_rad: 0.0, residual_gain: 0.25 })?;
    /// let mut covariance = PoseCovariance::default();
    /// let first_of_two = [[0.1_f64, 0.0], [0.0, 0.0], [0.0, 0.0]];
    /// growth.step_by(&mut covariance, &PlanarPose::origin(), &first_of_two, &[1.0, 40.0].into(), &[0.2, 39.0].into());
    /// assert!((covariance.standard_deviations()[0] - 0.1 * 0.5 * 0.2).abs() < 1e-15);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step_by<const N: usize>(
        &self,
        covariance: &mut PoseCovariance<R>,
        start: &PlanarPose<R>,
        forward: &[[R; N]; 3],
        increments: &WheelAngles<R, N>,
        residuals: &WheelAngles<R, N>,
    ) -> bool {
        let moved = forward.map(|row| {
            let mut sum = R::zero();
            for (f, d) in row.iter().zip(&increments.rad) {
                sum += *f * *d;
            }
            sum
        });
        let (by_yaw, by_displacement) = derivatives(start, &BodyDisplacement::from_array(moved));
        // Each wheel alone: its column of G J, whose outer product its variance weighs.
        let mut grown = sheared(by_yaw, &covariance.matrix);
        let [jx, jy, jyaw] = forward;
        let wheels = jx
            .iter()
            .zip(jy)
            .zip(jyaw)
            .zip(&increments.rad)
            .zip(&residuals.rad);
        for ((((&x, &y), &yaw), increment), &residual) in wheels {
            let variance = self.per_rad * increment.abs() + self.per_residual * residual * residual;
            let column = by_displacement.map(|[a, b, c]| a * x + b * y + c * yaw);
            for i in 0..3 {
                for j in i..3 {
                    grown[i][j] += variance * column[i] * column[j];
                }
            }
        }
        // The upper triangle is what was computed.
        let [[xx, xy, xw], [_, yy, yw], [_, _, ww]] = grown;
        let finite = [xx, xy, xw, yy, yw, ww].iter().all(|c| c.is_finite_real());
        if finite {
            covariance.matrix = [[xx, xy, xw], [xy, yy, yw], [xw, yw, ww]];
        }
        finite
    }
}

/// Derivatives of [`PlanarPose::moved_by`]: of x and y by the yaw (the pose's others are the identity), and of the
/// pose by the displacement.
fn derivatives<R: Real>(start: &PlanarPose<R>, moved: &BodyDisplacement<R>) -> ([R; 2], [[R; 3]; 3]) {
    let half = R::of(0.5);
    let half_turn = moved.dyaw_rad * half;
    let (chord, slope) = (cardinal_sine(half_turn), cardinal_sine_slope(half_turn));
    let (sin, cos) = (start.yaw_rad + half_turn).sine_cosine();
    // The displacement along the world's axes, not yet shortened by turning.
    let (x, y) = (
        cos * moved.dx_m - sin * moved.dy_m,
        sin * moved.dx_m + cos * moved.dy_m,
    );
    let by_displacement = [
        [chord * cos, -(chord * sin), half * (slope * x - chord * y)],
        [chord * sin, chord * cos, half * (slope * y + chord * x)],
        [R::zero(), R::zero(), R::one()],
    ];
    ([-(chord * y), chord * x], by_displacement)
}

/// `F P F^T`, its upper triangle, for the F that adds `a` yaw to x and `b` yaw to y.
fn sheared<R: Real>([a, b]: [R; 2], p: &[[R; 3]; 3]) -> [[R; 3]; 3] {
    let [[xx, xy, xw], [_, yy, yw], [_, _, ww]] = *p;
    let (xw_new, yw_new) = (xw + a * ww, yw + b * ww);
    let zero = R::zero();
    [
        [xx + a * (xw + xw_new), xy + a * yw + b * xw_new, xw_new],
        [zero, yy + b * (yw + yw_new), yw_new],
        [zero, zero, ww],
    ]
}

#[cfg(test)]
mod tests;
