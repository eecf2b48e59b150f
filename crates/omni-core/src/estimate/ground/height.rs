//! Height of the vehicle: wheels that pass over known ground follow it.

use super::grid::{Grid, Place, Who};
use crate::Real;

/// Slope that counts as much as none \[m/m\].
const EVEN: f64 = 0.03;
/// Slope that unknown ground may have beyond what it had so far \[m/m\].
const UNKNOWN: f64 = 0.7;
/// How far the place of a wheel is off from where another wheel passed \[m\].
const PLACE_M: f64 = 2e-3;
/// Distance from its ground from which on a wheel counts as lifted \[m\].
const LIFTED_M: f64 = 0.006;
/// Time in which the height settles on the ground that is known \[s\].
const SETTLES_S: f64 = 0.2;

/// What a wheel looks at.
#[derive(Clone, Copy)]
pub(super) struct Follower<R> {
    pub(super) place: Place<R>,
    /// Height of its contact above the base's origin \[m\], and how much that has grown in the period.
    pub(super) height_m: R,
    pub(super) grown_m: R,
    /// Ground below it a period ago \[m\]; NaN for none.
    pub(super) last_m: R,
    /// Arm from the base's origin, along the heading and to its left \[m\].
    pub(super) arm_m: [R; 2],
    /// Slope of its path so far \[m/m\], and how steep its rim says it is.
    pub(super) slope: R,
    pub(super) steep: R,
}

/// How far the base has risen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rise<R, const N: usize> {
    pub(super) by_m: R,
    /// Variance of the ground that is followed \[m^2\], and the mean arm of the wheels that follow it; none where no wheel does.
    pub(super) followed: Option<(R, [R; 2])>,
    /// Ground below each wheel \[m\]; NaN for none.
    pub(super) ground_m: [R; N],
}

/// The travel of a period.
#[derive(Clone, Copy)]
pub(super) struct Way<R> {
    /// A cell's length along it \[cells\].
    pub(super) ahead: [R; 2],
    /// Its length \[m\], in a period \[s\].
    pub(super) way_m: R,
    pub(super) period_s: R,
    /// Since the start, in cells of so much \[m\].
    pub(super) travel: u32,
    pub(super) cell_m: R,
}

/// How far the base has risen on its way, from `height_m`.
pub(super) fn rise<R: Real, const N: usize>(
    grid: &Grid<R>,
    followers: &[Follower<R>; N],
    height_m: R,
    way: &Way<R>,
) -> Rise<R, N> {
    let Way {
        ahead,
        way_m,
        period_s,
        travel,
        cell_m,
    } = *way;
    let zero = R::zero();
    let mut ground_m = [R::of(f64::NAN); N];
    let (mut weight, mut by, mut missing, mut variance) = (zero, zero, zero, zero);
    let (mut ahead_weight, mut ahead_by) = (zero, zero);
    let mut arm = [zero; 2];
    for (wheel, (follower, ground)) in followers.iter().zip(&mut ground_m).enumerate() {
        let who = Who { wheel, travel };
        let Some(found) = grid.read(&follower.place, who, true) else {
            // The ground goes on as it was, if the wheel's rim does not say otherwise.
            let even = R::of(UNKNOWN) + follower.slope.abs() + follower.steep;
            let each = R::one() / (even * even);
            ahead_weight += each;
            ahead_by += each * (follower.slope * way_m - follower.grown_m);
            continue;
        };
        *ground = found.height_m;
        if !follower.last_m.is_finite_real() {
            continue;
        }
        let mut slope = zero;
        for sign in [R::one(), -R::one()] {
            let beside = follower.place.moved(ahead.map(|each| sign * each));
            if let Some(beside) = grid.read(&beside, who, false) {
                let steep = (beside.height_m - found.height_m).abs() / cell_m;
                slope = if steep > slope { steep } else { slope };
            }
        }
        let stands = found.height_m - follower.height_m - height_m;
        let off = stands / R::of(LIFTED_M);
        let even = R::of(EVEN) + slope;
        // A place that is off by a little is another height where it is steep, and so is a height that was recorded meanwhile.
        let off_m = slope * R::of(PLACE_M);
        let own = found.variance_m2 + off_m * off_m;
        let even = even + found.variance_m2.sqrt() / cell_m;
        let beside = if found.below { R::one() } else { R::of(0.1) };
        let each = beside / (even * even * (R::one() + off * off));
        weight += each;
        by += each * (found.height_m - follower.last_m - follower.grown_m);
        missing += each * stands;
        variance += each * own;
        for (sum, part) in arm.iter_mut().zip(follower.arm_m) {
            *sum += each * part;
        }
    }
    let both = weight + ahead_weight;
    let part = period_s / (period_s + R::of(SETTLES_S));
    Rise {
        by_m: if both > zero {
            (by + ahead_by + part * missing) / both
        } else {
            zero
        },
        followed: (weight > zero).then(|| (variance / weight, arm.map(|each| each / weight))),
        ground_m,
    }
}
