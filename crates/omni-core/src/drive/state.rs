//! The state of a drive.

use super::model::Drive;
use crate::Real;
use crate::drive::{FaultState, SlipState};
use crate::estimate::{OdometryState, PoseCovariance};
use crate::geometry::WheelVelocities;
use crate::loops::ControlState;
use crate::shaping::ShaperState;

/// The state of a [`Drive`].
///
/// ```
/// use omni_core::geometry::PlanarPose;
/// use omni_core::{Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
/// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
/// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
/// let mut state = DriveState::new(&drive);
/// // Its pose is known from outside: x = 2 m.
/// state.odometry.reset(&PlanarPose { x_m: 2.0, ..PlanarPose::origin() });
/// let sample = drive.step(&mut state, &DriveInput::measured(&WheelVelocities { rad_s: [5.0; 4] }));
/// assert!((sample.pose.x_m - (2.0 + 0.1 * 5.0 * 1e-3)).abs() < 1e-12); // from there on
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DriveState<R, const N: usize> {
    /// The loops.
    pub control: ControlState<R, N>,
    pub(super) shaper: ShaperState<R>,
    /// The readings' history.
    pub faults: FaultState<R, N>,
    /// Pose of the vehicle.
    pub odometry: OdometryState<R, N>,
    /// How sure that is.
    pub covariance: PoseCovariance<R>,
    pub(super) slip: SlipState<R, N>,
    /// A safe stop is latched.
    pub(super) stopping: bool,
    /// Periods in a row in which too few wheels determined the motion.
    pub(super) unobservable_periods: u16,
    /// The velocities that the other wheels imply, and which of them are significant.
    pub(super) by_others: WheelVelocities<R, N>,
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) checked: [bool; N],
    pub(super) reference: WheelVelocities<R, N>,
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) torque_n_m: [R; N],
}

impl<R: Real, const N: usize> DriveState<R, N> {
    /// A fresh start: at rest at the world's origin, every wheel trusted.
    #[must_use]
    pub fn new(drive: &Drive<R, N>) -> Self {
        Self {
            control: ControlState::default(),
            shaper: ShaperState::default(),
            faults: FaultState::default(),
            odometry: OdometryState::default(),
            covariance: PoseCovariance::default(),
            slip: SlipState::new(drive.controller.kinematics()),
            stopping: false,
            unobservable_periods: 0,
            by_others: WheelVelocities::zero(),
            checked: [false; N],
            reference: WheelVelocities::zero(),
            torque_n_m: [R::zero(); N],
        }
    }

    /// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed, as
    /// [`Restart`](crate::shaping::Restart) says. A safe stop whose cause lasts begins anew.
    ///
    /// ```
    /// use omni_core::{BodyTwist, DriveInput, DriveMode, DriveState, WheelVelocities};
    /// # let drive = omni_core::examples::drive()?;
    /// let mut state = DriveState::new(&drive);
    /// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// let input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
    /// let mut deaf = input;
    /// deaf.readings_rad_s = [None; 4];
    /// for _ in 0..100 {
    ///     drive.step(&mut state, &deaf);
    /// }
    /// let step = |state: &mut _| (drive.step(state, &input).mode, drive.step(state, &input).shaped.twist.vx_m_s);
    /// assert_eq!(step(&mut state), (DriveMode::SafeStop, 0.0)); // although they are back
    /// state.release_safe_stop();
    /// assert_eq!(step(&mut state), (DriveMode::Normal, 0.5));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn release_safe_stop(&mut self) {
        (self.stopping, self.unobservable_periods) = (false, 0);
        self.faults.clear();
    }
}
