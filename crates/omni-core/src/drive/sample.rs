//! Result of one step of a drive.

use crate::Real;
use crate::drive::{Fault, SlipSample};
use crate::geometry::{BodyTwist, Desaturated, PlanarPose, WheelVelocities};
use crate::loops::WheelSample;
use crate::shaping::{CommandStatus, ShapedCommand};

/// How far the vehicle can be relied on.
///
/// ```
/// use omni_core::{Drive, DriveConfig, DriveInput, DriveMode, DriveState, WheelLayout, WheelVelocities};
/// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
/// let mut config = DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config);
/// config.unobservable_periods = 0; // stops at once
/// let drive = Drive::new(config)?;
/// let mut state = DriveState::new(&drive);
/// let mut input = DriveInput::measured(&WheelVelocities { rad_s: [1.0; 4] });
/// for (valid, mode) in [(4, DriveMode::Normal), (3, DriveMode::Degraded), (2, DriveMode::SafeStop)] {
///     for (index, reading) in input.readings_rad_s.iter_mut().enumerate() {
///         *reading = (index < valid).then_some(1.0);
///     }
///     let sample = drive.step(&mut state, &input);
///     assert_eq!(sample.mode, mode); // two wheels do not determine three motions
///     assert_eq!(sample.wheels.applied.n_m[0], -0.3); // kp times 1 rad/s: wheels with a reading brake
/// }
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum DriveMode {
    /// Every wheel drives, and its readings are accepted.
    Normal = 0,
    /// A wheel is released, lifted or excluded; the others move the vehicle as commanded.
    Degraded = 1,
    /// Too few wheels are left to determine how the vehicle moves: those that are left are brought
    /// to rest, at the emergency deceleration. Latched until
    /// [`DriveState::release_safe_stop`](crate::drive::DriveState::release_safe_stop).
    SafeStop = 2,
    /// Requested: for as long as [`DriveInput::emergency`](crate::drive::DriveInput::emergency) says so.
    EmergencyStop = 3,
}

impl DriveMode {
    /// The number that stands for it in frames, in C and in tables: 0 to 3 in the order above. It never changes.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }
}

/// Every signal of one step of a [`Drive`](crate::drive::Drive). Nothing in it is ever NaN.
///
/// ```
/// use omni_core::{Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
/// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
/// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
/// let mut state = DriveState::new(&drive);
/// // No command arrives, but the vehicle rolls: 5 rad/s of wheels of 0.1 m, for a millisecond.
/// let sample = drive.step(&mut state, &DriveInput::measured(&WheelVelocities { rad_s: [5.0; 4] }));
/// assert!((sample.slip.estimated.vx_m_s - 0.5).abs() < 1e-12);
/// assert!((sample.pose.x_m - 0.5e-3).abs() < 1e-12);
/// assert_eq!(sample.shaped.twist.vx_m_s, 0.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct DriveSample<R, const N: usize> {
    /// How far the vehicle can be relied on.
    pub mode: DriveMode,
    /// The fault of each wheel.
    pub faults: [Option<Fault>; N],
    /// The command as shaped, still of the command point.
    pub shaped: ShapedCommand<R>,
    /// The twist of the origin that the wheels can follow, and their velocities on flat ground.
    pub desaturated: Desaturated<R, N>,
    /// The loops.
    pub wheels: WheelSample<R, N>,
    /// Motors whose windings shall be shorted. In a safe stop and an emergency stop: the motors of faulty wheels,
    /// because no torque can be controlled without a reading and a vehicle of three wheels would coast; and all motors
    /// when the torque has ended. Otherwise at rest: all motors when the torque has ended, if
    /// [`Rest::short_windings`](crate::loops::Rest::short_windings) requests it.
    pub brake: [bool; N],
    /// Enough wheels determine the motion: `slip` means something, and the pose was integrated.
    pub motion_known: bool,
    /// The motion by the wheels, and their disagreement.
    pub slip: SlipSample<R, N>,
    /// Pose by odometry.
    pub pose: PlanarPose<R>,
}

impl<R: Real, const N: usize> DriveSample<R, N> {
    /// At rest at the origin, to be written to by [`Drive::step_into`](crate::drive::Drive::step_into).
    #[must_use]
    pub fn zero() -> Self {
        Self {
            mode: DriveMode::Normal,
            faults: [None; N],
            shaped: ShapedCommand {
                twist: BodyTwist::ZERO,
                status: CommandStatus::Idle,
                rejected: false,
            },
            desaturated: Desaturated::whole(BodyTwist::ZERO, WheelVelocities::zero()),
            wheels: WheelSample::zero(),
            brake: [false; N],
            motion_known: false,
            slip: SlipSample::unknown([false; N]),
            pose: PlanarPose::origin(),
        }
    }
}
