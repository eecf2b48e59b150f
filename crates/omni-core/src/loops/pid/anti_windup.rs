//! What an integral does while the output is not what its loop asked for.

use super::Pid;
use crate::constants::constant_enum;
use crate::error::within;
use crate::{ConfigError, Real};

/// How the integral of a saturated loop is kept from winding up.
///
/// `excess` below is the output as applied minus the output as asked for: not zero only while something, a limit or a
/// coordination law, changed the output.
///
/// ```
/// use omni_core::loops::{AntiWindup, Pid, PidState};
/// use omni_core::motor::TorqueRange;
/// use omni_core::{PidConfig, PidGains};
/// let gains = PidGains { kp_n_m_s_rad: 1.0_f64, ki_n_m_rad: 1.0, kd_n_m_s2_rad: 0.0 };
/// let output = TorqueRange { lower_n_m: -1.0, upper_n_m: 1.0 };
/// let integral_after_1_s_at_the_limit = |anti_windup| {
///     let mut config = PidConfig::new(gains, 0.001);
///     (config.anti_windup, config.output) = (anti_windup, output);
///     let (pid, mut state) = (Pid::new(config).expect("valid"), PidState::default());
///     for _ in 0..1000 {
///         pid.step(&mut state, 10.0, 0.0);
///     }
///     state.integral_n_m
/// };
/// assert!((integral_after_1_s_at_the_limit(AntiWindup::None) - 10.0).abs() < 1e-9); // ten times the limit
/// assert_eq!(integral_after_1_s_at_the_limit(AntiWindup::Clamp { limit_n_m: 1.0 }), 1.0);
/// assert_eq!(integral_after_1_s_at_the_limit(AntiWindup::Conditional), 0.0); // the first error alone saturates
/// // Conditioned: the loop assumes that it was asked for what it could do, and its error is that of 1 rad/s or less.
/// assert!(integral_after_1_s_at_the_limit(AntiWindup::Conditioned) < 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C, u8)]
#[non_exhaustive]
pub enum AntiWindup<R> {
    /// Nothing: the integral takes in every error. Overshoots after every saturation.
    None,
    /// The integral term itself is held within +-`limit_n_m`.
    Clamp {
        /// Largest integral term \[N.m\], 0 to 1e9.
        limit_n_m: R,
    },
    /// No error is taken in that would drive a saturated output further out (conditional integration).
    Conditional,
    /// The integral follows the applied output: `I' = ki e + excess / T` (Fertik and Ross).
    BackCalculation {
        /// Tracking time constant T \[s\], the control period to 1e6: smaller forgets faster. A usual choice is kp / ki.
        tracking_time_s: R,
    },
    /// The loop sees the reference with which its output would just have been the applied one, in every term (Hanus'
    /// conditioned controller). No parameter. Acts as [`AntiWindup::Conditional`] where the reference moves no term.
    Conditioned,
}

constant_enum!(AntiWindup<R> { None, Clamp { limit_n_m }, Conditional, BackCalculation { tracking_time_s }, Conditioned });

impl<R: Real> AntiWindup<R> {
    /// The share of an excess that back-calculation gives back each period, 0 for the other laws.
    pub(super) fn tracking(&self, period: R) -> Result<R, ConfigError> {
        match *self {
            Self::Clamp { limit_n_m } => {
                within("limit_n_m", limit_n_m, 0.0..=1e9, "0 to 1e9")?;
                Ok(R::zero())
            }
            Self::BackCalculation { tracking_time_s } => {
                if tracking_time_s >= period && tracking_time_s <= R::of(1e6) {
                    Ok(period / tracking_time_s)
                } else {
                    let allowed = "the control period to 1e6";
                    Err(ConfigError::new(
                        "tracking_time_s",
                        tracking_time_s.as_f64(),
                        allowed,
                    ))
                }
            }
            _ => Ok(R::zero()),
        }
    }
}

/// `1 / slope`; 0 for next to nothing, whose reciprocal would be beyond every number.
pub(super) fn reciprocal<R: Real>(slope: R) -> R {
    if slope > R::of(1e-9) {
        R::one() / slope
    } else {
        R::zero()
    }
}

/// Part of an excess that a conditioned integral takes back; 0 where it stops instead. Integral and derivative act one period
/// late: together they must not take back more than the whole excess, they would swing.
pub(super) fn back_calculation_gain<R: Real>(ki_dt: R, per_slope: R, derivative_slope: R) -> R {
    let (gain, room) = (ki_dt * per_slope, R::one() - derivative_slope * per_slope);
    if gain <= R::of(1.001) * room || room >= R::of(0.5) {
        gain.limited(R::zero(), room)
    } else {
        R::zero()
    }
}

/// What a loop gave beyond what it asked for, and what it asked for with its proportional term.
pub(crate) struct Excess<R> {
    /// Applied less requested output \[N.m\].
    pub(crate) excess_n_m: R,
    /// The proportional term \[N.m\].
    pub(crate) p_n_m: R,
    /// What it were without its limit \[N.m\].
    pub(crate) unbounded_p_n_m: R,
}

impl<R: Real> Pid<R> {
    /// Part of an excess that the integral takes back, where that is all there is to do: the law is
    /// [`AntiWindup::Conditioned`], nothing is remembered or bounded, and the integral need not stop instead.
    #[inline]
    pub(crate) fn plain_gain(&self, law: AntiWindup<R>) -> Option<R> {
        let gain = self.first_conditioned_gain;
        let plain = !self.remembers && !self.bounds.any;
        (law == AntiWindup::Conditioned && plain && gain > R::zero()).then_some(gain)
    }

    /// What anti-windup adds to the integral \[N.m\] for an excess, and how far the realised reference is from the one asked for
    /// \[rad/s\]: 0 but for [`AntiWindup::Conditioned`].
    pub(crate) fn correction(
        &self,
        law: AntiWindup<R>,
        integrated_error: R,
        excess: &Excess<R>,
        started: bool,
    ) -> (R, R) {
        let zero = R::zero();
        let beyond = excess.excess_n_m;
        let conditional = || {
            if beyond * integrated_error < zero {
                -self.ki_dt * integrated_error
            } else {
                zero
            }
        };
        match law {
            AntiWindup::None | AntiWindup::Clamp { .. } => (zero, zero),
            AntiWindup::Conditional => (conditional(), zero),
            AntiWindup::BackCalculation { .. } => {
                let over = excess.unbounded_p_n_m - excess.p_n_m;
                let correction = self.tracking * beyond;
                // What the proportional term does not show of an error, the integral does not see either. Otherwise it would
                // settle that much beyond the limit of the output.
                let unseen = if over * beyond < zero {
                    self.ki_dt * over / self.kp
                } else {
                    zero
                };
                (correction - unseen, zero)
            }
            AntiWindup::Conditioned => {
                let (shift, gain, whole) = self.realised(excess, started);
                if gain > zero {
                    (whole * gain, shift)
                } else {
                    (conditional(), shift)
                }
            }
        }
    }

    /// Shift of the reference \[rad/s\] with which the output would have been the applied one, the integral's part of the change
    /// of the output that goes with it, and that change \[N.m\].
    fn realised(&self, excess: &Excess<R>, started: bool) -> (R, R, R) {
        let (per_slope, gain) = if started {
            (self.per_slope, self.conditioned_gain)
        } else {
            (self.per_first_slope, self.first_conditioned_gain)
        };
        if !self.bounds.any {
            return (excess.excess_n_m * per_slope, gain, excess.excess_n_m);
        }
        if excess.excess_n_m == R::zero() {
            return (R::zero(), gain, R::zero());
        }
        // As if the term had no limit there.
        let free = excess.excess_n_m + (excess.p_n_m - excess.unbounded_p_n_m);
        let shift = free * per_slope;
        let p_n_m = excess.unbounded_p_n_m + self.kp_reference * shift;
        let bounded = self.bounds.proportional(p_n_m);
        if bounded == p_n_m {
            return (shift, gain, free);
        }
        // At its limit there: the other terms have to make the change.
        let slopes = self.term_slopes(started);
        let rest = slopes.i_n_m + (slopes.d_n_m + slopes.ff_n_m);
        let change = excess.excess_n_m + (excess.p_n_m - bounded);
        let per_rest = reciprocal(rest);
        let gain = back_calculation_gain(self.ki_dt, per_rest, self.derivative_slope(started));
        (change * per_rest, gain, change)
    }
}
