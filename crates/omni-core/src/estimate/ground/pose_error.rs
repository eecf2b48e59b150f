//! Covariance of x, y and yaw, and of the gyro's bias with them.

use super::wheel_motion::MotionEstimate;
use crate::Real;

/// Part of the wheels' residual that is an error of the velocity, and its correlation time \[s\].
const SLIP_PART: f64 = 0.1;
const SLIP_S: f64 = 0.2;
/// Largest number of periods for which an error of the gyro's bias accumulates.
const MOST_PERIODS: u16 = 2000;

/// Errors of the planar pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct PoseError<R> {
    /// Of x, y and yaw.
    covariance: [[R; 3]; 3],
    /// Variance of the gyro's bias, and its covariance with x, y and yaw.
    bias_variance: R,
    bias_covariance: [R; 3],
    /// Periods since the vehicle stood.
    periods: u16,
}

/// Movement of a period.
pub(super) struct Movement<R> {
    /// Displacement in the world, corrections included \[m\].
    pub(super) by_m: [R; 2],
    /// Increase and decrease of the position's covariance by the velocity \[m^2\]: xx, xy, yy.
    pub(super) increase_m2: [R; 3],
    pub(super) decrease_m2: [R; 3],
}

impl<R: Real> PoseError<R> {
    pub(super) fn none() -> Self {
        let zero = R::zero();
        Self {
            covariance: [[zero; 3]; 3],
            bias_variance: zero,
            bias_covariance: [zero; 3],
            periods: 0,
        }
    }

    pub(super) fn covariance(&self) -> [[R; 3]; 3] {
        self.covariance
    }

    /// The gyro's bias was measured anew, with this variance.
    pub(super) fn measure_bias(&mut self, variance: R) {
        self.bias_variance = variance;
        self.bias_covariance = [R::zero(); 3];
        self.periods = 0;
    }

    /// Noise that has the effect of the bias's error: it accumulates, so that its variance grows with the periods.
    pub(super) fn accumulated_bias(&self) -> R {
        self.bias_variance * R::of(f64::from(self.periods))
    }

    /// A period of motion begins.
    pub(super) fn count_period(&mut self) {
        self.periods = (self.periods + 1).min(MOST_PERIODS);
    }

    /// F P F^T and noise, for the F that adds the yaw's error to x and y, and that of the gyro's bias to the yaw.
    pub(super) fn grow(
        &mut self,
        movement: &Movement<R>,
        motion: &MotionEstimate<R>,
        gyro_rad_s: R,
        period_s: R,
    ) {
        let [wx, wy] = movement.by_m;
        let (increase, decrease) = (&movement.increase_m2, &movement.decrease_m2);
        let (a, b) = (-wy, wx);
        let turned = -(period_s * motion.gyro_part);
        let [[xx, xy, xw], [_, yy, yw], [_, _, ww]] = self.covariance;
        let [zx, zy, zw] = self.bias_covariance;
        let (xw_new, yw_new) = (xw + a * ww, yw + b * ww);
        let (zx_new, zy_new, zw_new) = (zx + a * zw, zy + b * zw, zw + turned * self.bias_variance);
        let slip = R::of(SLIP_PART * SLIP_PART * SLIP_S) * motion.disagreement_m2_s2 * period_s;
        let xx = xx + a * (xw + xw_new) + increase[0] - decrease[0] + slip;
        let xy = xy + a * yw + b * xw_new + increase[1] - decrease[1];
        let yy = yy + b * (yw + yw_new) + increase[2] - decrease[2] + slip;
        let xw = xw_new + turned * zx_new;
        let yw = yw_new + turned * zy_new;
        let (part, rest) = (motion.gyro_part, R::one() - motion.gyro_part);
        let rate_noise = part * part * gyro_rad_s * gyro_rad_s + rest * motion.covariance[2][2];
        let yaw_noise = rate_noise * period_s * period_s;
        let ww = ww + turned * (zw + zw_new) + yaw_noise;
        self.bias_covariance = [zx_new, zy_new, zw_new];
        self.covariance = [[xx, xy, xw], [xy, yy, yw], [xw, yw, ww]];
    }
}
