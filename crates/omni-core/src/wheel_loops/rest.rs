//! What loops do once the command is rest: integrals fall to zero, so that a wheel that stands is not pushed.

use super::ControlState;
use crate::constants::constant_struct;
use crate::error::{ConfigError, within};
use crate::{Real, WheelVelocities};

/// What becomes of the integrals while every reference is 0: a stop, a time-out, a command of rest.
///
/// A wheel that cannot turn has no error at rest, so its integral would stay where it was and push for ever. By default all
/// integrals fall to exactly 0 within 0.5 s, whatever the wheels measure. From then on a loop is its proportional and
/// derivative terms: a wheel that stands gets no torque, one that is turned is braked. On a slope the vehicle then creeps, at
/// the speed at which kp makes the torque of the slope.
///
/// To stand on a slope, let the integrals hold for a time first: bounded by that time and by heat, because a motor that
/// stands cools badly.
///
/// ```
/// use omni_core::{ControlState, Rest, WheelController, WheelVelocities};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 2], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 0.25), limits, coordination };
/// let wheels = WheelController::new(config)?.with_rest(Rest { bleed_s: 1.0, ..Rest::default() })?;
/// let (mut state, standing) = (ControlState::default(), WheelVelocities::zero());
/// wheels.step(&mut state, &[2.0, 1.0].into(), &standing); // blocked; ki dt is 0.5 and the period 0.25 s
/// let torques = [(); 5].map(|()| wheels.step(&mut state, &WheelVelocities::zero(), &standing).applied.n_m[0]);
/// assert_eq!(torques, [1.0, 0.75, 0.5, 0.25, 0.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rest<R> {
    /// Within this time \[s\] the integrals fall to 0, 0 to 10; a time shorter than the control period is one period.
    pub bleed_s: R,
    /// Before that they are held for this time \[s\], 0 to 3600, and take in errors as ever; 0 holds nothing.
    pub hold_s: R,
    /// Holding ends when the sum over the wheels of the integral of torque squared has reached this since the command came
    /// to rest \[N^2.m^2.s\], 0 to 1e9.
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
    bleed_periods: u32,
    hold_periods: u32,
    hold_heat: R,
    period_s: R,
}

constant_struct!(RestRule<R> { bleed_periods: u32, hold_periods: u32, hold_heat: R, period_s: R });

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
        // Half a period less than nothing of rounding: 0.5 s of 1 ms are 500 periods in f32 too.
        let periods = |time: R| (time.as_f64() / period_s.as_f64() + 0.5) as u32;
        Ok(Self {
            bleed_periods: periods(bleed_s).max(1),
            hold_periods: periods(hold_s),
            hold_heat,
            period_s,
        })
    }

    pub(super) fn period_s(&self) -> R {
        self.period_s
    }

    /// After a step with every reference at 0 that gave `applied_n_m`: the integrals as they are then.
    #[inline(never)]
    pub(super) fn step<const N: usize>(&self, state: &mut ControlState<R, N>, applied_n_m: &[R; N]) {
        if state.rest_periods < self.hold_periods {
            for torque in applied_n_m {
                state.rest_heat_n2m2s += *torque * *torque * self.period_s;
            }
            if state.rest_heat_n2m2s < self.hold_heat {
                state.rest_periods += 1;
                return;
            }
            // Hot: as if the time were over.
            state.rest_periods = self.hold_periods;
        }
        let bled = state.rest_periods - self.hold_periods;
        if bled < self.bleed_periods {
            state.rest_periods += 1;
            // One part of those that are left: a straight line to exactly 0.
            let left = self.bleed_periods - bled;
            let kept = R::of(f64::from(left - 1)) / R::of(f64::from(left));
            state.integral_n_m = state.integral_n_m.map(|integral| integral * kept);
        } else {
            state.integral_n_m = [R::zero(); N];
        }
    }
}

/// Every reference is 0.
#[inline]
pub(super) fn is_rest<R: Real, const N: usize>(reference: &WheelVelocities<R, N>) -> bool {
    // One wheel that turns is enough to know, and while driving that is mostly the first.
    reference.rad_s.iter().all(|r| *r == R::zero())
}
