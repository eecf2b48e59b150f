//! A run that viewers watch and steer while it goes on: the only room that names foxglove.
//!
//! The messages are those of a log, over Foxglove's WebSocket protocol. Parameters, and `geometry_msgs/msg/Twist` that a client
//! publishes on `/cmd_vel`, change the run.

mod desk;

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use foxglove::websocket::Capability;
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServerHandle};

use crate::config::Scenario;
use crate::controller::AnyController;
use crate::log::ros2::{
    self, JointState, MarkerArray, Odometry, RosMessage, StringMessage, TfMessage, TwistStamped, VehicleState,
};
use crate::log::{Messages, Sink, topic};
use crate::run::drive;
use crate::{Error, Outcome, Simulation};
use desk::{Desk, Said};

/// Where and how fast a live run is.
#[derive(Clone, Copy, Debug)]
pub struct Live {
    /// Port on 127.0.0.1; 0 for any that is free.
    pub port: u16,
    /// Simulated seconds a second on the clock, 0.001 and more; infinity for as fast as it goes.
    pub speed: f64,
    /// Starts when the first client subscribes to something.
    pub wait: bool,
}

/// Slowest run: an hour of it is then six weeks.
const SLOWEST: f64 = 1e-3;
/// How far ahead of the clock a run may be before it waits.
const AHEAD: Duration = Duration::from_millis(2);
/// Time between two looks for the first client.
const LOOK: Duration = Duration::from_millis(20);

/// Runs a scenario in step with the clock and serves it on 127.0.0.1. `started` is told the address, as `ws://127.0.0.1:8765`,
/// before the first period; `watch` is called after every control period with the part done.
///
/// Clients may set the parameters `command.vx_m_s`, `command.vy_m_s`, `command.wz_rad_s` (from then on the vehicle follows these,
/// not the scenario), `control.policy` and `vehicle.motor.stall_torque_n_m`; the controller goes on from the state that it has.
/// What is not allowed changes nothing, and the client is told why.
///
/// # Errors
/// [`Error::Argument`] for a speed below 0.001, [`Error::Live`] where the port cannot be had; as [`crate::run()`], and
/// whatever `watch` returns.
pub fn run_live<E: From<Error>>(
    scenario: &Scenario,
    live: Live,
    started: impl FnOnce(&str),
    mut watch: impl FnMut(&Simulation, f64) -> Result<(), E>,
) -> Result<(Outcome, Option<Error>), E> {
    if live.speed.is_nan() || live.speed < SLOWEST {
        return Err(E::from(Error::Argument {
            name: "--speed",
            value: live.speed.to_string(),
            allowed: "0.001 and more",
        }));
    }
    let controller = AnyController::new(scenario)?;
    let desk = Arc::new(Desk::new(scenario));
    let mut server = Server::start(live.port, &desk)?;
    server.advertise();
    let messages = Messages::new(scenario);
    let address = format!("ws://127.0.0.1:{}", server.handle.port());
    started(&address);
    while live.wait && !desk.take_subscribed() {
        server.say(desk.take_said());
        std::thread::sleep(LOOK);
    }
    // Sending cannot fail: who is too slow misses messages.
    let _ = messages.describe(&mut server);
    let start = Instant::now();
    let messages = RefCell::new(messages);
    let steer = |simulation: &mut Simulation| {
        if let Some(changed) = desk.take_changed() {
            simulation.take_control(&changed)?;
            // From the next message on; the description is sent to whoever subscribes next.
            messages.borrow_mut().describes(&changed);
        }
        Ok(desk.command().unwrap_or_else(|| simulation.scenario_command()))
    };
    let ended = drive(scenario, controller, steer, |simulation, part| {
        let mut messages = messages.borrow_mut();
        if desk.take_subscribed() {
            // Latched, as ROS has it: who comes later gets them too.
            let _ = messages.describe(&mut server);
        }
        let _ = messages.push(simulation.sample(), simulation.observation(), &mut server);
        server.say(desk.take_said());
        let due = Duration::try_from_secs_f64(simulation.time_ns() as f64 * 1e-9 / live.speed);
        let ahead = due.unwrap_or(Duration::MAX).saturating_sub(start.elapsed());
        if ahead > AHEAD {
            std::thread::sleep(ahead);
        }
        watch(simulation, part)
    });
    server.handle.stop().wait_blocking();
    ended
}

/// The server and its channels.
struct Server {
    handle: WebSocketServerHandle,
    context: Arc<Context>,
    channels: HashMap<&'static str, Arc<RawChannel>>,
    buffer: Vec<u8>,
}

impl Server {
    fn start(port: u16, desk: &Arc<Desk>) -> Result<Self, Error> {
        let context = Context::new();
        let handle = foxglove::WebSocketServer::new()
            .name(concat!("omnistep ", env!("CARGO_PKG_VERSION")))
            .bind("127.0.0.1", port)
            .capabilities([Capability::ClientPublish, Capability::Parameters])
            .supported_encodings(["cdr", "json"])
            .listener(desk.clone())
            .parameter_handler(desk.clone())
            .context(&context)
            .start_blocking()
            .map_err(|error| Error::Live {
                port,
                reason: error.to_string(),
            })?;
        Ok(Self {
            handle,
            context,
            channels: HashMap::new(),
            buffer: Vec::new(),
        })
    }

    /// Tells every client what became of its requests.
    fn say(&self, said: Vec<Said>) {
        for said in said {
            match said {
                Said::Refused(why) => self
                    .handle
                    .publish_status(foxglove::websocket::Status::error(why)),
                Said::Set(parameters) => self.handle.publish_parameter_values(parameters),
            }
        }
    }
}

impl Server {
    /// The channel of a topic, advertised from then on; none where it cannot be made, which no topic of ours is.
    fn channel<M: RosMessage>(&mut self, topic: &'static str) -> Option<Arc<RawChannel>> {
        if let Some(channel) = self.channels.get(topic) {
            return Some(channel.clone());
        }
        let schema = Schema::new(M::TYPE, "ros2msg", M::schema().as_bytes());
        let builder = ChannelBuilder::new(topic).message_encoding("cdr").schema(schema);
        let built = builder.context(&self.context).build_raw().ok()?;
        self.channels.insert(topic, built.clone());
        Some(built)
    }

    /// Advertises every topic: clients subscribe before the first message.
    fn advertise(&mut self) {
        self.channel::<StringMessage>(topic::ROBOT_DESCRIPTION);
        self.channel::<StringMessage>(topic::TERRAIN);
        self.channel::<VehicleState>(topic::VEHICLE_STATE);
        self.channel::<TfMessage>(topic::TF);
        self.channel::<JointState>(topic::JOINT_STATES);
        self.channel::<Odometry>(topic::ODOM);
        self.channel::<TwistStamped>(topic::CMD_VEL);
        self.channel::<MarkerArray>(topic::MARKERS);
    }
}

impl Sink for Server {
    type Error = std::convert::Infallible;

    fn send<M: RosMessage>(
        &mut self,
        topic: &'static str,
        time_ns: u64,
        message: &M,
    ) -> Result<(), Self::Error> {
        if let Some(channel) = self.channel::<M>(topic)
            && channel.has_sinks()
            && ros2::encode_into(message, &mut self.buffer).is_ok()
        {
            let log_time = Some(time_ns);
            channel.log_with_meta(&self.buffer, PartialMetadata { log_time });
        }
        Ok(())
    }
}
