//! Limiting factor of a vehicle that makes no progress: whether its wheels slip or its motors stand at their limit.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::config::{Scenario, WheelSpec};
use crate::control_sample::ControlSample;
use crate::observation::Observation;

/// A wheel slips where its rim slides by more than this part of the commanded way.
const SLIDES_PART: f64 = 0.1;
/// A motor is at its limit from this part of it on.
const FULL_PART: f64 = 0.9;
/// For so much of the time.
const MOST_OF_IT: f64 = 0.5;
/// Motors push if one of them applies this fraction of its largest torque.
const PUSHES_PART: f64 = 0.01;
/// What is judged: the last so many windows of so many periods' time \[ns\] in which motors pushed, a second together.
const WINDOWS: usize = 10;
const WINDOW_US: u64 = 100_000;

/// Factor that limited a vehicle's commanded motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LimitedBy {
    /// Motors were at their limit, and their wheels stood.
    Torque,
    /// Wheels slipped: the ground transmitted no more.
    Friction,
    /// Neither: when the time ended it still moved, or its loops had not brought up the torque.
    Time,
}

impl LimitedBy {
    /// The name in tables and logs, as `torque`.
    ///
    /// ```
    /// assert_eq!(omni_sim::LimitedBy::Friction.name(), "friction");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::Friction => "friction",
            Self::Time => "time",
        }
    }
}

/// What the wheels do while motors push.
pub(super) struct Effort {
    period_us: u64,
    way_per_rad: Vec<f64>,
    peak_n_m: f64,
    time_us: u64,
    /// Since the start.
    now: Vec<Sums>,
    /// The time and the same at the beginning of each of the last windows.
    windows: VecDeque<(u64, Vec<Sums>)>,
}

/// Of one wheel.
#[derive(Clone, Copy, Default)]
struct Sums {
    asked_m: f64,
    slid_m: f64,
    full_us: u64,
}

impl Effort {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let vehicle = scenario.vehicle();
        Self {
            period_us: scenario.control.period_us,
            way_per_rad: vehicle.wheel.iter().map(WheelSpec::way_per_rad).collect(),
            peak_n_m: vehicle.motor.peak_torque_n_m(),
            time_us: 0,
            now: vec![Sums::default(); vehicle.wheel.len()],
            windows: VecDeque::new(),
        }
    }

    pub(super) fn push(&mut self, sample: &ControlSample, seen: &Observation) {
        let least_n_m = PUSHES_PART * self.peak_n_m;
        if seen.wheels.iter().all(|wheel| wheel.torque_n_m.abs() < least_n_m) {
            return;
        }
        if self.time_us % WINDOW_US < self.period_us {
            if self.windows.len() == WINDOWS {
                self.windows.pop_front();
            }
            self.windows.push_back((self.time_us, self.now.clone()));
        }
        self.time_us += self.period_us;
        let period_s = self.period_us as f64 * 1e-6;
        let wheels = sample.wheels.iter().zip(&seen.wheels).zip(&self.way_per_rad);
        for (sums, ((signals, wheel), way_per_rad)) in self.now.iter_mut().zip(wheels) {
            let asked_m = (signals.reference_rad_s * way_per_rad).abs() * period_s;
            if asked_m.is_finite() {
                sums.asked_m += asked_m;
            }
            if wheel.touches() {
                sums.slid_m += (wheel.rim_m_s - wheel.along_m_s).abs() * period_s;
            }
            let limit_n_m = if wheel.torque_n_m > 0.0 {
                signals.limit_upper_n_m
            } else {
                -signals.limit_lower_n_m
            };
            // A controller of one's own may say nothing of limits.
            let limit_n_m = limit_n_m.min(self.peak_n_m);
            if wheel.torque_n_m.abs() >= FULL_PART * limit_n_m {
                sums.full_us += self.period_us;
            }
        }
    }

    /// What limited it in the last second in which motors pushed, and how many wheels slipped or
    /// stood at the limit of their motors.
    pub(super) fn limited(&self) -> (LimitedBy, usize) {
        let Some((from_us, then)) = self.windows.front() else {
            return (LimitedBy::Time, 0);
        };
        let last = self.now.iter().zip(then).map(|(now, then)| Sums {
            asked_m: now.asked_m - then.asked_m,
            slid_m: now.slid_m - then.slid_m,
            full_us: now.full_us - then.full_us,
        });
        let most_us = MOST_OF_IT * (self.time_us - from_us) as f64;
        let (mut driven, mut slipped, mut full) = (0, 0, 0);
        for wheel in last.filter(|wheel| wheel.asked_m > 0.0) {
            driven += 1;
            if wheel.slid_m > SLIDES_PART * wheel.asked_m {
                slipped += 1;
            } else if wheel.full_us as f64 >= most_us {
                full += 1;
            }
        }
        if slipped > 0 && (2 * slipped >= driven || full == 0) {
            (LimitedBy::Friction, slipped)
        } else if full > 0 {
            (LimitedBy::Torque, full)
        } else {
            (LimitedBy::Time, 0)
        }
    }
}
