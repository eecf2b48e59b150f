//! The data of the page of a live run as JSON: the scene once, its state 30 times per second.

use std::time::{Duration, Instant};

use omni_config::{POLICIES, Scenario, policy_in_a_line};
use omni_sim::Simulation;
use serde::Serialize;

use super::hub::{Event, Hub, Topic};
use crate::messages::Messages;
use crate::scene;

/// Time between two states.
const EVERY: Duration = Duration::from_millis(33);

/// The scene, what its policies do, and whether this page may control.
#[derive(Serialize)]
struct SceneMessage<'a> {
    #[serde(flatten)]
    scene: scene::Scene<'a>,
    policies_in_a_line: [&'a str; POLICIES.len()],
    allow_control: bool,
}

/// The page's topics, which viewers may also use.
pub(super) const TOPICS: [Topic; 2] = [json("/page/scene"), json("/page/state")];

const fn json(name: &'static str) -> Topic {
    Topic {
        name,
        encoding: "json",
        schema_name: "",
        schema: "",
    }
}

/// Sends to the page, on the topics `first` and the one behind it.
pub(super) struct Page {
    first: usize,
    due: Option<Instant>,
}

impl Page {
    pub(super) fn new(first: usize) -> Self {
        Self { first, due: None }
    }

    /// The scene, for a new client.
    pub(super) fn describe(&self, scenario: &Scenario, hub: &Hub) {
        if hub.is_wanted(self.first) {
            let message = SceneMessage {
                scene: scene::scene(scenario),
                policies_in_a_line: POLICIES.map(policy_in_a_line),
                allow_control: hub.allow_control,
            };
            send(hub, self.first, 0, &message);
        }
    }

    /// The state after a period, if it is due.
    pub(super) fn push(&mut self, messages: &Messages, simulation: &Simulation, hub: &Hub) {
        let (now, state_of) = (Instant::now(), self.first + 1);
        if self.due.is_some_and(|due| now < due) || !hub.is_wanted(state_of) {
            return;
        }
        self.due = Some(now + EVERY);
        send(
            hub,
            state_of,
            simulation.time_ns(),
            &scene::state(messages, simulation),
        );
    }
}

fn send(hub: &Hub, topic: usize, time_ns: u64, what: &impl Serialize) {
    let data = scene::json(what).into_bytes();
    hub.send(Event::Message(topic, time_ns, data.into()));
}
