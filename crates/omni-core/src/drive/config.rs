//! The parts of a drive, and its input in one period.

use crate::Real;
use crate::drive::{FaultConfig, SlipConfig};
use crate::estimate::OdometryNoise;
use crate::geometry::{BodyTwist, ForwardMap, PathFactors, SpeedLimits, WheelLayout, WheelVelocities};
use crate::loops::{Rest, WheelControlConfig};
use crate::motor::TorqueRanges;
use crate::shaping::ShapingConfig;

/// Everything a [`Drive`](crate::drive::Drive) is made of; checked by
/// [`Drive::new`](crate::drive::Drive::new). Its period is the period of `control.pid`.
///
/// ```
/// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
/// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
/// let mut config = DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config);
/// // Commands are meant for a tool half a metre ahead. To turn about it the vehicle has to move to the right.
/// config.command_point_m = [0.5, 0.0];
/// let drive = Drive::new(config)?;
/// let input = DriveInput::measured(&WheelVelocities::zero());
/// let turn_left = BodyTwist { wz_rad_s: 0.2, ..BodyTwist::ZERO };
/// let sample = drive.step(&mut DriveState::new(&drive), &input.with_command(turn_left));
/// assert!((sample.desaturated.twist.vy_m_s + 0.5 * 0.2).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct DriveConfig<R, const N: usize> {
    /// The wheels.
    pub layout: WheelLayout<R, N>,
    /// Method that estimates the vehicle's motion from the wheels while all are trusted.
    pub forward: ForwardMap,
    /// The wheels' loops. Its period is the drive's.
    pub control: WheelControlConfig<R, N>,
    /// Behaviour of the loops once the command is rest, and in every stop: time-out, emergency stop, safe stop.
    pub rest: Rest<R>,
    /// Limits, time-out and emergency stop of the command.
    pub shaping: ShapingConfig<R>,
    /// Point of the body \[m\] that moves as commanded, `[x, y]`, each within +-1000 m; `[0, 0]` is the origin.
    pub command_point_m: [R; 2],
    /// Take the rotation within a period into account ([`BodyTwist::discretize`]).
    pub discretize: bool,
    /// Periods in which too few wheels may determine the motion before the vehicle is stopped;
    /// until then it is controlled on. 10 are usual.
    pub unobservable_periods: u16,
    /// Speed limits of the actuators, if they have any.
    pub speed_limits: Option<SpeedLimits<R, N>>,
    /// When a wheel counts as slipping; none: wheels are never left out for it.
    pub slip: Option<SlipConfig<R>>,
    /// When a reading is rejected; none: only one that is missing or not a number.
    pub faults: Option<FaultConfig<R>>,
    /// Noise of the wheels for the covariance of the pose; none: it stays zero.
    pub noise: Option<OdometryNoise<R>>,
}

impl<R: Real, const N: usize> DriveConfig<R, N> {
    /// Layout and loops, and nothing else: no limits, no time-out, no detection.
    #[must_use]
    pub fn new(layout: WheelLayout<R, N>, control: WheelControlConfig<R, N>) -> Self {
        Self {
            layout,
            forward: ForwardMap::LeastSquares,
            control,
            rest: Rest::default(),
            shaping: ShapingConfig::none(),
            command_point_m: [R::zero(); 2],
            discretize: false,
            unobservable_periods: 10,
            speed_limits: None,
            slip: None,
            faults: None,
            noise: None,
        }
    }
}

/// The input of one period.
///
/// ```
/// use omni_core::motor::TorqueRange;
/// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveMode, DriveState, WheelLayout, WheelVelocities};
/// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
/// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
/// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
/// let mut input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
/// input.torque_ranges.set(3, &TorqueRange { lower_n_m: -0.25, upper_n_m: 0.25 }); // the fourth motor is hot
/// let sample = drive.step(&mut DriveState::new(&drive), &input);
/// assert!((sample.wheels.applied.n_m[0] - 0.3 * 0.5 / 0.1).abs() < 1e-12);
/// assert_eq!(sample.wheels.applied.n_m[3], 0.25);
/// input.emergency = true; // the red button
/// let sample = drive.step(&mut DriveState::new(&drive), &input);
/// assert_eq!((sample.mode, sample.shaped.twist.vx_m_s), (DriveMode::EmergencyStop, 0.0));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct DriveInput<R, const N: usize> {
    /// A new command, if one arrived: the twist of the command point.
    pub command: Option<BodyTwist<R>>,
    /// Actuator velocity of each wheel \[rad/s\], none if no reading arrived.
    pub readings_rad_s: [Option<R>; N],
    /// The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration,
    /// whatever is commanded, and stays there for as long as this is said. A level: it is to be
    /// true in every step of the stop. A momentary button has to be latched by the caller.
    pub emergency: bool,
    /// Wheels known to be off the ground: they go on turning, but do not count for the motion.
    pub lifted: [bool; N],
    /// Path of each wheel over path of the body beneath it: 1 on flat ground.
    pub path: PathFactors<R, N>,
    /// Torque ranges that hold besides the motors' own limits: a hot motor, a low battery.
    pub torque_ranges: TorqueRanges<R, N>,
}

impl<R: Real, const N: usize> DriveInput<R, N> {
    /// All readings there \[rad/s\], no new command, no emergency stop, every wheel on flat ground,
    /// no torque limits but the motors' own.
    ///
    /// ```
    /// use omni_core::{DriveInput, WheelVelocities};
    /// let input = DriveInput::measured(&WheelVelocities { rad_s: [3.0, 0.0, -3.0] });
    /// assert_eq!(input.readings_rad_s, [Some(3.0), Some(0.0), Some(-3.0)]);
    /// assert_eq!((input.command, input.lifted), (None, [false; 3]));
    /// ```
    #[must_use]
    pub fn measured(velocities: &WheelVelocities<R, N>) -> Self {
        Self {
            command: None,
            readings_rad_s: velocities.rad_s.map(Some),
            emergency: false,
            lifted: [false; N],
            path: PathFactors::default(),
            torque_ranges: TorqueRanges::unlimited(),
        }
    }

    /// [`DriveInput::measured`], but a reading of NaN did not arrive, as in a link, a log and
    /// [`Readings`](crate::policy::Readings). Other invalid velocities, such as infinity, are left to the monitor.
    ///
    /// ```
    /// use omni_core::{DriveInput, WheelVelocities};
    /// let input = DriveInput::received(&WheelVelocities { rad_s: [3.0, f64::NAN, -3.0] });
    /// assert_eq!(input.readings_rad_s, [Some(3.0), None, Some(-3.0)]);
    /// ```
    #[must_use]
    #[expect(
        clippy::eq_op,
        reason = "what is not a number is not equal to itself, in any scalar"
    )]
    pub fn received(velocities: &WheelVelocities<R, N>) -> Self {
        Self {
            readings_rad_s: velocities
                .rad_s
                .map(|velocity| (velocity == velocity).then_some(velocity)),
            ..Self::measured(velocities)
        }
    }

    /// The same with a new command: the twist of the command point \[m/s, m/s, rad/s\], checked by
    /// [`Drive::step`](crate::drive::Drive::step).
    #[must_use]
    pub fn with_command(self, command: BodyTwist<R>) -> Self {
        Self {
            command: Some(command),
            ..self
        }
    }
}
