//! Readings of one period for the ground odometry.

use crate::Real;
use crate::geometry::WheelVelocities;
use crate::linkage::MAX_HINGES;
use crate::policy::Imu;

/// The readings of one period. A value that is NaN is a missing reading.
///
/// ```
/// use omni_core::estimate::GroundInput;
/// use omni_core::policy::Imu;
/// let input = GroundInput::new(&[1.0_f32, 2.0, 3.0].into(), &Imu::level()).with_hinges(&[0.1], &[0.0]);
/// assert_eq!((input.wheels.rad_s[2], input.hinges_rad[0]), (3.0, 0.1));
/// assert!(input.hinges_rad[1].is_nan() && !input.standing);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GroundInput<R, const N: usize> {
    /// Velocities of the actuators \[rad/s\], the mean over the period.
    pub wheels: WheelVelocities<R, N>,
    /// Gyros and accelerometer, the mean over the period, and the present roll and pitch of the base.
    pub imu: Imu<R>,
    /// Present angles of the hinges \[rad\].
    pub hinges_rad: [R; MAX_HINGES],
    /// Their rates \[rad/s\].
    pub hinges_rad_s: [R; MAX_HINGES],
    /// The command is rest and the vehicle stands: the readings of the gyros are their biases, and the pose stays.
    pub standing: bool,
    /// The ground below a vehicle that stands is level: the readings of roll, pitch, hinges and accelerometer are their
    /// biases.
    pub level: bool,
}

impl<R: Real, const N: usize> GroundInput<R, N> {
    /// Of wheels and inertial measurement unit, in motion; without hinges.
    #[must_use]
    pub fn new(wheels: &WheelVelocities<R, N>, imu: &Imu<R>) -> Self {
        let nan = R::of(f64::NAN);
        Self {
            wheels: *wheels,
            imu: *imu,
            hinges_rad: [nan; MAX_HINGES],
            hinges_rad_s: [nan; MAX_HINGES],
            standing: false,
            level: false,
        }
    }

    /// With the hinges' angles and rates, in the order of the linkage.
    #[must_use]
    pub fn with_hinges(mut self, angles_rad: &[R], rates_rad_s: &[R]) -> Self {
        for (to, from) in self.hinges_rad.iter_mut().zip(angles_rad) {
            *to = *from;
        }
        for (to, from) in self.hinges_rad_s.iter_mut().zip(rates_rad_s) {
            *to = *from;
        }
        self
    }

    /// Of a vehicle that stands, on ground that is level or not.
    ///
    /// ```
    /// use omni_core::estimate::GroundInput;
    /// use omni_core::policy::Imu;
    /// let input = GroundInput::new(&[0.0; 4].into(), &Imu::<f64>::level()).at_rest(false);
    /// assert_eq!((input.standing, input.level, input.wheels.rad_s[0]), (true, false, 0.0));
    /// ```
    #[must_use]
    pub fn at_rest(self, level: bool) -> Self {
        Self {
            standing: true,
            level,
            ..self
        }
    }
}
