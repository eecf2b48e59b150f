//! What a step of traction control costs, without and with its supervisor.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use omni_core::traction::{SupervisorState, TractionSample, TractionState, TractionTarget};
use omni_core::{BodyTwist, Readings};
use omni_firmware::constants::{SUPERVISOR, TRACTION};
use omni_firmware::counter::Counter;
use omni_firmware::platform::exit;
use omni_firmware::{say, stack};

/// What is kept between steps, and what the last one did.
struct Memory {
    state: TractionState<f32, 7>,
    supervisor: SupervisorState<f32>,
    sample: TractionSample<f32, 7>,
}

impl Memory {
    const fn new() -> Self {
        Self {
            state: TractionState::new(),
            supervisor: SupervisorState::new(),
            sample: TractionSample::zero(),
        }
    }
}

#[inline(never)]
fn step(memory: &mut Memory, readings: &Readings<'_, f32>) {
    TRACTION.step_into(
        &mut memory.state,
        readings,
        &TractionTarget::at(0.3),
        &mut memory.sample,
    );
}

#[inline(never)]
fn supervised(memory: &mut Memory, readings: &Readings<'_, f32>) {
    TRACTION.command(&mut memory.state, &readings.command);
    let target = SUPERVISOR.step(&mut memory.supervisor, &memory.state);
    TRACTION.step_into(&mut memory.state, readings, &target, &mut memory.sample);
}

#[entry]
fn main() -> ! {
    let command = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.0,
        wz_rad_s: 0.0,
    };
    let whole = TRACTION.kinematics().inverse(&command).rad_s;
    let mut slipping = whole;
    slipping[0] += 2.0;
    let slow = slipping.map(|rate| 0.5 * rate);
    // The front frame pitches up: its wheels climb. Slower than commanded they give all they have,
    // and rows are levelled.
    let cases = [
        ("free", whole, [0.0, 0.0], [0.0, 0.0]),
        ("slipping", slipping, [0.0, 0.0], [0.0, 0.0]),
        ("climbing", slipping, [-0.15, 0.02], [-0.6, 0.05]),
        ("pulling", slow, [-0.15, 0.02], [-0.3, 0.03]),
        ("without hinge encoders", whole, [f32::NAN; 2], [f32::NAN; 2]),
    ];
    let Some(counter) = Counter::start() else {
        say!("no timer to count instructions with");
        exit(false)
    };
    for (case, wheels, angles, rates) in cases {
        let mut readings = Readings::new(command, &wheels);
        (readings.hinges_rad, readings.hinges_rad_s) = (&angles, &rates);
        let mut memory = Memory::new();
        let starts = counter.most(400, |_| step(black_box(&mut memory), black_box(&readings)));
        say!("instructions, traction from rest, {}: {}", case, starts);
        let most = counter.most(400, |_| step(black_box(&mut memory), black_box(&readings)));
        say!("instructions, traction, {}: {}", case, most);
        let mut memory = Memory::new();
        let most = counter.most(400, |_| supervised(black_box(&mut memory), black_box(&readings)));
        say!(
            "instructions, traction and supervisor from rest, {}: {}",
            case,
            most
        );
        let most = counter.most(400, |_| supervised(black_box(&mut memory), black_box(&readings)));
        say!("instructions, traction and supervisor, {}: {}", case, most);
    }
    let mut memory = Memory::new();
    let readings = Readings::new(command, &whole);
    say!(
        "stack of a step with traction: {} bytes",
        stack::used_by(|| step(&mut memory, black_box(&readings)))
    );
    exit(true)
}
