//! What a PID loop is made of.

use super::{AntiWindup, FeedForward};
use crate::error::positive;
use crate::motor::TorqueRange;
use crate::{ConfigError, Real};

/// Gains of eq. (10), `u = kp e + ki (integral of e) + kd e'`, on an actuator velocity error e \[rad/s\].
///
/// ```
/// use omni_core::loops::{Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.5 };
/// let (pid, mut state) = (Pid::new(PidConfig::new(gains, 0.25))?, PidState::default());
/// pid.step(&mut state, 1.0, 1.0);
/// // An error of 1 rad/s from one period to the next.
/// assert_eq!(pid.step(&mut state, 2.0, 1.0).output_n_m, 2.0 * 1.0 + 4.0 * (1.0 * 0.25) + 0.5 * (1.0 / 0.25));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PidGains<R> {
    /// Proportional gain k_p \[N.m per rad/s\], 0 to 1e6.
    pub kp_n_m_s_rad: R,
    /// Integral gain k_i \[N.m per rad\], 0 to 1e6.
    pub ki_n_m_rad: R,
    /// Derivative gain k_d \[N.m per rad/s^2\], 0 to 1e6.
    pub kd_n_m_s2_rad: R,
}

impl<R: Real> PidGains<R> {
    /// A loop without a derivative, as wheels usually have it: their encoders are too coarse for one.
    ///
    /// `kp_n_m_s_rad` \[N.m per rad/s\] and `ki_n_m_rad` \[N.m per rad\], each 0 to 1e6.
    ///
    /// ```
    /// use omni_core::PidGains;
    /// let gains = PidGains::pi(0.3, 2.0);
    /// assert_eq!((gains.kp_n_m_s_rad, gains.ki_n_m_rad, gains.kd_n_m_s2_rad), (0.3, 2.0, 0.0));
    /// ```
    #[must_use]
    pub fn pi(kp_n_m_s_rad: R, ki_n_m_rad: R) -> Self {
        Self {
            kp_n_m_s_rad,
            ki_n_m_rad,
            kd_n_m_s2_rad: R::ZERO,
        }
    }
}

/// When the integral takes in the present error. References differ: see docs/units.md.
///
/// ```
/// use omni_core::loops::{IntegrationOrder, Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.0 };
/// let (before, after) = (IntegrationOrder::BeforeOutput, IntegrationOrder::AfterOutput);
/// for (order, outputs) in [(before, [1.0, 2.0]), (after, [0.0, 1.0])] {
///     let mut config = PidConfig::new(gains, 0.25);
///     config.order = order;
///     let (pid, mut state) = (Pid::new(config)?, PidState::default());
///     assert_eq!([0; 2].map(|_| pid.step(&mut state, 1.0, 0.0).output_n_m), outputs); // ki dt is 1
/// }
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum IntegrationOrder {
    /// First integrate, then form the output (implicit Euler; WPILib, the `pid` crate).
    BeforeOutput,
    /// First form the output, then integrate (explicit Euler; ros2's control_toolbox): the integral
    /// acts one period late.
    AfterOutput,
}

/// Everything a PID loop is made of; checked by [`Pid::new`](crate::loops::Pid::new).
///
/// ```
/// use omni_core::loops::{Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 2.0_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 1.0 };
/// // The derivative looks at the measurement only: a step of the reference does not kick.
/// let pid = Pid::new(PidConfig::new(gains, 0.1).with_derivative_on_measurement())?;
/// let mut state = PidState::default();
/// pid.step(&mut state, 0.0, 0.0);
/// assert_eq!(pid.step(&mut state, 1.0, 0.0).output_n_m, 2.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PidConfig<R> {
    /// Gains.
    pub gains: PidGains<R>,
    /// Control period \[s\], 1e-6 to 10: the step must be called exactly this often.
    pub period_s: R,
    /// Weight b of the reference in the proportional term, 0 to 1: below 1 a step of the reference overshoots less.
    pub proportional_weight: R,
    /// Weight c of the reference in the derivative term, 0 to 1: 1 is the derivative of the error, 0 that of the
    /// measurement alone.
    pub derivative_weight: R,
    /// Time constant \[s\] of the derivative's first-order filter, 0 (none) to 1e3; `T d' + d = kd e'`.
    pub derivative_filter_s: R,
    /// What the reference needs without any error.
    pub feed_forward: FeedForward<R>,
    /// When the integral takes in the error.
    pub order: IntegrationOrder,
    /// What the integral does while the output is not what the loop asked for.
    pub anti_windup: AntiWindup<R>,
    /// Integral zone \[rad/s\], 0 or more, infinite for none: the integral takes in errors
    /// within +- this and is set to 0 by any other, so that it mends the last bit of an error and
    /// knows nothing of the way there. WPILib's `IZone` does the same. Wider than the noise of the
    /// readings. Where wheels share an integral, one error beyond the zone sets all of them to 0.
    pub integral_zone_rad_s: R,
    /// The proportional term is held within +- this \[N.m\], 0 or more, infinite for none. The
    /// integral knows of the limits of the output only, but while the output is limited too it
    /// takes in no more than what is left of the proportional term stands for.
    pub proportional_limit_n_m: R,
    /// Limits of the output, infinite for none. [`crate::loops::WheelController`] uses its motors' limits instead.
    pub output: TorqueRange<R>,
}

impl<R: Real> PidConfig<R> {
    /// Eq. (10) and nothing else, with a control period of `period_s` \[s\], 1e-6 to 10: whole weights, no filter, no
    /// feed-forward, no limits, the integral taken in before the output and never held back.
    #[must_use]
    pub fn new(gains: PidGains<R>, period_s: R) -> Self {
        Self {
            gains,
            period_s,
            proportional_weight: R::one(),
            derivative_weight: R::one(),
            derivative_filter_s: R::ZERO,
            feed_forward: FeedForward::none(),
            order: IntegrationOrder::BeforeOutput,
            anti_windup: AntiWindup::None,
            integral_zone_rad_s: R::one() / R::zero(),
            proportional_limit_n_m: R::one() / R::zero(),
            output: TorqueRange::unlimited(),
        }
    }

    /// What one count of an encoder with `counts_per_turn` > 0 makes of a velocity read once a period, and what
    /// the gains make of that: proportional, integral and derivative of a single count. More than the motor has
    /// is a warning: the torque then jumps from limit to limit, and the loop holds the speed in the mean only.
    ///
    /// # Errors
    /// Parameter `counts_per_turn` not above 0 or not finite.
    ///
    /// ```
    /// use omni_core::{PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// let step = PidConfig::new(gains, 1e-3).encoder_step(64.0)?;
    /// assert!((step.velocity_rad_s - 98.17).abs() < 0.01); // 2 pi / 64 in a millisecond
    /// assert!((step.torque_n_m - 29.45).abs() < 0.01); // no motor of 2 N.m gives that
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn encoder_step(&self, counts_per_turn: R) -> Result<EncoderStep<R>, ConfigError> {
        let counts = positive("counts_per_turn", counts_per_turn)?;
        let velocity_rad_s = R::of(core::f64::consts::TAU) / counts / self.period_s;
        let PidGains {
            kp_n_m_s_rad,
            ki_n_m_rad,
            kd_n_m_s2_rad,
        } = self.gains;
        let gain = kp_n_m_s_rad
            + ki_n_m_rad * self.period_s
            + kd_n_m_s2_rad / (self.derivative_filter_s + self.period_s);
        // What a limit of the proportional term takes off.
        let over = kp_n_m_s_rad * velocity_rad_s - self.proportional_limit_n_m;
        let over = if over > R::zero() { over } else { R::zero() };
        Ok(EncoderStep {
            velocity_rad_s,
            torque_n_m: gain * velocity_rad_s - over,
        })
    }

    /// The same with an integral that takes in only errors of at most `zone_rad_s` \[rad/s\], 0 or
    /// more; a larger one sets it to 0.
    ///
    /// ```
    /// use omni_core::loops::{Pid, PidState};
    /// use omni_core::{PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: 1.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.0 };
    /// let (pid, mut state) = (Pid::new(PidConfig::new(gains, 0.25).with_integral_zone(2.0))?, PidState::default());
    /// // Far away it is a proportional loop; from 2 rad/s on the integral counts, and it starts from nothing.
    /// let outputs = [9.0, 2.0, 1.0, 3.0].map(|reference| pid.step(&mut state, reference, 0.0).output_n_m);
    /// assert_eq!(outputs, [9.0, 2.0 + 2.0, 1.0 + 3.0, 3.0]); // ki dt is 1
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn with_integral_zone(self, zone_rad_s: R) -> Self {
        Self {
            integral_zone_rad_s: zone_rad_s,
            ..self
        }
    }

    /// The same with the proportional term held within +-`limit_n_m` \[N.m\], 0 or more: a large
    /// error pulls no harder than that.
    ///
    /// ```
    /// use omni_core::loops::{Pid, PidState};
    /// use omni_core::{PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: 1.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.0 };
    /// let (pid, mut state) = (Pid::new(PidConfig::new(gains, 0.25).with_proportional_limit(0.5))?, PidState::default());
    /// let terms = pid.step(&mut state, -3.0, 0.0).terms;
    /// assert_eq!((terms.p_n_m, terms.i_n_m), (-0.5, -3.0)); // not -3; the integral takes in the whole error
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn with_proportional_limit(self, limit_n_m: R) -> Self {
        Self {
            proportional_limit_n_m: limit_n_m,
            ..self
        }
    }

    /// The same with the derivative of the measurement alone (`derivative_weight` 0): it brakes what moves, and a step
    /// of the reference does not kick.
    #[must_use]
    pub fn with_derivative_on_measurement(self) -> Self {
        Self {
            derivative_weight: R::ZERO,
            ..self
        }
    }
}

/// One count of an encoder, as a loop sees it: see [`PidConfig::encoder_step`].
///
/// ```
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 0.5_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let step = PidConfig::new(gains, 0.01).encoder_step(2000.0)?;
/// assert!((step.torque_n_m / step.velocity_rad_s - 0.5).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct EncoderStep<R> {
    /// Velocity that one count in one period reads as \[rad/s\].
    pub velocity_rad_s: R,
    /// Torque that the gains make of it \[N.m\].
    pub torque_n_m: R,
}
