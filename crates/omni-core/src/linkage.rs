//! Passive hinges: height and motion of the wheels from the hinge angles.
//!
//! A wheel that climbs moves up as well as ahead. It rolls without slip only if it turns faster
//! than the others, and its encoder sees besides how its carrier turns. Hinge encoders and an
//! inertial measurement unit on the base measure both.

mod motion;
mod tree;

pub use motion::LinkageMotion;
#[doc(hidden)]
pub use tree::Joint;
pub use tree::{Attitude, CarriedWheel, HingeGeometry, Linkage, MAX_HINGES, rolled_speed};
pub(crate) use tree::{NO_RISE, rolled};
