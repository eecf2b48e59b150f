//! What the functions of `Controller` have in common: what a null pointer does.

use core::mem::MaybeUninit;

use omni_core::loops::ControlSample;
use omni_core::{BodyTwist, ControlState, Controller, WheelVelocities};

#[inline]
pub fn init<const N: usize>(
    state: Option<&mut MaybeUninit<ControlState<f32, N>>>,
    sample: Option<&mut MaybeUninit<ControlSample<f32, N>>>,
) -> bool {
    let (Some(state), Some(sample)) = (state, sample) else {
        return false;
    };
    state.write(ControlState::new());
    sample.write(ControlSample::zero());
    true
}

#[inline]
pub fn step<const N: usize>(
    controller: Option<&Controller<f32, N>>,
    state: Option<&mut ControlState<f32, N>>,
    command: Option<&BodyTwist<f32>>,
    measured: Option<&WheelVelocities<f32, N>>,
    sample: Option<&mut ControlSample<f32, N>>,
) -> bool {
    let (Some(controller), Some(state)) = (controller, state) else {
        return false;
    };
    let (Some(command), Some(measured), Some(sample)) = (command, measured, sample) else {
        return false;
    };
    controller.step_into(state, command, measured, sample);
    true
}

#[inline]
pub fn estimate<const N: usize>(
    controller: Option<&Controller<f32, N>>,
    measured: Option<&WheelVelocities<f32, N>>,
    twist: Option<&mut BodyTwist<f32>>,
) -> bool {
    let (Some(controller), Some(measured), Some(twist)) = (controller, measured, twist) else {
        return false;
    };
    *twist = controller.kinematics().forward(measured);
    true
}
