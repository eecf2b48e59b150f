//! A controller at the other end of a link, in lock-step: greeted, asked once a control period, its answers checked.

use std::time::Instant;

use omni_core::{BodyTwist, Controller, DriveMode, Fault, Readings, TorqueLimit, WheelTorques};
use omni_link::{
    Action, Answer, FromController, Greeting, Guard, HOLD_PERIODS, PROTOCOL_VERSION, Request, ToController,
};

use super::drive::{self, Told};
use super::link::{Event, GREETINGS, Link, LinkCounters};
use super::{ControlSample, Loop, inverse, scalar, velocities};
use crate::Error;
use crate::config::Scenario;

/// Messages that answer nothing, within one time-out, before a peer is given up. Frames that were late are no more than the
/// greetings and the periods of a hold.
const MOST_UNDUE: u32 = 100;
/// The largest numbers of a mode and of a fault.
const MOST_MODE: u8 = DriveMode::EmergencyStop.number();
const MOST_FAULT: u8 = Fault::Lost.number();
/// How far beyond the motor's range a torque may be, as a part of it: another processor's rounding in `f32`, and far below what
/// any motor's data sheet promises.
const ROUNDING: f64 = 1e-5;

/// Counts messages that answer nothing.
struct Undue(u32);

impl Undue {
    /// One more; says when it is one too many.
    fn message(&mut self) -> Result<(), String> {
        self.0 += 1;
        if self.0 > MOST_UNDUE {
            return Err(format!(
                "the firmware sends without being asked: more than {MOST_UNDUE} messages that answer nothing"
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
    /// Signals of its own: those of a drive, where it has one.
    names: Vec<String>,
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
        let greeting = greeting::<N>(&mut link).map_err(|reason| refuse(&link, reason))?;
        let greeting = greeting.ok_or_else(|| refuse(&link, link.why_nobody_was_met()))?;
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
            names: if scenario.drive.is_some() {
                drive::names(scenario)
            } else {
                Vec::new()
            },
            restart: true,
            last: Answer::stopped(),
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
            // To a drive a command of NaN says that none arrived; the loops go on with the last one.
            command: if readings.new_command || self.names.is_empty() {
                scalar(&readings.command)
            } else {
                BodyTwist::from_array([f32::NAN; 3])
            },
            measured_rad_s: velocities::<f32, N>(readings.wheels_rad_s).rad_s,
        };
        for (most, asked) in self.asked.iter_mut().zip(request.command.to_array()) {
            *most = most.max(asked.abs());
        }
        self.link.send(&ToController::Request(request))?;
        let mut undue = Undue(0);
        let until = Instant::now() + self.link.time_out;
        // A controller that has not seen the restart yet knows no number.
        let due = |answer: &Answer<N>, restart| {
            answer.sequence == sequence || restart && answer.action == Action::Stop
        };
        let action = loop {
            match self.link.hear(until) {
                Event::Message(FromController::Answer(answer)) if due(&answer, self.restart) => {
                    self.believable(&answer, &request.measured_rad_s)?;
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
            Action::Stop => Err(format!(
                "no fresh torques in {} periods in a row",
                HOLD_PERIODS + 1
            )),
        }
    }

    /// Can the motors give these torques at the velocities that were sent? Else the firmware is at fault, whatever physics would
    /// make of it.
    fn believable(&self, answer: &Answer<N>, measured_rad_s: &[f32; N]) -> Result<(), String> {
        if answer.action == Action::Hold {
            return Ok(()); // none of its signals is used
        }
        plausible(answer, measured_rad_s, &self.asked, !self.names.is_empty())?;
        if answer.action == Action::Stop {
            return Ok(()); // its torques are not used
        }
        let torques = answer.sample.wheels.applied.n_m;
        let velocities = if self.names.is_empty() {
            *measured_rad_s
        } else {
            self.taken(answer, measured_rad_s)?
        };
        for ((torque, velocity), (wheel, motor)) in torques.iter().zip(&velocities).zip(&self.motors) {
            let range = motor.range(*velocity);
            let (lower, upper) = (f64::from(range.lower_n_m), f64::from(range.upper_n_m));
            let room = ROUNDING * (upper - lower);
            // Not so for a NaN.
            if !(lower - room..=upper + room).contains(&f64::from(*torque)) {
                return Err(format!(
                    "the firmware answers {torque} N.m for wheel {wheel}, allowed: {lower} to {upper}, what its motor gives at \
                     {velocity} rad/s"
                ));
            }
        }
        Ok(())
    }

    /// The velocities that a drive worked with: as sent, or as it took them in the period before. A wheel that it does not believe, whose
    /// velocity it takes for 0, gets no torque.
    fn taken(&self, answer: &Answer<N>, sent: &[f32; N]) -> Result<[f32; N], String> {
        let wheels = &answer.sample.wheels;
        for (i, (said, sent)) in wheels.measured.rad_s.iter().zip(sent).enumerate() {
            let (wheel, _) = &self.motors[i];
            let before = self.last.sample.wheels.measured.rad_s[i];
            let let_go = wheels.applied.n_m[i] == 0.0;
            if said != sent && *said != before && !(*said == 0.0 && let_go) {
                return Err(format!(
                    "the firmware answers {said} rad/s as measured velocity of wheel {wheel}, allowed: {sent}, which was sent, {before}, as \
                     before, or 0 without torque"
                ));
            }
            if answer.drive.faults[i] != 0 && !let_go {
                return Err(format!(
                    "the firmware answers a torque for wheel {wheel}, which it says it does not believe, allowed: 0"
                ));
            }
        }
        Ok(wheels.measured.rad_s)
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
        sample.mark_silent(readings.wheels_rad_s);
        if !self.names.is_empty() {
            let report = &self.last.drive;
            let told = Told::<N> {
                mode: report.mode,
                motion_known: report.motion_known,
                status: f64::NAN, // an answer does not tell
                pose: report.pose.map(f64::from),
                deviations: [f64::NAN; 3],
                faults: report.faults,
                left_out: report.excluded,
            };
            told.put_into(readings.wheels_rad_s, sample);
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

    fn signal_names(&self) -> &[String] {
        &self.names
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

/// Are the signals of an answer those of a controller that was told what was sent? They go into logs and figures.
fn plausible<const N: usize>(
    answer: &Answer<N>,
    measured_rad_s: &[f32; N],
    asked: &[f32; 3],
    drives: bool,
) -> Result<(), String> {
    let wheels = &answer.sample.wheels;
    let of_wheels = [
        ("reference", &wheels.reference.rad_s),
        ("measured velocity", &wheels.measured.rad_s),
        ("proportional term", &wheels.p_n_m),
        ("integral term", &wheels.i_n_m),
        ("derivative term", &wheels.d_n_m),
        ("feed-forward", &wheels.ff_n_m),
        ("requested torque", &wheels.requested.n_m),
        ("lower limit", &wheels.range.lower_n_m),
        ("upper limit", &wheels.range.upper_n_m),
        ("residual", &answer.residual.rad_s),
    ];
    for (signal, values) in of_wheels {
        if let Some((i, value)) = values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(format!(
                "the firmware answers {value} as {signal} of wheel {}, allowed: finite",
                i + 1
            ));
        }
    }
    let (command, estimated) = (answer.sample.command.to_array(), answer.estimated.to_array());
    let of_vehicle = estimated.iter().chain(&command).chain([&wheels.common_factor]);
    if let Some(value) = of_vehicle.into_iter().find(|value| !value.is_finite()) {
        return Err(format!(
            "the firmware answers {value} as a twist or common factor, allowed: finite"
        ));
    }
    let report = &answer.drive;
    if report.mode > MOST_MODE || report.faults.iter().any(|fault| *fault > MOST_FAULT) {
        return Err(format!(
            "the firmware answers mode {} and faults {:?}, allowed: 0 to {MOST_MODE} and 0 to {MOST_FAULT}",
            report.mode, report.faults
        ));
    }
    if let Some(value) = report.pose.iter().find(|value| !value.is_finite()) {
        return Err(format!(
            "the firmware answers {value} as a part of its pose, allowed: finite"
        ));
    }
    // A controller that has stopped repeats its last period; a wheel that is let go has 0.
    let measured = (answer.action == Action::Step).then_some(&wheels.measured.rad_s);
    for (i, (said, sent)) in measured.into_iter().flatten().zip(measured_rad_s).enumerate() {
        // A drive goes on with the last reading for a while where none arrives.
        // A drive judges readings: what it does not believe it replaces.
        if said != sent && *said != 0.0 && !drives {
            return Err(format!(
                "the firmware answers {said} rad/s as measured velocity of wheel {}, allowed: {sent}, which was sent, or 0",
                i + 1
            ));
        }
    }
    for (said, most) in command.iter().zip(asked) {
        if said.abs() > most * (1.0 + ROUNDING as f32) {
            return Err(format!(
                "the firmware answers {said} as part of its command, allowed: -{most} to {most}, the most that it was ever sent"
            ));
        }
    }
    Ok(())
}

/// Who is there? Asks again where the question or its answer is lost.
fn greeting<const N: usize>(link: &mut Link) -> Result<Option<Greeting>, String> {
    let mut answers = false;
    for _ in 0..GREETINGS {
        link.send(&ToController::<N>::Hello)?;
        let until = Instant::now() + link.time_out;
        let mut undue = Undue(0);
        loop {
            match link.hear::<N>(until) {
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
        return Err("it speaks omni-link, but does not say what it was built for when it is greeted".into());
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
