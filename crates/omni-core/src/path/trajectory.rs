//! Trajectories: reference poses over time. Sampled without state.

#[cfg(test)]
mod tests;

use super::piece::PathPiece;
use super::segment::PathSegment;
use crate::Real;
use crate::geometry::{BodyTwist, PlanarPose, WorldTwist};

/// A reference trajectory. Sampled without state, in a time that grows with the logarithm of its length.
///
/// A trajectory that does not come from [`TrajectoryPlanner`](crate::path::TrajectoryPlanner) can also be sampled, with
/// any result: nothing panics.
///
/// ```
/// use omni_core::path::Trajectory;
/// static NOWHERE: Trajectory<'_, f32> = Trajectory::new(&[], &[]); // a plan may be a constant of the firmware
/// assert_eq!((NOWHERE.duration_s(), NOWHERE.at(1.0).done), (0.0, true));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trajectory<'a, R> {
    segments: &'a [PathSegment<R>],
    pieces: &'a [PathPiece<R>],
}

/// A [`Trajectory`] at one time.
///
/// ```
/// use omni_core::path::Trajectory;
/// let sample = Trajectory::<f64>::new(&[], &[]).at(2.0);
/// assert_eq!((sample.time_s, sample.speed_m_s), (2.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct TrajectorySample<R> {
    /// The time asked for \[s\].
    pub time_s: R,
    /// Reference pose \[m, m, rad\], the heading in (-pi, pi].
    pub pose: PlanarPose<R>,
    /// How to move \[m/s, m/s, rad/s\], along the world's axes.
    pub velocity: WorldTwist<R>,
    /// How that changes \[m/s^2, m/s^2, rad/s^2\], along the world's axes.
    pub acceleration: [R; 3],
    /// Speed along the path \[m/s\], rad/s in a turn on the spot; >= 0.
    pub speed_m_s: R,
    /// The end is reached: the pose is the last one, and everything rests.
    pub done: bool,
    /// Time since the end was reached \[s\]; 0 before.
    pub over_s: R,
}

impl<R: Real> TrajectorySample<R> {
    /// The body twist of a vehicle at the reference pose \[m/s, m/s, rad/s\].
    ///
    /// ```
    /// use omni_core::path::Trajectory;
    /// use omni_core::BodyTwist;
    /// assert_eq!(Trajectory::<f64>::new(&[], &[]).at(0.0).feed_forward(), BodyTwist::ZERO);
    /// ```
    #[must_use]
    pub fn feed_forward(&self) -> BodyTwist<R> {
        self.velocity.to_body(&self.pose)
    }
}

impl<'a, R: Real> Trajectory<'a, R> {
    /// A trajectory from a planner's segments and pieces, also for a `static`.
    #[must_use]
    pub const fn new(segments: &'a [PathSegment<R>], pieces: &'a [PathPiece<R>]) -> Self {
        Self { segments, pieces }
    }

    /// Its segments, one a waypoint after the first.
    #[must_use]
    pub fn segments(&self) -> &'a [PathSegment<R>] {
        self.segments
    }

    /// Their pieces, one after the other.
    #[must_use]
    pub fn pieces(&self) -> &'a [PathPiece<R>] {
        self.pieces
    }

    /// When its end is reached \[s\].
    ///
    /// ```
    /// assert_eq!(omni_core::path::Trajectory::<f64>::new(&[], &[]).duration_s(), 0.0);
    /// ```
    #[must_use]
    pub fn duration_s(&self) -> R {
        self.segments
            .last()
            .map_or(R::ZERO, |last| last.start_s + last.duration_s)
    }

    /// The sample at a time \[s\] from its start: the first pose, at rest, before 0 and for NaN, the last pose from
    /// [`Trajectory::duration_s`] on.
    ///
    /// ```
    /// use omni_core::path::Trajectory;
    /// let sample = Trajectory::<f64>::new(&[], &[]).at(f64::NAN);
    /// assert_eq!((sample.done, sample.pose.x_m), (false, 0.0));
    /// ```
    #[must_use]
    pub fn at(&self, time_s: R) -> TrajectorySample<R> {
        // NaN counts as before the start.
        let asked = if time_s > R::ZERO { time_s } else { R::ZERO };
        let end_s = self.duration_s();
        let done = time_s >= end_s;
        let next = self.segments.partition_point(|segment| segment.start_s <= asked);
        let segment = next.checked_sub(1).and_then(|k| self.segments.get(k));
        let (along, pieces) = segment.map_or(([R::ZERO; 3], &[][..]), |segment| {
            let since = (asked - segment.start_s).limited(R::ZERO, segment.duration_s);
            let mut phase = &segment.phases[0];
            for later in &segment.phases[1..] {
                if later.start_s <= since {
                    phase = later;
                }
            }
            (phase.at(since), segment.pieces_of(self.pieces))
        });
        let [mut way, mut speed, mut acceleration] = along;
        if let Some(segment) = segment {
            way = way.limited(R::ZERO, segment.length_m);
        }
        if done || time_s != asked {
            (speed, acceleration) = (R::ZERO, R::ZERO);
        }
        let piece = pieces.partition_point(|piece| piece.start_m <= way);
        let piece = piece.checked_sub(1).and_then(|k| pieces.get(k));
        let [place, first, second] = piece.map_or([[R::ZERO; 3]; 3], |piece| piece.at(way));
        let [vx_m_s, vy_m_s, wz_rad_s] = first.map(|by_way| by_way * speed);
        let mut changes = second.map(|by_way| by_way * speed * speed);
        for (change, by_way) in changes.iter_mut().zip(first) {
            *change += by_way * acceleration;
        }
        TrajectorySample {
            time_s,
            pose: PlanarPose {
                x_m: place[0],
                y_m: place[1],
                yaw_rad: place[2].wrapped_angle(),
            },
            velocity: WorldTwist {
                vx_m_s,
                vy_m_s,
                wz_rad_s,
            },
            acceleration: changes,
            speed_m_s: if speed > R::ZERO { speed } else { R::ZERO },
            done,
            over_s: if done { time_s - end_s } else { R::ZERO },
        }
    }
}
