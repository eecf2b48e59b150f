//! The frames of a log, in the world frame.

use std::collections::{BTreeMap, BTreeSet};

use omni_config::Vehicle;

use crate::ros2::{TfMessage, TransformStamped};
use crate::rotation::{after, rotate};
use crate::urdf::{BASE_LINK, ODOM_LINK, WORLD_LINK, link_name, wheel_link};

/// A pose: x, y, z \[m\] and the unit quaternion x, y, z, w.
pub(crate) type Pose = [f64; 7];
/// Poses of frames by name, one a message.
type Poses = BTreeMap<String, Vec<Pose>>;

/// Most frames of a vehicle: odometry's, 16 bodies and 8 wheels.
const MOST_FRAMES: usize = 25;

/// A link of the tree, as every message has it.
struct Link {
    parent: String,
    child: String,
    /// Which of the links before it carries it; none if that is the world, or not there.
    carrier: Option<usize>,
    poses: Vec<Pose>,
}

/// Frames in the world, message after message: all of them hold the same links, so that none needs more memory than its
/// message.
#[derive(Default)]
pub(crate) struct Frames {
    times_s: Vec<f64>,
    links: Vec<Link>,
}

impl Frames {
    /// Adds a message; in it a parent comes before its children. Says where it has other links than those before.
    pub(crate) fn add(&mut self, time_ns: u64, message: TfMessage) -> Result<(), String> {
        let transforms = message.transforms;
        let said = |what: &str| {
            let (time_s, count) = (time_ns as f64 / 1e9, transforms.len());
            Err(format!("/tf at t = {time_s} s: {count} frames, {what}"))
        };
        if transforms.len() > MOST_FRAMES {
            return said(&format!("allowed: {MOST_FRAMES} at most"));
        }
        if self.times_s.is_empty() {
            for (i, link) in transforms.iter().enumerate() {
                let (parent, child) = (&link.header.frame_id, &link.child_frame_id);
                self.links.push(Link {
                    carrier: self.links[..i].iter().rposition(|before| before.child == *parent),
                    parent: parent.clone(),
                    child: child.clone(),
                    poses: Vec::new(),
                });
            }
        }
        let same = |(own, link): (&Link, &TransformStamped)| {
            own.parent == link.header.frame_id && own.child == link.child_frame_id
        };
        if transforms.len() != self.links.len() || !self.links.iter().zip(&transforms).all(same) {
            return said("other frames than in the first message");
        }
        let row = self.times_s.len();
        self.times_s.push(time_ns as f64 / 1e9);
        for (i, link) in transforms.iter().enumerate() {
            let (t, q) = (&link.transform.translation, &link.transform.rotation);
            let local = [t.x, t.y, t.z, q.x, q.y, q.z, q.w];
            let pose = match self.links[i].carrier {
                Some(carrier) => placed(self.links[carrier].poses[row], local),
                None if self.links[i].parent == WORLD_LINK => local,
                None => [f64::NAN; 7],
            };
            self.links[i].poses.push(pose);
        }
        Ok(())
    }

    /// Times \[s\] and poses by name, if they are the vehicle's; nothing if no message was there.
    pub(crate) fn of(self, vehicle: &Vehicle) -> Result<(Vec<f64>, Poses), String> {
        let wheels = vehicle.wheel.iter().map(|wheel| wheel_link(&wheel.name));
        let bodies = vehicle
            .hinge
            .iter()
            .map(|hinge| link_name(vehicle, &hinge.child).to_owned());
        let always = [BASE_LINK.to_owned(), ODOM_LINK.to_owned()];
        let own: BTreeSet<String> = bodies.chain(wheels).chain(always).collect();
        let count = self.links.len();
        let frames: BTreeMap<_, _> = self
            .links
            .into_iter()
            .map(|link| (link.child, link.poses))
            .collect();
        // A log of before /ground_truth/odom has no frame of odometry.
        let of_before = own.iter().filter(|name| *name != ODOM_LINK);
        let fits = count == frames.len() && (frames.keys().eq(&own) || frames.keys().eq(of_before));
        if self.times_s.is_empty() || fits {
            return Ok((self.times_s, frames));
        }
        let own: Vec<_> = own.into_iter().collect();
        Err(match frames.keys().find(|name| !own.contains(name)) {
            Some(name) => format!("/tf: frame {name:?}, allowed: {}", own.join(", ")),
            None => format!("/tf: {count} frames, allowed: {}, each once", own.join(", ")),
        })
    }
}

/// A pose in the frame that `carrier` is the pose of.
pub(crate) fn placed([x, y, z, a, b, c, w]: [f64; 7], [px, py, pz, d, e, f, v]: [f64; 7]) -> [f64; 7] {
    let [dx, dy, dz] = rotate([a, b, c, w], [px, py, pz]);
    let [d, e, f, v] = after([a, b, c, w], [d, e, f, v]);
    [x + dx, y + dy, z + dz, d, e, f, v]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::Header;
    use omni_config::Scenario;

    fn message(links: &[(&str, &str)]) -> TfMessage {
        let link = |(parent, child): &(&str, &str)| TransformStamped {
            header: Header::new(0, *parent),
            child_frame_id: (*child).to_owned(),
            ..TransformStamped::default()
        };
        TfMessage {
            transforms: links.iter().map(link).collect(),
        }
    }

    #[test]
    fn frames_that_come_and_go_are_refused_before_they_take_memory() {
        let mut frames = Frames::default();
        assert_eq!(frames.add(0, message(&[])), Ok(()));
        for time in 1..1000 {
            assert_eq!(frames.add(time, message(&[])), Ok(()));
        }
        let said = frames
            .add(20_000_000, message(&[("world", "x")]))
            .expect_err("refused");
        assert_eq!(
            said,
            "/tf at t = 0.02 s: 1 frames, other frames than in the first message"
        );
        assert!(frames.links.is_empty());
    }

    #[test]
    fn frames_are_the_vehicles_each_once() {
        let scenario = Scenario::load("flat", &[]).expect("built-in");
        let own: Vec<String> = {
            let said = Frames {
                times_s: vec![0.0],
                links: Vec::new(),
            }
            .of(scenario.vehicle())
            .expect_err("none");
            let (said, names) = said.split_once(", allowed: ").expect("names");
            assert_eq!(said, "/tf: 0 frames");
            names
                .trim_end_matches(", each once")
                .split(", ")
                .map(String::from)
                .collect()
        };
        assert_eq!(own.len(), scenario.vehicle().body.len() + 7 + 1);
        let mut links: Vec<(&str, &str)> = own.iter().map(|name| ("world", name.as_str())).collect();
        let of = |links: &[(&str, &str)]| {
            let mut frames = Frames::default();
            frames.add(0, message(links)).expect("the first");
            frames.of(scenario.vehicle()).map(|(_, frames)| frames.len())
        };
        assert_eq!(of(&links), Ok(own.len()));
        let before: Vec<_> = links
            .iter()
            .copied()
            .filter(|(_, name)| *name != "odom")
            .collect();
        assert_eq!(of(&before), Ok(own.len() - 1));
        links.push(("world", "base_link"));
        assert!(
            of(&links)
                .expect_err("twice")
                .starts_with(&format!("/tf: {} frames, allowed: ", own.len() + 1))
        );
        links.push(("world", "a_frame_of_others"));
        assert!(
            of(&links)
                .expect_err("foreign")
                .starts_with("/tf: frame \"a_frame_of_others\", allowed: base_link")
        );
    }
}
