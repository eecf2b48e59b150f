//! Passive hinges: height and motion of the wheels from the hinge angles.
//!
//! A climbing wheel moves upwards as well as forward. It rolls without slip only if it turns faster than the other
//! wheels, and its encoder also measures the rotation of its carrier. Hinge encoders and an inertial measurement unit
//! on the base measure both.

mod motion;
mod place;
mod tree;

pub use motion::LinkageMotion;
pub(crate) use place::{WheelPlace, cross, dot, turned};
#[doc(hidden)]
pub use tree::Joint;
pub use tree::{Attitude, CarriedWheel, HingeGeometry, Linkage, MAX_HINGES, rolled_speed};
pub(crate) use tree::{NO_RISE, rolled};
