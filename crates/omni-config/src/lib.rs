//! Vehicles and scenarios as plain data from TOML, checked when they are loaded.
//!
//! Every key is checked: an unknown key, a missing one, a wrong type, a NaN or a value out of range is one line that
//! names the file, the key, the value and what is allowed.
//!
//! No physics in here: simulation, Python and the builds of firmware read the same files with it.

#![forbid(unsafe_code)]

mod balls;
mod check;
mod command;
mod constants;
mod control;
mod crossing;
mod encoding;
mod error;
mod facts;
mod file;
mod file_kind;
mod gains;
mod height_map;
mod imperfections;
mod load;
mod log_rates;
mod nearest;
mod physics;
mod regular;
mod rest;
mod roller_wheel;
mod rollers;
mod scenario;
mod schema;
mod shortened;
mod study;
mod tagged;
mod terrain;
mod vehicle;
mod wheel_spec;
mod wheels;

pub use balls::{BALL_LEAN_RAD, BeyondBall};
pub use command::{Command, CommandFrame, Start, Then};
pub use constants::{Language, rust_expression};
pub use control::wheel_count_refused;
pub use error::Error;
pub use file::File;
pub use file_kind::FileKind;
pub use gains::DerivedGains;
pub use height_map::HeightMap;
pub use imperfections::{Actuators, Fault, HeadingHold, Sensors};
pub use load::{Override, Source, builtin_scenarios, builtin_studies, builtin_vehicles};
pub use log_rates::LogRates;
pub use nearest::did_you_mean;
pub use physics::Physics;
pub use regular::{MOST_PNG_BYTES, MOST_TOML_BYTES, open_regular, read_regular};
pub use rest::Rest;
pub use roller_wheel::{Barrel, Ripple, RollerWheel};
pub use rollers::{Rollers, WheelModel};
pub use scenario::{Control, Perturbation, Precision, Scenario};
pub use shortened::{shortened, shortened_line};
pub use study::{Axis, MapAxes, Point, Seeds, Study};
pub use terrain::{FrictionPatch, Obstacle, Terrain};
pub use vehicle::{Body, Coupling, CouplingSpring, Gains, Hinge, Limits, Motor, Row, Vehicle};
pub use wheel_spec::{WheelContact, WheelSpec};
pub use wheels::{DamperLoad, WheelsExperiment};

/// The version of the file format that this release reads.
pub const SCHEMA_VERSION: u32 = 1;
