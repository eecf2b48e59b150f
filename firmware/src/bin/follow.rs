//! A path followed by the pose that an estimator finds: the same steps as `c/example/path.c`, the same bits.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use omni_core::estimate::{EstimatorInput, PoseCovariance};
use omni_core::geometry::PlanarPose;
use omni_core::loops::ControlSample;
use omni_core::policy::Imu;
use omni_core::{BodyTwist, ControlState, WheelVelocities};
use omni_firmware::platform::exit;
use omni_firmware::say;

/// Written by the build script.
mod constants {
    include!(concat!(env!("OUT_DIR"), "/figure_eight.rs"));
}
use constants::{CONTROLLER, ESTIMATOR, FOLLOWER, TRAJECTORY};

/// FNV-1a over the bits of numbers.
fn take(hash: u32, values: &[f32]) -> u32 {
    values.iter().fold(hash, |hash, value| {
        let bytes = value.to_bits().to_le_bytes();
        bytes.iter().fold(hash, |hash, byte| take_byte(hash, *byte))
    })
}

fn take_byte(hash: u32, byte: u8) -> u32 {
    (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
}

fn take_pose(hash: u32, pose: &PlanarPose<f32>) -> u32 {
    take(hash, &[pose.x_m, pose.y_m, pose.yaw_rad])
}

#[entry]
fn main() -> ! {
    let (mut control, mut sample) = (ControlState::new(), ControlSample::zero());
    let mut state = ESTIMATOR.start();
    let mut wheels = WheelVelocities::zero();
    let mut moves = BodyTwist::<f32>::ZERO;
    let mut hash = 0x811c_9dc5;
    let end = (TRAJECTORY.duration_s() * 1000.0) as u32;
    for k in 0..end + 1000 {
        let on_the_way = TRAJECTORY.at(k as f32 * 0.001);
        let follow = FOLLOWER.step(&on_the_way, &state.pose());
        CONTROLLER.step_into(&mut control, &follow.twist, &wheels, &mut sample);
        for (rate, reference) in wheels.rad_s.iter_mut().zip(sample.wheels.reference.rad_s) {
            *rate += 0.05 * (reference - *rate);
        }
        let mut measured = wheels;
        if (3000..3400).contains(&k) {
            measured.rad_s[2] = f32::NAN;
        }
        if (5000..5200).contains(&k) {
            measured.rad_s[1] += 4.0;
        }
        let moved = moves;
        moves = CONTROLLER.kinematics().forward(&wheels);
        let mut imu = Imu::silent();
        if !(7000..7500).contains(&k) {
            imu = Imu::level();
            imu.rate_rad_s[2] = moves.wz_rad_s;
            imu.specific_force_m_s2[0] =
                (moves.vx_m_s - moved.vx_m_s) * 1000.0 - moves.wz_rad_s * moves.vy_m_s;
            imu.specific_force_m_s2[1] =
                (moves.vy_m_s - moved.vy_m_s) * 1000.0 + moves.wz_rad_s * moves.vx_m_s;
        }
        if k == 9000 {
            let pose = state.pose();
            let seen = PlanarPose {
                x_m: pose.x_m + 0.01,
                ..pose
            };
            let variances = [0.005_f32, 0.005, 0.01].map(|off| off * off);
            if let Ok(known) = PoseCovariance::diagonal(variances) {
                state.reset(&seen, &known);
            }
        }
        let mut input = EstimatorInput::with_imu(&measured, &imu, &BodyTwist::ZERO);
        input.commanded_rest = on_the_way.done;
        let step = ESTIMATOR.step(&mut state, &input);
        hash = take(hash, &follow.twist.to_array());
        hash = take_pose(take_pose(hash, &state.pose()), &on_the_way.pose);
        hash = take(take(hash, &state.twist().to_array()), &state.slip().to_array());
        hash = take(hash, &[state.gyro_bias_rad_s(), step.nis]);
        hash = take_byte(take_byte(hash, step.readings as u8), u8::from(step.standing));
    }
    hash = take(hash, &state.covariance().standard_deviations());
    say!("the path of mecanum4, hash {}", hash);
    exit(true)
}
