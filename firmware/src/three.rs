//! The control task of a base with three omni wheels: counters of encoders in, duty of the motors' bridges out.

use omni_core::drive::DriveSample;
use omni_core::estimate::EncoderState;
use omni_core::{BodyTwist, DriveInput, DriveState, WheelVelocities};

mod constants {
    include!(concat!(env!("OUT_DIR"), "/three.rs"));
}
use constants::{DRIVE, ENCODER, ENCODER_WINDOW, MOTORS, WHEELS};

/// The board: these are yours.
pub trait Board {
    /// The counter of a timer in encoder mode; none where it cannot be read.
    fn counter(&mut self, wheel: usize) -> Option<u32>;
    /// The command \[m/s, m/s, rad/s\]; none where none came since the last period.
    fn command(&mut self) -> Option<BodyTwist<f32>>;
    /// PWM and direction of a bridge: -1 to 1. 0 shorts the motor, which brakes.
    fn set_duty(&mut self, wheel: usize, duty: f32);
    /// The wheel rolls freely.
    fn open_bridge(&mut self, wheel: usize);
}

/// State between periods.
pub struct Base {
    drive: DriveState<f32, WHEELS>,
    encoders: [EncoderState<f32, ENCODER_WINDOW>; WHEELS],
}

impl Base {
    /// Before the first period.
    pub fn at_start() -> Self {
        Self {
            drive: DriveState::new(&DRIVE),
            encoders: [EncoderState::at_rest(); WHEELS],
        }
    }

    /// To be called from a timer's interrupt, every `PERIOD_US`.
    pub fn every_period(&mut self, board: &mut impl Board) -> DriveSample<f32, WHEELS> {
        let mut input = DriveInput::measured(&WheelVelocities::zero());
        for wheel in 0..WHEELS {
            // A period without a reading is one too: the next velocity is right about the time.
            input.readings_rad_s[wheel] = ENCODER.step(&mut self.encoders[wheel], board.counter(wheel), None);
        }
        input.command = board.command();
        let sample = DRIVE.step(&mut self.drive, &input);
        for wheel in 0..WHEELS {
            if sample.brake[wheel] {
                board.set_duty(wheel, 0.0);
            } else if sample.wheels.active[wheel] {
                let torque_n_m = sample.wheels.applied.n_m[wheel];
                let velocity_rad_s = sample.wheels.measured.rad_s[wheel];
                board.set_duty(wheel, MOTORS[wheel].duty(torque_n_m, velocity_rad_s));
            } else {
                board.open_bridge(wheel);
            }
        }
        sample
    }
}
