//! A controller at the other end of a link, in lock-step: greeted, asked once a control period, its answers checked.

mod response_checks;

use std::time::Instant;

use omni_core::geometry::{PlanarPose, WheelTorques};
use omni_core::{BodyTwist, Controller, Readings, TorqueLimit};
use omni_link::{
    Action, Answer, Bodies, FromController, Greeting, Guard, HOLD_PERIODS, PROTOCOL_VERSION, Request,
    ToController,
};

use super::control_law::{ControlLaw, inverse, scalar, velocities};
use super::link::{Event, GREETINGS, Link};
use crate::config::Scenario;
use crate::control_sample::ControlSample;
use crate::link_counters::LinkCounters;
use crate::report::{DriveReport, DriveWheel, drive_mode, wheel_fault};
use crate::{Error, ReportColumns};

/// Messages that answer nothing, within one time-out, before a peer is given up. Frames that were
/// late are no more than the greetings and the periods of a hold.
const MOST_UNDUE: u32 = 100;

/// Periods without an answer, and the one that is answered now.
const MOST_UNANSWERED: usize = HOLD_PERIODS as usize + 1;

/// Counts messages that answer nothing.
struct Undue(u32);

impl Undue {
    /// One more; says when it is one too many.
    fn message(&mut self) -> Result<(), String> {
        self.0 += 1;
        if self.0 > MOST_UNDUE {
            return Err(format!(
                "the firmware sent more than {MOST_UNDUE} messages that answer no request"
            ));
        }
        Ok(())
    }
}

/// A controller of `N` wheels at the other end of a link.
pub(super) struct Linked<const N: usize> {
    link: Link,
    /// The same controller, for what it knows without being asked.
    here: Controller<f32, N>,
    /// What each wheel's motor gives, by the wheel's name.
    motors: [(String, TorqueLimit<f32>); N],
    guard: Guard,
    /// Largest amount of each component of the commands so far: a limiter does not go beyond.
    asked: [f32; 3],
    /// Largest amount of each wheel's velocity so far: an estimate from coarse counts does not go beyond.
    fastest_rad_s: [f32; N],
    /// It is traction control, which also reads the bodies' motion.
    grips: bool,
    /// It is a drive.
    drives: bool,
    columns: ReportColumns,
    /// Start the loops afresh: until the controller says that it has.
    restart: bool,
    emergency_stop: bool,
    last: Answer<N>,
    /// Wheel velocities sent since that answer, now or in vain, the oldest first: no more than
    /// there may be periods of a hold.
    unanswered_rad_s: Vec<[f32; N]>,
    period_s: f64,
    periods: u64,
    /// When and why, once it has stopped.
    stopped: Option<(f64, String)>,
}

impl<const N: usize> Linked<N> {
    /// The controller at the other end, if it is the scenario's.
    pub(super) fn greet(scenario: &Scenario, mut link: Link) -> Result<Self, Error> {
        let refuse = |link: &Link, reason| Error::Firmware {
            name: link.name.clone(),
            reason,
        };
        let here = scenario.controller()?;
        let greeting = greeting::<N>(&mut link).map_err(|reason| refuse(&link, reason))?;
        let greeting = greeting.ok_or_else(|| refuse(&link, link.why_no_peer_was_met()))?;
        fits(&greeting, scenario).map_err(|reason| refuse(&link, reason))?;
        let limits = scenario.wheel_control::<f32, N>()?.limits;
        let wheels = &scenario.vehicle().wheel;
        let motors = std::array::from_fn(|i| (wheels[i].name.clone(), limits[i]));
        let mut guard = Guard::new();
        guard.restart(0);
        Ok(Self {
            link,
            here,
            motors,
            guard,
            asked: [0.0; 3],
            fastest_rad_s: [0.0; N],
            grips: scenario.has_traction(),
            drives: scenario.drive.is_some(),
            columns: ReportColumns::built_in(scenario.vehicle(), scenario.drive.is_some(), false),
            restart: true,
            emergency_stop: false,
            last: Answer::stopped(),
            unanswered_rad_s: Vec::with_capacity(MOST_UNANSWERED),
            period_s: scenario.period_s(),
            periods: 0,
            stopped: None,
        })
    }

    /// The answer of this period in `last`, if it came.
    fn exchange(&mut self, readings: &Readings<'_, f64>) -> Result<(), String> {
        let sequence = self.guard.sequence().wrapping_add(1);
        let request = Request {
            sequence,
            restart: self.restart,
            emergency_stop: self.emergency_stop,
            // To a drive a command of NaN says that none arrived; the loops go on with the last one.
            command: if readings.new_command || !self.drives {
                scalar(&readings.command)
            } else {
                BodyTwist::from_array([f32::NAN; 3])
            },
            measured_rad_s: velocities::<f32, N>(readings.wheels_rad_s).rad_s,
        };
        for (most, asked) in self.asked.iter_mut().zip(request.command.to_array()) {
            *most = most.max(asked.abs());
        }
        for (most, sent) in self.fastest_rad_s.iter_mut().zip(request.measured_rad_s) {
            *most = most.max(sent.abs());
        }
        if self.unanswered_rad_s.len() == MOST_UNANSWERED {
            self.unanswered_rad_s.remove(0);
        }
        self.unanswered_rad_s.push(request.measured_rad_s);
        self.link.send(&if self.grips {
            ToController::RequestWithBodies(request, bodies(readings))
        } else {
            ToController::Request(request)
        })?;
        let mut undue = Undue(0);
        let until = Instant::now() + self.link.time_out;
        // A controller that has not seen the restart yet knows no number.
        let due = |answer: &Answer<N>, restart| {
            answer.sequence == sequence || restart && answer.action == Action::Stop
        };
        let action = loop {
            match self.link.next_message(until) {
                Event::Message(FromController::Answer(answer)) if due(&answer, self.restart) => {
                    self.plausible(&answer, &request)?;
                    break self.take(answer);
                }
                // A late one.
                Event::Message(_) => undue.message()?,
                Event::Damaged(error) => break self.guard.damaged(error),
                Event::Nothing => break self.guard.missed(),
                Event::Closed => return Err(self.link.why_it_ended()),
            }
        };
        match action {
            Action::Step | Action::Hold => Ok(()),
            Action::Stop if self.last.action == Action::Stop => Err("the controller has stopped".into()),
            Action::Stop => Err(format!("no new torques in {} periods in a row", HOLD_PERIODS + 1)),
        }
    }

    fn take(&mut self, answer: Answer<N>) -> Action {
        match answer.action {
            Action::Step => {
                self.last = answer;
                self.unanswered_rad_s.clear();
                self.restart = false;
                self.guard.received(answer.sequence)
            }
            Action::Hold => {
                self.last.counters = answer.counters;
                self.guard.held()
            }
            // It is waiting for a restart that it has not received yet.
            Action::Stop if self.restart => self.guard.held(),
            Action::Stop => {
                self.last = answer;
                self.guard.stop();
                Action::Stop
            }
        }
    }
}

impl<const N: usize> ControlLaw for Linked<N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let time_s = self.periods as f64 * self.period_s;
        self.periods += 1;
        if self.stopped.is_none()
            && let Err(reason) = self.exchange(readings)
        {
            self.guard.stop();
            self.last.sample.wheels.applied = WheelTorques::zero();
            self.stopped = Some((time_s, reason));
        }
        sample.take(&self.last.sample, &self.last.estimated, &self.last.residual);
        if self.drives {
            sample.brake = self.last.brake().to_vec();
            sample.report.drive = self.report();
        }
        match &self.stopped {
            None => Ok(()),
            Some((time_s, reason)) => Err(Error::Link {
                time_s: *time_s,
                reason: reason.clone(),
                counters: self.counters(),
            }),
        }
    }

    fn columns(&self) -> ReportColumns {
        self.columns.clone()
    }

    fn emergency_stop(&mut self, pressed: bool) {
        self.emergency_stop = pressed;
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(self.here.kinematics(), twist)
    }

    fn link_counters(&self) -> Option<LinkCounters> {
        Some(self.counters())
    }
}

impl<const N: usize> Linked<N> {
    /// Report of a drive in its last answer, with checked numbers.
    fn report(&self) -> Option<DriveReport> {
        let (report, brake) = (&self.last.drive, self.last.brake());
        let [x_m, y_m, yaw_rad] = report.pose.map(f64::from);
        let wheel = |i: usize| {
            Some(DriveWheel {
                fault: wheel_fault(report.faults[i])?,
                excluded: report.excluded[i],
                brake: brake[i],
            })
        };
        Some(DriveReport {
            mode: drive_mode(report.mode)?,
            motion_known: report.motion_known,
            command: None,
            pose: PlanarPose { x_m, y_m, yaw_rad },
            deviations: None,
            wheels: (0..N).map(wheel).collect::<Option<_>>()?,
        })
    }

    fn counters(&self) -> LinkCounters {
        LinkCounters {
            answers: self.guard.counters(),
            requests: self.last.counters,
        }
    }
}

/// The bodies' motion as a message has it. More hinges than that are rejected with the scenario.
fn bodies(readings: &Readings<'_, f64>) -> Bodies {
    let mut bodies = Bodies::none();
    let put = |to: &mut [f32], from: &[f64]| {
        for (to, from) in to.iter_mut().zip(from) {
            *to = *from as f32;
        }
    };
    put(&mut bodies.hinges_rad, readings.hinges_rad);
    put(&mut bodies.hinges_rad_s, readings.hinges_rad_s);
    put(&mut bodies.rate_rad_s, &readings.imu.rate_rad_s);
    put(&mut bodies.specific_force_m_s2, &readings.imu.specific_force_m_s2);
    (bodies.roll_rad, bodies.pitch_rad) = (readings.imu.roll_rad as f32, readings.imu.pitch_rad as f32);
    bodies
}

/// Who is there? Asks again where the question or its answer is lost.
fn greeting<const N: usize>(link: &mut Link) -> Result<Option<Greeting>, String> {
    let mut answers = false;
    for _ in 0..GREETINGS {
        link.send(&ToController::<N>::Hello)?;
        let until = Instant::now() + link.time_out;
        let mut undue = Undue(0);
        loop {
            match link.next_message::<N>(until) {
                Event::Message(FromController::Greeting(greeting)) => return Ok(Some(greeting)),
                Event::Message(FromController::Answer(_)) => {
                    answers = true;
                    undue.message()?;
                }
                Event::Damaged(_) | Event::Nothing => break,
                Event::Closed => return Err(link.why_it_ended()),
            }
        }
    }
    if answers {
        return Err(
            "it sends omni-link messages, but its greeting does not state the vehicle it was built for"
                .into(),
        );
    }
    Ok(None)
}

/// Was it built for this scenario?
fn fits(greeting: &Greeting, scenario: &Scenario) -> Result<(), String> {
    let expected = Greeting {
        version: PROTOCOL_VERSION,
        wheels: scenario.vehicle().wheel.len() as u32,
        period_us: scenario.control.period_us as u32,
        digest: scenario.constants_digest().map_err(|error| error.to_string())?,
    };
    let built = |what: String| {
        Err(format!(
            "{what}; build it for this scenario: in firmware/, OMNISTEP_SCENARIO=FILE cargo build --release"
        ))
    };
    match (greeting, &expected) {
        (found, expected) if found.version != expected.version => {
            let (found, expected) = (found.version, expected.version);
            built(format!(
                "built for version {found} of the protocol, expected {expected}"
            ))
        }
        (found, expected) if found.wheels != expected.wheels => {
            let (found, expected) = (found.wheels, expected.wheels);
            built(format!("built for {found} wheels, the vehicle has {expected}"))
        }
        (found, expected) if found.period_us != expected.period_us => {
            let (found, expected) = (found.period_us, expected.period_us);
            built(format!(
                "built for a control period of {found} us, the scenario has {expected}"
            ))
        }
        (found, expected) if found.digest != expected.digest => {
            let (found, expected) = (found.digest, expected.digest);
            built(format!(
                "built for another vehicle or policy: its constants' digest is {found:08x}, the scenario's {expected:08x}"
            ))
        }
        _ => Ok(()),
    }
}
