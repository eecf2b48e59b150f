//! Readings of an estimator in a period.

use crate::Real;
use crate::geometry::{BodyTwist, WheelVelocities};
use crate::policy::Imu;

/// The readings of one period. NaN marks a missing reading.
///
/// ```
/// use omni_core::estimate::EstimatorInput;
/// let input = EstimatorInput::new(&[1.0_f32, 2.0, 3.0].into());
/// assert!(input.wheels.rad_s[2] == 3.0 && input.yaw_rate_rad_s.is_nan());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct EstimatorInput<R, const N: usize> {
    /// Velocities of the actuators \[rad/s\].
    pub wheels: WheelVelocities<R, N>,
    /// Yaw rate by the gyro \[rad/s\], counter-clockwise positive.
    pub yaw_rate_rad_s: R,
    /// Acceleration of the origin along and to the left of the heading, level and without gravity \[m/s^2\].
    pub acceleration_m_s2: [R; 2],
    /// The command is rest: a vehicle that then stands still has no velocity.
    pub commanded_rest: bool,
    /// Unit vector, forward and to the left, along which something holds the vehicle that its wheels push against: it
    /// has no velocity along it, however fast they turn. Zeros for none.
    pub(in crate::estimate) held_along: [R; 2],
}

impl<R: Real, const N: usize> EstimatorInput<R, N> {
    /// Wheels alone; on its way.
    #[must_use]
    pub fn new(wheels: &WheelVelocities<R, N>) -> Self {
        let nan = R::of(f64::NAN);
        Self {
            wheels: *wheels,
            yaw_rate_rad_s: nan,
            acceleration_m_s2: [nan; 2],
            commanded_rest: false,
            held_along: [R::zero(); 2],
        }
    }

    /// Readings of wheels and an inertial measurement unit, with the command. The unit's roll and pitch level its
    /// readings: gravity is subtracted from the acceleration, and the yaw rate is the rate of the heading. Without them
    /// there is no acceleration, and the rate is that about z.
    ///
    /// ```
    /// use omni_core::estimate::EstimatorInput;
    /// use omni_core::policy::Imu;
    /// use omni_core::BodyTwist;
    /// // At rest with the nose up by 0.1 rad: gravity pushes backwards along x, and means nothing.
    /// let mut imu = Imu::level();
    /// (imu.pitch_rad, imu.specific_force_m_s2) = (0.1_f64, [9.81 * 0.1_f64.sin(), 0.0, 9.81 * 0.1_f64.cos()]);
    /// let input = EstimatorInput::with_imu(&[0.0; 4].into(), &imu, &BodyTwist::ZERO);
    /// assert!(input.acceleration_m_s2[0].abs() < 1e-12 && input.commanded_rest);
    /// ```
    #[must_use]
    pub fn with_imu(wheels: &WheelVelocities<R, N>, imu: &Imu<R>, command: &BodyTwist<R>) -> Self {
        let mut input = Self::new(wheels);
        input.commanded_rest = *command == BodyTwist::ZERO;
        let [fx, fy, fz] = imu.specific_force_m_s2;
        let [wx, wy, wz] = imu.rate_rad_s;
        let ((sp, cp), (sr, _)) = (imu.pitch_rad.sine_cosine(), imu.roll_rad.sine_cosine());
        // The base's axes, seen from its heading: x = (cp, 0, sp), y = (a, b, sr) across it, z = x cross y.
        let level = R::one() - sp * sp - sr * sr;
        let upright = level > R::of(0.01);
        if !upright {
            // On its side, or not known: a lean that is NaN.
            input.yaw_rate_rad_s = wz;
            return input;
        }
        let a = -(sp * sr) / cp;
        let b = level.sqrt() / cp;
        let z = [-(sp * b), sp * a - cp * sr, cp * b];
        input.acceleration_m_s2 = [cp * fx + a * fy + z[0] * fz, b * fy + z[1] * fz];
        // Along the heading and upwards; what turns the x axis sideways is both.
        let along = cp * wx + a * wy + z[0] * wz;
        let up = sp * wx + sr * wy + z[2] * wz;
        input.yaw_rate_rad_s = up - along * sp / cp;
        input
    }
}
