//! Geometry of a vehicle on wheels: motions, wheel layouts, and the maps between the two.
//!
//! A [`WheelLayout`] defines [`Kinematics`], which maps a [`BodyTwist`] to [`WheelVelocities`] and back;
//! [`SpeedLimits`] keeps the velocities within the wheels' speed limits.

mod desaturation;
mod forward_map;
mod kinematics;
mod layout;
mod matrix3;
mod path_factors;
mod twist;
mod wheels;

pub use desaturation::{Desaturated, Desaturation, SpeedLimits};
pub use forward_map::CONDITION_LIMIT;
pub use kinematics::{ForwardMap, Kinematics};
pub use layout::{Wheel, WheelLayout};
pub use path_factors::PathFactors;
pub use twist::{BodyDisplacement, BodyTwist, PlanarPose, WorldTwist};
pub use wheels::{WheelAngles, WheelTorques, WheelVelocities};
