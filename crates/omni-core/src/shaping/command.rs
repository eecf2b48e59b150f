//! Shaping of a command: a check, a time-out and an emergency stop around the limits.

use crate::constants::constant_struct;
use crate::error::{not_negative, period};
use crate::geometry::BodyTwist;
use crate::shaping::limits::limit;
use crate::shaping::twist_limits::Vector;
use crate::shaping::{AxisLimits, TwistLimiter, TwistLimiterState, TwistLimits};
use crate::{ConfigError, Real};

/// Deceleration of an emergency stop. Linear and yaw motion stop independently, so that neither waits for the other.
/// Checked by [`CommandShaper::new`].
///
/// ```
/// use omni_core::shaping::{CommandShaper, EmergencyDeceleration, ShaperState, ShapingConfig};
/// use omni_core::BodyTwist;
/// let brakes = EmergencyDeceleration { linear_m_s2: 2.0, yaw_rad_s2: 8.0 };
/// let mut config = ShapingConfig::none();
/// config.emergency_deceleration = Some(brakes);
/// let shaper = CommandShaper::new(config, 0.125)?;
/// let mut state = ShaperState::at(&BodyTwist { vx_m_s: 0.75, vy_m_s: 1.0, wz_rad_s: 1.0 });
/// state.emergency_stop();
/// // 1.25 m/s less 2.0 * 0.125 in the same direction: four fifths. The yaw rate is gone at once.
/// let braked = shaper.step(&mut state, None).twist;
/// assert!((braked.vx_m_s - 0.6_f64).abs() < 1e-12 && (braked.vy_m_s - 0.8).abs() < 1e-12 && braked.wz_rad_s == 0.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EmergencyDeceleration<R> {
    /// Loss of speed along the direction of (vx, vy) \[m/s^2\], > 0; infinity means at once.
    pub linear_m_s2: R,
    /// Loss of yaw rate \[rad/s^2\], > 0; infinity means at once.
    pub yaw_rad_s2: R,
}

/// Condition for motion after an automatic stop: after an emergency stop, a safe stop or a time-out, and after the
/// start.
///
/// ```
/// use omni_core::shaping::{CommandShaper, CommandStatus, Restart, ShaperState, ShapingConfig};
/// use omni_core::BodyTwist;
/// let mut config = ShapingConfig::none();
/// config.restart = Restart::Neutral;
/// let (shaper, mut state) = (CommandShaper::new(config, 0.01)?, ShaperState::default());
/// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
/// let step = |state: &mut _, command: BodyTwist<f64>| shaper.step(state, Some(&command)).twist.vx_m_s;
/// assert_eq!([ahead, BodyTwist::ZERO, ahead].map(|command| step(&mut state, command)), [0.0, 0.0, 0.5]);
/// state.emergency_stop();
/// assert_eq!(step(&mut state, ahead), 0.0);
/// state.release();
/// assert_eq!([ahead, ahead, BodyTwist::ZERO, ahead].map(|command| step(&mut state, command)), [0.0, 0.0, 0.0, 0.5]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Restart {
    /// With the next command.
    #[default]
    AtOnce,
    /// With the next command after one of rest, which is exactly 0 in every component: a stick that
    /// is still pushed moves nothing.
    Neutral,
}

/// Everything that a [`CommandShaper`] needs to know.
///
/// ```
/// use omni_core::shaping::{CommandShaper, CommandStatus, ShaperState, ShapingConfig};
/// use omni_core::BodyTwist;
/// // Commands hold for a tenth of a second, ten periods; after that the vehicle rests.
/// let mut config = ShapingConfig::none();
/// config.timeout_s = Some(0.1);
/// let (shaper, mut state) = (CommandShaper::new(config, 0.01)?, ShaperState::default());
/// shaper.step(&mut state, Some(&BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO }));
/// let periods = (0..100).take_while(|_| shaper.step(&mut state, None).status == CommandStatus::Following).count();
/// assert_eq!((periods, state.twist().vx_m_s), (10, 0.0));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ShapingConfig<R> {
    /// Limits of the twist that goes out.
    pub limits: TwistLimits<R>,
    /// How old a command may become \[s\], finite and >= 0; 0 uses it in one period only, `None` for ever.
    pub timeout_s: Option<R>,
    /// Deceleration of an emergency stop, and the most where no command is in force; `None` stops at once.
    pub emergency_deceleration: Option<EmergencyDeceleration<R>>,
    /// When the vehicle moves again.
    pub restart: Restart,
}

impl<R: Real> ShapingConfig<R> {
    /// Nothing in the way of a command that is a number: no limits, no time-out; an emergency stop is immediate.
    ///
    /// ```
    /// use omni_core::shaping::{CommandShaper, ShaperState, ShapingConfig};
    /// use omni_core::BodyTwist;
    /// let shaper = CommandShaper::new(ShapingConfig::none(), 1e-3)?;
    /// let mut state = ShaperState::default();
    /// shaper.step(&mut state, Some(&BodyTwist { vx_m_s: 5.0, ..BodyTwist::ZERO }));
    /// for _ in 0..10_000 {
    ///     assert_eq!(shaper.step(&mut state, None).twist.vx_m_s, 5.0); // ten seconds without another command
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn none() -> Self {
        let unlimited = AxisLimits::unlimited();
        Self {
            limits: TwistLimits::PerAxis {
                vx: unlimited,
                vy: unlimited,
                wz: unlimited,
            },
            timeout_s: None,
            emergency_deceleration: None,
            restart: Restart::AtOnce,
        }
    }
}

/// Why the twist is what it is.
///
/// ```
/// use omni_core::shaping::{
///     AxisLimits, CommandShaper, CommandStatus, ShaperState, ShapingConfig, TwistLimits,
/// };
/// use omni_core::BodyTwist;
/// let [vx, vy, wz] = [AxisLimits::symmetric(1.0, 1.0, 1.0, f64::INFINITY); 3];
/// let mut config = ShapingConfig::none();
/// config.limits = TwistLimits::PerAxis { vx, vy, wz };
/// let (shaper, mut state) = (CommandShaper::new(config, 0.25)?, ShaperState::default());
/// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
/// let mut step = |command| {
///     let shaped = shaper.step(&mut state, command);
///     (shaped.twist.vx_m_s, shaped.status)
/// };
/// assert_eq!(step(None), (0.0, CommandStatus::Idle));
/// assert_eq!(step(Some(&ahead)), (0.25, CommandStatus::Limited)); // 1 m/s^2 for 0.25 s
/// assert_eq!(step(None), (0.5, CommandStatus::Following));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum CommandStatus {
    /// No command since the start or since the release of an emergency stop, or no command of rest yet if
    /// [`Restart::Neutral`] requires one: at rest, or decelerating to rest.
    Idle,
    /// The twist is the command.
    Following,
    /// The limits keep the twist from the command, or still do.
    Limited,
    /// The last command is too old, or none of rest has come since where [`Restart::Neutral`] wants
    /// one: rest, or on the way there.
    TimedOut,
    /// The emergency stop is latched: rest, or on the way there.
    EmergencyStop,
}

/// One control period's twist and the reason for it. The twist is always finite.
///
/// ```
/// use omni_core::shaping::{CommandShaper, CommandStatus, ShaperState, ShapingConfig};
/// use omni_core::BodyTwist;
/// let (shaper, mut state) = (CommandShaper::new(ShapingConfig::none(), 1e-3)?, ShaperState::default());
/// let shaped = shaper.step(&mut state, Some(&BodyTwist { vx_m_s: 2e6, ..BodyTwist::ZERO })); // beyond 1e6
/// assert_eq!((shaped.twist.vx_m_s, shaped.status, shaped.rejected), (0.0, CommandStatus::Idle, true));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ShapedCommand<R> {
    /// The twist for the vehicle.
    pub twist: BodyTwist<R>,
    /// Why.
    pub status: CommandStatus,
    /// A command arrived in this period and was rejected: a component is not finite or above 1e6 in magnitude.
    pub rejected: bool,
}

/// The state of a [`CommandShaper`] between steps; `default` is at rest, without a command.
///
/// ```
/// use omni_core::shaping::{CommandShaper, ShaperState, ShapingConfig};
/// use omni_core::BodyTwist;
/// let (shaper, mut state) = (CommandShaper::new(ShapingConfig::none(), 1e-3)?, ShaperState::default());
/// assert_eq!(state.twist().vx_m_s, 0.0);
/// shaper.step(&mut state, Some(&BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO }));
/// assert_eq!(state.twist().vx_m_s, 0.5);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ShaperState<R> {
    limiter: TwistLimiterState<R>,
    command: Option<BodyTwist<R>>,
    /// Periods since `command` arrived.
    age: u32,
    stopped: bool,
}

impl<R: Real> Default for ShaperState<R> {
    fn default() -> Self {
        Self::at(&BodyTwist::ZERO)
    }
}

impl<R: Real> ShaperState<R> {
    /// In steady motion with `twist`, without a command: for control that begins while the vehicle moves.
    ///
    /// ```
    /// use omni_core::shaping::{AxisLimits, CommandShaper, ShaperState, ShapingConfig, TwistLimits};
    /// use omni_core::BodyTwist;
    /// let [vx, vy, wz] = [AxisLimits::symmetric(1.0, 1.0, 2.0, f64::INFINITY); 3];
    /// let mut config = ShapingConfig::none();
    /// config.limits = TwistLimits::PerAxis { vx, vy, wz };
    /// let mut state = ShaperState::at(&BodyTwist { vx_m_s: 1.0, ..BodyTwist::ZERO });
    /// // No command arrives: it comes to rest as the limits say, 2 m/s^2 for 0.125 s.
    /// assert_eq!(CommandShaper::new(config, 0.125)?.step(&mut state, None).twist.vx_m_s, 0.75);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn at(twist: &BodyTwist<R>) -> Self {
        Self {
            limiter: TwistLimiterState::at(twist),
            command: None,
            age: 0,
            stopped: false,
        }
    }

    /// The twist that the last step returned.
    #[must_use]
    pub fn twist(&self) -> BodyTwist<R> {
        self.limiter.twist()
    }

    /// Latches the emergency stop from the next step on, and forgets the command.
    ///
    /// ```
    /// use omni_core::shaping::{CommandShaper, CommandStatus, ShaperState, ShapingConfig};
    /// use omni_core::BodyTwist;
    /// let (shaper, mut state) = (CommandShaper::new(ShapingConfig::none(), 1e-3)?, ShaperState::default());
    /// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// shaper.step(&mut state, Some(&ahead));
    /// state.emergency_stop();
    /// let shaped = shaper.step(&mut state, Some(&ahead)); // commands that still arrive are ignored
    /// assert_eq!((shaped.twist.vx_m_s, shaped.status), (0.0, CommandStatus::EmergencyStop));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn emergency_stop(&mut self) {
        self.stopped = true;
        self.command = None;
    }

    /// Ends the emergency stop. Only a command that arrives from now on moves the vehicle.
    ///
    /// ```
    /// use omni_core::shaping::{CommandShaper, CommandStatus, ShaperState, ShapingConfig};
    /// use omni_core::BodyTwist;
    /// let (shaper, mut state) = (CommandShaper::new(ShapingConfig::none(), 1e-3)?, ShaperState::default());
    /// let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// shaper.step(&mut state, Some(&ahead));
    /// state.emergency_stop();
    /// state.release();
    /// let shaped = shaper.step(&mut state, None); // the command from before the stop is forgotten
    /// assert_eq!((shaped.twist.vx_m_s, shaped.status), (0.0, CommandStatus::Idle));
    /// assert_eq!(shaper.step(&mut state, Some(&ahead)).twist.vx_m_s, 0.5);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn release(&mut self) {
        self.stopped = false;
    }

    /// Whether the emergency stop is latched.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }
}

/// Turns the commands that arrive into a twist every control period: rejects invalid commands, expires old commands,
/// keeps the limits and stops in an emergency. The changing state is in [`ShaperState`].
///
/// A rejected command counts as none: the last valid command stays in force until it expires. A command that expires is
/// followed by rest, within the limits and no harder than an emergency stop, which has its own deceleration and no jerk
/// limit. After its release commands are followed from the velocity reached.
///
/// ```
/// use omni_core::shaping::{
///     CommandShaper, CommandStatus, MotionLimits, ShaperState, ShapingConfig, TwistLimits,
/// };
/// use omni_core::BodyTwist;
/// let linear = MotionLimits { acceleration: 1.0_f64, deceleration: 2.0, ..MotionLimits::unlimited() };
/// let mut config = ShapingConfig::none();
/// config.limits = TwistLimits::AlongMotion { linear, yaw: MotionLimits::unlimited() };
/// config.timeout_s = Some(0.5);
/// let (shaper, mut state) = (CommandShaper::new(config, 0.25)?, ShaperState::default());
/// let forward = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
/// let shaped = shaper.step(&mut state, Some(&forward));
/// assert_eq!((shaped.twist.vx_m_s, shaped.status), (0.25, CommandStatus::Limited));
/// let broken = BodyTwist { vx_m_s: f64::NAN, ..forward };
/// let shaped = shaper.step(&mut state, Some(&broken)); // 0.25 s old, and the best there is
/// assert_eq!((shaped.twist.vx_m_s, shaped.status, shaped.rejected), (0.5, CommandStatus::Following, true));
/// assert_eq!(shaper.step(&mut state, None).twist.vx_m_s, 0.5); // 0.5 s old
/// let shaped = shaper.step(&mut state, None);
/// assert_eq!((shaped.twist.vx_m_s, shaped.status), (0.0, CommandStatus::TimedOut));
/// state.emergency_stop();
/// assert_eq!(shaper.step(&mut state, Some(&forward)).status, CommandStatus::EmergencyStop);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct CommandShaper<R> {
    limiter: TwistLimiter<R>,
    /// The highest age at which a command counts.
    oldest: u32,
    /// Linear and yaw speed that an emergency stop removes per period.
    emergency_steps: [R; 2],
    /// Only a command of rest ends rest.
    neutral: bool,
}

constant_struct!(CommandShaper<R> { limiter: TwistLimiter<R>, oldest: u32, emergency_steps: [R; 2], neutral: bool });

impl<R: Real> CommandShaper<R> {
    /// A shaper that is stepped every `period_s` \[s\], 1e-6 to 10. A time-out counts in whole periods, rounded down.
    ///
    /// # Errors
    /// Parameter `period_s`, `timeout_s`, `emergency_deceleration.linear_m_s2` or `emergency_deceleration.yaw_rad_s2`
    /// if it is out of range; errors of the limits as in [`TwistLimiter::new`].
    pub fn new(config: ShapingConfig<R>, period_s: R) -> Result<Self, ConfigError> {
        let dt = period(period_s)?;
        let oldest = match config.timeout_s {
            // A ratio that is a whole number but for rounding is that number; the cast saturates.
            Some(timeout) => {
                let periods = not_negative("timeout_s", timeout)?.as_f64() / dt.as_f64();
                (periods * (1.0 + 1e-6)) as u32
            }
            None => u32::MAX,
        };
        let none = R::of(f64::INFINITY);
        let emergency = config.emergency_deceleration.unwrap_or(EmergencyDeceleration {
            linear_m_s2: none,
            yaw_rad_s2: none,
        });
        Ok(Self {
            limiter: TwistLimiter::new(config.limits, period_s)?,
            oldest,
            emergency_steps: [
                limit("emergency_deceleration.linear_m_s2", emergency.linear_m_s2)? * dt,
                limit("emergency_deceleration.yaw_rad_s2", emergency.yaw_rad_s2)? * dt,
            ],
            neutral: config.restart == Restart::Neutral,
        })
    }

    /// One control period; `command` \[m/s, m/s, rad/s\] is the one that arrived in it, if one did. The twist is always
    /// finite.
    ///
    /// ```
    /// use omni_core::shaping::{CommandShaper, ShaperState, ShapingConfig};
    /// use omni_core::BodyTwist;
    /// // A time-out of 0: each command moves the vehicle for one period.
    /// let mut config = ShapingConfig::none();
    /// config.timeout_s = Some(0.0);
    /// let (shaper, mut state) = (CommandShaper::new(config, 1e-3)?, ShaperState::default());
    /// let left = BodyTwist { vy_m_s: 0.5, ..BodyTwist::ZERO };
    /// assert_eq!([Some(&left), None].map(|command| shaper.step(&mut state, command).twist.vy_m_s), [0.5, 0.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut ShaperState<R>, command: Option<&BodyTwist<R>>) -> ShapedCommand<R> {
        let accepted = command.filter(|command| is_sane(command));
        let rejected = command.is_some() && accepted.is_none();
        if state.stopped {
            state.limiter = TwistLimiterState::at(&self.braked(&state.twist()));
            return ShapedCommand {
                twist: state.twist(),
                status: CommandStatus::EmergencyStop,
                rejected,
            };
        }
        let waits = self.neutral && (state.command.is_none() || state.age > self.oldest);
        let accepted = accepted.filter(|command| !waits || **command == BodyTwist::ZERO);
        if accepted.is_some() {
            state.command = accepted.copied();
            state.age = 0;
        } else {
            state.age = state.age.saturating_add(1);
        }
        let rest = BodyTwist::ZERO;
        let (target, status) = match state.command {
            None => (rest, CommandStatus::Idle),
            Some(_) if state.age > self.oldest => (rest, CommandStatus::TimedOut),
            Some(command) => (command, CommandStatus::Following),
        };
        let before = state.twist();
        self.limiter.step(&mut state.limiter, &target);
        if matches!(status, CommandStatus::Idle | CommandStatus::TimedOut) && before != rest {
            state.limiter.brake_no_harder(&before, &self.braked(&before));
        }
        let twist = state.twist();
        let status = if status == CommandStatus::Following && twist != target {
            CommandStatus::Limited
        } else {
            status
        };
        ShapedCommand {
            twist,
            status,
            rejected,
        }
    }

    /// `twist` after one period of emergency stop.
    fn braked(&self, twist: &BodyTwist<R>) -> BodyTwist<R> {
        let [linear, yaw] = self.emergency_steps;
        let planar = less(
            Vector {
                x: twist.vx_m_s,
                y: twist.vy_m_s,
            },
            linear,
        );
        let turn = Vector {
            x: twist.wz_rad_s,
            y: R::zero(),
        };
        BodyTwist {
            vx_m_s: planar.x,
            vy_m_s: planar.y,
            wz_rad_s: less(turn, yaw).x,
        }
    }
}

/// `velocity` shorter by `step`, no less than nothing.
fn less<R: Real>(velocity: Vector<R>, step: R) -> Vector<R> {
    let speed = velocity.norm();
    // If the step is below the resolution of R, or the square of the speed overflows, it stops at once, because a brake
    // must always act.
    let rest = (speed - step) / speed;
    let factor = if speed > step && rest < R::one() {
        rest
    } else {
        R::zero()
    };
    velocity.scaled(factor)
}

/// Is every component finite and no more than 1e6 in magnitude?
fn is_sane<R: Real>(command: &BodyTwist<R>) -> bool {
    command.to_array().iter().all(|v| v.abs() <= R::of(1e6))
}

#[cfg(test)]
mod tests;
