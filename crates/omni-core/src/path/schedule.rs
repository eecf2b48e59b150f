//! Timing of a path: speeds at its waypoints, and the limits that meet their times.

use crate::error::within;
use crate::shaping::MotionLimits;
use crate::{ConfigError, Real};

use super::piece::{PathPiece, Waypoint};
use super::segment::PathSegment;
use super::time_law::{Profile, Ramp, bisected};

/// If the direction of travel changes by more than this \[rad\] from one segment to the next, the vehicle stops between
/// them, and also if the heading's turn per metre changes by more than this.
const CORNER: f64 = 2e-3;

/// The longest trajectory \[s\], which is twelve days.
const MOST_S: f64 = 1e6;

/// Gives the segments their times.
pub(super) fn schedule<R: Real>(
    waypoints: &[Waypoint<R>],
    segments: &mut [PathSegment<R>],
    pieces: &[PathPiece<R>],
) -> Result<(), ConfigError> {
    // As fast as may be at the waypoints.
    for i in 1..segments.len() {
        let (a, b) = (segments[i - 1], segments[i]);
        let passes = !(a.on_the_spot || b.on_the_spot) && is_smooth(&a, &b, pieces);
        let speed = if !passes {
            R::ZERO
        } else if a.allowed.velocity < b.allowed.velocity {
            a.allowed.velocity
        } else {
            b.allowed.velocity
        };
        (segments[i - 1].ends[1], segments[i].ends[0]) = (speed, speed);
    }
    // No faster at a waypoint with a time than on the mean before and after it.
    let mut start = 0;
    let mut start_s = R::ZERO;
    for last in 0..segments.len() {
        let Some(time_s) = waypoints[last + 1].time_s else {
            continue;
        };
        let mean = mean_speed(&segments[start..=last], time_s - start_s);
        for (k, side) in [(start, 0), (last, 1)] {
            if mean < segments[k].ends[side] {
                segments[k].ends[side] = mean;
                let neighbour = if side == 0 { k.checked_sub(1) } else { Some(k + 1) };
                if let Some(other) = neighbour.and_then(|n| segments.get_mut(n)) {
                    other.ends[1 - side] = mean;
                }
            }
        }
        (start, start_s) = (last + 1, time_s);
    }
    reach(segments);
    // Between waypoints with a time: no faster than that it is met.
    (start, start_s) = (0, R::ZERO);
    for last in 0..segments.len() {
        let Some(time_s) = waypoints[last + 1].time_s else {
            continue;
        };
        let run = &mut segments[start..=last];
        let asked = time_s - start_s;
        // Times are rounded by their size, and so is what lies between two of them.
        let rounding = R::of(16.0) * R::default_epsilon() * time_s;
        if !slowed(run, asked, rounding) {
            let sooner = "a later time: the limits do not permit this one";
            return Err(ConfigError::new("waypoint.time_s", time_s.as_f64(), sooner).at(last + 1));
        }
        (start, start_s) = (last + 1, time_s);
    }
    let mut now = R::ZERO;
    for (i, segment) in segments.iter_mut().enumerate() {
        segment.start_s = now;
        if !segment.waits() {
            (segment.phases, segment.duration_s) = segment.profile(segment.allowed.velocity).phases();
            if segment.duration_s == R::ZERO {
                // At a speed that rounds to 0 it never gets there.
                segment.duration_s = R::of(f64::INFINITY);
            }
        }
        now += segment.duration_s;
        // What takes longer has a limit that is next to nothing, a mass that no motor moves, or a speed of 0.
        within(
            "waypoint.time_s",
            now,
            0.0..=MOST_S,
            "up to 1000000: the limits are too small for the way there",
        )
        .map_err(|error| error.at(i + 1))?;
    }
    Ok(())
}

fn is_smooth<R: Real>(a: &PathSegment<R>, b: &PathSegment<R>, pieces: &[PathPiece<R>]) -> bool {
    let (Some(end), Some(start)) = (a.pieces_of(pieces).last(), b.pieces_of(pieces).first()) else {
        return false;
    };
    let ([_, ends, _], [_, starts, _]) = (end.at(a.length_m), start.at(R::ZERO));
    ends.into_iter()
        .zip(starts)
        .all(|(e, s)| (e - s).abs() < R::of(CORNER))
}

/// The mean speed \[m/s\] of a run that takes `lasts` \[s\], less what its turns on the spot take;
/// infinite if it ends with waiting.
fn mean_speed<R: Real>(run: &[PathSegment<R>], lasts: R) -> R {
    let (mut way, mut left) = (R::ZERO, lasts);
    for segment in run {
        if segment.on_the_spot {
            left -= segment.time_at(segment.allowed.velocity, segment.ends);
        } else {
            way += segment.length_m;
        }
    }
    let waits = run.last().is_some_and(PathSegment::waits);
    // Where no time is left it is found out later.
    if left > R::ZERO && way > R::ZERO && !waits {
        way / left
    } else {
        R::of(f64::INFINITY)
    }
}

/// Lowers the speeds at waypoints to those that are reached from the one before, and from which the next is.
fn reach<R: Real>(run: &mut [PathSegment<R>]) {
    for i in 0..run.len() {
        let segment = &run[i];
        if segment.waits() {
            continue;
        }
        let [from, to] = segment.ends;
        if to > from {
            let reached = segment.ramps()[0].reached(from, segment.length_m, to);
            lower(run, i, 1, reached);
        }
    }
    for i in (0..run.len()).rev() {
        let segment = &run[i];
        if segment.waits() {
            continue;
        }
        let [from, to] = segment.ends;
        if from > to {
            let reached = segment.ramps()[1].reached(to, segment.length_m, from);
            lower(run, i, 0, reached);
        }
    }
}

fn lower<R: Real>(run: &mut [PathSegment<R>], i: usize, side: usize, speed: R) {
    run[i].ends[side] = speed;
    let neighbour = if side == 0 { i.checked_sub(1) } else { Some(i + 1) };
    if let Some(other) = neighbour.and_then(|n| run.get_mut(n)) {
        other.ends[1 - side] = speed;
    }
}

/// Holds a run back until it takes `asked` \[s\]; says whether it can be so quick. Its outer ends keep their speeds.
fn slowed<R: Real>(run: &mut [PathSegment<R>], asked: R, rounding: R) -> bool {
    let least = run
        .iter()
        .fold(R::ZERO, |sum, s| sum + s.time_at(s.allowed.velocity, s.ends));
    if least > asked + rounding {
        return false;
    }
    if let Some(last) = run.last_mut().filter(|last| last.waits()) {
        // There as soon as may be, and then wait.
        last.duration_s = if asked > least { asked - least } else { R::ZERO };
        return true;
    }
    // If the vehicle moves at all, the duration of its turns on the spot is fixed.
    let moving = run.iter().any(|segment| !segment.on_the_spot);
    let held = |segment: &PathSegment<R>| segment.on_the_spot != moving;
    let top = run.iter().filter(|s| held(s)).fold(R::ZERO, |top, s| {
        if s.allowed.velocity > top {
            s.allowed.velocity
        } else {
            top
        }
    });
    // Ends between segments of the run follow the speed that all are held to; the outer ones are
    // below it, as both are no faster than the mean.
    let count = run.len();
    let ends = |segment: &PathSegment<R>, i: usize, most: R| {
        let within = |speed: R, outer: bool| if outer || speed < most { speed } else { most };
        [
            within(segment.ends[0], i == 0),
            within(segment.ends[1], i + 1 == count),
        ]
    };
    let lasts = |most: R| {
        run.iter().enumerate().fold(R::ZERO, |sum, (i, segment)| {
            if held(segment) {
                let own = if segment.allowed.velocity < most {
                    segment.allowed.velocity
                } else {
                    most
                };
                sum + segment.time_at(own, ends(segment, i, most))
            } else {
                sum + segment.time_at(segment.allowed.velocity, segment.ends)
            }
        })
    };
    // The time grows without bound as the speed shrinks, down to the speeds of the outer ends,
    // where it is the mean's or more.
    let outer = [run[0].ends[0], run[count - 1].ends[1]];
    let slowest = outer
        .into_iter()
        .fold(R::of(1e-6), |least, end| if end > least { end } else { least });
    let most = bisected(slowest, top, |most| lasts(most) >= asked);
    for i in 0..count {
        if held(&run[i]) {
            run[i].ends = ends(&run[i], i, most);
            if most < run[i].allowed.velocity {
                run[i].allowed.velocity = most;
            }
        }
    }
    true
}

impl<R: Real> PathSegment<R> {
    fn waits(&self) -> bool {
        self.length_m == R::ZERO
    }

    fn ramps(&self) -> [Ramp<R>; 2] {
        let MotionLimits {
            acceleration,
            deceleration,
            jerk,
            ..
        } = self.allowed;
        [acceleration, deceleration].map(|acceleration| Ramp { acceleration, jerk })
    }

    fn profile(&self, most: R) -> Profile<R> {
        let [up, down] = self.ramps();
        Profile {
            length: self.length_m,
            ends: self.ends,
            most,
            up,
            down,
        }
    }

    fn time_at(&self, most: R, ends: [R; 2]) -> R {
        if self.waits() {
            R::ZERO
        } else {
            Profile {
                ends,
                ..self.profile(most)
            }
            .duration_s()
        }
    }
}
