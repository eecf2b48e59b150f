//! Speeds, times and places of a supervisor, and how its retries follow each other.

use crate::constants::constant_struct;
use crate::error::{each_within, period, within};
use crate::{ConfigError, Real};

/// Sequence of retries if the vehicle is stuck.
///
/// ```
/// use omni_core::traction::SupervisorConfig;
/// let retry = SupervisorConfig::traction_runup(1e-3_f64).retry;
/// assert!(retry.run_up_m_s + 3.0 * retry.run_up_more_m_s > retry.run_up_m_s);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct RetrySchedule<R> {
    /// Retries a row at most, 0 to 100; 0: none.
    pub retries: u16,
    /// Backs off so fast \[m/s\], 0.001 to 100, and so far \[m\], 0 to 100; further by so much each try, up to so far.
    pub back_off_m_s: R,
    /// Distance of the first retry \[m\].
    pub back_off_m: R,
    /// Increment of the distance per retry \[m\].
    pub back_off_more_m: R,
    /// No further than this \[m\].
    pub back_off_max_m: R,
    /// The same for the first row, which has nothing behind it that could fall off an edge: further
    /// each time, and at most \[m\].
    pub first_row_more_m: R,
    /// No further than this for the first row \[m\].
    pub first_row_max_m: R,
    /// Slow retries: at `slow_retry_m_s`, without slip allowed and without spin.
    pub slow_retries: u16,
    /// Speed of these \[m/s\], 0.001 to 100.
    pub slow_retry_m_s: R,
    /// Speed of the run-up of the first try after these \[m/s\], 0.001 to 100.
    pub run_up_m_s: R,
    /// Increment of the speed per retry \[m/s\], 0 to 100.
    pub run_up_more_m_s: R,
    /// A run-up lasts no longer \[s\], 0.001 to 100, unless its speed takes longer for the way that was backed off.
    pub run_up_s: R,
    /// No run-up is faster than so many times the command, 1 to 100.
    pub run_up_times: R,
    /// It ends where the vehicle is stuck again for this time \[s\]; 0: only with its time.
    pub stuck_again_s: R,
    /// Slip that the climbing row is allowed for each try \[m/s\], 0 to 100.
    pub allowance_m_s: R,
    /// Slip that it is spun up to in a run-up \[m/s\], 0 to 100; 0: not at all.
    pub spin_m_s: R,
    /// Increment per retry \[m/s\], 0 to 100.
    pub spin_more_m_s: R,
    /// Gain of that, in multiples of the thrust's, 0 to 100.
    pub spin_gain: R,
    /// Part of the speed of a try that succeeded with which later rows are approached, 0 to 1.
    pub later_rows_part: R,
    /// Part of the spin with which they are, 0 to 1.
    pub later_rows_spin: R,
}

constant_struct!(RetrySchedule<R> {
    retries: u16, back_off_m_s: R, back_off_m: R, back_off_more_m: R, back_off_max_m: R, first_row_more_m: R, first_row_max_m: R,
    slow_retries: u16, slow_retry_m_s: R, run_up_m_s: R, run_up_more_m_s: R, run_up_s: R, run_up_times: R, stuck_again_s: R, allowance_m_s: R, spin_m_s: R,
    spin_more_m_s: R, spin_gain: R, later_rows_part: R, later_rows_spin: R
});

/// Speeds, times and places of a [`super::Supervisor`].
///
/// ```
/// use omni_core::traction::SupervisorConfig;
/// assert_eq!(SupervisorConfig::traction(1e-3_f64).retry.spin_m_s, 0.0); // wheels are never spun up
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct SupervisorConfig<R> {
    /// Control period \[s\], 1e-6 to 10.
    pub period_s: R,
    /// The target speed changes no faster \[m/s^2\], 0.001 to 1e6.
    pub acceleration_m_s2: R,
    /// It is never above this, forward and lateral \[m/s\], each 0.001 to 100.
    pub max_m_s: [R; 2],
    /// Part of the commanded speed by which it is raised for the second row, and for those behind it, 0 to 10.
    pub boost: [R; 2],
    /// A row that stands higher than the next by this is up \[m\], 0.0001 to 99.
    pub height_m: R,
    /// At this height the speed is raised by the whole of `boost`, in proportion below \[m\]: `height_m` + 0.0001 to
    /// 100.
    pub boost_height_m: R,
    /// The vehicle is stuck below this speed \[m/s\], or this part of its target, above this part
    /// of the largest thrust, for this long \[s\].
    pub stuck_m_s: R,
    /// Part of the target below which it is stuck, 0 to 1.
    pub stuck_part: R,
    /// Part of the largest thrust above which it is, 0 to 1.
    pub stuck_thrust: R,
    /// Time for which it is \[s\], 0.001 to 100.
    pub stuck_s: R,
    /// Thrust that carries the vehicle's weight, as a multiple of the largest thrust, 0.01 to 1000. A vehicle that
    /// pushes for seconds with a fifth of its weight, beyond what the slope takes, is stuck though its wheels turn.
    pub weight_thrust: R,
    /// Nothing counts as stuck so shortly after the vehicle was commanded to go \[s\], 0 to 100.
    pub starting_s: R,
    /// All rows level for this long: the obstacle is behind \[s\], 0 to 100.
    pub level_s: R,
    /// Highest edge that the vehicle climbs, by a climb chart \[m\], 0.001 to 100; 100 if no chart is known. Where a
    /// wheel has climbed a higher one there is one retry at most.
    pub climbs_m: R,
    /// Action if it is stuck.
    pub retry: RetrySchedule<R>,
}

constant_struct!(SupervisorConfig<R> {
    period_s: R, acceleration_m_s2: R, max_m_s: [R; 2], boost: [R; 2], height_m: R, boost_height_m: R, stuck_m_s: R, stuck_part: R, stuck_thrust: R, stuck_s: R,
    weight_thrust: R, starting_s: R, level_s: R, climbs_m: R, retry: RetrySchedule<R>
});

impl<R: Real> SupervisorConfig<R> {
    /// As [`crate::traction::TractionConfig::traction`]: a slow second try, no wheel is spun up. For its numbers the
    /// same holds.
    ///
    /// ```
    /// assert_eq!(omni_core::traction::SupervisorConfig::traction(1e-3_f64).retry.retries, 8);
    /// ```
    #[must_use]
    pub fn traction(period_s: R) -> Self {
        let (of, zero) = (R::of, R::zero());
        Self {
            period_s,
            acceleration_m_s2: of(4.0),
            max_m_s: [of(1.0); 2],
            boost: [of(0.1936), of(0.1524)],
            height_m: of(0.01),
            boost_height_m: of(0.04),
            stuck_m_s: of(0.04),
            stuck_part: zero,
            stuck_thrust: of(0.9),
            stuck_s: of(0.308),
            weight_thrust: of(2.5),
            starting_s: of(0.5),
            level_s: of(0.5),
            climbs_m: of(100.0),
            retry: RetrySchedule {
                retries: 8,
                back_off_m_s: of(0.3),
                back_off_m: of(0.130),
                back_off_more_m: of(0.05),
                back_off_max_m: of(0.22),
                first_row_more_m: of(0.05),
                first_row_max_m: of(0.22),
                slow_retries: 0,
                slow_retry_m_s: of(0.505),
                run_up_m_s: of(0.505),
                run_up_more_m_s: of(0.0173),
                run_up_s: R::one(),
                run_up_times: of(2.0),
                stuck_again_s: zero,
                allowance_m_s: of(0.264),
                spin_m_s: zero,
                spin_more_m_s: zero,
                spin_gain: zero,
                later_rows_part: zero,
                later_rows_spin: zero,
            },
        }
    }

    /// As [`crate::traction::TractionConfig::traction_runup`]: every try is faster, and the climbing row is spun up
    /// before the impact. This requires motors with a speed reserve: `spin_m_s` at the rim beyond the speed of the
    /// run-up.
    ///
    /// ```
    /// assert!(omni_core::traction::SupervisorConfig::traction_runup(1e-3_f64).retry.spin_m_s > 0.9);
    /// ```
    #[must_use]
    pub fn traction_runup(period_s: R) -> Self {
        let of = R::of;
        let traction = Self::traction(period_s);
        Self {
            acceleration_m_s2: of(4.6915),
            boost: [of(0.2238), of(0.2312)],
            stuck_part: of(0.5),
            stuck_thrust: of(0.6),
            stuck_s: of(0.2887),
            retry: RetrySchedule {
                back_off_m: of(0.1099),
                back_off_more_m: of(0.05),
                back_off_max_m: of(0.27),
                first_row_more_m: of(0.0884),
                first_row_max_m: of(0.40),
                slow_retries: 1,
                slow_retry_m_s: of(0.5354),
                run_up_m_s: of(0.8476),
                run_up_more_m_s: of(0.1578),
                run_up_times: of(4.0),
                stuck_again_s: of(0.1251),
                allowance_m_s: of(1.1139),
                spin_m_s: of(2.64),
                spin_more_m_s: of(0.3335),
                spin_gain: of(0.9295),
                later_rows_part: of(0.93),
                later_rows_spin: of(0.3146),
                ..traction.retry
            },
            ..traction
        }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        period(self.period_s)?;
        let retry = &self.retry;
        each_within(
            &[
                ("max_m_s", self.max_m_s[0]),
                ("max_m_s", self.max_m_s[1]),
                ("back_off_m_s", retry.back_off_m_s),
                ("slow_retry_m_s", retry.slow_retry_m_s),
                ("run_up_m_s", retry.run_up_m_s),
            ],
            &(1e-3..=100.0),
            "0.001 to 100",
        )?;
        each_within(
            &[
                ("back_off_m", retry.back_off_m),
                ("back_off_more_m", retry.back_off_more_m),
                ("back_off_max_m", retry.back_off_max_m),
                ("first_row_more_m", retry.first_row_more_m),
                ("first_row_max_m", retry.first_row_max_m),
                ("run_up_more_m_s", retry.run_up_more_m_s),
                ("stuck_again_s", retry.stuck_again_s),
                ("allowance_m_s", retry.allowance_m_s),
                ("spin_m_s", retry.spin_m_s),
                ("spin_more_m_s", retry.spin_more_m_s),
                ("spin_gain", retry.spin_gain),
                ("stuck_m_s", self.stuck_m_s),
                ("starting_s", self.starting_s),
                ("level_s", self.level_s),
            ],
            &(0.0..=100.0),
            "0 to 100",
        )?;
        each_within(
            &[
                ("stuck_part", self.stuck_part),
                ("stuck_thrust", self.stuck_thrust),
                ("later_rows_part", retry.later_rows_part),
                ("later_rows_spin", retry.later_rows_spin),
            ],
            &(0.0..=1.0),
            "0 to 1",
        )?;
        each_within(
            &[
                ("stuck_s", self.stuck_s),
                ("run_up_s", retry.run_up_s),
                ("climbs_m", self.climbs_m),
            ],
            &(1e-3..=100.0),
            "0.001 to 100",
        )?;
        within("weight_thrust", self.weight_thrust, 0.01..=1000.0, "0.01 to 1000")?;
        within("run_up_times", retry.run_up_times, 1.0..=100.0, "1 to 100")?;
        for boost in self.boost {
            within("boost", boost, 0.0..=10.0, "0 to 10")?;
        }
        within(
            "acceleration_m_s2",
            self.acceleration_m_s2,
            1e-3..=1e6,
            "0.001 to 1e6",
        )?;
        within("height_m", self.height_m, 1e-4..=99.0, "0.0001 to 99")?;
        let least = self.height_m.as_f64() + 1e-4;
        within(
            "boost_height_m",
            self.boost_height_m,
            least..=100.0,
            "height_m + 0.0001 to 100",
        )?;
        if retry.retries > 100 {
            return Err(ConfigError::new("retries", f64::from(retry.retries), "0 to 100"));
        }
        Ok(())
    }
}
