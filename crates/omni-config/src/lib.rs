#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod ball_validity;
mod builtin;
mod command;
mod command_file;
mod command_plausibility;
mod constants;
mod control;
mod controller;
mod crossing_time;
mod data_url;
mod derived_gains;
mod digits;
mod drive;
mod drive_config;
mod drive_plausibility;
mod encoder_reading;
mod encoder_velocity;
mod encoding;
mod error;
mod fault;
mod file;
mod file_kind;
mod height_map;
mod imperfections;
mod integers;
mod key_place;
mod kind_tables;
mod load;
mod log_rates;
mod microseconds;
mod missing_keys;
mod motor_bench;
mod override_key;
mod path;
mod physics;
mod planned_path;
mod ranges;
mod regular_file;
mod rest;
mod roller_wheel;
mod rollers;
mod scenario;
#[cfg(feature = "schema")]
mod schema;
mod study;
mod suggestion;
mod terrain;
mod traction;
mod truncate;
mod vehicle;
mod vehicle_plausibility;
mod vehicle_properties;
mod waypoints;
mod wheel_spec;

pub use ball_validity::{BALL_LEAN_RAD, BeyondBall};
pub use builtin::{builtin_scenarios, builtin_studies, builtin_vehicles};
pub use command::{Command, CommandFrame, Start, Then};
pub use command_file::CommandFile;
pub use constants::{Language, rust_expression};
pub use control::{
    AntiWindupLaw, AutoPolicy, Control, IntegralLaw, POLICIES, Precision, SaturationLaw, policy_in_a_line,
};
pub use controller::{MOST_WHEELS, wheel_count_refused};
pub use derived_gains::DerivedGains;
pub use drive::{Drive, DriveFaults, DriveNoise, DriveRestart, DriveSlip};
pub use encoder_reading::EncoderReading;
pub use encoder_velocity::EncoderVelocity;
pub use error::Error;
pub use fault::{AddedLoad, Fault, FaultSpan, SupplyPart, WheelDrag, WheelFault, WheelPart};
pub use file::File;
pub use file_kind::FileKind;
pub use height_map::HeightMap;
pub use imperfections::{Actuators, HeadingHold, Sensors};
pub use load::Source;
pub use log_rates::LogRates;
pub use motor_bench::{DamperLoad, MotorBench};
pub use override_key::Override;
pub use path::{PathChoice, PathFollow, PathPlan, PathPoint, PathWait, PoseSource, WayKind};
pub use physics::{Engine, Physics};
pub use planned_path::PlannedPath;
pub use regular_file::{MOST_PNG_BYTES, MOST_TOML_BYTES, check_replaceable, open_regular, read_regular};
pub use rest::Rest;
pub use roller_wheel::{Barrel, Ripple, RollerWheel};
pub use rollers::{Rollers, WheelModel};
pub use scenario::{Perturbation, Scenario};
pub use study::{Axis, MapAxes, Point, Seeds, Study};
pub use suggestion::{did_you_mean, did_you_mean_file};
pub use terrain::{Block, FrictionPatch, Obstacle, Terrain};
pub use truncate::{shortened, shortened_line};
pub use vehicle::{Body, Coupling, CouplingSpring, Gains, Hinge, Limits, Motor, Row, Vehicle};
pub use wheel_spec::{WheelContact, WheelSpec};

/// The version of the file format that this release reads.
pub const SCHEMA_VERSION: u32 = 1;
