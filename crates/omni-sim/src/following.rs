//! Following a scenario's path: where the vehicle takes itself to be, and what the path asks of it then.

use omni_core::{BodyTwist, Kinematics, Odometry, OdometryState, PlanarPose};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::config::{self, PlannedPath, PoseSource, Scenario, for_wheel_count};
use crate::controller::{AnyController, ControlSample};
use crate::observation::Observation;

/// Signals of a run that follows a path: where it should be at the end of the period.
pub(crate) const SIGNALS: [&str; 3] = ["path_x_m", "path_y_m", "path_yaw_rad"];

/// Dead reckoning by twists: how many wheels there are does not matter to it.
type ByTwists = Odometry<f64, 1>;

/// What is remembered: the pose by odometry.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct State(OdometryState<f64, 1>);

/// A path, and where whoever follows it takes itself to be.
pub(crate) struct Following {
    path: PlannedPath,
    odometry: ByTwists,
    pose: State,
    /// Twist by wheel velocities, one row an axis.
    forward: [Vec<f64>; 3],
    start: PlanarPose<f64>,
    /// Where a drive's pose begins among the controller's own signals.
    drive: Option<usize>,
}

/// The true pose in the plane.
fn true_pose(seen: &Observation) -> PlanarPose<f64> {
    PlanarPose {
        x_m: seen.pose.position_m[0],
        y_m: seen.pose.position_m[1],
        yaw_rad: seen.pose.yaw_rad(),
    }
}

/// How far the vehicle is from where a path wants it \[m\], and how far its heading is turned to the left of the path's \[rad\].
pub(crate) fn error_of(wanted: &PlanarPose<f64>, seen: &Observation) -> [f64; 2] {
    let is = true_pose(seen);
    let turned = omni_core::Real::wrapped_angle(is.yaw_rad - wanted.yaw_rad);
    [(is.x_m - wanted.x_m).hypot(is.y_m - wanted.y_m), turned]
}

fn forward<const N: usize>(scenario: &Scenario) -> Result<[Vec<f64>; 3], omni_core::ConfigError> {
    let kinematics = Kinematics::<f64, N>::new(&scenario.vehicle().layout()?)?;
    Ok(kinematics.forward_matrix().map(|row| row.to_vec()))
}

impl Following {
    /// Of a scenario with a path, at its start, with a controller that was made for it.
    pub(crate) fn new(scenario: &Scenario, controller: &AnyController) -> Result<Option<Self>, Error> {
        let Some(path) = scenario.planned_path()? else {
            return Ok(None);
        };
        let refuse = |error: omni_core::ConfigError| config::Error::Key {
            file: format!("scenario {}", scenario.name),
            key: error.parameter.into(),
            message: error.to_string(),
        };
        let count = scenario.vehicle().wheel.len();
        let forward =
            for_wheel_count!(count, forward[](scenario), |count| Err(config::wheel_count_refused(count)));
        let start = PlanarPose {
            x_m: scenario.start.x_m,
            y_m: scenario.start.y_m,
            yaw_rad: scenario.start.heading_rad,
        };
        let mut pose = State(OdometryState::new());
        pose.0.reset(&start);
        let own = controller.signal_names();
        Ok(Some(Self {
            path,
            odometry: Odometry::new(scenario.period_s()).map_err(refuse)?,
            pose,
            forward: forward.map_err(refuse)?,
            start,
            drive: own.iter().position(|name| name == "drive_pose_x_m"),
        }))
    }

    /// The wheels turned with these velocities \[rad/s\] for a period.
    pub(crate) fn turned(&mut self, wheels_rad_s: &[f64]) {
        let twist = self
            .forward
            .each_ref()
            .map(|row| row.iter().zip(wheels_rad_s).map(|(f, v)| f * v).sum());
        // What a silent encoder would have said is not known: then nothing is added.
        self.odometry
            .step_twist(&mut self.pose.0, &BodyTwist::from_array(twist));
    }

    /// The twist to command at a time \[s\].
    pub(crate) fn command(&self, time_s: f64, sample: &ControlSample, seen: &Observation) -> BodyTwist<f64> {
        let pose = match (self.path.pose, self.drive) {
            (PoseSource::Truth, _) => true_pose(seen),
            (_, Some(first)) => self.of_drive(sample.own.get(first..first + 3).unwrap_or(&[0.0; 3])),
            _ => self.pose.0.pose(),
        };
        self.path
            .follower
            .step(&self.path.trajectory().at(time_s), &pose)
            .twist
    }

    /// A drive's pose, which is from where it started, in the world.
    fn of_drive(&self, own: &[f64]) -> PlanarPose<f64> {
        let (sin, cos) = omni_core::Real::sine_cosine(self.start.yaw_rad);
        PlanarPose {
            x_m: self.start.x_m + cos * own[0] - sin * own[1],
            y_m: self.start.y_m + sin * own[0] + cos * own[1],
            yaw_rad: self.start.yaw_rad + own[2],
        }
    }

    pub(crate) fn state(&self) -> State {
        self.pose.clone()
    }

    pub(crate) fn restore(&mut self, state: State) {
        self.pose = state;
    }
}
