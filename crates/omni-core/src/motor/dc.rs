//! A brushed DC motor, or a brushless one seen from its quadrature axis, from its data sheet.

use super::limit::TorqueLimit;
use crate::error::{not_negative, positive};
use crate::{ConfigError, Real};

/// Figures of a data sheet; checked by [`DcMotor::new`].
///
/// ```
/// use omni_core::motor::{DcMotor, DcMotorConfig};
/// let sheet = DcMotorConfig {
///     torque_constant_n_m_a: 0.05,
///     resistance_ohm: 2.0,
///     no_load_current_a: 0.1,
///     supply_v: 12.0_f64,
///     current_limit_a: None,
/// };
/// let stall = |config| DcMotor::new(config).expect("valid").torque_limit().range(0.0).upper_n_m;
/// assert!((stall(sheet) - 0.05 * (12.0 / 2.0 - 0.1)).abs() < 1e-12); // 6 A less friction
/// assert!((stall(DcMotorConfig { current_limit_a: Some(2.0), ..sheet }) - 0.05 * (2.0 - 0.1)).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DcMotorConfig<R> {
    /// Torque constant \[N.m/A\], > 0; the same number is the back-EMF constant \[V per rad/s\].
    pub torque_constant_n_m_a: R,
    /// Resistance between the terminals \[ohm\], > 0.
    pub resistance_ohm: R,
    /// No-load current \[A\], >= 0, which overcomes friction.
    pub no_load_current_a: R,
    /// Voltage of the supply \[V\], > 0.
    pub supply_v: R,
    /// Largest current of the driver \[A\], above the no-load current; none: only the resistance limits it.
    pub current_limit_a: Option<R>,
}

/// A motor at its terminals: `U = R i + kt w`, `torque = kt i - kt i0 sgn(w)`.
///
/// ```
/// use omni_core::motor::{DcMotor, DcMotorConfig};
/// let motor = DcMotor::new(DcMotorConfig {
///     torque_constant_n_m_a: 0.0234_f64,
///     resistance_ohm: 2.32,
///     no_load_current_a: 0.037,
///     supply_v: 24.0,
///     current_limit_a: Some(5.0),
/// })?;
/// let limit = motor.torque_limit();
/// assert!((limit.range(0.0).upper_n_m - 0.0234 * (5.0 - 0.037)).abs() < 1e-12); // held down by the driver
/// assert!((motor.no_load_speed_rad_s() - 1021.97).abs() < 0.01); // 9759 rpm
/// assert!(limit.range(1021.9).upper_n_m > 0.0 && limit.range(1022.0).upper_n_m == 0.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DcMotor<R> {
    config: DcMotorConfig<R>,
    limit: TorqueLimit<R>,
}

impl<R: Real> DcMotor<R> {
    /// A motor with these figures.
    ///
    /// # Errors
    /// The field of [`DcMotorConfig`] that is out of range, by its name; `no_load_current_a` at or above what the
    /// supply can drive, `current_limit_a` at or below the no-load current.
    pub fn new(config: DcMotorConfig<R>) -> Result<Self, ConfigError> {
        let kt = positive("torque_constant_n_m_a", config.torque_constant_n_m_a)?;
        let resistance = positive("resistance_ohm", config.resistance_ohm)?;
        let idle = not_negative("no_load_current_a", config.no_load_current_a)?;
        let starting = positive("supply_v", config.supply_v)? / resistance;
        if idle >= starting {
            let allowed = "below supply_v / resistance_ohm, the current at standstill";
            return Err(ConfigError::new("no_load_current_a", idle.as_f64(), allowed));
        }
        let mut limit = TorqueLimit::line(kt * (starting - idle), kt * kt / resistance)?;
        if let Some(most) = config.current_limit_a {
            if positive("current_limit_a", most)? <= idle {
                return Err(ConfigError::new(
                    "current_limit_a",
                    most.as_f64(),
                    "above no_load_current_a",
                ));
            }
            limit = limit.capped(kt * (most - idle))?;
        }
        Ok(Self { config, limit })
    }

    pub(super) fn config(&self) -> &DcMotorConfig<R> {
        &self.config
    }

    /// The torque-speed line at the shaft \[N.m, rad/s\], less friction, capped by the current limit: stall torque
    /// `kt (U / R - i0)`, slope `kt^2 / R`. Braking, friction would help; it is left out, on the safe side.
    ///
    /// ```
    /// use omni_core::motor::DcMotor;
    /// # let config = omni_core::examples::motor();
    /// let limit = DcMotor::new(config)?.torque_limit(); // 12 V, 2 ohm, 0.05 N.m/A, 0.1 A
    /// let at_100_rad_s = 0.05 * (12.0 / 2.0 - 0.1) - 0.05 * 0.05 / 2.0 * 100.0;
    /// assert!((limit.range(100.0).upper_n_m - at_100_rad_s).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn torque_limit(&self) -> TorqueLimit<R> {
        self.limit
    }

    /// Speed without load \[rad/s\], `(U - R i0) / kt`: where the line of [`DcMotor::torque_limit`] ends.
    ///
    /// ```
    /// use omni_core::motor::DcMotor;
    /// # let config = omni_core::examples::motor();
    /// let motor = DcMotor::new(config)?; // 12 V, 2 ohm, 0.05 N.m/A, 0.1 A
    /// assert!((motor.no_load_speed_rad_s() - (12.0 - 2.0 * 0.1) / 0.05).abs() < 1e-9); // 236 rad/s
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn no_load_speed_rad_s(&self) -> R {
        let c = &self.config;
        (c.supply_v - c.resistance_ohm * c.no_load_current_a) / c.torque_constant_n_m_a
    }

    /// Current \[A\] for a shaft torque \[N.m\] at a velocity \[rad/s\], `torque / kt + i0 sgn(w)`: friction included;
    /// positive drives forwards.
    ///
    /// ```
    /// use omni_core::motor::DcMotor;
    /// # let config = omni_core::examples::motor();
    /// let motor = DcMotor::new(config)?; // 0.05 N.m/A, 0.1 A
    /// assert!((motor.current_a(0.1, 50.0) - (2.0 + 0.1)).abs() < 1e-12);
    /// assert!((motor.current_a(0.1, -50.0) - (2.0 - 0.1)).abs() < 1e-12); // it brakes, and friction helps
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn current_a(&self, torque_n_m: R, velocity_rad_s: R) -> R {
        let idle = self.config.no_load_current_a;
        let friction = if velocity_rad_s > R::zero() {
            idle
        } else if velocity_rad_s < R::zero() {
            -idle
        } else {
            R::zero()
        };
        torque_n_m / self.config.torque_constant_n_m_a + friction
    }

    /// Voltage \[V\] at the terminals for a shaft torque \[N.m\] at a velocity \[rad/s\], `R i + kt w`; positive drives
    /// forwards.
    ///
    /// ```
    /// use omni_core::motor::DcMotor;
    /// # let config = omni_core::examples::motor();
    /// let motor = DcMotor::new(config)?; // 2 ohm, 0.05 N.m/A, 0.1 A
    /// assert!((motor.voltage_v(0.1, 100.0) - (2.0 * (2.0 + 0.1) + 0.05 * 100.0)).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn voltage_v(&self, torque_n_m: R, velocity_rad_s: R) -> R {
        let c = &self.config;
        c.resistance_ohm * self.current_a(torque_n_m, velocity_rad_s)
            + c.torque_constant_n_m_a * velocity_rad_s
    }

    /// Electrical power \[W\], `U i`, for a shaft torque \[N.m\] at a velocity \[rad/s\]; negative flows back into the
    /// supply.
    ///
    /// ```
    /// use omni_core::motor::DcMotor;
    /// # let config = omni_core::examples::motor();
    /// let motor = DcMotor::new(config)?; // 2 ohm, 0.05 N.m/A, 0.1 A
    /// // What goes in turns the shaft, heats the winding (2.1 A) and overcomes friction.
    /// let sum = 0.1 * 100.0 + 2.0 * 2.1 * 2.1 + 0.05 * 0.1 * 100.0;
    /// assert!((motor.electrical_power_w(0.1, 100.0) - sum).abs() < 1e-12);
    /// assert!(motor.electrical_power_w(-0.02, 100.0) < 0.0); // gentle braking charges
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn electrical_power_w(&self, torque_n_m: R, velocity_rad_s: R) -> R {
        self.voltage_v(torque_n_m, velocity_rad_s) * self.current_a(torque_n_m, velocity_rad_s)
    }

    /// Heat of the winding \[W\], `R i^2`, for a shaft torque \[N.m\] at a velocity \[rad/s\]; never negative.
    ///
    /// ```
    /// use omni_core::motor::DcMotor;
    /// # let config = omni_core::examples::motor();
    /// let motor = DcMotor::new(config)?; // 2 ohm, 0.05 N.m/A
    /// assert!((motor.heat_w(0.1, 0.0) - 2.0 * 2.0 * 2.0).abs() < 1e-12); // holding 0.1 N.m at rest takes 2 A
    /// assert!((motor.heat_w(-0.2, 0.0) - 4.0 * 8.0).abs() < 1e-12); // twice the torque, four times the heat
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn heat_w(&self, torque_n_m: R, velocity_rad_s: R) -> R {
        let i = self.current_a(torque_n_m, velocity_rad_s);
        self.config.resistance_ohm * i * i
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SHEET: DcMotorConfig<f64> = DcMotorConfig {
        torque_constant_n_m_a: 0.0234,
        resistance_ohm: 2.32,
        no_load_current_a: 0.037,
        supply_v: 24.0,
        current_limit_a: None,
    };

    #[test]
    fn the_line_runs_from_stall_to_no_load() {
        let motor = DcMotor::new(SHEET).expect("valid");
        // Stall: 24 V / 2.32 ohm = 10.345 A, less friction, times 23.4 mN.m/A.
        assert!((motor.torque_limit().range(0.0).upper_n_m - 0.2412).abs() < 1e-4);
        let no_load = motor.no_load_speed_rad_s();
        assert!(
            (motor.voltage_v(0.0, no_load) - 24.0).abs() < 1e-12
                && (motor.current_a(0.0, no_load) - 0.037).abs() < 1e-15
        );
        assert!(motor.torque_limit().range(no_load * 0.999_999).upper_n_m > 0.0);
        assert_eq!(motor.torque_limit().range(no_load * 1.000_001).upper_n_m, 0.0);
        assert_eq!(motor.current_a(0.0234, 0.0), 1.0);
    }

    #[test]
    fn figures_are_checked_by_name() {
        let named = |config| DcMotor::<f64>::new(config).expect_err("refused").parameter;
        assert_eq!(
            named(DcMotorConfig {
                torque_constant_n_m_a: 0.0,
                ..SHEET
            }),
            "torque_constant_n_m_a"
        );
        assert_eq!(
            named(DcMotorConfig {
                resistance_ohm: -1.0,
                ..SHEET
            }),
            "resistance_ohm"
        );
        assert_eq!(
            named(DcMotorConfig {
                no_load_current_a: 11.0,
                ..SHEET
            }),
            "no_load_current_a"
        );
        assert_eq!(
            named(DcMotorConfig {
                supply_v: f64::NAN,
                ..SHEET
            }),
            "supply_v"
        );
        assert_eq!(
            named(DcMotorConfig {
                current_limit_a: Some(0.03),
                ..SHEET
            }),
            "current_limit_a"
        );
    }

    proptest! {
        #[test]
        fn the_limit_is_where_the_supply_or_the_driver_gives_out_and_energy_is_kept(
            velocity in 0.0..1000.0_f64, torque in 0.0..0.2_f64, limit in prop::option::of(0.1..8.0_f64),
        ) {
            let motor = DcMotor::new(DcMotorConfig { current_limit_a: limit, ..SHEET }).expect("valid");
            let most = motor.torque_limit().range(velocity).upper_n_m;
            if velocity > 0.0 && most > 0.0 {
                let by_voltage = (motor.voltage_v(most, velocity) - 24.0).abs() < 1e-9;
                let by_current = limit.is_some_and(|l| (motor.current_a(most, velocity) - l).abs() < 1e-9);
                prop_assert!(by_voltage || by_current);
            }
            // Electrical power is heat, friction and shaft power.
            let friction = if velocity > 0.0 { 0.0234 * 0.037 * velocity } else { 0.0 };
            let sum = motor.heat_w(torque, velocity) + friction + torque * velocity;
            prop_assert!((motor.electrical_power_w(torque, velocity) - sum).abs() < 1e-9); // sums of up to 400 W
        }
    }
}
