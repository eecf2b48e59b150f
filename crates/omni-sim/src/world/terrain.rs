//! The ground as fixed colliders.

use rapier3d_f64::prelude::*;

use crate::config::Terrain;

/// Half the extent of the ground \[m\]: far beyond any run.
const HALF_EXTENT: f64 = 200.0;
/// Half the thickness of slabs \[m\]: no wheel tunnels through.
const HALF_THICKNESS: f64 = 1.0;

/// Adds the ground to the world.
pub(super) fn insert(physics: &mut PhysicsWorld, terrain: &Terrain) {
    let slab = |from_x: f64, top: f64, friction: f64| {
        let half_x = (HALF_EXTENT - from_x) / 2.0;
        ColliderBuilder::cuboid(half_x, HALF_EXTENT, HALF_THICKNESS)
            .translation(Vector::new(from_x + half_x, 0.0, top - HALF_THICKNESS))
            .friction(friction)
            .friction_combine_rule(CoefficientCombineRule::Min)
    };
    match *terrain {
        Terrain::Flat { friction } => {
            physics.insert_collider(slab(-HALF_EXTENT, 0.0, friction), None);
        }
        Terrain::Step {
            friction,
            height_m,
            at_m,
        } => {
            physics.insert_collider(slab(-HALF_EXTENT, 0.0, friction), None);
            physics.insert_collider(slab(at_m, height_m, friction), None);
        }
    }
}
