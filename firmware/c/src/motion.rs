//! Before the loops and after them: a command within limits and counts in, PWM duty out.

use core::mem::MaybeUninit;

use omni_core::estimate::{Encoder, EncoderState};
use omni_core::shaping::{TwistLimiter, TwistLimiterState};
use omni_core::{BodyTwist, TorqueLimit};

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

/// Makes the state of one wheel's encoder ready for the first reading.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni_encoder_init(state: Option<&mut MaybeUninit<EncoderState<f32, 32>>>) -> bool {
    let Some(state) = state else {
        return false;
    };
    state.write(EncoderState::at_rest());
    true
}

/// Takes in the counter of a wheel's encoder as it stands (16 bits, or more of which the lower 16 are used), once every control period, and
/// gives the wheel's velocity [rad/s]; 0 at the first reading. The counter may wrap around; right while the wheel turns by less than 32768
/// counts a period.
///
/// `since_edge_s` is the time from the last edge to now [s], for encoders whose velocities come from edges; NaN where it is not known.
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni_encoder_step(
    encoder: Option<&Encoder<f32, 32>>,
    state: Option<&mut EncoderState<f32, 32>>,
    raw: u32,
    since_edge_s: f32,
    rad_s: Option<&mut f32>,
) -> bool {
    let (Some(encoder), Some(state), Some(rad_s)) = (encoder, state, rad_s) else {
        return false;
    };
    let read = encoder.step(state, Some(raw), Some(since_edge_s));
    read.map(|read| *rad_s = read).is_some()
}

/// The duty, -1 to 1, of a bridge without a current loop that gives `torque_n_m` [N.m] at `velocity_rad_s` [rad/s], or the nearest there is:
/// `OMNI_MOTORS[i]`. 0 shorts the motor, which brakes; to let a wheel go, open the bridge.
///
/// Returns false, and does nothing, where a pointer is null.
#[unsafe(no_mangle)]
pub extern "C" fn omni_duty(
    motor: Option<&TorqueLimit<f32>>,
    torque_n_m: f32,
    velocity_rad_s: f32,
    duty: Option<&mut f32>,
) -> bool {
    let (Some(motor), Some(duty)) = (motor, duty) else {
        return false;
    };
    *duty = motor.duty(torque_n_m, velocity_rad_s);
    true
}
