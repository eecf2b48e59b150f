//! Commands of other nodes, received on a separate thread, because checking a command may last longer than a control
//! period.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use byteorder::LittleEndian;
use omni_config::shortened_line;
use ros2_client::{Node, Subscription};

use super::joints::JointCommands;
use super::node::absolute;
use super::payload::{Whole, reliable, type_name};
use crate::live::requests::{ClientId, Requests};
use crate::ros2::{JointState, RosMessage, Twist, TwistStamped};
use crate::topic;

/// Time between two looks at what came.
const LOOK: Duration = Duration::from_millis(5);
/// Messages that are taken in one look: a flood of them must not keep the thread from its end.
const MOST: usize = 64;
/// Lines about rejected messages, in a run.
const MOST_LINES: usize = 20;
/// All of ROS 2 is one client.
const ROS: ClientId = 0;
/// Length of a twist \[bytes\]; a stamped one is longer. Subscriptions are matched by topic alone,
/// so that one receives both types.
const TWIST_BYTES: usize = 48;

/// Takes commands until it is stopped.
pub(super) struct Commands {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Commands {
    /// Twists for the vehicle, stamped and not.
    pub(super) fn of_base(
        node: &mut Node,
        namespace: &str,
        requests: Arc<Requests>,
        warn: Box<dyn Fn(&str) + Send + Sync>,
    ) -> Result<Self, String> {
        let types = [Twist::TYPE, TwistStamped::TYPE];
        Self::take(node, (namespace, topic::CMD_VEL), &types, warn, move |bytes| {
            requests.drive(ROS, twist(bytes)?, Instant::now())
        })
    }

    /// Velocities or torques for its wheels.
    pub(super) fn of_joints(
        node: &mut Node,
        namespace: &str,
        joints: Arc<JointCommands>,
        warn: Box<dyn Fn(&str) + Send + Sync>,
    ) -> Result<Self, String> {
        let types = [JointState::TYPE];
        Self::take(
            node,
            (namespace, topic::JOINT_COMMANDS),
            &types,
            warn,
            move |bytes| joints.take(&decoded(bytes)?, Instant::now()),
        )
    }

    fn take(
        node: &mut Node,
        (namespace, name): (&str, &'static str),
        types: &[&str],
        warn: Box<dyn Fn(&str) + Send + Sync>,
        taken: impl Fn(&[u8]) -> Result<(), String> + Send + 'static,
    ) -> Result<Self, String> {
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
        let over = Arc::new(AtomicBool::new(false));
        let ends = over.clone();
        // A line that is the last one again says nothing new: senders repeat themselves.
        let (mut lines, mut last) = (0, String::new());
        let listen = move || {
            while !ends.load(Ordering::Relaxed) {
                for subscription in &subscriptions {
                    for message in
                        std::iter::from_fn(|| subscription.take_seed(Whole).ok().flatten()).take(MOST)
                    {
                        if let Err(why) = taken(&message.0)
                            && lines < MOST_LINES
                            && why != last
                        {
                            lines += 1;
                            warn(&shortened_line(&format!("{name}: {why}")));
                            last = why;
                        }
                    }
                }
                std::thread::sleep(LOOK);
            }
        };
        let thread = std::thread::Builder::new()
            .name("ros2 commands".into())
            .spawn(listen)
            .map_err(|error| error.to_string())?;
        Ok(Self {
            over,
            thread: Some(thread),
        })
    }

    /// Takes nothing any more.
    pub(super) fn stop(self) {
        drop(self);
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
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

fn decoded<M: RosMessage + serde::de::DeserializeOwned>(bytes: &[u8]) -> Result<M, String> {
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
