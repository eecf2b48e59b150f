//! The whole controller of a robot in one step: faults, slip, command, limits, loops and pose.
//!
//! [`Drive`] is the step that firmware runs every period; [`TractionDrive`] adds traction control. [`FaultMonitor`] and
//! [`SlipDetector`] are two of its parts, which also work alone.

mod config;
mod faults;
mod model;
mod policy;
mod sample;
mod slip;
mod state;
mod step;
mod traction;

use crate::Real;

/// The whole periods nearest to a time \[s\], at least one.
fn periods_of<R: Real>(time_s: f64, period_s: R) -> u16 {
    let periods = (R::of(time_s) / period_s + R::of(0.5)).whole_part();
    periods.clamp(1, u32::from(u16::MAX)) as u16
}

pub use config::{DriveConfig, DriveInput};
pub use faults::{Expectation, Fault, FaultConfig, FaultMonitor, FaultState};
pub use model::Drive;
pub use policy::DrivePolicy;
pub use sample::{DriveMode, DriveSample};
#[doc(hidden)]
pub use slip::LEAST_REDUNDANCY;
pub use slip::{SlipConfig, SlipDetector, SlipSample, SlipState};
pub use state::DriveState;
pub use traction::{BodyReadings, TractionDrive, TractionDriveSample, TractionDriveState};
