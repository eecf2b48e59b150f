//! Edges of the ground: what the paths of the wheels say that they meet, climb and leave.

use crate::Real;
use crate::scalar::follow;

/// Heights of a path that are remembered, and the way between them \[m\].
const HEIGHTS: usize = 8;
const SPACING_M: f64 = 0.01;
/// Way over which the height is averaged for its slope \[m\], and for the slope of the ground at large.
const SLOPE_M: f64 = 0.015;
const AT_LARGE_M: f64 = 0.15;
/// An edge is steeper than the ground at large by this \[m/m\]; even ground is not steeper by the other.
const STEEP: f64 = 0.3;
const EVEN: f64 = 0.1;
/// The path is even again after this way \[m\]; a slope that lasts for the other is no edge.
const SETTLED_M: f64 = 0.03;
const LONGEST_M: f64 = 0.3;
/// Deviation of a height by the shape of rollers and by what slips \[m\].
const SHAPE_M: f64 = 7e-4;
/// Part of the way between two wheels that may be along the travel, if they are to be on one edge: 15 degrees of skew.
const SKEW: f64 = 0.27;
/// Wheels on one edge are apart by at least this \[m\].
const APART_M: f64 = 0.1;

/// What a wheel does with an edge.
///
/// ```
/// use omni_core::estimate::EdgeKind;
/// let sign = |kind: EdgeKind| if kind == EdgeKind::Left { -1 } else { 1 };
/// assert_eq!((sign(EdgeKind::Climbed), sign(EdgeKind::Left)), (1, -1));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum EdgeKind {
    /// The wheel has begun to climb. The height is what it has climbed so far.
    Met,
    /// It is on top.
    Climbed,
    /// It has gone down: the height is negative.
    Left,
}

/// An edge that a wheel met, climbed or left.
///
/// ```
/// use omni_core::estimate::{EdgeEvent, EdgeKind};
/// let far = |edge: &EdgeEvent<f64>| edge.kind == EdgeKind::Climbed && edge.height_m > 0.05 + 2.0 * edge.height_deviation_m;
/// let edge = EdgeEvent {
///     kind: EdgeKind::Climbed, wheel: 4, height_m: 0.03, height_deviation_m: 0.001, place_m: [0.7, -0.2], angle: None,
/// };
/// assert!(!far(&edge) && edge.height_m > 0.02);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EdgeEvent<R> {
    /// What the wheel does.
    pub kind: EdgeKind,
    /// Index of the wheel.
    pub wheel: usize,
    /// How much higher the ground is beyond the edge \[m\].
    pub height_m: R,
    /// Standard deviation of that \[m\].
    pub height_deviation_m: R,
    /// Where the centre of the wheel was in the world when it met the edge \[m\].
    pub place_m: [R; 2],
    /// Direction of the edge's normal in the world, the way that the vehicle goes, and its standard deviation \[rad\]. None for a wheel
    /// that is the first to pass over the edge.
    pub angle: Option<[R; 2]>,
}

/// The path of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Path<R> {
    /// Heights, the oldest first, and the way since the last of them \[m\].
    heights_m: [R; HEIGHTS],
    since_m: R,
    /// Height averaged over a short way, and the slope at large.
    short_m: R,
    at_large: R,
    /// Way on the edge, and the part of it that was even \[m\]; none on even ground.
    on_edge_m: Option<[R; 2]>,
    /// Height before the edge, and the highest since.
    before_m: R,
    highest_m: R,
    place_m: [R; 2],
    met: bool,
    /// The last edge that was passed: where, how high it was below and above, and the way since.
    last: [R; 4],
    last_m: R,
    is_known: bool,
}

/// Where a wheel is now.
#[derive(Clone, Copy)]
pub(super) struct Contact<R> {
    pub(super) wheel: usize,
    /// Height of the contact, and the way since the period before \[m\].
    pub(super) height_m: R,
    pub(super) way_m: R,
    pub(super) place_m: [R; 2],
    /// Variance of its height against the vehicle's \[m^2\].
    pub(super) variance_m2: R,
}

impl<R: Real> Path<R> {
    pub(super) const NONE: Self = Self {
        heights_m: [R::ZERO; HEIGHTS],
        since_m: R::ZERO,
        short_m: R::ZERO,
        at_large: R::ZERO,
        on_edge_m: None,
        before_m: R::ZERO,
        highest_m: R::ZERO,
        place_m: [R::ZERO; 2],
        met: false,
        last: [R::ZERO; 4],
        last_m: R::ZERO,
        is_known: false,
    };

    /// At this height, on even ground.
    fn start(&mut self, height_m: R) {
        *self = Self {
            heights_m: [height_m; HEIGHTS],
            short_m: height_m,
            is_known: true,
            ..Self::NONE
        };
    }

    /// The last edge: where, its heights, and the way since; none where there was none.
    pub(super) fn passed(&self) -> Option<([R; 4], R)> {
        (self.last_m > R::zero()).then_some((self.last, self.last_m))
    }

    fn event(&mut self, kind: EdgeKind, contact: &Contact<R>, height_m: R) -> EdgeEvent<R> {
        let shape = R::of(SHAPE_M);
        let two = R::of(2.0);
        if kind != EdgeKind::Met {
            let [x, y] = self.place_m;
            self.last = [x, y, self.before_m, self.before_m + height_m];
            self.last_m = R::of(1e-6);
        }
        EdgeEvent {
            kind,
            wheel: contact.wheel,
            height_m,
            height_deviation_m: (two * contact.variance_m2 + shape * shape).sqrt(),
            place_m: self.place_m,
            angle: None,
        }
    }

    /// A period on: what the wheel did with an edge of at least `edge_m` \[m\].
    pub(super) fn step(&mut self, contact: &Contact<R>, edge_m: R) -> Option<EdgeEvent<R>> {
        let (height, way) = (contact.height_m, contact.way_m);
        if !self.is_known {
            self.start(height);
            return None;
        }
        if self.last_m > R::zero() {
            self.last_m += way;
        }
        let part = |over: f64| way / (way + R::of(over));
        if way <= R::zero() {
            return None;
        }
        follow(&mut self.short_m, height, part(SLOPE_M));
        let slope = (height - self.short_m) / R::of(SLOPE_M);
        let unlike = (slope - self.at_large).abs();
        let [oldest, next, ..] = self.heights_m;
        self.since_m += way;
        let spacing = R::of(SPACING_M);
        if self.since_m >= spacing {
            self.since_m = R::zero();
            if self.on_edge_m.is_none() {
                // So far back the ground is not yet that of an edge.
                let large = R::of(SPACING_M / AT_LARGE_M);
                follow(&mut self.at_large, (next - oldest) / spacing, large);
            }
            self.heights_m.rotate_left(1);
            if let Some(newest) = self.heights_m.last_mut() {
                *newest = height;
            }
        }
        let half = R::of(0.5);
        let Some([on, even]) = self.on_edge_m else {
            if unlike > R::of(STEEP) {
                let back = R::of(HEIGHTS as f64 - 0.5 - 1.0) * spacing + self.since_m;
                self.before_m = half * (oldest + next) + self.at_large * back;
                self.highest_m = height;
                self.place_m = contact.place_m;
                self.met = false;
                self.on_edge_m = Some([R::zero(); 2]);
            }
            return None;
        };
        let even = if unlike < R::of(EVEN) {
            even + way
        } else {
            R::zero()
        };
        let on = on + way;
        self.on_edge_m = Some([on, even]);
        let climbed = self.highest_m - self.before_m;
        if height > self.highest_m {
            self.highest_m = height;
        }
        if !self.met && climbed >= half * edge_m {
            self.met = true;
            return Some(self.event(EdgeKind::Met, contact, climbed));
        }
        // Over a bump: down again before it was even.
        if climbed >= edge_m && self.highest_m - height >= half * edge_m {
            let event = self.event(EdgeKind::Climbed, contact, climbed);
            self.before_m = self.highest_m;
            self.highest_m = height;
            self.met = true;
            self.on_edge_m = Some([R::zero(); 2]);
            return Some(event);
        }
        if even >= R::of(SETTLED_M) {
            let level = half * (height + self.short_m);
            let by = level - self.before_m - self.at_large * on;
            self.on_edge_m = None;
            self.heights_m = [level; HEIGHTS];
            if by >= edge_m {
                return Some(self.event(EdgeKind::Climbed, contact, by));
            }
            if by <= -edge_m {
                return Some(self.event(EdgeKind::Left, contact, by));
            }
        } else if on >= R::of(LONGEST_M) {
            self.start(height);
            self.at_large = slope;
        }
        None
    }
}

/// Direction of the normal of the edge that this event is of, from another wheel that passed over it, and its deviation.
pub(super) fn angle<R: Real, const N: usize>(
    paths: &[Path<R>; N],
    event: &EdgeEvent<R>,
    travel: [R; 2],
    deviation_m: R,
) -> Option<[R; 2]> {
    let ([x, y, below, above], _) = paths.get(event.wheel)?.passed()?;
    let alike = R::of(4.0) * event.height_deviation_m;
    let mut nearest: Option<(R, [R; 2])> = None;
    for (wheel, path) in paths.iter().enumerate() {
        let Some(([px, py, low, high], since)) = path.passed().filter(|_| wheel != event.wheel) else {
            continue;
        };
        let (dx, dy) = (x - px, y - py);
        let apart = (dx * dx + dy * dy).sqrt();
        let fits = (low - below).abs() < alike && (high - above).abs() < alike;
        let [tx, ty] = travel;
        let speed = (tx * tx + ty * ty).sqrt();
        let across = (dx * tx + dy * ty).abs() <= R::of(SKEW) * apart * speed;
        let soon = across && since < R::of(SKEW) * apart && nearest.is_none_or(|(least, _)| since < least);
        if fits && soon && apart > R::of(APART_M) {
            nearest = Some((since, [dx, dy]));
        }
    }
    let (_, [dx, dy]) = nearest?;
    let apart = (dx * dx + dy * dy).sqrt();
    // Across the line through both, the way that the vehicle goes.
    let [tx, ty] = travel;
    let (nx, ny) = if -dy * tx + dx * ty >= R::zero() {
        (-dy, dx)
    } else {
        (dy, -dx)
    };
    Some([ny.atan2(nx), R::of(2.0).sqrt() * deviation_m / apart])
}
