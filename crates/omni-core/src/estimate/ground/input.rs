//! Readings of one period for the ground odometry.

use crate::Real;
use crate::geometry::{BodyTwist, WheelTorques, WheelVelocities};
use crate::linkage::MAX_HINGES;
use crate::policy::Imu;

/// The readings of one period. A value that is NaN is a missing reading.
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_core::estimate::GroundInput;
/// use omni_core::policy::Imu;
/// let input = GroundInput::new(&[1.0_f32, 2.0, 3.0].into(), &Imu::level(), &BodyTwist::ZERO);
/// let input = input.with_hinges(&[0.1], &[0.0]);
/// assert_eq!((input.wheels.rad_s[2], input.hinges_rad[0]), (3.0, 0.1));
/// assert!(input.hinges_rad[1].is_nan());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GroundInput<R, const N: usize> {
    /// Velocities of the actuators \[rad/s\].
    pub wheels: WheelVelocities<R, N>,
    /// Gyros, accelerometer, and roll and pitch of the base. Where roll or pitch is NaN, the gyros turn the lean.
    pub imu: Imu<R>,
    /// Angles of the hinges \[rad\].
    pub hinges_rad: [R; MAX_HINGES],
    /// Their rates \[rad/s\].
    pub hinges_rad_s: [R; MAX_HINGES],
    /// Torques of the actuators \[N m\], as commanded or measured: of wheels that push while the vehicle is held. NaN
    /// where one is not known, as of a motor that brakes.
    pub torques: WheelTorques<R, N>,
    /// The command: a vehicle that is commanded to rest and is quiet stands.
    pub command: BodyTwist<R>,
}

impl<R: Real, const N: usize> GroundInput<R, N> {
    /// Of wheels, inertial measurement unit and command; without hinges.
    #[must_use]
    pub fn new(wheels: &WheelVelocities<R, N>, imu: &Imu<R>, command: &BodyTwist<R>) -> Self {
        let nan = R::of(f64::NAN);
        Self {
            wheels: *wheels,
            imu: *imu,
            hinges_rad: [nan; MAX_HINGES],
            hinges_rad_s: [nan; MAX_HINGES],
            torques: [nan; N].into(),
            command: *command,
        }
    }

    /// With the torques of the actuators.
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// use omni_core::estimate::GroundInput;
    /// use omni_core::geometry::{WheelTorques, WheelVelocities};
    /// use omni_core::policy::Imu;
    /// let input = GroundInput::new(&WheelVelocities::<f32, 3>::zero(), &Imu::level(), &BodyTwist::ZERO);
    /// assert!(input.torques.n_m[0].is_nan()); // not known
    /// assert_eq!(input.with_torques(&WheelTorques { n_m: [0.5; 3] }).torques.n_m[0], 0.5);
    /// ```
    #[must_use]
    pub fn with_torques(mut self, torques: &WheelTorques<R, N>) -> Self {
        self.torques = *torques;
        self
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
}
