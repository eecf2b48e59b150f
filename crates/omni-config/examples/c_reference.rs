//! The steps of firmware/c/example/main.c on this computer: the C program has to print the same hash.

mod fnv;

use fnv::{START, take_all};
use omni_config::{Override, Scenario};
use omni_core::loops::ControlSample;
use omni_core::shaping::TwistLimiterState;
use omni_core::{BodyTwist, ControlState, WheelVelocities};

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
    let mut hash = START;
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
        hash = take_all(hash, &sample.wheels.applied.n_m);
    }
    let estimate = controller.kinematics().forward(&measured);
    hash = take_all(hash, &estimate.to_array());
    println!("{hash}");
    Ok(())
}
