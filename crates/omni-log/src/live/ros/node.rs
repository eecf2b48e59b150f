//! The node and what it publishes.

use std::sync::Arc;

use ros2_client::builtin_interfaces::Time;
use ros2_client::dds::rustdds::dds::statusevents::DomainParticipantStatusEvent;
use ros2_client::dds::rustdds::{StatusEvented, Topic};
use ros2_client::log::LogLevel;
use ros2_client::{Context, ContextOptions, Name, NodeName, NodeOptions, Publisher, QosProfile, RosoutRaw};

use super::payload::{Cdr, latched, reliable, type_name};
use crate::Error;
use crate::live::warn::Warn;
use crate::messages::Sink;
use crate::ros2::{
    self, Clock, DiagnosticArray, Imu, JointState, Odometry, Path, RosMessage, StringMessage, TfMessage,
    VehicleState,
};
use crate::topic;
use crate::urdf::MAP_LINK;

/// Name of the node.
const NODE: &str = "omnistep";

/// A topic, its type, and whether its last message is kept for who comes later.
type Published = (&'static str, &'static str, bool);

/// Everything that is published.
const TOPICS: [Published; 12] = [
    (topic::CLOCK, Clock::TYPE, false),
    (topic::ROBOT_DESCRIPTION, StringMessage::TYPE, true),
    (topic::TERRAIN, StringMessage::TYPE, true),
    (topic::TF_STATIC, TfMessage::TYPE, true),
    (topic::VEHICLE_STATE, VehicleState::TYPE, false),
    (topic::TF, TfMessage::TYPE, false),
    (topic::JOINT_STATES, JointState::TYPE, false),
    (topic::ODOM, Odometry::TYPE, false),
    (topic::GROUND_TRUTH, Odometry::TYPE, false),
    (topic::IMU, Imu::TYPE, false),
    (topic::DIAGNOSTICS, DiagnosticArray::TYPE, false),
    (topic::PLAN, Path::TYPE, true),
];

/// Joins a domain with a node that has no parameters.
pub(super) fn join(domain: u16, namespace: &str) -> Result<(ros2_client::Node, Context), Error> {
    let failed = |reason: String| Error::Ros2 { domain, reason };
    let options = ContextOptions::new().domain_id(domain);
    let context = Context::with_options(options).map_err(|error| failed(error.to_string()))?;
    let name = NodeName::new(namespace, NODE).map_err(|error| failed(error.to_string()))?;
    let options = NodeOptions::new()
        .enable_rosout(true)
        .start_parameter_services(false);
    let node = context.new_node(name, options);
    Ok((node.map_err(|error| failed(error.to_string()))?, context))
}

/// Says a line on `/rosout`, too, as a warning at the time of the clock.
pub(super) fn with_rosout(node: &ros2_client::Node, namespace: &str, warn: &Warn) -> Warn {
    let (log, warn) = (node.logging_handle(), warn.clone());
    // As ROS names the log of a node.
    let name = format!("{namespace}/{NODE}")
        .trim_start_matches('/')
        .replace('/', ".");
    Arc::new(move |line| {
        warn(line);
        log.rosout_raw(Time::now(), LogLevel::Warn, &name, line, "", "", 0);
    })
}

/// A topic in a namespace; the time is everybody's, and diagnostics are named by their nodes.
pub(super) fn absolute(namespace: &str, topic: &str) -> Result<Name, String> {
    let full = if [topic::CLOCK, topic::DIAGNOSTICS].contains(&topic) {
        topic.to_owned()
    } else {
        format!("{}{topic}", namespace.trim_end_matches('/'))
    };
    Name::parse(&full).map_err(|error| error.to_string())
}

/// What publishes a topic.
struct Outlet {
    name: &'static str,
    topic: Topic,
    qos: QosProfile,
    publisher: Publisher<Cdr>,
}

/// A node with everything that it publishes.
pub(super) struct Node {
    outlets: Vec<Outlet>,
    events: ros2_client::dds::rustdds::DomainParticipantStatusListener,
    buffer: Vec<u8>,
    /// Stands before the names of frames.
    prefix: String,
    node: ros2_client::Node,
    _context: Context,
}

impl Node {
    pub(super) fn new(
        mut node: ros2_client::Node,
        context: Context,
        namespace: &str,
        prefix: &str,
    ) -> Result<Self, String> {
        let mut outlets = Vec::new();
        // Vehicles with frames of their own share the topics of frames.
        let shared = |name| !prefix.is_empty() && [topic::TF, topic::TF_STATIC].contains(&name);
        for (name, full_type, keeps) in TOPICS {
            let namespace = if shared(name) { "/" } else { namespace };
            let qos = if keeps { latched() } else { reliable() };
            let topic = node
                .create_topic(&absolute(namespace, name)?, type_name(full_type), &qos)
                .map_err(|error| error.to_string())?;
            let publisher = node
                .create_publisher(&topic, Some(qos.clone()))
                .map_err(|error| error.to_string())?;
            outlets.push(Outlet {
                name,
                topic,
                qos,
                publisher,
            });
        }
        Ok(Self {
            outlets,
            events: context.domain_participant().status_listener(),
            buffer: Vec::new(),
            prefix: prefix.into(),
            node,
            _context: context,
        })
    }

    /// Has a client subscribed to one of its topics since the last call?
    pub(super) fn take_subscribed(&self) -> bool {
        let mut subscribed = false;
        while let Some(event) = self.events.try_recv_status() {
            if let DomainParticipantStatusEvent::RemoteReaderMatched { local_writer, .. } = event {
                subscribed |= self
                    .outlets
                    .iter()
                    .any(|outlet| outlet.publisher.guid() == local_writer);
            }
        }
        subscribed
    }
}

/// The message with a prefix before its frames, as several vehicles on one `/tf` need. `map` keeps its name: it is
/// where these vehicles meet.
fn with_prefix<M: RosMessage>(message: &M, prefix: &str) -> M {
    let mut own = message.clone();
    for frame in own.frames() {
        if !frame.is_empty() && frame != MAP_LINK {
            frame.insert_str(0, prefix);
        }
    }
    own
}

impl Sink for Node {
    type Error = std::convert::Infallible;

    fn send<M: RosMessage>(&mut self, topic: &'static str, _: u64, message: &M) -> Result<(), Self::Error> {
        let prefixed = (!self.prefix.is_empty()).then(|| with_prefix(message, &self.prefix));
        let message = prefixed.as_ref().unwrap_or(message);
        let outlet = self.outlets.iter_mut().find(|outlet| outlet.name == topic);
        if let Some(outlet) = outlet
            && ros2::encode_into(message, &mut self.buffer).is_ok()
        {
            // The library writes the header of its encapsulation, which is the same.
            let body = self.buffer.get(ros2::HEADER..).unwrap_or_default();
            // The library keeps 8192 messages for a reader that wants all and takes none, and then
            // it sends none to anybody: the topic begins anew for all of them.
            if outlet.publisher.publish(Cdr(body.to_vec())).is_err()
                && let Ok(anew) = self
                    .node
                    .create_publisher(&outlet.topic, Some(outlet.qos.clone()))
            {
                outlet.publisher = anew;
                let _ = outlet.publisher.publish(Cdr(body.to_vec()));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::{Header, TransformStamped};

    #[test]
    fn a_prefix_is_before_every_frame_but_the_map_and_one_that_is_unused() {
        let between = |parent: &str, child: &str| TransformStamped {
            header: Header::new(0, parent),
            child_frame_id: child.into(),
            ..TransformStamped::default()
        };
        let frames = TfMessage {
            transforms: vec![between("map", "odom"), between("odom", "base_link")],
        };
        let named = with_prefix(&frames, "robot1/");
        assert_eq!(
            named.transforms,
            [
                between("map", "robot1/odom"),
                between("robot1/odom", "robot1/base_link")
            ]
        );
        let odometry = Odometry {
            header: Header::new(0, "world"),
            child_frame_id: "base_link".into(),
            ..Odometry::default()
        };
        let named = with_prefix(&odometry, "robot1/");
        assert_eq!(
            [named.header.frame_id, named.child_frame_id],
            ["robot1/world", "robot1/base_link"]
        );
        let unused = JointState::default();
        assert_eq!(with_prefix(&unused, "robot1/"), unused);
        let imu = Imu {
            header: Header::new(0, "imu_link"),
            ..Imu::default()
        };
        assert_eq!(with_prefix(&imu, "a_").header.frame_id, "a_imu_link");
        let state = VehicleState {
            header: Header::new(0, "base_link"),
            ..VehicleState::default()
        };
        assert_eq!(with_prefix(&state, "b/").header.frame_id, "b/base_link");
    }
}
