//! A vehicle that pushes against something that holds it, such as an edge that it does not climb.
//!
//! All wheels may turn there for seconds. The accelerometer has seen the vehicle stop, but its bias hides that after a
//! while. The torques do not: what pushes hard and neither accelerates nor rises is held.

use crate::Real;
use crate::scalar::{all_plausible, follow, max};

/// Time constant of the averages \[s\].
const PUSH_S: f64 = 0.1;
/// Acceleration by the wheels' torques that something takes \[m/s^2\]: more than rolling friction and an uneven torque.
const TAKEN_M_S2: f64 = 1.0;
/// The same, from which the vehicle is held whatever it seems to do: no vehicle tows so much without slip.
const HELD_M_S2: f64 = 3.0;
/// Speed of the wheels along the push from which they turn \[m/s\]; part of it that the vehicle has at most.
const TURNS_M_S: f64 = 0.05;
const PART: f64 = 0.5;
/// Rate at which a wheel that climbs rises at least \[m/s\].
const RISES_M_S: f64 = 0.03;

/// What holds the vehicle, averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Push<R> {
    /// Acceleration by the torques beyond that of the vehicle, gravity included, forward and to the left \[m/s^2\].
    pub(super) taken_m_s2: [R; 2],
    /// Largest rate at which a wheel rises or sinks \[m/s\].
    pub(super) rise_m_s: R,
}

impl<R: Real> Push<R> {
    pub(super) const NONE: Self = Self {
        taken_m_s2: [R::ZERO; 2],
        rise_m_s: R::ZERO,
    };

    /// A period with an acceleration by the torques of `thrust_m_s2` and this reading of the accelerometer.
    pub(super) fn step(&mut self, thrust_m_s2: [R; 2], force_m_s2: [R; 2], rise_m_s: R, period_s: R) {
        if !(all_plausible(&thrust_m_s2) && all_plausible(&force_m_s2)) {
            *self = Self::NONE;
            return;
        }
        let part = period_s / (period_s + R::of(PUSH_S));
        for ((taken, thrust), force) in self.taken_m_s2.iter_mut().zip(thrust_m_s2).zip(force_m_s2) {
            follow(taken, thrust - force, part);
        }
        follow(&mut self.rise_m_s, rise_m_s, part);
    }

    /// The direction in which the vehicle is held, which moves by `twist` where its wheels show `shown` \[m/s\]; zeros
    /// if it is not.
    pub(super) fn held_along(&self, twist: [R; 2], shown: [R; 2]) -> [R; 2] {
        let [x, y] = self.taken_m_s2;
        let taken = (x * x + y * y).sqrt();
        let none = [R::zero(); 2];
        if taken < R::of(TAKEN_M_S2) || self.rise_m_s > R::of(RISES_M_S) {
            return none;
        }
        let along = [x / taken, y / taken];
        let dot = |[vx, vy]: [R; 2]| along[0] * vx + along[1] * vy;
        let turns = max(dot(shown), R::of(TURNS_M_S));
        let is_stopped = taken > R::of(HELD_M_S2) || dot(twist) < R::of(PART) * turns;
        if dot(shown) >= turns && is_stopped {
            along
        } else {
            none
        }
    }
}
