//! Losses of a gear: dry and viscous friction besides its efficiency.

use super::gearbox::Gearbox;
use crate::error::not_negative;
use crate::motor::TorqueRange;
use crate::{ConfigError, Real};

/// A gear with an efficiency, and friction at its output: dry (Coulomb, equal at every speed, and static) and viscous.
///
/// The plant of the simulation is built on it. For a controller it says which motor torque makes up
/// for friction: feed-forward.
///
/// ```
/// use omni_core::motor::{GearFriction, Gearbox};
/// let gear = GearFriction::new(Gearbox::new(20.0_f64, 0.8)?, 0.04, 0.002)?; // 20:1, 0.04 N.m, 0.002 N.m.s/rad
/// // 0.1 N.m of the motor are 1.6 behind the teeth; at 10 rad/s friction takes 0.04 + 0.02.
/// assert!((gear.output_torque(0.1, 10.0) - 1.54).abs() < 1e-12);
/// assert!((gear.motor_torque(1.54, 10.0) - 0.1).abs() < 1e-12);
/// assert_eq!(gear.output_torque(0.002, 0.0), 0.0); // 0.032 N.m move nothing
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GearFriction<R> {
    gear: Gearbox<R>,
    coulomb_n_m: R,
    viscous_n_m_s_rad: R,
}

impl<R: Real> GearFriction<R> {
    /// A gear with friction at its output: `coulomb_n_m` >= 0 \[N.m\] and `viscous_n_m_s_rad` >= 0 \[N.m per rad/s\].
    ///
    /// # Errors
    /// Parameter `coulomb_n_m` or `viscous_n_m_s_rad` if it is negative or not finite.
    pub fn new(gear: Gearbox<R>, coulomb_n_m: R, viscous_n_m_s_rad: R) -> Result<Self, ConfigError> {
        Ok(Self {
            gear,
            coulomb_n_m: not_negative("coulomb_n_m", coulomb_n_m)?,
            viscous_n_m_s_rad: not_negative("viscous_n_m_s_rad", viscous_n_m_s_rad)?,
        })
    }

    /// Viscous friction at the output \[N.m per rad/s\].
    #[must_use]
    pub fn viscous_n_m_s_rad(&self) -> R {
        self.viscous_n_m_s_rad
    }

    /// Torques at the output \[N.m\] between which a motor torque \[N.m\] holds the gear still: a load within them
    /// turns nothing. Turning forwards the lower one acts, turning backwards the upper one, each less viscous friction.
    ///
    /// An efficiency is friction that grows with the torque on the teeth: between driving, `efficiency` times
    /// the lossless torque, and being driven, the lossless torque over the efficiency, the gear stands.
    ///
    /// ```
    /// use omni_core::motor::{GearFriction, Gearbox, TorqueRange};
    /// let gear = GearFriction::new(Gearbox::new(10.0, 0.5)?, 0.25, 0.0)?;
    /// // 0.1 N.m: 1 lossless, 0.5 driving, 2 driven.
    /// assert_eq!(gear.holding(0.1), TorqueRange { lower_n_m: 0.5 - 0.25, upper_n_m: 2.0 + 0.25 });
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn holding(&self, motor_n_m: R) -> TorqueRange<R> {
        TorqueRange {
            lower_n_m: self.gear.output_torque(motor_n_m, R::one()) - self.coulomb_n_m,
            upper_n_m: self.gear.output_torque(motor_n_m, -R::one()) + self.coulomb_n_m,
        }
    }

    /// Torque at the output \[N.m\] that a motor torque \[N.m\] makes at an output velocity
    /// \[rad/s\]. At rest: the torque beyond friction, the motor driving; 0 if it moves nothing.
    ///
    /// ```
    /// use omni_core::motor::{GearFriction, Gearbox};
    /// let gear = GearFriction::new(Gearbox::new(10.0, 0.5)?, 0.25, 0.125)?;
    /// // Driving forwards, at rest, driven backwards.
    /// assert_eq!([2.0, 0.0, -2.0].map(|w| gear.output_torque(0.1, w)), [0.5 - 0.25 - 0.25, 0.25, 2.0 + 0.25 + 0.25]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn output_torque(&self, motor_n_m: R, output_rad_s: R) -> R {
        let zero = R::zero();
        let TorqueRange {
            lower_n_m: forwards,
            upper_n_m: backwards,
        } = self.holding(motor_n_m);
        let viscous = self.viscous_n_m_s_rad * output_rad_s;
        let still = output_rad_s == zero;
        if output_rad_s > zero || (still && forwards > zero) {
            forwards - viscous
        } else if output_rad_s < zero || (still && backwards < zero) {
            backwards - viscous
        } else {
            zero
        }
    }

    /// Motor torque \[N.m\] for a torque at the output \[N.m\] at an output velocity \[rad/s\]: the
    /// inverse of [`GearFriction::output_torque`], and the feed-forward of friction. At rest: the torque that moves the
    /// gear and leaves this torque; 0 for 0.
    ///
    /// Give it the velocity of the reference: the sign of a measured one chatters about rest.
    ///
    /// ```
    /// use omni_core::motor::{GearFriction, Gearbox};
    /// let gear = GearFriction::new(Gearbox::new(10.0, 0.5)?, 0.25, 0.125)?;
    /// assert_eq!(gear.motor_torque(0.0, 2.0), (0.25 + 0.25) / 10.0 / 0.5); // rolling on
    /// assert_eq!([1.0, 0.0, -1.0].map(|n_m| gear.motor_torque(n_m, 0.0)), [0.25, 0.0, -0.25]); // from rest
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn motor_torque(&self, output_n_m: R, output_rad_s: R) -> R {
        let zero = R::zero();
        let ahead = output_rad_s > zero || (output_rad_s == zero && output_n_m > zero);
        let back = output_rad_s < zero || (output_rad_s == zero && output_n_m < zero);
        let coulomb = if ahead {
            self.coulomb_n_m
        } else if back {
            -self.coulomb_n_m
        } else {
            zero
        };
        self.gear.motor_torque(
            output_n_m + self.viscous_n_m_s_rad * output_rad_s + coulomb,
            output_rad_s,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn friction_takes_energy_holds_at_rest_and_is_undone_exactly(
            ratio in 0.01..500.0_f64, efficiency in 0.05..1.0_f64, coulomb in 0.0..1.0_f64, viscous in 0.0..0.1_f64,
            torque in -2.0..2.0_f64, velocity in -30.0..30.0_f64,
        ) {
            let gear = Gearbox::new(ratio, efficiency).expect("valid");
            let friction = GearFriction::new(gear, coulomb, viscous).expect("valid");
            let output = friction.output_torque(torque, velocity);
            let (motor_w, output_w) = (torque * gear.motor_velocity(velocity), output * velocity);
            // Minimum friction: the dry part. Rounding of the largest term.
            let rounding = 1e-14 * (motor_w.abs() / efficiency + output_w.abs() + 1.0);
            prop_assert!(motor_w - output_w >= coulomb * velocity.abs() + viscous * velocity * velocity - rounding);
            let back = friction.motor_torque(output, velocity);
            prop_assert!((back - torque).abs() <= 1e-13 * (torque.abs() + (coulomb + viscous * 30.0) / ratio / efficiency));
            // At rest nothing turns by itself: no torque at the output comes of one that is within friction.
            let range = friction.holding(torque);
            prop_assert!(range.lower_n_m <= range.upper_n_m);
            let still = friction.output_torque(torque, 0.0);
            prop_assert!(still.abs() <= (torque * ratio).abs() * efficiency);
            if (torque * ratio).abs() * efficiency <= coulomb {
                prop_assert_eq!(still, 0.0);
            }
            // Without friction it is the gearbox.
            let bare = GearFriction::new(gear, 0.0, 0.0).expect("valid");
            prop_assert_eq!(bare.output_torque(torque, velocity), gear.output_torque(torque, velocity));
            prop_assert_eq!(bare.motor_torque(torque, velocity), gear.motor_torque(torque, velocity));
        }
    }

    #[test]
    fn figures_are_checked_by_name() {
        let gear = Gearbox::new(10.0_f32, 0.5).expect("valid");
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            let named = |coulomb, viscous| {
                GearFriction::new(gear, coulomb, viscous)
                    .expect_err("refused")
                    .parameter
            };
            assert_eq!(
                (named(bad, 0.0), named(0.0, bad)),
                ("coulomb_n_m", "viscous_n_m_s_rad")
            );
        }
    }
}
