//! Eq. (10) and what practice adds to it: one PID loop with the real period fixed at construction.

mod anti_windup;
mod feed_forward;
#[cfg(test)]
mod tests;

use crate::error::{ConfigError, within};
use crate::{Real, TorqueRange};
pub use anti_windup::AntiWindup;
pub use feed_forward::FeedForward;

/// Gains of eq. (10) on an actuator velocity error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains<R> {
    /// Proportional gain k_p \[N.m per rad/s\], 0 to 1e6.
    pub kp_n_m_s_rad: R,
    /// Integral gain k_i \[N.m per rad\], 0 to 1e6.
    pub ki_n_m_rad: R,
    /// Derivative gain k_d \[N.m per rad/s^2\], 0 to 1e6.
    pub kd_n_m_s2_rad: R,
}

/// When the integral takes in the present error. References differ: see docs/conventions.md.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// Eq. (10) and nothing else: whole weights, no filter, no feed-forward, no limits, the integral taken in before the
    /// output and never held back.
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

    /// The same with the derivative of the measurement alone.
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
pub struct Pid<R> {
    kp: R,
    kp_reference: R,
    ki_dt: R,
    ki_dt_output: R,
    kd_per_dt: R,
    derivative_weight: R,
    derivative_memory: R,
    feed_forward: feed_forward::Discrete<R>,
    /// Some term compares with the step before: a derivative or a feed-forward.
    remembers: bool,
    anti_windup: AntiWindup<R>,
    tracking: R,
    output: TorqueRange<R>,
}

/// What a PID loop remembers between steps; `default` is a fresh start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidState<R> {
    /// Integral term \[N.m\].
    pub integral_n_m: R,
    /// Derivative term \[N.m\], after its filter.
    pub derivative_n_m: R,
    /// What the derivative and the feed-forward compare with, none before the first step.
    pub last: Option<LastStep<R>>,
}

/// The step before, as far as a loop needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// The terms of one output \[N.m\].
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// The output asked for: the sum of the four \[N.m\].
    #[must_use]
    pub fn sum(&self) -> R {
        self.p_n_m + self.i_n_m + self.d_n_m + self.ff_n_m
    }
}

/// One step of a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    pub fn new(config: PidConfig<R>) -> Result<Self, ConfigError> {
        let gain = |name, value| within(name, value, 0.0..=1e6, "0 to 1000000");
        let weight = |name, value| within(name, value, 0.0..=1.0, "0 to 1");
        let PidConfig { gains, output, .. } = config;
        let dt = within("period_s", config.period_s, 1e-6..=10.0, "0.000001 to 10")?;
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
        let feed_forward = feed_forward::Discrete::new(&config.feed_forward, dt)?;
        let zero = R::zero();
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
        Ok(Self {
            kp,
            kp_reference,
            ki_dt,
            ki_dt_output,
            // Backward Euler of T d' + d = kd e'.
            kd_per_dt: kd / (filter + dt),
            derivative_weight,
            derivative_memory: filter / (filter + dt),
            feed_forward,
            remembers: kd > zero || config.feed_forward != FeedForward::none(),
            anti_windup: config.anti_windup,
            tracking: config.anti_windup.tracking(dt)?,
            output,
        })
    }

    /// One step: the output that brings `measured_rad_s` to `reference_rad_s`, within the limits of the configuration.
    ///
    /// A reference or measurement that is not finite, or beyond 1e6 rad/s, changes nothing in the state and yields the
    /// integral term alone.
    pub fn step(&self, state: &mut PidState<R>, reference_rad_s: R, measured_rad_s: R) -> PidSample<R> {
        let zero = R::zero();
        if !(is_plausible(reference_rad_s) && is_plausible(measured_rad_s)) {
            let terms = PidTerms {
                p_n_m: zero,
                i_n_m: state.integral_n_m,
                d_n_m: zero,
                ff_n_m: zero,
            };
            return self.limited(terms);
        }
        let error = reference_rad_s - measured_rad_s;
        let terms = self.terms(state, reference_rad_s, measured_rad_s, error);
        let sample = self.limited(terms);
        let excess = sample.output_n_m - terms.sum();
        let correction = self.correction(self.anti_windup, state, error, excess);
        let shift = self.shift(self.anti_windup, state, excess);
        self.commit(state, &terms, reference_rad_s, measured_rad_s, shift);
        state.integral_n_m = self.held(state.integral_n_m + self.ki_dt * error + correction);
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

    /// The terms for a reference and a measurement, where the integral may take in another error than theirs; changes
    /// nothing.
    #[inline]
    pub(crate) fn terms(&self, state: &PidState<R>, reference: R, measured: R, taken_in: R) -> PidTerms<R> {
        let (mut d_n_m, mut ff_n_m) = (R::zero(), R::zero());
        if self.remembers {
            let mut last_reference = reference;
            if let Some(last) = &state.last {
                last_reference = last.reference_rad_s;
                let change =
                    self.derivative_weight * (reference - last_reference) - (measured - last.measured_rad_s);
                d_n_m = self.derivative_memory * state.derivative_n_m + self.kd_per_dt * change;
            }
            ff_n_m = self.feed_forward.torque(reference, last_reference);
        }
        PidTerms {
            p_n_m: self.kp_reference * reference - self.kp * measured,
            i_n_m: state.integral_n_m + self.ki_dt_output * taken_in,
            d_n_m,
            ff_n_m,
        }
    }

    /// How each term changes with the reference \[N.m per rad/s\]; the integral's as if its error changed alike.
    #[inline]
    pub(crate) fn slopes(&self, state: &PidState<R>) -> PidTerms<R> {
        let (mut d_n_m, mut ff_n_m) = (R::zero(), R::zero());
        if self.remembers {
            if state.last.is_some() {
                d_n_m = self.kd_per_dt * self.derivative_weight;
                ff_n_m = self.feed_forward.gain;
            } else {
                ff_n_m = self.feed_forward.gain * (R::one() - self.feed_forward.decay);
            }
        }
        PidTerms {
            p_n_m: self.kp_reference,
            i_n_m: self.ki_dt_output,
            d_n_m,
            ff_n_m,
        }
    }

    /// What anti-windup adds to the integral \[N.m\] for an `excess` of applied over requested output.
    #[inline]
    pub(crate) fn correction(&self, law: AntiWindup<R>, state: &PidState<R>, taken_in: R, excess: R) -> R {
        if excess == R::zero() {
            return R::zero();
        }
        let conditional = || {
            if excess * taken_in < R::zero() {
                -self.ki_dt * taken_in
            } else {
                R::zero()
            }
        };
        match law {
            AntiWindup::None | AntiWindup::Clamp { .. } => R::zero(),
            AntiWindup::Conditional => conditional(),
            AntiWindup::BackCalculation { .. } => self.tracking * excess,
            AntiWindup::Conditioned => {
                let slope = self.slopes(state).sum();
                if slope > R::zero() {
                    self.ki_dt * excess / slope
                } else {
                    conditional()
                }
            }
        }
    }

    /// How far the realised reference is from the one asked for \[rad/s\]; 0 but for [`AntiWindup::Conditioned`].
    #[inline]
    pub(crate) fn shift(&self, law: AntiWindup<R>, state: &PidState<R>, excess: R) -> R {
        if !self.remembers || excess == R::zero() || law != AntiWindup::Conditioned {
            return R::zero();
        }
        let slope = self.slopes(state).sum();
        if slope > R::zero() {
            excess / slope
        } else {
            R::zero()
        }
    }

    /// Remembers what derivative and feed-forward compare with next time; the integral is the caller's.
    #[inline]
    pub(crate) fn commit(
        &self,
        state: &mut PidState<R>,
        used: &PidTerms<R>,
        reference: R,
        measured: R,
        shift: R,
    ) {
        if self.remembers {
            let moved = if state.last.is_some() {
                self.kd_per_dt * self.derivative_weight * shift
            } else {
                R::zero()
            };
            state.derivative_n_m = used.d_n_m + moved;
            state.last = Some(LastStep {
                reference_rad_s: reference + shift,
                measured_rad_s: measured,
            });
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
