//! Time law of a path: speeding up and slowing down with limited jerk.

use crate::Real;
use crate::constants::constant_struct;

/// Constant jerk for a while; the last one of a segment goes on for ever.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[doc(hidden)]
pub struct Phase<R> {
    /// When it begins \[s\] and where \[m\], from the start of its segment.
    pub(crate) start_s: R,
    pub(crate) start_m: R,
    /// Speed, acceleration then, and jerk \[m/s, m/s^2, m/s^3\].
    pub(crate) speed: R,
    pub(crate) acceleration: R,
    pub(crate) jerk: R,
}

constant_struct!(Phase<R> { start_s: R, start_m: R, speed: R, acceleration: R, jerk: R });

impl<R: Real> Phase<R> {
    pub(crate) const EMPTY: Self = Self {
        start_s: R::ZERO,
        start_m: R::ZERO,
        speed: R::ZERO,
        acceleration: R::ZERO,
        jerk: R::ZERO,
    };

    /// Way, speed and acceleration at a time from the start of the segment.
    pub(crate) fn at(&self, time_s: R) -> [R; 3] {
        let t = time_s - self.start_s;
        let half = R::of(0.5);
        let acceleration = self.acceleration + self.jerk * t;
        let speed = self.speed + t * (self.acceleration + half * self.jerk * t);
        let way = self.start_m
            + t * (self.speed + t * (half * self.acceleration + R::of(1.0 / 6.0) * self.jerk * t));
        [way, speed, acceleration]
    }
}

/// Limits of the speed on one segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ramp<R> {
    pub(crate) acceleration: R,
    pub(crate) jerk: R,
}

impl<R: Real> Ramp<R> {
    /// How long the acceleration grows and shrinks, and how long it is at its limit, for a change of speed.
    fn times(&self, change: R) -> (R, R) {
        let Self { acceleration, jerk } = *self;
        if change * jerk < acceleration * acceleration {
            ((change / jerk).sqrt(), R::ZERO)
        } else if change > R::ZERO {
            let growing = acceleration / jerk;
            (growing, change / acceleration - growing)
        } else {
            (R::ZERO, R::ZERO)
        }
    }

    /// Way for a change from one speed to another: the mean of both, for as long as it takes.
    pub(crate) fn way(&self, from: R, to: R) -> R {
        let (growing, held) = self.times((to - from).abs());
        R::of(0.5) * (from + to) * (growing + growing + held)
    }

    /// The highest speed, up to `most`, that is reached from `speed` within `way`.
    pub(crate) fn reached(&self, speed: R, way: R, most: R) -> R {
        if speed >= most || self.way(speed, most) <= way {
            return if most < speed { speed } else { most };
        }
        bisected(speed, most, |to| self.way(speed, to) <= way)
    }
}

/// The largest number between `low`, which will do, and `high`, that will do, where all below one that does do.
pub(crate) fn bisected<R: Real>(mut low: R, mut high: R, does: impl Fn(R) -> bool) -> R {
    for _ in 0..64 {
        let middle = R::of(0.5) * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if does(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The fastest way from one speed to another over `length`: up, along, down.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Profile<R> {
    pub(crate) length: R,
    /// Speeds at both ends, and the highest allowed.
    pub(crate) ends: [R; 2],
    pub(crate) most: R,
    pub(crate) up: Ramp<R>,
    pub(crate) down: Ramp<R>,
}

impl<R: Real> Profile<R> {
    fn peak(&self) -> R {
        let [from, to] = self.ends;
        let fits = |peak: R| self.up.way(from, peak) + self.down.way(peak, to) <= self.length;
        if fits(self.most) {
            return self.most;
        }
        bisected(if from > to { from } else { to }, self.most, fits)
    }

    /// The phases, and their total duration \[s\]. The last one ends at rest in its own time, to be held.
    pub(crate) fn phases(&self) -> ([Phase<R>; 7], R) {
        let peak = self.peak();
        let [from, to] = self.ends;
        let left = self.length - self.up.way(from, peak) - self.down.way(peak, to);
        let along = if left > R::ZERO && peak > R::ZERO {
            left / peak
        } else {
            R::ZERO
        };
        let (mut phases, mut time_s, mut way) = ([Phase::EMPTY; 7], R::ZERO, R::ZERO);
        let (mut speed, mut acceleration) = (from, R::ZERO);
        let ramp = |ramp: &Ramp<R>, change: R, sign: R| {
            let (growing, held) = ramp.times(change);
            let (top, jerk) = if growing > R::ZERO {
                let reached = ramp.jerk * growing;
                (
                    if reached < ramp.acceleration {
                        reached
                    } else {
                        ramp.acceleration
                    },
                    ramp.jerk,
                )
            } else {
                (ramp.acceleration, R::ZERO)
            };
            let (top, jerk) = (sign * top, sign * jerk);
            [
                (growing, R::ZERO, jerk),
                (held, top, R::ZERO),
                (growing, top, -jerk),
            ]
        };
        let [a, b, c] = ramp(&self.up, peak - from, R::ONE);
        let [e, f, g] = ramp(&self.down, peak - to, -R::ONE);
        let plan = [a, b, c, (along, R::ZERO, R::ZERO), e, f, g];
        for (k, (lasts, starts_with, jerk)) in plan.into_iter().enumerate() {
            // A ramp ends where it should, whatever rounding made of it.
            if k == 3 || k == 4 {
                speed = peak;
            }
            acceleration = if lasts > R::ZERO {
                starts_with
            } else {
                acceleration
            };
            phases[k] = Phase {
                start_s: time_s,
                start_m: way,
                speed,
                acceleration: if lasts > R::ZERO { acceleration } else { R::ZERO },
                jerk: if lasts > R::ZERO { jerk } else { R::ZERO },
            };
            [way, speed, acceleration] = phases[k].at(time_s + lasts);
            time_s += lasts;
        }
        (phases, time_s)
    }

    pub(crate) fn duration_s(&self) -> R {
        let peak = self.peak();
        let [from, to] = self.ends;
        let of = |ramp: &Ramp<R>, change: R| {
            let (growing, held) = ramp.times(change);
            growing + growing + held
        };
        let left = self.length - self.up.way(from, peak) - self.down.way(peak, to);
        let along = if left > R::ZERO && peak > R::ZERO {
            left / peak
        } else {
            R::ZERO
        };
        of(&self.up, peak - from) + along + of(&self.down, peak - to)
    }
}
