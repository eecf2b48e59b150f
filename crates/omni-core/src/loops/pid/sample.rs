//! State of a PID loop, and the sample of one step.

use crate::Real;

/// The state of a PID loop between steps; `default` is a fresh start.
///
/// ```
/// use omni_core::loops::{LastStep, Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
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
    /// What the derivative and the feed-forward compare with: none before the first step, and none
    /// without either unless [`Pid::track`](super::Pid::track) set it.
    pub last: Option<LastStep<R>>,
}

/// The step before, as far as a loop needs it.
///
/// ```
/// use omni_core::loops::{LastStep, Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
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
    /// use omni_core::loops::PidState;
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

/// The terms of one output \[N.m\]: the terms of eq. (10) and the feed-forward.
///
/// ```
/// use omni_core::loops::{Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.5 };
/// let terms = Pid::new(PidConfig::new(gains, 0.25))?.step(&mut PidState::default(), 3.0, 1.0).terms;
/// assert_eq!((terms.p_n_m, terms.i_n_m, terms.d_n_m, terms.ff_n_m), (2.0 * 2.0, 4.0 * 2.0 * 0.25, 0.0, 0.0));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PidTerms<R> {
    /// Proportional term \[N.m\].
    pub p_n_m: R,
    /// Integral term \[N.m\]; the present error is in it under
    /// [`IntegrationOrder::BeforeOutput`](crate::loops::IntegrationOrder::BeforeOutput).
    pub i_n_m: R,
    /// Derivative term \[N.m\].
    pub d_n_m: R,
    /// Feed-forward \[N.m\].
    pub ff_n_m: R,
}

impl<R: Real> PidTerms<R> {
    pub(super) fn integral_alone(i_n_m: R) -> Self {
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
    /// use omni_core::loops::{Pid, PidState};
    /// use omni_core::{PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.0 };
    /// let sample = Pid::new(PidConfig::new(gains, 0.25))?.step(&mut PidState::default(), 3.0, 1.0);
    /// assert_eq!(sample.terms.sum(), 2.0 * 2.0 + 4.0 * 2.0 * 0.25);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn sum(&self) -> R {
        self.p_n_m + self.i_n_m + self.d_n_m + self.ff_n_m
    }
}

/// One step of a loop.
///
/// ```
/// use omni_core::loops::{Pid, PidState};
/// use omni_core::motor::TorqueRange;
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let output = TorqueRange { lower_n_m: -1.0, upper_n_m: 1.0 };
/// let mut config = PidConfig::new(gains, 1e-3);
/// config.output = output;
/// let sample = Pid::new(config)?.step(&mut PidState::default(), 0.0, 3.0);
/// assert_eq!((sample.terms.sum(), sample.output_n_m, sample.saturated), (-2.0 * 3.0, -1.0, true));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PidSample<R> {
    /// The terms.
    pub terms: PidTerms<R>,
    /// Output within the limits \[N.m\].
    pub output_n_m: R,
    /// The limits reduced the output.
    pub saturated: bool,
}
