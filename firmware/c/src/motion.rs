//! Before the loops and after them: a command within limits, counts and inertial readings in, PWM duty out.

use core::mem::MaybeUninit;

use omni_core::estimate::{Encoder, EncoderState};
use omni_core::policy::Imu;
use omni_core::shaping::{TwistLimiter, TwistLimiterState};
use omni_core::{BodyTwist, TorqueLimit};

use crate::status::{Status, at, finite};

/// Brings `command` within the vehicle's limits, for one control period; `limited` is what to give
/// to the step. `state` is all zero at the start: `static omni_limiter_state state;`.
#[unsafe(no_mangle)]
pub extern "C" fn omni_limit(
    limiter: Option<&TwistLimiter<f32>>,
    state: Option<&mut TwistLimiterState<f32>>,
    command: Option<&BodyTwist<f32>>,
    limited: Option<&mut BodyTwist<f32>>,
) -> Status {
    let limit = || {
        let (limiter, state, command) = (at(limiter)?, at(state)?, at(command)?);
        *at(limited)? = limiter.step(state, command);
        Ok(())
    };
    limit().into()
}

/// Makes the state of one wheel's encoder ready for the first reading.
#[unsafe(no_mangle)]
pub extern "C" fn omni_encoder_init(state: Option<&mut MaybeUninit<EncoderState<f32, 32>>>) -> Status {
    let Some(state) = state else {
        return Status::NullPointer;
    };
    state.write(EncoderState::at_rest());
    Status::Ok
}

/// Takes in the counter of a wheel's encoder as it stands (16 bits, or more of which the lower 16 are
/// used), once every control period, and gives the wheel's velocity [rad/s]; 0 at the first reading.
/// The counter may wrap around; right while the wheel turns by less than 32768 counts per period.
///
/// `since_edge_s` is the time from the last edge to now [s], for encoders whose velocities come
/// from edges; NaN if it is not known.
#[unsafe(no_mangle)]
pub extern "C" fn omni_encoder_step(
    encoder: Option<&Encoder<f32, 32>>,
    state: Option<&mut EncoderState<f32, 32>>,
    raw: u32,
    since_edge_s: f32,
    rad_s: Option<&mut f32>,
) -> Status {
    let (Some(encoder), Some(state), Some(rad_s)) = (encoder, state, rad_s) else {
        return Status::NullPointer;
    };
    *rad_s = encoder.step(state, Some(raw), Some(since_edge_s)).unwrap_or(0.0);
    Status::Ok
}

/// The same for a counter that was read `since_reading_s` [s] after the last time, if that was
/// measured: a period that came late or is not constant.
#[unsafe(no_mangle)]
pub extern "C" fn omni_encoder_step_after(
    encoder: Option<&Encoder<f32, 32>>,
    state: Option<&mut EncoderState<f32, 32>>,
    raw: u32,
    since_reading_s: f32,
    since_edge_s: f32,
    rad_s: Option<&mut f32>,
) -> Status {
    let (Some(encoder), Some(state), Some(rad_s)) = (encoder, state, rad_s) else {
        return Status::NullPointer;
    };
    *rad_s = encoder.step_after(state, raw, since_reading_s, Some(since_edge_s));
    Status::Ok
}

/// A control period in which the counter could not be read, instead of `omni_encoder_step`: the
/// next reading is right about the time.
#[unsafe(no_mangle)]
pub extern "C" fn omni_encoder_missed(
    encoder: Option<&Encoder<f32, 32>>,
    state: Option<&mut EncoderState<f32, 32>>,
) -> Status {
    let (Some(encoder), Some(state)) = (encoder, state) else {
        return Status::NullPointer;
    };
    encoder.step(state, None, None);
    Status::Ok
}

/// Makes the readings of an inertial measurement unit ready for the first one, if it computes no angles itself.
#[unsafe(no_mangle)]
pub extern "C" fn omni_imu_init(imu: Option<&mut MaybeUninit<Imu<f32>>>) -> Status {
    let Some(imu) = imu else {
        return Status::NullPointer;
    };
    imu.write(Imu::silent());
    Status::Ok
}

/// Follows `roll_rad` and `pitch_rad` by `rate_rad_s` and `specific_force_m_s2`, which were read `period_s` [s] after
/// the last time. `OMNI_STATUS_NOT_FINITE` if one of them is no number, or the first force is far from 1 g: the angles
/// stay, and the unit counts as not received.
#[unsafe(no_mangle)]
pub extern "C" fn omni_imu_update_angles(imu: Option<&mut Imu<f32>>, period_s: f32) -> Status {
    let Some(imu) = imu else {
        return Status::NullPointer;
    };
    finite(imu.update_angles(period_s)).into()
}

/// The duty, -1 to 1, of a bridge without a current loop that applies `torque_n_m` [N.m] at `velocity_rad_s` [rad/s],
/// or the nearest there is: `OMNI_MOTORS[i]`. 0 shorts the motor, which brakes; to let a wheel go, open the bridge.
#[unsafe(no_mangle)]
pub extern "C" fn omni_duty(
    motor: Option<&TorqueLimit<f32>>,
    torque_n_m: f32,
    velocity_rad_s: f32,
    duty: Option<&mut f32>,
) -> Status {
    omni_duty_at(motor, torque_n_m, velocity_rad_s, 1.0, duty)
}

/// `omni_duty` if the supply has `supply_part` of the voltage of `OMNI_MOTORS`, above 0:
/// a battery that runs down. 0 for a part that is not above 0.
#[unsafe(no_mangle)]
pub extern "C" fn omni_duty_at(
    motor: Option<&TorqueLimit<f32>>,
    torque_n_m: f32,
    velocity_rad_s: f32,
    supply_part: f32,
    duty: Option<&mut f32>,
) -> Status {
    let (Some(motor), Some(duty)) = (motor, duty) else {
        return Status::NullPointer;
    };
    *duty = motor.duty_at(torque_n_m, velocity_rad_s, supply_part);
    Status::Ok
}
