//! A trajectory of omni-core, planned along a scenario's path.

use omni_core::geometry::PlanarPose;
use omni_core::path::{
    FollowerConfig, HolonomicFollower, PathLimits, PathPiece, PathProgress, PathSegment, PlanarInertia,
    ProgressConfig, ProgressState, Trajectory, TrajectoryPlanner, TrajectorySample, Waypoint,
};
use omni_core::shaping::MotionLimits;
use omni_core::{BodyTwist, ConfigError, Kinematics, TorqueLimit};

use crate::path::{PathFollow, PathPlan, PathWait, PoseSource};
use crate::{Error, Scenario, Vehicle, for_wheel_count, wheel_count_refused};

/// A limit that nothing meets.
const NO_LIMIT: f64 = 1e9;

/// A path with its times, and its follower.
///
/// ```
/// use omni_config::Scenario;
/// let path = Scenario::load("square", &[])?.planned_path()?.expect("it has a path");
/// let corner = path.trajectory().at(path.trajectory().segments()[1].start_s());
/// assert!((corner.pose.x_m - 1.0).abs() < 1e-9 && corner.speed_m_s < 1e-9);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlannedPath {
    segments: Vec<PathSegment<f64>>,
    pieces: Vec<PathPiece<f64>>,
    /// Follows the trajectory.
    pub follower: HolonomicFollower<f64>,
    /// Makes the trajectory wait for the vehicle; none: it does not.
    pub progress: Option<PathProgress<f64>>,
    /// Source of the follower's pose.
    pub pose: PoseSource,
    /// Time for which the vehicle stands before \[s\].
    pub rest_s: f64,
}

impl PlannedPath {
    /// The path with its times.
    #[must_use]
    pub fn trajectory(&self) -> Trajectory<'_, f64> {
        Trajectory::new(&self.segments, &self.pieces)
    }

    /// Time from the beginning of the rest to the end of the path, if it never waits \[s\].
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.rest_s + self.trajectory().duration_s()
    }

    /// Reference at a time since the beginning of the rest \[s\], for a vehicle at a pose. A path that waits for the
    /// vehicle goes on with its progress.
    #[must_use]
    pub fn step(
        &self,
        progress: &mut ProgressState<f64>,
        time_s: f64,
        pose: &PlanarPose<f64>,
    ) -> TrajectorySample<f64> {
        let time_s = (time_s - self.rest_s).max(0.0);
        match &self.progress {
            Some(waits) => waits.step(progress, &self.trajectory(), time_s, pose),
            None => self.trajectory().at(time_s),
        }
    }
}

impl Vehicle {
    /// Moment of inertia of everything about the vertical through the centre of mass, as the vehicle
    /// stands on flat ground \[kg.m^2\]; of a wheel half of what it is about its axle, as of a disc.
    ///
    /// ```
    /// let mecanum4 = omni_config::Vehicle::load("mecanum4")?; // a crate of 20 kg, and wheels of 1 kg under its corners
    /// let expected = 20.0 * (0.36 + 0.16) / 12.0 + 4.0 * (0.25 * 0.25 + 0.2 * 0.2) + 4.0 * 0.0035 / 2.0;
    /// assert!((mecanum4.yaw_inertia_kg_m2() - expected).abs() < 1e-12);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn yaw_inertia_kg_m2(&self) -> f64 {
        let [cx, cy, _] = self.centre_of_mass_m();
        let bodies = self.body.iter().map(|body| body.inertia_kg_m2()[2]);
        let wheels = self.wheel.iter().map(|wheel| 0.5 * wheel.inertia_kg_m2);
        let beside = self
            .weights()
            .map(|(mass, [x, y, _])| mass * ((x - cx).powi(2) + (y - cy).powi(2)));
        bodies.chain(wheels).chain(beside).sum()
    }
}

impl PathPlan {
    /// The limits for planning a path of this vehicle.
    fn limits<const N: usize>(&self, vehicle: &Vehicle) -> Result<PathLimits<f64, N>, ConfigError> {
        let motion = |velocity, acceleration, jerk| MotionLimits {
            velocity,
            acceleration,
            deceleration: acceleration,
            jerk,
        };
        let [x, y, _] = vehicle.centre_of_mass_m();
        let body = PlanarInertia {
            mass_kg: vehicle.mass_kg(),
            yaw_kg_m2: vehicle.yaw_inertia_kg_m2(),
            centre_m: [x, y],
        };
        let torque = if self.wheels {
            vehicle.motor.limit()?
        } else {
            TorqueLimit::constant(NO_LIMIT)?
        };
        let speed = vehicle
            .no_load_rad_s()
            .filter(|_| self.wheels)
            .unwrap_or(NO_LIMIT);
        let mut limits = PathLimits::new(
            motion(self.speed_m_s, self.acceleration_m_s2, self.jerk_m_s3),
            motion(self.yaw_rad_s, self.yaw_rad_s2, self.yaw_rad_s3),
            body,
            [speed; N],
            [torque; N],
        );
        for (inertia, wheel) in limits.wheel_kg_m2.iter_mut().zip(&vehicle.wheel) {
            *inertia = wheel.inertia_kg_m2 * wheel.gear * wheel.gear;
        }
        if let Some(own) = vehicle.limits.filter(|_| self.wheels) {
            let none = f64::INFINITY;
            let (linear, yaw) = (own.linear_m_s2.unwrap_or(none), own.yaw_rad_s2.unwrap_or(none));
            limits.fastest = BodyTwist::from_array(own.speeds().map(|v| self.share * v));
            limits.quickest = BodyTwist::from_array([linear, linear, yaw].map(|v| self.share * v));
        }
        limits.share = self.share;
        Ok(limits)
    }
}

type Parts = (Vec<PathSegment<f64>>, Vec<PathPiece<f64>>);

fn planned<const N: usize>(
    vehicle: &Vehicle,
    plan: &PathPlan,
    waypoints: &[Waypoint<f64>],
) -> Result<Parts, ConfigError> {
    let planner =
        TrajectoryPlanner::<f64, N>::new(&Kinematics::new(&vehicle.layout()?)?, plan.limits(vehicle)?)?;
    let [segments, pieces] = TrajectoryPlanner::<f64, N>::room(waypoints);
    let mut parts = (vec![PathSegment::EMPTY; segments], vec![PathPiece::EMPTY; pieces]);
    planner.plan(waypoints, &mut parts.0, &mut parts.1)?;
    Ok(parts)
}

impl PathFollow {
    fn follower(&self) -> Result<HolonomicFollower<f64>, ConfigError> {
        HolonomicFollower::new(FollowerConfig {
            gain_per_s: self.gain_per_s,
            heading_gain_per_s: self.heading_gain_per_s,
            limit_m_s: self.limit_m_s,
            limit_rad_s: self.limit_rad_s,
        })
    }
}

impl PathWait {
    fn progress(&self) -> Result<PathProgress<f64>, ConfigError> {
        PathProgress::new(ProgressConfig {
            lag_m: self.lag_m,
            lag_rad: self.lag_rad,
        })
    }
}

impl Scenario {
    /// The path of the scenario's command, planned for its vehicle from the start pose; none for a command without a
    /// path.
    ///
    /// # Errors
    /// [`Error::Key`] if it cannot be planned; a loaded scenario has been checked.
    pub fn planned_path(&self) -> Result<Option<PlannedPath>, Error> {
        let refuse = |(key, message)| Error::Key {
            file: format!("scenario {}", self.name),
            key,
            message,
        };
        self.plan_path().map_err(refuse)
    }

    /// The same, or the key and what is wrong with it.
    pub(crate) fn plan_path(&self) -> Result<Option<PlannedPath>, (String, String)> {
        let command = &self.command;
        let Some(waypoints) = command.waypoints(&self.start) else {
            return Ok(None);
        };
        let plan = |waypoints: &[Waypoint<f64>]| {
            let vehicle = self.vehicle();
            let count = vehicle.wheel.len();
            for_wheel_count!(count, planned[](vehicle, &command.plan, waypoints), |count| Err(wheel_count_refused(count)))
        };
        let (segments, pieces) = plan(&waypoints).map_err(|error| {
            let Some((parameter, index)) = error.parameter.strip_prefix("waypoint.").zip(error.index) else {
                return ("command.path".to_owned(), error.to_string());
            };
            let mut message = format!("{}, allowed: {}", error.value, error.allowed);
            if parameter == "time_s" {
                // The same way without that time, and how soon it is there.
                let mut freed = waypoints[..=index].to_vec();
                freed[index].time_s = None;
                if let Ok((segments, pieces)) = plan(&freed) {
                    let soonest = Trajectory::new(&segments, &pieces).duration_s();
                    message = format!(
                        "{}, allowed: at least {:.3}, the earliest time that the limits permit",
                        error.value,
                        soonest + 5e-4
                    );
                }
            }
            // The start is the waypoint with index 0.
            (
                format!("command.path[{}].{parameter}", index.saturating_sub(1)),
                message,
            )
        })?;
        let follower = command
            .follow
            .follower()
            .map_err(|error| (format!("command.follow.{}", error.parameter), error.to_string()))?;
        let progress = command.follow.wait.as_ref().map(PathWait::progress).transpose();
        let progress = progress.map_err(|error| {
            (
                format!("command.follow.wait.{}", error.parameter),
                error.to_string(),
            )
        })?;
        Ok(Some(PlannedPath {
            segments,
            pieces,
            follower,
            progress,
            pose: command.follow.pose,
            rest_s: command.follow.rest_s,
        }))
    }

    /// Largest distance from its start of a vehicle that follows the command \[m\].
    ///
    /// ```
    /// use omni_config::Scenario;
    /// assert!((Scenario::load("flat", &[])?.farthest_m() - 0.3 * 4.0).abs() < 1e-12); // 0.3 m/s for 4 s
    /// assert!((Scenario::load("square", &[])?.farthest_m() - 4.0).abs() < 1e-12); // all of its sides
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn farthest_m(&self) -> f64 {
        match self.command.waypoints(&self.start) {
            // Half of a circle is pi / 2 of its chord, and nothing bends more on the way to a place
            // that is further away.
            Some(waypoints) => waypoints
                .windows(2)
                .map(|pair| libm::hypot(pair[1].x_m - pair[0].x_m, pair[1].y_m - pair[0].y_m))
                .sum(),
            None => self.command.fastest_m_s() * self.duration_s,
        }
    }
}
