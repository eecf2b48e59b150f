//! Goals of other nodes: planned on the thread that receives them, driven to by the run.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use omni_config::PlannedPath;
use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;
use omni_core::path::ProgressState;

use super::frames::{Frames, Poses};
use crate::ros2::{Header, Path, Point, Pose, PoseStamped};
use crate::urdf::MAP_LINK;

/// Farthest goal from the vehicle \[m\]: it is planned in three seconds, for which the end of a run may wait.
const FARTHEST_M: f64 = 50.0;
/// As far as a vehicle may be from the beginning of its way \[m\]: from farther it would be driven there over ground
/// that is not planned.
const MOVED_M: f64 = 0.15;
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
    frames: Arc<Frames>,
    exchange: Mutex<Exchange>,
}

#[derive(Default)]
struct Exchange {
    /// How often the run began anew: what was planned for an earlier one is none of the next.
    run: u64,
    /// What the last goal led to.
    planned: Option<Planned>,
}

/// A way to a goal.
pub(super) struct Planned {
    path: PlannedPath,
    /// When the goal came: a later command of others counts more.
    pub(super) came: Instant,
    /// The way as other nodes show and follow it.
    pub(super) message: Path,
}

impl Goals {
    /// In these frames.
    pub(super) fn new(planner: GoalPlanner, frames: Arc<Frames>) -> Self {
        Self {
            planner,
            frames,
            exchange: Mutex::default(),
        }
    }

    /// No thread panics while writing; if one did, what is there is still whole.
    fn exchange(&self) -> MutexGuard<'_, Exchange> {
        self.exchange.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Plans the way to a goal from where the vehicle is, or says why not: then nothing changes.
    pub(super) fn take(&self, goal: &PoseStamped) -> Result<(), String> {
        let came = Instant::now();
        let run = self.exchange().run;
        let poses = self.frames.poses()?;
        let to = self.frames.in_map(&goal.header, &goal.pose)?;
        let from = &poses.in_map;
        // Numbers that are none are not within it either.
        if !(0.0..=FARTHEST_M).contains(&distance_m(from, &to)) {
            let Point { x, y, .. } = goal.pose.position;
            return Err(format!(
                "a goal at {x}, {y}, allowed: within {FARTHEST_M} m of the vehicle"
            ));
        }
        let refuse = |why: String| format!("to {:.2}, {:.2}: {why}", to.x_m, to.y_m);
        let path = (self.planner.0)(from, &to).map_err(refuse)?;
        let message = plan_message(&path);
        let mut exchange = self.exchange();
        if exchange.run != run {
            return Err(refuse("the run began anew while the way was planned".into()));
        }
        let moved = |now: Poses| distance_m(&now.in_map, from) > MOVED_M;
        if self.frames.poses().map_or(true, moved) {
            return Err(refuse(
                "the vehicle moved on while the way was planned; send the goal again when it stands".into(),
            ));
        }
        exchange.planned = Some(Planned { path, came, message });
        Ok(())
    }

    /// What the last goal led to, if it came since the last time.
    fn take_planned(&self) -> Option<Planned> {
        self.exchange().planned.take()
    }

    /// The run begins anew: what was asked of the one before is over.
    fn forget(&self) {
        let mut exchange = self.exchange();
        *exchange = Exchange {
            run: exchange.run + 1,
            ..Exchange::default()
        };
    }
}

fn distance_m(one: &PlanarPose<f64>, other: &PlanarPose<f64>) -> f64 {
    (one.x_m - other.x_m).hypot(one.y_m - other.y_m)
}

/// The drive to a goal.
struct Drive {
    path: PlannedPath,
    progress: ProgressState<f64>,
    /// When its goal came, and when it began \[s\].
    came: Instant,
    begin_s: f64,
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
    /// A drive begins, whose plan this is.
    Begin(Path),
    /// A command of others ended the drive.
    Ended,
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

    /// At a time \[ns\], with the vehicle at that pose; the last command of others came then.
    pub(super) fn step(&mut self, time_ns: u64, poses: Poses, commanded: Option<Instant>) -> Wanted {
        let time_s = time_ns as f64 * 1e-9;
        let is_later = |came: Instant| commanded.is_some_and(|command| command > came);
        let planned = self.goals.take_planned();
        if let Some(Planned { path, came, message }) = planned.filter(|planned| !is_later(planned.came)) {
            self.drive = Some(Drive {
                path,
                progress: ProgressState::default(),
                came,
                begin_s: time_s,
            });
            return Wanted::Begin(message.at(time_ns));
        }
        let Some(drive) = &mut self.drive else {
            return Wanted::Nothing;
        };
        if is_later(drive.came) {
            self.drive = None;
            return Wanted::Ended;
        }
        let pose = poses.in_map;
        let wanted = drive
            .path
            .step(&mut drive.progress, time_s - drive.begin_s, &pose);
        Wanted::Twist(drive.path.follower.step(&wanted, &pose).twist)
    }
}

impl Path {
    /// The same at a time \[ns\].
    pub(super) fn at(mut self, time_ns: u64) -> Self {
        let stamp = Header::new(time_ns, MAP_LINK).stamp;
        self.header.stamp = stamp;
        for pose in &mut self.poses {
            pose.header.stamp = stamp;
        }
        self
    }

    /// No way.
    pub(super) fn none() -> Self {
        Self {
            header: Header::new(0, MAP_LINK),
            poses: Vec::new(),
        }
    }
}

/// The way as other nodes show and follow it, at time 0.
fn plan_message(path: &PlannedPath) -> Path {
    let pose = |at: PlanarPose<f64>| PoseStamped {
        header: Header::new(0, MAP_LINK),
        pose: Pose {
            position: [at.x_m, at.y_m, 0.0].into(),
            orientation: [0.0, 0.0, (0.5 * at.yaw_rad).sin(), (0.5 * at.yaw_rad).cos()].into(),
        },
    };
    let trajectory = path.trajectory();
    let duration_s = trajectory.duration_s();
    let steps = (duration_s / SPACING_S).ceil() as u32;
    let times = (0..=steps).map(|step| (f64::from(step) * SPACING_S).min(duration_s));
    Path {
        poses: times.map(|time_s| pose(trajectory.at(time_s).pose)).collect(),
        ..Path::none()
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
            let path = Override::parse("command={ path = [{ x_m = 2.0, y_m = 0.0 }] }").expect("a path");
            let ahead = Scenario::load("flat", &[path]);
            let ahead = ahead.map_err(|error| error.to_string())?;
            Ok(ahead
                .planned_path()
                .map_err(|error| error.to_string())?
                .expect("a path"))
        })
    }

    const LEVEL: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

    #[test]
    fn a_goal_is_planned_published_and_driven_to_until_others_command() {
        let frames = Arc::new(Frames::new("robot1/"));
        let goals = Arc::new(Goals::new(planner(), frames.clone()));
        let mut navigator = Navigator::new(goals.clone());
        let ahead = goal("map", [2.0, 0.0], LEVEL);
        assert_eq!(goals.take(&ahead), Err("the run has not begun".into()));
        let origin = Poses {
            in_map: PlanarPose::origin(),
            by_odometry: PlanarPose::origin(),
        };
        frames.set(Some(origin));
        let before = Instant::now();
        assert!(matches!(navigator.step(0, origin, None), Wanted::Nothing));
        assert_eq!(goals.take(&ahead), Ok(()));
        // A command from before the goal does not count.
        let Wanted::Begin(plan) = navigator.step(1_000_000, origin, Some(before)) else {
            panic!("a plan");
        };
        let last = plan.poses.last().expect("poses").pose.position;
        assert!(plan.poses.len() > 20 && (last.x - 2.0).abs() < 1e-9, "{last:?}");
        assert_eq!(plan.header, Header::new(1_000_000, "map"));
        let Wanted::Twist(twist) = navigator.step(1_001_000_000, origin, Some(before)) else {
            panic!("a command");
        };
        assert!(twist.vx_m_s > 0.0);
        // What is no goal, and one that has no way, change nothing.
        let said = goals.take(&goal("odom", [1.0, 0.0], LEVEL));
        assert_eq!(
            said,
            Err("a pose in the frame \"odom\", allowed: map, robot1/odom".into())
        );
        for far in [50.1, f64::NAN, f64::INFINITY] {
            let said = goals.take(&goal("map", [0.0, far], LEVEL)).expect_err("too far");
            assert!(said.ends_with(", allowed: within 50 m of the vehicle"), "{said}");
        }
        let said = goals.take(&goal("map", [5.0, 0.0], LEVEL));
        assert_eq!(said, Err("to 5.00, 0.00: a wall".into()));
        assert!(matches!(
            navigator.step(1_003_000_000, origin, Some(before)),
            Wanted::Twist(_)
        ));
        // A later command ends the drive, and one that came while the way was planned does not let it begin.
        let after = Some(Instant::now());
        assert!(matches!(
            navigator.step(1_004_000_000, origin, after),
            Wanted::Ended
        ));
        assert_eq!(goals.take(&ahead), Ok(()));
        let after = Some(Instant::now());
        assert!(matches!(
            navigator.step(1_005_000_000, origin, after),
            Wanted::Nothing
        ));
        // In the frame of odometry, which the map has a metre ahead and turned by a quarter: 5 m ahead there.
        let poses = Poses {
            in_map: PlanarPose {
                x_m: 1.0,
                y_m: 0.0,
                yaw_rad: std::f64::consts::FRAC_PI_2,
            },
            ..origin
        };
        frames.set(Some(poses));
        assert!(matches!(
            navigator.step(1_006_000_000, poses, after),
            Wanted::Nothing
        ));
        let said = goals
            .take(&goal("robot1/odom", [0.0, -4.0], LEVEL))
            .expect_err("a wall");
        assert!(
            said.starts_with("to 5.00, ") && said.ends_with(": a wall"),
            "{said}"
        );
        // A goal of one run is none of the next.
        assert_eq!(goals.take(&ahead), Ok(()));
        navigator.start_again();
        assert!(matches!(navigator.step(0, origin, after), Wanted::Nothing));
    }

    #[test]
    fn a_way_is_not_driven_that_was_planned_for_another_run_or_from_another_place() {
        type Happens = Box<dyn Fn(&Goals, &Frames) + Send + Sync>;
        let away = |x_m| Poses {
            in_map: PlanarPose {
                x_m,
                ..PlanarPose::origin()
            },
            by_odometry: PlanarPose::origin(),
        };
        // What happens while the way is planned.
        let cases: [(Happens, &str); 3] = [
            (
                Box::new(|goals, _| goals.forget()),
                "the run began anew while the way was planned",
            ),
            (
                Box::new(move |_, frames| frames.set(Some(away(0.2)))),
                "the vehicle moved on while the way was planned",
            ),
            (Box::new(move |_, frames| frames.set(Some(away(0.1)))), ""),
        ];
        for (happens, why) in cases {
            let frames = Arc::new(Frames::new(""));
            frames.set(Some(away(0.0)));
            let goals = Arc::new_cyclic(|this: &std::sync::Weak<Goals>| {
                let (this, plan, of_the_plan) = (this.clone(), planner(), frames.clone());
                let planner = GoalPlanner::new(move |from, to| {
                    happens(&this.upgrade().expect("there"), &of_the_plan);
                    (plan.0)(from, to)
                });
                Goals::new(planner, frames.clone())
            });
            let mut navigator = Navigator::new(goals.clone());
            navigator.step(0, away(0.0), None);
            let said = goals
                .take(&goal("map", [2.0, 0.0], LEVEL))
                .err()
                .unwrap_or_default();
            assert!(said.contains(why), "{said}");
            let begins = matches!(navigator.step(0, away(0.0), None), Wanted::Begin(_));
            assert_eq!(begins, why.is_empty());
        }
    }
}
