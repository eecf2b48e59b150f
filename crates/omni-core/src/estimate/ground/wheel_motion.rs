//! Velocity of the vehicle from the rims of its wheels and the gyro: least squares with robust weights.

use super::inertial::{InertialFilter, inverse};
use crate::Real;
use crate::geometry::matrix3;
use crate::linkage::{WheelPlace, cross, dot, turned};
use crate::scalar::max;

/// Rounds of reweighting.
const ROUNDS: usize = 4;
/// Residual, in standard deviations, at which the weight of a wheel is half as large.
const SLIPS: f64 = 3.0;
/// Part of the wheels' mean squared residual that is added to the variance of each, if an accelerometer predicts the
/// velocity.
const UNEXPLAINED: f64 = 0.3;
/// Standard deviation of the speed of a wheel on an edge, relative to its speed, per squared sine of the slope.
const EDGE_PART: f64 = 0.1;
/// Standard deviation of the yaw rate without a gyro \[rad/s\].
const YAW_RAD_S: f64 = 1.0;
/// Below this speed the slope of the path is not determined by the velocity \[m/s\].
const SLOW_M_S: f64 = 0.02;
/// Limits of the squared slope of a path: rise over ground, squared, less its noise.
const SLOPE2: [f64; 2] = [-0.2, 25.0];

/// A wheel as it is built.
#[derive(Clone, Copy, Debug)]
pub(super) struct RollingWheel<R> {
    pub(super) radius_m: R,
    /// Speed of the rim per velocity of the actuator \[m/rad\].
    pub(super) rim_m_rad: R,
    /// Rolling direction, and cosine and sine of the roller's angle to it.
    pub(super) direction: [R; 2],
    pub(super) roller: [R; 2],
}

/// Rate of rise of a wheel's centre.
#[derive(Clone, Copy)]
pub(super) struct RiseRate<R> {
    pub(super) m_s: R,
    pub(super) variance: R,
}

/// A wheel in a period: its rim's speed, and the motion of its centre.
#[derive(Clone, Copy)]
pub(super) struct WheelReading<R> {
    /// Speed of its rim relative to the ground \[m/s\], and the standard deviation; none without a reading.
    rim_m_s: Option<R>,
    noise_m_s: R,
    /// Rolling direction, level and of length 1.
    direction: [R; 2],
    roller: [R; 2],
    /// Position and velocity of its centre relative to the base's origin, level.
    arm_m: [R; 2],
    centre_m_s: [R; 2],
    rise: RiseRate<R>,
}

/// Equation of a wheel: `factors` times the motion is `rim_m_s`, with this variance.
struct WheelEquation<R> {
    factors: [R; 3],
    rim_m_s: R,
    variance: R,
}

/// The motion that wheels, gyro and accelerometer determine together.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionEstimate<R> {
    /// Forward, to the left, and yaw rate \[m/s, m/s, rad/s\].
    pub(super) velocity: [R; 3],
    pub(super) covariance: [[R; 3]; 3],
    /// Mean square of the wheels' residuals beyond their noise \[m^2/s^2\].
    pub(super) disagreement_m2_s2: R,
    /// Agreement of the wheels with the predicted velocity, 0 to 1.
    pub(super) agreement: R,
    /// Weight of the gyro in the yaw rate, 0 to 1.
    pub(super) gyro_part: R,
}

impl<R: Real> RollingWheel<R> {
    /// The wheel at this place, from the velocity of its actuator.
    pub(super) fn reading(
        &self,
        place: &WheelPlace<R>,
        actuator_rad_s: Option<R>,
        rise: RiseRate<R>,
        noise_m_s: R,
    ) -> WheelReading<R> {
        let [x, y] = self.direction;
        let rolling = turned(&place.axes, &[x, y, R::zero()]);
        let [_, _, up] = &place.axes;
        // The encoder measures the wheel relative to its carrier, which also rotates about the axle.
        let carried_rad_s = dot(&place.rate_rad_s, &cross(up, &rolling));
        let length = (rolling[0] * rolling[0] + rolling[1] * rolling[1]).sqrt();
        let [arm_x, arm_y, _] = place.centre_m;
        let [centre_x, centre_y, _] = place.velocity_m_s;
        WheelReading {
            rim_m_s: actuator_rad_s.map(|rate| self.rim_m_rad * rate + self.radius_m * carried_rad_s),
            noise_m_s,
            direction: [rolling[0] / length, rolling[1] / length],
            roller: self.roller,
            arm_m: [arm_x, arm_y],
            centre_m_s: [centre_x, centre_y],
            rise,
        }
    }
}

impl<R: Real> WheelReading<R> {
    /// Velocity of its centre over the ground for this motion of the vehicle.
    pub(super) fn over_ground(&self, [vx, vy, wz]: &[R; 3]) -> [R; 2] {
        let ([x, y], [centre_x, centre_y]) = (self.arm_m, self.centre_m_s);
        [*vx + centre_x - *wz * y, *vy + centre_y + *wz * x]
    }

    /// Slope of the path of a wheel whose rim is faster than its centre moves over the ground, the rim's noise
    /// subtracted \[m/m\]; 1 without a reading.
    pub(super) fn slope_by_rim(&self, velocity: &[R; 3]) -> R {
        let [wx, wy] = self.over_ground(velocity);
        let [dx, dy] = self.direction;
        let (along, across) = (wx * dx + wy * dy, wy * dx - wx * dy);
        let [cos, sin] = self.roller;
        let Some(rim) = self.rim_m_s else { return R::one() };
        let level = along - across * sin / cos;
        let excess = rim.abs() - level.abs() - R::of(SLIPS) * self.noise_m_s;
        let excess = max(excess, R::zero());
        let ground2 = max(level * level, R::of(SLOW_M_S * SLOW_M_S));
        (excess * (level.abs() + level.abs() + excess) / ground2).sqrt()
    }

    /// Its equation, with the slope of its path at this motion of the vehicle; none without a reading.
    ///
    /// The contact is where the path of the centre is perpendicular to the ground. The roller at the contact has its
    /// angle to the tangent of the rim there. Along the roller's axis the rim's speed is the speed of the centre.
    fn equation(&self, velocity: &[R; 3]) -> Option<WheelEquation<R>> {
        let rim_m_s = self.rim_m_s?;
        let ([dx, dy], [cos, sin]) = (self.direction, self.roller);
        let (px, py) = (cos * dx - sin * dy, cos * dy + sin * dx);
        let [wx, wy] = self.over_ground(velocity);
        let ground2 = wx * wx + wy * wy;
        let least = R::of(SLOW_M_S * SLOW_M_S);
        let speed2 = max(ground2, least);
        let speed = speed2.sqrt();
        // The square of the rise contains its noise, whose mean is subtracted.
        let rise2 = self.rise.m_s * self.rise.m_s - self.rise.variance;
        let [lower, upper] = SLOPE2.map(R::of);
        let slope2 = (rise2 / speed2).limited(lower, upper);
        let cosine2 = R::one() / (R::one() + slope2);
        let factor = if ground2 > least {
            let heading = [(wx * dx + wy * dy) / speed, (wx * dy - wy * dx) / speed];
            self.ground_per_rim(heading, cosine2)
        } else {
            // The direction of the path is not determined yet: along the push, and up by the rise.
            let rim2 = max(rim_m_s * rim_m_s, least);
            let up = (rise2 / rim2).limited(R::zero(), R::one());
            (R::one() - up).sqrt()
        };
        let [x, y] = self.arm_m;
        let centre = px * self.centre_m_s[0] + py * self.centre_m_s[1];
        let on_edge = R::of(EDGE_PART) * speed * (R::one() - cosine2).limited(R::zero(), R::one());
        Some(WheelEquation {
            factors: [px, py, py * x - px * y],
            rim_m_s: cos * rim_m_s * factor - centre,
            variance: self.noise_m_s * self.noise_m_s + on_edge * on_edge,
        })
    }

    /// Speed over the ground along the roller's axis, per speed of the rim along it. `c` and `s` are cosine and sine of
    /// the path's heading relative to the rolling direction, `cosine2` is the squared cosine of its slope.
    fn ground_per_rim(&self, [c, s]: [R; 2], cosine2: R) -> R {
        let [cos, sin] = self.roller;
        let cosine = cosine2.sqrt();
        let rim_level = (c * c + s * s * cosine2).sqrt();
        let (flat, tilted) = (cos * c - sin * s, cos * c - sin * s * cosine);
        let part = if tilted.abs() > R::of(0.05) {
            (flat / tilted).limited(R::zero(), R::of(3.0))
        } else {
            R::one()
        };
        rim_level * cosine * part
    }
}

/// Weights of the wheels: after Geman and McClure if an accelerometer predicts the velocity, else after Cauchy.
struct Weights<R> {
    /// Covariance of the predicted velocity \[m^2/s^2\]: xx, xy, yy. Zero without accelerometer.
    predicted: Option<[R; 3]>,
    /// Variance that is added to that of each wheel.
    unexplained: R,
}

impl<R: Real> Weights<R> {
    /// Of a wheel with this residual: its agreement, 0 to 1, and its weight.
    fn of(&self, equation: &WheelEquation<R>, residual: R) -> (R, R) {
        let [a, b, _] = equation.factors;
        let predicted = match self.predicted {
            Some([xx, xy, yy]) => a * a * xx + (a + a) * b * xy + b * b * yy,
            None => R::zero(),
        };
        let one = R::one();
        let normalised2 = residual * residual / (R::of(SLIPS * SLIPS) * (equation.variance + predicted));
        let agreement = one / (one + normalised2);
        let part = if self.predicted.is_some() {
            agreement * agreement
        } else {
            agreement
        };
        (agreement, part / (equation.variance + self.unexplained))
    }
}

/// Normal equations of the wheels, and sums over their residuals.
struct NormalEquations<R> {
    matrix: [[R; 3]; 3],
    right: [R; 3],
    readings: R,
    disagreement: R,
    agreement: R,
}

impl<R: Real> NormalEquations<R> {
    fn new(right: [R; 3]) -> Self {
        let zero = R::zero();
        Self {
            matrix: [[zero; 3]; 3],
            right,
            readings: zero,
            disagreement: zero,
            agreement: zero,
        }
    }

    /// Adds a wheel, with its weight at this motion of the vehicle.
    fn add(&mut self, equation: &WheelEquation<R>, velocity: &[R; 3], weights: &Weights<R>) {
        let residual = equation.rim_m_s - dot(&equation.factors, velocity);
        self.readings += R::one();
        self.disagreement += max(residual * residual - equation.variance, R::zero());
        let (agreement, weight) = weights.of(equation, residual);
        self.agreement += agreement;
        let sums = self.matrix.iter_mut().zip(&mut self.right);
        for ((row, right), factor) in sums.zip(equation.factors) {
            *right += weight * factor * equation.rim_m_s;
            for (sum, other) in row.iter_mut().zip(equation.factors) {
                *sum += weight * factor * other;
            }
        }
    }

    /// Mean over the readings; `none` without any.
    fn mean(&self, sum: R, none: R) -> R {
        if self.readings > R::zero() {
            sum / self.readings
        } else {
            none
        }
    }
}

/// The yaw rate by the gyro \[rad/s\], and its standard deviation.
pub(super) struct YawRate<R> {
    pub(super) rad_s: R,
    pub(super) deviation_rad_s: R,
}

/// The motion by least squares over the predicted velocity, the gyro and the wheels, reweighted in four rounds.
/// `disagreement_m2_s2` is the average over the periods before.
pub(super) fn estimate_motion<R: Real, const N: usize>(
    wheels: &[WheelReading<R>; N],
    predicted: &InertialFilter<R>,
    gyro: Option<YawRate<R>>,
    disagreement_m2_s2: R,
) -> MotionEstimate<R> {
    let (one, zero) = (R::one(), R::zero());
    let [vx, vy, wz] = predicted.velocity();
    let [[xx, xy], [_, yy]] = *predicted.velocity_variance();
    let [[ixx, ixy], [_, iyy]] = inverse(predicted.velocity_variance());
    let YawRate {
        rad_s: rate,
        deviation_rad_s: deviation,
    } = gyro.unwrap_or(YawRate {
        rad_s: wz,
        deviation_rad_s: R::of(YAW_RAD_S),
    });
    let information = one / (deviation * deviation);
    let by_accelerometer = predicted.by_accelerometer();
    let weights = Weights {
        predicted: by_accelerometer.then_some([xx, xy, yy]),
        unexplained: if by_accelerometer {
            R::of(UNEXPLAINED) * disagreement_m2_s2
        } else {
            zero
        },
    };
    let mut velocity = [vx, vy, rate];
    let mut covariance = [[xx, xy, zero], [xy, yy, zero], [zero, zero, one / information]];
    let right = [ixx * vx + ixy * vy, ixy * vx + iyy * vy, information * rate];
    let mut equations = NormalEquations::new(right);
    for _ in 0..ROUNDS {
        equations = NormalEquations::new(right);
        for equation in wheels.iter().filter_map(|wheel| wheel.equation(&velocity)) {
            equations.add(&equation, &velocity, &weights);
        }
        let [[a, b, c], [d, e, f], [g, h, i]] = equations.matrix;
        let whole = [
            [a + ixx, b + ixy, c],
            [d + ixy, e + iyy, f],
            [g, h, i + information],
        ];
        let Some(inverse) = matrix3::inverse(&whole) else {
            break;
        };
        velocity = inverse.map(|row| dot(&row, &equations.right));
        covariance = inverse;
    }
    MotionEstimate {
        velocity,
        covariance,
        disagreement_m2_s2: equations.mean(equations.disagreement, zero),
        agreement: equations.mean(equations.agreement, one),
        gyro_part: information * covariance[2][2],
    }
}
