//! `three.rs` on a bench: three motors with their encoders, computed, a command that stops, and an
//! encoder whose cable breaks. The same steps as firmware/c/example/three_bench.c, the same bits.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use omni_core::drive::{DriveSample, Fault};
use omni_core::shaping::CommandStatus;
use omni_core::{BodyTwist, DriveMode};
use omni_firmware::platform::exit;
use omni_firmware::say;
use omni_firmware::three::{Base, Board};

// A 12 V gear motor of 1 N.m and 33 rad/s, and what its wheel moves: as the vehicle omni3 has them.
const STALL_N_M: f32 = 1.0;
const SLOPE_N_M_S_RAD: f32 = 0.03;
const INERTIA_KG_M2: f32 = 0.013;
const PERIOD_S: f32 = 0.001;
/// 1440 a turn.
const COUNTS_PER_RAD: f32 = 229.183_12;

/// What is left of the counter of a timer when a cable breaks. A timer can always be read.
#[derive(Clone, Copy)]
enum Broken {
    /// The supply or the plug: it stands.
    Cable,
    /// One channel alone: as the shaft turns, each edge of the other one counts up and down again.
    Channel,
}

/// In this period.
const BREAKS: u32 = 2800;

/// A shorted motor brakes the wheel from 17 rad/s, with 13 / 30 s.
const PERIODS: u32 = 5500;
const LAST: u32 = PERIODS - 1;

/// Periods of rest within which every torque falls to 0: `control.rest.bleed_s`.
const BLEED: u32 = 500;

struct Bench {
    period: u32,
    /// Periods in a row with every reference at 0.
    rested: u32,
    broken: Broken,
    stood: u16,
    rad_s: [f32; 3],
    part: [f32; 3],
    duties: [f32; 3],
    opened: [bool; 3],
    counters: [u16; 3],
}

impl Board for Bench {
    fn counter(&mut self, wheel: usize) -> Option<u32> {
        let counter = self.counters[wheel % 3];
        if wheel != 1 || self.period < BREAKS {
            return Some(u32::from(counter));
        }
        if self.period == BREAKS {
            self.stood = counter;
        }
        let counter = match self.broken {
            Broken::Cable => self.stood,
            Broken::Channel => self.stood.wrapping_add(counter / 2 % 2),
        };
        Some(u32::from(counter))
    }

    fn command(&mut self) -> Option<BodyTwist<f32>> {
        let commanded = self.period.is_multiple_of(20) && (self.period < 1500 || self.period >= 2300);
        commanded.then_some(BodyTwist {
            vx_m_s: 0.4,
            vy_m_s: 0.2,
            wz_rad_s: 0.5,
        })
    }

    fn set_duty(&mut self, wheel: usize, duty: f32) {
        self.duties[wheel % 3] = duty;
        self.opened[wheel % 3] = false;
    }

    fn open_bridge(&mut self, wheel: usize) {
        self.opened[wheel % 3] = true;
    }
}

impl Bench {
    fn turn(&mut self, i: usize) {
        let torque = if self.opened[i] {
            0.0
        } else {
            STALL_N_M * self.duties[i] - SLOPE_N_M_S_RAD * self.rad_s[i]
        };
        self.rad_s[i] = self.rad_s[i] + torque / INERTIA_KG_M2 * PERIOD_S;
        self.part[i] = self.part[i] + self.rad_s[i] * PERIOD_S * COUNTS_PER_RAD;
        let whole = self.part[i] as i32;
        self.part[i] -= whole as f32;
        self.counters[i] = self.counters[i].wrapping_add(whole as u16);
    }

    /// Is it so after this period? A hash alone would not say that the wheels turned.
    fn as_expected(&mut self, sample: &DriveSample<f32, 3>) -> bool {
        let references = sample.wheels.reference.rad_s;
        self.rested = if references == [0.0; 3] {
            self.rested + 1
        } else {
            0
        };
        // Whatever the dead encoder reads: torque ends when it is said to end, and wheels with
        // accepted readings are driven until then.
        let over = self.rested > BLEED;
        let wheels = &sample.wheels;
        let none = wheels.active == [false; 3] && wheels.applied.n_m == [0.0; 3];
        if over != wheels.ended || over && !none || !over && !(wheels.active[0] && wheels.active[2]) {
            return false;
        }
        let near = |wanted: [f32; 3]| {
            self.rad_s
                .iter()
                .zip(wanted)
                .all(|(v, wanted)| (v - wanted).abs() < 0.11)
        };
        match self.period {
            // At the command: within a hundredth of the fastest wheel's 11 rad/s.
            1499 => near(references) && sample.mode == DriveMode::Normal,
            // No command for 0.8 s: at rest.
            2299 => near([0.0; 3]) && sample.shaped.status == CommandStatus::TimedOut,
            // The counter has stood for 0.1 s: it reads exactly 0. It also stood for 0.1 s while half
            // the motor's torque acted and others turned.
            BREAKS => sample.faults[1].is_none(),
            3099 => sample.faults[1] == Some(Fault::Stuck) && sample.brake[1],
            // Three wheels have no redundancy: a safe stop, at the end of which every motor is shorted.
            LAST => near([0.0; 3]) && sample.mode == DriveMode::SafeStop && over && sample.brake == [true; 3],
            _ => true,
        }
    }
}

/// FNV-1a.
fn take(hash: u32, value: f32) -> u32 {
    value.to_bits().to_le_bytes().iter().fold(hash, |hash, byte| {
        (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193)
    })
}

#[entry]
fn main() -> ! {
    let (mut hash, mut good) = (0x811c_9dc5, true);
    for broken in [Broken::Cable, Broken::Channel] {
        let mut base = Base::at_start();
        let mut bench = Bench {
            period: 0,
            rested: 0,
            broken,
            stood: 0,
            rad_s: [0.0; 3],
            part: [0.0; 3],
            duties: [0.0; 3],
            opened: [false; 3],
            counters: [65_000, 500, 0], // the first wraps upwards, the second downwards
        };
        for period in 0..PERIODS {
            bench.period = period;
            let sample = base.every_period(&mut bench);
            for i in 0..3 {
                bench.turn(i);
                hash = take(take(hash, bench.duties[i]), bench.rad_s[i]);
            }
            if !bench.as_expected(&sample) {
                say!("after period {} it is not as expected", period);
                good = false;
            }
        }
    }
    say!(
        "three wheels: hash {}{}",
        hash,
        if good { "" } else { ", not as expected" }
    );
    exit(good)
}
