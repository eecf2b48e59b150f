//! Velocity from the counts of a coarse encoder.

#[cfg(test)]
mod tests;

use crate::constants::{constant_enum, constant_struct};
use crate::error::{period, within};
use crate::{ConfigError, Real};

/// Longest window \[control periods\].
pub const LONGEST_WINDOW: usize = 32;

/// The longest time between two readings \[s\] that counts as one.
const LONGEST_WAIT_S: f64 = 1e3;

/// A counter that moves by no more than this many counts stands, or toggles about an edge.
const STANDING_COUNTS: i32 = 2;

/// For at least this time \[s\], and for as long as a wheel of [`SLOWEST_RAD_S`] takes for one count more.
const STANDING_S: f64 = 0.1;
const SLOWEST_RAD_S: f64 = 0.25;

/// Method that estimates a velocity from counts.
///
/// With a count of angle `d`, a period `T` and a wheel that turns steadily, the reading is off by
/// at most (in brackets what it lags behind a wheel that speeds up):
///
/// | method | off by at most | lag |
/// |---|---|---|
/// | `Window` | `d / (n T)` | `n T / 2` |
/// | `Edges` | the time stamps' error over the time between edges, as a part of the velocity | half the time between edges, or `T / 2` |
/// | `Observer` | `bandwidth d / e`, e = 2.718, and 2 % where `bandwidth T` is near 0.5 | `2 / bandwidth` |
///
/// ```
/// use omni_core::estimate::VelocityMethod;
/// assert_eq!(VelocityMethod::<f32>::default(), VelocityMethod::Window { periods: 1 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum VelocityMethod<R> {
    /// Counts of the last `periods` readings, 1 to 32, over their time.
    Window {
        /// Readings, one each control period.
        periods: u16,
    },
    /// Counts between the last edges of two periods that had some, over the time between those
    /// edges (the M/T method: at low speeds the time of one count, at high speeds the counts of a
    /// period). Wants the time of the last edge: an input capture, or an interrupt.
    Edges,
    /// A second-order tracking observer (a phase-locked loop): it follows the counted angle with
    /// both poles at this bandwidth.
    Observer {
        /// Bandwidth \[rad/s\], 0.001 to 1 over the control period.
        bandwidth_rad_s: R,
    },
}

impl<R> Default for VelocityMethod<R> {
    /// The counts of one period.
    fn default() -> Self {
        Self::Window { periods: 1 }
    }
}

/// The configuration of a [`VelocityEstimator`].
///
/// ```
/// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
/// let config = VelocityConfig {
///     method: VelocityMethod::Window { periods: 4 },
///     count_rad: core::f64::consts::TAU / 360.0,
///     period_s: 0.001,
/// };
/// let (estimator, mut state) = (VelocityEstimator::<_, 4>::new(config)?, VelocityState::default());
/// // One count in four periods: 1 degree in 4 ms.
/// let read = [1, 0, 0, 0].map(|counts| estimator.step(&mut state, counts, None));
/// assert!((read[3] - 250.0_f64.to_radians()).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VelocityConfig<R> {
    /// How.
    pub method: VelocityMethod<R>,
    /// Angle of one count \[rad\], 1e-9 to 7: [`crate::estimate::EncoderCounter::count_rad`].
    pub count_rad: R,
    /// Control period \[s\], 0.000001 to 10.
    pub period_s: R,
}

/// Velocity out of counts, by the method that its configuration chooses.
///
/// Once no count comes any more the velocity falls: the wheel turned less than a count since, so by every method
/// it is at most one count over the time without. A counter that has stayed within two counts for
/// [`VelocityEstimator::standing_s`] stands, or toggles about an edge: the velocity is exactly 0 by every method
/// until it has left them. Therefore an encoder with a cut wire, whose counter stands or toggles, repeats one reading,
/// and a [`FaultMonitor`](crate::drive::FaultMonitor) detects it. A wheel slower than three counts in that time
/// occasionally reads 0; that is at most 0.25 rad/s for coarse encoders, and 30 counts per second for fine ones.
///
/// Nothing divides by a time or by counts that can be zero, and every reading is finite.
///
/// The state holds the counts of `WINDOW` readings, 1 unless given: an observer, edges and a window
/// of one need no more.
///
/// ```
/// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
/// let count_rad = core::f64::consts::TAU / 360.0;
/// let edges = VelocityConfig { method: VelocityMethod::Edges, count_rad, period_s: 0.001 };
/// let (estimator, mut state) = (VelocityEstimator::<_>::new(edges)?, VelocityState::default());
/// // 5 rad/s: a count every 3.49 ms. A count over a period would read 0 or 17.5 rad/s.
/// let mut read = 0.0;
/// for k in 1..100 {
///     let at = |time_s: f64| (5.0 * time_s / count_rad).floor() as i32;
///     let now_s = f64::from(k) * 0.001;
///     let since_edge_s = now_s - f64::from(at(now_s)) * count_rad / 5.0;
///     read = estimator.step(&mut state, at(now_s) - at(now_s - 0.001), Some(since_edge_s));
/// }
/// assert!((read - 5.0).abs() < 1e-9);
/// // Then the wheel stands, and a while later that is known.
/// assert!((estimator.standing_s() - 3.0 * count_rad / 0.25).abs() < 0.001);
/// for _ in 0..200 {
///     read = estimator.step(&mut state, 0, None);
/// }
/// assert!(read > 0.0 && read <= count_rad / 0.2); // at most a count in the fifth of a second since
/// for _ in 0..50 {
///     read = estimator.step(&mut state, 0, None);
/// }
/// assert_eq!(read, 0.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct VelocityEstimator<R, const WINDOW: usize = 1> {
    law: VelocityLaw<R>,
    count_rad: R,
    period_s: R,
    standing_periods: u32,
}

constant_struct!(VelocityEstimator<R, const WINDOW> { law: VelocityLaw<R>, count_rad: R, period_s: R, standing_periods: u32 });

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
/// How velocities are made of counts.
#[repr(C, u8)]
pub enum VelocityLaw<R> {
    /// [`VelocityMethod::Window`].
    Window {
        /// Control periods, 1 to 32.
        periods: u16,
        /// Velocity of one count in the window \[rad/s\].
        rad_s_per_count: R,
    },
    /// [`VelocityMethod::Edges`].
    Edges,
    /// [`VelocityMethod::Observer`]: correction for an angle error of 1 rad in a period.
    Observer {
        /// Bandwidth \[rad/s\].
        bandwidth_rad_s: R,
        /// Part of the angle.
        angle: R,
        /// Velocity \[rad/s\].
        rate_per_s: R,
    },
}

constant_enum!(VelocityLaw<R> { Window { periods, rad_s_per_count }, Edges, Observer { bandwidth_rad_s, angle, rate_per_s } });

/// The state of one wheel's counts; `default` at rest.
///
/// ```
/// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
/// let config = VelocityConfig { method: VelocityMethod::default(), count_rad: 0.01, period_s: 0.001 };
/// let mut state = VelocityState::default();
/// let read = VelocityEstimator::<f64>::new(config)?.step(&mut state, 2, None);
/// assert!((read - 20.0).abs() < 1e-9); // two counts in a millisecond
/// assert!(size_of::<VelocityState<f32>>() <= 72 && size_of::<VelocityState<f32, 32>>() <= 320); // bytes
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct VelocityState<R, const WINDOW: usize = 1> {
    /// Ring buffer of the counts of the last readings, and the time by which each exceeded a period \[s\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    counts: [i32; WINDOW],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    longer_s: [R; WINDOW],
    /// The index of the next, and the number until all lasted one period.
    next: u8,
    uneven: u8,
    sum: i64,
    /// Time since the last reading beyond the present period \[s\], and what is left over of whole periods.
    waited_s: R,
    left_s: R,
    /// Which way the last edge went: 0 before the first.
    way: i8,
    /// Age of the last edge when its period ended \[s\], and periods since without one.
    aged_s: R,
    quiet: u32,
    /// Lowest and highest count since the counter last left two counts, from the present one, and the periods since.
    lowest: i32,
    highest: i32,
    stood: u32,
    /// Angle estimated beyond the counted one \[rad\].
    beyond_rad: R,
    rate_rad_s: R,
}

impl<R: Real, const WINDOW: usize> VelocityState<R, WINDOW> {
    /// Before the first count: the wheel stands.
    ///
    /// ```
    /// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
    /// let config = VelocityConfig { method: VelocityMethod::default(), count_rad: 0.01, period_s: 0.001 };
    /// let mut state = VelocityState::at_rest();
    /// let read = VelocityEstimator::<f64>::new(config)?.step(&mut state, 2, None);
    /// assert!((read - 20.0).abs() < 1e-9); // two counts in a millisecond
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub const fn at_rest() -> Self {
        Self {
            counts: [0; WINDOW],
            longer_s: [R::ZERO; WINDOW],
            next: 0,
            uneven: 0,
            sum: 0,
            waited_s: R::ZERO,
            left_s: R::ZERO,
            way: 0,
            aged_s: R::ZERO,
            quiet: u32::MAX,
            lowest: 0,
            highest: 0,
            stood: 0,
            beyond_rad: R::ZERO,
            rate_rad_s: R::ZERO,
        }
    }
}

impl<R: Real, const WINDOW: usize> Default for VelocityState<R, WINDOW> {
    fn default() -> Self {
        Self::at_rest()
    }
}

impl<R: Real, const WINDOW: usize> VelocityEstimator<R, WINDOW> {
    /// An estimator of that configuration. A window of several periods needs as many places:
    /// `VelocityEstimator::<f32, 8>::new(..)`.
    ///
    /// # Errors
    /// Parameter `count_rad`, `period_s`, `periods` or `bandwidth_rad_s` if it is out of range. A bandwidth beyond one
    /// over the period would be the counts of a period again; one below a thousandth of that is lost in rounding.
    pub fn new(config: VelocityConfig<R>) -> Result<Self, ConfigError> {
        let count_rad = within("count_rad", config.count_rad, 1e-9..=7.0, "1e-9 to 7")?;
        let period_s = period(config.period_s)?;
        let law = match config.method {
            VelocityMethod::Window { periods } => {
                if !(1..=LONGEST_WINDOW.min(WINDOW)).contains(&usize::from(periods)) {
                    let allowed = "1 to 32, and up to the estimator's WINDOW";
                    return Err(ConfigError::new("periods", f64::from(periods), allowed));
                }
                VelocityLaw::Window {
                    periods,
                    rad_s_per_count: count_rad / (R::of(f64::from(periods)) * period_s),
                }
            }
            VelocityMethod::Edges => VelocityLaw::Edges,
            VelocityMethod::Observer { bandwidth_rad_s } => {
                let allowed = "0.001 to 1 over the control period";
                // Beside its rounding the ends belong to the range.
                let steps = bandwidth_rad_s * period_s;
                if within("", steps, 0.999_999e-3..=1.000_001, allowed).is_err() {
                    return Err(ConfigError::new(
                        "bandwidth_rad_s",
                        bandwidth_rad_s.as_f64(),
                        allowed,
                    ));
                }
                let [angle, rate_per_s] = observer_gains(bandwidth_rad_s, period_s);
                VelocityLaw::Observer {
                    bandwidth_rad_s,
                    angle,
                    rate_per_s,
                }
            }
        };
        let most = (f64::from(STANDING_COUNTS) + 1.0) * count_rad.as_f64() / SLOWEST_RAD_S;
        let standing_s = if most > STANDING_S { most } else { STANDING_S };
        // Rounded, and at least two periods; the cast saturates.
        let standing_periods = ((standing_s / period_s.as_f64() + 0.5) as u32).max(2);
        Ok(Self {
            law,
            count_rad,
            period_s,
            standing_periods,
        })
    }

    /// Time for which a counter must stay within two counts before its wheel counts as standing \[s\]: 0.1, or the time
    /// of three counts at 0.25 rad/s if that is longer, in whole control periods, at least two.
    ///
    /// ```
    /// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod};
    /// let of = |counts| {
    ///     let count_rad = core::f64::consts::TAU / counts;
    ///     VelocityEstimator::<f64>::new(VelocityConfig { method: VelocityMethod::Edges, count_rad, period_s: 0.001 })
    /// };
    /// assert!((of(2048.0)?.standing_s() - 0.1).abs() < 1e-12);
    /// assert!((of(64.0)?.standing_s() - 1.178).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn standing_s(&self) -> R {
        whole::<R>(i64::from(self.standing_periods)) * self.period_s
    }

    /// Takes in the counts since the last reading, positive forwards, and returns the velocity \[rad/s\]. To
    /// be called every control period; [`VelocityEstimator::missed`] stands for a period without a reading.
    ///
    /// `since_edge_s` is the time from the last edge to the end of the period \[s\], of a period with
    /// counts; without it (or if it is not within the time since the last reading) `Edges` assumes 0, with an error of
    /// up to a period over the time between edges. The other methods do not look at it.
    ///
    /// ```
    /// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
    /// let method = VelocityMethod::Observer { bandwidth_rad_s: 50.0_f64 };
    /// let estimator = VelocityEstimator::<_>::new(VelocityConfig { method, count_rad: 0.01, period_s: 0.001 })?;
    /// let mut state = VelocityState::default();
    /// let mut read = 0.0;
    /// for _ in 0..1000 {
    ///     read = estimator.step(&mut state, 3, None); // 0.03 rad a millisecond
    /// }
    /// assert!((read - 30.0).abs() < 1e-9);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step(&self, state: &mut VelocityState<R, WINDOW>, counts: i32, since_edge_s: Option<R>) -> R {
        let since_reading_s = self.period_s + state.waited_s;
        self.advance(state, counts, since_reading_s, since_edge_s)
    }

    /// A control period passes without a reading: the next counts include this period.
    ///
    /// ```
    /// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityState};
    /// let config = VelocityConfig { method: Default::default(), count_rad: 0.01_f64, period_s: 0.001 };
    /// let (estimator, mut state) = (VelocityEstimator::<_>::new(config)?, VelocityState::default());
    /// estimator.step(&mut state, 2, None);
    /// estimator.missed(&mut state);
    /// assert!((estimator.step(&mut state, 4, None) - 20.0).abs() < 1e-9); // four counts in two periods
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn missed(&self, state: &mut VelocityState<R, WINDOW>) {
        state.waited_s = (state.waited_s + self.period_s).limited(R::zero(), R::of(LONGEST_WAIT_S));
    }

    /// [`VelocityEstimator::step`] with a measured time since the last reading: `since_reading_s` \[s\], a thousandth
    /// of the control period to 1000 s. Outside of that, or NaN, it counts as the control period. Periods that were
    /// [missed](Self::missed) are part of it.
    ///
    /// ```
    /// use omni_core::estimate::{VelocityConfig, VelocityEstimator, VelocityState};
    /// let config = VelocityConfig { method: Default::default(), count_rad: 0.001_f64, period_s: 0.005 };
    /// let (estimator, mut state) = (VelocityEstimator::<_>::new(config)?, VelocityState::default());
    /// // 10 rad/s, read after 4.7 and 5.4 ms in turn.
    /// assert!((estimator.step_after(&mut state, 47, 0.0047, None) - 10.0).abs() < 1e-9);
    /// assert!((estimator.step_after(&mut state, 54, 0.0054, None) - 10.0).abs() < 1e-9);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step_after(
        &self,
        state: &mut VelocityState<R, WINDOW>,
        counts: i32,
        since_reading_s: R,
        since_edge_s: Option<R>,
    ) -> R {
        let plausible =
            since_reading_s >= R::of(1e-3) * self.period_s && since_reading_s <= R::of(LONGEST_WAIT_S);
        let since_reading_s = if plausible { since_reading_s } else { self.period_s };
        self.advance(state, counts, since_reading_s, since_edge_s)
    }

    #[inline]
    fn advance(
        &self,
        state: &mut VelocityState<R, WINDOW>,
        counts: i32,
        passed_s: R,
        since_edge_s: Option<R>,
    ) -> R {
        let even = passed_s == self.period_s;
        state.waited_s = R::zero();
        let between = self.pass_time(state, counts, passed_s, since_edge_s);
        let rate = match self.law {
            VelocityLaw::Window {
                periods,
                rad_s_per_count,
            } => {
                let periods = usize::from(periods).clamp(1, LONGEST_WINDOW);
                let place = usize::from(state.next) % periods;
                if let (Some(held), Some(longer_s)) =
                    (state.counts.get_mut(place), state.longer_s.get_mut(place))
                {
                    state.sum += i64::from(counts) - i64::from(*held);
                    (*held, *longer_s) = (counts, passed_s - self.period_s);
                }
                state.next = ((place + 1) % periods) as u8;
                state.uneven = if even {
                    state.uneven.saturating_sub(1)
                } else {
                    periods as u8
                };
                if state.uneven == 0 {
                    whole::<R>(state.sum) * rad_s_per_count
                } else {
                    self.uneven_rad_s(state, periods)
                }
            }
            VelocityLaw::Edges => {
                if let Some((edges, time_s)) = between {
                    state.rate_rad_s = whole::<R>(edges) * self.count_rad / time_s;
                }
                state.rate_rad_s
            }
            VelocityLaw::Observer {
                bandwidth_rad_s,
                angle,
                rate_per_s,
            } => {
                let [angle, rate_per_s] = if even {
                    [angle, rate_per_s]
                } else {
                    observer_gains(bandwidth_rad_s, passed_s)
                };
                let counted_rad = whole::<R>(i64::from(counts)) * self.count_rad;
                let off = state.beyond_rad + state.rate_rad_s * passed_s - counted_rad;
                state.beyond_rad = off - angle * off;
                state.rate_rad_s -= rate_per_s * off;
                state.rate_rad_s
            }
        };
        let periods = if even {
            1
        } else {
            self.whole_periods(state, passed_s)
        };
        if self.stands(state, counts, periods) {
            R::zero()
        } else if counts == 0 {
            let most = self.most_rad_s(state);
            rate.limited(-most, most)
        } else {
            rate
        }
    }

    /// The velocity of a window whose readings did not all last one period \[rad/s\].
    #[cold]
    fn uneven_rad_s(&self, state: &VelocityState<R, WINDOW>, periods: usize) -> R {
        let mut time_s = whole::<R>(periods as i64) * self.period_s;
        for &longer_s in state.longer_s.iter().take(periods) {
            time_s += longer_s;
        }
        // Rounding leaves no less than what the shortest times add up to.
        let least_s = R::of(1e-3) * self.period_s;
        whole::<R>(state.sum) * self.count_rad / if time_s > least_s { time_s } else { least_s }
    }

    /// The whole control periods within the time that passed; what is left over counts later.
    #[cold]
    fn whole_periods(&self, state: &mut VelocityState<R, WINDOW>, passed_s: R) -> u32 {
        let time_s = state.left_s + passed_s;
        let periods = (time_s / self.period_s).whole_part(); // saturates, at 0 too
        state.left_s = time_s - whole::<R>(i64::from(periods)) * self.period_s;
        periods
    }

    /// Has the counter stayed within two counts for long enough?
    #[inline]
    fn stands(&self, state: &mut VelocityState<R, WINDOW>, counts: i32, periods: u32) -> bool {
        let (lowest, highest) = (
            state.lowest.saturating_sub(counts),
            state.highest.saturating_sub(counts),
        );
        (state.lowest, state.highest) = (lowest.min(0), highest.max(0));
        if state.highest.saturating_sub(state.lowest) > STANDING_COUNTS {
            (state.lowest, state.highest, state.stood) = (0, 0, 0);
        } else {
            state.stood = state.stood.saturating_add(periods);
        }
        state.stood >= self.standing_periods
    }

    /// Lets the time pass. Where it had counts: how many edges lie between its last one and the
    /// last one before, and how much time.
    #[inline]
    fn pass_time(
        &self,
        state: &mut VelocityState<R, WINDOW>,
        counts: i32,
        passed_s: R,
        since_edge_s: Option<R>,
    ) -> Option<(i64, R)> {
        if counts == 0 {
            state.quiet = state.quiet.saturating_add(1);
            state.aged_s += passed_s - self.period_s;
            return None;
        }
        let way = if counts > 0 { 1 } else { -1 };
        let age_s = match since_edge_s {
            Some(age) if age >= R::zero() && age <= passed_s => age,
            _ => R::zero(),
        };
        let between = (state.way != 0).then(|| {
            // An edge passed forwards and then backwards is one and the same.
            let edges = i64::from(counts) + i64::from(way < 0) - i64::from(state.way < 0);
            let time_s = self.since_s(state) + passed_s - age_s;
            // At a steady velocity no less than half of it passes; stamps that say so are out of order.
            let least_s = R::of(0.5) * passed_s;
            (edges, if time_s > least_s { time_s } else { least_s })
        });
        (state.way, state.aged_s, state.quiet) = (way, age_s, 0);
        between
    }

    /// Time since the last edge at the end of the last period \[s\].
    #[inline]
    fn since_s(&self, state: &VelocityState<R, WINDOW>) -> R {
        whole::<R>(i64::from(state.quiet)) * self.period_s + state.aged_s
    }

    /// The fastest that a wheel without a count since the last reading can turn on average \[rad/s\].
    #[inline]
    fn most_rad_s(&self, state: &VelocityState<R, WINDOW>) -> R {
        // At least the last period, which had no count; readings that come faster say no more.
        let since_s = self.since_s(state);
        self.count_rad
            / if since_s > self.period_s {
                since_s
            } else {
                self.period_s
            }
    }
}

/// What an angle off by 1 rad corrects of an observer after `passed_s` \[s\]: parts of the angle and of the velocity
/// \[rad/s\]. Both poles at p = exp(-bandwidth T): the angle keeps p^2 of its error, and (1 - p)^2 goes to the rate.
fn observer_gains<R: Real>(bandwidth_rad_s: R, passed_s: R) -> [R; 2] {
    let off = -(-(bandwidth_rad_s * passed_s)).exp_m1();
    [off * (R::of(2.0) - off), off * off / passed_s]
}

/// A whole number as a scalar, without `f64` for `f32`.
#[inline]
fn whole<R: Real>(number: i64) -> R {
    R::from_i64(number).unwrap_or(R::zero()) // every i64 has a nearest value
}
