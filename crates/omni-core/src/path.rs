//! Paths: plan a trajectory within the speed and torque limits of the wheels, and follow it.
//!
//! [`TrajectoryPlanner`] makes a [`Trajectory`] through [`Waypoint`]s, and [`HolonomicFollower`]
//! turns it into commands. [`PathProgress`] makes it wait for a vehicle that is held up.
//!
//! A path is made of pieces, polynomials of the way along it; a segment, from one waypoint to the
//! next, says when how much of the way is behind. Both are plain numbers, so that a trajectory can
//! be made on a computer and lie in a microcontroller's flash.

mod follower;
mod limits;
mod path_geometry;
mod piece;
mod planner;
mod progress;
mod schedule;
mod segment;
mod time_law;
mod trajectory;

pub use follower::{Follow, FollowerConfig, HolonomicFollower};
pub use limits::{PathLimits, PlanarInertia};
pub use piece::{PathPiece, WayShape, Waypoint};
pub use planner::TrajectoryPlanner;
pub use progress::{PathProgress, ProgressConfig, ProgressState};
pub use segment::PathSegment;
#[doc(hidden)]
pub use time_law::Phase;
pub use trajectory::{Trajectory, TrajectorySample};
