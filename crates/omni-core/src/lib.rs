#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

pub mod coordination;
pub mod metrics;

mod controller;
mod covariance;
mod error;
mod kinematics;
mod layout;
mod motor;
mod odometry;
mod pid;
mod scalar;
mod trig;
mod twist;

pub use controller::{
    ControlSample, ControlState, Controller, WheelControlConfig, WheelController, WheelSample,
};
pub use coordination::{Coordination, Integral, Saturation, TorqueRange};
pub use covariance::{CovarianceGrowth, OdometryNoise, PoseCovariance};
pub use error::ConfigError;
pub use kinematics::{ForwardMap, Kinematics};
pub use layout::{Wheel, WheelLayout};
pub use motor::TorqueLimit;
pub use odometry::{Odometry, OdometryState, OdometryStep};
pub use pid::{Pid, PidGains, PidState, PidTerms};
pub use scalar::Real;
pub use twist::{BodyDisplacement, BodyTwist, PlanarPose, WorldTwist};

#[cfg(test)]
extern crate std;
