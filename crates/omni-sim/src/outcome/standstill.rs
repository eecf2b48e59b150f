//! Standstill: motors apply their full torque and the vehicle does not move.

use super::criteria::farthest_wheel_m;
use crate::config::Scenario;
use crate::observation::Observation;

/// A vehicle stands if it stays within this distance of its position \[m\]; yaw counts as the distance of the farthest
/// wheel about the origin.
const STANDS_M: f64 = 0.02;
/// This part of the torque that the motor has at standstill is all of it.
const FULL_PART: f64 = 0.9;

/// Time for which a standing vehicle's motors applied their full torque.
pub(super) struct Standstill {
    reach_m: f64,
    period_us: u64,
    full_n_m: f64,
    /// Where it stands: x, y \[m\], heading \[rad\].
    at: Option<([f64; 2], f64)>,
    now: Span,
    longest: Span,
}

/// A time of full torque.
#[derive(Clone, Copy, Default)]
struct Span {
    /// Since the run's start.
    from_us: u64,
    time_us: u64,
}

impl Standstill {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self {
            reach_m: farthest_wheel_m(scenario),
            period_us: scenario.control.period_us,
            full_n_m: FULL_PART * scenario.vehicle().motor.peak_torque_n_m(),
            at: None,
            now: Span::default(),
            longest: Span::default(),
        }
    }

    /// Adds a period; `heading_rad` does not jump at half a turn.
    pub(super) fn push(&mut self, seen: &Observation, heading_rad: f64) {
        let [x, y, _] = seen.pose.position_m;
        let stays = self.at.is_some_and(|([from_x, from_y], from_rad)| {
            let turned_m = self.reach_m * (heading_rad - from_rad).abs();
            libm::hypot(x - from_x, y - from_y) + turned_m < STANDS_M
        });
        if !stays {
            (self.at, self.now) = (Some(([x, y], heading_rad)), Span::default());
        }
        let full = seen
            .wheels
            .iter()
            .any(|wheel| wheel.torque_n_m.abs() >= self.full_n_m);
        if full {
            if self.now.time_us == 0 {
                self.now.from_us = (seen.time_ns / 1000).saturating_sub(self.period_us);
            }
            self.now.time_us += self.period_us;
        }
        if self.now.time_us > self.longest.time_us {
            self.longest = self.now;
        }
    }

    /// The longest such time \[s\].
    pub(super) fn longest_s(&self) -> f64 {
        self.longest.time_us as f64 / 1e6
    }

    /// When that began, from the start of the run \[s\]; none if there was none.
    pub(super) fn began_s(&self) -> Option<f64> {
        (self.longest.time_us > 0).then_some(self.longest.from_us as f64 / 1e6)
    }
}
