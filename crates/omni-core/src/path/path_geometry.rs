//! Geometry of a path between its waypoints, and the vehicle's heading along it.

use crate::{ConfigError, Real};

use super::piece::{Arc, PathPiece, Spline, Station, WayShape, Waypoint, between, cross, norm};
use super::segment::PathSegment;

/// Closer than this \[m\] two waypoints are one place.
const SAME_M: f64 = 1e-4;
/// Smaller than this \[rad\] a turn is none.
const SAME_RAD: f64 = 1e-6;
/// A spline that would turn back on itself to go on smoothly ends in a corner: least cosine of the
/// angle between its end and its chord.
const LEADS_ON: f64 = 0.2;
/// Pieces of a spline from one waypoint to the next.
const SPLINE_PIECES: u16 = 4;
/// Largest turn of one piece of an arc \[rad\].
const ARC_PIECE_RAD: f64 = core::f64::consts::FRAC_PI_4;

/// A section of the path, from one waypoint to the next.
#[derive(Clone, Copy)]
pub(super) enum Section<R> {
    Line { length: R },
    Arc(Arc<R>),
    Spline,
    Turn,
    Wait,
}

impl<R: Real> Section<R> {
    pub(super) fn of(from: &Waypoint<R>, to: &Waypoint<R>) -> Option<Self> {
        let (a, b) = ([from.x_m, from.y_m], [to.x_m, to.y_m]);
        let length = norm(between(a, b));
        let moves = length > R::of(SAME_M);
        match to.shape {
            WayShape::Line if moves => Some(Self::Line { length }),
            WayShape::Arc { sweep_rad } if moves => Some(Self::Arc(Arc::new(a, b, sweep_rad))),
            WayShape::Spline if moves => Some(Self::Spline),
            WayShape::Line if to.heading_rad.is_some() => Some(Self::Turn),
            WayShape::Line if to.time_s.is_some() => Some(Self::Wait),
            _ => None,
        }
    }

    fn moves(&self) -> bool {
        !matches!(self, Self::Turn | Self::Wait)
    }

    pub(super) fn pieces(&self) -> u16 {
        match self {
            Self::Arc(arc) => {
                let turn = (arc.sweep.abs().as_f64() / ARC_PIECE_RAD).min(8.0);
                // Rounded up; a sweep is at most 6.2 rad.
                (1..=8_u16).find(|n| turn <= f64::from(*n) + 1e-6).unwrap_or(8)
            }
            Self::Spline => SPLINE_PIECES,
            _ => 1,
        }
    }
}

fn place<R: Real>(waypoint: &Waypoint<R>) -> [R; 2] {
    [waypoint.x_m, waypoint.y_m]
}

/// Lays the path in the plane: pieces of every segment, still without headings.
pub(super) fn lay<R: Real>(
    waypoints: &[Waypoint<R>],
    segments: &mut [PathSegment<R>],
    pieces: &mut [PathPiece<R>],
) -> Result<(), ConfigError> {
    let mut used: u16 = 0;
    for (i, segment) in segments.iter_mut().enumerate() {
        let (from, to) = (&waypoints[i], &waypoints[i + 1]);
        let Some(way) = Section::of(from, to) else {
            let nothing = "not the place of the waypoint before, unless a line has another heading or a time";
            return Err(ConfigError::new("waypoint.x_m", to.x_m.as_f64(), nothing).at(i + 1));
        };
        let count = way.pieces();
        *segment = PathSegment::EMPTY;
        (segment.first, segment.count, segment.on_the_spot) = (used, count, !way.moves());
        let own = &mut pieces[usize::from(used)..usize::from(used + count)];
        segment.length_m = match way {
            Section::Line { length } => {
                own[0] = PathPiece::line(place(from), place(to), length);
                length
            }
            Section::Arc(arc) => lay_between(own, |part| arc.at(part), |a, b| arc.length * (b - a)),
            Section::Spline => {
                let [a, b] = [station(waypoints, i, false), station(waypoints, i, true)];
                let spline = Spline::new(&a, &b);
                let length = lay_between(own, |part| spline.at(part), |a, b| spline.length(a, b));
                if !length.is_finite_real() {
                    let smooth = "a place that a spline can reach without a cusp";
                    return Err(ConfigError::new("waypoint.x_m", to.x_m.as_f64(), smooth).at(i + 1));
                }
                length
            }
            Section::Turn | Section::Wait => {
                own[0] = PathPiece::place(place(from), R::ZERO);
                R::ZERO
            }
        };
        used += count;
    }
    Ok(())
}

/// Pieces of a curve by equal parts of its parameter, each by the way along it. Its whole length.
fn lay_between<R: Real>(
    pieces: &mut [PathPiece<R>],
    at: impl Fn(R) -> Station<R>,
    length: impl Fn(R, R) -> R,
) -> R {
    let per_piece = R::ONE / R::of(pieces.len() as f64);
    let mut start = R::ZERO;
    for (k, piece) in pieces.iter_mut().enumerate() {
        let (a, b) = (R::of(k as f64) * per_piece, R::of(k as f64 + 1.0) * per_piece);
        let own = length(a, b);
        *piece = PathPiece::between(&at(a), &at(b), own, start);
        start += own;
    }
    start
}

/// Start, or end, of the spline from waypoint `i` to the next.
fn station<R: Real>(waypoints: &[Waypoint<R>], i: usize, end: bool) -> Station<R> {
    let here = if end { i + 1 } else { i };
    let before = here.checked_sub(1).and_then(|k| waypoints.get(k));
    let after = waypoints.get(here + 1);
    let middle = &waypoints[here];
    let comes = before.and_then(|before| Section::of(before, middle));
    let goes = after.and_then(|after| Section::of(middle, after));
    let neighbour = if end { goes } else { comes };
    let at = place(middle);
    let straight = |from: &Waypoint<R>, to: &Waypoint<R>| Station {
        place: at,
        tangent: unit(between(place(from), place(to))),
        curvature: R::ZERO,
    };
    let chord = if end {
        before.map(|b| straight(b, middle))
    } else {
        after.map(|a| straight(middle, a))
    };
    let chord = chord.unwrap_or(Station {
        place: at,
        tangent: [R::ONE, R::ZERO],
        curvature: R::ZERO,
    });
    let smooth = match (neighbour, before, after) {
        (Some(Section::Spline), Some(before), Some(after)) => through(place(before), at, place(after)),
        (Some(Section::Line { .. }), Some(_), Some(after)) if end => Some(straight(middle, after)),
        (Some(Section::Line { .. }), Some(before), Some(_)) => Some(straight(before, middle)),
        (Some(Section::Arc(arc)), _, _) => Some(arc.at(if end { R::ZERO } else { R::ONE })),
        _ => free_end(waypoints, i, end),
    };
    let leads_on =
        |s: &Station<R>| s.tangent[0] * chord.tangent[0] + s.tangent[1] * chord.tangent[1] > R::of(LEADS_ON);
    smooth.filter(leads_on).unwrap_or(chord)
}

/// The end of a spline that nothing smooth goes on from: as its other end, mirrored, which is the
/// circle that leaves there.
fn free_end<R: Real>(waypoints: &[Waypoint<R>], i: usize, end: bool) -> Option<Station<R>> {
    let (from, to) = (place(&waypoints[i]), place(&waypoints[i + 1]));
    let next = if end { i.checked_sub(1) } else { Some(i + 2) }.and_then(|k| waypoints.get(k))?;
    let neighbour = if end {
        Section::of(next, &waypoints[i])
    } else {
        Section::of(&waypoints[i + 1], next)
    };
    if !matches!(neighbour, Some(Section::Spline)) {
        return None;
    }
    let ends = if end {
        [place(next), from, to]
    } else {
        [from, to, place(next)]
    };
    let there = through(ends[0], ends[1], ends[2])?;
    let chord = unit(between(from, to));
    let [tx, ty] = there.tangent;
    let dot = tx * chord[0] + ty * chord[1];
    Some(Station {
        place: if end { to } else { from },
        tangent: [(dot + dot) * chord[0] - tx, (dot + dot) * chord[1] - ty],
        curvature: there.curvature,
    })
}

/// The circle through three points, at the middle one; none if the first and the last are one.
fn through<R: Real>(a: [R; 2], b: [R; 2], c: [R; 2]) -> Option<Station<R>> {
    let (first, second, whole) = (between(a, b), between(b, c), norm(between(a, c)));
    let (la, lb) = (norm(first), norm(second));
    if whole <= R::of(1e-3) * (la + lb) {
        return None;
    }
    let (ua, ub) = (first.map(|v| v / la), second.map(|v| v / lb));
    Some(Station {
        place: b,
        tangent: unit([ua[0] * lb + ub[0] * la, ua[1] * lb + ub[1] * la]),
        curvature: (cross(ua, ub) + cross(ua, ub)) / whole,
    })
}

fn unit<R: Real>(v: [R; 2]) -> [R; 2] {
    let length = norm(v);
    v.map(|c| c / length)
}

/// Gives the headings to the pieces: from one waypoint with a heading to the next by a turn that
/// begins and ends at rest.
pub(super) fn head<R: Real>(
    waypoints: &[Waypoint<R>],
    segments: &mut [PathSegment<R>],
    pieces: &mut [PathPiece<R>],
) {
    let mut yaw = waypoints.first().and_then(|w| w.heading_rad).unwrap_or(R::ZERO);
    let mut i = 0;
    while i < segments.len() {
        let turn_to = |k: usize| {
            waypoints[k + 1]
                .heading_rad
                .map(|heading| (heading - yaw).wrapped_angle())
        };
        if segments[i].on_the_spot {
            let turn = turn_to(i).unwrap_or(R::ZERO);
            let piece = &mut pieces[usize::from(segments[i].first)];
            piece.yaw[0] = yaw;
            if turn.abs() > R::of(SAME_RAD) {
                (piece.yaw[1], piece.per_length) = (turn, R::ONE / turn.abs());
                segments[i].length_m = turn.abs();
                yaw += turn;
            }
            i += 1;
            continue;
        }
        // As far as the next waypoint with a heading, or before the vehicle turns on the spot: then
        // it keeps the one it has.
        let mut last = i;
        while waypoints[last + 1].heading_rad.is_none()
            && segments.get(last + 1).is_some_and(|s| !s.on_the_spot)
        {
            last += 1;
        }
        let turn = turn_to(last).unwrap_or(R::ZERO);
        let whole = segments[i..=last].iter().fold(R::ZERO, |sum, s| sum + s.length_m);
        let mut behind = R::ZERO;
        for segment in &segments[i..=last] {
            let own = usize::from(segment.first)..usize::from(segment.first + segment.count);
            for piece in &mut pieces[own] {
                let next = behind + piece.length();
                piece.turn_by_part(yaw, turn, behind / whole, next / whole);
                behind = next;
            }
        }
        yaw += turn;
        i = last + 1;
    }
}
