//! Limits of the wheels' speed and torque for a motion along a path.

use crate::error::{each_within, finite, not_negative, positive, within};
use crate::geometry::{BodyTwist, Kinematics, PlanarPose, WheelTorques, WheelVelocities, WorldTwist};
use crate::motor::TorqueLimit;
use crate::shaping::MotionLimits;
use crate::{ConfigError, Real};

use super::piece::{PathPiece, WayShape, Waypoint, norm};
use super::time_law::bisected;

/// Mass and inertia of a vehicle that moves in the plane.
///
/// ```
/// use omni_core::path::PlanarInertia;
/// let crate_of_24_kg = PlanarInertia { mass_kg: 24.0, yaw_kg_m2: 24.0 * (0.36 + 0.16) / 12.0, centre_m: [0.0, 0.0] };
/// assert!((crate_of_24_kg.yaw_kg_m2 - 1.04_f64).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlanarInertia<R> {
    /// Mass of everything \[kg\], > 0.
    pub mass_kg: R,
    /// Yaw moment of inertia of the whole vehicle about the centre of mass \[kg.m^2\], > 0.
    pub yaw_kg_m2: R,
    /// Centre of mass, from the vehicle's origin, forward and to the left \[m\].
    pub centre_m: [R; 2],
}

/// The limits of a trajectory. Checked by [`TrajectoryPlanner::new`](crate::path::TrajectoryPlanner::new).
///
/// ```
/// use omni_core::path::{PathLimits, PlanarInertia};
/// use omni_core::shaping::MotionLimits;
/// use omni_core::TorqueLimit;
/// let motion = MotionLimits { velocity: 1.0, acceleration: 1.0, deceleration: 1.0, jerk: 10.0 };
/// let body = PlanarInertia { mass_kg: 24.0, yaw_kg_m2: 1.0, centre_m: [0.0; 2] };
/// let limits = PathLimits::new(motion, motion, body, [20.0; 4], [TorqueLimit::line(3.0, 0.1)?; 4]);
/// assert_eq!((limits.share, limits.wheel_kg_m2), (0.9, [0.0; 4]));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PathLimits<R, const N: usize> {
    /// Speed, acceleration, deceleration and jerk along the path, 0.001 or more (a speed may be 0);
    /// the acceleration also limits the lateral acceleration in bends. Acceleration and deceleration are finite.
    pub linear: MotionLimits<R>,
    /// The same of the heading.
    pub yaw: MotionLimits<R>,
    /// Largest components of the body twist, either way, 0, or 0.001 or more; infinite by default.
    pub fastest: BodyTwist<R>,
    /// Largest change of each component \[m/s^2, m/s^2, rad/s^2\], 0.001 or more; infinite by default.
    pub quickest: BodyTwist<R>,
    /// Fastest that actuators turn \[rad/s\], 0.001 or more, finite.
    pub speeds_rad_s: [R; N],
    /// Torque of the actuators at a speed.
    pub torques: [TorqueLimit<R>; N],
    /// The inertia that they accelerate.
    pub body: PlanarInertia<R>,
    /// Inertia of each wheel and rotor about its axle, as its actuator feels it \[kg.m^2\], >= 0; 0 by default.
    pub wheel_kg_m2: [R; N],
    /// Fraction of the wheels' speeds and torques that the trajectory may use, 0.05 to 1: the remaining fraction is for
    /// the follower. 0.9 by default.
    pub share: R,
}

impl<R: Real, const N: usize> PathLimits<R, N> {
    /// These limits and no others.
    #[must_use]
    pub fn new(
        linear: MotionLimits<R>,
        yaw: MotionLimits<R>,
        body: PlanarInertia<R>,
        speeds_rad_s: [R; N],
        torques: [TorqueLimit<R>; N],
    ) -> Self {
        let none = BodyTwist::from_array([R::of(f64::INFINITY); 3]);
        Self {
            linear,
            yaw,
            fastest: none,
            quickest: none,
            speeds_rad_s,
            torques,
            body,
            wheel_kg_m2: [R::ZERO; N],
            share: R::of(0.9),
        }
    }

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        speed_limit("linear.velocity", self.linear.velocity)?;
        speed_limit("yaw.velocity", self.yaw.velocity)?;
        for (name, value) in [
            ("linear.acceleration", self.linear.acceleration),
            ("linear.deceleration", self.linear.deceleration),
            ("yaw.acceleration", self.yaw.acceleration),
            ("yaw.deceleration", self.yaw.deceleration),
        ] {
            within(name, value, LEAST..=f64::MAX, "0.001 or more, finite")?;
        }
        positive("mass_kg", self.body.mass_kg)?;
        positive("yaw_kg_m2", self.body.yaw_kg_m2)?;
        change_limit("linear.jerk", self.linear.jerk)?;
        change_limit("yaw.jerk", self.yaw.jerk)?;
        each_within(
            &self.body.centre_m.map(|c| ("centre_m", c)),
            &(-100.0..=100.0),
            "-100 to 100",
        )?;
        for (speed, change) in self.fastest.to_array().into_iter().zip(self.quickest.to_array()) {
            speed_limit("fastest", speed)?;
            change_limit("quickest", change)?;
        }
        for (index, (&speed, &inertia)) in self.speeds_rad_s.iter().zip(&self.wheel_kg_m2).enumerate() {
            within("speeds_rad_s", speed, LEAST..=f64::MAX, "0.001 or more, finite")
                .map_err(|error| error.at(index))?;
            not_negative("wheel_kg_m2", inertia).map_err(|error| error.at(index))?;
        }
        within("share", self.share, 0.05..=1.0, "0.05 to 1").map(|_| ())
    }
}

/// The smallest limit that a way can be planned within [m, rad and s]: far below it times overflow.
/// A speed may be 0, which nothing moves at.
const LEAST: f64 = 1e-3;

/// `value` if it is 0, or large enough; infinity means no limit.
fn speed_limit<R: Real>(parameter: &'static str, value: R) -> Result<(), ConfigError> {
    if value == R::ZERO {
        return Ok(());
    }
    let allowed = "0, or 0.001 or more (infinity: no limit)";
    within(parameter, value, LEAST..=f64::INFINITY, allowed).map(|_| ())
}

/// `value` if it is large enough; infinity means no limit.
fn change_limit<R: Real>(parameter: &'static str, value: R) -> Result<(), ConfigError> {
    let allowed = "0.001 or more (infinity: no limit)";
    within(parameter, value, LEAST..=f64::INFINITY, allowed).map(|_| ())
}

/// The fraction of every limit on accelerations that bends may use, so that the remaining fraction is left for speeding
/// up and slowing down.
const BENDS: f64 = 0.5;
/// A jerk has three parts: of the bend's change, of speeding up in a bend, of the change of that.
const JERK_PARTS: f64 = 3.0;
/// The part of its torque at rest that a motor keeps at the highest speed.
const KEPT: f64 = 0.25;
/// Points of a piece at which limits are looked at: both ends and 31 between.
const POINTS: u8 = 32;

/// A vehicle's maps and limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vehicle<R, const N: usize> {
    pub(crate) kinematics: Kinematics<R, N>,
    pub(crate) limits: PathLimits<R, N>,
}

/// What a motion takes at one place of a path, by the way: at the speed v and the acceleration a
/// along it, `by_square * v^2 + by_change * a` of everything that has a limit.
struct Point<R, const N: usize> {
    twist: BodyTwist<R>,
    wheels: WheelVelocities<R, N>,
    torques_by_square: WheelTorques<R, N>,
    torques_by_change: WheelTorques<R, N>,
    rates_by_square: [R; 3],
    /// Lengths of the first three derivatives of the place, and the same of the heading.
    linear: [R; 3],
    yaw: [R; 3],
}

fn smaller<R: Real>(a: R, b: R) -> R {
    if b < a { b } else { a }
}

fn max<R: Real>(a: R, b: R) -> R {
    if b > a { b } else { a }
}

impl<R: Real, const N: usize> Vehicle<R, N> {
    /// Body twist of a velocity, and how its components change under an acceleration, both in the world, at a heading.
    fn in_body(heading: R, velocity: [R; 3], acceleration: [R; 3]) -> (BodyTwist<R>, [R; 3], [R; 3]) {
        let pose = PlanarPose {
            x_m: R::ZERO,
            y_m: R::ZERO,
            yaw_rad: heading,
        };
        let turned = |[vx_m_s, vy_m_s, wz_rad_s]: [R; 3]| {
            WorldTwist {
                vx_m_s,
                vy_m_s,
                wz_rad_s,
            }
            .to_body(&pose)
        };
        let (twist, along) = (turned(velocity), turned(acceleration).to_array());
        // The axes turn with the vehicle.
        let rates = [
            along[0] + twist.wz_rad_s * twist.vy_m_s,
            along[1] - twist.wz_rad_s * twist.vx_m_s,
            along[2],
        ];
        (twist, along, rates)
    }

    /// Actuator torques for an acceleration: the set with the smallest sum of squares that produces the force and the
    /// moment.
    pub(crate) fn torques(&self, heading: R, velocity: [R; 3], acceleration: [R; 3]) -> WheelTorques<R, N> {
        let (twist, [ax, ay, yaw], rates) = Self::in_body(heading, velocity, acceleration);
        let PlanarInertia {
            mass_kg,
            yaw_kg_m2,
            centre_m: [cx, cy],
        } = self.limits.body;
        let square = twist.wz_rad_s * twist.wz_rad_s;
        let force = [
            mass_kg * (ax - yaw * cy - square * cx),
            mass_kg * (ay + yaw * cx - square * cy),
        ];
        let moment = yaw_kg_m2 * yaw + cx * force[1] - cy * force[0];
        let [x, y, z] = self.kinematics.forward_matrix();
        let spun_up = self.kinematics.inverse(&BodyTwist::from_array(rates)).rad_s;
        let mut n_m = [R::ZERO; N];
        for (i, (torque, spin)) in n_m.iter_mut().zip(spun_up).enumerate() {
            *torque = x[i] * force[0] + y[i] * force[1] + z[i] * moment + self.limits.wheel_kg_m2[i] * spin;
        }
        WheelTorques { n_m }
    }

    fn point(&self, piece: &PathPiece<R>, z: R) -> Point<R, N> {
        let [place, first, second] = piece.at(piece.start_m + z * piece.length());
        let third = piece.third(z);
        let (twist, _, rates_by_square) = Self::in_body(place[2], first, second);
        let lengths = |k: fn([R; 3]) -> R| [first, second, third].map(k);
        Point {
            twist,
            wheels: self.kinematics.inverse(&twist),
            torques_by_square: self.torques(place[2], first, second),
            torques_by_change: self.torques(place[2], [R::ZERO; 3], first),
            rates_by_square,
            linear: lengths(|[x, y, _]| norm([x, y])),
            yaw: lengths(|[_, _, yaw]| yaw.abs()),
        }
    }

    /// What is left of each limit on accelerations at a speed, less what the bend takes; and what
    /// each unit of acceleration takes.
    fn left(&self, point: &Point<R, N>, speed: R, part: R) -> impl Iterator<Item = (R, R)> {
        let square = speed * speed;
        let share = part * self.limits.share;
        let wheels = core::array::from_fn::<_, N, _>(|i| {
            let upper = self.limits.torques[i]
                .range((point.wheels.rad_s[i] * speed).abs())
                .upper_n_m;
            (
                share * upper - point.torques_by_square.n_m[i].abs() * square,
                point.torques_by_change.n_m[i].abs(),
            )
        });
        let (quickest, twist) = (self.limits.quickest.to_array(), point.twist.to_array());
        let axes = core::array::from_fn::<_, 3, _>(|k| {
            (
                part * quickest[k] - point.rates_by_square[k].abs() * square,
                twist[k].abs(),
            )
        });
        let yaw = smaller(self.limits.yaw.acceleration, self.limits.yaw.deceleration);
        let heading = (part * yaw - point.yaw[1] * square, point.yaw[0]);
        wheels.into_iter().chain(axes).chain([heading])
    }

    /// Is the speed one that the wheels turn, at which motors keep [`KEPT`] of their torque, of
    /// which bends take [`BENDS`] at most, and whose jerk is a third at most?
    fn may_have(&self, point: &Point<R, N>, speed: R) -> bool {
        let PathLimits {
            linear,
            yaw,
            fastest,
            share,
            ..
        } = &self.limits;
        let turns = point.wheels.rad_s.iter().zip(&self.limits.speeds_rad_s);
        let components = point.twist.to_array().into_iter().zip(fastest.to_array());
        let third = R::of(1.0 / JERK_PARTS);
        let cube = speed * speed * speed;
        point.linear[0] * speed <= linear.velocity
            && point.yaw[0] * speed <= yaw.velocity
            && turns
                .into_iter()
                .all(|(turn, most)| turn.abs() * speed <= *share * *most)
            && components.into_iter().all(|(v, most)| v.abs() * speed <= most)
            && point.linear[1] * speed * speed <= smaller(linear.acceleration, linear.deceleration)
            && point.linear[2] * cube <= third * linear.jerk
            && point.yaw[2] * cube <= third * yaw.jerk
            && point
                .wheels
                .rad_s
                .iter()
                .zip(&self.limits.torques)
                .all(|(turn, torque)| {
                    torque.range((*turn * speed).abs()).upper_n_m
                        >= R::of(KEPT) * torque.range(R::ZERO).upper_n_m
                })
            && self
                .left(point, speed, R::of(BENDS))
                .all(|(left, _)| left >= R::ZERO)
    }

    /// The limits of a segment: the smallest of what all points of its pieces allow.
    pub(crate) fn allowed(&self, pieces: &[PathPiece<R>], fastest: R) -> MotionLimits<R> {
        let points = || {
            let part = |k: u8| R::of(f64::from(k) / f64::from(POINTS));
            let of = move |piece| (0..=POINTS).map(move |k| (piece, part(k)));
            pieces.iter().flat_map(of).map(|(piece, z)| self.point(piece, z))
        };
        let speed = points().fold(fastest, |speed, point| {
            if self.may_have(&point, speed) {
                speed
            } else {
                bisected(R::ZERO, speed, |less| self.may_have(&point, less))
            }
        });
        let PathLimits { linear, yaw, .. } = &self.limits;
        let third = R::of(1.0 / JERK_PARTS);
        let none = R::of(f64::INFINITY);
        let per = |left: R, each: R| if each > R::ZERO { left / each } else { none };
        let start = MotionLimits {
            velocity: speed,
            ..MotionLimits::unlimited()
        };
        let mut allowed = points().fold(start, |allowed, point| {
            let both = self
                .left(&point, speed, R::ONE)
                .map(|(left, each)| per(left, each))
                .chain([
                    per(third * linear.jerk, R::of(JERK_PARTS) * point.linear[1] * speed),
                    per(third * yaw.jerk, R::of(JERK_PARTS) * point.yaw[1] * speed),
                ])
                .fold(none, smaller);
            MotionLimits {
                acceleration: smaller(
                    allowed.acceleration,
                    smaller(both, per(linear.acceleration, point.linear[0])),
                ),
                deceleration: smaller(
                    allowed.deceleration,
                    smaller(both, per(linear.deceleration, point.linear[0])),
                ),
                ..allowed
            }
        });
        let most = max(allowed.acceleration, allowed.deceleration);
        for point in points() {
            for (jerk, [first, second, third]) in [(linear.jerk, point.linear), (yaw.jerk, point.yaw)] {
                let taken = third * speed * speed * speed + R::of(JERK_PARTS) * second * speed * most;
                allowed.jerk = smaller(allowed.jerk, per(jerk - taken, first));
            }
        }
        allowed
    }
}

/// A waypoint that can be planned to.
pub(crate) fn check_waypoint<R: Real>(waypoint: &Waypoint<R>) -> Result<(), ConfigError> {
    let far = -10_000.0..=10_000.0;
    within("waypoint.x_m", waypoint.x_m, far.clone(), "-10000 to 10000")?;
    within("waypoint.y_m", waypoint.y_m, far, "-10000 to 10000")?;
    if let Some(heading) = waypoint.heading_rad {
        within("waypoint.heading_rad", heading, -1000.0..=1000.0, "-1000 to 1000")?;
    }
    if let Some(speed) = waypoint.speed_m_s {
        positive("waypoint.speed_m_s", speed)?;
        within(
            "waypoint.speed_m_s",
            speed,
            0.0..=1000.0,
            "above 0 and up to 1000",
        )?;
    }
    if let Some(time_s) = waypoint.time_s {
        positive("waypoint.time_s", time_s)?;
        within("waypoint.time_s", time_s, 0.0..=1e5, "above 0 and up to 100000")?;
    }
    if let WayShape::Arc { sweep_rad } = waypoint.shape {
        finite("waypoint.sweep_rad", sweep_rad)?;
        within(
            "waypoint.sweep_rad",
            sweep_rad.abs(),
            0.01..=6.2,
            "0.01 to 6.2, or -6.2 to -0.01",
        )
        .map_err(|error| ConfigError {
            value: sweep_rad.as_f64(),
            ..error
        })?;
    }
    Ok(())
}
