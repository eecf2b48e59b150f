//! Path geometry: pieces as polynomials of the distance along them, and the waypoints that define them.

use crate::Real;
use crate::constants::constant_struct;
use crate::trig::cardinal_sine;

/// Shape of a path from the previous waypoint.
///
/// ```
/// use omni_core::path::WayShape;
/// let mut corner = omni_core::path::Waypoint::at(1.0_f64, 1.0);
/// corner.shape = WayShape::Arc { sweep_rad: 1.57 }; // a quarter to the left
/// assert_eq!((corner.shape, corner.y_m), (WayShape::Arc { sweep_rad: 1.57 }, 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum WayShape<R> {
    /// Straight. If the waypoint coincides with the previous one, the vehicle turns on the spot to the heading, or
    /// waits for the time.
    Line,
    /// Along the circle on which the direction of travel turns by `sweep_rad` \[rad\] from one
    /// waypoint to the other: left is +, 0.01 to 6.2 or as much to the right.
    Arc {
        /// Turn of the direction of travel \[rad\].
        sweep_rad: R,
    },
    /// Smooth through this waypoint and its neighbours, direction and curvature continuous: if the neighbours are also
    /// splines, equal to the circle through the three points; if the neighbour is a line or an arc, equal to the
    /// neighbour's.
    Spline,
}

/// A waypoint of a path with optional constraints. Made by [`Waypoint::at`].
///
/// ```
/// use omni_core::path::{WayShape, Waypoint};
/// let mut aside = Waypoint::at(1.0_f64, 0.5);
/// aside.heading_rad = Some(0.0);
/// aside.speed_m_s = Some(0.2);
/// assert_eq!((aside.shape, aside.x_m, aside.time_s), (WayShape::Line, 1.0, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Waypoint<R> {
    /// World x \[m\], -10000 to 10000.
    pub x_m: R,
    /// World y \[m\], -10000 to 10000.
    pub y_m: R,
    /// Heading at the waypoint \[rad\], -1000 to 1000, reached by the shorter turn from the previous heading; if none,
    /// the turn continues to the next waypoint with a heading. Of the first waypoint none is 0.
    pub heading_rad: Option<R>,
    /// The way here from the waypoint before; without effect on the first.
    pub shape: WayShape<R>,
    /// Highest speed on the segment to this waypoint \[m/s\], above 0 and up to 1000; if none, only the limits apply.
    /// Without effect on the first.
    pub speed_m_s: Option<R>,
    /// Time of arrival \[s\] from the start, above 0 and up to 100000, later than the previous waypoint's time; if
    /// none, as early as the limits allow. At that waypoint the vehicle is no faster than the mean before and after it.
    /// Without effect on the first, which is at 0.
    pub time_s: Option<R>,
}

impl<R: Real> Waypoint<R> {
    /// The position `x_m`, `y_m` \[m\], reached on a straight line, as early as the limits allow, with any heading.
    ///
    /// ```
    /// use omni_core::path::Waypoint;
    /// assert_eq!(Waypoint::at(2.0_f32, -1.0).heading_rad, None);
    /// ```
    #[must_use]
    pub fn at(x_m: R, y_m: R) -> Self {
        Self {
            x_m,
            y_m,
            heading_rad: None,
            shape: WayShape::Line,
            speed_m_s: None,
            time_s: None,
        }
    }
}

/// A piece of a path: x, y and heading as polynomials of the fifth degree of the way along it. Made by
/// [`TrajectoryPlanner`](crate::path::TrajectoryPlanner).
///
/// ```
/// use omni_core::path::PathPiece;
/// static ROOM: [PathPiece<f32>; 8] = [PathPiece::EMPTY; 8];
/// assert_eq!(ROOM[7], PathPiece::EMPTY);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct PathPiece<R> {
    /// Its start on its segment \[m, or rad of a turn on the spot\].
    pub(crate) start_m: R,
    /// One over its length; 0 of a place.
    pub(crate) per_length: R,
    /// Coefficients of x \[m\], y \[m\] and heading \[rad\], of the part of the piece that is behind, 0 to 1.
    pub(crate) x: [R; 6],
    pub(crate) y: [R; 6],
    pub(crate) yaw: [R; 6],
}

constant_struct!(PathPiece<R> { start_m: R, per_length: R, x: [R; 6], y: [R; 6], yaw: [R; 6] });

/// Place (or direction, or how that changes) and heading along a path: x, y, heading.
pub(crate) type Along<R> = [R; 3];

/// A point of a curve in the plane: the place, the unit tangent, the curvature (left is +).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Station<R> {
    pub(crate) place: [R; 2],
    pub(crate) tangent: [R; 2],
    pub(crate) curvature: R,
}

/// Value and first two derivatives of a polynomial with these coefficients.
fn horner<R: Real>(c: &[R; 6], z: R) -> [R; 3] {
    let (mut value, mut first, mut half_second) = (c[5], R::ZERO, R::ZERO);
    for k in [4, 3, 2, 1, 0] {
        half_second = half_second * z + first;
        first = first * z + value;
        value = value * z + c[k];
    }
    [value, first, half_second + half_second]
}

/// The polynomial of 0..1 with these values and first two derivatives at its ends.
fn quintic<R: Real>([p0, v0, a0]: [R; 3], [p1, v1, a1]: [R; 3]) -> [R; 6] {
    let (way, half) = (p1 - p0, R::of(0.5));
    [
        p0,
        v0,
        half * a0,
        R::of(10.0) * way - R::of(6.0) * v0 - R::of(4.0) * v1 - R::of(1.5) * a0 + half * a1,
        -R::of(15.0) * way + R::of(8.0) * v0 + R::of(7.0) * v1 + R::of(1.5) * a0 - a1,
        R::of(6.0) * way - R::of(3.0) * (v0 + v1) - half * a0 + half * a1,
    ]
}

impl<R: Real> PathPiece<R> {
    /// Nothing: what room for pieces is filled with.
    ///
    /// ```
    /// use omni_core::path::PathPiece;
    /// let room = [PathPiece::<f64>::EMPTY; 4];
    /// assert_eq!(room.len(), 4);
    /// ```
    pub const EMPTY: Self = Self {
        start_m: R::ZERO,
        per_length: R::ZERO,
        x: [R::ZERO; 6],
        y: [R::ZERO; 6],
        yaw: [R::ZERO; 6],
    };

    /// A place, for waiting or turning.
    pub(crate) fn place([x, y]: [R; 2], yaw: R) -> Self {
        let mut piece = Self::EMPTY;
        (piece.x[0], piece.y[0], piece.yaw[0]) = (x, y, yaw);
        piece
    }

    /// Straight from `from` to `to`, which are not the same.
    pub(crate) fn line(from: [R; 2], to: [R; 2], length: R) -> Self {
        let mut piece = Self::place(from, R::ZERO);
        (piece.x[1], piece.y[1]) = (to[0] - from[0], to[1] - from[1]);
        piece.per_length = R::ONE / length;
        piece
    }

    /// From one station to another that is `length` further along.
    pub(crate) fn between(a: &Station<R>, b: &Station<R>, length: R, start_m: R) -> Self {
        let end = |s: &Station<R>, axis: usize| {
            let normal = if axis == 0 { -s.tangent[1] } else { s.tangent[0] };
            [
                s.place[axis],
                s.tangent[axis] * length,
                normal * s.curvature * length * length,
            ]
        };
        Self {
            start_m,
            per_length: R::ONE / length,
            x: quintic(end(a, 0), end(b, 0)),
            y: quintic(end(a, 1), end(b, 1)),
            yaw: [R::ZERO; 6],
        }
    }

    /// Gives the heading the part from `from` to `to`, of 0..1, of a turn from `yaw` by `turn` that
    /// begins and ends at rest: 10 z^3 - 15 z^4 + 6 z^5, about `from`.
    pub(crate) fn turn_by_part(&mut self, yaw: R, turn: R, from: R, to: R) {
        let (z, zz) = (from, from * from);
        let of = R::of;
        let taylor = [
            zz * z * (of(10.0) - of(15.0) * z + of(6.0) * zz),
            of(30.0) * zz * (R::ONE - z - z + zz),
            of(30.0) * z * (R::ONE - of(3.0) * z + zz + zz),
            of(10.0) * (R::ONE - of(6.0) * z + of(6.0) * zz),
            of(15.0) * (z + z - R::ONE),
            of(6.0),
        ];
        let mut power = turn;
        for (coefficient, term) in self.yaw.iter_mut().zip(taylor) {
            *coefficient = term * power;
            power *= to - from;
        }
        self.yaw[0] += yaw;
    }

    /// Place and heading, and their first and second derivative by the way, `along` from the start
    /// of the piece's segment.
    pub(crate) fn at(&self, along: R) -> [Along<R>; 3] {
        let z = (along - self.start_m) * self.per_length;
        let [x, y, yaw] = [&self.x, &self.y, &self.yaw].map(|c| horner(c, z));
        let (one, two) = (self.per_length, self.per_length * self.per_length);
        [
            [x[0], y[0], yaw[0]],
            [x[1] * one, y[1] * one, yaw[1] * one],
            [x[2] * two, y[2] * two, yaw[2] * two],
        ]
    }

    /// The third derivatives by the way, at a part of the piece, 0 to 1.
    pub(crate) fn third(&self, z: R) -> Along<R> {
        let scale = self.per_length * self.per_length * self.per_length;
        [&self.x, &self.y, &self.yaw]
            .map(|c| scale * (R::of(6.0) * c[3] + z * (R::of(24.0) * c[4] + z * R::of(60.0) * c[5])))
    }

    /// Its length; 0 of a place.
    pub(crate) fn length(&self) -> R {
        if self.per_length > R::ZERO {
            R::ONE / self.per_length
        } else {
            R::ZERO
        }
    }
}

pub(crate) fn norm<R: Real>([x, y]: [R; 2]) -> R {
    (x * x + y * y).sqrt()
}

pub(crate) fn cross<R: Real>(a: [R; 2], b: [R; 2]) -> R {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn between<R: Real>(from: [R; 2], to: [R; 2]) -> [R; 2] {
    [to[0] - from[0], to[1] - from[1]]
}

/// Turned by an angle \[rad\].
fn turned<R: Real>([x, y]: [R; 2], by: R) -> [R; 2] {
    let (sin, cos) = by.sine_cosine();
    [cos * x - sin * y, sin * x + cos * y]
}

/// An arc from `from` to `to` on which the direction turns by `sweep`.
#[derive(Clone, Copy)]
pub(crate) struct Arc<R> {
    from: [R; 2],
    /// Unit chord.
    chord: [R; 2],
    pub(crate) sweep: R,
    pub(crate) length: R,
}

impl<R: Real> Arc<R> {
    pub(crate) fn new(from: [R; 2], to: [R; 2], sweep: R) -> Self {
        let chord = between(from, to);
        let far = norm(chord);
        Self {
            from,
            chord: chord.map(|v| v / far),
            sweep,
            length: far / cardinal_sine(sweep * R::of(0.5)),
        }
    }

    /// Where a part of it, 0 to 1, is behind.
    pub(crate) fn at(&self, part: R) -> Station<R> {
        let half = R::of(0.5);
        let (turn, start) = (part * self.sweep, -half * self.sweep);
        let far = self.length * part * cardinal_sine(half * turn);
        let [dx, dy] = turned(self.chord, start + half * turn);
        Station {
            place: [self.from[0] + far * dx, self.from[1] + far * dy],
            tangent: turned(self.chord, start + turn),
            curvature: self.sweep / self.length,
        }
    }
}

/// A curve between two stations as a polynomial of its own parameter, 0 to 1: smooth, but not yet by the way along it.
#[derive(Clone, Copy)]
pub(crate) struct Spline<R> {
    x: [R; 6],
    y: [R; 6],
}

impl<R: Real> Spline<R> {
    pub(crate) fn new(a: &Station<R>, b: &Station<R>) -> Self {
        let chord = between(a.place, b.place);
        let far = norm(chord);
        // How much longer than its chord the arc is whose ends lean like this: 1 + d^2 / 6 for
        // small angles d, pi/2 for 90 degrees.
        let cosine = |s: &Station<R>| (s.tangent[0] * chord[0] + s.tangent[1] * chord[1]) / far;
        let lean = R::ONE - R::of(0.5) * (cosine(a) + cosine(b));
        let scale = far * (R::ONE + lean * (R::of(1.0 / 3.0) + R::of(0.237) * lean));
        let curve = PathPiece::between(a, b, scale, R::ZERO);
        Self {
            x: curve.x,
            y: curve.y,
        }
    }

    fn derivatives(&self, p: R) -> [[R; 2]; 3] {
        let (x, y) = (horner(&self.x, p), horner(&self.y, p));
        [[x[0], y[0]], [x[1], y[1]], [x[2], y[2]]]
    }

    /// Where the curve is at a parameter.
    pub(crate) fn at(&self, p: R) -> Station<R> {
        let [place, first, second] = self.derivatives(p);
        let speed = norm(first);
        Station {
            place,
            tangent: first.map(|v| v / speed),
            curvature: cross(first, second) / (speed * speed * speed),
        }
    }

    /// Length between two parameters, by Gauss and Legendre's rule with five points.
    pub(crate) fn length(&self, from: R, to: R) -> R {
        let (middle, half) = (R::of(0.5) * (from + to), R::of(0.5) * (to - from));
        [
            (0.0, 0.568_888_888_888_888_9),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ]
        .into_iter()
        .flat_map(|(at, weight)| {
            // The middle is counted from both sides, with half of its weight each.
            let weight = if at == 0.0 { 0.5 * weight } else { weight };
            [(-at, weight), (at, weight)]
        })
        .fold(R::ZERO, |sum, (at, weight)| {
            let [_, first, _] = self.derivatives(middle + half * R::of(at));
            sum + half * R::of(weight) * norm(first)
        })
    }
}
