//! A run that viewers watch, and steer if they may, while it goes on: the only room that names foxglove.
//!
//! The messages are those of a log, over Foxglove's WebSocket protocol. With [`Live::steer`], parameters, and
//! `geometry_msgs/msg/Twist` that a client publishes on `/cmd_vel`, change the run.

mod client;
mod guard;
mod requests;
mod server;

use std::cell::RefCell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use guard::Guard;
use omni_config::Scenario;
use omni_sim::controller::AnyController;
use omni_sim::{Outcome, Simulation, drive};
use requests::{COMMAND_HOLDS, Requests};
use server::{Event, Hub, Server, Topic};

use crate::Error;
use crate::messages::{Messages, Sink, topic};
use crate::record::End;
use crate::ros2::{
    self, JointState, MarkerArray, Odometry, RosMessage, StringMessage, TfMessage, TwistStamped, VehicleState,
};

/// Where and how fast a live run is, and what others may do to it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Live {
    /// Port on 127.0.0.1; 0 for any that is free.
    pub port: u16,
    /// Simulated seconds a second on the clock, 0.001 and more; infinity for as fast as it goes.
    pub speed: f64,
    /// Starts when the first client subscribes to something.
    pub wait: bool,
    /// Clients may change command, policy and torque limit; else they watch.
    pub steer: bool,
    /// Origins of web pages that may connect besides those of known viewers and of this machine, as `https://viewer.example`.
    pub origins: Vec<String>,
}

impl Live {
    /// A run on that port, 0 for any that is free, as fast as the clock: it starts at once, and others watch.
    ///
    /// ```
    /// let live = omni_log::Live::new(8765);
    /// assert_eq!((live.port, live.speed, live.steer), (8765, 1.0, false));
    /// ```
    #[must_use]
    pub fn new(port: u16) -> Self {
        Self {
            port,
            speed: 1.0,
            wait: false,
            steer: false,
            origins: Vec::new(),
        }
    }
}

/// Slowest run: an hour of it is then six weeks.
const SLOWEST: f64 = 1e-3;
/// How far ahead of the clock a run may be before it waits.
const AHEAD: Duration = Duration::from_millis(2);
/// Time between two looks for the first client, and at whether to go on.
const LOOK: Duration = Duration::from_millis(20);

/// Runs a scenario in step with the clock and serves it on 127.0.0.1. `started` is told the address, as `ws://127.0.0.1:8765`,
/// before the first period; `warn`, on any thread and at most 21 times, of connections that were refused; `watch` is called after
/// every control period with the part done, every 20 ms while the run waits for the clock, and, without a simulation, while it
/// waits for the first client: its error ends the run.
///
/// Connections come from programs that send no `Origin` and from pages of Foxglove, of Lichtblick, of this machine and of
/// [`Live::origins`]; their `Host` is this machine. Others are refused with status 403 and a reason. A handshake may take 10 s, and 16
/// clients may be there at a time.
///
/// With [`Live::steer`] clients may set the parameters `command.vx_m_s`, `command.vy_m_s`, `command.wz_rad_s` or publish a twist: from
/// then on the vehicle follows these, not the scenario. 0.5 s on the clock after the last of them, or when the client goes or
/// publishes no longer, the command is rest until another comes. `control.policy` and `vehicle.motor.stall_torque_n_m` are settings:
/// they stay when the client goes; the controller goes on from the state that it has. What is not allowed changes nothing, and the
/// client is told why.
///
/// # Errors
/// [`omni_sim::Error::Argument`] for a speed below 0.001 and for an origin that is none, [`Error::Live`] where the port cannot be had; as
/// [`omni_sim::run()`], and whatever `watch` returns.
///
/// ```
/// use omni_log::{Error, Live, run_live};
/// use omni_sim::config::{Override, Scenario};
/// let mut live = Live::new(0); // a free port
/// live.speed = f64::INFINITY;
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
/// let mut periods = 0;
/// let started = |address: &str| assert!(address.starts_with("ws://127.0.0.1:"));
/// let (_, ended) = run_live::<Error>(&scenario, &live, started, |warning| eprintln!("{warning}"), |simulation, _| {
///     periods += usize::from(simulation.is_some());
///     Ok(())
/// })?;
/// assert!(ended.is_none() && periods >= 100);
/// # Ok::<(), omni_log::Error>(())
/// ```
pub fn run_live<E: From<Error>>(
    scenario: &Scenario,
    live: &Live,
    started: impl FnOnce(&str),
    warn: impl Fn(&str) + Send + Sync + 'static,
    mut watch: impl FnMut(Option<&Simulation>, f64) -> Result<(), E>,
) -> Result<(Outcome, Option<omni_sim::Error>), E> {
    if live.speed.is_nan() || live.speed < SLOWEST {
        return Err(refused(omni_sim::Error::Argument {
            name: "--speed",
            value: live.speed.to_string(),
            allowed: "0.001 and more",
        }));
    }
    let guard = Guard::new(&live.origins).map_err(|value| {
        refused(omni_sim::Error::Argument {
            name: "--allow-origin",
            value,
            allowed: "an origin of web pages, as https://viewer.example:8080, without a path",
        })
    })?;
    let controller = AnyController::new(scenario).map_err(refused)?;
    let requests = Arc::new(Requests::new(scenario));
    let steering = (live.steer, guard);
    let server = Server::start(
        live.port,
        requests.clone(),
        &TOPICS.map(|topic| topic()),
        steering,
        Box::new(warn),
    );
    let server = server.map_err(|error| Error::Live {
        port: live.port,
        reason: error.to_string(),
    })?;
    let messages = Messages::new(scenario, &controller);
    let mut served = Served {
        hub: server.hub.clone(),
        buffer: Vec::new(),
    };
    started(&format!("ws://127.0.0.1:{}", server.port));
    while live.wait && !requests.take_subscribed() {
        if let Err(error) = watch(None, 0.0) {
            server.stop();
            return Err(error);
        }
        std::thread::sleep(LOOK);
    }
    // Sending cannot fail: who is too slow misses messages.
    let _ = messages.describe(&mut served);
    let start = Instant::now();
    let messages = RefCell::new(messages);
    let steer = |simulation: &mut Simulation| -> Result<_, omni_sim::Error> {
        if let Some(changed) = requests.take_changed() {
            simulation.take_control(&changed)?;
            // From the next message on; the description is sent to whoever subscribes next.
            messages.borrow_mut().describes(&changed);
        }
        if requests.time_out(Instant::now()) {
            server
                .hub
                .rests(&format!("no command for {} s", COMMAND_HOLDS.as_secs_f64()));
        }
        Ok(requests
            .command()
            .unwrap_or_else(|| simulation.scenario_command()))
    };
    let ended = drive(scenario, controller, steer, |simulation, part| {
        let mut messages = messages.borrow_mut();
        if requests.take_subscribed() {
            // Latched, as ROS has it: who comes later gets them too.
            let _ = messages.describe(&mut served);
        }
        let _ = messages.push(simulation.sample(), simulation.observation(), &mut served);
        let due = Duration::try_from_secs_f64(simulation.time_ns() as f64 * 1e-9 / live.speed);
        let due = due.unwrap_or(Duration::MAX);
        loop {
            watch(Some(simulation), part).map_err(End)?;
            let ahead = due.saturating_sub(start.elapsed());
            if ahead <= AHEAD {
                return Ok(());
            }
            std::thread::sleep(ahead.min(LOOK));
        }
    });
    server.stop();
    ended.map_err(|End(error)| error)
}

/// An error of the simulation, as the caller has it.
fn refused<E: From<Error>>(error: omni_sim::Error) -> E {
    Error::from(error).into()
}

/// Everything that is served, in the order of the channels; signals that only one controller has are for logs.
const TOPICS: [fn() -> Topic; 9] = [
    || topic_of::<StringMessage>(topic::ROBOT_DESCRIPTION),
    || topic_of::<StringMessage>(topic::TERRAIN),
    || topic_of::<VehicleState>(topic::VEHICLE_STATE),
    || topic_of::<TfMessage>(topic::TF),
    || topic_of::<JointState>(topic::JOINT_STATES),
    || topic_of::<Odometry>(topic::ODOM),
    || topic_of::<Odometry>(topic::GROUND_TRUTH),
    || topic_of::<TwistStamped>(topic::CMD_VEL),
    || topic_of::<MarkerArray>(topic::MARKERS),
];

fn topic_of<M: RosMessage>(name: &'static str) -> Topic {
    Topic {
        name,
        schema_name: M::TYPE,
        schema: M::schema(),
    }
}

/// Where the run's messages go: to whoever wants them.
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
