//! Heading hold: an outer loop with a gyro.
//!
//! Wheels measure the heading only if they do not slip, and on a step they slip. A gyro knows
//! better: what the vehicle was commanded to turn less what it has turned is an error of heading,
//! and a yaw rate in proportion to it takes the vehicle back.

use crate::error::{period, within};
use crate::geometry::BodyTwist;
use crate::sum::Sum;
use crate::{ConfigError, Real};

/// Gain, limit and period of a [`HeadingHold`].
///
/// ```
/// use omni_core::shaping::{HeadingHold, HeadingHoldConfig};
/// let config = HeadingHoldConfig { gain_per_s: 3.0, limit_rad_s: 0.5, period_s: 0.0 };
/// let error = HeadingHold::new(config).unwrap_err();
/// assert_eq!((error.parameter, error.value), ("period_s", 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HeadingHoldConfig<R> {
    /// Yaw rate asked for per heading error \[rad/s per rad\], 0 to 1000. The inverse is the time
    /// constant of the return: it should be several times the time constant of the wheels' loops.
    pub gain_per_s: R,
    /// Largest correction of the yaw rate \[rad/s\], 0 to 1000.
    pub limit_rad_s: R,
    /// Time between steps \[s\], 1e-6 to 10.
    pub period_s: R,
}

/// Adds to a commanded twist the yaw rate that keeps the heading, by a gyro. Goes before the limits of the twist.
///
/// A command of rest is left as it is, so that stops end without torque. The error is kept for the way on as it is: the
/// bias of a gyro would fill it while the vehicle stands. Rotation of the vehicle during that time is not corrected.
///
/// ```
/// use omni_core::shaping::{HeadingHold, HeadingHoldConfig, HeadingHoldState};
/// use omni_core::BodyTwist;
/// let hold = HeadingHold::new(HeadingHoldConfig { gain_per_s: 4.0, limit_rad_s: 0.5, period_s: 0.01 })?;
/// let mut state = HeadingHoldState::default();
/// let ahead = BodyTwist { vx_m_s: 0.3_f64, ..BodyTwist::ZERO };
/// // A step turns the vehicle left at 1 rad/s for 0.1 s: 0.1 rad too far, taken back at 0.4 rad/s.
/// let mut out = ahead;
/// for _ in 0..10 {
///     out = hold.step(&mut state, &ahead, 1.0);
/// }
/// assert!((out.wz_rad_s + 0.4).abs() < 1e-12 && out.vx_m_s == 0.3);
/// assert!((state.error_rad() + 0.1).abs() < 1e-12); // it looks 0.1 rad too far left
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HeadingHold<R> {
    config: HeadingHoldConfig<R>,
}

/// The heading error of a [`HeadingHold`]; `default` has none.
///
/// ```
/// assert_eq!(omni_core::shaping::HeadingHoldState::<f32>::default().error_rad(), 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HeadingHoldState<R> {
    error: Sum<R>,
}

impl<R: Real> Default for HeadingHoldState<R> {
    fn default() -> Self {
        Self {
            error: Sum::of(R::zero()),
        }
    }
}

impl<R: Real> HeadingHoldState<R> {
    /// Heading commanded less heading reached since the start \[rad\], counter-clockwise positive; not wrapped.
    #[must_use]
    pub fn error_rad(&self) -> R {
        self.error.total
    }
}

impl<R: Real> HeadingHold<R> {
    /// A loop with this gain and limit.
    ///
    /// # Errors
    /// Parameter `gain_per_s`, `limit_rad_s` or `period_s`.
    pub fn new(config: HeadingHoldConfig<R>) -> Result<Self, ConfigError> {
        within("gain_per_s", config.gain_per_s, 0.0..=1000.0, "0 to 1000")?;
        within("limit_rad_s", config.limit_rad_s, 0.0..=1000.0, "0 to 1000")?;
        period(config.period_s)?;
        Ok(Self { config })
    }

    /// The twist to command instead of `command`, with the gyro's yaw rate \[rad/s\] of the period
    /// that has passed. A command or a reading that is not finite leaves the error as it is; the
    /// command's own components pass as they are.
    ///
    /// ```
    /// use omni_core::shaping::{HeadingHold, HeadingHoldConfig, HeadingHoldState};
    /// use omni_core::BodyTwist;
    /// let hold = HeadingHold::new(HeadingHoldConfig { gain_per_s: 4.0, limit_rad_s: 0.5, period_s: 0.01 })?;
    /// let turn = BodyTwist { wz_rad_s: 1.0, ..BodyTwist::ZERO };
    /// let mut state = HeadingHoldState::default();
    /// assert_eq!(hold.step(&mut state, &turn, 1.0).wz_rad_s, 1.0); // it turns as commanded
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(
        &self,
        state: &mut HeadingHoldState<R>,
        command: &BodyTwist<R>,
        gyro_rad_s: R,
    ) -> BodyTwist<R> {
        let HeadingHoldConfig {
            gain_per_s,
            limit_rad_s,
            period_s,
        } = self.config;
        if *command == BodyTwist::ZERO {
            // A vehicle that is blocked would be pushed for as long as it stands, and the bias of
            // the gyro would be all there is to integrate.
            return *command;
        }
        let error = state.error.plus((command.wz_rad_s - gyro_rad_s) * period_s);
        if error.is_finite() {
            state.error = error;
        }
        let asked = gain_per_s * state.error.total;
        let correction = if asked > limit_rad_s {
            limit_rad_s
        } else if asked < -limit_rad_s {
            -limit_rad_s
        } else {
            asked
        };
        BodyTwist {
            wz_rad_s: command.wz_rad_s + correction,
            ..*command
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const AHEAD: BodyTwist<f64> = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };

    fn hold(gain_per_s: f64, limit_rad_s: f64) -> HeadingHold<f64> {
        HeadingHold::new(HeadingHoldConfig {
            gain_per_s,
            limit_rad_s,
            period_s: 1e-3,
        })
        .expect("in range")
    }

    #[test]
    fn a_vehicle_that_turns_as_commanded_comes_back_with_the_time_constant_of_the_gain() {
        let (hold, mut state) = (hold(2.0, 10.0), HeadingHoldState::default());
        // Pushed by 0.2 rad in one period, then a vehicle that follows at once.
        let mut yaw_rate = 200.0;
        let mut heading = 0.0;
        for _ in 0..=500 {
            heading += yaw_rate * 1e-3;
            yaw_rate = hold.step(&mut state, &AHEAD, yaw_rate).wz_rad_s;
        }
        // One time constant of 0.5 s later; Euler's steps of 1 ms are off by a thousandth of the exponent.
        assert!(
            (heading / (0.2 * (-1.0_f64).exp()) - 1.0).abs() < 2e-3,
            "{heading}"
        );
    }

    #[test]
    fn correction_stays_within_its_limit() {
        let (hold, mut state) = (hold(100.0, 0.3), HeadingHoldState::default());
        for sign in [1.0, -1.0] {
            let out = (0..1000)
                .map(|_| hold.step(&mut state, &AHEAD, 5.0 * sign).wz_rad_s)
                .next_back();
            assert_eq!(out, Some(if sign > 0.0 { -0.3 } else { 0.0 }), "{sign}");
        }
    }

    #[test]
    fn what_is_not_finite_changes_nothing() {
        let (hold, mut state) = (hold(2.0, 1.0), HeadingHoldState::default());
        hold.step(&mut state, &AHEAD, -100.0);
        let before = state;
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let out = hold.step(&mut state, &AHEAD, bad);
            assert_eq!((state, out.wz_rad_s), (before, 0.2));
        }
    }

    #[test]
    fn a_command_of_rest_is_not_corrected_and_the_error_is_kept() {
        let (hold, mut state) = (hold(2.0, 1.0), HeadingHoldState::default());
        hold.step(&mut state, &AHEAD, -100.0);
        for _ in 0..60_000 {
            // A minute of a biased gyro.
            assert_eq!(hold.step(&mut state, &BodyTwist::ZERO, 0.02), BodyTwist::ZERO);
        }
        assert_eq!(hold.step(&mut state, &AHEAD, 0.0).wz_rad_s, 0.2);
    }

    proptest! {
        #[test]
        fn no_input_makes_the_correction_other_than_finite_and_bounded(readings in prop::collection::vec(any::<f32>(), 1..50)) {
            let config = HeadingHoldConfig { gain_per_s: 3.0_f32, limit_rad_s: 0.5, period_s: 1e-3 };
            let (hold, mut state) = (HeadingHold::new(config).expect("in range"), HeadingHoldState::default());
            for reading in readings {
                let out = hold.step(&mut state, &BodyTwist::from_array([0.3, 0.0, 0.0]), reading).wz_rad_s;
                prop_assert!(out.abs() <= 0.5);
            }
        }
    }
}
