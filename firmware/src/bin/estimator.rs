//! What a step of the estimator costs, with four mecanum wheels.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use omni_core::BodyTwist;
use omni_core::estimate::{EstimatorInput, EstimatorState};
use omni_core::policy::Imu;
use omni_firmware::constants::ESTIMATOR;
use omni_firmware::counter::Counter;
use omni_firmware::platform::exit;
use omni_firmware::{say, stack};

/// From wheels and inertial measurement unit to the pose.
#[inline(never)]
fn step(state: &mut EstimatorState<f32, 4>, wheels: &[f32; 4], imu: &Imu<f32>, command: &BodyTwist<f32>) {
    let input = EstimatorInput::with_imu(&(*wheels).into(), imu, command);
    black_box(ESTIMATOR.step(state, &input));
}

#[entry]
fn main() -> ! {
    let ahead = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    };
    // 0.3 m/s, 0.1 m/s and 0.2 rad/s, by wheels of 76 mm.
    let wheels = [2.0, 5.8, 4.7, 3.3];
    let mut slipping = wheels;
    slipping[1] += 10.0;
    let mut silent = wheels;
    silent[2] = f32::NAN;
    let mut level = Imu::level();
    level.rate_rad_s[2] = 0.2;
    let cases = [
        ("free", wheels, level, ahead),
        ("slipping", slipping, level, ahead),
        ("a wheel lost", silent, level, ahead),
        ("without inertial measurement unit", wheels, Imu::silent(), ahead),
        ("standing", [0.0; 4], Imu::level(), BodyTwist::ZERO),
    ];
    let Some(counter) = Counter::start() else {
        say!("no timer to count instructions with");
        exit(false)
    };
    for (case, wheels, imu, command) in cases {
        let mut state = ESTIMATOR.start();
        let most = counter.most(400, |_| {
            step(
                black_box(&mut state),
                black_box(&wheels),
                black_box(&imu),
                black_box(&command),
            )
        });
        say!("instructions, estimator, {}: {}", case, most);
    }
    let mut state = ESTIMATOR.start();
    say!(
        "stack of a step with the estimator: {} bytes",
        stack::used_by(|| step(
            &mut state,
            black_box(&wheels),
            black_box(&level),
            black_box(&ahead)
        ))
    );
    exit(true)
}
