//! What a step of traction control costs, without and with its supervisor.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use omni_core::{
    BodyTwist, Readings, SupervisorState, TractionObservation, TractionSample, TractionState, TractionTarget,
    WheelTorques,
};
use omni_firmware::constants::{SUPERVISOR, TRACTION};
use omni_firmware::counter::Counter;
use omni_firmware::platform::exit;
use omni_firmware::{say, stack};

/// What is kept between steps, and what the last one did.
struct Memory {
    state: TractionState<f32, 7>,
    supervisor: SupervisorState<f32>,
    observed: TractionObservation<f32, 7>,
    sample: TractionSample<f32, 7>,
}

impl Memory {
    const fn new() -> Self {
        Self {
            state: TractionState::new(),
            supervisor: SupervisorState::new(),
            observed: TractionObservation::zero(),
            sample: TractionSample::zero(),
        }
    }
}

/// Torques only.
#[inline(never)]
fn lean(state: &mut TractionState<f32, 7>, readings: &Readings<'_, f32>, torques: &mut WheelTorques<f32, 7>) {
    TRACTION.torques_into(state, readings, &TractionTarget::at(0.3), torques);
}

#[inline(never)]
fn step(memory: &mut Memory, readings: &Readings<'_, f32>) {
    let Memory {
        state,
        observed,
        sample,
        ..
    } = memory;
    TRACTION.observe_into(state, readings, observed);
    TRACTION.act_into(state, readings, observed, &TractionTarget::at(0.3), sample);
}

#[inline(never)]
fn supervised(memory: &mut Memory, readings: &Readings<'_, f32>) {
    let Memory {
        state,
        supervisor,
        observed,
        sample,
    } = memory;
    TRACTION.observe_into(state, readings, observed);
    let target = SUPERVISOR.step(supervisor, state, observed);
    TRACTION.act_into(state, readings, observed, &target, sample);
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
    // The front frame pitches up: its wheels climb. Slower than commanded they give all they have, and rows are levelled.
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
        let (mut state, mut torques) = (TractionState::new(), WheelTorques::zero());
        let mut work = |_| {
            lean(
                black_box(&mut state),
                black_box(&readings),
                black_box(&mut torques),
            )
        };
        let starts = counter.most(400, &mut work);
        say!("instructions, traction's torques from rest, {}: {}", case, starts);
        let most = counter.most(400, &mut work);
        say!("instructions, traction's torques, {}: {}", case, most);
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
    let (mut memory, mut torques) = (Memory::new(), WheelTorques::zero());
    let readings = Readings::new(command, &whole);
    say!(
        "stack of a step with traction's torques: {} bytes",
        stack::used_by(|| lean(&mut memory.state, black_box(&readings), &mut torques))
    );
    say!(
        "stack of a step with traction: {} bytes",
        stack::used_by(|| step(&mut memory, black_box(&readings)))
    );
    exit(true)
}
