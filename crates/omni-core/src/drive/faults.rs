//! Fault detection of encoders and actuators; a faulty wheel is named and left out.

mod config;

pub use config::FaultConfig;

use crate::constants::constant_struct;
use crate::error::each_within;
use crate::geometry::WheelVelocities;
use crate::scalar::is_plausible;
use crate::{ConfigError, Real};

/// The fault of a wheel.
///
/// ```
/// use omni_core::drive::{Fault, FaultMonitor, FaultState};
/// # let (mut config, expected) = (omni_core::examples::faults(), omni_core::examples::nothing_expected());
/// config.silent_periods = 2;
/// let (monitor, mut state) = (FaultMonitor::new(config)?, FaultState::default());
/// monitor.step(&mut state, &[Some(3.0)], &expected);
/// assert_eq!(monitor.step(&mut state, &[None], &expected).rad_s, [3.0]); // the last reading stands
/// assert_eq!(monitor.step(&mut state, &[None], &expected).rad_s, [0.0]); // not any longer
/// assert_eq!(state.faults(), [Some(Fault::Silent)]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum Fault {
    /// Its reading is NaN, infinite, or beyond 1e6 rad/s.
    NotANumber = 1,
    /// Its reading jumps further in one period than a wheel can.
    Jump = 2,
    /// Its reading never changes although the vehicle moves, or although the motor pulls: an
    /// encoder that is dead, or a wheel that is blocked.
    Stuck = 3,
    /// No reading has arrived for too long.
    Silent = 4,
    /// It has been declared lost.
    Lost = 5,
}

impl Fault {
    /// The number that stands for it in frames, in C and in tables, 1 to 5 in the order above; 0 is
    /// no fault. It never changes.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }
}

/// Watches the readings of all wheels. Immutable; the changing state is in [`FaultState`].
///
/// ```
/// use omni_core::drive::{Fault, FaultMonitor, FaultState};
/// # let (mut config, expected) = (omni_core::examples::faults(), omni_core::examples::nothing_expected());
/// config.jump_periods = 3;
/// let (monitor, mut state) = (FaultMonitor::new(config)?, FaultState::default());
/// monitor.step(&mut state, &[Some(1.0)], &expected);
/// // No wheel gains 8 rad/s in a period. Twice the reading before stands for it, then the wheel is released.
/// let velocities = [0; 3].map(|_| monitor.step(&mut state, &[Some(9.0)], &expected).rad_s[0]);
/// assert_eq!(velocities, [1.0, 1.0, 0.0]);
/// assert_eq!(state.faults(), [Some(Fault::Jump)]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct FaultMonitor<R> {
    config: FaultConfig<R>,
}

constant_struct!(FaultMonitor<R> { config: FaultConfig<R> });

/// The monitor's state; `default` is a fresh start.
///
/// ```
/// use omni_core::drive::{Fault, FaultMonitor, FaultState};
/// # let (mut config, expected) = (omni_core::examples::faults(), omni_core::examples::nothing_expected());
/// config.recovery_periods = 2;
/// let (monitor, mut state) = (FaultMonitor::new(config)?, FaultState::default());
/// monitor.step(&mut state, &[Some(f64::NAN)], &expected);
/// assert_eq!(monitor.step(&mut state, &[Some(1.0)], &expected).rad_s, [0.0]); // one good reading is not enough
/// assert_eq!(state.faults(), [Some(Fault::NotANumber)]);
/// assert_eq!(monitor.step(&mut state, &[Some(1.1)], &expected).rad_s, [1.1]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub struct FaultState<R, const N: usize> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    wheel: [WheelHistory<R>; N],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    lost: [bool; N],
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct WheelHistory<R> {
    /// Last reading accepted, and the periods without any reading since.
    accepted: Option<R>,
    gap: u16,
    /// Last finite reading, accepted or not, and the periods without any since.
    last: Option<R>,
    last_gap: u16,
    /// Velocity by the other wheels when the reading last changed.
    said_then: Option<R>,
    fault: Option<Fault>,
    /// The reading has changed since the fault.
    alive: bool,
    jumping: u16,
    /// Tenths of periods.
    evidence: R,
    silent: u16,
    good: u16,
}

/// Weight of a period of evidence, of a period in which only the torque contradicts a reading, and of one in which it
/// contradicts several, which may be a vehicle before an obstacle.
const FULL: f64 = 10.0;
const FAINT: f64 = 1.0;
const FAINTEST: f64 = 0.5;

impl<R: Real> WheelHistory<R> {
    const FRESH: Self = Self {
        accepted: None,
        gap: 0,
        last: None,
        last_gap: 0,
        said_then: None,
        fault: None,
        alive: false,
        jumping: 0,
        evidence: R::ZERO,
        silent: 0,
        good: 0,
    };

    fn fail(&mut self, fault: Fault) {
        self.fault.get_or_insert(fault);
        (self.good, self.alive) = (0, false);
    }
}

impl<R: Real, const N: usize> Default for FaultState<R, N> {
    fn default() -> Self {
        Self {
            wheel: [WheelHistory::FRESH; N],
            lost: [false; N],
        }
    }
}

impl<R: Real, const N: usize> FaultState<R, N> {
    /// Declares which wheels are lost: no torque, not counted, whatever they read, until declared otherwise.
    ///
    /// ```
    /// use omni_core::drive::{Fault, FaultMonitor, FaultState};
    /// # let (mut config, expected) = (omni_core::examples::faults(), omni_core::examples::nothing_expected());
    /// config.recovery_periods = 2;
    /// let (monitor, mut state) = (FaultMonitor::new(config)?, FaultState::default());
    /// state.declare_lost(&[false, true]);
    /// assert_eq!(monitor.step(&mut state, &[Some(1.0), Some(1.0)], &expected).rad_s, [1.0, 0.0]);
    /// state.declare_lost(&[false; 2]); // mended
    /// assert_eq!(monitor.step(&mut state, &[Some(1.0), Some(1.0)], &expected).rad_s, [1.0, 1.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn declare_lost(&mut self, lost: &[bool; N]) {
        self.lost = *lost;
    }

    /// Forgets every fault but what is declared lost: each reading is judged afresh. A fault whose
    /// cause lasts comes back.
    ///
    /// ```
    /// use omni_core::drive::FaultState;
    /// let mut state = FaultState::<f64, 3>::default();
    /// state.declare_lost(&[false, true, false]);
    /// state.clear();
    /// assert_eq!(state.faults().iter().flatten().count(), 1); // what is lost stays lost
    /// ```
    pub fn clear(&mut self) {
        self.wheel = [WheelHistory::FRESH; N];
    }

    /// Names wheels that traction control leaves out: without torque there is no evidence that the
    /// monitor could find by itself.
    pub(crate) fn doubt(&mut self, doubted: [bool; N]) {
        for (wheel, doubted) in self.wheel.iter_mut().zip(doubted) {
            if doubted {
                wheel.fail(Fault::Stuck);
            }
        }
    }

    /// Which wheels have a velocity to go on with: no fault, and at least one reading so far.
    ///
    /// ```
    /// use omni_core::drive::FaultState;
    /// let usable = FaultState::<f64, 2>::default().usable();
    /// assert_eq!(usable.iter().filter(|usable| **usable).count(), 0); // nothing has been read yet
    /// ```
    #[must_use]
    pub fn usable(&self) -> [bool; N] {
        let mut usable = self
            .wheel
            .map(|wheel| wheel.fault.is_none() && wheel.accepted.is_some());
        for (usable, &lost) in usable.iter_mut().zip(&self.lost) {
            *usable &= !lost;
        }
        usable
    }

    /// The fault of each wheel, in the layout's order; none if its readings are accepted. [`Fault::Lost`] hides any
    /// other.
    ///
    /// ```
    /// use omni_core::drive::{Fault, FaultState};
    /// let mut state = FaultState::<f64, 4>::default();
    /// state.declare_lost(&[false, false, true, false]);
    /// assert_eq!(state.faults().iter().position(|fault| *fault == Some(Fault::Lost)), Some(2));
    /// assert_eq!(state.faults().iter().flatten().count(), 1);
    /// ```
    #[must_use]
    pub fn faults(&self) -> [Option<Fault>; N] {
        let mut faults = self.wheel.map(|wheel| wheel.fault);
        for (fault, &lost) in faults.iter_mut().zip(&self.lost) {
            if lost {
                *fault = Some(Fault::Lost);
            }
        }
        faults
    }
}

/// The values that readings are compared with.
///
/// ```
/// use omni_core::drive::{Expectation, Fault, FaultMonitor, FaultState};
/// use omni_core::WheelVelocities;
/// # let mut config = omni_core::examples::faults();
/// config.stuck_periods = 3;
/// # let zero = WheelVelocities::zero();
/// let (monitor, mut state) = (FaultMonitor::new(config)?, FaultState::default());
/// // By what the others say both wheels speed up from 2 to 6 rad/s, but the second they do not determine.
/// for k in 0..=5 {
///     let by_others = WheelVelocities { rad_s: [2.0 + 0.8 * f64::from(k); 2] };
///     let checked = [true, false];
///     let expected = Expectation { by_others: &by_others, checked: &checked, reference: &zero, torque_n_m: &[0.0; 2] };
///     monitor.step(&mut state, &[Some(2.0), Some(2.0)], &expected); // never changes
/// }
/// # let (by_others, checked) = (WheelVelocities { rad_s: [6.0; 2] }, [true, false]);
/// # let expected = Expectation { by_others: &by_others, checked: &checked, reference: &zero, torque_n_m: &[0.0; 2] };
/// assert_eq!(state.faults(), [Some(Fault::Stuck), None]);
/// assert_eq!(monitor.step(&mut state, &[Some(2.0), Some(2.0)], &expected).rad_s, [0.0, 2.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expectation<'a, R, const N: usize> {
    /// Velocity \[rad/s\] of each wheel that the other wheels imply.
    pub by_others: &'a WheelVelocities<R, N>,
    /// Which of these are worth something: the others must determine it.
    pub checked: &'a [bool; N],
    /// Reference of the last step \[rad/s\].
    pub reference: &'a WheelVelocities<R, N>,
    /// Torque applied in the last step \[N.m\].
    pub torque_n_m: &'a [R; N],
}

impl<R: Real> FaultMonitor<R> {
    /// A monitor as configured.
    ///
    /// # Errors
    /// The field of [`FaultConfig`] that is out of range, by its name.
    pub fn new(config: FaultConfig<R>) -> Result<Self, ConfigError> {
        each_within(
            &[
                ("jump_rad_s", config.jump_rad_s),
                ("stuck_rad_s", config.stuck_rad_s),
                ("stuck_torque_n_m", config.stuck_torque_n_m),
            ],
            &(1e-9..=f64::INFINITY),
            "1e-9 or more, infinite for no check",
        )?;
        for (name, value, least, allowed) in [
            ("jump_periods", config.jump_periods, 1, "1 to 65535"),
            ("stuck_periods", config.stuck_periods, 2, "2 to 65535"),
            ("silent_periods", config.silent_periods, 1, "1 to 65535"),
            ("recovery_periods", config.recovery_periods, 1, "1 to 65535"),
        ] {
            if value < least {
                return Err(ConfigError::new(name, f64::from(value), allowed));
            }
        }
        Ok(Self { config })
    }

    /// Whether it detects encoders that read 0 while motors apply torque.
    pub(crate) fn judges_standing(&self) -> bool {
        self.config.stuck_periods != u16::MAX && self.config.stuck_torque_n_m.is_finite_real()
    }

    /// One step: readings in (`None` if none has arrived), velocities for further use out. A faulty wheel's is 0 and
    /// not to be used: see [`FaultState::faults`]. Never NaN. O(N).
    ///
    /// ```
    /// use omni_core::drive::{Expectation, Fault, FaultMonitor, FaultState};
    /// use omni_core::WheelVelocities;
    /// let (monitor, mut state) = (FaultMonitor::new(omni_core::examples::faults())?, FaultState::default());
    /// let nothing = WheelVelocities::zero();
    /// let expected = Expectation { by_others: &nothing, checked: &[false; 2], reference: &nothing, torque_n_m: &[0.0; 2] };
    /// monitor.step(&mut state, &[Some(1.0), Some(1.0)], &expected);
    /// // Wheel 1 reads NaN, wheel 2 jumps by 9 rad/s: the jump is bridged for five periods.
    /// let velocities = monitor.step(&mut state, &[Some(f64::NAN), Some(10.0)], &expected);
    /// assert_eq!(velocities.rad_s, [0.0, 1.0]);
    /// assert_eq!(state.faults(), [Some(Fault::NotANumber), None]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step<const N: usize>(
        &self,
        state: &mut FaultState<R, N>,
        readings: &[Option<R>; N],
        expected: &Expectation<'_, R, N>,
    ) -> WheelVelocities<R, N> {
        let mut velocities = WheelVelocities::zero();
        let mut turning = state.wheel.map(|wheel| self.is_turning(&wheel));
        for (turning, &lost) in turning.iter_mut().zip(&state.lost) {
            *turning &= !lost;
        }
        let turn = turning.iter().filter(|turning| **turning).count();
        let mut others_change = false;
        for i in 0..N {
            let others_turn = turn > usize::from(turning[i]);
            let pulls = self.pulls_in_vain(state, expected, i, others_turn);
            let by_others = expected.checked[i].then_some(expected.by_others.rad_s[i]);
            let wheel = &mut state.wheel[i];
            let was_faulty = wheel.fault.is_some();
            let trusted = self.judge(wheel, readings[i], by_others, pulls);
            others_change |= wheel.fault.is_some() != was_faulty;
            if !state.lost[i] && wheel.fault.is_none() {
                velocities.rad_s[i] = trusted;
            }
        }
        if others_change {
            // With a wheel more or less the others say something else, and no wheel has moved for that.
            for wheel in &mut state.wheel {
                (wheel.said_then, wheel.evidence) = (None, R::zero());
            }
        }
        velocities
    }

    /// Evidence against a reading, should it stay the same: that the motor pulls in vain. None if nothing speaks
    /// against it.
    fn pulls_in_vain<const N: usize>(
        &self,
        state: &FaultState<R, N>,
        expected: &Expectation<'_, R, N>,
        i: usize,
        others_turn: bool,
    ) -> Option<R> {
        let wheel = state.wheel.get(i)?;
        let torque = expected.torque_n_m[i];
        let away = expected.reference.rad_s[i] - wheel.last.unwrap_or(R::zero());
        let hard = torque.abs() >= self.config.stuck_torque_n_m;
        let towards = torque * away > R::zero();
        // From a wheel without a count any reference is away.
        let no_count = wheel.last == Some(R::zero());
        let is_away = away.abs() > self.config.stuck_rad_s || (no_count && towards);
        // If another wheel is pulled hard without a count too, the vehicle more probably stands before an obstacle. Yet
        // encoders of one supply die together, and then nothing else says how the vehicle runs away.
        let alone = || {
            let wheels = state
                .wheel
                .iter()
                .zip(expected.torque_n_m)
                .zip(&expected.reference.rad_s);
            !wheels.enumerate().any(|(j, ((wheel, torque), &reference))| {
                j != i
                    && wheel.last == Some(R::zero())
                    && torque.abs() >= self.config.stuck_torque_n_m
                    && *torque * reference > R::zero()
            })
        };
        if !expected.checked[i] {
            return if !hard || !(is_away || towards) {
                None
            } else if N > 3 {
                Some(R::of(if alone() { FAINT } else { FAINTEST }))
            } else {
                // Of three wheels no other ever determines it.
                Some(R::of(if is_away && others_turn { FULL } else { FAINT }))
            };
        }
        if !no_count || !towards {
            return (hard && towards).then_some(R::of(FAINT));
        }
        // Without a count, although the others say that it turns. At a crawl they say little, and
        // the angle counts that it turns by.
        let said = expected.by_others.rad_s[i] / self.config.stuck_rad_s;
        if said.abs() > R::one() {
            return Some(R::of(FAINT));
        }
        let pulled = if torque < R::zero() { -said } else { said };
        hard.then(|| {
            if alone() {
                pulled * R::of(FAINT)
            } else {
                R::of(FAINTEST)
            }
        })
    }

    /// Judges one reading; returns the velocity for further use if the wheel has no fault.
    fn judge(
        &self,
        wheel: &mut WheelHistory<R>,
        reading: Option<R>,
        by_others: Option<R>,
        pulls: Option<R>,
    ) -> R {
        let config = &self.config;
        let reached = |count: u16, limit: u16| count >= limit && limit != u16::MAX;
        let Some(reading) = reading else {
            wheel.gap = wheel.gap.saturating_add(1);
            wheel.last_gap = wheel.last_gap.saturating_add(1);
            wheel.silent = wheel.silent.saturating_add(1);
            if reached(wheel.silent, config.silent_periods) {
                wheel.fail(Fault::Silent);
            }
            return wheel.accepted.unwrap_or(R::zero());
        };
        wheel.silent = 0;
        if !is_plausible(reading) {
            wheel.last_gap = wheel.last_gap.saturating_add(1);
            wheel.fail(Fault::NotANumber);
            return R::zero();
        }
        let changed = wheel.last.is_none_or(|last| last != reading);
        let smooth = wheel
            .last
            .is_none_or(|last| self.reaches(last, reading, wheel.last_gap));
        (wheel.last, wheel.last_gap) = (Some(reading), 0);
        if changed {
            (wheel.said_then, wheel.evidence) = (by_others, R::zero());
        }
        if let Some(fault) = wheel.fault {
            wheel.alive |= changed;
            let agrees = by_others.is_none_or(|v| (reading - v).abs() <= config.stuck_rad_s);
            let good = smooth && agrees && (wheel.alive || fault != Fault::Stuck);
            wheel.good = if good { wheel.good.saturating_add(1) } else { 0 };
            if reached(wheel.good, config.recovery_periods) {
                let reading = Some(reading);
                *wheel = WheelHistory {
                    accepted: reading,
                    last: reading,
                    said_then: by_others,
                    ..WheelHistory::FRESH
                };
            }
            return reading;
        }
        if let Some(accepted) = wheel.accepted
            && !self.reaches(accepted, reading, wheel.gap)
        {
            wheel.jumping = wheel.jumping.saturating_add(1);
            if reached(wheel.jumping, config.jump_periods) {
                wheel.fail(Fault::Jump);
            }
            return accepted;
        }
        wheel.jumping = wheel.jumping.saturating_sub(1);
        (wheel.accepted, wheel.gap) = (Some(reading), 0);
        // Standing still is no fault: only a reading that stays while it should have moved.
        let moved = match (wheel.said_then, by_others) {
            (Some(then), Some(now)) => (now - then).abs() > config.stuck_rad_s,
            _ => {
                wheel.said_then = wheel.said_then.or(by_others);
                false
            }
        };
        let speaks = if moved { Some(R::of(FULL)) } else { pulls };
        wheel.evidence = match speaks {
            Some(speaks) if !changed => (wheel.evidence + speaks).max(R::zero()),
            _ => R::zero(),
        };
        let limit = config.stuck_periods;
        if limit != u16::MAX && wheel.evidence >= R::of(FULL) * R::of(f64::from(limit)) {
            wheel.fail(Fault::Stuck);
        }
        reading
    }

    /// A wheel whose readings are accepted and that was last read to turn.
    fn is_turning(&self, wheel: &WheelHistory<R>) -> bool {
        let read = wheel.accepted.unwrap_or(R::zero());
        wheel.fault.is_none() && read.abs() > self.config.stuck_rad_s
    }

    /// Whether a wheel can change from one velocity to another in one period plus the missed periods.
    fn reaches(&self, from: R, to: R, missed: u16) -> bool {
        (to - from).abs() <= self.config.jump_rad_s * (R::one() + R::of(f64::from(missed)))
    }
}

#[cfg(test)]
mod tests;
