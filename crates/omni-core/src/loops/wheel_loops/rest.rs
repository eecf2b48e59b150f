//! Behaviour of controllers once the command is rest: their torque ends, whatever the wheels measure.

use crate::constants::constant_struct;
use crate::error::within;
use crate::geometry::WheelVelocities;
use crate::motor::TorqueRanges;
use crate::sum::Sum;
use crate::{ConfigError, Real};

/// How torque ends while every reference is 0: in a stop, after a time-out, at a command of rest.
///
/// Loops depend on their measurements. A wheel that cannot turn, an encoder that is stuck at its last reading or a
/// slope would keep a torque for ever. Therefore the integrals fall to 0 in the first half of `bleed_s`, after which
/// loops only brake, and in the second half the range of each torque shrinks from the motor's limits to 0, both
/// linearly. From then on every torque is exactly 0 until a reference is not 0 again, regardless of the measurements. A
/// stop is over when its deceleration, `hold_s` and `bleed_s` have passed; a vehicle that still moves then rolls on,
/// and on a slope it rolls down. `short_windings` makes its motors brake it; a [`Drive`](crate::drive::Drive) does so
/// in a safe stop and in an emergency stop by itself.
///
/// To stand on a slope, hold for a time first: bounded by that time and by torque squared, because a
/// motor that stands cools badly. A [`Drive`](crate::drive::Drive) does not hold in a safe stop or an
/// emergency stop, because loops that hold trust their encoders. While references are not 0, both come
/// back ten times slower than holding uses them up: a command that flickers does not hold for ever.
///
/// ```
/// use omni_core::loops::{Rest, WheelController};
/// use omni_core::{ControlState, WheelVelocities};
/// # let mut config = omni_core::examples::loops(0.5, 2.0, 2.0)?;
/// config.pid.period_s = 0.25;
/// let mut rest = Rest::default();
/// rest.bleed_s = 1.0;
/// let wheels = WheelController::new(config)?.with_rest(rest)?;
/// // The first wheel's encoder is stuck at 9 rad/s. The motors have 2 N.m, and the period is 0.25 s.
/// let (mut state, measured) = (ControlState::default(), [9.0, 0.0].into());
/// let torques = [(); 6].map(|()| wheels.step(&mut state, &WheelVelocities::zero(), &measured).applied.n_m[0]);
/// assert_eq!(torques, [-2.0, -2.0, -2.0, -1.0, 0.0, 0.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Rest<R> {
    /// Within this time \[s\] torques fall to 0, 0 to 10; a time shorter than the control period is one period.
    pub bleed_s: R,
    /// Before that the loops hold the wheels for this time \[s\], 0 to 3600; 0 holds nothing.
    pub hold_s: R,
    /// Holding ends when the sum over the wheels of the integral of torque squared has reached this, less the amount
    /// recovered \[N^2.m^2.s\], 0 to 1e9; above 0 if `hold_s` is.
    pub hold_torque_squared_n2m2s: R,
    /// The windings of the motors are to be shorted when the torque has ended:
    /// [`WheelSample::shorted`](crate::loops::WheelSample::shorted).
    pub short_windings: bool,
}

impl<R: Real> Default for Rest<R> {
    /// Torques fall to 0 within 0.5 s, nothing is held, and the wheels then turn freely.
    fn default() -> Self {
        Self {
            bleed_s: R::of(0.5),
            hold_s: R::zero(),
            hold_torque_squared_n2m2s: R::zero(),
            short_windings: false,
        }
    }
}

impl<R: Real> Rest<R> {
    /// Holds for `hold_s` \[s\] or until `hold_torque_squared_n2m2s` \[N^2.m^2.s\], then releases
    /// the wheels as the default does.
    ///
    /// ```
    /// use omni_core::loops::Rest;
    /// // Half a minute on a ramp; seven wheels with 0.3 N.m each reach that after 5 / (7 * 0.09) = 8 s.
    /// let rest = Rest::hold(30.0, 5.0);
    /// assert_eq!((rest.bleed_s, rest.hold_s), (0.5, 30.0));
    /// ```
    #[must_use]
    pub fn hold(hold_s: R, hold_torque_squared_n2m2s: R) -> Self {
        Self {
            hold_s,
            hold_torque_squared_n2m2s,
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
    hold_torque_squared: R,
    /// What comes back in a period.
    torque_squared_back: R,
    period_s: R,
    short_windings: bool,
}

/// Time and torque squared come back in so many times as long as holding used them up.
const RECOVERY: u32 = 10;

constant_struct!(RestRule<R> {
    bleed_periods: R,
    hold: u32,
    hold_torque_squared: R,
    torque_squared_back: R,
    period_s: R,
    short_windings: bool,
});

/// The state of a [`RestRule`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct RestState<R> {
    /// Tenths of the periods in which wheels were held while every reference was 0, less those that have come back.
    held: u32,
    /// Integral of torque squared of that \[N^2.m^2.s\].
    held_torque_squared_n2m2s: Sum<R>,
    /// Periods in which the torques fell since then.
    bled_periods: R,
}

impl<R: Real> RestState<R> {
    pub(crate) const fn new() -> Self {
        Self {
            held: 0,
            held_torque_squared_n2m2s: Sum::of(R::ZERO),
            bled_periods: R::ZERO,
        }
    }
}

impl<R: Real> RestRule<R> {
    pub(crate) fn new(rest: Rest<R>, period_s: R) -> Result<Self, ConfigError> {
        within("rest.bleed_s", rest.bleed_s, 0.0..=10.0, "0 to 10")?;
        let hold_s = within("rest.hold_s", rest.hold_s, 0.0..=3600.0, "0 to 3600")?;
        let hold_torque_squared = within(
            "rest.hold_torque_squared_n2m2s",
            rest.hold_torque_squared_n2m2s,
            0.0..=1e9,
            "0 to 1e9",
        )?;
        if hold_s > R::zero() && hold_torque_squared <= R::zero() {
            let allowed = "above 0, up to 1e9, where hold_s is above 0";
            return Err(ConfigError::new(
                "rest.hold_torque_squared_n2m2s",
                hold_torque_squared.as_f64(),
                allowed,
            ));
        }
        Ok(Self::in_range(rest, period_s))
    }

    /// The default's rule, which is in range whatever the period.
    pub(crate) fn usual(period_s: R) -> Self {
        Self::in_range(Rest::default(), period_s)
    }

    fn in_range(rest: Rest<R>, period_s: R) -> Self {
        // Rounded: 0.5 s of 1 ms are also 500 periods in f32.
        let periods = |time: R| (time.as_f64() / period_s.as_f64() + 0.5) as u32;
        let hold = periods(rest.hold_s).saturating_mul(RECOVERY);
        Self {
            bleed_periods: R::of(f64::from(periods(rest.bleed_s).max(1))),
            hold,
            hold_torque_squared: rest.hold_torque_squared_n2m2s,
            torque_squared_back: R::of(rest.hold_torque_squared_n2m2s.as_f64() / f64::from(hold.max(1))),
            period_s,
            short_windings: rest.short_windings,
        }
    }

    pub(crate) fn period_s(&self) -> R {
        self.period_s
    }

    /// The integrals have fallen: the ranges of the torques shrink, or the torque has ended.
    #[inline]
    pub(crate) fn shrinks(&self, state: &RestState<R>) -> bool {
        // NaN, from a state set from outside, counts as past the half.
        let before = state.bled_periods <= R::of(0.5) * self.bleed_periods;
        !before
    }

    /// The torque has ended: every wheel's is 0 for as long as the references are.
    #[inline]
    pub(crate) fn is_over(&self, state: &RestState<R>) -> bool {
        // NaN, from a state set from outside, counts as ended.
        let bleeds = state.bled_periods < self.bleed_periods;
        state.held >= self.hold && !bleeds
    }

    /// The windings are to be shorted once the torque has ended.
    #[inline]
    pub(crate) fn shorts(&self) -> bool {
        self.short_windings
    }

    /// Before a step with every reference at 0, where it `shrinks`: what is left of the range of each torque.
    #[inline(never)]
    pub(crate) fn narrow<const N: usize>(&self, state: &RestState<R>, range: &mut TorqueRanges<R, N>) {
        if state.held < self.hold {
            return;
        }
        let left = R::of(2.0) * (self.bleed_periods - state.bled_periods) / self.bleed_periods;
        for i in 0..N {
            range.lower_n_m[i] *= left;
            range.upper_n_m[i] *= left;
        }
    }

    /// After a step with every reference at 0 that applied `applied_n_m`: remaining fraction of the integrals.
    #[inline(never)]
    pub(crate) fn step<const N: usize>(
        &self,
        state: &mut RestState<R>,
        integral_n_m: &mut [R; N],
        applied_n_m: &[R; N],
    ) {
        if state.held < self.hold {
            for torque in applied_n_m {
                state.held_torque_squared_n2m2s = state
                    .held_torque_squared_n2m2s
                    .plus(*torque * *torque * self.period_s);
            }
            if state.held_torque_squared_n2m2s.total < self.hold_torque_squared {
                state.held = state.held.saturating_add(RECOVERY);
                return;
            }
            // The bound is reached: as if the time were over.
            state.held = self.hold;
        }
        let left = R::of(0.5) * self.bleed_periods - state.bled_periods;
        state.bled_periods += R::one();
        if left > R::one() {
            // One part of those that are left: a straight line to exactly 0.
            let kept = (left - R::one()) / left;
            *integral_n_m = integral_n_m.map(|integral| integral * kept);
        } else {
            *integral_n_m = [R::zero(); N];
        }
    }

    /// The rule, or, where nothing may be held, the rule without holding.
    #[inline]
    pub(crate) fn where_held(&self, holds: bool) -> Self {
        Self {
            hold: if holds { self.hold } else { 0 },
            ..*self
        }
    }

    /// After a step with a reference that is not 0.
    #[inline]
    pub(crate) fn drive(&self, state: &mut RestState<R>) {
        state.bled_periods = R::zero();
        if state.held > 0 {
            self.recover(state);
        }
    }

    #[inline(never)]
    fn recover(&self, state: &mut RestState<R>) {
        state.held -= 1;
        let left = state.held_torque_squared_n2m2s.plus(-self.torque_squared_back);
        // Both are all there again together, at the latest.
        state.held_torque_squared_n2m2s = if state.held > 0 && left.total > R::zero() {
            left
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

    /// Two wheels that are held.
    struct Held {
        rule: RestRule<f32>,
        state: RestState<f32>,
        integral_n_m: [f32; 2],
    }

    impl Held {
        fn step(&mut self) {
            self.rule.step(&mut self.state, &mut self.integral_n_m, &TORQUES);
        }
    }

    fn holding(hold_s: f32, torque_squared: f32, period_s: f32) -> Held {
        Held {
            rule: RestRule::new(Rest::hold(hold_s, torque_squared), period_s).expect("in range"),
            state: RestState::new(),
            integral_n_m: TORQUES,
        }
    }

    #[test]
    fn holding_without_a_bound_of_torque_squared_is_refused() {
        let error = RestRule::new(Rest::hold(30.0, 0.0), 1e-3).expect_err("refused");
        assert_eq!(
            error.to_string(),
            "rest.hold_torque_squared_n2m2s = 0, allowed: above 0, up to 1e9, where hold_s is above 0"
        );
    }

    #[test]
    fn torque_squared_ends_holding_in_single_precision_at_ten_kilohertz_too() {
        // A period adds 1.8e-5 N^2.m^2.s: less than half a unit in the last place of 300 in f32.
        let mut held = holding(3600.0, 300.0, 1e-4);
        let mut periods = 0_u32;
        while held.integral_n_m == TORQUES {
            held.step();
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
        let mut held = holding(2.0, 1e9, 1e-3);
        // Every second period is driven: of 2 s a tenth comes back while they are used.
        let mut periods = 0_u32;
        while held.integral_n_m == TORQUES {
            held.step();
            held.rule.drive(&mut held.state);
            periods += 1;
        }
        assert!((2200..=2230).contains(&periods), "{periods}"); // 2000 / 0.9
        // Then they fall in all but a tenth of the periods of rest, by a 500th each.
        for _ in 0..10_000 {
            held.step();
            held.rule.drive(&mut held.state);
        }
        assert!(held.integral_n_m[0] < 1e-6, "{:?}", held.integral_n_m);
    }

    #[test]
    fn a_time_to_hold_beyond_every_counter_overflows_none() {
        // Tenths of 3600 s of 1 us: 3.6e10, more than a counter has.
        let mut held = holding(3600.0, 1e9, 1e-6);
        held.state.held = held.rule.hold;
        held.rule.drive(&mut held.state);
        held.step();
        assert_eq!(held.state.held, u32::MAX);
        assert_eq!(held.integral_n_m, TORQUES);
    }

    #[test]
    fn time_and_torque_squared_come_back_in_ten_times_as_long() {
        let mut held = holding(1.0, 0.09, 1e-3);
        while held.integral_n_m == TORQUES {
            held.step();
        }
        let mut periods = 0_u32;
        while held.state.held > 0 || held.state.held_torque_squared_n2m2s != Sum::of(0.0) {
            held.rule.drive(&mut held.state);
            periods += 1;
        }
        assert_eq!(periods, 10_000);
    }
}
