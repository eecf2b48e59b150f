//! What is done every control period.

#[cfg(test)]
mod tests;

use embedded_can::{Frame, nb::Can};
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use omni_core::estimate::EncoderState;
use omni_core::shaping::{CommandStatus, ShaperState};
use omni_core::{BodyTwist, ControlState, WheelVelocities};

use crate::constants::{CONTROLLER, ENCODER, ENCODER_WINDOW, SHAPER, WHEELS};
use crate::encoder::Encoder;
use crate::frames::{self, Mode};
use crate::motor::MotorDriver;

/// Periods from one report on the bus to the next: 10 ms. Three frames are 0.8 ms of a bus of 500 kbit/s.
pub const REPORT_PERIODS: u32 = 10;

/// Frames read in a period at most: a babbling bus cannot keep the task from its torques. The hardware stores three.
const FRAMES_PER_PERIOD: usize = 8;

/// What there is to know about a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// What the vehicle does.
    pub mode: Mode,
    /// Wheels that are driven; one without a velocity is released, and at rest every one when the torque has ended.
    pub driven: [bool; WHEELS],
    /// Commands ignored since the start: malformed, not a number, or repeated. Stops at 65535.
    pub ignored: u16,
    /// Periods since the start in which an encoder, a motor or the bus failed. Stops at 65535.
    pub hardware_errors: u16,
    /// Torque given to each motor \[N.m\].
    pub torque_n_m: [f32; WHEELS],
    /// Velocity of each wheel \[rad/s\], NaN where it is not known.
    pub velocity_rad_s: [f32; WHEELS],
}

/// The vehicle's controller with its hardware: motors and encoders in the order of the vehicle file, and the bus.
///
/// Nothing in it panics, and no error of the hardware is passed on: nothing could be done about it.
/// A wheel whose encoder fails is released and the others drive on. If a motor's driver fails, all
/// wheels are released. They stay so until a command to stand still has come, as after the start: a
/// vehicle does not set off because a contact closes again.
#[derive(Debug)]
pub struct ControlTask<P, D, E, C> {
    motors: [MotorDriver<P, D>; WHEELS],
    encoders: [E; WHEELS],
    can: C,
    velocities: [EncoderState<f32, ENCODER_WINDOW>; WHEELS],
    shaper: ShaperState<f32>,
    loops: ControlState<f32, WHEELS>,
    counter: Option<u8>,
    periods_to_report: u32,
    reports: u8,
    /// A part of the hardware failed in this period.
    failed: bool,
    status: Status,
}

impl<P: SetDutyCycle, D: OutputPin, E: Encoder, C: Can> ControlTask<P, D, E, C> {
    /// A task at rest.
    #[must_use]
    pub fn new(motors: [MotorDriver<P, D>; WHEELS], encoders: [E; WHEELS], can: C) -> Self {
        Self {
            motors,
            encoders,
            can,
            velocities: [EncoderState::at_rest(); WHEELS],
            shaper: ShaperState::default(),
            loops: ControlState::new(),
            counter: None,
            periods_to_report: REPORT_PERIODS,
            reports: 0,
            failed: false,
            status: Status {
                mode: Mode::Held,
                driven: [false; WHEELS],
                ignored: 0,
                hardware_errors: 0,
                torque_n_m: [0.0; WHEELS],
                velocity_rad_s: [f32::NAN; WHEELS],
            },
        }
    }

    /// One period: to be called every [`crate::constants::PERIOD_US`].
    pub fn step(&mut self) -> Status {
        self.failed = false;
        let command = self.receive();
        self.status.velocity_rad_s = self.measure();
        if self.status.mode == Mode::Held && command != Some(BodyTwist::ZERO) {
            self.hold();
        } else {
            self.drive(command.as_ref());
        }
        self.report();
        self.status.hardware_errors = self.status.hardware_errors.saturating_add(self.failed.into());
        self.status
    }

    /// The last good command of those that arrived.
    fn receive(&mut self) -> Option<BodyTwist<f32>> {
        let mut newest = None;
        for _ in 0..FRAMES_PER_PERIOD {
            match self.can.receive() {
                Ok(frame) if frames::is_command(&frame) => {
                    let command = frames::command(&frame).filter(|c| self.counter != Some(c.counter));
                    match command {
                        Some(command) => {
                            self.counter = Some(command.counter);
                            newest = Some(command.twist);
                        }
                        None => self.status.ignored = self.status.ignored.saturating_add(1),
                    }
                }
                Ok(_) => {}
                Err(nb::Error::WouldBlock) => break,
                Err(nb::Error::Other(_)) => {
                    self.failed = true;
                    break;
                }
            }
        }
        newest
    }

    /// Velocity of each wheel \[rad/s\], NaN where its encoder failed.
    fn measure(&mut self) -> [f32; WHEELS] {
        let mut measured = [f32::NAN; WHEELS];
        for ((measured, velocity), encoder) in measured
            .iter_mut()
            .zip(&mut self.velocities)
            .zip(&mut self.encoders)
        {
            let count = encoder.count().ok();
            self.failed |= count.is_none();
            *measured = ENCODER
                .step(velocity, count.map(u32::from), None)
                .unwrap_or(f32::NAN);
        }
        measured
    }

    /// Limits, time-out, inverse kinematics, the loops, and the torques to the motors.
    fn drive(&mut self, command: Option<&BodyTwist<f32>>) {
        let shaped = SHAPER.step(&mut self.shaper, command);
        let measured = WheelVelocities {
            rad_s: self.status.velocity_rad_s,
        };
        let wheels = CONTROLLER.step(&mut self.loops, &shaped.twist, &measured).wheels;
        let mut obeyed = true;
        for (i, motor) in self.motors.iter_mut().enumerate() {
            let done = if wheels.active[i] {
                motor.apply(wheels.applied.n_m[i], wheels.measured.rad_s[i])
            } else if wheels.shorted {
                motor.short()
            } else {
                // A wheel whose velocity is NaN, and every wheel when the torque has ended: the duty for
                // no torque follows from a velocity, and behind a stuck encoder it would turn the wheel.
                motor.release()
            };
            obeyed &= done.is_ok();
        }
        self.status.mode = match shaped.status {
            CommandStatus::TimedOut => Mode::TimedOut,
            _ => Mode::Driving,
        };
        self.status.driven = wheels.active;
        self.status.torque_n_m = wheels.applied.n_m;
        if !obeyed {
            self.failed = true;
            self.hold();
        }
    }

    /// No torque anywhere, and the initial state.
    fn hold(&mut self) {
        for motor in &mut self.motors {
            self.failed |= motor.release().is_err();
        }
        self.shaper = ShaperState::default();
        self.loops = ControlState::new();
        self.status.mode = Mode::Held;
        self.status.driven = [false; WHEELS];
        self.status.torque_n_m = [0.0; WHEELS];
    }

    /// Says what the wheels do, every [`REPORT_PERIODS`].
    fn report(&mut self) {
        self.periods_to_report -= 1;
        if self.periods_to_report > 0 {
            return;
        }
        self.periods_to_report = REPORT_PERIODS;
        self.reports = self.reports.wrapping_add(1);
        let status = &self.status;
        let driven = (0..).zip(status.driven).map(|(i, on)| u8::from(on) << i).sum();
        let [ignored, errors] = [status.ignored, status.hardware_errors].map(u16::to_le_bytes);
        let bytes = [
            status.mode as u8,
            driven,
            ignored[0],
            ignored[1],
            errors[0],
            errors[1],
            self.reports,
            0,
        ];
        for (id, data) in [
            (frames::TORQUES, frames::wheels(&status.torque_n_m, 1e3)),
            (frames::VELOCITIES, frames::wheels(&status.velocity_rad_s, 1e2)),
            (frames::STATUS, bytes),
        ] {
            // Without room in the hardware the frame is left out: the next one is newer anyway.
            if let Some(frame) = C::Frame::new(id, &data)
                && let Err(nb::Error::Other(_)) = self.can.transmit(&frame)
            {
                self.failed = true;
            }
        }
    }
}
