//! Edges of the ground, from the paths of the wheels: met, climbed and left.

use crate::Real;
use crate::scalar::{follow, max};

/// Recorded heights of a path, and the distance between them \[m\].
const HEIGHTS: usize = 8;
const SPACING_M: f64 = 0.01;
/// Distance over which the height is averaged for the slope of the path \[m\], and for the slope of the ground.
const SLOPE_M: f64 = 0.015;
const GROUND_SLOPE_M: f64 = 0.15;
/// Least difference of slope between an edge and the ground \[m/m\], and the largest difference on even ground.
const STEEP: f64 = 0.3;
const EVEN: f64 = 0.1;
/// Even distance at the end of an edge \[m\], and the longest edge: a longer slope is not an edge.
const SETTLED_M: f64 = 0.03;
const LONGEST_M: f64 = 0.3;
/// Standard deviation of a height by the shape of the rollers and by slip \[m\].
const SHAPE_M: f64 = 7e-4;
/// Largest part of the distance between two wheels on one edge that is along the travel: 15 degrees of skew.
const SKEW: f64 = 0.27;
/// Least distance between two wheels on one edge \[m\].
const APART_M: f64 = 0.1;
/// Largest difference of the heights of one edge at two wheels, in standard deviations.
const ALIKE: f64 = 4.0;

/// Event of a wheel at an edge.
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
    /// The wheel has begun to climb. The height is that climbed so far.
    Met,
    /// The wheel is on top of the edge.
    Climbed,
    /// The wheel is below the edge: the height is negative.
    Left,
}

/// An edge that a wheel met, climbed or left.
///
/// ```
/// use omni_core::estimate::{EdgeEvent, EdgeKind};
/// let far = |edge: &EdgeEvent<f64>| edge.height_m > 0.05 + 2.0 * edge.height_deviation_m;
/// let edge = EdgeEvent {
///     kind: EdgeKind::Climbed,
///     wheel: 4,
///     height_m: 0.03,
///     height_deviation_m: 0.001,
///     place_m: [0.7, -0.2],
///     angle: None,
/// };
/// assert!(!far(&edge) && edge.height_m > 0.02);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EdgeEvent<R> {
    /// Kind of event.
    pub kind: EdgeKind,
    /// Index of the wheel.
    pub wheel: usize,
    /// Height of the ground beyond the edge relative to the ground before it \[m\].
    pub height_m: R,
    /// Standard deviation of that \[m\].
    pub height_deviation_m: R,
    /// Position of the wheel's centre in the world when it met the edge \[m\].
    pub place_m: [R; 2],
    /// Direction of the edge's normal in the world, on the side to which the vehicle travels, and its standard
    /// deviation \[rad\]. None for the first wheel that passes over the edge, and where no wheel follows known ground.
    pub angle: Option<[R; 2]>,
}

/// An edge that a wheel has passed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct PassedEdge<R> {
    place_m: [R; 2],
    /// Heights of the ground before and beyond it.
    before_m: R,
    beyond_m: R,
    /// Distance since then.
    since_m: R,
}

/// An edge below a wheel: distance on it, and its even end \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct OnEdge<R> {
    length_m: R,
    even_m: R,
}

/// The path of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct WheelPath<R> {
    /// Heights, the oldest first, and the distance since the last of them \[m\].
    heights_m: [R; HEIGHTS],
    since_m: R,
    /// Height averaged over a short distance, and the slope of the ground.
    average_m: R,
    ground_slope: R,
    /// None on even ground.
    on_edge: Option<OnEdge<R>>,
    /// Height before the edge, and the highest since.
    before_m: R,
    highest_m: R,
    place_m: [R; 2],
    met: bool,
    passed: Option<PassedEdge<R>>,
    started: bool,
}

/// The contact of a wheel in a period.
#[derive(Clone, Copy)]
pub(super) struct Contact<R> {
    pub(super) wheel: usize,
    /// Height of the contact, and the distance travelled in the period \[m\].
    pub(super) height_m: R,
    pub(super) distance_m: R,
    pub(super) place_m: [R; 2],
    /// Variance of its height relative to the vehicle \[m^2\].
    pub(super) variance_m2: R,
}

impl<R: Real> WheelPath<R> {
    pub(super) const NONE: Self = Self {
        heights_m: [R::ZERO; HEIGHTS],
        since_m: R::ZERO,
        average_m: R::ZERO,
        ground_slope: R::ZERO,
        on_edge: None,
        before_m: R::ZERO,
        highest_m: R::ZERO,
        place_m: [R::ZERO; 2],
        met: false,
        passed: None,
        started: false,
    };

    /// At this height, on even ground.
    fn start(&mut self, height_m: R) {
        *self = Self {
            heights_m: [height_m; HEIGHTS],
            average_m: height_m,
            started: true,
            ..Self::NONE
        };
    }

    fn event(&mut self, kind: EdgeKind, contact: &Contact<R>, height_m: R) -> EdgeEvent<R> {
        if kind != EdgeKind::Met {
            self.passed = Some(PassedEdge {
                place_m: self.place_m,
                before_m: self.before_m,
                beyond_m: self.before_m + height_m,
                since_m: R::of(1e-6),
            });
        }
        let shape = R::of(SHAPE_M);
        EdgeEvent {
            kind,
            wheel: contact.wheel,
            height_m,
            height_deviation_m: (R::of(2.0) * contact.variance_m2 + shape * shape).sqrt(),
            place_m: self.place_m,
            angle: None,
        }
    }

    /// One period: the event of the wheel at an edge of at least `edge_m` \[m\].
    pub(super) fn step(&mut self, contact: &Contact<R>, edge_m: R) -> Option<EdgeEvent<R>> {
        let (height_m, distance_m) = (contact.height_m, contact.distance_m);
        // A path begins again where its height was not known.
        if !self.started || !(height_m + distance_m).is_finite_real() {
            self.start(height_m);
            self.started = (height_m + distance_m).is_finite_real();
            return None;
        }
        if let Some(passed) = &mut self.passed {
            passed.since_m += distance_m;
        }
        if distance_m <= R::zero() {
            return None;
        }
        let average_m = R::of(SLOPE_M);
        follow(
            &mut self.average_m,
            height_m,
            distance_m / (distance_m + average_m),
        );
        let slope = (height_m - self.average_m) / average_m;
        let steepness = (slope - self.ground_slope).abs();
        let [oldest_m, next_m, ..] = self.heights_m;
        self.record(contact);
        let Some(on_edge) = self.on_edge else {
            if steepness > R::of(STEEP) {
                self.begin(contact, [oldest_m, next_m]);
            }
            return None;
        };
        let on_edge = OnEdge {
            length_m: on_edge.length_m + distance_m,
            even_m: if steepness < R::of(EVEN) {
                on_edge.even_m + distance_m
            } else {
                R::zero()
            },
        };
        self.on_edge = Some(on_edge);
        if let Some(event) = self.climb(contact, edge_m) {
            return Some(event);
        }
        if on_edge.even_m >= R::of(SETTLED_M) {
            return self.end(contact, on_edge.length_m, edge_m);
        }
        if on_edge.length_m >= R::of(LONGEST_M) {
            self.start(height_m);
            self.ground_slope = slope;
        }
        None
    }

    /// Records the height after each spacing. The slope of the ground is that of the oldest heights, which an edge that
    /// begins does not affect yet.
    fn record(&mut self, contact: &Contact<R>) {
        let [oldest_m, next_m, ..] = self.heights_m;
        self.since_m += contact.distance_m;
        let spacing = R::of(SPACING_M);
        if self.since_m >= spacing {
            self.since_m = R::zero();
            if self.on_edge.is_none() {
                let part = R::of(SPACING_M / GROUND_SLOPE_M);
                follow(&mut self.ground_slope, (next_m - oldest_m) / spacing, part);
            }
            self.heights_m.rotate_left(1);
            if let Some(newest) = self.heights_m.last_mut() {
                *newest = contact.height_m;
            }
        }
    }

    /// An edge begins. The height before it is that of the oldest heights, extended by the slope of the ground.
    fn begin(&mut self, contact: &Contact<R>, [oldest_m, next_m]: [R; 2]) {
        let since_m = R::of(HEIGHTS as f64 - 0.5 - 1.0) * R::of(SPACING_M) + self.since_m;
        self.before_m = R::of(0.5) * (oldest_m + next_m) + self.ground_slope * since_m;
        self.highest_m = contact.height_m;
        self.place_m = contact.place_m;
        self.met = false;
        self.on_edge = Some(OnEdge {
            length_m: R::zero(),
            even_m: R::zero(),
        });
    }

    /// The event of a wheel that has begun to climb, or that is down again before the path was even: a bump.
    fn climb(&mut self, contact: &Contact<R>, edge_m: R) -> Option<EdgeEvent<R>> {
        let half_m = R::of(0.5) * edge_m;
        let climbed_m = self.highest_m - self.before_m;
        self.highest_m = max(contact.height_m, self.highest_m);
        if !self.met && climbed_m >= half_m {
            self.met = true;
            return Some(self.event(EdgeKind::Met, contact, climbed_m));
        }
        if climbed_m >= edge_m && self.highest_m - contact.height_m >= half_m {
            let event = self.event(EdgeKind::Climbed, contact, climbed_m);
            self.before_m = self.highest_m;
            self.highest_m = contact.height_m;
            self.met = true;
            self.on_edge = Some(OnEdge {
                length_m: R::zero(),
                even_m: R::zero(),
            });
            return Some(event);
        }
        None
    }

    /// An edge of this length ends: the path is even.
    fn end(&mut self, contact: &Contact<R>, length_m: R, edge_m: R) -> Option<EdgeEvent<R>> {
        let level_m = R::of(0.5) * (contact.height_m + self.average_m);
        let by_m = level_m - self.before_m - self.ground_slope * length_m;
        self.on_edge = None;
        self.heights_m = [level_m; HEIGHTS];
        if by_m >= edge_m {
            return Some(self.event(EdgeKind::Climbed, contact, by_m));
        }
        (by_m <= -edge_m).then(|| self.event(EdgeKind::Left, contact, by_m))
    }
}

/// Direction of the normal of an event's edge, and its standard deviation \[rad\]: across the line to the last wheel
/// that passed over the same edge, on the side of the travel. `deviation_m` is that of both wheels' positions.
pub(super) fn edge_normal<R: Real, const N: usize>(
    paths: &[WheelPath<R>; N],
    event: &EdgeEvent<R>,
    travel: [R; 2],
    deviation_m: R,
) -> Option<[R; 2]> {
    let edge = paths.get(event.wheel)?.passed?;
    let alike_m = R::of(ALIKE) * event.height_deviation_m;
    let [tx, ty] = travel;
    let speed = (tx * tx + ty * ty).sqrt();
    let mut nearest: Option<(R, [R; 2])> = None;
    for (wheel, path) in paths.iter().enumerate() {
        let Some(other) = path.passed.filter(|_| wheel != event.wheel) else {
            continue;
        };
        let (dx, dy) = (
            edge.place_m[0] - other.place_m[0],
            edge.place_m[1] - other.place_m[1],
        );
        let apart_m = (dx * dx + dy * dy).sqrt();
        let is_alike = (other.before_m - edge.before_m).abs() < alike_m
            && (other.beyond_m - edge.beyond_m).abs() < alike_m;
        let is_across = (dx * tx + dy * ty).abs() <= R::of(SKEW) * apart_m * speed;
        let is_recent =
            other.since_m < R::of(SKEW) * apart_m && nearest.is_none_or(|(least, _)| other.since_m < least);
        if is_alike && is_across && is_recent && apart_m > R::of(APART_M) {
            nearest = Some((other.since_m, [dx, dy]));
        }
    }
    let (_, [dx, dy]) = nearest?;
    let apart_m = (dx * dx + dy * dy).sqrt();
    let (nx, ny) = if -dy * tx + dx * ty >= R::zero() {
        (-dy, dx)
    } else {
        (dy, -dx)
    };
    Some([ny.atan2(nx), R::of(2.0).sqrt() * deviation_m / apart_m])
}
