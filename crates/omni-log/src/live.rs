//! A run served in real time to viewers and to ROS 2, which may steer it (features `live`, `ros2`).
//!
//! The messages are the messages of a log, which may be written at the same time.

mod client;
mod controls;
mod guard;
mod http;
mod hub;
mod options;
mod pacer;
mod page;
mod pilot;
mod requests;
#[cfg(feature = "ros2")]
mod ros;
mod server;
#[cfg(test)]
mod tests;
mod viewers;
mod warn;

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use controls::Controls;
use omni_config::Scenario;
use omni_core::BodyTwist;
use omni_sim::controller::AnyController;
use omni_sim::{Outcome, Run, Simulation, control_periods};
pub use options::{Live, Opened, Until};
use pacer::Pacer;
pub use pilot::Pilot;
use requests::{ClientId, Requests};
#[cfg(feature = "ros2")]
use ros::OnRos;
#[cfg(feature = "ros2")]
pub use ros::{GoalPlanner, Ros2, TfFrames};
use viewers::Viewers;
use warn::Warn;

use crate::{Error, RunLog};

/// Slowest run: an hour of it is then six weeks.
const SLOWEST: f64 = 1e-3;
/// Time between two looks for the first client, and at whether to go on.
const LOOK: Duration = Duration::from_millis(20);
/// Time between two looks at a clock that is followed, whose messages come every 10 ms.
const LOOK_AT_CLOCK: Duration = Duration::from_millis(1);

/// Runs a scenario in step with the clock, serves it on 127.0.0.1 and sends it to ROS 2, as [`Live`] says. `opened` is
/// called with where it is before the first period; `warn`, on any thread, of connections and
/// commands that were rejected; `watch` is called after every control period with the part done (0 if there is no end),
/// at least every 20 ms while the run waits for the clock, and, without a simulation, while it waits for the first
/// client: where it breaks the run ends with the metrics so far, its error ends the run. A run that is more than 0.5 s
/// behind the clock continues from its present time.
///
/// Connections come from programs that send no `Origin` and from pages of Foxglove, of Lichtblick, of this machine
/// and of [`Live::origins`]; their `Host` is this machine. Others are rejected with status 403 and a reason. A
/// handshake may take 10 s, and 16 clients may be there at a time. With [`Live::allow_control`] clients may set the
/// parameters `command.vx_m_s`, `command.vy_m_s`, `command.wz_rad_s` or publish a twist on `/cmd_vel`. `control.policy`
/// and `vehicle.motor.stall_torque_n_m` are settings: they stay when the client goes; the controller goes on from the
/// state that it has. A rejected request changes nothing, and the client receives the reason.
///
/// ROS 2 nodes in the same domain publish `geometry_msgs/msg/Twist` or `TwistStamped` on `/cmd_vel`; with
/// [`Ros2::joints`] they publish `sensor_msgs/msg/JointState` on `/joint_commands` instead. The service
/// `/omnistep/pause` stops the time. Without a log, and without viewers that may only watch, `/omnistep/reset` begins
/// the run anew, and so does a pose on `/initialpose`, with the vehicle there; the reset is a service of the port, too,
/// with [`Live::allow_control`]. A run with [`Ros2::follow_clock`] has none of the three: it waits and begins anew with
/// the clock of another. The outcome is that of the last start.
///
/// From the first command on the vehicle follows these, not the scenario. 0.5 s on the clock after
/// the last of them, or when the client goes or publishes no longer, the command is rest until
/// another comes; it is rest, too, after the end of the scenario's own.
///
/// # Errors
/// [`omni_sim::Error::Argument`] for a speed below 0.001, an origin that is none, a rate or a
/// namespace that is none; [`Error::Live`] if the port cannot be opened, `Error::Ros2` if the domain cannot be joined;
/// as [`omni_sim::run()`], and whatever `watch` returns.
///
/// ```
/// use std::ops::ControlFlow;
/// use omni_log::{Error, Live, Opened, run_live};
/// use omni_sim::config::{Override, Scenario};
/// let mut live = Live::new(0); // a free port
/// live.real_time_factor = f64::INFINITY;
/// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
/// let mut periods = 0;
/// let opened = |opened: &Opened| assert!(matches!(opened, Opened::Port(address) if address.starts_with("ws://127.0.0.1:")));
/// let (_, ended) = run_live::<Error>(&scenario, &live, opened, |warning| eprintln!("{warning}"), |simulation, _| {
///     periods += usize::from(simulation.is_some());
///     Ok(ControlFlow::Continue(()))
/// })?;
/// assert!(ended.is_none() && periods >= 100);
/// # Ok::<(), omni_log::Error>(())
/// ```
pub fn run_live<E: From<omni_sim::Error> + From<Error>>(
    scenario: &Scenario,
    live: &Live,
    opened: impl FnMut(&Opened),
    warn: impl Fn(&str) + Send + Sync + 'static,
    mut watch: impl FnMut(Option<&Simulation>, f64) -> Result<ControlFlow<()>, E>,
) -> Result<(Outcome, Option<omni_sim::Error>), E> {
    check(live)?;
    let warn: Warn = Arc::new(warn);
    let (mut controller, mut outlets) = Outlets::open(scenario, live, &warn)?;
    outlets.report(opened);
    while live.wait && !outlets.take_subscribed() {
        match watch(None, 0.0) {
            Ok(ControlFlow::Continue(())) => std::thread::sleep(LOOK),
            // It ends with its first period.
            Ok(ControlFlow::Break(())) => break,
            Err(error) => {
                let _ = outlets.close().map(RunLog::leave);
                return Err(error);
            }
        }
    }
    outlets.describe();
    let mut going = Going::new(scenario, live, outlets.controls.clone());
    let controls = outlets.controls.clone();
    let outlets = RefCell::new(outlets);
    // The scenario of this start: others may place the vehicle.
    let mut placed = None;
    let ended = loop {
        let begun = placed.as_ref().unwrap_or(scenario);
        let steer = |simulation: &mut Simulation| outlets.borrow_mut().command(begun, simulation);
        let run = Run::new(begun).controller(controller).command(steer);
        let run = run.until(|simulation| {
            outlets.borrow_mut().push(simulation)?;
            going.wait(simulation, |part| watch(Some(simulation), part))
        });
        let ended = run.outcome();
        if !matches!(ended, Ok((_, None))) || !going.take_start_again() {
            break ended;
        }
        placed = controls.take_placed();
        controller = match outlets
            .borrow_mut()
            .start_again(placed.as_ref().unwrap_or(scenario))
        {
            Ok(controller) => controller,
            Err(error) => break Err(error.into()),
        };
    };
    let log = outlets.into_inner().close();
    let lost_s = going.pacer.lost_s();
    if lost_s > 0.0 {
        warn(&format!(
            "the run was slower than the clock and fell behind by {lost_s:.1} s"
        ));
    }
    match (ended, log) {
        (Ok(ended), Some(log)) => {
            log.finish(&ended.0).map_err(Error::from)?;
            Ok(ended)
        }
        (Err(error), Some(log)) => {
            // Only the end of the run is reported, not also errors of its log.
            let _ = log.leave();
            Err(error)
        }
        (ended, None) => ended,
    }
}

/// How far a run has come, and what it waits for.
struct Going<'a> {
    scenario: &'a Scenario,
    live: &'a Live,
    controls: Arc<Controls>,
    start: Instant,
    pacer: Pacer,
    /// Control periods that are done, and with which it ends.
    periods: u64,
    end: Option<u64>,
}

impl<'a> Going<'a> {
    /// From now on.
    fn new(scenario: &'a Scenario, live: &'a Live, controls: Arc<Controls>) -> Self {
        let start = Instant::now();
        Self {
            scenario,
            live,
            controls,
            start,
            pacer: Pacer::new(live.real_time_factor, start),
            periods: 0,
            end: match live.until {
                Until::Scenario => Some(control_periods(scenario)),
                Until::Seconds(seconds) => Some((seconds / scenario.period_s()).ceil().max(1.0) as u64),
                Until::Stopped => None,
            },
        }
    }

    /// Waits after a control period until the next one is due, and says whether there is one.
    fn wait<E: From<omni_sim::Error>>(
        &mut self,
        simulation: &Simulation,
        mut watch: impl FnMut(f64) -> Result<ControlFlow<()>, E>,
    ) -> Result<ControlFlow<()>, E> {
        self.periods += 1;
        let time_s = simulation.time_ns() as f64 * 1e-9;
        let part = self.end.map_or(0.0, |end| self.periods as f64 / end as f64);
        loop {
            let now = Instant::now();
            if watch(part)?.is_break() || self.end == Some(self.periods) {
                // The end is the end, also if another start was asked for.
                self.controls.take_start_again();
                return Ok(ControlFlow::Break(()));
            }
            if self.controls.starts_again() {
                return Ok(ControlFlow::Break(()));
            }
            let time_limit_s = self.scenario.time_limit_s;
            if self.live.until == Until::Scenario && (now - self.start).as_secs_f64() > time_limit_s {
                return Err(omni_sim::Error::OutOfTime { time_s, time_limit_s }.into());
            }
            if self.controls.is_paused() {
                self.pacer.hold(time_s, now);
                std::thread::sleep(LOOK);
                continue;
            }
            if self.live.follows_clock() {
                match self.controls.clock_ns() {
                    // A run that has no clock yet has not begun.
                    0 => self.start = now,
                    clock_ns if simulation.time_ns() <= clock_ns => return Ok(ControlFlow::Continue(())),
                    _ => {}
                }
                std::thread::sleep(LOOK_AT_CLOCK);
                continue;
            }
            match self.pacer.wait(time_s, now) {
                Some(wait) => std::thread::sleep(wait.min(LOOK)),
                None => return Ok(ControlFlow::Continue(())),
            }
        }
    }

    /// Does the run begin anew? Then its time does, too.
    fn take_start_again(&mut self) -> bool {
        let again = self.controls.take_start_again();
        if again {
            let now = Instant::now();
            self.pacer.hold(0.0, now);
            // A time that was asked for counts on, a scenario is whole.
            if self.live.until == Until::Scenario {
                (self.periods, self.start) = (0, now);
            }
        }
        again
    }
}

/// Is it something that a live run can do?
fn check(live: &Live) -> Result<(), Error> {
    let refuse =
        |name, value: String, allowed| Err(Error::from(omni_sim::Error::Argument { name, value, allowed }));
    if live.real_time_factor.is_nan() || live.real_time_factor < SLOWEST {
        return refuse(
            "--real-time-factor",
            live.real_time_factor.to_string(),
            "at least 0.001",
        );
    }
    if let Until::Seconds(seconds) = live.until
        && !(seconds > 0.0 && seconds <= LONGEST_S)
    {
        return refuse("--duration", seconds.to_string(), "above 0, at most 1e9 s");
    }
    if live.allow_control && live.log.is_some() {
        return refuse(
            "--allow-control",
            "true".into(),
            "only without --log, because a log has one policy from start to end",
        );
    }
    #[cfg(feature = "ros2")]
    if live.allow_control && live.ros2.as_ref().is_some_and(|ros2| ros2.joints.is_some()) {
        return refuse(
            "--allow-control",
            "true".into(),
            "only where no client drives single wheels",
        );
    }
    Ok(())
}

/// Longest run that has an end \[s\]: 32 years.
const LONGEST_S: f64 = 1e9;

/// The number that a [`Pilot`] commands under: viewers count from 1, ROS 2 is 0.
const PILOT: ClientId = ClientId::MAX;

/// Outputs of a run, and their requests.
struct Outlets {
    requests: Arc<Requests>,
    pilot: Option<Pilot>,
    warn: Warn,
    controls: Arc<Controls>,
    /// The wheels are driven one by one.
    #[cfg(feature = "ros2")]
    joints: Option<Arc<ros::JointCommands>>,
    viewers: Option<Viewers>,
    #[cfg(feature = "ros2")]
    ros: Option<(u16, OnRos)>,
    log: Option<RunLog>,
}

impl Outlets {
    /// Opens what is asked for, with the controller that the run has then.
    fn open(scenario: &Scenario, live: &Live, warn: &Warn) -> Result<(AnyController, Self), Error> {
        let requests = Arc::new(Requests::new(scenario));
        if live.stands {
            requests.rest();
        }
        #[cfg(feature = "ros2")]
        let joints = match &live.ros2 {
            Some(Ros2 {
                joints: Some(interface),
                ..
            }) => Some(Arc::new(ros::JointCommands::new(scenario, *interface))),
            _ => None,
        };
        #[cfg(feature = "ros2")]
        let controller = ros::controller(scenario, joints.as_ref())?;
        #[cfg(not(feature = "ros2"))]
        let controller = AnyController::new(scenario)?;
        let open = |port| Viewers::open(scenario, &controller, (live, port), &requests, warn.clone());
        let viewers = live.port.map(open).transpose()?;
        let controls = requests.controls.clone();
        #[cfg(feature = "ros2")]
        let ros = match &live.ros2 {
            Some(ros2) => {
                // A log has one time, which does not go back. Viewers that may control begin it anew themselves.
                let can_start_again = live.log.is_none() && (live.port.is_none() || live.allow_control);
                let asked = ros::Asked {
                    requests: &requests,
                    joints: joints.as_ref(),
                    controls: (controls.clone(), can_start_again),
                };
                Some((
                    ros2.domain,
                    OnRos::open(scenario, &controller, ros2, asked, warn)?,
                ))
            }
            None => None,
        };
        let create = |path| RunLog::create(path, scenario, &controller);
        let outlets = Self {
            requests,
            pilot: live.pilot.clone(),
            warn: warn.clone(),
            controls,
            #[cfg(feature = "ros2")]
            joints,
            viewers,
            #[cfg(feature = "ros2")]
            ros,
            log: live.log.as_ref().map(create).transpose()?,
        };
        Ok((controller, outlets))
    }

    fn report(&self, mut opened: impl FnMut(&Opened)) {
        if let Some(viewers) = &self.viewers {
            opened(&Opened::Port(viewers.address()));
        }
        #[cfg(feature = "ros2")]
        if let Some((domain, _)) = &self.ros {
            opened(&Opened::Ros2(*domain));
        }
    }

    /// Has a client subscribed since the last call?
    fn take_subscribed(&mut self) -> bool {
        let subscribed = self.requests.take_subscribed();
        #[cfg(feature = "ros2")]
        if let Some((_, ros)) = &self.ros {
            return ros.take_subscribed() || subscribed;
        }
        subscribed
    }

    fn describe(&mut self) {
        if let Some(viewers) = &mut self.viewers {
            viewers.describe();
        }
        #[cfg(feature = "ros2")]
        if let Some((_, ros)) = &mut self.ros {
            ros.describe();
        }
    }

    /// The run begins anew with the controller that is returned.
    fn start_again(&mut self, scenario: &Scenario) -> Result<AnyController, Error> {
        #[cfg(feature = "ros2")]
        let controller = ros::controller(scenario, self.joints.as_ref())?;
        #[cfg(not(feature = "ros2"))]
        let controller = AnyController::new(scenario)?;
        #[cfg(feature = "ros2")]
        if let Some((_, ros)) = &mut self.ros {
            ros.start_again(scenario, &controller);
        }
        if let Some(viewers) = &mut self.viewers {
            viewers.start_again(scenario, &controller);
        }
        self.requests.start_again();
        Ok(controller)
    }

    /// From now on viewers are shown another scenario.
    fn set_scenario(&mut self, scenario: &Scenario) {
        if let Some(viewers) = &mut self.viewers {
            viewers.set_scenario(scenario);
        }
        #[cfg(feature = "ros2")]
        if let Some((_, ros)) = &mut self.ros {
            ros.set_scenario(scenario);
        }
    }

    /// The next period's command, and the controller that a client has asked for.
    fn command(
        &mut self,
        scenario: &Scenario,
        simulation: &mut Simulation,
    ) -> Result<BodyTwist<f64>, omni_sim::Error> {
        if let Some(changed) = self.requests.take_changed() {
            if let Err(error) = simulation.take_control(&changed) {
                (self.warn)(&error.to_string());
            } else {
                self.set_scenario(&changed);
            }
        }
        if let Some(twist) = self.pilot.as_ref().and_then(Pilot::take)
            && let Err(why) = self.requests.drive(PILOT, twist, Instant::now())
        {
            (self.warn)(&why);
        }
        if self.requests.time_out(Instant::now())
            && let Some(viewers) = &self.viewers
        {
            viewers.timed_out();
        }
        #[cfg(feature = "ros2")]
        if self.joints.is_some() {
            // The command is of the wheels alone: the vehicle is judged by the motion that they amount to.
            let twist = simulation.observation().odometry.twist;
            let known = twist.to_array().iter().all(|part| part.is_finite());
            return Ok(if known { twist } else { BodyTwist::ZERO });
        }
        #[cfg(feature = "ros2")]
        if let Some((_, ros)) = &mut self.ros
            && let Some(twist) = ros.drive_to_goal(simulation, &self.requests)
        {
            return Ok(twist);
        }
        let over = simulation.time_ns() as f64 * 1e-9 >= scenario.duration_s;
        Ok(match self.requests.command() {
            Some(command) => command,
            None if over => BodyTwist::ZERO,
            None => simulation.scenario_command(),
        })
    }

    fn push(&mut self, simulation: &Simulation) -> Result<(), Error> {
        if let Some(viewers) = &mut self.viewers {
            viewers.push(simulation);
        }
        #[cfg(feature = "ros2")]
        if let Some((_, ros)) = &mut self.ros {
            ros.push(simulation);
        }
        if let Some(log) = &mut self.log {
            log.push(simulation.period())?;
        }
        Ok(())
    }

    /// Closes all but the log, which is returned.
    fn close(self) -> Option<RunLog> {
        #[cfg(feature = "ros2")]
        drop(self.ros);
        if let Some(viewers) = self.viewers {
            viewers.close();
        }
        self.log
    }
}
