//! Velocity and lean of the base, carried from period to period by gyros and accelerometer.

use super::GRAVITY_M_S2;
use crate::Real;
use crate::linkage::{Attitude, axes_of, turned};
use crate::scalar::all_plausible;

/// Change of the velocity that is expected in a period without accelerometer \[m/s^2\], and beside it \[m/s\].
const CHANGE_M_S2: f64 = 3.0;
const CHANGE_M_S: f64 = 0.01;
/// Deviation of the velocity of a vehicle that stands \[m/s\], and of its lean \[rad\].
const STANDING_M_S: f64 = 1e-3;
const STANDING_RAD: f64 = 3e-4;
/// Deviations of velocity and lean that have turned out to be wrong.
const LOST_M_S: f64 = 1.0;
const LOST_RAD: f64 = 0.1;

/// Velocity forward and to the left, how nose and left side are up, and the covariance of these four.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Carried<R> {
    /// With the yaw rate \[m/s, m/s, rad/s\].
    pub(super) velocity: [R; 3],
    /// \[rad\]
    pub(super) lean: [R; 2],
    velocity_variance: [[R; 2]; 2],
    /// Of lean (rows) and velocity (columns).
    mixed: [[R; 2]; 2],
    lean_variance: [[R; 2]; 2],
    /// Of the place in the world (rows) and velocity, and lean (columns).
    place_velocity: [[R; 2]; 2],
    place_lean: [[R; 2]; 2],
    /// An accelerometer carries the velocity: wheels that all slip are noticed.
    pub(super) by_accelerometer: bool,
}

type Pair<R> = [[R; 2]; 2];

fn times<R: Real>([[a, b], [c, d]]: &Pair<R>, [[e, f], [g, h]]: &Pair<R>) -> Pair<R> {
    [
        [*a * *e + *b * *g, *a * *f + *b * *h],
        [*c * *e + *d * *g, *c * *f + *d * *h],
    ]
}

fn transposed<R: Real>([[a, b], [c, d]]: Pair<R>) -> Pair<R> {
    [[a, c], [b, d]]
}

fn each<R: Real>(
    [[a, b], [c, d]]: &Pair<R>,
    [[e, f], [g, h]]: &Pair<R>,
    with: impl Fn(R, R) -> R,
) -> Pair<R> {
    [[with(*a, *e), with(*b, *f)], [with(*c, *g), with(*d, *h)]]
}

pub(super) fn inverse<R: Real>([[a, b], [c, d]]: &Pair<R>) -> Pair<R> {
    let area = *a * *d - *b * *c;
    [[*d / area, -*b / area], [-*c / area, *a / area]]
}

impl<R: Real> Carried<R> {
    pub(super) fn at_rest() -> Self {
        let zero = R::zero();
        let diagonal = |deviation: f64| {
            let variance = R::of(deviation * deviation);
            [[variance, zero], [zero, variance]]
        };
        Self {
            velocity: [zero; 3],
            lean: [zero; 2],
            velocity_variance: diagonal(STANDING_M_S),
            mixed: [[zero; 2]; 2],
            lean_variance: diagonal(STANDING_RAD),
            place_velocity: [[zero; 2]; 2],
            place_lean: [[zero; 2]; 2],
            by_accelerometer: false,
        }
    }

    /// Rests with this lean.
    pub(super) fn rest(&mut self, lean: [R; 2]) {
        *self = Self {
            lean,
            ..Self::at_rest()
        };
    }

    pub(super) fn velocity_variance(&self) -> &Pair<R> {
        &self.velocity_variance
    }

    /// What it is now is not known well: the wheels are followed for a while.
    pub(super) fn forget(&mut self) {
        let (velocity, lean) = (R::of(LOST_M_S * LOST_M_S), R::of(LOST_RAD * LOST_RAD));
        self.velocity_variance[0][0] += velocity;
        self.velocity_variance[1][1] += velocity;
        self.lean_variance[0][0] += lean;
        self.lean_variance[1][1] += lean;
    }

    /// Variances are positive, and everything is a number.
    pub(super) fn is_sound(&self) -> bool {
        let [[xx, xy], [_, yy]] = self.velocity_variance;
        let [x, y, _] = self.velocity;
        all_plausible(&[xx, xy, yy, x, y]) && xx > R::zero() && xx * yy > xy * xy && all_plausible(&self.lean)
    }

    /// Variance of how the nose is up \[rad^2\].
    pub(super) fn nose_variance(&self) -> R {
        let [[nose, _], _] = self.lean_variance;
        nose
    }

    /// How the base leans, with these rates.
    pub(super) fn attitude(&self, [p, q, _]: &[R; 3]) -> Attitude<R> {
        let [nose_up_rad, left_up_rad] = self.lean;
        Attitude {
            nose_up_rad,
            left_up_rad,
            nose_up_rad_s: -*q,
            left_up_rad_s: *p,
        }
    }

    /// A period on, by gyros \[rad/s\] and accelerometer \[m/s^2\], with their deviations.
    pub(super) fn carry(&mut self, rate: &[R; 3], force: &[R; 3], gyro: R, accelerometer: R, period_s: R) {
        let half = R::of(0.5);
        let lean_by = |lean: &[R; 2]| {
            let attitude = Attitude {
                nose_up_rad: lean[0],
                left_up_rad: lean[1],
                ..Attitude::LEVEL
            };
            let [x, y, z] = axes_of(&attitude);
            let ([p, q, r], level) = (*rate, R::of(0.2));
            let root = |sine: R| {
                let rest = R::one() - sine * sine;
                if rest > level { rest } else { level }.sqrt()
            };
            [
                (r * y[2] - q * z[2]) / root(x[2]),
                (p * z[2] - r * x[2]) / root(y[2]),
            ]
        };
        let moved = |lean: &[R; 2], by: [R; 2], time: R| [lean[0] + by[0] * time, lean[1] + by[1] * time];
        // The middle of the period, for both.
        let middle = moved(&self.lean, lean_by(&self.lean), half * period_s);
        let axes = axes_of(&Attitude {
            nose_up_rad: middle[0],
            left_up_rad: middle[1],
            ..Attitude::LEVEL
        });
        let [ax, ay, _] = turned(&axes, force);
        let [vx, vy, wz] = self.velocity;
        self.velocity = [vx + (ax + wz * vy) * period_s, vy + (ay - wz * vx) * period_s, wz];
        self.lean = moved(&self.lean, lean_by(&middle), period_s);
        // A lean that is not known is taken for an acceleration.
        let fall = R::of(GRAVITY_M_S2) * period_s;
        let (mixed, lean) = (self.mixed, self.lean_variance);
        let back = transposed(mixed);
        let crossed = each(&mixed, &back, |a, b| a + b);
        self.velocity_variance = each(&self.velocity_variance, &crossed, |v, m| v - fall * m);
        self.velocity_variance = each(&self.velocity_variance, &lean, |v, l| v + fall * fall * l);
        self.mixed = each(&mixed, &lean, |m, l| m - fall * l);
        self.place_velocity = each(&self.place_velocity, &self.place_lean, |v, l| v - fall * l);
        let (added, turned) = (accelerometer * period_s, gyro * period_s);
        let (added, turned) = (added * added, turned * turned);
        self.velocity_variance[0][0] += added;
        self.velocity_variance[1][1] += added;
        self.lean_variance[0][0] += turned;
        self.lean_variance[1][1] += turned;
        self.by_accelerometer = true;
    }

    /// A period on without accelerometer, with the lean that is measured.
    pub(super) fn guess(&mut self, lean: [R; 2], deviation: R, period_s: R) {
        let change = R::of(CHANGE_M_S) + R::of(CHANGE_M_S2) * period_s;
        self.velocity_variance[0][0] += change * change;
        self.velocity_variance[1][1] += change * change;
        self.lean = lean;
        let (zero, variance) = (R::zero(), deviation * deviation);
        self.mixed = [[zero; 2]; 2];
        self.place_lean = [[zero; 2]; 2];
        self.lean_variance = [[variance, zero], [zero, variance]];
        self.by_accelerometer = false;
    }

    /// The velocity is now known to be this: lean and place follow by what they have in common with it. The place's correction, and what its
    /// covariance loses: xx, xy, yy. `trust`, 0 to 1, is the part of that which the lean follows: what slips is no lean.
    pub(super) fn correct(
        &mut self,
        velocity: [R; 3],
        covariance: &[[R; 3]; 3],
        trust: R,
    ) -> ([R; 2], [R; 3]) {
        let [[xx, xy, _], [_, yy, _], _] = *covariance;
        let after = [[xx, xy], [xy, yy]];
        let known = inverse(&self.velocity_variance);
        let [vx, vy, _] = self.velocity;
        let (dx, dy) = (velocity[0] - vx, velocity[1] - vy);
        let by = |[[a, b], [c, d]]: &Pair<R>| [*a * dx + *b * dy, *c * dx + *d * dy];
        let gone = each(&self.velocity_variance, &after, |before, after| before - after);
        let gain = times(&self.mixed, &known);
        let place = times(&self.place_velocity, &known);
        let [nose, left] = by(&gain);
        self.lean = [self.lean[0] + trust * nose, self.lean[1] + trust * left];
        let part = trust * (R::of(2.0) - trust);
        let less = times(&times(&gain, &gone), &transposed(gain)).map(|row| row.map(|each| part * each));
        self.lean_variance = each(&self.lean_variance, &less, |all, less| all - less);
        let common = times(&times(&place, &gone), &transposed(gain));
        self.place_lean = each(&self.place_lean, &common, |all, less| all - less);
        let [[xx, xy], [_, yy]] = times(&times(&place, &gone), &transposed(place));
        self.place_velocity = times(&place, &after);
        self.mixed = times(&gain, &after);
        self.velocity_variance = after;
        self.velocity = velocity;
        (by(&place), [xx, xy, yy])
    }

    /// The place has moved with the velocity, along the heading with this sine and cosine: what its covariance gains, xx, xy, yy.
    pub(super) fn moved(&mut self, (sin, cos): (R, R), period_s: R) -> [R; 3] {
        let turn = [
            [cos * period_s, -(sin * period_s)],
            [sin * period_s, cos * period_s],
        ];
        let added = times(&turn, &self.velocity_variance);
        let old = times(&self.place_velocity, &transposed(turn));
        let new = times(&added, &transposed(turn));
        self.place_velocity = each(&self.place_velocity, &added, |all, more| all + more);
        let lean = times(&turn, &transposed(self.mixed));
        self.place_lean = each(&self.place_lean, &lean, |all, more| all + more);
        let two = R::of(2.0);
        [
            two * old[0][0] + new[0][0],
            old[0][1] + old[1][0] + new[0][1],
            two * old[1][1] + new[1][1],
        ]
    }

    /// Variance of how the left side is up \[rad^2\].
    pub(super) fn left_variance(&self) -> R {
        let [_, [_, left]] = self.lean_variance;
        left
    }
}
