//! Velocity and lean of the base, predicted by gyros and accelerometer and corrected by the wheels: a Kalman filter.

use crate::Real;
use crate::linkage::{Attitude, axes_of, turned};
use crate::scalar::all_plausible;

/// Standard gravity \[m/s^2\].
pub(super) const GRAVITY_M_S2: f64 = 9.81;
/// Standard deviation of the velocity's change in a period without accelerometer: a part that grows with the period
/// \[m/s^2\], and a constant part \[m/s\].
const CHANGE_M_S2: f64 = 3.0;
const CHANGE_M_S: f64 = 0.01;
/// Standard deviations of velocity \[m/s\] and lean \[rad\] of a vehicle that stands.
const STANDING_M_S: f64 = 1e-3;
const STANDING_RAD: f64 = 3e-4;
/// Standard deviations that are added after a loss: velocity \[m/s\], lean \[rad\].
const LOST_M_S: f64 = 1.0;
const LOST_RAD: f64 = 0.1;
/// Smallest squared cosine of an angle of the lean.
const LEAST_COSINE2: f64 = 0.2;

/// A matrix of 2 x 2, by rows.
pub(super) type Pair<R> = [[R; 2]; 2];

/// The filter's state. Vectors of the plane are forward and to the left, the lean is the angles of nose and left side
/// above the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct InertialFilter<R> {
    /// Velocity and yaw rate \[m/s, m/s, rad/s\].
    velocity: [R; 3],
    lean_rad: [R; 2],
    velocity_variance: Pair<R>,
    /// Covariance of lean (rows) and velocity (columns).
    lean_velocity: Pair<R>,
    lean_variance: Pair<R>,
    /// Covariance of the position in the world (rows) and velocity, and lean (columns).
    position_velocity: Pair<R>,
    position_lean: Pair<R>,
    /// An accelerometer predicted the velocity of this period.
    by_accelerometer: bool,
}

/// Standard deviations of a reading of the inertial measurement unit.
pub(super) struct InertialNoise<R> {
    pub(super) gyro_rad_s: R,
    pub(super) accelerometer_m_s2: R,
}

/// Correction of the position in the world by a corrected velocity.
pub(super) struct PositionCorrection<R> {
    pub(super) by_m: [R; 2],
    /// Decrease of the position's covariance \[m^2\]: xx, xy, yy.
    pub(super) decrease_m2: [R; 3],
}

fn product<R: Real>([[a, b], [c, d]]: &Pair<R>, [[e, f], [g, h]]: &Pair<R>) -> Pair<R> {
    [
        [*a * *e + *b * *g, *a * *f + *b * *h],
        [*c * *e + *d * *g, *c * *f + *d * *h],
    ]
}

fn transposed<R: Real>([[a, b], [c, d]]: Pair<R>) -> Pair<R> {
    [[a, c], [b, d]]
}

/// A function of two matrices, element by element.
fn elementwise<R: Real>(
    [[a, b], [c, d]]: &Pair<R>,
    [[e, f], [g, h]]: &Pair<R>,
    with: impl Fn(R, R) -> R,
) -> Pair<R> {
    [[with(*a, *e), with(*b, *f)], [with(*c, *g), with(*d, *h)]]
}

pub(super) fn inverse<R: Real>([[a, b], [c, d]]: &Pair<R>) -> Pair<R> {
    let determinant = *a * *d - *b * *c;
    [
        [*d / determinant, -*b / determinant],
        [-*c / determinant, *a / determinant],
    ]
}

fn add_to_diagonal<R: Real>([[a, _], [_, d]]: &mut Pair<R>, added: R) {
    *a += added;
    *d += added;
}

fn at_lean<R: Real>([nose_up_rad, left_up_rad]: [R; 2]) -> Attitude<R> {
    Attitude {
        nose_up_rad,
        left_up_rad,
        ..Attitude::LEVEL
    }
}

/// Rates of the lean's angles, from the rates about the base's axes.
fn lean_rate<R: Real>(lean_rad: [R; 2], [p, q, r]: &[R; 3]) -> [R; 2] {
    let [x, y, z] = axes_of(&at_lean(lean_rad));
    let cosine = |sine: R| {
        let square = R::one() - sine * sine;
        let least = R::of(LEAST_COSINE2);
        if square > least { square } else { least }.sqrt()
    };
    [
        (*r * y[2] - *q * z[2]) / cosine(x[2]),
        (*p * z[2] - *r * x[2]) / cosine(y[2]),
    ]
}

impl<R: Real> InertialFilter<R> {
    pub(super) fn at_rest() -> Self {
        let zero = R::zero();
        let diagonal = |deviation: f64| {
            let variance = R::of(deviation * deviation);
            [[variance, zero], [zero, variance]]
        };
        Self {
            velocity: [zero; 3],
            lean_rad: [zero; 2],
            velocity_variance: diagonal(STANDING_M_S),
            lean_velocity: [[zero; 2]; 2],
            lean_variance: diagonal(STANDING_RAD),
            position_velocity: [[zero; 2]; 2],
            position_lean: [[zero; 2]; 2],
            by_accelerometer: false,
        }
    }

    /// At rest with this lean.
    pub(super) fn rest(&mut self, lean_rad: [R; 2]) {
        *self = Self {
            lean_rad,
            ..Self::at_rest()
        };
    }

    /// Adds the variances of a loss: the following wheel readings get a large weight.
    pub(super) fn widen(&mut self) {
        add_to_diagonal(&mut self.velocity_variance, R::of(LOST_M_S * LOST_M_S));
        add_to_diagonal(&mut self.lean_variance, R::of(LOST_RAD * LOST_RAD));
    }

    /// The variances are positive, and velocity and lean are finite.
    pub(super) fn is_valid(&self) -> bool {
        let [[xx, xy], [_, yy]] = self.velocity_variance;
        let [x, y, _] = self.velocity;
        all_plausible(&[xx, xy, yy, x, y])
            && xx > R::zero()
            && xx * yy > xy * xy
            && all_plausible(&self.lean_rad)
    }

    pub(super) fn velocity(&self) -> [R; 3] {
        self.velocity
    }

    pub(super) fn velocity_variance(&self) -> &Pair<R> {
        &self.velocity_variance
    }

    /// An accelerometer predicted the velocity: then a slip of all wheels at once is detected.
    pub(super) fn by_accelerometer(&self) -> bool {
        self.by_accelerometer
    }

    pub(super) fn lean_rad(&self) -> [R; 2] {
        self.lean_rad
    }

    /// Variance of the height of a point at this arm from the base's origin, by the lean \[m^2\].
    pub(super) fn height_variance_m2(&self, [x, y]: [R; 2]) -> R {
        let [[nose, _], [_, left]] = self.lean_variance;
        nose * x * x + left * y * y
    }

    /// The attitude of the base, with these rates about its axes.
    pub(super) fn attitude(&self, [p, q]: [R; 2]) -> Attitude<R> {
        Attitude {
            nose_up_rad_s: -q,
            left_up_rad_s: p,
            ..at_lean(self.lean_rad)
        }
    }

    /// Predicts one period from gyros \[rad/s\] and accelerometer \[m/s^2\].
    pub(super) fn predict(&mut self, rate: &[R; 3], force: &[R; 3], noise: &InertialNoise<R>, period_s: R) {
        let half = R::of(0.5);
        let moved = |lean: &[R; 2], by: [R; 2], time: R| [lean[0] + by[0] * time, lean[1] + by[1] * time];
        // Midpoint rule: both use the lean in the middle of the period.
        let middle = moved(&self.lean_rad, lean_rate(self.lean_rad, rate), half * period_s);
        let [ax, ay, _] = turned(&axes_of(&at_lean(middle)), force);
        let [vx, vy, wz] = self.velocity;
        self.velocity = [vx + (ax + wz * vy) * period_s, vy + (ay - wz * vx) * period_s, wz];
        self.lean_rad = moved(&self.lean_rad, lean_rate(middle, rate), period_s);
        self.predict_covariance(R::of(GRAVITY_M_S2) * period_s);
        let (accelerated, rotated) = (noise.accelerometer_m_s2 * period_s, noise.gyro_rad_s * period_s);
        add_to_diagonal(&mut self.velocity_variance, accelerated * accelerated);
        add_to_diagonal(&mut self.lean_variance, rotated * rotated);
        self.by_accelerometer = true;
    }

    /// F P F^T for the F that subtracts `fall` times the lean from the velocity: the accelerometer measures the
    /// component of gravity along a lean that is not known as an acceleration.
    fn predict_covariance(&mut self, fall: R) {
        let (lean_velocity, lean) = (self.lean_velocity, self.lean_variance);
        let crossed = elementwise(&lean_velocity, &transposed(lean_velocity), |a, b| a + b);
        let velocity = elementwise(&self.velocity_variance, &crossed, |v, m| v - fall * m);
        self.velocity_variance = elementwise(&velocity, &lean, |v, l| v + fall * fall * l);
        self.lean_velocity = elementwise(&lean_velocity, &lean, |m, l| m - fall * l);
        self.position_velocity =
            elementwise(&self.position_velocity, &self.position_lean, |v, l| v - fall * l);
    }

    /// Predicts one period without accelerometer: the velocity follows a random walk, and the lean is the measured one
    /// with this standard deviation.
    pub(super) fn predict_unaccelerated(&mut self, lean_rad: [R; 2], deviation_rad: R, period_s: R) {
        let change = R::of(CHANGE_M_S) + R::of(CHANGE_M_S2) * period_s;
        add_to_diagonal(&mut self.velocity_variance, change * change);
        self.lean_rad = lean_rad;
        let (zero, variance) = (R::zero(), deviation_rad * deviation_rad);
        self.lean_velocity = [[zero; 2]; 2];
        self.position_lean = [[zero; 2]; 2];
        self.lean_variance = [[variance, zero], [zero, variance]];
        self.by_accelerometer = false;
    }

    /// Replaces the velocity by the estimate that includes the wheels, and corrects lean and position by their
    /// covariance with the velocity. `trust`, 0 to 1, is the part of its correction that the lean takes: a slip of the
    /// wheels is not a lean.
    pub(super) fn correct(
        &mut self,
        velocity: [R; 3],
        covariance: &[[R; 3]; 3],
        trust: R,
    ) -> PositionCorrection<R> {
        let [[xx, xy, _], [_, yy, _], _] = *covariance;
        let after = [[xx, xy], [xy, yy]];
        let information = inverse(&self.velocity_variance);
        let [vx, vy, _] = self.velocity;
        let (dx, dy) = (velocity[0] - vx, velocity[1] - vy);
        let apply = |[[a, b], [c, d]]: &Pair<R>| [*a * dx + *b * dy, *c * dx + *d * dy];
        let removed = elementwise(&self.velocity_variance, &after, |before, after| before - after);
        let lean_gain = product(&self.lean_velocity, &information);
        let position_gain = product(&self.position_velocity, &information);
        let [nose, left] = apply(&lean_gain);
        self.lean_rad = [self.lean_rad[0] + trust * nose, self.lean_rad[1] + trust * left];
        let part = trust * (R::of(2.0) - trust);
        let of_lean = product(&product(&lean_gain, &removed), &transposed(lean_gain));
        let of_lean = of_lean.map(|row| row.map(|each| part * each));
        self.lean_variance = elementwise(&self.lean_variance, &of_lean, |all, less| all - less);
        let of_both = product(&product(&position_gain, &removed), &transposed(lean_gain));
        self.position_lean = elementwise(&self.position_lean, &of_both, |all, less| all - less);
        let [[xx, xy], [_, yy]] = product(&product(&position_gain, &removed), &transposed(position_gain));
        self.position_velocity = product(&position_gain, &after);
        self.lean_velocity = product(&lean_gain, &after);
        self.velocity_variance = after;
        self.velocity = velocity;
        PositionCorrection {
            by_m: apply(&position_gain),
            decrease_m2: [xx, xy, yy],
        }
    }

    /// The position moved with the velocity for a period, at the yaw with this sine and cosine. Increase of the
    /// position's covariance \[m^2\]: xx, xy, yy.
    pub(super) fn move_position(&mut self, (sin, cos): (R, R), period_s: R) -> [R; 3] {
        let turn = [
            [cos * period_s, -(sin * period_s)],
            [sin * period_s, cos * period_s],
        ];
        let velocity = product(&turn, &self.velocity_variance);
        let old = product(&self.position_velocity, &transposed(turn));
        let new = product(&velocity, &transposed(turn));
        let add = |all, more| all + more;
        self.position_velocity = elementwise(&self.position_velocity, &velocity, add);
        let lean = product(&turn, &transposed(self.lean_velocity));
        self.position_lean = elementwise(&self.position_lean, &lean, add);
        let two = R::of(2.0);
        [
            two * old[0][0] + new[0][0],
            old[0][1] + old[1][0] + new[0][1],
            two * old[1][1] + new[1][1],
        ]
    }
}
