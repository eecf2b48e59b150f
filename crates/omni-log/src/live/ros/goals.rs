//! Goals of other nodes: planned on the thread that receives them, driven to by the run.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use omni_config::PlannedPath;
use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;
use omni_core::path::{ProgressState, TrajectorySample};

use crate::ros2::{Header, Path, Point, Pose, PoseStamped};
use crate::urdf::{MAP_LINK, ODOM_LINK};

/// Farthest goal from the vehicle \[m\]: it is planned in three seconds, for which the end of a run may wait.
const FARTHEST_M: f64 = 50.0;
/// The norm of an attitude's quaternion is 1 within this: clients round.
const NORM_WITHIN: f64 = 0.01;
/// Times between the poses of a published plan \[s\].
const SPACING_S: f64 = 0.1;

type Plan = dyn Fn(&PlanarPose<f64>, &PlanarPose<f64>) -> Result<PlannedPath, String> + Send + Sync;

/// Plans the way from a pose to a goal, or says in a line why there is none. It is called on a thread of its own.
#[derive(Clone)]
pub struct GoalPlanner(Arc<Plan>);

impl GoalPlanner {
    /// The planner that a function is.
    #[must_use]
    pub fn new(
        plan: impl Fn(&PlanarPose<f64>, &PlanarPose<f64>) -> Result<PlannedPath, String> + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(plan))
    }
}

impl std::fmt::Debug for GoalPlanner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("GoalPlanner")
    }
}

/// What the thread that receives goals and the run exchange.
pub(super) struct Goals {
    planner: GoalPlanner,
    /// Name of the frame of odometry.
    odom: String,
    exchange: Mutex<Exchange>,
}

#[derive(Default)]
struct Exchange {
    /// Where the vehicle is in the map and by odometry; none before its first period.
    poses: Option<Poses>,
    /// What the last goal led to; the inner one is none where there is no way.
    planned: Option<Option<PlannedPath>>,
}

/// The vehicle's pose.
#[derive(Clone, Copy)]
pub(super) struct Poses {
    pub(super) in_map: PlanarPose<f64>,
    pub(super) by_odometry: PlanarPose<f64>,
}

impl Poses {
    /// A pose in the frame of odometry as the map has it.
    fn to_map(self, pose: &PlanarPose<f64>) -> PlanarPose<f64> {
        let turn = self.in_map.yaw_rad - self.by_odometry.yaw_rad;
        let (sin, cos) = turn.sin_cos();
        let (x_m, y_m) = (pose.x_m - self.by_odometry.x_m, pose.y_m - self.by_odometry.y_m);
        PlanarPose {
            x_m: self.in_map.x_m + cos * x_m - sin * y_m,
            y_m: self.in_map.y_m + sin * x_m + cos * y_m,
            yaw_rad: pose.yaw_rad + turn,
        }
    }
}

impl Goals {
    /// With what stands before the names of frames.
    pub(super) fn new(planner: GoalPlanner, prefix: &str) -> Self {
        Self {
            planner,
            odom: format!("{prefix}{ODOM_LINK}"),
            exchange: Mutex::default(),
        }
    }

    /// No thread panics while writing; if one did, what is there is still whole.
    fn exchange(&self) -> MutexGuard<'_, Exchange> {
        self.exchange.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Plans the way to a goal from where the vehicle is, or says why not. What is no goal changes nothing; a goal
    /// without a way ends the drive to the one before.
    pub(super) fn take(&self, goal: &PoseStamped) -> Result<(), String> {
        let pose = planar(goal)?;
        let Some(poses) = self.exchange().poses else {
            return Err("the run has not begun".into());
        };
        let to = match goal.header.frame_id.trim_start_matches('/') {
            MAP_LINK => pose,
            odom if odom == self.odom => poses.to_map(&pose),
            frame => {
                return Err(format!(
                    "a goal in the frame {frame:?}, allowed: {MAP_LINK}, {}",
                    self.odom
                ));
            }
        };
        let from = &poses.in_map;
        // Numbers that are none are not within it either.
        if !(0.0..=FARTHEST_M).contains(&(to.x_m - from.x_m).hypot(to.y_m - from.y_m)) {
            let Point { x, y, .. } = goal.pose.position;
            return Err(format!(
                "a goal at {x}, {y}, allowed: within {FARTHEST_M} m of the vehicle"
            ));
        }
        let planned = (self.planner.0)(from, &to);
        let (path, said) = match planned {
            Ok(path) => (Some(path), Ok(())),
            Err(why) => (None, Err(format!("to {:.2}, {:.2}: {why}", to.x_m, to.y_m))),
        };
        self.exchange().planned = Some(path);
        said
    }

    /// The vehicle is there now. What the last goal led to, if it came since the last time.
    fn exchange_with(&self, poses: Poses) -> Option<Option<PlannedPath>> {
        let mut exchange = self.exchange();
        exchange.poses = Some(poses);
        exchange.planned.take()
    }

    /// The run begins anew: what was asked of the one before is over.
    fn forget(&self) {
        *self.exchange() = Exchange::default();
    }
}

/// The goal in the plane of its frame.
fn planar(goal: &PoseStamped) -> Result<PlanarPose<f64>, String> {
    let Pose {
        position: at,
        orientation: q,
    } = goal.pose;
    let norm = (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w).sqrt();
    if !(1.0 - NORM_WITHIN..=1.0 + NORM_WITHIN).contains(&norm) {
        return Err(format!("orientation: a quaternion of norm {norm}, allowed: 1"));
    }
    Ok(PlanarPose {
        x_m: at.x,
        y_m: at.y,
        yaw_rad: (2.0 * (q.w * q.z + q.x * q.y)).atan2(1.0 - 2.0 * (q.y * q.y + q.z * q.z)),
    })
}

/// The drive to a goal.
struct Drive {
    path: PlannedPath,
    progress: ProgressState<f64>,
    /// When it began \[s\].
    begin_s: f64,
}

impl Drive {
    fn at(&mut self, time_s: f64, pose: &PlanarPose<f64>) -> TrajectorySample<f64> {
        let (trajectory, time_s) = (self.path.trajectory(), time_s - self.begin_s);
        match &self.path.progress {
            Some(waits) => waits.step(&mut self.progress, &trajectory, time_s, pose),
            None => trajectory.at(time_s),
        }
    }
}

/// Drives to the goals, and knows what to publish.
pub(super) struct Navigator {
    goals: Arc<Goals>,
    drive: Option<Drive>,
}

/// What the navigator wants of the run's next period.
pub(super) enum Wanted {
    /// Nothing: others command.
    Nothing,
    /// A goal came. The plan is empty where there is no way.
    New(Path),
    /// This twist.
    Twist(BodyTwist<f64>),
}

impl Navigator {
    pub(super) fn new(goals: Arc<Goals>) -> Self {
        Self { goals, drive: None }
    }

    /// The run begins anew.
    pub(super) fn start_again(&mut self) {
        self.goals.forget();
        self.drive = None;
    }

    /// Others command: the drive is over.
    pub(super) fn cancel(&mut self) {
        self.drive = None;
    }

    /// At a time \[ns\], with the vehicle at that pose.
    pub(super) fn step(&mut self, time_ns: u64, poses: Poses) -> Wanted {
        let time_s = time_ns as f64 * 1e-9;
        if let Some(planned) = self.goals.exchange_with(poses) {
            let plan = plan_message(time_ns, planned.as_ref());
            self.drive = planned.map(|path| Drive {
                path,
                progress: ProgressState::default(),
                begin_s: time_s,
            });
            return Wanted::New(plan);
        }
        let Some(drive) = &mut self.drive else {
            return Wanted::Nothing;
        };
        let pose = poses.in_map;
        let wanted = drive.at(time_s, &pose);
        Wanted::Twist(drive.path.follower.step(&wanted, &pose).twist)
    }
}

/// The way as other nodes show and follow it.
fn plan_message(time_ns: u64, planned: Option<&PlannedPath>) -> Path {
    let header = Header::new(time_ns, MAP_LINK);
    let pose = |at: PlanarPose<f64>| PoseStamped {
        header: header.clone(),
        pose: Pose {
            position: [at.x_m, at.y_m, 0.0].into(),
            orientation: [0.0, 0.0, (0.5 * at.yaw_rad).sin(), (0.5 * at.yaw_rad).cos()].into(),
        },
    };
    let mut poses = Vec::new();
    if let Some(path) = planned {
        let trajectory = path.trajectory();
        let duration_s = trajectory.duration_s();
        let steps = (duration_s / SPACING_S).ceil() as u32;
        let times = (0..=steps).map(|step| (f64::from(step) * SPACING_S).min(duration_s));
        poses.extend(times.map(|time_s| pose(trajectory.at(time_s).pose)));
    }
    Path {
        header: header.clone(),
        poses,
    }
}

#[cfg(test)]
mod tests {
    use omni_config::{Override, Scenario};

    use super::*;

    fn goal(frame: &str, [x, y]: [f64; 2], q: [f64; 4]) -> PoseStamped {
        PoseStamped {
            header: Header::new(0, frame),
            pose: Pose {
                position: [x, y, 0.0].into(),
                orientation: q.into(),
            },
        }
    }

    /// Plans straight from the origin to two metres ahead; beyond three there is no way.
    fn planner() -> GoalPlanner {
        GoalPlanner::new(|_, to| {
            if to.x_m > 3.0 {
                return Err("a wall".into());
            }
            let path = "[{ x_m = 2.0 }]";
            let ahead = Scenario::load(
                "flat",
                &[Override::parse(&format!("command.path={path}")).expect("a path")],
            );
            let ahead = ahead.map_err(|error| error.to_string())?;
            Ok(ahead
                .planned_path()
                .map_err(|error| error.to_string())?
                .expect("a path"))
        })
    }

    const LEVEL: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

    #[test]
    fn what_is_no_goal_is_refused_by_its_part() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turned = planar(&goal("map", [1.0, -2.0], [0.0, 0.0, half, half])).expect("a goal");
        assert!((turned.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        for (wrong, part) in [
            (goal("map", [1.0, 0.0], [0.0; 4]), "norm 0, allowed: 1"),
            (
                goal("map", [1.0, 0.0], [f64::INFINITY; 4]),
                "norm inf, allowed: 1",
            ),
        ] {
            let said = planar(&wrong).expect_err(part);
            assert!(said.contains(part), "{said}");
        }
    }

    #[test]
    fn a_goal_is_planned_published_and_driven_to_until_another_has_no_way() {
        let goals = Arc::new(Goals::new(planner(), "robot1/"));
        let mut navigator = Navigator::new(goals.clone());
        let ahead = goal("map", [2.0, 0.0], LEVEL);
        assert_eq!(goals.take(&ahead), Err("the run has not begun".into()));
        let origin = Poses {
            in_map: PlanarPose::origin(),
            by_odometry: PlanarPose::origin(),
        };
        assert!(matches!(navigator.step(0, origin), Wanted::Nothing));
        assert_eq!(goals.take(&ahead), Ok(()));
        let Wanted::New(plan) = navigator.step(1_000_000, origin) else {
            panic!("a plan");
        };
        let last = plan.poses.last().expect("poses").pose.position;
        assert!(plan.poses.len() > 20 && (last.x - 2.0).abs() < 1e-9, "{last:?}");
        assert_eq!(plan.header.frame_id, "map");
        let Wanted::Twist(twist) = navigator.step(1_001_000_000, origin) else {
            panic!("a command");
        };
        assert!(twist.vx_m_s > 0.0);
        // What is no goal changes nothing; no way ends the drive.
        for far in [50.1, f64::NAN, f64::INFINITY] {
            let said = goals.take(&goal("map", [0.0, far], LEVEL)).expect_err("too far");
            assert!(said.ends_with(", allowed: within 50 m of the vehicle"), "{said}");
        }
        let said = goals.take(&goal("odom", [1.0, 0.0], LEVEL));
        assert_eq!(
            said,
            Err("a goal in the frame \"odom\", allowed: map, robot1/odom".into())
        );
        assert!(matches!(navigator.step(1_002_000_000, origin), Wanted::Twist(_)));
        assert_eq!(
            goals.take(&goal("map", [5.0, 0.0], LEVEL)),
            Err("to 5.00, 0.00: a wall".into())
        );
        let Wanted::New(plan) = navigator.step(1_003_000_000, origin) else {
            panic!("an empty plan");
        };
        assert!(plan.poses.is_empty());
        assert!(matches!(navigator.step(1_004_000_000, origin), Wanted::Nothing));
        // In the frame of odometry, which the map has a metre ahead and turned by a quarter: 5 m ahead there.
        let poses = Poses {
            in_map: PlanarPose {
                x_m: 1.0,
                y_m: 0.0,
                yaw_rad: std::f64::consts::FRAC_PI_2,
            },
            ..origin
        };
        assert!(matches!(navigator.step(1_005_000_000, poses), Wanted::Nothing));
        let said = goals.take(&goal("robot1/odom", [0.0, -4.0], LEVEL));
        assert_eq!(said, Err("to 5.00, 0.00: a wall".into()));
        // A goal of one run is none of the next.
        assert_eq!(goals.take(&ahead), Ok(()));
        navigator.start_again();
        assert!(matches!(navigator.step(0, origin), Wanted::Nothing));
    }
}
