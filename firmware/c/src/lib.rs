//! omni-core for C: see `include/omnistep.h`.
//!
//! Written out for each wheel count, because cbindgen reads source and expands no macro. What a null pointer does is in one
//! place, below.
#![no_std]

mod drive;
mod motion;

use core::mem::MaybeUninit;

use omni_core::loops::ControlSample;
use omni_core::shaping::{TwistLimiter, TwistLimiterState};
use omni_core::{BodyTwist, ControlState, Controller, WheelVelocities};

/// A panic that could happen is an error of the linker: it finds no such function.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        safe fn omnistep_a_panic_is_reachable() -> !;
    }
    omnistep_a_panic_is_reachable()
}

#[inline]
fn init<const N: usize>(
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
fn step<const N: usize>(
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
fn estimate<const N: usize>(
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

/// Makes the state and the sample of a three-wheel vehicle ready for the first step.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni3_init(
    state: Option<&mut MaybeUninit<ControlState<f32, 3>>>,
    sample: Option<&mut MaybeUninit<ControlSample<f32, 3>>>,
) -> bool {
    init(state, sample)
}

/// One control period of a three-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
/// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
///
/// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
/// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni3_step(
    controller: Option<&Controller<f32, 3>>,
    state: Option<&mut ControlState<f32, 3>>,
    command: Option<&BodyTwist<f32>>,
    measured: Option<&WheelVelocities<f32, 3>>,
    sample: Option<&mut ControlSample<f32, 3>>,
) -> bool {
    step(controller, state, command, measured, sample)
}

/// The motion that the measured wheel velocities [rad/s] of a three-wheel vehicle amount to, by least squares.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni3_estimate(
    controller: Option<&Controller<f32, 3>>,
    measured: Option<&WheelVelocities<f32, 3>>,
    twist: Option<&mut BodyTwist<f32>>,
) -> bool {
    estimate(controller, measured, twist)
}

/// Makes the state and the sample of a four-wheel vehicle ready for the first step.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni4_init(
    state: Option<&mut MaybeUninit<ControlState<f32, 4>>>,
    sample: Option<&mut MaybeUninit<ControlSample<f32, 4>>>,
) -> bool {
    init(state, sample)
}

/// One control period of a four-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
/// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
///
/// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
/// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni4_step(
    controller: Option<&Controller<f32, 4>>,
    state: Option<&mut ControlState<f32, 4>>,
    command: Option<&BodyTwist<f32>>,
    measured: Option<&WheelVelocities<f32, 4>>,
    sample: Option<&mut ControlSample<f32, 4>>,
) -> bool {
    step(controller, state, command, measured, sample)
}

/// The motion that the measured wheel velocities [rad/s] of a four-wheel vehicle amount to, by least squares.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni4_estimate(
    controller: Option<&Controller<f32, 4>>,
    measured: Option<&WheelVelocities<f32, 4>>,
    twist: Option<&mut BodyTwist<f32>>,
) -> bool {
    estimate(controller, measured, twist)
}

/// Makes the state and the sample of a six-wheel vehicle ready for the first step.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_init(
    state: Option<&mut MaybeUninit<ControlState<f32, 6>>>,
    sample: Option<&mut MaybeUninit<ControlSample<f32, 6>>>,
) -> bool {
    init(state, sample)
}

/// One control period of a six-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
/// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
///
/// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
/// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_step(
    controller: Option<&Controller<f32, 6>>,
    state: Option<&mut ControlState<f32, 6>>,
    command: Option<&BodyTwist<f32>>,
    measured: Option<&WheelVelocities<f32, 6>>,
    sample: Option<&mut ControlSample<f32, 6>>,
) -> bool {
    step(controller, state, command, measured, sample)
}

/// The motion that the measured wheel velocities [rad/s] of a six-wheel vehicle amount to, by least squares.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_estimate(
    controller: Option<&Controller<f32, 6>>,
    measured: Option<&WheelVelocities<f32, 6>>,
    twist: Option<&mut BodyTwist<f32>>,
) -> bool {
    estimate(controller, measured, twist)
}

/// Makes the state and the sample of a seven-wheel vehicle ready for the first step.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni7_init(
    state: Option<&mut MaybeUninit<ControlState<f32, 7>>>,
    sample: Option<&mut MaybeUninit<ControlSample<f32, 7>>>,
) -> bool {
    init(state, sample)
}

/// One control period of a seven-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
/// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
///
/// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
/// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni7_step(
    controller: Option<&Controller<f32, 7>>,
    state: Option<&mut ControlState<f32, 7>>,
    command: Option<&BodyTwist<f32>>,
    measured: Option<&WheelVelocities<f32, 7>>,
    sample: Option<&mut ControlSample<f32, 7>>,
) -> bool {
    step(controller, state, command, measured, sample)
}

/// The motion that the measured wheel velocities [rad/s] of a seven-wheel vehicle amount to, by least squares.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni7_estimate(
    controller: Option<&Controller<f32, 7>>,
    measured: Option<&WheelVelocities<f32, 7>>,
    twist: Option<&mut BodyTwist<f32>>,
) -> bool {
    estimate(controller, measured, twist)
}

/// Brings `command` within the vehicle's limits, for one control period; `limited` is what to give to the step. `state` is
/// all zero at the start: `static omni_limiter_state state;`.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni_limit(
    limiter: Option<&TwistLimiter<f32>>,
    state: Option<&mut TwistLimiterState<f32>>,
    command: Option<&BodyTwist<f32>>,
    limited: Option<&mut BodyTwist<f32>>,
) -> bool {
    let (Some(limiter), Some(state)) = (limiter, state) else {
        return false;
    };
    let (Some(command), Some(limited)) = (command, limited) else {
        return false;
    };
    *limited = limiter.step(state, command);
    true
}
