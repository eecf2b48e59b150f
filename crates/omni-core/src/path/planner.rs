//! From waypoints to a trajectory.

use crate::geometry::{Kinematics, WheelTorques, WheelVelocities};
use crate::{ConfigError, Real};

use super::limits::{PathLimits, Vehicle, check_waypoint};
use super::path_geometry::{Section, head, lay};
use super::piece::{PathPiece, Waypoint};
use super::schedule::schedule;
use super::segment::PathSegment;
use super::trajectory::{Trajectory, TrajectorySample};

/// Makes trajectories of waypoints. Nothing is allocated; the caller brings the room.
///
/// Limits of a trajectory, segment by segment, at both ends and at 31 points between them on each piece:
/// - No wheel turns faster than `share` of its speed, and no motor so fast that it keeps less than
///   a quarter of its torque at rest.
/// - Bends and turns of the heading use at most half of `share` of the wheels' torques at the segment's highest speed;
///   speeding up and slowing down use the remaining part of `share` at that speed. Torques are the set with the
///   smallest sum of squares that accelerates the body, centripetal acceleration included, and the wheels.
/// - The components of the twist, their changes, and velocity, acceleration and jerk of path and heading
///   stay within their limits, of which bends use half (of a jerk a third) at the highest speed.
///
/// Between those points a limit may be passed by a hundredth at most (tested), which [`PathLimits::share`]
/// leaves room for. Acceleration is zero at the joints of segments, and the speed there is as high as both segments
/// allow, or zero at a corner. The ground's friction limit is not known: set `linear.acceleration` accordingly.
///
/// ```
/// use omni_core::path::{PathLimits, PathPiece, PathSegment, PlanarInertia};
/// use omni_core::shaping::MotionLimits;
/// use omni_core::{Kinematics, TorqueLimit};
/// use omni_core::path::{TrajectoryPlanner, Waypoint};
/// use omni_core::WheelLayout;
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.5, 0.4, 0.076)?)?;
/// let linear = MotionLimits { velocity: 0.8, acceleration: 1.0, deceleration: 1.0, jerk: 8.0 };
/// let yaw = MotionLimits { velocity: 2.0, acceleration: 4.0, deceleration: 4.0, jerk: 40.0 };
/// let body = PlanarInertia { mass_kg: 24.0, yaw_kg_m2: 1.0, centre_m: [0.0; 2] };
/// let limits = PathLimits::new(linear, yaw, body, [25.0; 4], [TorqueLimit::line(3.0, 0.1)?; 4]);
/// let planner = TrajectoryPlanner::new(&kinematics, limits)?;
/// let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
/// let waypoints = [Waypoint::at(0.0, 0.0), Waypoint::at(2.0, 0.0)];
/// let ahead = planner.plan(&waypoints, &mut segments, &mut pieces)?;
/// // Section over speed, and for each of two ramps half of v / a + a / j.
/// assert!((ahead.duration_s() - (2.0 / 0.8 + 0.8 / 1.0 + 1.0 / 8.0)).abs() < 1e-9);
/// let halfway = ahead.at(0.5 * ahead.duration_s());
/// assert!((halfway.pose.x_m - 1.0).abs() < 1e-9 && (halfway.velocity.vx_m_s - 0.8).abs() < 1e-9);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPlanner<R, const N: usize> {
    vehicle: Vehicle<R, N>,
}

impl<R: Real, const N: usize> TrajectoryPlanner<R, N> {
    /// For a vehicle with these wheels and limits.
    ///
    /// # Errors
    /// The limit that is out of its range, by its name in [`PathLimits`].
    pub fn new(kinematics: &Kinematics<R, N>, limits: PathLimits<R, N>) -> Result<Self, ConfigError> {
        limits.check()?;
        let kinematics = *kinematics;
        Ok(Self {
            vehicle: Vehicle { kinematics, limits },
        })
    }

    /// Numbers of segments and pieces that [`TrajectoryPlanner::plan`] needs room for.
    ///
    /// ```
    /// use omni_core::path::{TrajectoryPlanner, WayShape, Waypoint};
    /// let mut left_about = Waypoint::at(0.0, 2.0);
    /// left_about.shape = WayShape::Arc { sweep_rad: core::f64::consts::PI };
    /// assert_eq!(TrajectoryPlanner::<f64, 4>::room(&[Waypoint::at(0.0, 0.0), left_about]), [1, 4]); // pieces of 45 degrees
    /// ```
    #[must_use]
    pub fn room(waypoints: &[Waypoint<R>]) -> [usize; 2] {
        let pairs = waypoints.iter().zip(waypoints.iter().skip(1));
        let pieces = pairs.map(|(from, to)| Section::of(from, to).map_or(1, |way| usize::from(way.pieces())));
        [waypoints.len().saturating_sub(1), pieces.sum()]
    }

    /// The trajectory through `waypoints`, 2 to 1000 of them, from rest to rest, in the room given.
    ///
    /// # Errors
    /// `waypoints` if there are too few or too many, `segments` or `pieces` if the room is too small; otherwise
    /// `waypoint.` and the wrong field of the waypoint with the error's `index`: a value out of range, `waypoint.x_m`
    /// if the segment to it is empty, `waypoint.time_s` if it is earlier than the limits allow, or no later than the
    /// previous time.
    ///
    /// ```
    /// use omni_core::path::{PathLimits, PathPiece, PathSegment, PlanarInertia};
    /// use omni_core::shaping::MotionLimits;
    /// use omni_core::{Kinematics, TorqueLimit};
    /// use omni_core::path::{TrajectoryPlanner, Waypoint};
    /// use omni_core::WheelLayout;
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.5, 0.4, 0.076)?)?;
    /// let motion = MotionLimits { velocity: 1.0, acceleration: 1.0, deceleration: 1.0, jerk: 10.0 };
    /// let body = PlanarInertia { mass_kg: 24.0, yaw_kg_m2: 1.0, centre_m: [0.0; 2] };
    /// let limits = PathLimits::new(motion, motion, body, [25.0; 4], [TorqueLimit::line(3.0, 0.1)?; 4]);
    /// let planner = TrajectoryPlanner::new(&kinematics, limits)?;
    /// let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
    /// let mut there = Waypoint::at(2.0, 0.0);
    /// there.time_s = Some(10.0);
    /// let slow = planner.plan(&[Waypoint::at(0.0, 0.0), there], &mut segments, &mut pieces)?;
    /// assert!((slow.duration_s() - 10.0).abs() < 1e-9);
    /// there.time_s = Some(1.0);
    /// let error = planner.plan(&[Waypoint::at(0.0, 0.0), there], &mut segments, &mut pieces).unwrap_err();
    /// assert_eq!(error.to_string(), "waypoint 2: time_s = 1, allowed: a later time: the limits do not permit this one");
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn plan<'a>(
        &self,
        waypoints: &[Waypoint<R>],
        segments: &'a mut [PathSegment<R>],
        pieces: &'a mut [PathPiece<R>],
    ) -> Result<Trajectory<'a, R>, ConfigError> {
        let count = waypoints.len();
        if !(2..=1000).contains(&count) {
            return Err(ConfigError::new("waypoints", count as f64, "2 to 1000"));
        }
        let mut before_s = R::ZERO;
        for (i, waypoint) in waypoints.iter().enumerate() {
            check_waypoint(waypoint).map_err(|error| error.at(i))?;
            if let Some(time_s) = waypoint.time_s.filter(|_| i > 0) {
                if time_s <= before_s {
                    let late = "later than the time of the waypoint before";
                    return Err(ConfigError::new("waypoint.time_s", time_s.as_f64(), late).at(i));
                }
                before_s = time_s;
            }
        }
        let [ways, needed] = Self::room(waypoints);
        let room = |name, found: usize| {
            ConfigError::new(
                name,
                found as f64,
                "at least as many as TrajectoryPlanner::room returns",
            )
        };
        let found = [segments.len(), pieces.len()];
        let segments = segments.get_mut(..ways).ok_or(room("segments", found[0]))?;
        let pieces = pieces.get_mut(..needed).ok_or(room("pieces", found[1]))?;
        lay(waypoints, segments, pieces)?;
        head(waypoints, segments, pieces);
        self.limit(waypoints, segments, pieces);
        schedule(waypoints, segments, pieces)?;
        Ok(Trajectory::new(segments, pieces))
    }

    /// Actuator velocities \[rad/s\] of a vehicle that follows a sample exactly.
    ///
    /// ```
    /// use omni_core::path::{PathPiece, PathSegment, Waypoint};
    /// # let planner = omni_core::examples::planner()?;
    /// # let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
    /// // 0.5 m/s, 1 m/s^2, 20 kg, four wheels of 0.1 m.
    /// let ahead = planner.plan(&[Waypoint::at(0.0, 0.0), Waypoint::at(2.0, 0.0)], &mut segments, &mut pieces)?;
    /// let halfway = ahead.at(0.5 * ahead.duration_s());
    /// assert!((planner.velocities(&halfway).rad_s[0] - 5.0).abs() < 1e-9);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn velocities(&self, sample: &TrajectorySample<R>) -> WheelVelocities<R, N> {
        self.vehicle.kinematics.inverse(&sample.feed_forward())
    }

    /// Actuator torques \[N.m\] that a sample's acceleration requires: of all torques that produce it, the set with the
    /// smallest sum of squares. Friction is not included.
    ///
    /// ```
    /// use omni_core::path::{PathPiece, PathSegment, Waypoint};
    /// # let planner = omni_core::examples::planner()?;
    /// # let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
    /// // 0.5 m/s, 1 m/s^2, 20 kg, four wheels of 0.1 m.
    /// let ahead = planner.plan(&[Waypoint::at(0.0, 0.0), Waypoint::at(2.0, 0.0)], &mut segments, &mut pieces)?;
    /// let speeding_up = ahead.at(0.3); // the jerk of 10 m/s^3 is behind
    /// assert!((planner.torques(&speeding_up).n_m[0] - 20.0 * 1.0 / 4.0 * 0.1).abs() < 1e-9);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn torques(&self, sample: &TrajectorySample<R>) -> WheelTorques<R, N> {
        let velocity = [
            sample.velocity.vx_m_s,
            sample.velocity.vy_m_s,
            sample.velocity.wz_rad_s,
        ];
        self.vehicle
            .torques(sample.pose.yaw_rad, velocity, sample.acceleration)
    }

    fn limit(&self, waypoints: &[Waypoint<R>], segments: &mut [PathSegment<R>], pieces: &[PathPiece<R>]) {
        for (segment, to) in segments.iter_mut().zip(waypoints.iter().skip(1)) {
            let own = to.speed_m_s.filter(|_| !segment.on_the_spot);
            let fastest = own.unwrap_or(R::of(1000.0));
            segment.allowed = self.vehicle.allowed(segment.pieces_of(pieces), fastest);
        }
    }
}
