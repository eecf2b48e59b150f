//! Loops of the wheels: PID, coordination at a torque limit, rest.
//!
//! [`Pid`] is one loop, [`WheelController`] coordinates `N` of them, and [`Controller`] turns a
//! body twist into their torques.

mod controller;
mod coordination;
mod law;
mod pid;
mod policy;
pub(crate) mod wheel_loops;

pub use controller::{ControlSample, Controller};
pub use coordination::{Coordination, Integral, Saturation, reference_factor, torque_factor};
pub use pid::{
    AntiWindup, EncoderStep, FeedForward, IntegrationOrder, LastStep, Pid, PidConfig, PidGains, PidSample,
    PidState, PidTerms,
};
#[doc(hidden)]
pub use pid::{Discrete, TermBounds};
pub use policy::ControllerPolicy;
#[doc(hidden)]
pub use wheel_loops::RestRule;
pub use wheel_loops::{ControlState, Overload, Rest, WheelControlConfig, WheelController, WheelSample};
