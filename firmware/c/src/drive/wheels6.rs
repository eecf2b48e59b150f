//! `Drive` of six wheels.

use core::mem::MaybeUninit;

use omni_core::Drive;

use super::{Deviations, Input, Output, State};

/// Makes the state and the output of a six-wheel vehicle ready for the first step: at rest at the origin, every wheel trusted.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_drive_init(
    drive: Option<&Drive<f32, 6>>,
    state: Option<&mut MaybeUninit<State<6, 216>>>,
    output: Option<&mut MaybeUninit<Output<6>>>,
) -> bool {
    super::init(drive, state, output)
}

/// One control period of a six-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`. To be called once every
/// period that the drive was made for, always with the same `drive`.
///
/// Never fails: nonsense in the input is refused, or its wheel is released. `input` must not lie within `output`.
/// Returns false, and does nothing, where a pointer is null or the state was not made ready.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_drive_step(
    drive: Option<&Drive<f32, 6>>,
    state: Option<&mut State<6, 216>>,
    input: Option<&Input<6>>,
    output: Option<&mut Output<6>>,
) -> bool {
    super::step(drive, state, input, output)
}

/// Brings a six-wheel vehicle to rest at the emergency deceleration from the next step on, whatever is commanded.
///
/// Returns false, and does nothing, where the pointer is null or the state was not made ready.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_drive_emergency_stop(state: Option<&mut State<6, 216>>) -> bool {
    super::change(state, |state| state.emergency_stop())
}

/// Ends an emergency stop; a safe stop stays. Commands that arrive from now on are followed.
///
/// Returns false, and does nothing, where the pointer is null or the state was not made ready.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_drive_release_emergency_stop(state: Option<&mut State<6, 216>>) -> bool {
    super::change(state, |state| state.release_emergency_stop())
}

/// Ends a safe stop; an emergency stop stays. Every reading is judged afresh, and commands that arrive from now on are followed.
/// A safe stop whose cause lasts begins anew.
///
/// Returns false, and does nothing, where the pointer is null or the state was not made ready.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_drive_release_safe_stop(state: Option<&mut State<6, 216>>) -> bool {
    super::change(state, |state| state.release_safe_stop())
}

/// Somebody has seen where the vehicle is: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad` [rad]. How far it may be off stays.
///
/// Returns false, and does nothing, where the pointer is null, the state was not made ready or a number is not finite.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_drive_reset_pose(
    state: Option<&mut State<6, 216>>,
    x_m: f32,
    y_m: f32,
    yaw_rad: f32,
) -> bool {
    super::reset_pose(state, [x_m, y_m, yaw_rad])
}

/// How far the pose may be off.
///
/// Returns false, and does nothing, where a pointer is null or the state was not made ready.
#[unsafe(no_mangle)]
pub extern "C" fn omni6_drive_deviations(
    state: Option<&mut State<6, 216>>,
    deviations: Option<&mut Deviations>,
) -> bool {
    super::deviations(state, deviations)
}
