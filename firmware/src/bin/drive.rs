//! What `Drive::step` costs as a `[drive]` of defaults makes it: limits, time-out, stops, faults of
//! readings that do not arrive or are no number, odometry.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use omni_core::drive::DriveSample;
use omni_core::{DriveInput, DriveState};
use omni_firmware::constants::DEFAULTS;
use omni_firmware::drive_cost::report;

#[inline(never)]
fn step(state: &mut DriveState<f32, 7>, input: &DriveInput<f32, 7>, sample: &mut DriveSample<f32, 7>) {
    DEFAULTS.step_into(state, input, sample);
}

#[entry]
fn main() -> ! {
    report("drive", &DEFAULTS, step)
}
