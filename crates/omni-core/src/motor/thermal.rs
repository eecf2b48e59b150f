//! I2t: time for which a motor may exceed its continuous torque.

use crate::error::{period, positive, within};
use crate::motor::TorqueRange;
use crate::sum::Sum;
use crate::{ConfigError, Real};

/// Figures of a motor's heat; checked by [`ThermalModel::new`].
///
/// ```
/// use omni_core::motor::{ThermalConfig, ThermalModel, ThermalState};
/// let config = ThermalConfig {
///     continuous_torque_n_m: 1.0_f64,
///     peak_torque_n_m: 2.0,
///     time_constant_s: 10.0,
///     derating_start: 0.8,
///     period_s: 0.01,
/// };
/// let (model, mut state) = (ThermalModel::new(config)?, ThermalState::default());
/// for _ in 0..1000 {
///     model.update(&mut state, 1.0);
/// }
/// // After one time constant at the continuous torque.
/// assert!((state.heat() - (1.0 - (-1.0_f64).exp())).abs() < 1e-9);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ThermalConfig<R> {
    /// Continuous torque \[N.m\], > 0.
    pub continuous_torque_n_m: R,
    /// Peak torque when cold \[N.m\], at least the continuous torque.
    pub peak_torque_n_m: R,
    /// Thermal time constant of the winding \[s\], > 0.
    pub time_constant_s: R,
    /// Heat, as a fraction of the allowed heat, above which torque is reduced, 0 to 0.99. 0.8 is usual.
    pub derating_start: R,
    /// Control period \[s\], > 0 and short against the time constant.
    pub period_s: R,
}

/// First-order winding temperature driven by the square of the torque, and the torque it allows.
///
/// With x the heat (0 cold, 1 as hot as allowed): `T x' = (torque / continuous)^2 - x`, discretised exactly
/// for a torque held over a period. Below the derating start the peak torque is allowed; above it the
/// square of the torque falls linearly to the continuous one at x = 1, which is therefore never passed.
///
/// ```
/// use omni_core::motor::{ThermalConfig, ThermalModel, ThermalState};
/// let model = ThermalModel::new(ThermalConfig {
///     continuous_torque_n_m: 1.0_f64,
///     peak_torque_n_m: 2.0,
///     time_constant_s: 10.0,
///     derating_start: 0.8,
///     period_s: 0.01,
/// })?;
/// let mut state = ThermalState::default();
/// let mut periods = 0;
/// while model.allowed_torque_n_m(&state) == 2.0 {
///     model.update(&mut state, 2.0);
///     periods += 1;
/// }
/// assert_eq!(periods, 224); // 10 s * ln(4 / (4 - 0.8)) = 2.23 s at peak torque
/// for _ in 0..100_000 {
///     let allowed = model.allowed_torque_n_m(&state);
///     model.update(&mut state, allowed);
/// }
/// assert!((model.allowed_torque_n_m(&state) - 1.0).abs() < 1e-9);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ThermalModel<R> {
    continuous: R,
    peak: R,
    per_continuous_square: R,
    /// Share of the way to the new equilibrium in one period, `1 - exp(-dt / T)`.
    share: R,
    start: R,
    /// `(peak^2 / continuous^2 - 1) / (1 - start)`.
    steepness: R,
}

/// How hot the motor is; `default` is cold.
///
/// ```
/// use omni_core::motor::{ThermalModel, ThermalState};
/// # let config = omni_core::examples::thermal();
/// let model = ThermalModel::new(config)?;
/// assert_eq!(ThermalState::<f64>::default().heat(), 0.0);
/// // Switched on again while still hot: no more than the continuous torque.
/// assert_eq!(model.allowed_torque_n_m(&ThermalState::at(1.0)), 1.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ThermalState<R> {
    /// In f32 a period adds less than the last digit of it.
    heat: Sum<R>,
}

impl<R: Real> ThermalState<R> {
    /// As hot as `heat` says: 0 cold, 1 as hot as allowed. Anything not finite or below 0 counts as 1.
    ///
    /// ```
    /// use omni_core::motor::ThermalState;
    /// assert_eq!(ThermalState::at(0.25).heat(), 0.25);
    /// assert_eq!(ThermalState::at(f32::NAN).heat(), 1.0);
    /// ```
    #[must_use]
    pub fn at(heat: R) -> Self {
        let known = heat.is_finite_real() && heat >= R::zero();
        Self {
            heat: Sum::of(if known { heat } else { R::one() }),
        }
    }

    /// 0 cold, 1 as hot as allowed; more if it applied more torque than allowed. Never negative.
    #[must_use]
    pub fn heat(&self) -> R {
        self.heat.total
    }
}

impl<R: Real> Default for ThermalState<R> {
    fn default() -> Self {
        Self::at(R::zero())
    }
}

impl<R: Real> ThermalModel<R> {
    /// A model with these figures.
    ///
    /// # Errors
    /// The field of [`ThermalConfig`] that is out of range, by its name; `period_s` if it is so long that one period at
    /// peak torque could overheat the motor.
    pub fn new(config: ThermalConfig<R>) -> Result<Self, ConfigError> {
        let continuous = positive("continuous_torque_n_m", config.continuous_torque_n_m)?;
        let peak = positive("peak_torque_n_m", config.peak_torque_n_m)?;
        if peak < continuous {
            return Err(ConfigError::new(
                "peak_torque_n_m",
                peak.as_f64(),
                "at least continuous_torque_n_m",
            ));
        }
        let time_constant = positive("time_constant_s", config.time_constant_s)?;
        let period = period(config.period_s)?;
        let start = within("derating_start", config.derating_start, 0.0..=0.99, "0 to 0.99")?;
        let share = -(-period / time_constant).exp_m1();
        let square = (peak / continuous) * (peak / continuous);
        let steepness = (square - R::one()) / (R::one() - start);
        // The next heat is 1 - (1 - x) (1 - share (1 + steepness)): below 1 for as long as the last
        // bracket is positive; half of that leaves room for rounding.
        if share * (R::one() + steepness) > R::of(0.5) {
            let allowed = "short enough that a period at peak torque does not overheat the motor";
            return Err(ConfigError::new("period_s", period.as_f64(), allowed));
        }
        Ok(Self {
            continuous,
            peak,
            per_continuous_square: R::one() / (continuous * continuous),
            share,
            start,
            steepness,
        })
    }

    /// Takes in the torque \[N.m\] of one period, of either sign. One that is not finite changes nothing.
    ///
    /// ```
    /// use omni_core::motor::{ThermalModel, ThermalState};
    /// # let config = omni_core::examples::thermal();
    /// let model = ThermalModel::new(config)?; // 1 N.m continuous, 10 s, periods of 0.01 s
    /// let mut state = ThermalState::at(0.5);
    /// model.update(&mut state, -2.0); // towards (2 / 1)^2
    /// assert!((state.heat() - (4.0 + (0.5 - 4.0) * (-0.01_f64 / 10.0).exp())).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn update(&self, state: &mut ThermalState<R>, torque_n_m: R) {
        let target = torque_n_m * torque_n_m * self.per_continuous_square;
        if target.is_finite_real() {
            state.heat = state.heat.plus(self.share * state.heat.gap(target));
        }
    }

    /// Torque allowed now \[N.m\], either way: continuous to peak.
    ///
    /// ```
    /// use omni_core::motor::{ThermalModel, ThermalState};
    /// # let config = omni_core::examples::thermal();
    /// let model = ThermalModel::new(config)?; // 1 N.m continuous, 2 N.m peak, derating from 0.8 on
    /// let allowed = [0.8, 0.9, 1.0].map(|heat| model.allowed_torque_n_m(&ThermalState::at(heat)));
    /// for (allowed, square) in allowed.iter().zip([4.0, 2.5, 1.0]) {
    ///     assert!((allowed * allowed - square).abs() < 1e-12); // in between: halfway from 2^2 to 1^2
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn allowed_torque_n_m(&self, state: &ThermalState<R>) -> R {
        if state.heat() <= self.start {
            return self.peak;
        }
        let left = R::one() - state.heat();
        let left = if left > R::zero() { left } else { R::zero() };
        // The root may round past either end.
        (self.continuous * (R::one() + self.steepness * left).sqrt()).limited(self.continuous, self.peak)
    }

    /// A motor's torque range \[N.m\] within its thermal limit.
    ///
    /// ```
    /// use omni_core::motor::{ThermalModel, ThermalState, TorqueRange};
    /// # let config = omni_core::examples::thermal();
    /// let model = ThermalModel::new(config)?; // 1 N.m continuous
    /// let range = TorqueRange { lower_n_m: -2.0, upper_n_m: 0.25 }; // driving fast, it has little left
    /// let hot = model.derated(&range, &ThermalState::at(1.0));
    /// assert_eq!((hot.lower_n_m, hot.upper_n_m), (-1.0, 0.25));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn derated(&self, range: &TorqueRange<R>, state: &ThermalState<R>) -> TorqueRange<R> {
        range.capped(self.allowed_torque_n_m(state))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FIGURES: ThermalConfig<f64> = ThermalConfig {
        continuous_torque_n_m: 0.8,
        peak_torque_n_m: 2.4,
        time_constant_s: 20.0,
        derating_start: 0.8,
        period_s: 1e-3,
    };

    #[test]
    fn heat_at_a_constant_torque_is_the_exponential_of_the_closed_form() {
        let model = ThermalModel::new(FIGURES).expect("valid");
        for torque in [0.3, 0.8, 2.4] {
            let mut state = ThermalState::default();
            let square = (torque / 0.8) * (torque / 0.8);
            for k in 1..=5000 {
                model.update(&mut state, torque);
                let exact = -square * (-1e-3 * f64::from(k) / 20.0).exp_m1();
                assert!((state.heat() - exact).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_continuous_torque_may_last_for_ever() {
        let model = ThermalModel::new(FIGURES).expect("valid");
        let mut state = ThermalState::default();
        for _ in 0..1_000_000 {
            model.update(&mut state, 0.8);
            assert!(model.allowed_torque_n_m(&state) >= 0.8);
        }
        assert!(
            (state.heat() - 1.0).abs() < 1e-9 && state.heat() <= 1.0,
            "{}",
            state.heat()
        );
        let range = model.derated(
            &TorqueRange {
                lower_n_m: -2.4,
                upper_n_m: 0.1,
            },
            &state,
        );
        assert!((range.lower_n_m + 0.8).abs() < 1e-6 && range.upper_n_m == 0.1);
    }

    #[test]
    fn figures_are_checked_by_name_and_nonsense_changes_nothing() {
        let named = |config| ThermalModel::<f64>::new(config).expect_err("refused").parameter;
        assert_eq!(
            named(ThermalConfig {
                continuous_torque_n_m: 0.0,
                ..FIGURES
            }),
            "continuous_torque_n_m"
        );
        assert_eq!(
            named(ThermalConfig {
                peak_torque_n_m: 0.7,
                ..FIGURES
            }),
            "peak_torque_n_m"
        );
        assert_eq!(
            named(ThermalConfig {
                time_constant_s: f64::NAN,
                ..FIGURES
            }),
            "time_constant_s"
        );
        assert_eq!(
            named(ThermalConfig {
                derating_start: 1.0,
                ..FIGURES
            }),
            "derating_start"
        );
        assert_eq!(
            named(ThermalConfig {
                period_s: 5.0,
                ..FIGURES
            }),
            "period_s"
        );
        let model = ThermalModel::new(FIGURES).expect("valid");
        let mut state = ThermalState::at(0.5);
        model.update(&mut state, f64::NAN);
        assert_eq!(state.heat(), 0.5);
    }

    #[test]
    fn in_single_precision_an_overloaded_motor_still_heats_up() {
        // A period adds 1e-4 / 3000 of the way: less than half of the last digit of 1 in f32.
        let model = ThermalModel::new(ThermalConfig {
            continuous_torque_n_m: 1.0_f32,
            peak_torque_n_m: 2.0,
            time_constant_s: 3000.0,
            derating_start: 0.8,
            period_s: 1e-4,
        })
        .expect("valid");
        let mut state = ThermalState::at(0.9);
        for _ in 0..3_000_000 {
            model.update(&mut state, 1.1);
        }
        // 300 s of 3000 s towards 1.21 from 0.9.
        let exact = 1.21 - 0.31 * (-0.1_f32).exp();
        assert!((state.heat() - exact).abs() < 1e-4, "{} {exact}", state.heat());
    }

    proptest! {
        #[test]
        fn a_motor_that_keeps_to_what_is_allowed_never_overheats(
            demand in prop::collection::vec(0.0..10.0_f64, 1..50), peak in 1.0..6.0_f64, start in 0.0..0.9_f64, period in 1e-3..0.02_f64,
        ) {
            let config = ThermalConfig { peak_torque_n_m: 0.8 * peak, derating_start: start, period_s: period, ..FIGURES };
            let model = ThermalModel::new(config).expect("valid");
            let mut state = ThermalState::default();
            for torque in demand {
                for _ in 0..500 {
                    let allowed = model.allowed_torque_n_m(&state);
                    prop_assert!((0.8..=0.8 * peak).contains(&allowed));
                    model.update(&mut state, torque.min(allowed));
                    prop_assert!(state.heat() <= 1.0 + 1e-15); // rounding of the last step
                }
            }
        }
    }
}
