//! Commands and goals of other nodes, received on separate threads, because checking a command and planning a way may
//! last longer than a control period.

use std::sync::Arc;
use std::time::Instant;

use byteorder::LittleEndian;
use omni_config::shortened_line;
use ros2_client::{Node, Subscription};

use super::goals::Goals;
use super::joints::JointCommands;
use super::listener::{Listener, MOST};
use super::node::absolute;
use super::payload::{Whole, reliable, type_name};
use super::placement::Placement;
use crate::live::requests::{ClientId, Requests};
use crate::live::warn::Warn;
use crate::ros2::{JointState, PoseStamped, PoseWithCovarianceStamped, RosMessage, Twist, TwistStamped};
use crate::topic;

/// Lines about rejected messages, in a run.
const MOST_LINES: usize = 20;
/// All of ROS 2 is one client.
const ROS: ClientId = 0;
/// Length of a twist \[bytes\]; a stamped one is longer. Subscriptions are matched by topic alone,
/// so that one receives both types.
const TWIST_BYTES: usize = 48;

/// Takes twists for the vehicle, stamped and not, until the listener is dropped.
pub(super) fn take_twists(
    node: &mut Node,
    namespace: &str,
    requests: Arc<Requests>,
    warn: Warn,
) -> Result<Listener, String> {
    let types = [Twist::TYPE, TwistStamped::TYPE];
    take(
        node,
        (namespace, topic::CMD_VEL),
        (&types, false),
        warn,
        move |bytes| requests.drive(ROS, twist(bytes)?, Instant::now()),
    )
}

/// Takes velocities or torques for its wheels.
pub(super) fn take_joints(
    node: &mut Node,
    namespace: &str,
    joints: Arc<JointCommands>,
    warn: Warn,
) -> Result<Listener, String> {
    let (name, types) = ((namespace, topic::JOINT_COMMANDS), [JointState::TYPE]);
    take(node, name, (&types, false), warn, move |bytes| {
        joints.take(&decoded(bytes)?, Instant::now())
    })
}

/// Takes goals, and plans the way to them.
pub(super) fn take_goals(
    node: &mut Node,
    namespace: &str,
    goals: Arc<Goals>,
    warn: Warn,
) -> Result<Listener, String> {
    let (name, types) = ((namespace, topic::GOAL_POSE), [PoseStamped::TYPE]);
    take(node, name, (&types, true), warn, move |bytes| {
        goals.take(&decoded(bytes)?)
    })
}

/// Takes poses to place the vehicle at.
pub(super) fn take_places(
    node: &mut Node,
    namespace: &str,
    placement: Placement,
    warn: Warn,
) -> Result<Listener, String> {
    let (name, types) = (
        (namespace, topic::INITIAL_POSE),
        [PoseWithCovarianceStamped::TYPE],
    );
    take(node, name, (&types, true), warn, move |bytes| {
        placement.take(&decoded(bytes)?)
    })
}

/// A topic in a namespace, of one of these types. Of the newest alone where one replaces those before: a way is planned
/// for up to seconds, and who asks again is answered again.
fn take(
    node: &mut Node,
    (namespace, name): (&str, &'static str),
    (types, newest): (&[&str], bool),
    warn: Warn,
    taken: impl Fn(&[u8]) -> Result<(), String> + Send + 'static,
) -> Result<Listener, String> {
    let mut subscriptions = Vec::new();
    for full_type in types {
        let topic = node
            .create_topic(&absolute(namespace, name)?, type_name(full_type), &reliable())
            .map_err(|error| error.to_string())?;
        let subscription: Subscription<Vec<u8>> = node
            .create_subscription(&topic, Some(reliable()))
            .map_err(|error| error.to_string())?;
        subscriptions.push(subscription);
    }
    // A line that is the last one again says nothing new: senders repeat themselves.
    let (mut lines, mut last) = (0, String::new());
    let mut refuse = move |last: &mut String, why: String| {
        if lines < MOST_LINES && why != *last {
            lines += 1;
            warn(&shortened_line(&format!("{name}: {why}")));
            *last = why;
        }
    };
    Listener::start(&format!("ros2 {name}"), move || {
        for subscription in &subscriptions {
            let came = std::iter::from_fn(|| subscription.take_seed(Whole).ok().flatten());
            let came = came.take(MOST);
            let came: Vec<_> = if newest {
                came.last().into_iter().collect()
            } else {
                came.collect()
            };
            for message in came {
                match taken(&message.0) {
                    Ok(()) if newest => last.clear(),
                    Ok(()) => {}
                    Err(why) => refuse(&mut last, why),
                }
            }
        }
    })
}

/// The twist of a message of either type: vx, vy \[m/s\] and wz \[rad/s\].
fn twist(bytes: &[u8]) -> Result<[f64; 3], String> {
    let twist = if bytes.len() <= TWIST_BYTES {
        decoded::<Twist>(bytes)?
    } else {
        decoded::<TwistStamped>(bytes)?.twist
    };
    Ok([twist.linear.x, twist.linear.y, twist.angular.z])
}

pub(super) fn decoded<M: RosMessage + serde::de::DeserializeOwned>(bytes: &[u8]) -> Result<M, String> {
    let decoded = cdr_encoding::from_bytes::<M, LittleEndian>(bytes);
    decoded
        .map(|(message, _)| message)
        .map_err(|error| format!("not a {}: {error}", M::TYPE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::{HEADER, Header, Vector3, encode};

    fn ahead() -> Twist {
        Twist {
            linear: Vector3 {
                x: 0.3,
                y: -0.1,
                z: 9.0,
            },
            angular: Vector3 {
                x: 9.0,
                y: 9.0,
                z: 0.5,
            },
        }
    }

    #[test]
    fn a_twist_is_taken_with_and_without_a_stamp() {
        let plain = encode(&ahead()).expect("cdr");
        assert_eq!(plain.len() - HEADER, TWIST_BYTES);
        assert_eq!(twist(&plain[HEADER..]), Ok([0.3, -0.1, 0.5]));
        for frame in ["", "base_link", "a frame of a long name"] {
            let stamped = TwistStamped {
                header: Header::new(1, frame),
                twist: ahead(),
            };
            let bytes = encode(&stamped).expect("cdr");
            assert_eq!(twist(&bytes[HEADER..]), Ok([0.3, -0.1, 0.5]), "{frame}");
        }
    }

    #[test]
    fn what_is_no_twist_is_refused_at_every_length() {
        let stamped = TwistStamped {
            header: Header::new(1, "base_link"),
            twist: ahead(),
        };
        let bytes = encode(&stamped).expect("cdr");
        let whole = &bytes[HEADER..];
        for length in (0..whole.len()).filter(|length| *length != TWIST_BYTES) {
            assert!(twist(&whole[..length]).is_err(), "{length} bytes");
        }
    }
}
