//! When a reading counts as wrong.

use crate::Real;
use crate::constants::constant_struct;
use crate::drive::periods_of;

/// When a reading is rejected. An infinite velocity or torque, or a count of 65535 periods, switches its check off.
/// Checked by [`FaultMonitor::new`](crate::drive::FaultMonitor::new).
///
/// ```
/// use omni_core::drive::{FaultConfig, FaultMonitor};
/// // Wheels of 6 rad/s that gain at most 500 rad/s^2, sampled every millisecond.
/// let config = FaultConfig { jump_rad_s: 2.0, ..FaultConfig::usual(0.001_f64) };
/// assert!(FaultMonitor::new(config).is_ok());
/// let one = FaultConfig { stuck_periods: 1, ..config }; // one reading alone is not stuck
/// let error = FaultMonitor::new(one).unwrap_err();
/// assert_eq!((error.parameter, error.value), ("stuck_periods", 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct FaultConfig<R> {
    /// Largest change \[rad/s\] of an actuator's velocity within one period, 1e-9 or more: a
    /// reading further from the last accepted one is held back.
    pub jump_rad_s: R,
    /// Periods a jump is bridged with the last accepted reading; then the wheel is faulty. Good
    /// readings between jumps count against jumps one by one. 1 to 65535.
    pub jump_periods: u16,
    /// A reading that stays exactly the same while the velocity that the other wheels imply changes by more than this
    /// \[rad/s\] is stuck, 1e-9 or more. After ten times as long, a reading is also stuck if it stays exactly 0 while
    /// the other wheels imply a velocity above this and its loop applies torque without effect towards its reference.
    /// Also how well a faulty wheel must agree with the others to be accepted again.
    pub stuck_rad_s: R,
    /// A reading that stays exactly the same while the motor is commanded to apply at least this torque \[N.m\] towards
    /// the reference, or while the reference differs by more than `stuck_rad_s`, is stuck after ten times
    /// `stuck_periods`, 1e-9 or more. A reading of 0 that the other wheels can check is stuck once they imply that the
    /// wheel has turned by `stuck_rad_s` in that time. Of three wheels, which cannot check each other, one of 0 or so
    /// far away is stuck after `stuck_periods` if another wheel turns faster than `stuck_rad_s`. A wheel that is
    /// blocked while others turn looks the same. If another wheel is pulled as hard and reads 0 too, the vehicle may
    /// stand before an obstacle, or encoders of one supply are dead: of more than three wheels both are then stuck
    /// after twenty times `stuck_periods`.
    pub stuck_torque_n_m: R,
    /// Periods of evidence in a row that make a reading stuck, 2 to 65535.
    pub stuck_periods: u16,
    /// Periods without a reading after which a wheel is faulty, 1 to 65535; until then its last reading stands.
    pub silent_periods: u16,
    /// Good readings in a row after which a faulty wheel (never one declared lost) is accepted
    /// again, 1 to 65535: readings without a jump that agree with the other wheels as far as these
    /// determine it, from a stuck wheel readings that change.
    pub recovery_periods: u16,
}

constant_struct!(FaultConfig<R> {
    jump_rad_s: R,
    jump_periods: u16,
    stuck_rad_s: R,
    stuck_torque_n_m: R,
    stuck_periods: u16,
    silent_periods: u16,
    recovery_periods: u16,
});

impl<R: Real> FaultConfig<R> {
    /// Usual values for a control period \[s\]: jumps for 5 ms, readings that are stuck by 1 rad/s for 0.1 s or do not
    /// arrive for 20 ms, and a recovery of 0.2 s, in whole periods. Values that depend on the vehicle are not checked:
    /// `jump_rad_s`, several times the velocity that a wheel gains in a period, and `stuck_torque_n_m`, half of a
    /// motor's torque.
    ///
    /// ```
    /// use omni_core::drive::FaultConfig;
    /// let [fast, slow] = [0.001_f32, 0.005].map(FaultConfig::usual);
    /// assert_eq!((fast.silent_periods, slow.silent_periods), (20, 4)); // 20 ms each
    /// assert_eq!((fast.recovery_periods, slow.recovery_periods), (200, 40));
    /// ```
    #[must_use]
    pub fn usual(period_s: R) -> Self {
        Self {
            jump_periods: periods_of(0.005, period_s),
            stuck_rad_s: R::one(),
            stuck_periods: periods_of(0.1, period_s).max(2),
            silent_periods: periods_of(0.02, period_s),
            recovery_periods: periods_of(0.2, period_s),
            ..Self::unchecked()
        }
    }

    /// No check but for readings that are missing or no numbers, which are rejected for as long as they last. What is
    /// to be checked is set from here.
    ///
    /// ```
    /// use omni_core::drive::{Fault, FaultConfig, FaultMonitor, FaultState};
    /// # let expected = omni_core::examples::nothing_expected();
    /// let (monitor, mut state) = (FaultMonitor::new(FaultConfig::unchecked())?, FaultState::default());
    /// // From 1 to 900 rad/s within a period: not checked.
    /// assert_eq!(monitor.step(&mut state, &[Some(1.0)], &expected).rad_s, [1.0]);
    /// assert_eq!(monitor.step(&mut state, &[Some(900.0)], &expected).rad_s, [900.0]);
    /// assert_eq!(monitor.step(&mut state, &[None], &expected).rad_s, [0.0]);
    /// assert_eq!(state.faults(), [Some(Fault::Silent)]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn unchecked() -> Self {
        let infinite = R::one() / R::zero();
        Self {
            jump_rad_s: infinite,
            jump_periods: u16::MAX,
            stuck_rad_s: infinite,
            stuck_torque_n_m: infinite,
            stuck_periods: u16::MAX,
            silent_periods: 1,
            recovery_periods: 1,
        }
    }
}
