//! Simulation of omni-directional vehicles over steps.
#![forbid(unsafe_code)]

pub mod cli;
pub mod controller;
mod error;
pub mod log;
pub mod observation;
mod outcome;
mod run;
mod sensing;
mod simulation;
mod snapshot;
pub mod study;
mod trace;
mod wheels;
mod world;

/// Vehicles and scenarios as plain data from TOML, checked when they are loaded.
pub use omni_config as config;

pub use error::Error;
pub use outcome::{Outcome, Verdict};
pub use run::{Record, control_periods, record, record_with, run, run_logged, run_watched, run_with};
pub use simulation::Simulation;
pub use trace::Trace;
pub use wheels::{ByWheel, WHEEL_POLICIES, WheelsTrace, run_wheels};
pub use world::ground_heights_m;
