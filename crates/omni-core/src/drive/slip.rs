//! Slip detection by redundancy; a slipping wheel is left out of the forward kinematics until it grips again.
//!
//! Seven wheels determine three motions four times over. A wheel that slips or has lost the ground breaks that
//! agreement; the residual of the other wheels identifies it (data snooping, Baarda 1968).

#[cfg(test)]
mod tests;

use super::periods_of;
use crate::constants::constant_struct;
use crate::error::within;
use crate::geometry::{BodyTwist, Kinematics, WheelVelocities};
use crate::{ConfigError, Real};

/// When a wheel counts as slipping. Hysteresis in size and time. Checked by [`SlipDetector::new`].
///
/// ```
/// use omni_core::drive::{SlipConfig, SlipDetector, SlipState};
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
/// let config = SlipConfig { enter_rad_s: 1.0, leave_rad_s: 0.5, enter_periods: 1, leave_periods: 1 };
/// let (detector, mut state) = (SlipDetector::new(config)?, SlipState::new(&kinematics));
/// // Out above 1 rad/s, in again below 0.5 rad/s: in between it stays as it is.
/// let left_out = [0.9, 1.1, 0.9, 0.6, 0.4].map(|slip| {
///     detector.step(&kinematics, &mut state, &[0.0, 0.0, 0.0, slip, 0.0, 0.0, 0.0].into()).excluded[3]
/// });
/// assert_eq!(left_out.map(u8::from), [0, 1, 1, 1, 0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct SlipConfig<R> {
    /// Slip \[rad/s\] of the actuator above which a wheel is suspected, 1e-9 or more; infinite never.
    pub enter_rad_s: R,
    /// Slip \[rad/s\] below which it is trusted again, 0 to `enter_rad_s`.
    pub leave_rad_s: R,
    /// Control periods in a row that a wheel must be suspected before it is left out, 1 to 65535.
    pub enter_periods: u16,
    /// Consecutive control periods below `leave_rad_s` before it is included again, 1 to 65535.
    pub leave_periods: u16,
}

constant_struct!(SlipConfig<R> { enter_rad_s: R, leave_rad_s: R, enter_periods: u16, leave_periods: u16 });

impl<R: Real> SlipConfig<R> {
    /// Usual values for a control period \[s\]: excluded after 10 ms above 2 rad/s, included again after 50 ms below 1
    /// rad/s, in whole periods.
    ///
    /// ```
    /// use omni_core::drive::SlipConfig;
    /// let slow = SlipConfig { enter_rad_s: 3.0, ..SlipConfig::usual(0.005_f32) };
    /// assert_eq!((slow.enter_periods, slow.leave_periods, slow.leave_rad_s), (2, 10, 1.0));
    /// ```
    #[must_use]
    pub fn usual(period_s: R) -> Self {
        Self {
            enter_rad_s: R::of(2.0),
            leave_rad_s: R::one(),
            enter_periods: periods_of(0.01, period_s),
            leave_periods: periods_of(0.05, period_s),
        }
    }

    /// No wheel is ever suspected.
    pub(crate) fn never() -> Self {
        let (enter_rad_s, leave_rad_s) = (R::one() / R::zero(), R::zero());
        Self {
            enter_rad_s,
            leave_rad_s,
            enter_periods: u16::MAX,
            leave_periods: u16::MAX,
        }
    }
}

/// Finds the wheel that slips and estimates the motion without it.
///
/// ```
/// use omni_core::drive::{SlipConfig, SlipDetector, SlipState};
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
/// let config = SlipConfig { enter_rad_s: 1.0, leave_rad_s: 0.5, enter_periods: 3, leave_periods: 20 };
/// let detector = SlipDetector::new(config)?;
/// let mut state = SlipState::new(&kinematics);
/// let mut wheels = kinematics.inverse(&BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 });
/// wheels.rad_s[4] += 2.0; // wheel 5 spins 2 rad/s too fast
/// for period in 1..=3 {
///     let sample = detector.step(&kinematics, &mut state, &wheels);
///     assert!((sample.slip_rad_s[4] - 2.0).abs() < 1e-12);
///     assert_eq!(sample.excluded[4], period == 3);
/// }
/// let sample = detector.step(&kinematics, &mut state, &wheels);
/// assert!((sample.estimated.vx_m_s - 0.3).abs() < 1e-12); // as if it were not there
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct SlipDetector<R> {
    config: SlipConfig<R>,
}

constant_struct!(SlipDetector<R> { config: SlipConfig<R> });

/// The detector's state: the excluded wheels, the time for which each seemed to slip, and the forward map of the
/// remaining wheels.
///
/// ```
/// use omni_core::drive::{SlipConfig, SlipDetector, SlipState};
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
/// let config = SlipConfig { enter_rad_s: 1.0, leave_rad_s: 0.5, enter_periods: 1, leave_periods: 1 };
/// let (detector, mut state) = (SlipDetector::new(config)?, SlipState::new(&kinematics));
/// let spins = [0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0].into();
/// // Wheel 4 shifts the first estimate by a fifth of 5 * 0.066 m/s; the state excludes it in the second.
/// let estimated = [0; 2].map(|_| detector.step(&kinematics, &mut state, &spins).estimated.vx_m_s);
/// assert!((estimated[0] - 0.066).abs() < 1e-12 && estimated[1] == 0.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SlipState<R, const N: usize> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    slipping: [bool; N],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    declared: [bool; N],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    periods: [u16; N],
    observed: Kinematics<R, N>,
    /// `1 - (A A+)_ii` of the map in use.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    redundancy: [R; N],
}

/// One step of the detector. Arrays are in the layout's order; nothing in it is NaN for finite measurements.
///
/// ```
/// use omni_core::drive::{SlipConfig, SlipDetector, SlipState};
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
/// let config = SlipConfig { enter_rad_s: 1.0, leave_rad_s: 0.5, enter_periods: 1, leave_periods: 1 };
/// let mut state = SlipState::new(&kinematics);
/// // One of four slips by 2 rad/s. Each has a quarter of the one check, and it could have been any of them.
/// let sample = SlipDetector::new(config)?.step(&kinematics, &mut state, &[7.0, 5.0, 5.0, 5.0].into());
/// for (rest, slip) in sample.residual.rad_s.iter().zip(sample.slip_rad_s) {
///     assert!((rest.abs() - 2.0 / 4.0).abs() < 1e-12 && (slip.abs() - 2.0).abs() < 1e-12);
/// }
/// assert!(sample.unattributed && sample.excluded == [false; 4]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct SlipSample<R, const N: usize> {
    /// The motion by the trusted wheels.
    pub estimated: BodyTwist<R>,
    /// Residual velocity of each wheel relative to that motion \[rad/s\]; for an excluded wheel, its whole slip.
    pub residual: WheelVelocities<R, N>,
    /// Slip \[rad/s\] of each wheel if it alone slips: the residual over the wheel's redundancy. 0 for a wheel that the
    /// others cannot check.
    pub slip_rad_s: [R; N],
    /// The wheels disagree, but what they say fits the slip of several of them equally well, and none is
    /// excluded: always so with four wheels (one check), and between wheels 2 and 6 of the seven-wheel vehicle.
    pub unattributed: bool,
    /// The others can check this wheel: its `slip_rad_s` means something.
    pub checked: [bool; N],
    /// Left out of the forward map from the next step on: found slipping, or declared.
    pub excluded: [bool; N],
}

impl<R: Real, const N: usize> SlipSample<R, N> {
    /// Nothing is known of the motion: too few wheels determine it.
    pub(crate) fn unknown(excluded: [bool; N]) -> Self {
        Self {
            estimated: BodyTwist::ZERO,
            residual: WheelVelocities::zero(),
            slip_rad_s: [R::zero(); N],
            unattributed: false,
            checked: [false; N],
            excluded,
        }
    }
}

impl<R: Real, const N: usize> SlipState<R, N> {
    /// All wheels trusted.
    #[must_use]
    pub fn new(kinematics: &Kinematics<R, N>) -> Self {
        Self {
            slipping: [false; N],
            declared: [false; N],
            periods: [0; N],
            observed: *kinematics,
            redundancy: kinematics.redundancy(),
        }
    }

    /// The maps in use: the full inverse map, and the forward map of the trusted wheels.
    #[must_use]
    pub fn observed(&self) -> &Kinematics<R, N> {
        &self.observed
    }

    /// Wheels left out of the forward map: those found slipping and those declared.
    ///
    /// ```
    /// use omni_core::drive::SlipState;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
    /// let mut state = SlipState::new(&kinematics);
    /// state.declare(&kinematics, &[false, true, false, false, false, false, false]);
    /// assert_eq!(state.excluded().iter().position(|&out| out), Some(1)); // wheel 2
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn excluded(&self) -> [bool; N] {
        let mut out = self.declared;
        for (out, &slipping) in out.iter_mut().zip(&self.slipping) {
            *out |= slipping;
        }
        out
    }

    /// Declares which wheels do not count: lifted, lost, or with a broken encoder. They stay out
    /// until declared otherwise.
    ///
    /// False if the remaining wheels would not determine the three motions; then nothing changes, except that wheels
    /// found slipping are included again.
    ///
    /// ```
    /// use omni_core::drive::SlipState;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
    /// let mut state = SlipState::new(&kinematics);
    /// assert!(state.declare(&kinematics, &[true, false, false, false])); // three wheels, three motions
    /// assert!((state.observed().forward(&[99.0, 5.0, 5.0, 5.0].into()).vx_m_s - 0.5).abs() < 1e-12);
    /// assert!(!state.declare(&kinematics, &[true, true, false, false]));
    /// assert_eq!(state.excluded(), [true, false, false, false]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn declare(&mut self, kinematics: &Kinematics<R, N>, out: &[bool; N]) -> bool {
        if *out == self.declared {
            return true;
        }
        let before = *self;
        self.declared = *out;
        if self.refresh(kinematics) {
            return true;
        }
        // A doubtful wheel is better than none.
        (self.slipping, self.periods) = ([false; N], [0; N]);
        let enough = self.refresh(kinematics);
        if !enough {
            self.declared = before.declared;
            self.refresh(kinematics);
        }
        enough
    }

    /// Forms the forward map anew. False if too few wheels are left; then nothing changes.
    fn refresh(&mut self, kinematics: &Kinematics<R, N>) -> bool {
        let excluded = self.excluded();
        // The map as chosen, be it least squares or not, while every wheel is trusted.
        let observed = if excluded.contains(&true) {
            kinematics.excluding(&excluded)
        } else {
            Some(*kinematics)
        };
        match observed {
            Some(observed) => {
                self.observed = observed;
                self.redundancy = observed.redundancy();
                true
            }
            None => false,
        }
    }
}

/// Factor by which the suspect's slip must explain more of the disagreement than the slip of any other wheel.
const MARGIN: f64 = 1.25;

/// Redundancy below which the others check a wheel too little to exclude it.
#[doc(hidden)]
pub const LEAST_REDUNDANCY: f64 = 0.05;

impl<R: Real> SlipDetector<R> {
    /// A detector as configured.
    ///
    /// # Errors
    /// The field of [`SlipConfig`] that is out of range, by its name.
    pub fn new(config: SlipConfig<R>) -> Result<Self, ConfigError> {
        let enter = within(
            "enter_rad_s",
            config.enter_rad_s,
            1e-9..=f64::INFINITY,
            "1e-9 or more",
        )?
        .as_f64();
        within("leave_rad_s", config.leave_rad_s, 0.0..=enter, "0 to enter_rad_s")?;
        for (name, periods) in [
            ("enter_periods", config.enter_periods),
            ("leave_periods", config.leave_periods),
        ] {
            if periods == 0 {
                return Err(ConfigError::new(name, 0.0, "1 to 65535"));
            }
        }
        Ok(Self { config })
    }

    /// One step: evaluates the actuator velocities `measured` \[rad/s\] for the vehicle's motion and for each other.
    ///
    /// The suspect is the wheel whose slip alone would explain most of the squared residual (the w-test of data
    /// snooping), a quarter more than the slip of any other wheel; a wheel of whose slip the other wheels see less than
    /// a twentieth is not suspected. At most one wheel is left out a step, the most suspected. A measurement of a
    /// declared wheel may be anything finite. Closed form, O(N).
    ///
    /// ```
    /// use omni_core::drive::{SlipConfig, SlipDetector, SlipState};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
    /// let config = SlipConfig { enter_rad_s: 1.0, leave_rad_s: 0.5, enter_periods: 1, leave_periods: 1 };
    /// let mut state = SlipState::new(&kinematics);
    /// // Forward with 3 rad/s; wheel 4 lags by 2. A fifth of that passes for motion, four fifths do not.
    /// let measured = [3.0, 0.0, -3.0, 1.0, 3.0, 0.0, -3.0].into();
    /// let sample = SlipDetector::new(config)?.step(&kinematics, &mut state, &measured);
    /// assert!((sample.estimated.vx_m_s - (3.0 - 2.0 / 5.0) * 0.066).abs() < 1e-12);
    /// assert!((sample.residual.rad_s[3] + 2.0 * 0.8).abs() < 1e-12 && (sample.slip_rad_s[3] + 2.0).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step<const N: usize>(
        &self,
        kinematics: &Kinematics<R, N>,
        state: &mut SlipState<R, N>,
        measured: &WheelVelocities<R, N>,
    ) -> SlipSample<R, N> {
        let estimated = state.observed.forward(measured);
        let mut residual = *measured;
        for (rest, explained) in residual
            .rad_s
            .iter_mut()
            .zip(kinematics.inverse(&estimated).rad_s)
        {
            *rest -= explained;
        }
        let zero = R::zero();
        let (mut slip_rad_s, mut checked) = ([zero; N], [false; N]);
        let (mut suspect, mut weight, mut runner_up, mut changed) = (None, zero, zero, false);
        for i in 0..N {
            let redundancy = state.redundancy[i];
            if redundancy < R::of(LEAST_REDUNDANCY) {
                state.periods[i] = 0;
                continue;
            }
            let slip = residual.rad_s[i] / redundancy;
            (slip_rad_s[i], checked[i]) = (slip, true);
            if state.slipping[i] {
                // Left out, its redundancy is 1: the residual is the slip.
                state.periods[i] = if slip.abs() < self.config.leave_rad_s {
                    state.periods[i].saturating_add(1)
                } else {
                    0
                };
                if state.periods[i] >= self.config.leave_periods {
                    (state.slipping[i], state.periods[i], changed) = (false, 0, true);
                }
            } else if !state.declared[i] {
                // The wheel whose slip alone would explain most of the residual: w-test of data snooping, squared.
                let explains = residual.rad_s[i] * slip;
                if explains > weight {
                    let suspected = slip.abs() > self.config.enter_rad_s;
                    (suspect, weight, runner_up) = (suspected.then_some(i), explains, weight);
                } else if explains > runner_up {
                    runner_up = explains;
                }
            }
        }
        let unattributed = suspect.is_some() && weight < R::of(MARGIN) * runner_up;
        if unattributed {
            suspect = None;
        }
        for i in 0..N {
            if state.slipping[i] || state.declared[i] {
                continue;
            }
            state.periods[i] = if suspect == Some(i) {
                state.periods[i].saturating_add(1)
            } else {
                0
            };
            if state.periods[i] >= self.config.enter_periods {
                state.slipping[i] = true;
                state.periods[i] = 0;
                // If too few wheels would remain, the wheel stays included.
                state.slipping[i] = kinematics.excluding(&state.excluded()).is_some();
                changed |= state.slipping[i];
            }
        }
        if changed {
            state.refresh(kinematics);
        }
        SlipSample {
            estimated,
            residual,
            slip_rad_s,
            unattributed,
            checked,
            excluded: state.excluded(),
        }
    }
}
