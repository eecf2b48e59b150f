//! Where a ball represents a wheel with rollers, and where it does not.
//!
//! A ball of the wheel's radius is the wheel where the ground's normal is at right angles to two axes: the axle,
//! because only there does the rim reach as far as the ball, and the ball's driven axis, because a ball is free to
//! spin about a normal that leans towards it: the motor then turns the ball on the spot instead of pushing. For an
//! omni wheel the two are one, so a ball is the wheel wherever the normal lies in the wheel's own plane: over any edge
//! straight ahead. For a mecanum wheel they are a roller angle apart, and only what is level under the wheel is at
//! right angles to both. A ball of a roller's radius is the wheel across its push, as long as nothing asks it to push.

#[cfg(test)]
mod tests;

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt;

use crate::{CommandFrame, Scenario, Terrain, Vehicle, WheelContact, WheelModel, WheelSpec};

/// How far the ground's normal may lean out of the plane in which a ball is a wheel \[rad\]: 10 degrees. Of a blocked
/// ball's torque 98.5 % still push then, and the ball turns with 3 % of what the torque would give a free one.
pub const BALL_LEAN_RAD: f64 = 10.0 * PI / 180.0;

/// A wheel whose ball is not the wheel it stands for.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BeyondBall {
    /// Its name.
    pub wheel: String,
    /// How far the ground's normal leans there out of the plane in which the ball is the wheel
    /// \[rad\], more than [`BALL_LEAN_RAD`].
    pub lean_rad: f64,
}

impl fmt::Display for BeyondBall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [lean, most] = [self.lean_rad, BALL_LEAN_RAD].map(f64::to_degrees);
        write!(
            f,
            "the ground's normal leans {lean:.0} deg out of the rolling plane of wheel {}, allowed: {most:.0}",
            self.wheel
        )
    }
}

/// Directions in the vehicle's plane, about a middle one \[rad\].
#[derive(Clone, Copy)]
struct Fan {
    middle_rad: f64,
    half_rad: f64,
}

impl Fan {
    const ALL: Self = Self {
        middle_rad: 0.0,
        half_rad: PI,
    };

    /// The largest size of the cosine of the angle between one of them and a direction.
    fn along(self, direction_rad: f64) -> f64 {
        let off = direction_rad - self.middle_rad;
        let off = (off - PI * (off / PI).round()).abs();
        libm::cos((off - self.half_rad).max(0.0))
    }
}

impl Scenario {
    /// The wheel whose ball stands least for it on this ground, where one does not: the normal
    /// leans by more than [`BALL_LEAN_RAD`] out of the plane in which that ball is the wheel. None
    /// where all balls do, and for wheels of rollers.
    ///
    /// From the wheels' directions and roller angles, the directions in which the vehicle looks and
    /// is commanded to go, and the ground's steepest normal; a command that turns meets an obstacle
    /// at any angle. How a run went is not looked at.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let ball = || Override::new("physics.wheel_model", "ball");
    /// let of = |vehicle: &str| Scenario::load("step", &[Override::new("vehicle", vehicle), ball()]);
    /// assert_eq!(of("chugo7")?.beyond_balls(), None); // omni wheels, straight ahead
    /// // An edge of 5 cm meets a rim of 76 mm at 70 degrees, and its rollers stand at 45 degrees to it: asin(sin 70 sin 45).
    /// let mecanum = of("mecanum4")?.beyond_balls().expect("mecanum wheels at an edge");
    /// assert!((mecanum.lean_rad.to_degrees() - 41.7).abs() < 0.1);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn beyond_balls(&self) -> Option<BeyondBall> {
        self.beyond_balls_with(self.wheel_model())
    }

    /// The same under a wheel model.
    pub(crate) fn beyond_balls_with(&self, model: WheelModel) -> Option<BeyondBall> {
        let ball = |(i, wheel): (usize, &WheelSpec)| {
            let spec = self.vehicle().rollers(i, model).is_none().then_some(wheel)?;
            let radius_m = spec.contact_radius_m();
            // A block has edges on all sides.
            let blocks = edge(self.highest_block_m(), radius_m);
            let [ahead, aside] = self.terrain.steepest(radius_m).map(|most| most.max(blocks));
            let (looks, pushes) = (self.looks(), self.pushes(spec));
            let meets = |from: Fan, steepest: f64| steepest * off_plane(spec, from, pushes);
            // What lies across the way is met from a quarter further.
            let beside = Fan {
                middle_rad: looks.middle_rad + FRAC_PI_2,
                ..looks
            };
            Some(beyond(spec, meets(looks, ahead).max(meets(beside, aside))))
        };
        let wheels = self.vehicle().wheel.iter().enumerate().filter_map(ball);
        worst(wheels)
    }

    /// Does the command turn the vehicle?
    fn turns(&self) -> bool {
        self.command.turns()
    }

    /// The world's forward as the vehicle sees it.
    fn looks(&self) -> Fan {
        if self.turns() {
            return Fan::ALL;
        }
        Fan {
            middle_rad: -self.start.heading_rad,
            half_rad: self.perturbation.yaw_rad,
        }
    }

    /// Does some command ask the wheel to push?
    fn pushes(&self, wheel: &WheelSpec) -> bool {
        let later = self.command.then.iter().map(|then| [then.vx_m_s, then.vy_m_s]);
        let mut all = later.chain([[self.command.vx_m_s, self.command.vy_m_s]]);
        let world = self.looks();
        self.turns()
            || all.any(|[vx, vy]| {
                let way = libm::atan2(vy, vx);
                let fan = match self.command.frame {
                    CommandFrame::Body => Fan {
                        middle_rad: way,
                        half_rad: 0.0,
                    },
                    CommandFrame::World => Fan {
                        middle_rad: way + world.middle_rad,
                        ..world
                    },
                };
                libm::hypot(vx, vy) > 0.0 && fan.along(push_rad(wheel)) > libm::sin(BALL_LEAN_RAD)
            })
    }
}

impl Vehicle {
    /// The wheel whose ball stands least for it at an upright edge straight ahead, driven forward, where one
    /// does not: see [`Scenario::beyond_balls`]. None too where wheels are rollers by their own `contact`.
    ///
    /// ```
    /// use omni_config::Vehicle;
    /// assert_eq!(Vehicle::load("chugo7")?.beyond_balls_ahead(), None);
    /// assert!(Vehicle::load("omni3")?.beyond_balls_ahead().is_some_and(|wheel| wheel.wheel == "1")); // stands crosswise
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn beyond_balls_ahead(&self) -> Option<BeyondBall> {
        let ahead = Fan {
            middle_rad: 0.0,
            half_rad: 0.0,
        };
        let balls = self
            .wheel
            .iter()
            .filter(|wheel| !matches!(wheel.contact, WheelContact::Rollers(_)));
        worst(balls.map(|wheel| {
            let pushes = ahead.along(push_rad(wheel)) > libm::sin(BALL_LEAN_RAD);
            beyond(wheel, off_plane(wheel, ahead, pushes))
        }))
    }
}

/// Direction of a wheel's push in the vehicle's plane \[rad\].
fn push_rad(wheel: &WheelSpec) -> f64 {
    let [dx, dy] = wheel.rolling_direction;
    (libm::atan2(dy, dx) + wheel.roller_angle_rad).rem_euclid(TAU)
}

/// Sine of the lean of a level normal from those directions out of the plane in which the ball is the wheel.
fn off_plane(wheel: &WheelSpec, from: Fan, pushes: bool) -> f64 {
    let push = push_rad(wheel);
    let driven = from.along(push + FRAC_PI_2);
    match wheel.contact {
        WheelContact::Roller { .. } if pushes => driven.max(from.along(push)),
        WheelContact::Roller { .. } => from.along(push),
        _ => driven.max(from.along(push - wheel.roller_angle_rad + FRAC_PI_2)),
    }
}

fn beyond(wheel: &WheelSpec, sine: f64) -> BeyondBall {
    BeyondBall {
        wheel: wheel.name.clone(),
        lean_rad: libm::asin(sine.min(1.0)),
    }
}

/// The first of those that lean most, if that is too much.
fn worst(wheels: impl Iterator<Item = BeyondBall>) -> Option<BeyondBall> {
    let worse = |a: BeyondBall, b: BeyondBall| if b.lean_rad > a.lean_rad { b } else { a };
    wheels
        .reduce(worse)
        .filter(|wheel| wheel.lean_rad > BALL_LEAN_RAD)
}

fn sine_of_cosine(cosine: f64) -> f64 {
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// Sine of the angle between the vertical and the normal where a ball of this radius meets an edge of this height.
fn edge(height_m: f64, radius_m: f64) -> f64 {
    sine_of_cosine((1.0 - height_m / radius_m).max(0.0))
}

impl Terrain {
    /// Sine of the largest angle between the vertical and the normal where a ball of this radius
    /// \[m\] meets the ground: of normals along world x, and of those along y.
    ///
    /// An edge meets it where it is as high; a bar where the two touch; of a random surface twice
    /// the root mean square of the slope, which 95 in 100 places do not exceed; of a picture the
    /// steepest slope over a quarter of the radius.
    fn steepest(&self, radius_m: f64) -> [f64; 2] {
        let edge = |height: f64| edge(height, radius_m);
        let of_slope = |slope: f64| slope / libm::hypot(slope, 1.0);
        match self {
            Self::Flat { .. } => [0.0; 2],
            Self::Step { height_m, .. }
            | Self::StepDown { height_m, .. }
            | Self::Stairs { height_m, .. }
            | Self::HalfStep { height_m, .. } => [edge(*height_m), 0.0],
            Self::Ramp { slope_rad, .. } => [libm::sin(*slope_rad), 0.0],
            Self::Ditch { width_m, depth_m, .. } => {
                [edge(*depth_m).min((0.5 * width_m / radius_m).min(1.0)), 0.0]
            }
            Self::Bumps {
                height_m, width_m, ..
            } => {
                let bar = (width_m * width_m / 4.0 + height_m * height_m) / (2.0 * height_m);
                [sine_of_cosine(1.0 - height_m / (radius_m + bar)), 0.0]
            }
            Self::Rough {
                rms_m, wavelength_m, ..
            } => {
                // Waves of one to four wavelengths, evenly: the mean of the squared wave number is
                // a quarter of the largest, and half of that is along either axis.
                let slope = rms_m * (TAU / wavelength_m) / 8.0_f64.sqrt();
                [of_slope(2.0 * slope); 2]
            }
            Self::HeightMap {
                image,
                pixel_m,
                black_height_m,
                white_height_m,
                ..
            } => {
                let most = (image.rows() - 1).min(image.columns() - 1);
                let over = ((0.25 * radius_m / pixel_m).round() as usize).clamp(1, most);
                let slope = (white_height_m - black_height_m).abs() / (over as f64 * pixel_m);
                image.steepest(over).map(|rise| of_slope(rise * slope))
            }
        }
    }
}
