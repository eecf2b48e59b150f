//! Feed-forward: the torque that a reference requires without any error.

use crate::constants::constant_struct;
use crate::error::within;
use crate::{ConfigError, Real};

/// Torque that holds and changes a velocity known in advance: static friction, viscous friction, inertia.
///
/// `u = ks sgn(r) + (r - a r_last) / b`, the exact inverse of `ka w' = u - kv w` over one period with the torque held:
/// `a = exp(-kv dt / ka)`, `b = (1 - a) / kv` (de Villiers' discretisation of a motor's equation). `ka = 0` leaves
/// `ks sgn(r) + kv r`; `kv = 0` leaves `ks sgn(r) + ka (r - r_last) / dt`.
///
/// ```
/// use omni_core::loops::{FeedForward, Pid, PidState};
/// use omni_core::{PidConfig, PidGains};
/// let ff = FeedForward { static_n_m: 0.5_f64, velocity_n_m_s_rad: 3.0, acceleration_n_m_s2_rad: 0.6 };
/// let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let mut config = PidConfig::new(gains, 0.02);
/// config.feed_forward = ff;
/// let (pid, mut state) = (Pid::new(config)?, PidState::default());
/// pid.step(&mut state, 2.0, 2.0);
/// assert!((pid.step(&mut state, 3.0, 2.0).output_n_m - 38.025).abs() < 1e-4); // from 2 to 3 rad/s within 20 ms
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FeedForward<R> {
    /// Static friction ks \[N.m\], 0 to 1e6: applied in the direction of the reference, nothing at rest.
    pub static_n_m: R,
    /// Viscous friction kv \[N.m per rad/s\], 0 to 1e6.
    pub velocity_n_m_s_rad: R,
    /// Inertia ka \[N.m per rad/s^2\], 0 to 1e6.
    pub acceleration_n_m_s2_rad: R,
}

impl<R: Real> FeedForward<R> {
    /// None: every coefficient 0.
    ///
    /// ```
    /// use omni_core::loops::{FeedForward, Pid, PidState};
    /// use omni_core::{PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// let mut config = PidConfig::new(gains, 1e-3);
    /// config.feed_forward = FeedForward::none(); // what it is anyway
    /// let pid = Pid::new(config)?;
    /// assert_eq!(pid.step(&mut PidState::default(), 5.0, 5.0).output_n_m, 0.0); // no error, no torque
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn none() -> Self {
        Self {
            static_n_m: R::zero(),
            velocity_n_m_s_rad: R::zero(),
            acceleration_n_m_s2_rad: R::zero(),
        }
    }
}

/// [`FeedForward`] for one period: `ks sgn(r) + gain (r - decay r_last)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Discrete<R> {
    pub(super) static_n_m: R,
    pub(super) gain: R,
    pub(super) decay: R,
}

constant_struct!(Discrete<R> { static_n_m: R, gain: R, decay: R });

impl<R: Real> Discrete<R> {
    pub(super) fn new(ff: &FeedForward<R>, period: R) -> Result<Self, ConfigError> {
        let coefficient = |name, value| within(name, value, 0.0..=1e6, "0 to 1000000");
        let static_n_m = coefficient("static_n_m", ff.static_n_m)?;
        let kv = coefficient("velocity_n_m_s_rad", ff.velocity_n_m_s_rad)?;
        let ka = coefficient("acceleration_n_m_s2_rad", ff.acceleration_n_m_s2_rad)?;
        let zero = R::zero();
        let (gain, decay) = if ka == zero {
            (kv, zero)
        } else {
            // kv dt / ka below the precision is no friction at all; exp_m1 keeps the digits of a small one.
            let lost = -(-kv * period / ka).exp_m1();
            if lost > R::default_epsilon() {
                (kv / lost, R::one() - lost)
            } else {
                (ka / period, R::one())
            }
        };
        // ka / dt grows without bound as the period shrinks: keep outputs finite.
        within(
            "acceleration_n_m_s2_rad / period",
            gain,
            0.0..=1e12,
            "0 to 1e12 N.m per rad/s",
        )?;
        Ok(Self {
            static_n_m,
            gain,
            decay,
        })
    }

    /// Torque for `reference`, `last` being the one before.
    #[inline]
    pub(super) fn torque(&self, reference: R, last: R) -> R {
        let friction = if reference > R::zero() {
            self.static_n_m
        } else if reference < R::zero() {
            -self.static_n_m
        } else {
            R::zero()
        };
        friction + self.gain * (reference - self.decay * last)
    }
}
