//! Eq. (10) and what practice adds to it: one PID loop with the real period fixed at construction.

mod anti_windup;
mod feed_forward;
#[cfg(test)]
mod tests;

use crate::constants::constant_struct;
use crate::error::{ConfigError, period, within};
use crate::{Real, TorqueRange};
pub use anti_windup::AntiWindup;
pub use feed_forward::{Discrete, FeedForward};

/// Gains of eq. (10), `u = kp e + ki (integral of e) + kd e'`, on an actuator velocity error e \[rad/s\].
///
/// ```
/// use omni_core::{Pid, PidConfig, PidGains, PidState};
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

/// When the integral takes in the present error. References differ: see docs/conventions.md.
///
/// ```
/// use omni_core::{IntegrationOrder, Pid, PidConfig, PidGains, PidState};
/// let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.0 };
/// let (before, after) = (IntegrationOrder::BeforeOutput, IntegrationOrder::AfterOutput);
/// for (order, outputs) in [(before, [1.0, 2.0]), (after, [0.0, 1.0])] {
///     let (pid, mut state) = (Pid::new(PidConfig { order, ..PidConfig::new(gains, 0.25) })?, PidState::default());
///     assert_eq!([0; 2].map(|_| pid.step(&mut state, 1.0, 0.0).output_n_m), outputs); // ki dt is 1
/// }
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum IntegrationOrder {
    /// First integrate, then form the output (implicit Euler; WPILib, the `pid` crate).
    BeforeOutput,
    /// First form the output, then integrate (explicit Euler; ros2's control_toolbox): the integral acts one period late.
    AfterOutput,
}

/// Everything a PID loop is made of; checked by [`Pid::new`].
///
/// ```
/// use omni_core::{Pid, PidConfig, PidGains, PidState};
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
    /// Limits of the output, infinite for none. [`crate::WheelController`] uses its motors' limits instead.
    pub output: TorqueRange<R>,
}

impl<R: Real> PidConfig<R> {
    /// Eq. (10) and nothing else, with a control period of `period_s` \[s\], 1e-6 to 10: whole weights, no filter, no
    /// feed-forward, no limits, the integral taken in before the output and never held back.
    ///
    /// ```
    /// use omni_core::{AntiWindup, PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: 2.0_f64, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.5 };
    /// let config = PidConfig::new(gains, 1e-3);
    /// assert_eq!((config.proportional_weight, config.derivative_weight, config.derivative_filter_s), (1.0, 1.0, 0.0));
    /// assert_eq!((config.output.upper_n_m, config.anti_windup), (f64::INFINITY, AntiWindup::None));
    /// ```
    #[must_use]
    pub fn new(gains: PidGains<R>, period_s: R) -> Self {
        Self {
            gains,
            period_s,
            proportional_weight: R::one(),
            derivative_weight: R::one(),
            derivative_filter_s: R::zero(),
            feed_forward: FeedForward::none(),
            order: IntegrationOrder::BeforeOutput,
            anti_windup: AntiWindup::None,
            output: TorqueRange::unlimited(),
        }
    }

    /// The same with the derivative of the measurement alone (`derivative_weight` 0): it brakes what moves, and a step
    /// of the reference does not kick.
    ///
    /// ```
    /// use omni_core::{Pid, PidConfig, PidGains, PidState};
    /// let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.5 };
    /// let pid = Pid::new(PidConfig::new(gains, 0.25).with_derivative_on_measurement())?;
    /// let mut state = PidState::default();
    /// pid.step(&mut state, 0.0, 0.0);
    /// assert_eq!(pid.step(&mut state, 9.0, 1.0).output_n_m, -0.5 * (1.0 / 0.25)); // 9 is not looked at
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn with_derivative_on_measurement(self) -> Self {
        Self {
            derivative_weight: R::zero(),
            ..self
        }
    }
}

/// A PID loop's constants. What changes from step to step is in [`PidState`].
///
/// Formed once from a [`PidConfig`]; derivatives are backward differences, zero in the first step.
///
/// ```
/// use omni_core::{Pid, PidConfig, PidGains, PidState};
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
    kp_reference: R,
    ki_dt: R,
    ki_dt_output: R,
    kd_per_dt: R,
    derivative_weight: R,
    derivative_memory: R,
    feed_forward: Discrete<R>,
    /// Some term compares with the step before: a derivative or a feed-forward.
    remembers: bool,
    feeds_forward: bool,
    /// Change of the reference with the output (0 where there is none), later and in the first step.
    per_slope: R,
    per_first_slope: R,
    anti_windup: AntiWindup<R>,
    tracking: R,
    output: TorqueRange<R>,
}

constant_struct!(Pid<R> {
    kp: R,
    kp_reference: R,
    ki_dt: R,
    ki_dt_output: R,
    kd_per_dt: R,
    derivative_weight: R,
    derivative_memory: R,
    feed_forward: Discrete<R>,
    remembers: bool,
    feeds_forward: bool,
    per_slope: R,
    per_first_slope: R,
    anti_windup: AntiWindup<R>,
    tracking: R,
    output: TorqueRange<R>,
});

/// What a PID loop remembers between steps; `default` is a fresh start.
///
/// ```
/// use omni_core::{LastStep, Pid, PidConfig, PidGains, PidState};
/// let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 1.0 };
/// let (pid, mut state) = (Pid::new(PidConfig::new(gains, 0.25))?, PidState::default());
/// pid.step(&mut state, 3.0, 1.0);
/// assert_eq!((state.integral_n_m, state.derivative_n_m), (4.0 * 2.0 * 0.25, 0.0)); // nothing to differ from yet
/// assert_eq!(state.last, Some(LastStep { reference_rad_s: 3.0, measured_rad_s: 1.0 }));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PidState<R> {
    /// Integral term \[N.m\].
    pub integral_n_m: R,
    /// Derivative term \[N.m\], after its filter.
    pub derivative_n_m: R,
    /// What the derivative and the feed-forward compare with, none before the first step.
    pub last: Option<LastStep<R>>,
}

/// The step before, as far as a loop needs it.
///
/// ```
/// use omni_core::{LastStep, Pid, PidConfig, PidGains, PidState};
/// let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 1.0 };
/// let pid = Pid::new(PidConfig::new(gains, 0.25))?;
/// // Taken over from another loop, which saw no error: an error of 1 rad/s now has come up within one period.
/// let last = Some(LastStep { reference_rad_s: 5.0, measured_rad_s: 5.0 });
/// let mut state = PidState { last, ..PidState::default() };
/// assert_eq!(pid.step(&mut state, 5.0, 4.0).output_n_m, 1.0 / 0.25);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LastStep<R> {
    /// Reference as realised \[rad/s\].
    pub reference_rad_s: R,
    /// Measurement \[rad/s\].
    pub measured_rad_s: R,
}

impl<R: Real> Default for PidState<R> {
    fn default() -> Self {
        Self {
            integral_n_m: R::zero(),
            derivative_n_m: R::zero(),
            last: None,
        }
    }
}

impl<R: Real> PidState<R> {
    /// Forgets everything but the integral term: after a pause in which the load stayed.
    ///
    /// ```
    /// use omni_core::PidState;
    /// let mut state = PidState { integral_n_m: -0.5_f64, derivative_n_m: 3.0, last: None };
    /// state.reset_keeping_integral();
    /// assert_eq!((state.integral_n_m, state.derivative_n_m), (-0.5, 0.0));
    /// ```
    pub fn reset_keeping_integral(&mut self) {
        *self = Self {
            integral_n_m: self.integral_n_m,
            ..Self::default()
        };
    }
}

/// The terms of one output \[N.m\]: those of eq. (10) and the feed-forward.
///
/// ```
/// use omni_core::{Pid, PidConfig, PidGains, PidState};
/// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.5 };
/// let terms = Pid::new(PidConfig::new(gains, 0.25))?.step(&mut PidState::default(), 3.0, 1.0).terms;
/// assert_eq!((terms.p_n_m, terms.i_n_m, terms.d_n_m, terms.ff_n_m), (2.0 * 2.0, 4.0 * 2.0 * 0.25, 0.0, 0.0));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PidTerms<R> {
    /// Proportional term \[N.m\].
    pub p_n_m: R,
    /// Integral term \[N.m\]; the present error is in it under [`IntegrationOrder::BeforeOutput`].
    pub i_n_m: R,
    /// Derivative term \[N.m\].
    pub d_n_m: R,
    /// Feed-forward \[N.m\].
    pub ff_n_m: R,
}

impl<R: Real> PidTerms<R> {
    fn integral_alone(i_n_m: R) -> Self {
        let zero = R::zero();
        Self {
            p_n_m: zero,
            i_n_m,
            d_n_m: zero,
            ff_n_m: zero,
        }
    }

    /// The output asked for: the sum of the four \[N.m\].
    ///
    /// ```
    /// use omni_core::PidTerms;
    /// assert_eq!(PidTerms { p_n_m: 1.0, i_n_m: 0.5, d_n_m: -0.25, ff_n_m: 2.0 }.sum(), 3.25);
    /// ```
    #[must_use]
    pub fn sum(&self) -> R {
        self.p_n_m + self.i_n_m + self.d_n_m + self.ff_n_m
    }
}

/// One step of a loop.
///
/// ```
/// use omni_core::{Pid, PidConfig, PidGains, PidState, TorqueRange};
/// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let output = TorqueRange { lower_n_m: -1.0, upper_n_m: 1.0 };
/// let pid = Pid::new(PidConfig { output, ..PidConfig::new(gains, 1e-3) })?;
/// let sample = pid.step(&mut PidState::default(), 0.0, 3.0);
/// assert_eq!((sample.terms.sum(), sample.output_n_m, sample.saturated), (-2.0 * 3.0, -1.0, true));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PidSample<R> {
    /// The terms.
    pub terms: PidTerms<R>,
    /// Output within the limits \[N.m\].
    pub output_n_m: R,
    /// The limits took something away.
    pub saturated: bool,
}

impl<R: Real> Pid<R> {
    /// A loop as configured.
    ///
    /// # Errors
    /// The parameter that is out of its range; `tracking_time_s` below the period; `output.lower_n_m` above 0 or
    /// `output.upper_n_m` below.
    ///
    /// ```
    /// use omni_core::{Pid, PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: -2.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// let error = Pid::new(PidConfig::new(gains, 1e-3)).unwrap_err(); // would drive away from the reference
    /// assert_eq!((error.parameter, error.value), ("kp_n_m_s_rad", -2.0));
    /// ```
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
        let kd_per_dt = kd / (filter + dt);
        let common = kp_reference + ki_dt_output;
        let slope = common + kd_per_dt * derivative_weight + feed_forward.gain;
        let first_slope = common + feed_forward.gain * (one - feed_forward.decay);
        // A slope of next to nothing is none: its reciprocal would be beyond every number.
        let reciprocal = |slope| if slope > R::of(1e-9) { one / slope } else { zero };
        Ok(Self {
            kp,
            kp_reference,
            ki_dt,
            ki_dt_output,
            kd_per_dt,
            derivative_weight,
            derivative_memory: filter / (filter + dt),
            feed_forward,
            remembers: kd > zero || feeds_forward,
            feeds_forward,
            per_slope: reciprocal(slope),
            per_first_slope: reciprocal(first_slope),
            anti_windup: config.anti_windup,
            tracking: config.anti_windup.tracking(dt)?,
            output,
        })
    }

    /// One step: the output \[N.m\] that brings `measured_rad_s` to `reference_rad_s`, within the limits of the
    /// configuration. To be called once every period.
    ///
    /// A reference or measurement that is not finite, or beyond 1e6 rad/s, changes nothing in the state and yields the
    /// integral term alone.
    ///
    /// ```
    /// use omni_core::{Pid, PidConfig, PidGains, PidState};
    /// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.0 };
    /// let (pid, mut state) = (Pid::new(PidConfig::new(gains, 0.25))?, PidState::default());
    /// assert_eq!(pid.step(&mut state, -1.0, 0.0).output_n_m, -(2.0 + 4.0 * 0.25));
    /// assert_eq!(pid.step(&mut state, -1.0, f64::NAN).output_n_m, -1.0); // what the integral holds
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut PidState<R>, reference_rad_s: R, measured_rad_s: R) -> PidSample<R> {
        if !(is_plausible(reference_rad_s) && is_plausible(measured_rad_s)) {
            return self.limited(PidTerms::integral_alone(state.integral_n_m));
        }
        let error = reference_rad_s - measured_rad_s;
        let mut terms = self.terms(state, reference_rad_s, measured_rad_s, error);
        if !terms.sum().is_finite_real() {
            // Only a state set from outside gets here: start afresh.
            *state = PidState::default();
            return self.limited(PidTerms::integral_alone(state.integral_n_m));
        }
        let sample = self.limited(terms);
        let (excess, started) = (sample.output_n_m - terms.sum(), state.last.is_some());
        let correction = self.correction(self.anti_windup, error, excess, started);
        state.integral_n_m = self.held(state.integral_n_m + self.ki_dt * error + correction);
        if self.remembers {
            let shift = self.shift(self.anti_windup, excess, started);
            terms.d_n_m += self.derivative_slope(started) * shift;
            state.derivative_n_m = terms.d_n_m;
            state.last = Some(LastStep {
                reference_rad_s: reference_rad_s + shift,
                measured_rad_s,
            });
        }
        sample
    }

    /// Bumpless transfer: sets the integral so that the next step with this reference and measurement yields `output_n_m`.
    ///
    /// Call it while something else drives the actuator (manual control, another loop), or once on a loop with new gains
    /// with the output of the old one. Without an integral gain there is nothing to set, and the output may jump.
    ///
    /// ```
    /// use omni_core::{Pid, PidConfig, PidGains, PidState};
    /// let gains = |kp| PidGains { kp_n_m_s_rad: kp, ki_n_m_rad: 1.0_f64, kd_n_m_s2_rad: 0.0 };
    /// let (before, after) = (Pid::new(PidConfig::new(gains(2.0), 0.1))?, Pid::new(PidConfig::new(gains(0.5), 0.1))?);
    /// let mut state = PidState::default();
    /// let output = before.step(&mut state, 3.0, 1.0).output_n_m;
    /// after.track(&mut state, output, 3.0, 1.0);
    /// assert!((after.step(&mut state, 3.0, 1.0).output_n_m - output).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn track(&self, state: &mut PidState<R>, output_n_m: R, reference_rad_s: R, measured_rad_s: R) {
        if !(is_plausible(reference_rad_s) && is_plausible(measured_rad_s) && is_plausible(output_n_m)) {
            return;
        }
        state.last = Some(LastStep {
            reference_rad_s,
            measured_rad_s,
        });
        state.derivative_n_m = R::zero();
        if self.ki_dt > R::zero() {
            let now = self.terms(
                state,
                reference_rad_s,
                measured_rad_s,
                reference_rad_s - measured_rad_s,
            );
            state.integral_n_m = self.held(state.integral_n_m + output_n_m - now.sum());
        }
    }

    fn limited(&self, terms: PidTerms<R>) -> PidSample<R> {
        let requested = terms.sum();
        PidSample {
            terms,
            output_n_m: self.output.clip(requested),
            saturated: self.output.exceeded_by(requested),
        }
    }

    /// The terms for a reference and a measurement; changes nothing.
    fn terms(&self, state: &PidState<R>, reference: R, measured: R, taken_in: R) -> PidTerms<R> {
        let (mut d_n_m, mut ff_n_m) = (R::zero(), R::zero());
        if self.remembers {
            let now = LastStep {
                reference_rad_s: reference,
                measured_rad_s: measured,
            };
            let last = state.last.unwrap_or(now);
            let change = self.weighted_change(reference, last.reference_rad_s, measured, last.measured_rad_s);
            d_n_m = self.derivative(state.derivative_n_m, change);
            ff_n_m = self.feed_forward(reference, last.reference_rad_s);
        }
        let p_n_m = self.proportional(reference, measured);
        PidTerms {
            p_n_m,
            i_n_m: self.integral(state.integral_n_m, taken_in),
            d_n_m,
            ff_n_m,
        }
    }

    #[inline]
    pub(crate) fn proportional(&self, reference: R, measured: R) -> R {
        self.kp_reference * reference - self.kp * measured
    }

    #[inline]
    pub(crate) fn integral(&self, integral: R, taken_in: R) -> R {
        integral + self.ki_dt_output * taken_in
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
        self.derivative_memory * last + self.kd_per_dt * change
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
    pub(crate) fn remembers(&self) -> bool {
        self.remembers
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
    fn per_slope(&self, started: bool) -> R {
        if started {
            self.per_slope
        } else {
            self.per_first_slope
        }
    }

    #[inline]
    pub(crate) fn derivative_slope(&self, started: bool) -> R {
        if started {
            self.kd_per_dt * self.derivative_weight
        } else {
            R::zero()
        }
    }

    /// What anti-windup adds to the integral \[N.m\] for an `excess` of applied over requested output.
    pub(crate) fn correction(&self, law: AntiWindup<R>, taken_in: R, excess: R, started: bool) -> R {
        let zero = R::zero();
        let conditional = || {
            if excess * taken_in < zero {
                -self.ki_dt * taken_in
            } else {
                zero
            }
        };
        match law {
            AntiWindup::None | AntiWindup::Clamp { .. } => zero,
            AntiWindup::Conditional => conditional(),
            AntiWindup::BackCalculation { .. } => self.tracking * excess,
            AntiWindup::Conditioned => {
                let gain = self.ki_dt * self.per_slope(started);
                // An integral that acts one period late must not take back more than the whole excess: it would swing.
                if gain > zero {
                    excess * gain.limited(zero, R::one())
                } else {
                    conditional()
                }
            }
        }
    }

    /// How far the realised reference is from the one asked for \[rad/s\]; 0 but for [`AntiWindup::Conditioned`].
    pub(crate) fn shift(&self, law: AntiWindup<R>, excess: R, started: bool) -> R {
        if law == AntiWindup::Conditioned {
            excess * self.per_slope(started)
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

    pub(crate) fn anti_windup(&self) -> AntiWindup<R> {
        self.anti_windup
    }
}

/// Finite and at most 1e6 in magnitude: what a sensor or a command can mean. NaN is not.
#[inline]
pub(crate) fn is_plausible<R: Real>(value: R) -> bool {
    value.abs() <= R::of(1e6)
}
