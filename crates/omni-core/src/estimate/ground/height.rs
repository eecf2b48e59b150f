//! Height of the vehicle, by wheels on ground of known height.

use super::grid::{GridPosition, GroundHeight, HeightGrid, Visit};
use crate::Real;
use crate::scalar::min;

/// Slope that is added to that of the ground in a wheel's weight \[m/m\].
const LEVEL_SLOPE: f64 = 0.03;
/// Standard deviation of the slope of unknown ground, relative to its slope so far \[m/m\].
const UNKNOWN_SLOPE: f64 = 0.3;
/// What the slope so far adds to it.
const UNKNOWN_PART_OF_SLOPE: f64 = 3.0;
/// Error of a wheel's position relative to the wheel that recorded the ground \[m\].
const POSITION_M: f64 = 2e-3;
/// Distance from the ground at which the weight of a wheel is half as large \[m\].
const LIFTED_M: f64 = 0.006;
/// Distance from the contact from which recorded ground is another one, a hole or another storey \[m\].
const OTHER_GROUND_M: f64 = 0.1;
/// Time constant of the height's approach to the known ground \[s\].
const SETTLES_S: f64 = 0.2;
/// Distance over unknown ground after which the deviation of the height does not grow any more \[m\].
const LONGEST_M: f64 = 1e6;
/// Largest rate of rise \[m/s\].
const FASTEST_M_S: f64 = 5.0;
/// Standard deviation of the height of unknown ground, relative to the distance over it \[m/m\].
const UNKNOWN_PART: f64 = 0.1;

/// A wheel on the ground.
#[derive(Clone, Copy)]
pub(super) struct Follower<R> {
    pub(super) position: GridPosition<R>,
    /// Height of its contact above the base's origin \[m\], and its increase in the period.
    pub(super) height_m: R,
    pub(super) increase_m: R,
    /// Ground below it a period ago \[m\]; NaN if it was not known.
    pub(super) last_m: R,
    /// Arm from the base's origin, along the heading and to its left \[m\].
    pub(super) arm_m: [R; 2],
    /// Slope of its path so far \[m/m\], and the slope by its rim.
    pub(super) slope: R,
    pub(super) slope_by_rim: R,
}

/// Displacement of the vehicle in a period.
#[derive(Clone, Copy)]
pub(super) struct Displacement<R> {
    /// A displacement of one cell in its direction \[cells\].
    pub(super) unit: [R; 2],
    pub(super) length_m: R,
    /// Rise of the plane of the contacts over it \[m\].
    pub(super) plane_m: R,
    pub(super) period_s: R,
    /// Distance travelled since the start \[cells\], and the side of a cell \[m\].
    pub(super) travelled: u32,
    pub(super) cell_m: R,
}

/// Ground that determines the height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Support<R> {
    /// Mean variance of its height \[m^2\].
    pub(super) variance_m2: R,
    /// Mean arm of the wheels on it \[m\].
    pub(super) arm_m: [R; 2],
}

/// Rise of the base in a period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rise<R, const N: usize> {
    pub(super) by_m: R,
    /// None if no wheel is on known ground.
    pub(super) support: Option<Support<R>>,
    /// Ground below each wheel \[m\]; NaN if it is not known.
    pub(super) ground_m: [R; N],
}

/// Variance of the vehicle's height.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct HeightError<R> {
    pub(super) variance_m2: R,
    /// Variance of the ground that determined the height last, grown since then, and the mean arm of the wheels on it.
    ground_m2: R,
    arm_m: [R; 2],
    /// Distance since then \[m\].
    unknown_m: R,
}

impl<R: Real> HeightError<R> {
    pub(super) fn none() -> Self {
        let zero = R::zero();
        Self {
            variance_m2: zero,
            ground_m2: zero,
            arm_m: [zero; 2],
            unknown_m: zero,
        }
    }

    /// A period over ground that determines the height, or over unknown ground. The ground and its variance.
    pub(super) fn update(&mut self, support: Option<Support<R>>, length_m: R) -> Support<R> {
        let support = if let Some(support) = support {
            self.unknown_m = R::zero();
            support
        } else {
            let before = R::of(UNKNOWN_PART) * self.unknown_m;
            self.unknown_m = min(self.unknown_m + length_m, R::of(LONGEST_M));
            let after = R::of(UNKNOWN_PART) * self.unknown_m;
            Support {
                variance_m2: self.ground_m2 + after * after - before * before,
                arm_m: self.arm_m,
            }
        };
        (self.ground_m2, self.arm_m) = (support.variance_m2, support.arm_m);
        support
    }
}

/// Weighted sums over the wheels.
struct Sums<R> {
    weight: R,
    rise_m: R,
    gap_m: R,
    variance_m2: R,
    arm_m: [R; 2],
    /// Of wheels on unknown ground.
    unknown_weight: R,
    unknown_rise_m: R,
}

impl<R: Real> Sums<R> {
    fn new() -> Self {
        let zero = R::zero();
        Self {
            weight: zero,
            rise_m: zero,
            gap_m: zero,
            variance_m2: zero,
            arm_m: [zero; 2],
            unknown_weight: zero,
            unknown_rise_m: zero,
        }
    }

    /// Adds a wheel on unknown ground: the ground continues with its slope, unless the speed of the rim contradicts.
    fn add_unknown(&mut self, follower: &Follower<R>, length_m: R) {
        let deviation = R::of(UNKNOWN_SLOPE)
            + R::of(UNKNOWN_PART_OF_SLOPE) * follower.slope.abs()
            + follower.slope_by_rim;
        let weight = R::one() / (deviation * deviation);
        self.unknown_weight += weight;
        self.unknown_rise_m += weight * (follower.slope * length_m - follower.increase_m);
    }

    /// Adds a wheel on ground of this height and slope. `gap_m` is the distance of the ground from the contact.
    fn add_known(&mut self, follower: &Follower<R>, ground: &GroundHeight<R>, slope: R, gap_m: R, cell_m: R) {
        let lifted = gap_m / R::of(LIFTED_M);
        // On a slope an error of the position is an error of the height, and so is a different recorded height.
        let position_m = slope * R::of(POSITION_M);
        let variance = ground.variance_m2 + position_m * position_m;
        let deviation = R::of(LEVEL_SLOPE) + slope;
        let deviation = deviation + ground.variance_m2.sqrt() / cell_m;
        let weight = R::one() / (deviation * deviation * (R::one() + lifted * lifted));
        self.weight += weight;
        self.rise_m += weight * (ground.height_m - follower.last_m - follower.increase_m);
        self.gap_m += weight * gap_m;
        self.variance_m2 += weight * variance;
        for (sum, arm) in self.arm_m.iter_mut().zip(follower.arm_m) {
            *sum += weight * arm;
        }
    }

    /// If no wheel is on known ground, the ground continues as the plane of the contacts.
    fn rise_m(&self, displacement: &Displacement<R>) -> R {
        let part = displacement.period_s / (displacement.period_s + R::of(SETTLES_S));
        let rise_m = if self.weight > R::zero() {
            (self.rise_m + self.unknown_rise_m + part * self.gap_m) / (self.weight + self.unknown_weight)
        } else {
            displacement.plane_m
        };
        let most_m = R::of(FASTEST_M_S) * displacement.period_s;
        rise_m.limited(-most_m, most_m)
    }

    fn support(&self) -> Option<Support<R>> {
        (self.weight > R::zero()).then(|| Support {
            variance_m2: self.variance_m2 / self.weight,
            arm_m: self.arm_m.map(|each| each / self.weight),
        })
    }
}

/// Slope of the ground at a wheel, over one cell in both directions of the displacement \[m/m\].
fn slope_at<R: Real>(
    grid: &HeightGrid<R>,
    follower: &Follower<R>,
    ground: &GroundHeight<R>,
    displacement: &Displacement<R>,
    visit: Visit,
) -> R {
    let mut slope = R::zero();
    for sign in [R::one(), -R::one()] {
        let neighbour = follower.position.moved(displacement.unit.map(|each| sign * each));
        if let Some(neighbour) = grid.below(&neighbour, visit) {
            let steep = (neighbour.height_m - ground.height_m).abs() / displacement.cell_m;
            slope = if steep > slope { steep } else { slope };
        }
    }
    slope
}

/// Rise of the base, whose height was `height_m`, over a displacement.
pub(super) fn rise<R: Real, const N: usize>(
    grid: &HeightGrid<R>,
    followers: &[Follower<R>; N],
    height_m: R,
    displacement: &Displacement<R>,
) -> Rise<R, N> {
    let mut ground_m = [R::of(f64::NAN); N];
    let mut sums = Sums::new();
    for (wheel, (follower, ground_m)) in followers.iter().zip(&mut ground_m).enumerate() {
        let visit = Visit {
            wheel,
            travelled: displacement.travelled,
        };
        if !follower.increase_m.is_finite_real() {
            continue;
        }
        let known = grid.below(&follower.position, visit).map(|ground| {
            let gap_m = ground.height_m - follower.height_m - height_m;
            (ground, gap_m)
        });
        let Some((ground, gap_m)) = known.filter(|(_, gap_m)| gap_m.abs() < R::of(OTHER_GROUND_M)) else {
            sums.add_unknown(follower, displacement.length_m);
            continue;
        };
        *ground_m = ground.height_m;
        if !follower.last_m.is_finite_real() {
            continue;
        }
        let slope = slope_at(grid, follower, &ground, displacement, visit);
        sums.add_known(follower, &ground, slope, gap_m, displacement.cell_m);
    }
    Rise {
        by_m: sums.rise_m(displacement),
        support: sums.support(),
        ground_m,
    }
}
