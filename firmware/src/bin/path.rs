//! What following a path costs, and that the path in flash is the one that was planned.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use omni_core::geometry::PlanarPose;
use omni_core::path::Follow;
use omni_firmware::constants::{FOLLOWER, ON_THE_WAY, TRAJECTORY};
use omni_firmware::counter::Counter;
use omni_firmware::platform::exit;
use omni_firmware::{say, stack};

/// Periods over the whole path.
const TIMES: u32 = 2000;

/// Off by this much at most: `f32` at 4 m is exact to 2.4e-7 m, and a piece adds up six terms of that size.
const ROUNDING: f32 = 2e-6;

#[inline(never)]
fn step(time_s: f32, pose: &PlanarPose<f32>) -> Follow<f32> {
    FOLLOWER.step(&TRAJECTORY.at(time_s), pose)
}

#[entry]
fn main() -> ! {
    for (k, [time_s, x_m, y_m, yaw_rad]) in ON_THE_WAY.into_iter().enumerate() {
        let pose = TRAJECTORY.at(time_s).pose;
        let off = [pose.x_m - x_m, pose.y_m - y_m, pose.yaw_rad - yaw_rad];
        if !off.iter().all(|off| off.abs() <= ROUNDING) {
            say!(
                "the path in flash is elsewhere at place {} of those that were looked at",
                k
            );
            exit(false)
        }
    }
    say!("the path in flash leads where it was planned to");
    let Some(counter) = Counter::start() else {
        say!("no timer to count instructions with");
        exit(false)
    };
    let beside = PlanarPose {
        x_m: 0.3,
        y_m: -0.2,
        yaw_rad: 0.4,
    };
    let part = TRAJECTORY.duration_s() / TIMES as f32;
    let most = counter.most(TIMES, |k| {
        black_box(step(black_box(k as f32 * part), black_box(&beside)));
    });
    say!("instructions, path and follower: {}", most);
    say!(
        "stack of a step with path and follower: {} bytes",
        stack::used_by(|| {
            black_box(step(black_box(1.0), black_box(&beside)));
        })
    );
    exit(true)
}
