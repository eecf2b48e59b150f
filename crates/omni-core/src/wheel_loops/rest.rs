//! What loops do once the command is rest: integrals fall to zero, so that a wheel that stands is not pushed.

use super::ControlState;
use crate::constants::constant_struct;
use crate::error::{ConfigError, within};
use crate::sum::Sum;
use crate::{Real, WheelVelocities};

/// What becomes of the integrals while every reference is 0: a stop, a time-out, a command of rest.
///
/// A wheel that cannot turn has no error at rest, so its integral would stay where it was and push for ever. By default all
/// integrals fall to exactly 0 within 0.5 s, whatever the wheels measure. From then on a loop is its proportional and
/// derivative terms: a wheel that stands gets no torque, one that is turned is braked. On a slope the vehicle then creeps, at
/// the speed at which kp makes the torque of the slope.
///
/// To stand on a slope, let the integrals hold for a time first: bounded by that time and by heat, because a motor that
/// stands cools badly. While references are not 0, time and heat come back ten times slower than holding uses them up: a command that
/// flickers does not hold for ever.
///
/// ```
/// use omni_core::{ControlState, Rest, WheelController, WheelVelocities};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 2], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 0.25), limits, coordination };
/// let mut rest = Rest::default();
/// rest.bleed_s = 1.0;
/// let wheels = WheelController::new(config)?.with_rest(rest)?;
/// let (mut state, standing) = (ControlState::default(), WheelVelocities::zero());
/// wheels.step(&mut state, &[2.0, 1.0].into(), &standing); // blocked; ki dt is 0.5 and the period 0.25 s
/// let torques = [(); 5].map(|()| wheels.step(&mut state, &WheelVelocities::zero(), &standing).applied.n_m[0]);
/// assert_eq!(torques, [1.0, 0.75, 0.5, 0.25, 0.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Rest<R> {
    /// Within this time \[s\] the integrals fall to 0, 0 to 10; a time shorter than the control period is one period.
    pub bleed_s: R,
    /// Before that they are held for this time \[s\], 0 to 3600, and take in errors as ever; 0 holds nothing.
    pub hold_s: R,
    /// Holding ends when the sum over the wheels of the integral of torque squared has reached this, less what has come back
    /// \[N^2.m^2.s\], 0 to 1e9; above 0 where `hold_s` is.
    pub hold_heat_n2m2s: R,
}

impl<R: Real> Default for Rest<R> {
    /// Integrals fall to 0 within 0.5 s and nothing is held.
    fn default() -> Self {
        Self {
            bleed_s: R::of(0.5),
            hold_s: R::zero(),
            hold_heat_n2m2s: R::zero(),
        }
    }
}

impl<R: Real> Rest<R> {
    /// Holds for `hold_s` \[s\] or until `hold_heat_n2m2s` \[N^2.m^2.s\] of heat, then lets go as the default does.
    ///
    /// ```
    /// use omni_core::Rest;
    /// // Half a minute on a ramp; seven wheels with 0.3 N.m each reach the heat after 5 / (7 * 0.09) = 8 s.
    /// let rest = Rest::hold(30.0, 5.0);
    /// assert_eq!((rest.bleed_s, rest.hold_s), (0.5, 30.0));
    /// ```
    #[must_use]
    pub fn hold(hold_s: R, hold_heat_n2m2s: R) -> Self {
        Self {
            hold_s,
            hold_heat_n2m2s,
            ..Self::default()
        }
    }
}

/// [`Rest`] in control periods.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct RestRule<R> {
    // A whole number below 2^24, exact in f32: a microcontroller without double precision turns no integer into it.
    bleed_periods: R,
    /// Time to hold, in periods times [`RECOVERY`].
    hold: u32,
    hold_heat: R,
    /// What comes back in a period.
    heat_back: R,
    period_s: R,
}

/// So much longer than holding takes its time and heat to come back.
const RECOVERY: u32 = 10;

constant_struct!(RestRule<R> { bleed_periods: R, hold: u32, hold_heat: R, heat_back: R, period_s: R });

impl<R: Real> RestRule<R> {
    pub(super) fn new(rest: Rest<R>, period_s: R) -> Result<Self, ConfigError> {
        let bleed_s = within("rest.bleed_s", rest.bleed_s, 0.0..=10.0, "0 to 10")?;
        let hold_s = within("rest.hold_s", rest.hold_s, 0.0..=3600.0, "0 to 3600")?;
        let hold_heat = within(
            "rest.hold_heat_n2m2s",
            rest.hold_heat_n2m2s,
            0.0..=1e9,
            "0 to 1e9",
        )?;
        if hold_s > R::zero() && hold_heat <= R::zero() {
            let allowed = "above 0, up to 1e9, where hold_s is above 0";
            return Err(ConfigError::new(
                "rest.hold_heat_n2m2s",
                hold_heat.as_f64(),
                allowed,
            ));
        }
        // Rounded: 0.5 s of 1 ms are 500 periods in f32 too.
        let periods = |time: R| (time.as_f64() / period_s.as_f64() + 0.5) as u32;
        let hold = periods(hold_s).saturating_mul(RECOVERY);
        Ok(Self {
            bleed_periods: R::of(f64::from(periods(bleed_s).max(1))),
            hold,
            hold_heat,
            heat_back: R::of(hold_heat.as_f64() / f64::from(hold.max(1))),
            period_s,
        })
    }

    pub(super) fn period_s(&self) -> R {
        self.period_s
    }

    /// After a step with every reference at 0 that gave `applied_n_m`: the integrals as they are then.
    #[inline(never)]
    pub(super) fn step<const N: usize>(&self, state: &mut ControlState<R, N>, applied_n_m: &[R; N]) {
        if state.held < self.hold {
            for torque in applied_n_m {
                state.held_heat_n2m2s = state.held_heat_n2m2s.plus(*torque * *torque * self.period_s);
            }
            if state.held_heat_n2m2s.total < self.hold_heat {
                state.held += RECOVERY;
                return;
            }
            // Hot: as if the time were over.
            state.held = self.hold;
        }
        let left = self.bleed_periods - state.bled_periods;
        if left >= R::one() {
            state.bled_periods += R::one();
            // One part of those that are left: a straight line to exactly 0.
            let kept = (left - R::one()) / left;
            state.integral_n_m = state.integral_n_m.map(|integral| integral * kept);
        } else {
            state.integral_n_m = [R::zero(); N];
        }
    }

    /// After a step with a reference that is not 0.
    #[inline]
    pub(super) fn drive<const N: usize>(&self, state: &mut ControlState<R, N>) {
        state.bled_periods = R::zero();
        if state.held > 0 {
            self.recover(state);
        }
    }

    #[inline(never)]
    fn recover<const N: usize>(&self, state: &mut ControlState<R, N>) {
        state.held -= 1;
        let heat = state.held_heat_n2m2s.plus(-self.heat_back);
        // Time and heat are all there again together, at the latest.
        state.held_heat_n2m2s = if state.held > 0 && heat.total > R::zero() {
            heat
        } else {
            Sum::of(R::zero())
        };
    }
}

/// Every reference is 0.
#[inline]
pub(super) fn is_rest<R: Real, const N: usize>(reference: &WheelVelocities<R, N>) -> bool {
    // One wheel that turns is enough to know, and while driving that is mostly the first.
    reference.rad_s.iter().all(|r| *r == R::zero())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    const TORQUES: [f32; 2] = [0.3, 0.3];

    fn holding(hold_s: f32, heat: f32, period_s: f32) -> (RestRule<f32>, ControlState<f32, 2>) {
        let rule = RestRule::new(Rest::hold(hold_s, heat), period_s).expect("in range");
        let mut state = ControlState::new();
        state.integral_n_m = TORQUES;
        (rule, state)
    }

    #[test]
    fn holding_without_heat_is_refused() {
        let error = RestRule::new(Rest::hold(30.0, 0.0), 1e-3).expect_err("refused");
        assert_eq!(
            error.to_string(),
            "rest.hold_heat_n2m2s = 0, allowed: above 0, up to 1e9, where hold_s is above 0"
        );
    }

    #[test]
    fn heat_ends_holding_in_single_precision_at_ten_kilohertz_too() {
        // A period adds 1.8e-5 N^2.m^2.s: less than half a unit in the last place of 300 in f32.
        let (rule, mut state) = holding(3600.0, 300.0, 1e-4);
        let mut periods = 0_u32;
        while state.integral_n_m == TORQUES {
            rule.step(&mut state, &TORQUES);
            periods += 1;
        }
        let expected = 300.0 / (2.0 * 0.09);
        // Rounding of the period and of the torques squared, 1e-7 each.
        assert!(
            (f64::from(periods) * 1e-4 - expected).abs() < 1e-5 * expected,
            "{periods}"
        );
    }

    #[test]
    fn a_command_that_flickers_does_not_hold_for_ever() {
        let (rule, mut state) = holding(2.0, 1e9, 1e-3);
        // Every second period is driven: of 2 s a tenth comes back while they are used.
        let mut periods = 0_u32;
        while state.integral_n_m == TORQUES {
            rule.step(&mut state, &TORQUES);
            rule.drive(&mut state);
            periods += 1;
        }
        assert!((2200..=2230).contains(&periods), "{periods}"); // 2000 / 0.9
        // Then they fall in all but a tenth of the periods of rest, by a 500th each.
        for _ in 0..10_000 {
            rule.step(&mut state, &TORQUES);
            rule.drive(&mut state);
        }
        assert!(state.integral_n_m[0] < 1e-6, "{:?}", state.integral_n_m);
    }

    #[test]
    fn time_and_heat_come_back_in_ten_times_as_long() {
        let (rule, mut state) = holding(1.0, 0.09, 1e-3);
        while state.integral_n_m == TORQUES {
            rule.step(&mut state, &TORQUES);
        }
        let fresh = ControlState::<f32, 2>::new();
        let mut periods = 0_u32;
        while (state.held, state.held_heat_n2m2s) != (fresh.held, fresh.held_heat_n2m2s) {
            rule.drive(&mut state);
            periods += 1;
        }
        assert_eq!(periods, 10_000);
    }
}
