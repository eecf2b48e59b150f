//! The run as viewers have it, over Foxglove's WebSocket protocol.

use std::sync::Arc;

use omni_config::Scenario;
use omni_sim::Simulation;
use omni_sim::controller::AnyController;

use super::Live;
use super::guard::Guard;
use super::hub::{Event, Hub, Topic};
use super::page::{self, Page};
use super::requests::{COMMAND_HOLDS, Requests};
use super::server::Server;
use super::warn::Warn;
use crate::Error;
use crate::messages::{Messages, Sink};
use crate::ros2::{
    self, JointState, Marker, MarkerArray, Odometry, RosMessage, Sensors, StringMessage, TfMessage,
    TwistStamped, VehicleState,
};
use crate::topic;

/// Everything that is served, in the order of the channels; signals that only one controller has are for logs.
const TOPICS: [fn() -> Topic; 10] = [
    || topic_of::<StringMessage>(topic::ROBOT_DESCRIPTION),
    || topic_of::<StringMessage>(topic::TERRAIN),
    || topic_of::<VehicleState>(topic::VEHICLE_STATE),
    || topic_of::<TfMessage>(topic::TF),
    || topic_of::<JointState>(topic::JOINT_STATES),
    || topic_of::<Odometry>(topic::ODOM),
    || topic_of::<Odometry>(topic::GROUND_TRUTH),
    || topic_of::<TwistStamped>(topic::CMD_VEL),
    || topic_of::<MarkerArray>(topic::MARKERS),
    || topic_of::<Sensors>(topic::SENSORS),
];

fn topic_of<M: RosMessage>(name: &'static str) -> Topic {
    Topic {
        name,
        encoding: "cdr",
        schema_name: M::TYPE,
        schema: M::schema(),
    }
}

/// The open port, and what is sent there.
pub(super) struct Viewers {
    server: Server,
    messages: Messages,
    served: Served,
    page: Page,
    requests: Arc<Requests>,
}

impl Viewers {
    /// Opens the port.
    pub(super) fn open(
        scenario: &Scenario,
        controller: &AnyController,
        (live, port): (&Live, u16),
        requests: &Arc<Requests>,
        warn: Warn,
    ) -> Result<Self, Error> {
        let guard = Guard::new(&live.origins, live.own_page).map_err(|value| omni_sim::Error::Argument {
            name: "--allow-origin",
            value,
            allowed: "an origin of web pages without a path, such as https://viewer.example:8080",
        })?;
        let topics = TOPICS.iter().map(|topic| topic()).chain(page::TOPICS);
        let topics: Vec<_> = topics.collect();
        let steering = (live.allow_control, guard);
        let server = Server::start(port, requests.clone(), &topics, steering, warn);
        let server = server.map_err(|error| Error::Live {
            port,
            reason: error.to_string(),
        })?;
        let served = Served {
            hub: server.hub.clone(),
            buffer: Vec::new(),
        };
        Ok(Self {
            server,
            messages: Messages::new(scenario, controller),
            served,
            page: Page::new(TOPICS.len()),
            requests: requests.clone(),
        })
    }

    /// Address of the port.
    pub(super) fn address(&self) -> String {
        format!("ws://127.0.0.1:{}", self.server.port)
    }

    /// Messages that are sent once. Sending cannot fail: who is too slow misses messages.
    pub(super) fn describe(&mut self) {
        let _ = self.messages.describe(None, &mut self.served);
        self.page.describe(self.messages.scenario(), &self.served.hub);
    }

    /// From the next message on the run has another controller; the description is sent to those that subscribe next.
    pub(super) fn set_scenario(&mut self, scenario: &Scenario) {
        self.messages.set_scenario(scenario);
    }

    /// The run begins anew: wheels and odometry of the messages, too, and what was marked on the ground is gone.
    pub(super) fn start_again(&mut self, scenario: &Scenario, controller: &AnyController) {
        let is_elsewhere = scenario.start != self.messages.scenario().start;
        self.messages = Messages::new(scenario, controller);
        let none = Marker {
            action: Marker::DELETE_ALL,
            ..Marker::default()
        };
        let markers = vec![none];
        let _ = self.served.send(topic::MARKERS, 0, &MarkerArray { markers });
        if is_elsewhere {
            // Only the ground around the start is described.
            self.describe();
        }
    }

    /// Informs all that a command ended by itself.
    pub(super) fn timed_out(&self) {
        self.served
            .hub
            .rests(&format!("no command for {} s", COMMAND_HOLDS.as_secs_f64()));
    }

    /// The messages of a control period.
    pub(super) fn push(&mut self, simulation: &Simulation) {
        if self.requests.take_subscribed() {
            // Latched in the sense of ROS: later subscribers also receive them.
            self.describe();
        }
        let _ = self.messages.push(simulation.period(), &mut self.served);
        self.page.push(&self.messages, simulation, &self.served.hub);
    }

    /// Lets clients have what is left, and closes the port.
    pub(super) fn close(self) {
        self.server.stop();
    }
}

/// Sends the run's messages to their subscribers.
struct Served {
    hub: Arc<Hub>,
    buffer: Vec<u8>,
}

impl Sink for Served {
    type Error = std::convert::Infallible;

    fn send<M: RosMessage>(
        &mut self,
        topic: &'static str,
        time_ns: u64,
        message: &M,
    ) -> Result<(), Self::Error> {
        let place = TOPICS.iter().position(|known| known().name == topic);
        if let Some(place) = place
            && self.hub.is_wanted(place)
            && ros2::encode_into(message, &mut self.buffer).is_ok()
        {
            let data = self.buffer.as_slice().into();
            self.hub.send(Event::Message(place, time_ns, data));
        }
        Ok(())
    }
}
