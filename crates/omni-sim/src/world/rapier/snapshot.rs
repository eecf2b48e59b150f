//! A world as bytes and back, bit-identically.

use rapier3d_f64::prelude::*;
use serde::{Deserialize, Serialize};

use super::{World, energy_balance};
use crate::state_bytes;
use crate::world::actuation;

/// Everything of a world that changes while it runs.
#[derive(Serialize, Deserialize)]
struct WorldSnapshot {
    physics: PhysicsWorld,
    actuation: actuation::State,
    energy: energy_balance::State,
    time_ns: u64,
    loads_done: Vec<bool>,
}

/// [`WorldSnapshot`] without a copy of the physics.
#[derive(Serialize)]
struct WorldView<'a> {
    physics: &'a PhysicsWorld,
    actuation: &'a actuation::State,
    energy: energy_balance::State,
    time_ns: u64,
    loads_done: Vec<bool>,
}

impl World {
    /// A snapshot.
    pub(super) fn to_bytes(&self) -> Result<Vec<u8>, postcard::Error> {
        state_bytes::to_bytes(&WorldView {
            physics: &self.physics,
            actuation: self.actuation.state(),
            energy: self.energy.state(),
            time_ns: self.time_ns,
            loads_done: self.loads.iter().map(|load| load.done).collect(),
        })
    }

    /// Goes on from a snapshot of a world that was made of the same scenario: bodies have the same handles there.
    pub(super) fn go_on_from(&mut self, bytes: &[u8]) -> Result<(), postcard::Error> {
        let (snapshot, rest): (WorldSnapshot, _) = state_bytes::take_from_bytes(bytes)?;
        if !snapshot.actuation.fits(self.vehicle.wheels.len()) || !rest.is_empty() {
            return Err(postcard::Error::DeserializeBadEncoding);
        }
        // At the start the world that was built is the one that was saved.
        if snapshot.time_ns > 0 {
            let built = std::mem::replace(&mut self.physics, snapshot.physics);
            for wheel in &self.vehicle.wheels {
                wheel.put_rollers_back(&mut self.physics, &built.colliders);
            }
        }
        self.actuation.restore(snapshot.actuation);
        self.energy.restore(snapshot.energy);
        self.time_ns = snapshot.time_ns;
        for (load, done) in self.loads.iter_mut().zip(snapshot.loads_done) {
            load.done = done;
        }
        self.failed = None;
        Ok(())
    }
}
