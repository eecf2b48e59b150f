//! The host's side of a controller that runs somewhere else, in lock-step: one request and one answer a control period.

use std::fmt;
use std::io::{Read, Write};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use omni_core::{BodyTwist, Controller, WheelTorques};
use omni_link::{
    Action, Answer, Counters, FrameError, FromController, Greeting, Guard, HOLD_PERIODS, MAX_ANSWER_FRAME,
    MAX_REQUEST_FRAME, PROTOCOL_VERSION, Request, ToController, decode, encode,
};

use super::qemu::Process;
use super::{ControlSample, Loop, inverse, scalar, velocities};
use crate::Error;
use crate::config::Scenario;

/// Greetings sent, one a time-out, before a controller is given up.
const GREETINGS: u32 = 5;

/// Frames that were not received as they were sent, both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounters {
    /// Of answers, counted here.
    pub answers: Counters,
    /// Of requests, as the controller last said.
    pub requests: Counters,
}

impl LinkCounters {
    /// All arrived.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.answers.is_zero() && self.requests.is_zero()
    }
}

impl fmt::Display for LinkCounters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            answers: a,
            requests: r,
        } = self;
        write!(
            f,
            "answers: {} lost, {} truncated, {} corrupted; ",
            a.lost, a.truncated, a.corrupted
        )?;
        write!(
            f,
            "requests: {} lost, {} truncated, {} corrupted",
            r.lost, r.truncated, r.corrupted
        )
    }
}

/// A way to a controller and back: bytes out, frames in, and how long to wait for one.
pub struct Link {
    name: String,
    frames: Mutex<Receiver<Vec<u8>>>,
    writer: Box<dyn Write + Send + Sync>,
    time_out: Duration,
    process: Option<Process>,
}

/// What came within the time-out.
enum Heard<const N: usize> {
    Message(FromController<Answer<N>>),
    Damaged(FrameError),
    Nothing,
    /// And nothing will ever come.
    Closed,
}

impl Link {
    /// A link over any two streams. An answer is waited for no longer than `time_out`: nothing else tells that a frame was
    /// lost, and one that is only late counts as lost. `name` is what messages call the other end.
    pub fn new(
        name: impl Into<String>,
        reader: impl Read + Send + 'static,
        writer: impl Write + Send + Sync + 'static,
        time_out: Duration,
    ) -> Self {
        let (sender, frames) = mpsc::channel();
        // Ends with the stream, or with the first frame that nobody wants any more.
        std::thread::spawn(move || receive(reader, &sender));
        Self {
            name: name.into(),
            frames: Mutex::new(frames),
            writer: Box::new(writer),
            time_out,
            process: None,
        }
    }

    /// The same, with the process at the other end: it is killed with the link.
    pub(super) fn with_process(self, process: Process) -> Self {
        let process = Some(process);
        Self { process, ..self }
    }

    fn send<const N: usize>(&mut self, message: &ToController<N>) -> bool {
        let mut buffer = [0; MAX_REQUEST_FRAME];
        let frame = encode(message, &mut buffer).unwrap_or_default();
        self.writer
            .write_all(frame)
            .and_then(|()| self.writer.flush())
            .is_ok()
    }

    fn hear<const N: usize>(&mut self, until: Instant) -> Heard<N> {
        let frames = self.frames.get_mut().unwrap_or_else(PoisonError::into_inner);
        match frames.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(mut frame) => decode(&mut frame).map_or_else(Heard::Damaged, Heard::Message),
            Err(RecvTimeoutError::Timeout) => Heard::Nothing,
            Err(RecvTimeoutError::Disconnected) => Heard::Closed,
        }
    }

    /// Why nothing comes any more.
    fn obituary(&mut self) -> String {
        let ended = self.process.as_mut().map(Process::obituary);
        ended.unwrap_or_else(|| "the other end has closed it".into())
    }
}

fn receive(mut reader: impl Read, frames: &mpsc::Sender<Vec<u8>>) {
    let mut receiver = omni_link::Receiver::<MAX_ANSWER_FRAME>::new();
    let mut bytes = [0; 1024];
    loop {
        let read = match reader.read(&mut bytes) {
            Ok(0) => return,
            Ok(read) => read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(_) => return,
        };
        for &byte in bytes.iter().take(read) {
            if let Some(frame) = receiver.push(byte)
                && frames.send(frame.to_vec()).is_err()
            {
                return;
            }
        }
    }
}

/// A controller of `N` wheels at the other end of a link.
pub(super) struct Linked<const N: usize> {
    link: Link,
    /// The same controller, for what it knows without being asked.
    here: Controller<f32, N>,
    guard: Guard,
    /// Start the loops afresh: until the controller says that it has.
    restart: bool,
    last: Answer<N>,
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
        let Some(greeting) = greeting::<N>(&mut link).map_err(|reason| refuse(&link, reason))? else {
            let waited = (link.time_out * GREETINGS).as_secs_f64();
            let reason =
                format!("no answer within {waited} s: is it the image that serves omni-link frames?");
            return Err(refuse(&link, reason));
        };
        fits(&greeting, scenario).map_err(|reason| refuse(&link, reason))?;
        let mut guard = Guard::new();
        guard.restart(0);
        Ok(Self {
            link,
            here,
            guard,
            restart: true,
            last: Answer::stopped(),
            period_s: scenario.period_s(),
            periods: 0,
            stopped: None,
        })
    }

    /// The answer of this period in `last`, if it came.
    fn exchange(&mut self, command: &BodyTwist<f64>, measured: &[f64]) -> Result<(), String> {
        let sequence = self.guard.sequence().wrapping_add(1);
        let request = Request {
            sequence,
            restart: self.restart,
            command: scalar(command),
            measured_rad_s: velocities::<f32, N>(measured).rad_s,
        };
        if !self.link.send(&ToController::Request(request)) {
            return Err(self.link.obituary());
        }
        let until = Instant::now() + self.link.time_out;
        // A controller that has not seen the restart yet knows no number.
        let due = |answer: &Answer<N>, restart| {
            answer.sequence == sequence || restart && answer.action == Action::Stop
        };
        let action = loop {
            match self.link.hear(until) {
                Heard::Message(FromController::Answer(answer)) if due(&answer, self.restart) => {
                    break self.take(answer);
                }
                // A late one.
                Heard::Message(_) => {}
                Heard::Damaged(error) => break self.guard.damaged(error),
                Heard::Nothing => break self.guard.missed(),
                Heard::Closed => return Err(self.link.obituary()),
            }
        };
        match action {
            Action::Step | Action::Hold => Ok(()),
            Action::Stop if self.last.action == Action::Stop => Err("the controller has stopped".into()),
            Action::Stop => Err(format!(
                "no fresh torques in {} periods in a row",
                HOLD_PERIODS + 1
            )),
        }
    }

    fn take(&mut self, answer: Answer<N>) -> Action {
        match answer.action {
            Action::Step => {
                self.last = answer;
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

impl<const N: usize> Loop for Linked<N> {
    fn step(
        &mut self,
        command: &BodyTwist<f64>,
        measured: &[f64],
        sample: &mut ControlSample,
    ) -> Result<(), Error> {
        let time_s = self.periods as f64 * self.period_s;
        self.periods += 1;
        if self.stopped.is_none()
            && let Err(reason) = self.exchange(command, measured)
        {
            self.guard.stop();
            self.last.sample.wheels.applied = WheelTorques::zero();
            self.stopped = Some((time_s, reason));
        }
        sample.take(&self.last.sample, &self.last.estimated, &self.last.residual);
        match &self.stopped {
            None => Ok(()),
            Some((time_s, reason)) => Err(Error::Link {
                time_s: *time_s,
                reason: reason.clone(),
                counters: self.counters(),
            }),
        }
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(&self.here, twist)
    }

    fn link(&self) -> Option<LinkCounters> {
        Some(self.counters())
    }
}

impl<const N: usize> Linked<N> {
    fn counters(&self) -> LinkCounters {
        LinkCounters {
            answers: self.guard.counters(),
            requests: self.last.counters,
        }
    }
}

/// Who is there? Asks again where the question or its answer is lost.
fn greeting<const N: usize>(link: &mut Link) -> Result<Option<Greeting>, String> {
    for _ in 0..GREETINGS {
        if !link.send(&ToController::<N>::Hello) {
            return Err(link.obituary());
        }
        let until = Instant::now() + link.time_out;
        loop {
            match link.hear::<N>(until) {
                Heard::Message(FromController::Greeting(greeting)) => return Ok(Some(greeting)),
                Heard::Message(FromController::Answer(_)) => {}
                Heard::Damaged(_) | Heard::Nothing => break,
                Heard::Closed => return Err(link.obituary()),
            }
        }
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
            "{what}; build it for this scenario, in firmware/ by OMNISTEP_SCENARIO=FILE cargo build --release"
        ))
    };
    match (greeting, &expected) {
        (found, expected) if found.version != expected.version => {
            let (found, expected) = (found.version, expected.version);
            built(format!("speaks version {found} of the protocol, not {expected}"))
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
