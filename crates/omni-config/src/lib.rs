//! Vehicles and scenarios as plain data from TOML, checked when they are loaded.
//!
//! Every key is checked: an unknown key, a missing one, a wrong type, a NaN or a value out of range is one line that
//! names the file, the key, the value and what is allowed.
//!
//! No physics in here: simulation, Python and the builds of firmware read the same files with it.

#![forbid(unsafe_code)]

mod check;
mod constants;
mod control;
mod error;
mod file;
mod load;
mod rollers;
mod scenario;
mod tagged;
mod vehicle;
mod wheels;

pub use constants::{Language, rust_expression};
pub use control::wheel_count_refused;
pub use error::Error;
pub use file::{File, FileKind};
pub use load::{Override, Source, builtin_scenarios, builtin_vehicles};
pub use rollers::{Barrel, Ripple, RollerWheel, Rollers, WheelModel};
pub use scenario::{Command, Control, Perturbation, Physics, Precision, Scenario, Terrain};
pub use vehicle::{Body, Gains, Hinge, Limits, Motor, Vehicle, WheelContact, WheelSpec};
pub use wheels::{DamperLoad, WheelsExperiment};

/// The version of the file format that this release reads.
pub const SCHEMA_VERSION: u32 = 1;
