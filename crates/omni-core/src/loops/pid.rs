//! One PID loop, eq. (10) of the paper, with a period that is fixed at construction.

mod anti_windup;
mod bounds;
mod config;
mod correction;
mod feed_forward;
mod sample;
mod step;
#[cfg(test)]
mod tests;

use crate::constants::constant_struct;
use crate::error::{period, within};
use crate::motor::TorqueRange;
use crate::{ConfigError, Real};
pub use anti_windup::AntiWindup;
use anti_windup::{back_calculation_gain, reciprocal};
pub use bounds::TermBounds;
pub use config::{EncoderStep, IntegrationOrder, PidConfig, PidGains};
pub(crate) use correction::Excess;
pub use feed_forward::{Discrete, FeedForward};
pub use sample::{LastStep, PidSample, PidState, PidTerms};

/// A PID loop's constants. The changing state is in [`PidState`].
///
/// Formed once from a [`PidConfig`]; derivatives are backward differences, zero in the first step. With the
/// reference r, the measurement y, the period T, the weights b and c and the filter time Td of the derivative:
///
/// ```text
/// p  = kp (b r - y)
/// i  = I + ki T (r - y)      AfterOutput: I alone
/// d' = (Td d + kd (c (r - r_last) - (y - y_last))) / (Td + T)
/// ff = what the motor's model needs for r, see FeedForward
/// u  = p + i + d' + ff       cut to the limits of the output
/// I' = I + ki T (r - y)      and what anti-windup adds
/// ```
///
/// ```
/// use omni_core::loops::{Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 2.0_f64, ki_n_m_rad: 10.0, kd_n_m_s2_rad: 0.0 };
/// let pid = Pid::new(PidConfig::new(gains, 0.1))?;
/// let mut state = PidState::default();
/// assert_eq!(pid.step(&mut state, 1.0, 0.0).output_n_m, 3.0); // 2 * 1 + 10 * (0.1 * 1)
/// assert_eq!(pid.step(&mut state, 1.0, 0.0).output_n_m, 4.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Pid<R> {
    kp: R,
    /// kp b.
    kp_reference: R,
    /// ki T.
    ki_dt: R,
    /// ki T if the integral includes an error before the output; 0 otherwise.
    ki_dt_output: R,
    /// kd / (Td + T).
    kd_discrete: R,
    /// c.
    derivative_weight: R,
    /// Td / (Td + T).
    derivative_memory: R,
    feed_forward: Discrete<R>,
    /// Some term compares with the step before: a derivative or a feed-forward.
    uses_last: bool,
    feeds_forward: bool,
    /// 1 / (du/dr) \[rad/s per N.m\], 0 if du/dr is 0; in the first step.
    inverse_slope: R,
    inverse_first_slope: R,
    // Fraction of an excess that a conditioned integral removes; in a first step.
    conditioned_gain: R,
    first_conditioned_gain: R,
    anti_windup: AntiWindup<R>,
    tracking: R,
    bounds: TermBounds<R>,
    output: TorqueRange<R>,
}

constant_struct!(Pid<R> {
    kp: R,
    kp_reference: R,
    ki_dt: R,
    ki_dt_output: R,
    kd_discrete: R,
    derivative_weight: R,
    derivative_memory: R,
    feed_forward: Discrete<R>,
    uses_last: bool,
    feeds_forward: bool,
    inverse_slope: R,
    inverse_first_slope: R,
    conditioned_gain: R,
    first_conditioned_gain: R,
    anti_windup: AntiWindup<R>,
    tracking: R,
    bounds: TermBounds<R>,
    output: TorqueRange<R>,
});

impl<R: Real> Pid<R> {
    /// A loop as configured.
    ///
    /// # Errors
    /// The parameter that is out of its range; `tracking_time_s` below the period; `output.lower_n_m` above 0 or
    /// `output.upper_n_m` below.
    pub fn new(config: PidConfig<R>) -> Result<Self, ConfigError> {
        let gain = |name, value| within(name, value, 0.0..=1e6, "0 to 1000000");
        let weight = |name, value| within(name, value, 0.0..=1.0, "0 to 1");
        let PidConfig { gains, output, .. } = config;
        let dt = period(config.period_s)?;
        let kp = gain("kp_n_m_s_rad", gains.kp_n_m_s_rad)?;
        let ki_dt = gain("ki_n_m_rad", gains.ki_n_m_rad)? * dt;
        let kd = gain("kd_n_m_s2_rad", gains.kd_n_m_s2_rad)?;
        let filter = within(
            "derivative_filter_s",
            config.derivative_filter_s,
            0.0..=1e3,
            "0 to 1000",
        )?;
        let derivative_weight = weight("derivative_weight", config.derivative_weight)?;
        let kp_reference = kp * weight("proportional_weight", config.proportional_weight)?;
        let feed_forward = Discrete::new(&config.feed_forward, dt)?;
        let feeds_forward = config.feed_forward != FeedForward::none();
        let (zero, one) = (R::zero(), R::one());
        within(
            "output.lower_n_m",
            output.lower_n_m,
            f64::NEG_INFINITY..=0.0,
            "<= 0",
        )?;
        within("output.upper_n_m", output.upper_n_m, 0.0..=f64::INFINITY, ">= 0")?;
        let ki_dt_output = if config.order == IntegrationOrder::BeforeOutput {
            ki_dt
        } else {
            zero
        };
        // Backward Euler of T d' + d = kd e'.
        let kd_discrete = kd / (filter + dt);
        let common = kp_reference + ki_dt_output;
        let slope = common + kd_discrete * derivative_weight + feed_forward.gain;
        let first_slope = common + feed_forward.gain * (one - feed_forward.decay);
        Ok(Self {
            kp,
            kp_reference,
            ki_dt,
            ki_dt_output,
            kd_discrete,
            derivative_weight,
            derivative_memory: filter / (filter + dt),
            feed_forward,
            uses_last: kd > zero || feeds_forward,
            feeds_forward,
            inverse_slope: reciprocal(slope),
            inverse_first_slope: reciprocal(first_slope),
            conditioned_gain: back_calculation_gain(
                ki_dt,
                reciprocal(slope),
                kd_discrete * derivative_weight,
            ),
            first_conditioned_gain: back_calculation_gain(ki_dt, reciprocal(first_slope), zero),
            anti_windup: config.anti_windup,
            tracking: config.anti_windup.checked_tracking_part(dt)?,
            bounds: TermBounds::new(config.integral_zone_rad_s, config.proportional_limit_n_m)?,
            output,
        })
    }

    #[inline]
    pub(crate) fn proportional(&self, reference: R, measured: R) -> R {
        self.kp_reference * reference - self.kp * measured
    }

    #[inline]
    pub(crate) fn integral(&self, integral: R, integrated_error: R) -> R {
        integral + self.ki_dt_output * integrated_error
    }

    /// Change of what the derivative looks at since the last step.
    #[inline]
    pub(crate) fn weighted_change(
        &self,
        reference: R,
        last_reference: R,
        measured: R,
        last_measured: R,
    ) -> R {
        self.derivative_weight * (reference - last_reference) - (measured - last_measured)
    }

    #[inline]
    pub(crate) fn derivative(&self, last: R, change: R) -> R {
        self.derivative_memory * last + self.kd_discrete * change
    }

    #[inline]
    pub(crate) fn feed_forward(&self, reference: R, last_reference: R) -> R {
        self.feed_forward.torque(reference, last_reference)
    }

    #[inline]
    pub(crate) fn feeds_forward(&self) -> bool {
        self.feeds_forward
    }

    /// Some term compares with the step before.
    #[inline]
    pub(crate) fn uses_last(&self) -> bool {
        self.uses_last
    }

    /// How each term changes with the reference \[N.m per rad/s\]. In the first step what is compared with moves along.
    #[inline]
    pub(crate) fn term_slopes(&self, started: bool) -> PidTerms<R> {
        let ff = self.feed_forward.gain;
        PidTerms {
            p_n_m: self.kp_reference,
            i_n_m: self.ki_dt_output,
            d_n_m: self.derivative_slope(started),
            ff_n_m: if started {
                ff
            } else {
                ff * (R::one() - self.feed_forward.decay)
            },
        }
    }

    #[inline]
    pub(crate) fn derivative_slope(&self, started: bool) -> R {
        if started {
            self.kd_discrete * self.derivative_weight
        } else {
            R::zero()
        }
    }

    /// An integral term held where [`AntiWindup::Clamp`] says so.
    #[inline]
    pub(crate) fn held(&self, integral: R) -> R {
        match self.anti_windup {
            AntiWindup::Clamp { limit_n_m } => integral.limited(-limit_n_m, limit_n_m),
            _ => integral,
        }
    }

    pub(crate) fn integral_gain_dt(&self) -> R {
        self.ki_dt
    }

    pub(crate) fn bounds(&self) -> &TermBounds<R> {
        &self.bounds
    }

    pub(crate) fn anti_windup(&self) -> AntiWindup<R> {
        self.anti_windup
    }
}
