//! Treatment of an integral while the output differs from its loop's request.

use crate::constants::constant_enum;
use crate::error::within;
use crate::{ConfigError, Real};

/// Method that prevents windup of a saturated loop's integral.
///
/// `excess` below is the output as applied minus the output as asked for: not zero only while something, a
/// limit or a coordination law, changed the output. In a [`WheelController`](crate::loops::WheelController)
/// it counts from the eighth period in a row beyond the same limit ([`Overload`](crate::loops::Overload)),
/// also for wheels scaled with it; in a [`Pid`](crate::loops::Pid) at once. Under
/// [`Saturation::ScaleReferences`](crate::loops::Saturation::ScaleReferences) the law is `Conditioned` whatever is set
/// here; `Clamp` also limits the integrals there.
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
    /// Nothing: The integral accumulates every error. Overshoots after every saturation.
    None,
    /// The integral is held within +-`limit_n_m` after each step. With
    /// [`IntegrationOrder::BeforeOutput`](crate::loops::IntegrationOrder) the term of a step may be
    /// larger by that step's `ki T e`.
    Clamp {
        /// Largest integral \[N.m\], 0 to 1e9.
        limit_n_m: R,
    },
    /// The integral rejects errors that would drive a saturated output further out (conditional integration).
    Conditional,
    /// The integral follows the applied output: `I' = ki e + excess / T` (Fertik and Ross).
    BackCalculation {
        /// Tracking time constant T \[s\], the control period to 1e6: smaller forgets faster. A
        /// usual choice is kp / ki.
        tracking_time_s: R,
    },
    /// The loop sees the reference with which its output would just have been the applied one, in every term (Hanus'
    /// conditioned controller). No parameter. Acts as [`AntiWindup::Conditional`] if the reference affects no term.
    Conditioned,
}

constant_enum!(AntiWindup<R> { None, Clamp { limit_n_m }, Conditional, BackCalculation { tracking_time_s }, Conditioned });

impl<R: Real> AntiWindup<R> {
    /// The share of an excess that back-calculation returns each period, 0 for the other laws.
    pub(super) fn checked_tracking_part(&self, period: R) -> Result<R, ConfigError> {
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

/// Fraction of an excess that a conditioned integral removes; 0 if it stops instead. Integral and derivative act one
/// period late: together they must not remove more than the whole excess, because they would oscillate.
///
/// With g = ki T / slope and the part rho = 1 - (slope of the derivative) / slope that is left for
/// the integral, the result is min(g, rho) where g <= rho (0.1 % more for rounding), or if the derivative takes back at
/// most half; otherwise 0.
pub(super) fn back_calculation_gain<R: Real>(ki_dt: R, inverse_slope: R, derivative_slope: R) -> R {
    let (gain, room) = (ki_dt * inverse_slope, R::one() - derivative_slope * inverse_slope);
    if gain <= R::of(1.001) * room || room >= R::of(0.5) {
        gain.limited(R::zero(), room)
    } else {
        R::zero()
    }
}
