//! Traction control for vehicles that climb: one thrust for all driven wheels, slip control for each wheel.
//!
//! Over a step every wheel should apply the largest torque that its motor and the ground allow, at the moment at which
//! it is needed. Scaling torques or references can only reduce it. This law measures one speed for the whole vehicle
//! from the slowest driving wheels, applies to all wheels the thrust that corrects this speed, and removes from each
//! the part that would only spin it: the torque transmitted to the ground is estimated from the motor's torque and the
//! wheel's acceleration (maximum transmissible torque; Yin, Oh and Hori, 2009).
//!
//! - [`Traction`] is the law: [`Traction::command`] accepts the command, [`Traction::step`] measures the speed and
//!   computes torques from a target speed.
//! - [`Supervisor`] chooses the target speed: a higher one for rows that need a run-up, a retry if the vehicle is
//!   stuck.
//! - [`TractionPolicy`] is both, and implements [`Policy`](crate::policy::Policy).

mod config;
mod direction;
mod encoder;
mod heading;
mod law;
mod linkage;
mod loops;
mod model;
mod policy;
mod sample;
mod slip;
mod speed;
mod state;
mod supervised;
mod supervisor;
mod target;
mod thrust;
mod unseen;

#[doc(hidden)]
pub use config::TractionTimes;
pub use config::{TractionConfig, TractionSensors, TractionWheel};
pub use loops::TractionLoops;
pub use model::Traction;
pub use policy::{TractionPolicy, TractionPolicyState};
pub use sample::TractionSample;
pub use state::TractionState;
pub(crate) use supervised::{Supervised, SupervisedState};
pub use supervisor::{RetrySchedule, Supervisor, SupervisorConfig, SupervisorMode, SupervisorState};
pub use target::TractionTarget;
