//! Simulation of omni-directional vehicles over steps.
#![forbid(unsafe_code)]

mod brain;
pub mod cli;
pub mod controller;
mod description;
mod error;
mod ground;
pub mod learn;
#[cfg(feature = "live")]
mod live;
pub mod log;
pub mod observation;
mod outcome;
mod replay;
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

pub use description::{
    BASE_LINK, WORLD_LINK, ground_urdf, link_frame_m, link_name, vehicle_urdf, wheel_link,
};
pub use error::Error;
#[cfg(feature = "live")]
pub use live::{Live, run_live};
pub use outcome::{Outcome, Verdict};
pub use replay::{Difference, Replay, WheelReplay, replay};
pub use run::{Record, control_periods, record, record_with, run, run_logged, run_watched, run_with};
pub use simulation::Simulation;
pub use trace::Trace;
pub use wheels::{ByWheel, WHEEL_POLICIES, WheelsTrace, run_wheels};
pub use world::ground_heights_m;
