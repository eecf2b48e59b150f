//! The run as a ROS 2 node over DDS, without a ROS installation; the only modules that name ros2-client.

mod clock;
mod commands;
mod diagnostics;
mod frames;
mod goals;
mod joints;
mod listener;
mod node;
mod options;
mod payload;
mod placement;
mod services;

use std::sync::Arc;

use diagnostics::Diagnostics;
use frames::{Frames, Poses};
pub use goals::GoalPlanner;
use goals::{Goals, Navigator, Wanted};
pub(super) use joints::JointCommands;
use listener::Listener;
use node::Node;
use omni_config::Scenario;
use omni_core::BodyTwist;
use omni_sim::Simulation;
use omni_sim::controller::AnyController;
use options::ExtraRates;
pub use options::{Ros2, TfFrames};
use placement::Placement;

use super::controls::Controls;
use super::requests::Requests;
use super::warn::Warn;
use crate::Error;
use crate::message_rates::{Pace, Rates};
use crate::messages::{Messages, Sink};
use crate::ros2::{
    Clock, Header, Imu, Path, Quaternion, TfMessage, Time, Transform, TransformStamped, Vector3,
};
use crate::topic;
use crate::tree::Roots;
use crate::urdf::{BASE_LINK, IMU_LINK, JointInterface};

/// Covariance of what is not measured.
const NOT_MEASURED: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// What others may ask of a run.
pub(super) struct Asked<'a> {
    pub(super) requests: &'a Arc<Requests>,
    /// The wheels are driven one by one.
    pub(super) joints: Option<&'a Arc<JointCommands>>,
    /// Pause and another start, and whether it can start again.
    pub(super) controls: (Arc<Controls>, bool),
}

/// A scenario's own controller, or others that drive the wheels one by one.
pub(super) fn controller(
    scenario: &Scenario,
    joints: Option<&Arc<JointCommands>>,
) -> Result<AnyController, Error> {
    match joints {
        Some(joints) => Ok(joints::controller(scenario, joints)?),
        None => Ok(AnyController::new(scenario)?),
    }
}

/// What the messages of a run begin with.
struct Start {
    rates: Rates,
    extra: ExtraRates,
    roots: Roots,
    joint_frames: bool,
}

impl Start {
    fn messages(&self, scenario: &Scenario, controller: &AnyController) -> Messages {
        let messages = Messages::at_rates(scenario, controller, self.rates, self.roots);
        if self.joint_frames {
            messages
        } else {
            messages.without_joint_frames()
        }
    }
}

/// What others know on ROS 2, and send.
pub(super) struct OnRos {
    /// Take commands, goals and requests of services, until they are dropped: before the node, which they use.
    _listeners: Vec<Listener>,
    /// Also on `/rosout`.
    warn: Warn,
    node: Node,
    start: Start,
    messages: Messages,
    driven: Option<JointInterface>,
    /// The frame that does not move is sent.
    fixed_frames: bool,
    clock: Pace,
    imu: Pace,
    diagnostics: Diagnostics,
    namespace: String,
    frames: Arc<Frames>,
    /// Of `--chart`.
    navigator: Option<Navigator>,
}

impl OnRos {
    /// Joins the domain.
    pub(super) fn open(
        scenario: &Scenario,
        controller: &AnyController,
        ros2: &Ros2,
        asked: Asked<'_>,
        warn: &Warn,
    ) -> Result<Self, Error> {
        let (rates, extra) = ros2.rates()?;
        ros2.check_goals()?;
        let prefix = ros2.frame_prefix()?;
        let frames = Arc::new(Frames::new(prefix));
        let goals = ros2
            .goals
            .clone()
            .map(|planner| Arc::new(Goals::new(planner, frames.clone())));
        let namespace = ros2.namespace()?;
        let (mut node, context) = node::join(ros2.domain, &namespace)?;
        let warn = node::with_rosout(&node, &namespace, warn);
        let mut listen = || -> Result<Vec<Listener>, String> {
            let mut listeners = vec![match asked.joints {
                Some(joints) => commands::take_joints(&mut node, &namespace, joints.clone(), warn.clone()),
                None => commands::take_twists(&mut node, &namespace, asked.requests.clone(), warn.clone()),
            }?];
            if let Some(goals) = &goals {
                let goals = goals.clone();
                listeners.push(commands::take_goals(&mut node, &namespace, goals, warn.clone())?);
            }
            let (controls, can_start_again) = &asked.controls;
            if ros2.follow_clock {
                // When it waits and begins anew is another's to say.
                listeners.push(clock::follow(&mut node, asked.controls.clone(), warn.clone())?);
                return Ok(listeners);
            }
            listeners.push(services::offer(&mut node, &namespace, asked.controls.clone())?);
            if *can_start_again {
                let placement = Placement {
                    scenario: scenario.clone(),
                    frames: frames.clone(),
                    controls: controls.clone(),
                };
                listeners.push(commands::take_places(
                    &mut node,
                    &namespace,
                    placement,
                    warn.clone(),
                )?);
            }
            Ok(listeners)
        };
        let listeners = listen().map_err(|reason| ros2.failed(reason))?;
        let node = Node::new(node, context, &namespace, prefix).map_err(|reason| ros2.failed(reason))?;
        let roots = if ros2.publish_map_frame {
            Roots::Map
        } else {
            Roots::Odometry
        };
        let start = Start {
            rates,
            extra,
            roots,
            joint_frames: ros2.tf == TfFrames::All,
        };
        Ok(Self {
            node,
            messages: start.messages(scenario, controller),
            start,
            fixed_frames: ros2.tf != TfFrames::None,
            driven: ros2.joints,
            clock: extra.clock,
            imu: extra.imu,
            diagnostics: Diagnostics::new(scenario, &namespace, extra.diagnostics),
            namespace,
            navigator: goals.map(Navigator::new),
            frames,
            _listeners: listeners,
            warn,
        })
    }

    /// The run begins anew: what was sent last is of another.
    pub(super) fn start_again(&mut self, scenario: &Scenario, controller: &AnyController) {
        self.frames.set(None);
        let is_elsewhere = scenario.start != self.messages.scenario().start;
        self.messages = self.start.messages(scenario, controller);
        let ExtraRates {
            clock,
            imu,
            diagnostics,
        } = self.start.extra;
        (self.clock, self.imu) = (clock, imu);
        self.diagnostics = Diagnostics::new(scenario, &self.namespace, diagnostics);
        if let Some(navigator) = &mut self.navigator {
            navigator.start_again();
            // The last one is kept for later readers.
            let _ = self.node.send(topic::PLAN, 0, &Path::none());
        }
        if is_elsewhere {
            // Only the ground around the start is described.
            self.describe();
        }
    }

    /// The twist of the drive to the last goal, if one goes on. A command of others that came after the goal ends it.
    pub(super) fn drive_to_goal(
        &mut self,
        simulation: &Simulation,
        requests: &Requests,
    ) -> Option<BodyTwist<f64>> {
        let navigator = self.navigator.as_mut()?;
        let poses = poses(simulation);
        let time_ns = simulation.time_ns();
        match navigator.step(time_ns, poses, requests.commanded()) {
            Wanted::Nothing => None,
            Wanted::Begin(plan) => {
                // What was commanded before the goal is over.
                requests.rest();
                let _ = self.node.send(topic::PLAN, time_ns, &plan);
                None
            }
            Wanted::Ended => {
                (self.warn)("/goal_pose: a command ended the drive to the goal");
                let _ = self.node.send(topic::PLAN, time_ns, &Path::none().at(time_ns));
                None
            }
            Wanted::Twist(twist) => Some(twist),
        }
    }

    /// Has another node subscribed to something since the last time?
    pub(super) fn take_subscribed(&self) -> bool {
        self.node.take_subscribed()
    }

    /// Messages that are sent once, and kept for later subscribers. Sending cannot fail: who is too slow misses
    /// messages.
    pub(super) fn describe(&mut self) {
        let _ = self.messages.describe(self.driven, &mut self.node);
        if !self.fixed_frames {
            return;
        }
        let fixed = TransformStamped {
            header: Header::new(0, BASE_LINK),
            child_frame_id: IMU_LINK.into(),
            transform: Transform {
                translation: Vector3::default(),
                rotation: Quaternion::default(),
            },
        };
        let message = TfMessage {
            transforms: vec![fixed],
        };
        let _ = self.node.send(topic::TF_STATIC, 0, &message);
    }

    /// From the next message on the run has another controller.
    pub(super) fn set_scenario(&mut self, scenario: &Scenario) {
        self.messages.set_scenario(scenario);
    }

    /// The messages of a control period, the time before what happened then.
    pub(super) fn push(&mut self, simulation: &Simulation) {
        let time_ns = simulation.time_ns();
        self.frames.set(Some(poses(simulation)));
        if self.clock.due(time_ns) {
            let clock = Time::from_ns(time_ns);
            let _ = self.node.send(topic::CLOCK, time_ns, &Clock { clock });
        }
        if self.imu.due(time_ns) {
            let _ = self.node.send(topic::IMU, time_ns, &imu(simulation));
        }
        if let Some(diagnostics) = self.diagnostics.push(simulation.period()) {
            let _ = self.node.send(topic::DIAGNOSTICS, time_ns, &diagnostics);
        }
        let _ = self.messages.push(simulation.period(), &mut self.node);
    }
}

/// Where the vehicle is.
fn poses(simulation: &Simulation) -> Poses {
    let seen = simulation.observation();
    Poses {
        in_map: seen.pose.planar(),
        by_odometry: seen.odometry.pose,
    }
}

/// Readings of the inertial measurement unit. Its attitude is not measured; how noisy its rates are is the scenario's,
/// which it does not know.
fn imu(simulation: &Simulation) -> Imu {
    let sensed = &simulation.sensed().imu;
    Imu {
        header: Header::new(simulation.time_ns(), IMU_LINK),
        orientation_covariance: NOT_MEASURED,
        angular_velocity: sensed.rate_rad_s.into(),
        linear_acceleration: sensed.specific_force_m_s2.into(),
        ..Imu::default()
    }
}
