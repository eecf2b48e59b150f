//! Geometry of a wheel's rollers: their positions, their largest size, and the roundness of the wheel.

use std::f64::consts::PI;

use super::Barrel;

/// The rollers of one wheel as they are built.
///
/// The wheel's frame: the axle, the rolling direction and up are a right-handed frame (rolling
/// direction x axle = up). Roller 0 of the first row is on the ground; a positive angle turns the
/// way the wheel turns when it drives along its rolling direction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RollerWheel {
    /// The shape of each roller.
    pub barrel: Barrel,
    /// Radius of the circle that the rollers' middles lie on \[m\].
    pub pitch_radius_m: f64,
    /// Largest distance of a roller's surface from the axle \[m\]: the wheel's radius.
    pub radius_m: f64,
    /// Axis of the roller on the ground, counter-clockwise from the rolling direction \[rad\].
    pub roller_angle_rad: f64,
    /// Rollers a row.
    pub count: usize,
    /// Rows, 1 or 2; the second one is turned by half a pitch.
    pub rows: usize,
    /// Distance of the rows' planes along the axle \[m\]; 0 for one row.
    pub row_gap_m: f64,
    /// Mass of a roller \[kg\].
    pub roller_mass_kg: f64,
    /// Damping of a roller's bearing \[N.m.s/rad\].
    pub friction_n_m_s_rad: f64,
}

/// How round a wheel of rollers is: the height of its axle above a plane that it rolls on, over one turn.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Ripple {
    /// Least height \[m\].
    pub min_m: f64,
    /// Largest height \[m\].
    pub max_m: f64,
    /// Way of the axle per turn over 2 pi \[m\]: the mean of the height.
    pub rolling_radius_m: f64,
}

impl Ripple {
    /// Difference of the heights, as a part of the largest.
    pub(crate) fn part(&self) -> f64 {
        (self.max_m - self.min_m) / self.max_m
    }
}

/// Gap that is kept between rollers, as a part of their radius.
const CLEARANCE: f64 = 0.02;
/// Part of a pitch that a roller covers where it is as long as is of any use.
const OVERLAP: f64 = 1.05;
/// Directions that are tried between two rollers, over half a turn.
const DIRECTIONS: usize = 180;
/// Steps of the turn within one pitch.
const TURN_STEPS: usize = 4096;

impl RollerWheel {
    /// Angle \[rad\] and place along the axle \[m\] of every roller, row by row.
    pub fn places(&self) -> impl Iterator<Item = (f64, f64)> {
        let pitch = 2.0 * PI / self.count as f64;
        let (rows, count, gap) = (self.rows, self.count, self.row_gap_m);
        (0..rows).flat_map(move |row| {
            let along = (row as f64 - 0.5 * (rows - 1) as f64) * gap;
            let first = 0.5 * pitch * row as f64;
            (0..count).map(move |k| (first + pitch * k as f64, along))
        })
    }

    /// Height of the axle \[m\] above a plane that touches the wheel from below, the wheel turned by an angle \[rad\].
    #[must_use]
    pub fn axle_height_m(&self, turn_rad: f64) -> f64 {
        let cos = libm::cos(self.roller_angle_rad);
        self.places()
            .map(|(angle, _)| {
                let here = angle + turn_rad;
                self.pitch_radius_m * libm::cos(here) + self.barrel.reach_m(cos * libm::sin(here))
            })
            .fold(f64::MIN, f64::max)
    }

    /// The height of the axle over a turn.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let scenario = Scenario::load("flat", &[Override::parse("physics.wheel_model=rollers")?])?;
    /// let ripple = scenario.rollers(0).expect("every wheel has rollers").ripple();
    /// assert!(ripple.max_m <= 0.066 + 1e-9 && ripple.min_m > 0.066 - 0.2e-3); // a wheel of 66 mm, round within 0.2 mm
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn ripple(&self) -> Ripple {
        let pitch = 2.0 * PI / (self.count * self.rows) as f64;
        let (mut min_m, mut max_m, mut sum) = (f64::MAX, f64::MIN, 0.0);
        for k in 0..TURN_STEPS {
            let height = self.axle_height_m(pitch * k as f64 / TURN_STEPS as f64);
            min_m = height.min(min_m);
            max_m = height.max(max_m);
            sum += height;
        }
        // A convex wheel rolls its circumference a turn, and that is the integral of its height over the turn (Cauchy).
        Ripple {
            min_m,
            max_m,
            rolling_radius_m: sum / TURN_STEPS as f64,
        }
    }

    /// Moment of inertia of all rollers about the axle \[kg.m^2\]: part of the wheel's.
    #[must_use]
    pub fn rollers_inertia_kg_m2(&self) -> f64 {
        let [axial, across] = self.roller_inertia_kg_m2();
        let (sin, cos) = (libm::sin(self.roller_angle_rad), libm::cos(self.roller_angle_rad));
        let each = self.roller_mass_kg * self.pitch_radius_m.powi(2) + axial * sin * sin + across * cos * cos;
        (self.rows * self.count) as f64 * each
    }

    /// Moments of inertia of a roller about its axis, as of a solid cylinder, and across it \[kg.m^2\].
    ///
    /// Across it a roller turns only with its wheel, whose inertia is the file's whatever part of it is
    /// called the roller's. Therefore that part is large, m R^2: the stiffness of the engine's contacts is proportional
    /// to the mass that they push, so that a roller, which tips, would yield more at its ends than in its middle.
    #[must_use]
    pub fn roller_inertia_kg_m2(&self) -> [f64; 2] {
        let radius = self.barrel.radius_m();
        [0.5 * radius * radius, self.radius_m * self.radius_m].map(|arm| arm * self.roller_mass_kg)
    }

    /// Moves the rollers out until the outermost point of their surface is on the rim; says whether
    /// they can be: very long ones reach beyond it wherever they are.
    pub(super) fn touch_rim(&mut self) -> bool {
        let cos = libm::cos(self.roller_angle_rad);
        let quarter = 0.5 * PI;
        for _ in 0..8 {
            let out = |turn: f64| {
                self.pitch_radius_m * libm::cos(turn) + self.barrel.reach_m(cos * libm::sin(turn))
            };
            let best = (0..=DIRECTIONS)
                .map(|k| quarter * k as f64 / DIRECTIONS as f64)
                .fold(0.0, |best, turn| if out(turn) > out(best) { turn } else { best });
            let step = quarter / DIRECTIONS as f64;
            let turn = highest([(best - step).max(0.0), (best + step).min(quarter)], out);
            let excess = out(turn) - self.radius_m;
            if excess.abs() < 1e-15 {
                break;
            }
            self.pitch_radius_m -= excess / libm::cos(turn);
            if !(self.barrel.radius_m()..=self.radius_m).contains(&self.pitch_radius_m) {
                return false;
            }
        }
        true
    }

    /// Is there a roller under the axle at every angle of the wheel, and the next one before it leaves?
    pub(super) fn closes_gaps(&self) -> bool {
        let half = OVERLAP * PI / (self.count * self.rows) as f64;
        self.barrel.end_sine() >= libm::cos(self.roller_angle_rad) * libm::sin(half)
    }

    /// Do neighbours keep their distance, in a row and between rows?
    pub(super) fn fits(&self) -> bool {
        let pitch = 2.0 * PI / self.count as f64;
        let row = self.gap_m(0.5 * pitch, 0.0) >= 0.0;
        let between = self.rows < 2
            || (self.gap_m(0.25 * pitch, self.row_gap_m) >= 0.0
                && self.gap_m(0.25 * pitch, -self.row_gap_m) >= 0.0);
        row && between
    }

    /// Do neighbours of the same row keep their distance?
    pub(super) fn fits_in_row(&self) -> bool {
        self.gap_m(PI / self.count as f64, 0.0) >= 0.0
    }

    /// Room between two rollers \[m\], turned by plus and minus `half_rad` about the axle and
    /// `along_m` apart on it, less what is kept; below 0 if they overlap.
    ///
    /// A half turn about the radius between them swaps the two, so if any plane parts them, one
    /// through that radius does.
    fn gap_m(&self, half_rad: f64, along_m: f64) -> f64 {
        let (sin, cos) = (libm::sin(half_rad), libm::cos(half_rad));
        let (angle_sin, angle_cos) = (libm::sin(self.roller_angle_rad), libm::cos(self.roller_angle_rad));
        // How far roller A, at +half and -along / 2, reaches across the plane whose normal is at `tilt` to the tangent.
        let across = |tilt: f64| {
            let (tilt_sin, tilt_cos) = (libm::sin(tilt), libm::cos(tilt));
            let middle = -self.pitch_radius_m * sin * tilt_cos - 0.5 * along_m * tilt_sin;
            let lean = (angle_cos * cos * tilt_cos + angle_sin * tilt_sin).clamp(-1.0, 1.0);
            middle + self.barrel.reach_m(lean)
        };
        let tilt = |k: usize| PI * (k as f64 / DIRECTIONS as f64 - 0.5);
        let best = (0..2 * DIRECTIONS)
            .min_by(|a, b| across(tilt(*a)).total_cmp(&across(tilt(*b))))
            .unwrap_or(0);
        let step = tilt(1) - tilt(0);
        let apart = highest([tilt(best) - step, tilt(best) + step], |tilt| -across(tilt));
        -2.0 * across(apart) - CLEARANCE * self.barrel.radius_m()
    }
}

/// Position of the maximum of a function with one peak in an interval.
fn highest([mut low, mut high]: [f64; 2], function: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if function(a) > function(b) {
            high = b;
        } else {
            low = a;
        }
    }
    0.5 * (low + high)
}
