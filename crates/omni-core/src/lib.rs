#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

pub mod coordination;
pub mod metrics;

mod controller;
mod covariance;
mod desaturation;
mod error;
mod faults;
mod kinematics;
mod layout;
mod motor;
mod odometry;
mod pid;
mod scalar;
mod slip;
mod trig;
mod twist;
mod wheel_loops;
mod wheels;

pub use controller::{ControlSample, Controller};
pub use coordination::{Coordination, Integral, Saturation, TorqueRange, TorqueRanges};
pub use covariance::{CovarianceGrowth, OdometryNoise, PoseCovariance};
pub use desaturation::{Desaturated, Desaturation, SpeedLimits};
pub use error::ConfigError;
pub use faults::{Expectation, Fault, FaultConfig, FaultMonitor, FaultState};
pub use kinematics::{ForwardMap, Kinematics, PathFactors, residual_shares};
pub use layout::{CONDITION_LIMIT, Wheel, WheelLayout};
pub use motor::TorqueLimit;
pub use odometry::{Odometry, OdometryState, OdometryStep};
pub use pid::{
    AntiWindup, FeedForward, IntegrationOrder, LastStep, Pid, PidConfig, PidGains, PidSample, PidState,
    PidTerms,
};
pub use scalar::Real;
pub use slip::{SlipConfig, SlipDetector, SlipSample, SlipState};
pub use twist::{BodyDisplacement, BodyTwist, PlanarPose, WorldTwist};
pub use wheel_loops::{ControlState, WheelControlConfig, WheelController, WheelSample};
pub use wheels::{WheelAngles, WheelTorques, WheelVelocities};

#[cfg(test)]
extern crate std;
