//! A gear with losses.

use crate::error::within;
use crate::motor::TorqueRange;
use crate::{ConfigError, Real};

/// A reduction with an efficiency. Losses act against the flow of power: driving, the output torque is less than the
/// motor's; driven by the load, the motor holds more than its torque.
///
/// For a model that has torque limits at the wheel. [`crate::geometry::Wheel::geared`] needs only
/// the ratio of velocities.
///
/// ```
/// use omni_core::motor::Gearbox;
/// let gear = Gearbox::new(20.0_f64, 0.8)?;
/// assert_eq!(gear.output_torque(0.1, 5.0), 1.6); // 0.1 * 20 * 0.8: the motor drives
/// assert_eq!(gear.output_torque(-0.1, 5.0), -2.5); // it brakes with the gear's friction helping
/// assert!((gear.motor_torque(1.6, 5.0) - 0.1).abs() < 1e-15);
/// assert_eq!(gear.motor_velocity(5.0), 100.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gearbox<R> {
    ratio: R,
    efficiency: R,
}

impl<R: Real> Gearbox<R> {
    /// `ratio` turns of the motor for one of the output, 0.001 to 1e6; `efficiency` 0.01 to 1 in both directions.
    ///
    /// # Errors
    /// Parameter `ratio` or `efficiency` if it is out of range.
    pub fn new(ratio: R, efficiency: R) -> Result<Self, ConfigError> {
        Ok(Self {
            ratio: within("ratio", ratio, 1e-3..=1e6, "0.001 to 1e6")?,
            efficiency: within("efficiency", efficiency, 0.01..=1.0, "0.01 to 1")?,
        })
    }

    /// Motor velocity \[rad/s\] at an output velocity \[rad/s\].
    ///
    /// ```
    /// use omni_core::motor::Gearbox;
    /// assert_eq!(Gearbox::new(20.0, 0.8)?.motor_velocity(-1.5), -30.0); // losses cost torque, not velocity
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn motor_velocity(&self, output_rad_s: R) -> R {
        output_rad_s * self.ratio
    }

    /// Torque at the output \[N.m\] that a motor torque \[N.m\] holds at an output velocity
    /// \[rad/s\]. At rest the motor counts as driving.
    ///
    /// ```
    /// use omni_core::motor::Gearbox;
    /// let gear = Gearbox::new(10.0, 0.5)?;
    /// assert_eq!([2.0, 0.0, -2.0].map(|velocity| gear.output_torque(0.25, velocity)), [1.25, 1.25, 5.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn output_torque(&self, motor_n_m: R, output_rad_s: R) -> R {
        let lossless = motor_n_m * self.ratio;
        if self.is_back_driven(motor_n_m, output_rad_s) {
            lossless / self.efficiency
        } else {
            lossless * self.efficiency
        }
    }

    /// The inverse of [`Gearbox::output_torque`]: motor torque \[N.m\] for an output torque \[N.m\] at an output
    /// velocity \[rad/s\].
    ///
    /// ```
    /// use omni_core::motor::Gearbox;
    /// let gear = Gearbox::new(10.0, 0.5)?;
    /// assert_eq!(gear.motor_torque(1.25, 2.0), 1.25 / 10.0 / 0.5); // lifting a load
    /// assert_eq!(gear.motor_torque(1.25, -2.0), 1.25 / 10.0 * 0.5); // letting it down takes a quarter of that
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn motor_torque(&self, output_n_m: R, output_rad_s: R) -> R {
        let lossless = output_n_m / self.ratio;
        if self.is_back_driven(output_n_m, output_rad_s) {
            lossless * self.efficiency
        } else {
            lossless / self.efficiency
        }
    }

    /// A motor's torque range at the output, at an output velocity \[rad/s\]: ask the motor at
    /// [`Gearbox::motor_velocity`].
    ///
    /// ```
    /// use omni_core::motor::{Gearbox, TorqueRange};
    /// use omni_core::TorqueLimit;
    /// let (gear, motor) = (Gearbox::new(10.0, 0.5)?, TorqueLimit::line(1.0, 0.025)?);
    /// // At 2 rad/s the motor turns with 20 and drives with 0.5 N.m, 2.5 behind the gear. It brakes with 1, there 20.
    /// let range = gear.output_range(&motor.range(gear.motor_velocity(2.0)), 2.0);
    /// assert_eq!(range, TorqueRange { lower_n_m: -1.0 * 10.0 / 0.5, upper_n_m: 0.5 * 10.0 * 0.5 });
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn output_range(&self, motor: &TorqueRange<R>, output_rad_s: R) -> TorqueRange<R> {
        TorqueRange {
            lower_n_m: self.output_torque(motor.lower_n_m, output_rad_s),
            upper_n_m: self.output_torque(motor.upper_n_m, output_rad_s),
        }
    }

    /// Whether power flows from the load to the motor.
    fn is_back_driven(&self, torque: R, velocity: R) -> bool {
        (torque > R::zero() && velocity < R::zero()) || (torque < R::zero() && velocity > R::zero())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn figures_are_checked_by_name() {
        assert_eq!(Gearbox::new(0.0, 0.9).expect_err("refused").parameter, "ratio");
        for bad in [0.0, 1.01, f64::NAN] {
            assert_eq!(
                Gearbox::new(10.0, bad).expect_err("refused").parameter,
                "efficiency"
            );
        }
    }

    proptest! {
        #[test]
        fn a_gear_makes_no_energy_and_is_undone_exactly(
            ratio in 0.01..500.0_f64, efficiency in 0.05..1.0_f64, torque in -2.0..2.0_f64, velocity in -30.0..30.0_f64,
        ) {
            let gear = Gearbox::new(ratio, efficiency).expect("valid");
            let output = gear.output_torque(torque, velocity);
            let (motor_w, output_w) = (torque * gear.motor_velocity(velocity), output * velocity);
            // Driving: less comes out. Braking: the load supplies more than arrives (both negative).
            prop_assert!(output_w <= motor_w * (1.0 + 1e-15 * motor_w.signum()));
            prop_assert!((gear.motor_torque(output, velocity) - torque).abs() <= 1e-15 * torque.abs() * 4.0);
            let range = gear.output_range(&TorqueRange { lower_n_m: -torque.abs(), upper_n_m: torque.abs() }, velocity);
            prop_assert!(range.lower_n_m <= 0.0 && range.upper_n_m >= 0.0);
        }
    }
}
