//! The ground as fixed colliders.

use rapier3d_f64::prelude::*;

use crate::config::{FrictionPatch, Scenario};
use crate::ground::{self, Shape};
use crate::world::height_field::height_field;

/// Adds the ground to the world; false if it is unknown, and there is none.
pub(super) fn insert(physics: &mut PhysicsWorld, scenario: &Scenario) -> bool {
    let hooks = if scenario.friction_patch.is_empty() {
        ActiveHooks::empty()
    } else {
        ActiveHooks::MODIFY_SOLVER_CONTACTS
    };
    let shapes = ground::shapes(scenario, ground::reach_m(scenario));
    let known = !shapes.is_empty();
    for shape in shapes {
        let collider = collider(shape)
            .friction(scenario.terrain.friction())
            .friction_combine_rule(CoefficientCombineRule::Min)
            .active_hooks(hooks);
        physics.insert_collider(collider, None);
    }
    known
}

fn collider(shape: Shape) -> ColliderBuilder {
    match shape {
        Shape::Box {
            half_m: [x, y, z],
            centre_m,
            turn_y_rad,
        } => ColliderBuilder::cuboid(x, y, z).position(Pose::new(
            Vector::from(centre_m),
            AngVector::new(0.0, turn_y_rad, 0.0),
        )),
        Shape::Bar {
            half_length_m,
            radius_m,
            centre_m,
        } => ColliderBuilder::cylinder(half_length_m, radius_m).translation(Vector::from(centre_m)),
        Shape::Field {
            from_m,
            extent_m,
            rows,
            columns,
            heights_m,
        } => {
            let (heights, scale, pose) = height_field(from_m, extent_m, [rows, columns], &heights_m);
            let flags = HeightFieldFlags::FIX_INTERNAL_EDGES;
            ColliderBuilder::heightfield_with_flags(heights, scale, flags).position(pose)
        }
    }
}

/// Height of the ground \[m\] at places x, y \[m\] of the world; NaN if there is none.
///
/// ```
/// use omni_sim::config::Scenario;
/// let stairs = Scenario::load("stairs", &[])?; // of 3 cm, from x = 0.7 m on, every 0.4 m
/// let heights = omni_sim::ground_heights_m(&stairs, &[[0.0, 0.0], [0.9, 0.0], [1.2, 0.5], [9.0, 0.0]]);
/// for (height, expected) in heights.iter().zip([0.0, 0.03, 0.06, 0.09]) {
///     assert!((height - expected).abs() < 1e-9);
/// }
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn ground_heights_m(scenario: &Scenario, places_m: &[[f64; 2]]) -> Vec<f64> {
    let mut physics = PhysicsWorld::new();
    insert(&mut physics, scenario);
    // Puts the colliders where rays look for them.
    physics.detect_collisions(&(), &());
    let above = 100.0; // obstacles are at most 10 m high
    let height = |[x, y]: [f64; 2]| {
        let ray = Ray::new(Vector::new(x, y, above), Vector::new(0.0, 0.0, -1.0));
        let hit = physics.cast_ray(&ray, 2.0 * above, true, QueryFilter::default());
        hit.map_or(f64::NAN, |(_, fall)| above - fall)
    };
    places_m.iter().copied().map(height).collect()
}

/// Friction by place at a time \[s\]: the last patch that holds a contact sets its coefficient.
pub(super) struct Patches<'a> {
    pub(super) patches: &'a [FrictionPatch],
    pub(super) time_s: f64,
}

impl PhysicsHooks for Patches<'_> {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let Some(rigid) = context.rigid_mut() else {
            return;
        };
        // A ball touches a convex shape in one point; a manifold has one coefficient.
        let Some(contact) = rigid.solver_contacts.first() else {
            return;
        };
        let at = contact.anchor1;
        let mut patches = self.patches.iter().rev();
        if let Some(patch) = patches.find(|patch| patch.holds(at.x, at.y, self.time_s)) {
            *rigid.friction = patch.friction;
        }
    }
}
