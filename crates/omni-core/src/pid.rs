//! Eq. (10): one PID loop with the real period fixed at construction.

use crate::Real;
use crate::error::{ConfigError, not_negative, positive};

/// Gains of eq. (10) on an actuator velocity error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains<R> {
    /// Proportional gain k_p \[N.m per rad/s\], >= 0.
    pub kp_n_m_s_rad: R,
    /// Integral gain k_i \[N.m per rad\], >= 0.
    pub ki_n_m_rad: R,
    /// Derivative gain k_d \[N.m per rad/s^2\], >= 0.
    pub kd_n_m_s2_rad: R,
}

/// A PID loop's constants. What changes from step to step is in [`PidState`].
///
/// Order of a step: the integral takes in the present error first, then the output is formed (implicit Euler). The
/// derivative is the backward difference of the error, zero in the first step.
///
/// ```
/// use omni_core::{Pid, PidGains, PidState};
/// let gains = PidGains { kp_n_m_s_rad: 2.0_f64, ki_n_m_rad: 10.0, kd_n_m_s2_rad: 0.0 };
/// let pid = Pid::new(gains, 0.1)?;
/// let mut state = PidState::default();
/// assert_eq!(pid.step(&mut state, 1.0).sum(), 3.0); // 2 * 1 + 10 * (0.1 * 1)
/// assert_eq!(pid.step(&mut state, 1.0).sum(), 4.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pid<R> {
    kp: R,
    ki_dt: R,
    kd_per_dt: R,
}

/// What a PID loop remembers between steps; `default` is a fresh start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidState<R> {
    /// Integral term \[N.m\].
    pub integral_n_m: R,
    /// Error of the last step \[rad/s\], none before the first.
    pub last_error_rad_s: Option<R>,
}

impl<R: Real> Default for PidState<R> {
    fn default() -> Self {
        Self {
            integral_n_m: R::zero(),
            last_error_rad_s: None,
        }
    }
}

/// The three terms of one output \[N.m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidTerms<R> {
    /// Proportional term \[N.m\].
    pub p_n_m: R,
    /// Integral term \[N.m\], the present error taken in.
    pub i_n_m: R,
    /// Derivative term \[N.m\].
    pub d_n_m: R,
}

impl<R: Real> PidTerms<R> {
    /// The output: the sum of the three \[N.m\].
    #[must_use]
    pub fn sum(&self) -> R {
        self.p_n_m + self.i_n_m + self.d_n_m
    }
}

impl<R: Real> Pid<R> {
    /// A loop with the gains given, stepped every `period_s` > 0 \[s\].
    ///
    /// # Errors
    /// The gain that is negative or not finite, or `period_s`.
    pub fn new(gains: PidGains<R>, period_s: R) -> Result<Self, ConfigError> {
        let period = positive("period_s", period_s)?;
        Ok(Self {
            kp: not_negative("kp_n_m_s_rad", gains.kp_n_m_s_rad)?,
            ki_dt: not_negative("ki_n_m_rad", gains.ki_n_m_rad)? * period,
            kd_per_dt: not_negative("kd_n_m_s2_rad", gains.kd_n_m_s2_rad)? / period,
        })
    }

    /// One step on `error_rad_s` = reference - measured \[rad/s\].
    pub fn step(&self, state: &mut PidState<R>, error_rad_s: R) -> PidTerms<R> {
        let terms = self.terms(state, error_rad_s, error_rad_s);
        Self::commit(state, &terms, error_rad_s);
        terms
    }

    /// The terms for an error, where the integral may take in another error than the rest; changes nothing.
    #[must_use]
    pub fn terms(&self, state: &PidState<R>, error_rad_s: R, integrated_error_rad_s: R) -> PidTerms<R> {
        PidTerms {
            p_n_m: self.kp * error_rad_s,
            i_n_m: state.integral_n_m + self.ki_dt * integrated_error_rad_s,
            d_n_m: state
                .last_error_rad_s
                .map_or(R::zero(), |last| self.kd_per_dt * (error_rad_s - last)),
        }
    }

    /// Change of the output per change of the reference \[N.m per rad/s\], split as `(error's part, integrated error's part)`.
    #[must_use]
    pub fn slopes(&self, state: &PidState<R>) -> (R, R) {
        let d = if state.last_error_rad_s.is_some() {
            self.kd_per_dt
        } else {
            R::zero()
        };
        (self.kp + d, self.ki_dt)
    }

    /// Remembers the terms that were used and the error they were formed from.
    pub fn commit(state: &mut PidState<R>, used: &PidTerms<R>, error_rad_s: R) {
        *state = PidState {
            integral_n_m: used.i_n_m,
            last_error_rad_s: Some(error_rad_s),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_is_equation_10_of_a_ramp_error() {
        let (kp, ki, kd, dt) = (0.3, 2.0, 0.01, 1e-3);
        let pid = Pid::new(
            PidGains {
                kp_n_m_s_rad: kp,
                ki_n_m_rad: ki,
                kd_n_m_s2_rad: kd,
            },
            dt,
        )
        .expect("valid");
        let mut state = PidState::default();
        let slope = 5.0;
        let mut terms = pid.step(&mut state, 0.0);
        let steps = 1000;
        for k in 1..=steps {
            terms = pid.step(&mut state, slope * dt * f64::from(k));
        }
        let t = dt * f64::from(steps);
        assert!((terms.p_n_m - kp * slope * t).abs() < 1e-12);
        // The right-hand rectangle rule overestimates the integral of a ramp by half a step of its last height.
        assert!((terms.i_n_m - ki * slope * t * (t + dt) / 2.0).abs() < 1e-12);
        assert!((terms.d_n_m - kd * slope).abs() < 1e-12);
    }

    #[test]
    fn first_step_has_no_derivative_kick() {
        let pid = Pid::new(
            PidGains {
                kp_n_m_s_rad: 0.0,
                ki_n_m_rad: 0.0,
                kd_n_m_s2_rad: 1.0,
            },
            1e-3,
        )
        .expect("valid");
        let mut state = PidState::default();
        assert_eq!(pid.step(&mut state, 7.0).sum(), 0.0);
        assert!((pid.step(&mut state, 7.5).sum() - 500.0_f64).abs() < 1e-9);
    }

    #[test]
    fn gains_and_period_are_checked_by_name() {
        let good = PidGains {
            kp_n_m_s_rad: 0.3,
            ki_n_m_rad: 2.0,
            kd_n_m_s2_rad: 0.0,
        };
        let named = |gains, period| Pid::<f64>::new(gains, period).expect_err("refused").parameter;
        assert_eq!(
            named(
                PidGains {
                    kp_n_m_s_rad: -1.0,
                    ..good
                },
                1e-3
            ),
            "kp_n_m_s_rad"
        );
        assert_eq!(
            named(
                PidGains {
                    ki_n_m_rad: f64::NAN,
                    ..good
                },
                1e-3
            ),
            "ki_n_m_rad"
        );
        assert_eq!(
            named(
                PidGains {
                    kd_n_m_s2_rad: f64::INFINITY,
                    ..good
                },
                1e-3
            ),
            "kd_n_m_s2_rad"
        );
        assert_eq!(named(good, 0.0), "period_s");
    }
}
