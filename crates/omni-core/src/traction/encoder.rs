//! A wheel's rate out of whole counts of its encoder.

use crate::Real;
use crate::scalar::max;

/// What the width of a count may make of the rate \[rad/s\]: some 2 cm/s of a rim of 0.07 m, the width over which slip
/// control takes the torque from a wheel.
const RATE_RAD_S: f64 = 0.3;

/// Rate of change of wheel velocity in an impact \[rad/s^2\]: 15 m/s^2 of a rim of 0.15 m. What is read over a longer
/// time is out of date by as much as it is more precise.
const CHANGE_RAD_S2: f64 = 100.0;

/// Time over which a rate is best read from counts of this angle \[s\].
pub(super) fn window_s<R: Real>(count_rad: R) -> R {
    (count_rad / R::of(CHANGE_RAD_S2)).sqrt()
}

/// The state of an encoder: the wheel's position between two counts, its rate, and the time since the last count.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct EncoderState<R> {
    /// Angle beyond the last count \[rad\].
    beyond_rad: R,
    rate_rad_s: R,
    since_s: R,
}

impl<R: Real> EncoderState<R> {
    pub(super) const fn new() -> Self {
        Self {
            beyond_rad: R::ZERO,
            rate_rad_s: R::ZERO,
            since_s: R::ZERO,
        }
    }

    /// The rate \[rad/s\], from what whole counts of `count_rad` over the period said; `best_s` is [`window_s`] of a
    /// count.
    ///
    /// Between two counts the wheel is anywhere; in a period with a count it is next to an edge. Only an angle that
    /// leaves what is possible corrects the rate, by the time that it took, and slowly enough to keep the rate
    /// within [`RATE_RAD_S`]. A wheel of which no count comes any more slows down to what would have made one.
    pub(super) fn step(&mut self, read_rad_s: R, count_rad: R, best_s: R, period_s: R) -> R {
        let zero = R::zero();
        let counted = read_rad_s * period_s;
        self.since_s += period_s;
        self.beyond_rad += self.rate_rad_s * period_s - counted;
        // How far from the edge that was passed the wheel can be.
        let travel = self.rate_rad_s.abs() * period_s;
        let near = if travel < count_rad { travel } else { count_rad };
        let (lower, upper) = if counted > zero {
            (zero, near)
        } else if counted < zero {
            (count_rad - near, count_rad)
        } else {
            (zero, count_rad)
        };
        let off = self.beyond_rad.limited(lower, upper) - self.beyond_rad;
        let window = max(max(near / R::of(RATE_RAD_S), best_s), self.since_s);
        self.rate_rad_s += off / window;
        self.beyond_rad += off;
        if counted != zero {
            self.since_s = zero;
        }
        self.rate_rad_s
    }
}
