#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

pub mod constants;
pub mod drive;
pub mod estimate;
pub mod geometry;
pub mod linkage;
pub mod loops;
pub mod metrics;
pub mod motor;
pub mod path;
pub mod policy;
pub mod shaping;
pub mod traction;

mod error;
#[cfg(test)]
mod interface_tests;
mod scalar;
mod sum;
mod trig;

pub use drive::{Drive, DriveConfig, DriveInput, DriveMode, DriveState};
pub use error::ConfigError;
pub use geometry::{BodyTwist, Kinematics, WheelLayout, WheelVelocities};
pub use loops::{ControlState, Controller, Coordination, PidConfig, PidGains, WheelControlConfig};
pub use motor::TorqueLimit;
pub use policy::{Policy, Readings};
pub use scalar::Real;

/// Set-up that examples share.
#[doc(hidden)]
pub mod examples;

/// Every type that generated constants name.
#[doc(hidden)]
pub mod parts {
    pub use crate::drive::*;
    pub use crate::estimate::*;
    pub use crate::geometry::*;
    pub use crate::linkage::*;
    pub use crate::loops::*;
    pub use crate::motor::*;
    pub use crate::path::*;
    pub use crate::shaping::*;
    pub use crate::traction::*;
}

#[cfg(test)]
extern crate std;
