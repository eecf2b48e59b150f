#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

pub mod constants;
pub mod coordination;
pub mod linkage;
pub mod metrics;

mod controller;
mod covariance;
mod desaturation;
mod drive;
mod encoder;
mod error;
mod estimator;
mod faults;
mod follower;
mod heading;
#[cfg(test)]
mod interface_tests;
mod kinematics;
mod layout;
mod limits;
mod motor;
mod odometry;
mod pid;
mod policy;
mod scalar;
mod shaping;
mod slip;
mod sum;
mod traction;
mod trajectory;
mod trig;
mod twist;
mod twist_limits;
mod velocity;
mod wheel_loops;
mod wheels;

pub use controller::{ControlSample, Controller};
pub use coordination::{Coordination, Integral, Saturation, TorqueRange, TorqueRanges};
pub use covariance::{CovarianceGrowth, OdometryNoise, PoseCovariance};
pub use desaturation::{Desaturated, Desaturation, SpeedLimits};
pub use drive::{
    BodyReadings, Drive, DriveConfig, DriveInput, DriveMode, DriveSample, DriveState, TractionDrive,
    TractionDriveSample, TractionDriveState,
};
pub use encoder::{CounterState, EncoderCounter};
pub use error::ConfigError;
pub use estimator::{Estimator, EstimatorConfig, EstimatorInput, EstimatorState, EstimatorStep};
pub use faults::{Expectation, Fault, FaultConfig, FaultMonitor, FaultState};
pub use follower::{Follow, FollowerConfig, HolonomicFollower};
pub use heading::{HeadingHold, HeadingHoldConfig, HeadingHoldState};
pub use kinematics::{ForwardMap, Kinematics, PathFactors, residual_shares};
pub use layout::{CONDITION_LIMIT, Wheel, WheelLayout};
pub use limits::{AxisLimits, RateLimiter, RateLimiterState};
pub use linkage::{Attitude, CarriedWheel, HingeGeometry, Linkage, LinkageMotion};
pub use motor::{
    DcMotor, DcMotorConfig, GearFriction, Gearbox, MotorDuty, ThermalConfig, ThermalModel, ThermalState,
    TorqueLimit, TorqueTable,
};
pub use odometry::{Odometry, OdometryState, OdometryStep};
pub use pid::{
    AntiWindup, EncoderStep, FeedForward, IntegrationOrder, LastStep, Pid, PidConfig, PidGains, PidSample,
    PidState, PidTerms,
};
pub use policy::{ControllerPolicy, DrivePolicy, Imu, Policy, Readings};
pub use scalar::Real;
pub use shaping::{
    CommandShaper, CommandStatus, EmergencyDeceleration, ShapedCommand, ShaperState, ShapingConfig,
};
#[doc(hidden)]
pub use slip::LEAST_REDUNDANCY;
pub use slip::{SlipConfig, SlipDetector, SlipSample, SlipState};
pub use traction::{
    RetrySchedule, Supervisor, SupervisorConfig, SupervisorMode, SupervisorState, Traction, TractionConfig,
    TractionLoops, TractionPolicy, TractionPolicyState, TractionSample, TractionSensors, TractionState,
    TractionTarget, TractionWheel,
};
pub use trajectory::{
    PathLimits, PathPiece, PathSegment, PlanarInertia, Trajectory, TrajectoryPlanner, TrajectorySample,
    WayShape, Waypoint,
};
pub use twist::{BodyDisplacement, BodyTwist, PlanarPose, WorldTwist};
pub use twist_limits::{MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
pub use velocity::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
pub use wheel_loops::{ControlState, Overload, Rest, WheelControlConfig, WheelController, WheelSample};
pub use wheels::{WheelAngles, WheelTorques, WheelVelocities};

/// Set-up that examples share.
#[doc(hidden)]
pub mod examples;

/// Every type that generated constants name.
#[doc(hidden)]
pub mod parts {
    pub use crate::limits::Steps;
    pub use crate::linkage::Joint;
    pub use crate::motor::TorqueLimits;
    pub use crate::pid::{Discrete, TermBounds};
    pub use crate::traction::TractionTimes;
    pub use crate::trajectory::Phase;
    pub use crate::twist_limits::{Group, Law};
    pub use crate::velocity::VelocityLaw;
    pub use crate::wheel_loops::RestRule;
    pub use crate::*;
}

#[cfg(test)]
extern crate std;
