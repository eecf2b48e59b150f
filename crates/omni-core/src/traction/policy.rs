//! Traction control behind the interface of all controllers.

use super::model::Traction;
use super::sample::TractionSample;
use super::supervised::{Supervised, SupervisedState};
use super::supervisor::{Supervisor, SupervisorState};
use crate::geometry::BodyTwist;
use crate::loops::{ControlState, Rest, RestRule};
use crate::policy::{Policy, Readings};
use crate::shaping::{TwistLimiter, TwistLimiterState};
use crate::{ConfigError, Real};

/// The state of a [`TractionPolicy`]: to be kept and given back, [`TractionPolicy::state`],
/// [`TractionPolicy::restore`].
///
/// ```
/// use omni_core::traction::TractionPolicyState;
/// assert!(size_of::<TractionPolicyState<f32, 7>>() < 1536); // bytes
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(deserialize = "R: Real + serde::Deserialize<'de>"))
)]
pub struct TractionPolicyState<R, const N: usize> {
    limited: TwistLimiterState<R>,
    supervised: SupervisedState<R, N>,
}

/// A vehicle's limits, a [`Supervisor`], a [`Traction`]: from readings to torques.
///
/// ```
/// use omni_core::traction::TractionPolicy;
/// use omni_core::{BodyTwist, Policy, Readings};
/// # let traction = omni_core::examples::traction()?;
/// # let supervisor = omni_core::examples::supervisor()?;
/// # let limiter = omni_core::examples::limiter(f64::INFINITY)?;
/// let mut policy = TractionPolicy::new(limiter, supervisor, traction);
/// // Sideways to the left from rest: the four wheels of a mecanum vehicle give the same, in the pattern of that way.
/// let (left, mut torques_n_m) = (BodyTwist { vy_m_s: 0.3, ..BodyTwist::ZERO }, [0.0; 4]);
/// policy.step(&Readings::new(left, &[0.0; 4]), &mut torques_n_m);
/// assert!(torques_n_m[0].abs() > 0.0 && torques_n_m.iter().all(|torque| torque.abs() == torques_n_m[0].abs()));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TractionPolicy<R, const N: usize> {
    limiter: TwistLimiter<R>,
    supervisor: Option<Supervisor<R, N>>,
    traction: Traction<R, N>,
    rest: RestRule<R>,
    state: TractionPolicyState<R, N>,
    sample: TractionSample<R, N>,
}

impl<R: Real, const N: usize> TractionPolicyState<R, N> {
    const fn new() -> Self {
        Self {
            limited: TwistLimiterState::new(),
            supervised: SupervisedState::new(),
        }
    }
}

impl<R: Real, const N: usize> TractionPolicyState<R, N> {
    /// A start after a [`ControllerPolicy`](crate::loops::ControllerPolicy) with this state, while
    /// the vehicle moves with `twist`: its command goes on, and so does a hold at rest.
    ///
    /// ```
    /// use omni_core::shaping::TwistLimiterState;
    /// use omni_core::traction::TractionPolicyState;
    /// use omni_core::{BodyTwist, ControlState};
    /// let mut loops = ControlState::<f64, 4>::new();
    /// loops.integral_n_m = [0.3; 4];
    /// let state = TractionPolicyState::after(&(TwistLimiterState::new(), loops), &BodyTwist::ZERO);
    /// assert_eq!(state.loops().1.integral_n_m, [0.0; 4]); // loops start afresh
    /// ```
    #[must_use]
    pub fn after(
        (limited, loops): &(TwistLimiterState<R>, ControlState<R, N>),
        twist: &BodyTwist<R>,
    ) -> Self {
        Self {
            limited: *limited,
            supervised: SupervisedState::after(loops, twist),
        }
    }

    /// The state with which a [`ControllerPolicy`](crate::loops::ControllerPolicy) goes on after this one.
    ///
    /// ```
    /// use omni_core::traction::TractionPolicy;
    /// # let traction = omni_core::examples::traction()?;
    /// # let supervisor = omni_core::examples::supervisor()?;
    /// # let limiter = omni_core::examples::limiter(f64::INFINITY)?;
    /// let policy = TractionPolicy::new(limiter, supervisor, traction);
    /// assert_eq!(policy.state().loops().1.integral_n_m, [0.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn loops(&self) -> (TwistLimiterState<R>, ControlState<R, N>) {
        (self.limited, self.supervised.loops())
    }
}

impl<R: Real, const N: usize> TractionPolicy<R, N> {
    /// Freshly started.
    #[must_use]
    pub fn new(limiter: TwistLimiter<R>, supervisor: Supervisor<R, N>, traction: Traction<R, N>) -> Self {
        Self::with(limiter, Some(supervisor), traction)
    }

    /// Without a supervisor: the target speed is the commanded one, and there is one try.
    ///
    /// ```
    /// use omni_core::traction::TractionPolicy;
    /// use omni_core::{BodyTwist, Policy, Readings};
    /// # let traction = omni_core::examples::traction()?;
    /// # let limiter = omni_core::examples::limiter(f64::INFINITY)?;
    /// let mut policy = TractionPolicy::unsupervised(limiter, traction);
    /// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut [0.0; 4]);
    /// assert_eq!(policy.sample().target_m_s, 0.3); // at once: nothing slows the target
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn unsupervised(limiter: TwistLimiter<R>, traction: Traction<R, N>) -> Self {
        Self::with(limiter, None, traction)
    }

    fn with(
        limiter: TwistLimiter<R>,
        supervisor: Option<Supervisor<R, N>>,
        traction: Traction<R, N>,
    ) -> Self {
        Self {
            limiter,
            supervisor,
            rest: RestRule::usual(traction.period_s()),
            traction,
            state: TractionPolicyState::new(),
            sample: TractionSample::zero(),
        }
    }

    /// The same policy, whose torque ends as `rest` says instead of [`Rest::default`].
    ///
    /// # Errors
    /// As [`WheelController::with_rest`](crate::loops::WheelController::with_rest).
    ///
    /// ```
    /// use omni_core::loops::Rest;
    /// use omni_core::traction::TractionPolicy;
    /// use omni_core::{BodyTwist, Policy, Readings};
    /// # let traction = omni_core::examples::traction()?;
    /// # let supervisor = omni_core::examples::supervisor()?;
    /// # let limiter = omni_core::examples::limiter(f64::INFINITY)?;
    /// let mut rest = Rest::default();
    /// rest.bleed_s = 0.003; // three periods
    /// let mut policy = TractionPolicy::new(limiter, supervisor, traction).with_rest(rest)?;
    /// // Every encoder is stuck at 5 rad/s. The motors have 2 N.m.
    /// let (stuck, mut torques_n_m) = (Readings::new(BodyTwist::ZERO, &[5.0; 4]), [0.0; 4]);
    /// for _ in 0..4 {
    ///     policy.step(&stuck, &mut torques_n_m);
    /// }
    /// assert_eq!(torques_n_m, [0.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn with_rest(self, rest: Rest<R>) -> Result<Self, ConfigError> {
        Ok(Self {
            rest: RestRule::new(rest, self.traction.period_s())?,
            ..self
        })
    }

    /// The law.
    #[must_use]
    pub fn traction(&self) -> &Traction<R, N> {
        &self.traction
    }

    /// The result of the last step.
    #[must_use]
    pub fn sample(&self) -> &TractionSample<R, N> {
        &self.sample
    }

    /// State of the supervisor: phase, retries, row.
    #[must_use]
    pub fn supervisor(&self) -> &SupervisorState<R> {
        &self.state.supervised.supervisor
    }

    /// Its state.
    #[must_use]
    pub fn state(&self) -> &TractionPolicyState<R, N> {
        &self.state
    }

    /// Continues from the state of another one.
    pub fn restore(&mut self, state: TractionPolicyState<R, N>) {
        self.state = state;
    }
}

impl<R: Real, const N: usize> Policy<R> for TractionPolicy<R, N> {
    fn reset(&mut self) {
        self.state = TractionPolicyState::new();
        self.sample = TractionSample::zero();
    }

    fn step(&mut self, readings: &Readings<'_, R>, torques_n_m: &mut [R]) {
        let mut readings = *readings;
        readings.command = self.limiter.step(&mut self.state.limited, &readings.command);
        let supervised = Supervised {
            supervisor: self.supervisor.as_ref(),
            traction: &self.traction,
            rest: self.rest,
            within: None,
            stops: false,
        };
        supervised.step(&mut self.state.supervised, &readings, &mut self.sample);
        for (torque, applied) in torques_n_m.iter_mut().zip(self.sample.wheels.applied.n_m) {
            *torque = applied;
        }
    }

    fn name(&self) -> &str {
        "traction"
    }
}
