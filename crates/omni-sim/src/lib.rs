#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod control_loop;
mod control_sample;
pub mod controller;
mod error;
mod following;
pub mod ground;
mod ground_odometry;
mod history;
pub mod learn;
mod link_counters;
mod motors_on_dampers;
pub mod observation;
mod odometry;
mod outcome;
mod period;
mod report;
mod run;
mod sensed;
mod sensing;
mod simulation;
mod snapshot;
mod state_bytes;
mod stepped_run;
mod trace;
mod wall_clock;
mod wheel_signals;
mod world;

/// The version of the simulation: a run of another one is another run.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Vehicles and scenarios as plain data from TOML, checked when they are loaded.
pub use omni_config as config;

pub use control_loop::ControlLoop;
pub use error::Error;
pub use history::{outcome_of, trace_of};
pub use motors_on_dampers::{ByWheel, MOTOR_BENCH_POLICIES, MotorBenchTrace, run_motor_bench};
pub use observation::OdometryEstimate;
pub use outcome::{Better, BodyName, LimitedBy, Metric, Outcome, Verdict};
pub use period::Period;
pub use report::{
    DriveReport, DriveWheel, GroundReport, GroundWheel, Report, ReportColumns, TractionReport, TractionWheel,
};
pub use run::{Run, control_periods, run};
pub use sensed::Sensed;
pub use simulation::Simulation;
pub use stepped_run::SteppedRun;
pub use trace::{Rows, Trace, TraceBuilder};
pub use wheel_signals::{LOGGED_SIGNALS, WheelSignal, WheelSignals};
pub use world::{
    AxleDrive, BodyState, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep, Touch,
    ground_heights_m,
};
