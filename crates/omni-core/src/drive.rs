//! Everything around the loops in one step: what a vehicle's firmware calls every period.

#[cfg(test)]
mod tests;

use crate::constants::constant_struct;
use crate::error::{ConfigError, finite};
use crate::wheel_loops::LoopInputs;
use crate::{
    BodyTwist, CommandShaper, ControlState, Controller, CovarianceGrowth, Desaturated, Expectation, Fault,
    FaultConfig, FaultMonitor, FaultState, ForwardMap, Kinematics, Odometry, OdometryNoise, OdometryState,
    PathFactors, PlanarPose, PoseCovariance, Real, ShapedCommand, ShaperState, ShapingConfig, SlipConfig,
    SlipDetector, SlipSample, SlipState, SpeedLimits, TorqueRanges, WheelControlConfig, WheelLayout,
    WheelSample, WheelVelocities,
};

/// Everything a [`Drive`] is made of; checked by [`Drive::new`]. Its period is that of `control.pid`.
///
/// ```
/// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let layout = WheelLayout::mecanum4(0.6, 0.4, 0.1)?;
/// // Commands are meant for a tool half a metre ahead. To turn about it the vehicle has to move to the right.
/// let drive = Drive::new(DriveConfig { command_point_m: [0.5, 0.0], ..DriveConfig::new(layout, config) })?;
/// let input = DriveInput::measured(&WheelVelocities::zero());
/// let turn_left = BodyTwist { wz_rad_s: 0.2, ..BodyTwist::ZERO };
/// let sample = drive.step(&mut DriveState::new(&drive), &input.with_command(turn_left));
/// assert!((sample.desaturated.twist.vy_m_s + 0.5 * 0.2).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveConfig<R, const N: usize> {
    /// The wheels.
    pub layout: WheelLayout<R, N>,
    /// How the vehicle's motion is told from the wheels while all are trusted.
    pub forward: ForwardMap,
    /// The wheels' loops. Its period is the drive's.
    pub control: WheelControlConfig<R, N>,
    /// Limits, time-out and emergency stop of the command.
    pub shaping: ShapingConfig<R>,
    /// Point of the body \[m\] that moves as commanded, `[x, y]`, finite; `[0, 0]` is the origin.
    pub command_point_m: [R; 2],
    /// Take the rotation within a period into account ([`BodyTwist::discretize`]).
    pub discretize: bool,
    /// Periods that too few wheels may tell the motion before the vehicle is stopped; until then it is controlled on. 10 are
    /// usual.
    pub blind_periods: u16,
    /// Speed limits of the actuators, if they have any.
    pub speed_limits: Option<SpeedLimits<R, N>>,
    /// When a wheel counts as slipping; none: wheels are never left out for it.
    pub slip: Option<SlipConfig<R>>,
    /// When a reading is not believed; none: only one that is missing or not a number.
    pub faults: Option<FaultConfig<R>>,
    /// Noise of the wheels for the covariance of the pose; none: it stays zero.
    pub noise: Option<OdometryNoise<R>>,
}

impl<R: Real, const N: usize> DriveConfig<R, N> {
    /// Layout and loops, and nothing else: no limits, no time-out, no detection.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// let input = DriveInput::measured(&WheelVelocities::zero());
    /// let fast = BodyTwist { vx_m_s: 3.0, ..BodyTwist::ZERO };
    /// let sample = drive.step(&mut DriveState::new(&drive), &input.with_command(fast));
    /// assert_eq!(sample.desaturated.twist.vx_m_s, 3.0); // within a millisecond: nothing limits it
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn new(layout: WheelLayout<R, N>, control: WheelControlConfig<R, N>) -> Self {
        Self {
            layout,
            forward: ForwardMap::LeastSquares,
            control,
            shaping: ShapingConfig::none(),
            command_point_m: [R::zero(); 2],
            discretize: false,
            blind_periods: 10,
            speed_limits: None,
            slip: None,
            faults: None,
            noise: None,
        }
    }
}

/// What arrived in one period.
///
/// ```
/// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveState, TorqueRange, WheelLayout, WheelVelocities};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
/// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
/// let mut input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
/// input.torque_ranges.set(3, &TorqueRange { lower_n_m: -0.25, upper_n_m: 0.25 }); // the fourth motor is hot
/// let sample = drive.step(&mut DriveState::new(&drive), &input);
/// assert!((sample.wheels.applied.n_m[0] - 0.3 * 0.5 / 0.1).abs() < 1e-12);
/// assert_eq!(sample.wheels.applied.n_m[3], 0.25);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveInput<R, const N: usize> {
    /// A new command, if one arrived: the twist of the command point.
    pub command: Option<BodyTwist<R>>,
    /// Actuator velocity of each wheel \[rad/s\], none where no reading arrived.
    pub readings_rad_s: [Option<R>; N],
    /// Wheels known to be off the ground: they go on turning, but tell nothing.
    pub lifted: [bool; N],
    /// Path of each wheel over path of the body beneath it: 1 on flat ground.
    pub path: PathFactors<R, N>,
    /// Torque ranges that hold besides the motors' own limits: a hot motor, a low battery.
    pub torque_ranges: TorqueRanges<R, N>,
}

impl<R: Real, const N: usize> DriveInput<R, N> {
    /// All readings there \[rad/s\], no new command, every wheel on flat ground, no torque limits but the motors' own.
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
            lifted: [false; N],
            path: PathFactors::default(),
            torque_ranges: TorqueRanges::unlimited(),
        }
    }

    /// The same with a new command: the twist of the command point \[m/s, m/s, rad/s\], checked by [`Drive::step`].
    ///
    /// ```
    /// use omni_core::{BodyTwist, DriveInput, WheelVelocities};
    /// let left = BodyTwist { vy_m_s: 0.2, ..BodyTwist::ZERO };
    /// let input = DriveInput::measured(&WheelVelocities::<f64, 4>::zero()).with_command(left);
    /// assert_eq!(input.command.map(|command| command.vy_m_s), Some(0.2));
    /// ```
    #[must_use]
    pub fn with_command(self, command: BodyTwist<R>) -> Self {
        Self {
            command: Some(command),
            ..self
        }
    }
}

/// How far the vehicle can be relied on.
///
/// ```
/// use omni_core::{Drive, DriveConfig, DriveInput, DriveMode, DriveState, WheelLayout, WheelVelocities};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let plain = DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config);
/// let drive = Drive::new(DriveConfig { blind_periods: 0, ..plain })?; // no patience
/// let mut state = DriveState::new(&drive);
/// let mut input = DriveInput::measured(&WheelVelocities { rad_s: [1.0; 4] });
/// for (heard, mode) in [(4, DriveMode::Normal), (3, DriveMode::Degraded), (2, DriveMode::SafeStop)] {
///     for (index, reading) in input.readings_rad_s.iter_mut().enumerate() {
///         *reading = (index < heard).then_some(1.0);
///     }
///     let sample = drive.step(&mut state, &input);
///     assert_eq!(sample.mode, mode); // two wheels do not tell three motions
///     assert_eq!(sample.wheels.applied.n_m[0], -0.3); // kp times 1 rad/s: wheels that are heard brake
/// }
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DriveMode {
    /// Every wheel drives and is believed.
    Normal,
    /// A wheel is let go, lifted or left out; the others move the vehicle as commanded.
    Degraded,
    /// Too few wheels are left to tell how the vehicle moves: those that are left are brought to rest, at the emergency
    /// deceleration. Latched until [`DriveState::release_safe_stop`].
    SafeStop,
    /// Somebody asked for it with [`DriveState::emergency_stop`]; latched until [`DriveState::release_emergency_stop`].
    EmergencyStop,
}

/// Every signal of one step of a [`Drive`]. Nothing in it is ever NaN.
///
/// ```
/// use omni_core::{Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
/// let mut state = DriveState::new(&drive);
/// // Nobody commands, but the vehicle rolls: 5 rad/s of wheels of 0.1 m, for a millisecond.
/// let sample = drive.step(&mut state, &DriveInput::measured(&WheelVelocities { rad_s: [5.0; 4] }));
/// assert!((sample.slip.estimated.vx_m_s - 0.5).abs() < 1e-12);
/// assert!((sample.pose.x_m - 0.5e-3).abs() < 1e-12);
/// assert_eq!(sample.shaped.twist.vx_m_s, 0.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveSample<R, const N: usize> {
    /// How far the vehicle can be relied on.
    pub mode: DriveMode,
    /// What is wrong with each wheel.
    pub faults: [Option<Fault>; N],
    /// The command as shaped, still of the command point.
    pub shaped: ShapedCommand<R>,
    /// The twist of the origin that the wheels can follow, and their velocities on flat ground.
    pub desaturated: Desaturated<R, N>,
    /// The loops.
    pub wheels: WheelSample<R, N>,
    /// Enough wheels tell the motion: `slip` means something, and the pose was carried on.
    pub motion_known: bool,
    /// What the wheels say of the motion and of each other.
    pub slip: SlipSample<R, N>,
    /// Where the vehicle is by what its wheels say.
    pub pose: PlanarPose<R>,
}

/// A vehicle's whole controller: readings and commands in, torques out. Immutable; what changes is in [`DriveState`].
///
/// In order: readings are judged, faulty wheels let go, the motion estimated from the rest; the command is checked,
/// limited, moved to the origin and brought within what the wheels can turn; the loops run; the pose is carried on.
///
/// ```
/// use omni_core::{BodyTwist, Coordination, Drive, DriveConfig, DriveInput, DriveMode, DriveState, PidConfig, PidGains};
/// use omni_core::{TorqueLimit, WheelControlConfig, WheelLayout, WheelVelocities};
/// let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
/// let control = WheelControlConfig {
///     pid: PidConfig::new(gains, 1e-3),
///     limits: [TorqueLimit::constant(2.0)?; 7],
///     coordination: Coordination::synchronised(),
/// };
/// let drive = Drive::new(DriveConfig::new(WheelLayout::chugo7(0.30, 0.23, 0.066)?, control))?;
/// let mut state = DriveState::new(&drive);
/// let forward = BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 };
/// let mut input = DriveInput::measured(&WheelVelocities::zero()).with_command(forward);
/// input.readings_rad_s[4] = None; // wheel 5 is not heard from
/// let sample = drive.step(&mut state, &input);
/// assert_eq!((sample.mode, sample.wheels.applied.n_m[4]), (DriveMode::Degraded, 0.0));
/// assert!((sample.wheels.applied.n_m[0] - (0.3 + 0.002) * 0.3 / 0.066).abs() < 1e-12); // the others drive on
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Drive<R, const N: usize> {
    controller: Controller<R, N>,
    shaper: CommandShaper<R>,
    command_point_m: [R; 2],
    discretize: bool,
    blind_periods: u16,
    speed_limits: Option<SpeedLimits<R, N>>,
    slip: SlipDetector<R>,
    faults: FaultMonitor<R>,
    odometry: Odometry<R, N>,
    growth: Option<CovarianceGrowth<R>>,
    period_s: R,
}

constant_struct!(Drive<R, const N> {
    controller: Controller<R, N>,
    shaper: CommandShaper<R>,
    command_point_m: [R; 2],
    discretize: bool,
    blind_periods: u16,
    speed_limits: Option<SpeedLimits<R, N>>,
    slip: SlipDetector<R>,
    faults: FaultMonitor<R>,
    odometry: Odometry<R, N>,
    growth: Option<CovarianceGrowth<R>>,
    period_s: R,
});

/// What a [`Drive`] remembers.
///
/// ```
/// use omni_core::{Drive, DriveConfig, DriveInput, DriveState, PlanarPose, WheelLayout, WheelVelocities};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
/// let mut state = DriveState::new(&drive);
/// // Somebody has seen where it is: at x = 2 m.
/// state.odometry.reset(&PlanarPose { x_m: 2.0, ..PlanarPose::origin() });
/// let sample = drive.step(&mut state, &DriveInput::measured(&WheelVelocities { rad_s: [5.0; 4] }));
/// assert!((sample.pose.x_m - (2.0 + 0.1 * 5.0 * 1e-3)).abs() < 1e-12); // from there on
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveState<R, const N: usize> {
    /// The loops.
    pub control: ControlState<R, N>,
    shaper: ShaperState<R>,
    /// The readings' history.
    pub faults: FaultState<R, N>,
    /// Where the vehicle is.
    pub odometry: OdometryState<R, N>,
    /// How sure that is.
    pub covariance: PoseCovariance<R>,
    slip: SlipState<R, N>,
    /// A safe stop, an emergency stop is latched.
    stopping: bool,
    emergency: bool,
    /// Periods in a row in which too few wheels told the motion.
    blind: u16,
    /// What the wheels should have measured by what the others said, and which of these are worth something.
    by_others: WheelVelocities<R, N>,
    checked: [bool; N],
    reference: WheelVelocities<R, N>,
    torque_n_m: [R; N],
}

impl<R: Real, const N: usize> DriveState<R, N> {
    /// A fresh start: at rest at the world's origin, every wheel trusted.
    ///
    /// ```
    /// use omni_core::{Drive, DriveConfig, DriveState, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// let state = DriveState::new(&drive);
    /// assert_eq!((state.odometry.pose().x_m, state.control.integral_n_m), (0.0, [0.0; 4]));
    /// assert_eq!(state.covariance.standard_deviations(), [0.0; 3]); // it knows where it starts
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
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
            emergency: false,
            blind: 0,
            by_others: WheelVelocities::zero(),
            checked: [false; N],
            reference: WheelVelocities::zero(),
            torque_n_m: [R::zero(); N],
        }
    }

    /// Brings the vehicle to rest at the emergency deceleration from the next step on, whatever is commanded.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// let mut state = DriveState::new(&drive);
    /// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// let input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
    /// state.emergency_stop();
    /// assert_eq!(drive.step(&mut state, &input).shaped.twist.vx_m_s, 0.0);
    /// state.release_emergency_stop();
    /// assert_eq!(drive.step(&mut state, &input).shaped.twist.vx_m_s, 0.5);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn emergency_stop(&mut self) {
        self.emergency = true;
    }

    /// Ends an emergency stop; a safe stop stays. Commands that arrive from now on are followed.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// let mut state = DriveState::new(&drive);
    /// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// let input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
    /// state.emergency_stop();
    /// assert_eq!(drive.step(&mut state, &input).shaped.twist.vx_m_s, 0.0);
    /// state.release_emergency_stop();
    /// assert_eq!(drive.step(&mut state, &input).shaped.twist.vx_m_s, 0.5);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn release_emergency_stop(&mut self) {
        self.emergency = false;
    }

    /// Ends a safe stop; an emergency stop stays. Every reading is judged afresh, and commands that arrive from now on are
    /// followed. A safe stop whose cause lasts begins anew.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveState, WheelLayout, WheelVelocities};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// let mut state = DriveState::new(&drive);
    /// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// let input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
    /// state.emergency_stop();
    /// assert_eq!(drive.step(&mut state, &input).shaped.twist.vx_m_s, 0.0);
    /// state.release_safe_stop(); // not what stops it
    /// assert_eq!(drive.step(&mut state, &input).shaped.twist.vx_m_s, 0.0);
    /// state.release_emergency_stop();
    /// assert_eq!(drive.step(&mut state, &input).shaped.twist.vx_m_s, 0.5);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn release_safe_stop(&mut self) {
        (self.stopping, self.blind) = (false, 0);
        self.faults.clear();
    }
}

impl<R: Real, const N: usize> Drive<R, N> {
    /// A drive as configured.
    ///
    /// # Errors
    /// Those of the parts, with the parameter out of range: [`Controller::with_forward`], [`CommandShaper::new`],
    /// [`SlipDetector::new`], [`FaultMonitor::new`], [`CovarianceGrowth::new`]; `command_point_m` where it is not
    /// finite.
    ///
    /// ```
    /// use omni_core::{Drive, DriveConfig, ShapingConfig, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let plain = DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config);
    /// let shaping = ShapingConfig { timeout_s: Some(-0.5), ..ShapingConfig::none() };
    /// let error = Drive::new(DriveConfig { shaping, ..plain }).unwrap_err();
    /// assert_eq!((error.parameter, error.value), ("timeout_s", -0.5));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn new(config: DriveConfig<R, N>) -> Result<Self, ConfigError> {
        let period_s = config.control.pid.period_s;
        for p in config.command_point_m {
            finite("command_point_m", p)?;
        }
        Ok(Self {
            controller: Controller::with_forward(&config.layout, config.control, config.forward)?,
            shaper: CommandShaper::new(config.shaping, period_s)?,
            command_point_m: config.command_point_m,
            discretize: config.discretize,
            blind_periods: config.blind_periods,
            speed_limits: config.speed_limits,
            slip: SlipDetector::new(config.slip.unwrap_or_else(SlipConfig::never))?,
            faults: FaultMonitor::new(config.faults.unwrap_or_else(FaultConfig::unchecked))?,
            odometry: Odometry::new(period_s)?,
            growth: config.noise.map(CovarianceGrowth::new).transpose()?,
            period_s,
        })
    }

    /// The maps between twist and wheel velocities with every wheel trusted.
    ///
    /// ```
    /// use omni_core::{Drive, DriveConfig, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// assert!((drive.kinematics().inverse_matrix()[0][1] + 1.0 / 0.1).abs() < 1e-12); // -vy / r, front left
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics<R, N> {
        self.controller.kinematics()
    }

    /// One period: torques that move the vehicle as commanded, as far as command, limits and wheels allow. To be called
    /// once every control period. O(N).
    ///
    /// Never fails: nonsense in the input is refused or lets the wheel go that it came from.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveMode, DriveState, WheelLayout, WheelVelocities};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.0625, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// // 5 rad/s of wheels of 0.1 m; the fourth is in the air and spins with 21 rad/s.
    /// let mut input = DriveInput::measured(&WheelVelocities { rad_s: [5.0, 5.0, 5.0, 21.0] });
    /// input.lifted[3] = true;
    /// let sample = drive.step(&mut DriveState::new(&drive), &input);
    /// assert!((sample.slip.estimated.vx_m_s - 0.5).abs() < 1e-12); // it has no say
    /// assert_eq!(sample.wheels.applied.n_m[3], -0.0625 * 21.0); // but it is braked as the others are
    /// assert_eq!(sample.mode, DriveMode::Degraded);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut DriveState<R, N>, input: &DriveInput<R, N>) -> DriveSample<R, N> {
        let expected = Expectation {
            by_others: &state.by_others,
            checked: &state.checked,
            reference: &state.reference,
            torque_n_m: &state.torque_n_m,
        };
        let measured = self
            .faults
            .step(&mut state.faults, &input.readings_rad_s, &expected);
        let dropped = state.faults.usable().map(|usable| !usable);
        let kinematics = self.controller.kinematics();

        // What the remaining wheels say of the motion.
        let mut untold = dropped;
        for (untold, &lifted) in untold.iter_mut().zip(&input.lifted) {
            *untold |= lifted;
        }
        let enough = state.slip.declare(kinematics, &untold);
        let beneath = input.path.of_body(&measured);
        let slip = if enough {
            self.slip.step(kinematics, &mut state.slip, &beneath)
        } else {
            // What too few wheels say is no motion.
            SlipSample::unknown(untold)
        };
        // Lifted wheels still hold the vehicle on its course when they come down: no reason to stop.
        let blind = !enough && dropped.contains(&true) && kinematics.excluding(&dropped).is_none();
        state.blind = if blind { state.blind.saturating_add(1) } else { 0 };
        state.stopping |= state.blind > self.blind_periods;
        if state.stopping || state.emergency {
            state.shaper.emergency_stop();
        } else {
            state.shaper.release();
        }

        // What the wheels shall do.
        let shaped = self.shaper.step(&mut state.shaper, input.command.as_ref());
        let twist = if self.discretize {
            shaped.twist.discretize(self.period_s)
        } else {
            shaped.twist
        };
        let desaturated = match &self.speed_limits {
            Some(limits) => {
                limits.desaturate_at(kinematics, &twist, self.command_point_m, &input.path, &dropped)
            }
            None => {
                let twist = BodyTwist::from_point(twist, self.command_point_m);
                Desaturated::whole(twist, kinematics.inverse(&twist))
            }
        };
        let reference = input.path.of_wheels(&desaturated.velocities);
        let inputs = LoopInputs {
            reference: &reference,
            measured: &measured,
            dropped: Some(&dropped),
            within: Some(&input.torque_ranges),
        };
        let observed = *state.slip.observed();
        let wheels = self
            .controller
            .run(&mut state.control, &inputs, &observed, &input.path);

        if enough {
            self.carry_on(state, &observed, &slip, &beneath);
        }
        self.remember(state, &measured, &slip, &wheels, input);
        let mode = if state.emergency {
            DriveMode::EmergencyStop
        } else if state.stopping {
            DriveMode::SafeStop
        } else if slip.excluded.contains(&true) || wheels.active.contains(&false) {
            DriveMode::Degraded
        } else {
            DriveMode::Normal
        };
        DriveSample {
            mode,
            faults: state.faults.faults(),
            shaped,
            desaturated,
            wheels,
            motion_known: enough,
            slip,
            pose: state.odometry.pose(),
        }
    }

    /// Odometry and its covariance.
    fn carry_on(
        &self,
        state: &mut DriveState<R, N>,
        observed: &Kinematics<R, N>,
        slip: &SlipSample<R, N>,
        beneath: &WheelVelocities<R, N>,
    ) {
        let start = state.odometry.pose();
        self.odometry
            .step_displacement(&mut state.odometry, &slip.estimated.over(self.period_s));
        if let Some(growth) = &self.growth {
            let increments = beneath.over(self.period_s);
            let residuals = slip.residual.over(self.period_s);
            growth.step_by(
                &mut state.covariance,
                &start,
                observed.forward_matrix(),
                &increments,
                &residuals,
            );
        }
    }

    /// What the next period's readings will be compared with.
    fn remember(
        &self,
        state: &mut DriveState<R, N>,
        measured: &WheelVelocities<R, N>,
        slip: &SlipSample<R, N>,
        wheels: &WheelSample<R, N>,
        input: &DriveInput<R, N>,
    ) {
        let slips = input.path.of_wheels(&WheelVelocities {
            rad_s: slip.slip_rad_s,
        });
        for i in 0..N {
            state.by_others.rad_s[i] = measured.rad_s[i] - slips.rad_s[i];
        }
        state.checked = slip.checked;
        for (checked, &lifted) in state.checked.iter_mut().zip(&input.lifted) {
            // What the ground does says nothing of a wheel in the air.
            *checked &= !lifted;
        }
        state.reference = wheels.reference;
        state.torque_n_m = wheels.applied.n_m;
    }
}
