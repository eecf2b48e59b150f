//! What `Drive::step` costs with every option on: limits with jerk, speed limits, faults, slip,
//! covariance, paths, a command point, discretisation.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use omni_core::drive::DriveSample;
use omni_core::{DriveInput, DriveState};
use omni_firmware::constants::EVERYTHING;
use omni_firmware::drive_cost::report;

#[inline(never)]
fn step(state: &mut DriveState<f32, 7>, input: &DriveInput<f32, 7>, sample: &mut DriveSample<f32, 7>) {
    EVERYTHING.step_into(state, input, sample);
}

#[entry]
fn main() -> ! {
    report("everything on", &EVERYTHING, step)
}
