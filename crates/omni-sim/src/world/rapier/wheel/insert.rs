//! Adds a wheel to the world: a ball, or rollers on a hub.

use rapier3d_f64::prelude::*;

use super::{Wheel, ball, rollers};
use crate::config::{RollerWheel, WheelSpec};

impl Wheel {
    /// Adds a wheel to its carrier, whose local frame is the vehicle's: a ball, or rollers where there are some.
    pub(in crate::world::rapier) fn insert(
        physics: &mut PhysicsWorld,
        spec: &WheelSpec,
        rollers: Option<&RollerWheel>,
        contact_frequency_hz: f64,
        carrier: RigidBodyHandle,
        start: Pose,
    ) -> Self {
        match rollers {
            None => ball::insert(physics, spec, contact_frequency_hz, carrier, start),
            Some(built) => rollers::insert(physics, spec, built, contact_frequency_hz, carrier, start),
        }
    }
}
