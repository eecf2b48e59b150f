//! What the functions of `Controller` have in common: what a null pointer does.

use core::mem::MaybeUninit;

use omni_core::loops::ControlSample;
use omni_core::{BodyTwist, ControlState, Controller, WheelVelocities};

use crate::status::{Status, at};

#[inline]
pub fn init<const N: usize>(
    state: Option<&mut MaybeUninit<ControlState<f32, N>>>,
    sample: Option<&mut MaybeUninit<ControlSample<f32, N>>>,
) -> Result<(), Status> {
    let (state, sample) = (at(state)?, at(sample)?);
    state.write(ControlState::new());
    sample.write(ControlSample::zero());
    Ok(())
}

#[inline]
pub fn step<const N: usize>(
    controller: Option<&Controller<f32, N>>,
    state: Option<&mut ControlState<f32, N>>,
    command: Option<&BodyTwist<f32>>,
    measured: Option<&WheelVelocities<f32, N>>,
    sample: Option<&mut ControlSample<f32, N>>,
) -> Result<(), Status> {
    let (controller, state) = (at(controller)?, at(state)?);
    let (command, measured, sample) = (at(command)?, at(measured)?, at(sample)?);
    controller.step_into(state, command, measured, sample);
    Ok(())
}

#[inline]
pub fn estimate<const N: usize>(
    controller: Option<&Controller<f32, N>>,
    measured: Option<&WheelVelocities<f32, N>>,
    twist: Option<&mut BodyTwist<f32>>,
) -> Result<(), Status> {
    let (controller, measured, twist) = (at(controller)?, at(measured)?, at(twist)?);
    *twist = controller.kinematics().forward(measured);
    Ok(())
}
