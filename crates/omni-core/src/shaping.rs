//! Shape commands before the loops see them: limits of speed, acceleration and jerk, time-out, emergency stop, heading.
//!
//! [`CommandShaper`] does all but the heading, [`TwistLimiter`] and [`RateLimiter`] only limit,
//! [`HeadingHold`] keeps a heading.

mod command;
mod heading;
mod limits;
mod twist_limits;

pub use command::{
    CommandShaper, CommandStatus, EmergencyDeceleration, Restart, ShapedCommand, ShaperState, ShapingConfig,
};
pub use heading::{HeadingHold, HeadingHoldConfig, HeadingHoldState};
#[doc(hidden)]
pub use limits::Steps;
pub use limits::{AxisLimits, RateLimiter, RateLimiterState};
#[doc(hidden)]
pub use twist_limits::{Group, Law};
pub use twist_limits::{MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
