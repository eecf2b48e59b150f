//! Planned paths: the reference pose at a time, and the twist that leads to it.

use core::slice;

use omni_core::geometry::PlanarPose;
use omni_core::path::{Follow, HolonomicFollower, PathPiece, PathSegment, Trajectory, TrajectorySample};

use crate::status::{Status, at};

/// A path with its times: `OMNI_TRAJECTORY`.
#[repr(C)]
pub struct PlannedTrajectory {
    segments: *const PathSegment<f32>,
    pieces: *const PathPiece<f32>,
    segment_count: u32,
    piece_count: u32,
}

impl PlannedTrajectory {
    /// The same for the library; none where a pointer is null.
    #[inline]
    fn trajectory(&self) -> Result<Trajectory<'_, f32>, Status> {
        if self.segments.is_null() || self.pieces.is_null() {
            return Err(Status::NullPointer);
        }
        // SAFETY: neither is null, and `omnistep export` writes how many there are of constants.
        let (segments, pieces) = unsafe {
            (
                slice::from_raw_parts(self.segments, self.segment_count as usize),
                slice::from_raw_parts(self.pieces, self.piece_count as usize),
            )
        };
        Ok(Trajectory::new(segments, pieces))
    }
}

/// Reference pose `time_s` [s] after the start of the path. Before the start it is the start, after the
/// end it is the end, at rest.
#[unsafe(no_mangle)]
pub extern "C" fn omni_trajectory_at(
    trajectory: Option<&PlannedTrajectory>,
    time_s: f32,
    sample: Option<&mut TrajectorySample<f32>>,
) -> Status {
    let sampled = || {
        let (trajectory, sample) = (at(trajectory)?.trajectory()?, at(sample)?);
        *sample = trajectory.at(time_s);
        Ok(())
    };
    sampled().into()
}

/// Duration of the path [s].
#[unsafe(no_mangle)]
pub extern "C" fn omni_trajectory_duration(
    trajectory: Option<&PlannedTrajectory>,
    duration_s: Option<&mut f32>,
) -> Status {
    let asked = || {
        let (trajectory, duration_s) = (at(trajectory)?.trajectory()?, at(duration_s)?);
        *duration_s = trajectory.duration_s();
        Ok(())
    };
    asked().into()
}

/// The twist that brings a vehicle at `pose` to the reference pose and keeps it there: a command for the drive.
#[unsafe(no_mangle)]
pub extern "C" fn omni_follow(
    follower: Option<&HolonomicFollower<f32>>,
    sample: Option<&TrajectorySample<f32>>,
    pose: Option<&PlanarPose<f32>>,
    follow: Option<&mut Follow<f32>>,
) -> Status {
    let followed = || {
        let (follower, sample, pose, follow) = (at(follower)?, at(sample)?, at(pose)?, at(follow)?);
        *follow = follower.step(sample, pose);
        Ok(())
    };
    followed().into()
}
