//! The geometry of wheels whose rollers are bodies.

mod barrel;
mod geometry;
#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::collections::VecDeque;

pub use barrel::Barrel;
pub use geometry::{Ripple, RollerWheel};

use crate::rollers::Rollers;
use crate::wheel_spec::WheelSpec;

/// A key of [`Rollers`] that does not fit, and what would.
pub(crate) struct Misfit {
    pub(crate) key: &'static str,
    pub(crate) message: String,
}

/// Default fraction of the wheel's mass and inertia in its rollers, and minimum fraction of the hub.
const MASS_PART: f64 = 0.3;
const INERTIA_PART: f64 = 0.8;
const HUB_PART: f64 = 0.1;
/// Shortest roller, as a part of its diameter: shorter ones are discs with nothing to crown.
const SHORTEST: f64 = 0.15;

/// Ripple of a wheel without gaps, as a part of its radius: less is not felt.
const CLOSED: f64 = 1e-3;

/// Parameters of a wheel of rollers: rollers, and the wheel's radius, roller angle, mass and inertia.
type Parts = (Rollers, [f64; 4]);

thread_local! {
    /// Wheels that were built last: most wheels of a vehicle are alike, and each is asked for several times.
    static BUILT: RefCell<VecDeque<(Parts, RollerWheel)>> = const { RefCell::new(VecDeque::new()) };
}

/// Wheels that are kept.
const KEPT: usize = 16;

impl Rollers {
    /// Those of a wheel whose file gives none: nine as thick as a fifth of the wheel, two rows of
    /// them where their axes are across the wheel, which close the gaps.
    pub(crate) fn usual(wheel: &WheelSpec) -> Self {
        Self {
            count: 9,
            rows: if wheel.roller_angle_rad == 0.0 { 2 } else { 1 },
            row_gap_m: None,
            radius_m: wheel.radius_m / 5.0,
            length_m: None,
            crown_m: None,
            roller_mass_kg: None,
            friction_n_m_s_rad: 0.0,
        }
    }

    /// These rollers on a wheel.
    pub(crate) fn on(&self, wheel: &WheelSpec) -> Result<RollerWheel, Misfit> {
        let wheel_parts = [
            wheel.radius_m,
            wheel.roller_angle_rad,
            wheel.mass_kg,
            wheel.inertia_kg_m2,
        ];
        let parts = (*self, wheel_parts);
        let known = |built: &VecDeque<(Parts, RollerWheel)>| {
            built.iter().find(|(of, _)| *of == parts).map(|(_, built)| *built)
        };
        if let Some(built) = BUILT.with_borrow(known) {
            return Ok(built);
        }
        let built = self.build(wheel)?;
        BUILT.with_borrow_mut(|all| {
            all.truncate(KEPT - 1);
            all.push_front((parts, built));
        });
        Ok(built)
    }

    /// The largest radius of rollers that close the gaps of this wheel, with four digits; none if thinner ones do not.
    pub(crate) fn closing_radius_m(&self, wheel: &WheelSpec) -> Option<f64> {
        let closes = |radius_m: f64| {
            let thinner = Self {
                radius_m,
                length_m: None,
                crown_m: None,
                ..*self
            };
            thinner
                .build(wheel)
                .is_ok_and(|built| built.ripple().part() < CLOSED)
        };
        let radius_m = down(largest(self.radius_m, closes));
        closes(radius_m).then_some(radius_m)
    }

    fn build(&self, wheel: &WheelSpec) -> Result<RollerWheel, Misfit> {
        let most = 0.5 * wheel.radius_m;
        if self.radius_m >= most {
            return Err(misfit(
                "radius_m",
                self.radius_m,
                &format!("less than half the wheel's, {most}"),
            ));
        }
        if let (1, Some(gap)) = (self.rows, self.row_gap_m) {
            return Err(Misfit {
                key: "row_gap_m",
                message: format!("{gap}, allowed: only with rows = 2"),
            });
        }
        let half_length_m = self.half_length(wheel)?;
        let mut built = self
            .sized(wheel, self.radius_m, half_length_m)
            .ok_or_else(|| self.too_long(wheel, half_length_m))?;
        if let Some(crown) = self.crown_m {
            let mut round = *self;
            round.crown_m = None;
            let most = round
                .sized(wheel, self.radius_m, half_length_m)
                .map_or(self.radius_m, |b| b.barrel.crown_m());
            if crown > most {
                return Err(misfit(
                    "crown_m",
                    crown,
                    &format!("0 to {}, at which it follows the rim", down(most)),
                ));
            }
        }
        if !built.fits_in_row() {
            return Err(self.too_long(wheel, half_length_m));
        }
        if self.rows == 2 {
            let least = smallest(4.0 * self.radius_m + 2.0 * half_length_m, |gap| {
                built.row_gap_m = gap;
                built.fits()
            });
            built.row_gap_m = self.row_gap_m.unwrap_or(least);
            if built.row_gap_m < least {
                let allowed = format!("at least {}: closer rows overlap", up(least));
                return Err(misfit("row_gap_m", built.row_gap_m, &allowed));
            }
        }
        self.weigh(wheel, &mut built)?;
        Ok(built)
    }

    /// What a length that was given ought to be.
    fn too_long(&self, wheel: &WheelSpec, half_length_m: f64) -> Misfit {
        // What is shorter than its edges are round is no barrel; anything below is good for the search.
        let least = barrel::EDGE * self.radius_m;
        let most = largest(wheel.radius_m, |length| {
            length <= least
                || self
                    .sized(wheel, self.radius_m, length)
                    .is_some_and(|b| b.fits_in_row())
        });
        if most <= least * 1.001 {
            return self.too_thick(wheel);
        }
        let allowed = if half_length_m <= least {
            format!(
                "more than {}, twice the radius of its rounded edges",
                up(2.0 * least)
            )
        } else {
            format!(
                "up to {}: longer rollers overlap their neighbours",
                down(2.0 * most)
            )
        };
        misfit("length_m", 2.0 * half_length_m, &allowed)
    }

    /// What a radius that was given ought to be.
    fn too_thick(&self, wheel: &WheelSpec) -> Misfit {
        let most = largest(self.radius_m, |radius| {
            self.longest(wheel, radius) >= SHORTEST * radius
        });
        let allowed = format!(
            "up to {}: with {} rollers a row, thicker ones overlap their neighbours",
            down(most),
            self.count
        );
        misfit("radius_m", self.radius_m, &allowed)
    }

    /// Half the longest length of rollers of a radius that fits in its row and is of any use.
    fn longest(&self, wheel: &WheelSpec, radius_m: f64) -> f64 {
        largest(wheel.radius_m, |length| {
            self.sized(wheel, radius_m, length)
                .is_some_and(|b| b.fits_in_row() && (length < radius_m * SHORTEST || !b.closes_gaps()))
        })
    }

    /// Half the length of a roller: the one given, or the longest that fits in its row and is of any use.
    fn half_length(&self, wheel: &WheelSpec) -> Result<f64, Misfit> {
        if let Some(length) = self.length_m {
            return Ok(0.5 * length);
        }
        let found = self.longest(wheel, self.radius_m);
        if found >= SHORTEST * self.radius_m {
            return Ok(found);
        }
        Err(self.too_thick(wheel))
    }

    /// The wheel with rollers of that size, its rows in one plane and its rollers without mass;
    /// none if there is no such barrel.
    fn sized(&self, wheel: &WheelSpec, radius_m: f64, half_length_m: f64) -> Option<RollerWheel> {
        let cos = libm::cos(wheel.roller_angle_rad);
        let barrel = Barrel::new(radius_m, half_length_m, [wheel.radius_m, cos], self.crown_m)?;
        let mut built = RollerWheel {
            barrel,
            pitch_radius_m: wheel.radius_m - radius_m,
            radius_m: wheel.radius_m,
            roller_angle_rad: wheel.roller_angle_rad,
            count: self.count,
            rows: self.rows,
            row_gap_m: 0.0,
            roller_mass_kg: 0.0,
            friction_n_m_s_rad: self.friction_n_m_s_rad,
        };
        built.touch_rim().then_some(built)
    }

    /// Gives the rollers their mass and leaves the hub its own.
    fn weigh(&self, wheel: &WheelSpec, built: &mut RollerWheel) -> Result<(), Misfit> {
        let rollers = (self.rows * self.count) as f64;
        built.roller_mass_kg = 1.0;
        let inertia_a_kg = built.rollers_inertia_kg_m2();
        let within = |mass_part: f64, inertia_part: f64| {
            (mass_part * wheel.mass_kg / rollers).min(inertia_part * wheel.inertia_kg_m2 / inertia_a_kg)
        };
        built.roller_mass_kg = self.roller_mass_kg.unwrap_or(within(MASS_PART, INERTIA_PART));
        let most = within(1.0 - HUB_PART, 1.0 - HUB_PART);
        if built.roller_mass_kg > most {
            let allowed = format!(
                "up to {}: the hub must keep a tenth of the wheel's mass and inertia",
                down(most)
            );
            return Err(misfit("roller_mass_kg", built.roller_mass_kg, &allowed));
        }
        Ok(())
    }
}

fn misfit(key: &'static str, value: f64, allowed: &str) -> Misfit {
    Misfit {
        key,
        message: format!("{value}, allowed: {allowed}"),
    }
}

/// The largest good value from 0 to `most`, if smaller values are also good.
fn largest(most: f64, good: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if good(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The smallest good value from 0 to `most`, if larger values are also good.
fn smallest(most: f64, mut good: impl FnMut(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if good(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// A bound for a message, rounded to four digits so that it is within.
fn down(value: f64) -> f64 {
    rounded(value, f64::floor)
}

fn up(value: f64) -> f64 {
    rounded(value, f64::ceil)
}

fn rounded(value: f64, round: fn(f64) -> f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let digits = libm::pow(10.0, 3.0 - libm::floor(libm::log10(value)));
    round(value * digits) / digits
}
