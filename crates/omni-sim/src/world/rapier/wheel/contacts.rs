//! Contacts of rollers, found anew in every step, and exactly on boxes, which is what ground is made of.
//!
//! The engine keeps the points of a contact until the bodies have turned by a degree or slid by a
//! millimetre. On a wheel that rolls such a point trails behind the axle by up to a millimetre and
//! rises by 10 um: a load there drives the wheel, and the wheel sinks deeper than one that stands.
//! Where shapes overlap by more than a barrel's edge is rounded the engine approximates them, and
//! throws the wheel off. Balls are not concerned, for which there are formulas.

use rapier3d_f64::geometry::{ContactData, ContactManifoldData};
use rapier3d_f64::parry::query::TrackedContact;
use rapier3d_f64::parry::query::details::{ContactManifoldsWorkspace, NormalConstraints, ShapeCastOptions};
use rapier3d_f64::parry::query::{
    ClosestPoints, Contact, ContactManifold, DefaultQueryDispatcher, NonlinearRigidMotion,
    PersistentQueryDispatcher, QueryDispatcher, ShapeCastHit, ShapeDistance, ShapeIntersection, Unsupported,
};
use rapier3d_f64::parry::shape::{PackedFeatureId, Shape};
use rapier3d_f64::prelude::{Pose, Vector};

use crate::world::barrel::{BarrelShape, touch_box};

/// A formula for barrels on boxes; for all else the engine's own algorithms without their memory of contact points.
pub(in crate::world::rapier) struct FreshContacts;

type Manifold = ContactManifold<ContactManifoldData, ContactData>;

impl PersistentQueryDispatcher<ContactManifoldData, ContactData> for FreshContacts {
    fn contact_manifolds(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        prediction: f64,
        manifolds: &mut Vec<Manifold>,
        workspace: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        let barrel_on_box = match (shape1.as_cuboid(), shape2.as_cuboid()) {
            (Some(cuboid), None) => {
                let barrel = shape2.as_shape::<BarrelShape>();
                barrel.map(|barrel| touch_box(cuboid, barrel, pos12))
            }
            (None, Some(cuboid)) => {
                let barrel = shape1.as_shape::<BarrelShape>();
                barrel.map(|barrel| touch_box(cuboid, barrel, &pos12.inverse()))
            }
            _ => None,
        };
        if let Some(touch) = barrel_on_box {
            if manifolds.is_empty() {
                manifolds.push(Manifold::new());
            }
            for manifold in manifolds {
                let before = manifold.points.clone();
                manifold.clear();
                // Points in each shape's frame; the box is shape 1 here, and turned about where it is not.
                let [mut on, mut normal] = [touch.points, touch.normals];
                if shape2.as_cuboid().is_some() {
                    on.reverse();
                    normal.reverse();
                }
                [manifold.local_n1, manifold.local_n2] = normal;
                if touch.distance_m < prediction {
                    let unknown = PackedFeatureId::UNKNOWN;
                    let point = TrackedContact::new(on[0], on[1], unknown, unknown, touch.distance_m);
                    manifold.points.push(point);
                    manifold.match_contacts(&before);
                }
            }
            return Ok(());
        }
        manifolds.iter_mut().for_each(Manifold::mark_shapes_deformed);
        DefaultQueryDispatcher.contact_manifolds(pos12, shape1, shape2, prediction, manifolds, workspace)
    }

    fn contact_manifold_convex_convex(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        constraints1: Option<&dyn NormalConstraints>,
        constraints2: Option<&dyn NormalConstraints>,
        prediction: f64,
        manifold: &mut Manifold,
    ) -> Result<(), Unsupported> {
        manifold.mark_shapes_deformed();
        DefaultQueryDispatcher.contact_manifold_convex_convex(
            pos12,
            shape1,
            shape2,
            constraints1,
            constraints2,
            prediction,
            manifold,
        )
    }
}

/// As the engine answers all of these.
impl QueryDispatcher for FreshContacts {
    fn intersection_test(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
    ) -> Result<ShapeIntersection, Unsupported> {
        DefaultQueryDispatcher.intersection_test(pos12, shape1, shape2)
    }

    fn distance(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
    ) -> Result<ShapeDistance, Unsupported> {
        DefaultQueryDispatcher.distance(pos12, shape1, shape2)
    }

    fn contact(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        prediction: f64,
    ) -> Result<Option<Contact>, Unsupported> {
        DefaultQueryDispatcher.contact(pos12, shape1, shape2, prediction)
    }

    fn closest_points(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        most: f64,
    ) -> Result<ClosestPoints, Unsupported> {
        DefaultQueryDispatcher.closest_points(pos12, shape1, shape2, most)
    }

    fn cast_shapes(
        &self,
        pos12: &Pose,
        velocity12: Vector,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        options: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        DefaultQueryDispatcher.cast_shapes(pos12, velocity12, shape1, shape2, options)
    }

    fn cast_shapes_nonlinear(
        &self,
        motion1: &NonlinearRigidMotion,
        shape1: &dyn Shape,
        motion2: &NonlinearRigidMotion,
        shape2: &dyn Shape,
        from: f64,
        until: f64,
        stop_at_penetration: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        DefaultQueryDispatcher.cast_shapes_nonlinear(
            motion1,
            shape1,
            motion2,
            shape2,
            from,
            until,
            stop_at_penetration,
        )
    }
}
