//! How the vehicle moves over the ground: from every wheel the path of its centre, and the gyro.

use super::carried::{Carried, inverse};
use crate::Real;
use crate::geometry::matrix3;
use crate::linkage::{WheelPlace, cross, dot, turned};

/// Rounds of reweighting.
const ROUNDS: usize = 4;
/// Deviations from which on a wheel counts as one that slips.
const SLIPS: f64 = 3.0;
/// Part of what the wheels are beyond the motion that counts as noise of each, where an accelerometer knows better.
const UNLIKELY: f64 = 0.3;
/// Part of the path of a wheel on an edge that its contact may be off by, per squared sine of the slope.
const EDGE_PART: f64 = 0.1;
/// Yaw rate beyond which there is no need to look \[rad/s\].
const YAW_RAD_S: f64 = 1.0;
/// Slower than that the slope of the path is not found from the velocity \[m/s\].
const SLOW_M_S: f64 = 0.02;

/// A wheel as it is built.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub(super) struct RollingWheel<R> {
    pub(super) radius_m: R,
    /// Speed of the rim per velocity of the actuator \[m/rad\].
    pub(super) rim_m_rad: R,
    /// Rolling direction, and cosine and sine of the roller's angle to it.
    pub(super) direction: [R; 2],
    pub(super) roller: [R; 2],
}

/// What a wheel says of the vehicle's motion in a period.
#[derive(Clone, Copy)]
pub(super) struct WheelView<R> {
    /// Speed of its rim against the ground \[m/s\]; none without a reading.
    pub(super) rim_m_s: Option<R>,
    /// Rolling direction, level and of length 1.
    direction: [R; 2],
    /// Arm and velocity of its centre against the base's origin, level.
    pub(super) arm_m: [R; 2],
    own_m_s: [R; 2],
    /// How fast its centre rises \[m/s\].
    pub(super) rise_m_s: R,
    pub(super) rise_variance: R,
    roller: [R; 2],
    noise_m_s: R,
}

impl<R: Real> RollingWheel<R> {
    /// From where the wheel is and what its encoder reads.
    pub(super) fn view(
        &self,
        place: &WheelPlace<R>,
        read_rad_s: Option<R>,
        rise: (R, R),
        noise_m_s: R,
    ) -> WheelView<R> {
        let [x, y] = self.direction;
        let ahead = turned(&place.axes, &[x, y, R::zero()]);
        let [_, _, up] = &place.axes;
        // Its encoder reads the wheel against its carrier, which turns about the axle too.
        let carried = dot(&place.rate_rad_s, &cross(up, &ahead));
        let length = (ahead[0] * ahead[0] + ahead[1] * ahead[1]).sqrt();
        let [arm_x, arm_y, _] = place.centre_m;
        let [own_x, own_y, _] = place.velocity_m_s;
        WheelView {
            rim_m_s: read_rad_s.map(|read| self.rim_m_rad * read + self.radius_m * carried),
            direction: [ahead[0] / length, ahead[1] / length],
            arm_m: [arm_x, arm_y],
            own_m_s: [own_x, own_y],
            rise_m_s: rise.0,
            rise_variance: rise.1,
            roller: self.roller,
            noise_m_s,
        }
    }
}

/// Motion over the ground, and its covariance in one period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Travel<R> {
    /// Forward, to the left, and turning \[m/s, m/s, rad/s\].
    pub(super) velocity: [R; 3],
    pub(super) covariance: [[R; 3]; 3],
    /// Mean square of what the rims are beyond what the motion asks and their noise \[m^2/s^2\].
    pub(super) disagreement: R,
    /// How much the wheels agree with what was known before, 0 to 1.
    pub(super) agreement: R,
    /// Part that the gyro has in the yaw rate.
    pub(super) gyro_part: R,
}

impl<R: Real> WheelView<R> {
    /// Velocity of its centre over the ground for this motion of the vehicle.
    pub(super) fn over_ground(&self, [vx, vy, wz]: &[R; 3]) -> [R; 2] {
        let ([x, y], [own_x, own_y]) = (self.arm_m, self.own_m_s);
        [*vx + own_x - *wz * y, *vy + own_y + *wz * x]
    }

    /// How steep the path of a wheel is whose rim is faster than its centre moves over the ground, noise of the rim left out.
    pub(super) fn steep(&self, velocity: &[R; 3]) -> R {
        let [wx, wy] = self.over_ground(velocity);
        let [dx, dy] = self.direction;
        let (along, across) = (wx * dx + wy * dy, wy * dx - wx * dy);
        let [cg, sg] = self.roller;
        let Some(rim) = self.rim_m_s else { return R::one() };
        let rolled = along - across * sg / cg;
        let least = R::of(SLOW_M_S * SLOW_M_S);
        let ground = rolled * rolled;
        let beyond = rim.abs() - rolled.abs() - R::of(SLIPS) * self.noise_m_s;
        let beyond = if beyond > R::zero() { beyond } else { R::zero() };
        let ground = if ground > least { ground } else { least };
        (beyond * (rolled.abs() + rolled.abs() + beyond) / ground).sqrt()
    }

    /// Its line of the equations: factors of the motion, what they amount to by the rim, and the deviation of that.
    ///
    /// The contact lies where the path of the centre is perpendicular to the ground. The axis of the roller on the ground is at its angle to the
    /// tangent of the rim there, and along that axis the ground sees what the rim does.
    fn line(&self, velocity: &[R; 3], rim_m_s: R) -> ([R; 3], R, R) {
        let ([dx, dy], [cg, sg]) = (self.direction, self.roller);
        let (px, py) = (cg * dx - sg * dy, cg * dy + sg * dx);
        let [wx, wy] = self.over_ground(velocity);
        let ground = wx * wx + wy * wy;
        let least = R::of(SLOW_M_S * SLOW_M_S);
        let speed2 = if ground > least { ground } else { least };
        let speed = speed2.sqrt();
        // Noise of the rise has no sign in its square: its mean is taken off.
        let rise2 = self.rise_m_s * self.rise_m_s - self.rise_variance;
        let steep = (rise2 / speed2).limited(R::of(-0.2), R::of(25.0));
        let cosine2 = R::one() / (R::one() + steep);
        let cosine = cosine2.sqrt();
        let (c, s) = ((wx * dx + wy * dy) / speed, (wx * dy - wy * dx) / speed);
        let rim_level = (c * c + s * s * cosine2).sqrt();
        let (flat, tilted) = (cg * c - sg * s, cg * c - sg * s * cosine);
        let part = if tilted.abs() > R::of(0.05) {
            (flat / tilted).limited(R::zero(), R::of(3.0))
        } else {
            R::one()
        };
        let factor = if ground > least {
            rim_level * cosine * part
        } else {
            // Where it goes is not known yet: along its push, and up by the rise.
            let rim2 = rim_m_s * rim_m_s;
            let fast = if rim2 > least { rim2 } else { least };
            let up = (rise2 / fast).limited(R::zero(), R::one());
            (R::one() - up).sqrt()
        };
        let arm = self.arm_m;
        let line = [px, py, py * arm[0] - px * arm[1]];
        let known = px * self.own_m_s[0] + py * self.own_m_s[1];
        let unsure = R::of(EDGE_PART) * speed * (R::one() - cosine2).limited(R::zero(), R::one());
        let deviation2 = self.noise_m_s * self.noise_m_s + unsure * unsure;
        (line, cg * rim_m_s * factor - known, deviation2)
    }
}

/// The motion that wheels, gyro and accelerometer agree on: least squares, wheels that disagree count less (after Cauchy; where an
/// accelerometer carries the velocity, after Geman and McClure).
pub(super) fn travel<R: Real, const N: usize>(
    wheels: &[WheelView<R>; N],
    prior: &Carried<R>,
    gyro: Option<(R, R)>,
    disagreement: R,
) -> Travel<R> {
    let (one, zero) = (R::one(), R::zero());
    let turning = one / R::of(YAW_RAD_S * YAW_RAD_S);
    let [vx, vy, wz] = prior.velocity;
    let [[xx, xy], [_, yy]] = *prior.velocity_variance();
    let [[ixx, ixy], [_, iyy]] = inverse(prior.velocity_variance());
    let (rate, sure) = match gyro {
        Some((rate, deviation)) => (rate, one / (deviation * deviation)),
        None => (wz, turning),
    };
    let unlikely = if prior.by_accelerometer {
        R::of(UNLIKELY) * disagreement
    } else {
        zero
    };
    let mut velocity = [vx, vy, rate];
    let mut covariance = [[xx, xy, zero], [xy, yy, zero], [zero, zero, one / sure]];
    let (mut disagreement, mut readings, mut agreement) = (zero, zero, zero);
    for _ in 0..ROUNDS {
        let mut matrix = [[zero; 3]; 3];
        let mut right = [ixx * vx + ixy * vy, ixy * vx + iyy * vy, sure * rate];
        (disagreement, readings, agreement) = (zero, zero, zero);
        for wheel in wheels {
            let Some(rim) = wheel.rim_m_s else { continue };
            let (line, says, deviation2) = wheel.line(&velocity, rim);
            let beyond = says - dot(&line, &velocity);
            readings += one;
            let more = beyond * beyond - deviation2;
            disagreement += if more > zero { more } else { zero };
            let [a, b, _] = line;
            let unsure = if prior.by_accelerometer {
                a * a * xx + (a + a) * b * xy + b * b * yy
            } else {
                zero
            };
            let unlike = beyond * beyond / (R::of(SLIPS * SLIPS) * (deviation2 + unsure));
            let like = one / (one + unlike);
            agreement += like;
            let weight = if prior.by_accelerometer { like * like } else { like } / (deviation2 + unlikely);
            for (row, (to, factor)) in matrix.iter_mut().zip(right.iter_mut().zip(line)) {
                *to += weight * factor * says;
                for (sum, other) in row.iter_mut().zip(line) {
                    *sum += weight * factor * other;
                }
            }
        }
        let [[a, b, c], [d, e, f], [g, h, i]] = matrix;
        let known = [[a + ixx, b + ixy, c], [d + ixy, e + iyy, f], [g, h, i + sure]];
        let Some(inverse) = matrix3::inverse(&known) else {
            break;
        };
        velocity = inverse.map(|row| dot(&row, &right));
        covariance = inverse;
    }
    Travel {
        velocity,
        covariance,
        disagreement: if readings > zero {
            disagreement / readings
        } else {
            zero
        },
        agreement: if readings > zero {
            agreement / readings
        } else {
            one
        },
        gyro_part: sure * covariance[2][2],
    }
}
