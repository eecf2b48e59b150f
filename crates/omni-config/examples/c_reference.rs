//! The steps of firmware/c/example/main.c on this computer: the C program has to print the same hash.

use omni_config::{Override, Scenario};
use omni_core::loops::ControlSample;
use omni_core::shaping::TwistLimiterState;
use omni_core::{BodyTwist, ControlState, WheelVelocities};

/// FNV-1a over the bits of a number.
fn take(hash: u32, value: f32) -> u32 {
    value.to_bits().to_le_bytes().iter().fold(hash, |hash, byte| {
        (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193)
    })
}

#[expect(clippy::print_stdout, reason = "an example speaks on standard output")]
fn main() -> Result<(), omni_config::Error> {
    let scenario = Scenario::load("step", &[Override::new("control.policy", "scale_references")])?;
    let controller = scenario.controller::<f32, 7>()?;
    let (limiter, mut limited) = (scenario.limiter()?, TwistLimiterState::new());
    let (mut state, mut sample) = (ControlState::new(), ControlSample::zero());
    let command = BodyTwist {
        vx_m_s: 1.3,
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    };
    let mut measured = WheelVelocities::zero();
    let mut hash = 0x811c_9dc5;
    for k in 0..1000 {
        for i in 0..7 {
            let part = if i == 0 && (300..600).contains(&k) {
                0.25
            } else {
                0.75
            };
            measured.rad_s[i] = part * sample.wheels.reference.rad_s[i];
        }
        let twist = limiter.step(&mut limited, &command);
        controller.step_into(&mut state, &twist, &measured, &mut sample);
        hash = sample.wheels.applied.n_m.into_iter().fold(hash, take);
    }
    let estimate = controller.kinematics().forward(&measured);
    hash = estimate.to_array().into_iter().fold(hash, take);
    println!("{hash}");
    Ok(())
}
