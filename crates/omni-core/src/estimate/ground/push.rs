//! A vehicle that pushes against something that holds it, such as an edge that it does not climb.
//!
//! All wheels may turn there for seconds. The accelerometer has seen the vehicle stop, but its bias hides that after a
//! while. The torques do not: what pushes hard and neither accelerates nor rises is held.

use crate::Real;
use crate::scalar::{all_plausible, follow, max, min};

/// Time constant of the averages, and of that of a vehicle that rolls freely \[s\].
const PUSH_S: f64 = 0.1;
const FREE_S: f64 = 1.0;
/// Acceleration by the wheels' torques that something takes, beyond what it takes of a vehicle that rolls freely, if the
/// vehicle has lost speed \[m/s^2\].
const TAKEN_M_S2: f64 = 1.0;
/// The same, from which the vehicle is held whatever it seems to do: no vehicle pulls so much without slip.
const HELD_M_S2: f64 = 3.0;
/// Speed from which the wheels turn \[m/s\]; part of it that the vehicle has lost speed with, and that it rolls with.
const TURNS_M_S: f64 = 0.05;
const LOST: f64 = 0.3;
const ROLLS: f64 = 0.8;
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
    rise_m_s: R,
    /// What is taken along its way while the vehicle rolls freely, by gears or a load \[m/s^2\], and for how long it has
    /// rolled; not beyond what matters \[s\].
    free_m_s2: R,
    free_s: R,
}

fn dot<R: Real>([ax, ay]: [R; 2], [bx, by]: [R; 2]) -> R {
    ax * bx + ay * by
}

impl<R: Real> Push<R> {
    pub(super) const NONE: Self = Self {
        taken_m_s2: [R::ZERO; 2],
        rise_m_s: R::ZERO,
        free_m_s2: R::ZERO,
        free_s: R::ZERO,
    };

    /// A period with an acceleration by the torques of `thrust_m_s2`, this reading of the accelerometer and this rise of
    /// a wheel. The vehicle moves by `twist` where its wheels show `shown` \[m/s\].
    ///
    /// Result: the direction in which it is held; zeros if it is not.
    pub(super) fn step(
        &mut self,
        [thrust_m_s2, force_m_s2]: [[R; 2]; 2],
        rise_m_s: R,
        [twist, shown]: [[R; 2]; 2],
        period_s: R,
    ) -> [R; 2] {
        let none = [R::zero(); 2];
        if !(all_plausible(&thrust_m_s2) && all_plausible(&force_m_s2)) {
            *self = Self::NONE;
            return none;
        }
        let part = |time_s: f64| period_s / (period_s + R::of(time_s));
        for ((taken, thrust), force) in self.taken_m_s2.iter_mut().zip(thrust_m_s2).zip(force_m_s2) {
            follow(taken, thrust - force, part(PUSH_S));
        }
        follow(&mut self.rise_m_s, rise_m_s, part(PUSH_S));
        let speed = dot(shown, shown).sqrt();
        if speed > R::of(TURNS_M_S) && dot(twist, shown) > R::of(ROLLS) * speed * speed {
            let taken = dot(self.taken_m_s2, shown) / speed;
            follow(&mut self.free_m_s2, taken, part(FREE_S));
            self.free_s = min(self.free_s + period_s, R::of(FREE_S));
        }
        let taken = dot(self.taken_m_s2, self.taken_m_s2).sqrt();
        let beyond = taken - max(self.free_m_s2, R::zero());
        if beyond < R::of(TAKEN_M_S2) || self.rise_m_s > R::of(RISES_M_S) {
            return none;
        }
        let along = self.taken_m_s2.map(|each| each / taken);
        let turns = dot(along, shown);
        let is_held = beyond > R::of(HELD_M_S2) && self.free_s >= R::of(FREE_S);
        if turns > R::of(TURNS_M_S) && (is_held || dot(along, twist) < R::of(LOST) * turns) {
            along
        } else {
            none
        }
    }
}
