//! The whole control step behind the interface of every controller.

use super::config::DriveInput;
use super::model::Drive;
use super::sample::DriveSample;
use super::state::DriveState;
use crate::Real;
use crate::geometry::WheelVelocities;
use crate::policy::{Policy, Readings};

/// A [`Drive`] as a [`Policy`]: everything that firmware does in a period.
///
/// ```
/// use omni_core::drive::DrivePolicy;
/// use omni_core::{BodyTwist, Drive, DriveConfig, DriveMode, Policy, Readings, WheelLayout};
/// # let config = omni_core::examples::loops(0.25, 0.0, 2.0)?;
/// let mut policy = DrivePolicy::new(Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?);
/// let (ahead, mut torques_n_m) = (BodyTwist { vx_m_s: 0.4, ..BodyTwist::ZERO }, [0.0; 4]);
/// policy.step(&Readings::new(ahead, &[0.0, f64::NAN, 0.0, 0.0]), &mut torques_n_m); // wheel 2 is silent: released
/// assert!((torques_n_m[0] - 1.0).abs() < 1e-12 && torques_n_m[1] == 0.0); // 0.25 N.m a rad/s, 4 rad/s
/// assert_eq!(policy.sample().map(|sample| sample.mode), Some(DriveMode::Degraded));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivePolicy<R, const N: usize> {
    drive: Drive<R, N>,
    state: DriveState<R, N>,
    sample: Option<DriveSample<R, N>>,
    emergency: bool,
}

impl<R: Real, const N: usize> DrivePolicy<R, N> {
    /// Freshly started.
    #[must_use]
    pub fn new(drive: Drive<R, N>) -> Self {
        Self {
            state: DriveState::new(&drive),
            drive,
            sample: None,
            emergency: false,
        }
    }

    /// The drive.
    #[must_use]
    pub fn drive(&self) -> &Drive<R, N> {
        &self.drive
    }

    /// The result of the last step; none before the first.
    ///
    /// ```
    /// use omni_core::drive::DrivePolicy;
    /// use omni_core::{BodyTwist, Drive, DriveConfig, Policy, Readings, WheelLayout};
    /// # let config = omni_core::examples::loops(0.25, 0.0, 2.0)?;
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// let mut policy = DrivePolicy::new(drive);
    /// policy.step(&Readings::new(BodyTwist::ZERO, &[5.0; 4]), &mut [0.0; 4]); // rolling with 0.5 m/s, commanded to rest
    /// assert_eq!(policy.sample().map(|sample| sample.wheels.applied.n_m), Some([-1.25; 4]));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn sample(&self) -> Option<&DriveSample<R, N>> {
        self.sample.as_ref()
    }

    /// Its state.
    #[must_use]
    pub fn state(&self) -> &DriveState<R, N> {
        &self.state
    }

    /// Is the emergency stop pressed in the steps from now on: [`DriveInput::emergency`].
    ///
    /// ```
    /// use omni_core::drive::DrivePolicy;
    /// use omni_core::{BodyTwist, Policy, Readings};
    /// let mut policy = DrivePolicy::new(omni_core::examples::drive()?);
    /// policy.set_emergency(true);
    /// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut [0.0; 4]);
    /// assert_eq!(policy.sample().map(|sample| sample.shaped.twist.vx_m_s), Some(0.0));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn set_emergency(&mut self, pressed: bool) {
        self.emergency = pressed;
    }

    /// Its state, to set a pose or to release a safe stop.
    ///
    /// ```
    /// use omni_core::drive::DrivePolicy;
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::{BodyTwist, Policy, Readings};
    /// let mut policy = DrivePolicy::new(omni_core::examples::drive()?);
    /// policy.state_mut().odometry.reset(&PlanarPose { x_m: 2.0, ..PlanarPose::origin() });
    /// policy.step(&Readings::new(BodyTwist::ZERO, &[0.0; 4]), &mut [0.0; 4]);
    /// assert_eq!(policy.sample().map(|sample| sample.pose.x_m), Some(2.0));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn state_mut(&mut self) -> &mut DriveState<R, N> {
        &mut self.state
    }
}

impl<R: Real, const N: usize> Policy<R> for DrivePolicy<R, N> {
    fn reset(&mut self) {
        let emergency = self.emergency; // the button is still pressed
        *self = Self {
            emergency,
            ..Self::new(self.drive)
        };
    }

    fn step(&mut self, readings: &Readings<'_, R>, torques_n_m: &mut [R]) {
        let mut input = DriveInput::received(&WheelVelocities::received(readings.wheels_rad_s));
        input.command = readings.new_command.then_some(readings.command);
        input.emergency = self.emergency;
        let sample = self.drive.step(&mut self.state, &input);
        for (torque, applied) in torques_n_m.iter_mut().zip(sample.wheels.applied.n_m) {
            *torque = applied;
        }
        self.sample = Some(sample);
    }
}
