//! A vehicle that pushes against something that holds it, such as an edge that it does not climb.
//!
//! All wheels may turn there for seconds. The accelerometer has seen the vehicle stop, but its bias hides that after a
//! while. The torques do not: what pushes hard and neither accelerates nor rises is held. Torques alone do not show it,
//! because gears, a load or a weak supply take them too: the accelerometer must have seen the stop.

use crate::Real;
use crate::estimate::estimator::MOST_M_S2;
use crate::scalar::{all_plausible, follow, max};

/// Time constant of the averages; of that of a vehicle that rolls; of the velocity by the accelerometer \[s\].
const PUSH_S: f64 = 0.1;
const ROLLS_S: f64 = 1.0;
const GAINED_S: f64 = 0.5;
/// Acceleration by the wheels' torques that something takes, beyond what it takes of a vehicle that rolls \[m/s^2\].
const TAKEN_M_S2: f64 = 1.0;
/// Largest difference of torques and accelerometer in a period \[m/s^2\].
const DIFFERENCE_M_S2: f64 = 20.0;
/// Speed from which the wheels turn \[m/s\], and parts of it: that a stopped vehicle has lost, and least a speed; that
/// a vehicle has at most which the wheels have left standing; that one has which rolls.
const TURNS_M_S: f64 = 0.05;
const LOST: f64 = 0.5;
const LOST_M_S: f64 = 0.1;
const STANDS: f64 = 0.3;
const ROLLS: f64 = 0.8;
/// For how long a vehicle is held whose stop was not seen \[s\]: an accelerometer that is dead sees no start either.
const UNSEEN_S: f64 = 3.0;
/// Rate at which a wheel that climbs rises at least \[m/s\].
const RISES_M_S: f64 = 0.012;

/// What holds the vehicle, averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Push<R> {
    /// Acceleration by the torques beyond that of the vehicle, gravity included, forward and to the left \[m/s^2\].
    pub(super) taken_m_s2: [R; 2],
    /// Largest rate at which a wheel rises or sinks \[m/s\].
    rise_m_s: R,
    /// Velocity that the accelerometer has seen the vehicle gain of late \[m/s\].
    gained_m_s: [R; 2],
    /// What is taken along its way while the vehicle rolls, by gears or a load \[m/s^2\].
    rolling_m_s2: R,
    /// It has seen the vehicle stop, and not go on. For how long it may be held without \[s\].
    stopped: bool,
    unseen_s: R,
}

/// What a period shows of a push, in the axes of the base.
pub(super) struct Pushing<R> {
    /// Acceleration by the torques, and reading of the accelerometer \[m/s^2\].
    pub(super) thrust_m_s2: [R; 2],
    pub(super) force_m_s2: [R; 2],
    /// The latter without gravity.
    pub(super) acceleration_m_s2: [R; 2],
    /// Largest rate at which a wheel rises or sinks \[m/s\].
    pub(super) rise_m_s: R,
    /// Velocity of the vehicle as it is estimated, and as its wheels show it \[m/s\].
    pub(super) twist_m_s: [R; 2],
    pub(super) shown_m_s: [R; 2],
}

fn dot<R: Real>([ax, ay]: [R; 2], [bx, by]: [R; 2]) -> R {
    ax * bx + ay * by
}

impl<R: Real> Push<R> {
    pub(super) const NONE: Self = Self {
        taken_m_s2: [R::ZERO; 2],
        rise_m_s: R::ZERO,
        gained_m_s: [R::ZERO; 2],
        rolling_m_s2: R::ZERO,
        stopped: false,
        unseen_s: R::ZERO,
    };

    /// A period; the direction in which the vehicle is held, zeros if it is not.
    pub(super) fn step(&mut self, now: &Pushing<R>, period_s: R) -> [R; 2] {
        let none = [R::zero(); 2];
        let accelerations = [now.force_m_s2, now.acceleration_m_s2];
        let is_read =
            |values: &[R; 2]| all_plausible(values) && dot(*values, *values).sqrt() < R::of(MOST_M_S2);
        if !all_plausible(&now.thrust_m_s2) || !accelerations.iter().all(is_read) {
            *self = Self {
                rolling_m_s2: self.rolling_m_s2,
                ..Self::NONE
            };
            return none;
        }
        let part = |time_s: f64| period_s / (period_s + R::of(time_s));
        let most = R::of(DIFFERENCE_M_S2);
        for ((taken, thrust), force) in self
            .taken_m_s2
            .iter_mut()
            .zip(now.thrust_m_s2)
            .zip(now.force_m_s2)
        {
            follow(taken, (thrust - force).limited(-most, most), part(PUSH_S));
        }
        follow(&mut self.rise_m_s, now.rise_m_s, part(PUSH_S));
        for (gained, acceleration) in self.gained_m_s.iter_mut().zip(now.acceleration_m_s2) {
            *gained += acceleration * period_s - part(GAINED_S) * *gained;
        }
        let shown = now.shown_m_s;
        let speed = dot(shown, shown).sqrt();
        if speed > R::of(TURNS_M_S) && dot(now.twist_m_s, shown) > R::of(ROLLS) * speed * speed {
            let taken = dot(self.taken_m_s2, shown) / speed;
            follow(&mut self.rolling_m_s2, taken, part(ROLLS_S));
        }
        let taken = dot(self.taken_m_s2, self.taken_m_s2).sqrt();
        let along = self.taken_m_s2.map(|each| each / max(taken, R::of(1e-6)));
        let turns = dot(along, shown);
        if taken - max(self.rolling_m_s2, R::zero()) < R::of(TAKEN_M_S2) || turns < R::of(TURNS_M_S) {
            (self.stopped, self.unseen_s) = (false, R::of(UNSEEN_S));
            return none;
        }
        let gained = dot(along, self.gained_m_s);
        let lost = max(R::of(LOST) * turns, R::of(LOST_M_S));
        self.stopped = gained <= -lost || (self.stopped && gained < lost);
        self.unseen_s = max(self.unseen_s - period_s, R::zero());
        let stands = dot(along, now.twist_m_s) < R::of(STANDS) * turns && self.unseen_s > R::zero();
        if self.rise_m_s <= R::of(RISES_M_S) && (self.stopped || stands) {
            along
        } else {
            none
        }
    }
}
