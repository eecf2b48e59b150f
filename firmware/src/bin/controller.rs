//! The controller and nothing else: what it costs in flash and RAM. `self_test` measures the same functions.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use omni_core::loops::ControlSample;
use omni_core::shaping::TwistLimiterState;
use omni_core::{BodyTwist, ControlState, WheelVelocities};
use omni_firmware::constants::{CONTROLLER, LIMITER};

#[entry]
fn main() -> ! {
    static mut LIMITED: TwistLimiterState<f32> = TwistLimiterState::new();
    static mut STATE: ControlState<f32, 7> = ControlState::new();
    static mut SAMPLE: ControlSample<f32, 7> = ControlSample::zero();
    loop {
        // Here a vehicle reads the bus and the encoders, and writes the torques.
        let command = core::hint::black_box(BodyTwist::ZERO);
        let measured = core::hint::black_box(WheelVelocities::zero());
        let twist = LIMITER.step(LIMITED, &command);
        CONTROLLER.step_into(STATE, &twist, &measured, SAMPLE);
        core::hint::black_box(&SAMPLE.wheels.applied);
    }
}
