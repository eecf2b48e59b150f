//! From a torque to the duty cycle of a bridge.

use super::dc::DcMotor;
use crate::Real;

/// Duty cycle of a bridge without a current loop for a torque, and the result.
///
/// ```
/// use omni_core::motor::{DcMotor, DcMotorConfig};
/// let motor = DcMotor::new(DcMotorConfig {
///     torque_constant_n_m_a: 0.05_f64,
///     resistance_ohm: 2.0,
///     no_load_current_a: 0.1,
///     supply_v: 12.0,
///     current_limit_a: None,
/// })?;
/// // At 220 rad/s the back-EMF leaves 1 V, which drives 0.5 A; friction takes 0.1 A of them.
/// let most = motor.duty(1.0, 220.0);
/// assert!(most.limited && most.duty == 1.0);
/// assert!((most.current_a - 0.5).abs() < 1e-12 && (most.torque_n_m - 0.05 * 0.4).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MotorDuty<R> {
    /// Part of the supply's voltage at the terminals, -1 to 1; positive drives forwards. 0 shorts
    /// the motor, which brakes.
    pub duty: R,
    /// Current that flows with it \[A\], positive forwards.
    pub current_a: R,
    /// Resulting torque at the shaft \[N.m\]: the requested torque, unless limited.
    pub torque_n_m: R,
    /// The supply voltage or the driver's current limit restricts the torque.
    pub limited: bool,
}

impl<R: Real> DcMotor<R> {
    /// The duty for a shaft torque \[N.m\] at a velocity \[rad/s\], `(R i + kt w) / U`, with the current held
    /// within the driver's limit and the duty within -1 to 1. With it the current and the torque that follow.
    /// Steady state: the winding's inductance is left out. For what is not finite duty 0, which counts as limited.
    ///
    /// ```
    /// use omni_core::motor::DcMotor;
    /// # let mut config = omni_core::examples::motor();
    /// config.current_limit_a = Some(3.0);
    /// let motor = DcMotor::new(config)?; // 12 V, 2 ohm, 0.05 N.m/A, 0.1 A, a driver of 3 A
    /// let half = motor.duty(0.045, 84.0);
    /// // 0.045 N.m take 0.9 A and friction 0.1 A: 2 V over the winding, and 4.2 V of back-EMF.
    /// assert!((half.current_a - 1.0).abs() < 1e-12 && (half.duty - 6.2 / 12.0).abs() < 1e-12 && !half.limited);
    /// // At rest the driver holds the current down: 3 A.
    /// let held = motor.duty(1.0, 0.0);
    /// assert!(held.limited && (held.duty - 0.5).abs() < 1e-12 && (held.torque_n_m - 0.15).abs() < 1e-12);
    /// assert_eq!(motor.duty(f64::NAN, 0.0).duty, 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn duty(&self, torque_n_m: R, velocity_rad_s: R) -> MotorDuty<R> {
        let c = self.config();
        let asked = self.current_a(torque_n_m, velocity_rad_s);
        let back_emf = c.torque_constant_n_m_a * velocity_rad_s;
        if !asked.is_finite_real() || !back_emf.is_finite_real() {
            return MotorDuty {
                duty: R::zero(),
                current_a: R::zero(),
                torque_n_m: R::zero(),
                limited: true,
            };
        }
        let held = c.current_limit_a.map_or(asked, |most| asked.limited(-most, most));
        let wanted = (c.resistance_ohm * held + back_emf) / c.supply_v;
        let duty = wanted.limited(-R::one(), R::one());
        let full = duty != wanted;
        let current = if full {
            (duty * c.supply_v - back_emf) / c.resistance_ohm
        } else {
            held
        };
        let limited = full || held != asked;
        let friction = self.current_a(R::zero(), velocity_rad_s);
        MotorDuty {
            duty,
            current_a: current,
            torque_n_m: if limited {
                c.torque_constant_n_m_a * (current - friction)
            } else {
                torque_n_m
            },
            limited,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::Real;
    use crate::motor::{DcMotor, DcMotorConfig};
    use proptest::prelude::*;

    fn motor<R: Real>(current_limit_a: Option<f64>) -> DcMotor<R> {
        DcMotor::new(DcMotorConfig {
            torque_constant_n_m_a: R::of(0.0234),
            resistance_ohm: R::of(2.32),
            no_load_current_a: R::of(0.037),
            supply_v: R::of(24.0),
            current_limit_a: current_limit_a.map(R::of),
        })
        .expect("valid")
    }

    #[test]
    fn what_is_not_finite_gives_no_duty() {
        for bad in [f64::NAN, f64::INFINITY, f64::MAX] {
            for duty in [motor::<f64>(None).duty(bad, 0.0), motor(None).duty(0.0, bad)] {
                assert!(
                    duty.limited && duty.duty.abs() <= 1.0 && !duty.torque_n_m.is_nan(),
                    "{duty:?}"
                );
            }
            let duty = motor::<f32>(Some(1.0)).duty(bad as f32, 1.0);
            assert!(duty.limited && duty.duty.abs() <= 1.0, "{duty:?}");
        }
    }

    proptest! {
        #[test]
        fn within_the_torque_line_the_torque_is_had_and_beyond_it_the_line(
            torque in -0.3..0.3_f64, velocity in -1500.0..1500.0_f64, limit in prop::option::of(0.1..8.0_f64),
        ) {
            let motor = motor::<f64>(limit);
            let sample = motor.duty(torque, velocity);
            prop_assert!((-1.0..=1.0).contains(&sample.duty));
            // The motor's own equations, from the duty: 1e-9 is rounding of sums of up to 60 V.
            let current = (24.0 * sample.duty - 0.0234 * velocity) / 2.32;
            prop_assert!((current - sample.current_a).abs() < 1e-9);
            prop_assert!((motor.current_a(sample.torque_n_m, velocity) - current).abs() < 1e-9);
            // Driving: what the torque line says, as long as the motor is no faster than without load.
            if torque * velocity > 0.0 && velocity.abs() < motor.no_load_speed_rad_s() {
                let range = motor.torque_limit().range(velocity);
                let expected = torque.limited(range.lower_n_m, range.upper_n_m);
                prop_assert!((sample.torque_n_m - expected).abs() < 1e-9, "{sample:?} {expected}");
                prop_assert_eq!(sample.limited, (torque - expected).abs() > 0.0);
            }
            // Single precision does the same to its own rounding, 60 V * 2^-24 over 2.32 ohm and 24 V.
            let single = self::motor::<f32>(limit).duty(torque as f32, velocity as f32);
            prop_assert!((f64::from(single.duty) - sample.duty).abs() < 1e-5 && (f64::from(single.current_a) - sample.current_a).abs() < 1e-4);
        }
    }
}
