//! Does this build compute what the computer that built it computes, bit for bit, and at what cost?
#![no_std]
#![no_main]

use core::hint::black_box;

#[cfg(target_arch = "arm")]
use cortex_m_rt::entry;
use omni_core::{BodyTwist, WheelVelocities};
use omni_firmware::constants::{CONTROLLER, HASH, LIMITER, ODOMETRY, PERIOD_US, POLICY, VEHICLE, WHEELS};
use omni_firmware::counter::Counter;
use omni_firmware::platform::exit;
use omni_firmware::randomised::Memory;
use omni_firmware::{randomised, say, stack};
#[cfg(target_arch = "riscv32")]
use riscv_rt::entry;

/// Velocity limits, inverse kinematics, seven loops, coordination.
#[inline(never)]
fn step(memory: &mut Memory, command: &BodyTwist<f32>, measured: &WheelVelocities<f32, 7>) {
    randomised::step(&CONTROLLER, &LIMITER, memory, command, measured);
}

/// [`step`], the pose, and what shows slip.
#[inline(never)]
fn step_and_pose(memory: &mut Memory, command: &BodyTwist<f32>, measured: &WheelVelocities<f32, 7>) {
    step(memory, command, measured);
    randomised::pose(&CONTROLLER, &ODOMETRY, memory);
}

type Work = fn(&mut Memory, &BodyTwist<f32>, &WheelVelocities<f32, 7>);

/// Most instructions of 200 steps; `part` of the wheels' velocity is there, so that a small one saturates every torque.
fn most(counter: &Counter, work: Work, part: f32) -> u32 {
    let mut memory = Memory::new();
    let command = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    };
    let whole = CONTROLLER.kinematics().inverse(&command);
    let measured = [1.02, 0.98].map(|ripple| WheelVelocities {
        rad_s: whole.rad_s.map(|v| v * part * ripple),
    });
    let [even, odd] = &measured;
    counter.most(200, |k| {
        let now = if k % 2 == 0 { even } else { odd };
        work(black_box(&mut memory), black_box(&command), black_box(now));
    })
}

/// Most instructions of the randomised steps, where wheels are over their limits in every mixture and readings break.
fn worst(counter: &Counter, work: Work) -> u32 {
    let mut most = 0;
    randomised::hash(randomised::STEPS, |memory, command, measured| {
        most = most
            .max(counter.instructions(|| work(black_box(memory), black_box(command), black_box(measured))));
    });
    most
}

/// Largest torque \[N.m\] of wheels that cannot turn, 0.6 s after the command came to rest.
fn torque_after_a_stop() -> f32 {
    let mut memory = Memory::new();
    let (standing, ahead) = (
        WheelVelocities::zero(),
        BodyTwist {
            vx_m_s: 0.3,
            ..BodyTwist::ZERO
        },
    );
    let periods = |ms: u32| ms * 1000 / PERIOD_US;
    for _ in 0..periods(300) {
        step(&mut memory, &ahead, &standing);
    }
    // The limits of the command let it come to rest first.
    while memory.sample.command != BodyTwist::ZERO {
        step(&mut memory, &BodyTwist::ZERO, &standing);
    }
    for _ in 0..periods(600) {
        step(&mut memory, &BodyTwist::ZERO, &standing);
    }
    let torques = memory.sample.wheels.applied.n_m;
    torques.iter().fold(0.0, |most, torque| torque.abs().max(most))
}

#[entry]
fn main() -> ! {
    say!(
        "omnistep self-test: vehicle {}, policy {}, {} wheels, every {} us",
        VEHICLE,
        POLICY,
        WHEELS,
        PERIOD_US
    );
    let hash = randomised::hash(randomised::STEPS, step_and_pose);
    let same = hash == HASH;
    let verdict = if same {
        "as on the computer that built this"
    } else {
        "NOT as on the computer that built this"
    };
    say!(
        "{} randomised steps: hash {}, {}",
        randomised::STEPS,
        hash,
        verdict
    );
    let costs: [(&str, Work, f32); 4] = [
        ("step, free", step, 1.0),
        ("step, saturated", step, 0.3),
        ("step with odometry and residual, free", step_and_pose, 1.0),
        ("step with odometry and residual, saturated", step_and_pose, 0.3),
    ];
    match Counter::start() {
        Some(counter) => {
            for (name, work, part) in costs {
                say!("instructions, {}: {}", name, most(&counter, work, part));
            }
            say!("instructions, step, at worst: {}", worst(&counter, step));
            say!(
                "instructions, step with odometry and residual, at worst: {}",
                worst(&counter, step_and_pose)
            );
        }
        None => say!("no timer to count instructions with"),
    }
    let pushing = torque_after_a_stop();
    let rests = if pushing == 0.0 { "none" } else { "they still push" };
    say!("torque of blocked wheels after a stop: {}", rests);
    let mut memory = Memory::new();
    let command = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.1,
        wz_rad_s: 0.2,
    };
    let used = stack::used_by(|| {
        step_and_pose(
            &mut memory,
            black_box(&command),
            black_box(&WheelVelocities::zero()),
        )
    });
    say!("stack of a step with odometry and residual: {} bytes", used);
    exit(same && pushing == 0.0)
}
