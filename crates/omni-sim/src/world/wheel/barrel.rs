//! A roller's shape for the physics engine: exact, not a polyhedron.

use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingSphere};
use rapier3d_f64::parry::mass_properties::MassProperties;
use rapier3d_f64::parry::query::gjk::{self, CsoPoint, VoronoiSimplex};
use rapier3d_f64::parry::query::{
    PointProjection, PointQuery, Ray, RayCast, RayIntersection,
    details::local_point_projection_on_support_map,
};
use rapier3d_f64::parry::shape::{
    FeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, ShapeType, SupportMap, TypedShape,
};
use rapier3d_f64::prelude::Vector;

use crate::config::Barrel;

/// A barrel along its own x axis.
#[derive(Clone, Copy)]
pub(super) struct BarrelShape(pub(super) Barrel);

/// What is left of a barrel without the rounding of its edges; the engine adds that to contacts.
impl SupportMap for BarrelShape {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let across = (direction.y * direction.y + direction.z * direction.z).sqrt();
        let length = (direction.x * direction.x + across * across).sqrt();
        let sine = if length > 0.0 { direction.x / length } else { 0.0 };
        let [along, away] = self.0.core_support(sine);
        let outward = if across > 0.0 {
            [direction.y / across, direction.z / across]
        } else {
            [0.0; 2]
        };
        Vector::new(along, away * outward[0], away * outward[1])
    }
}

/// A barrel touches in one point: it has neither flat faces nor straight edges where it rolls.
impl PolygonalFeatureMap for BarrelShape {
    fn local_support_feature(&self, _: Vector, feature: &mut PolygonalFeature) {
        feature.num_vertices = 0;
    }
}

impl Shape for BarrelShape {
    fn compute_local_aabb(&self) -> Aabb {
        let (length, radius) = (self.0.half_length_m(), self.0.radius_m());
        Aabb::from_half_extents(Vector::ZERO, Vector::new(length, radius, radius))
    }

    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        BoundingSphere::new(Vector::ZERO, self.0.half_length_m().hypot(self.0.radius_m()))
    }

    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(*self)
    }

    fn scale_dyn(&self, _: Vector, _: u32) -> Option<Box<dyn Shape>> {
        None
    }

    /// As of a cylinder; the bodies that carry barrels are given their mass.
    fn mass_properties(&self, density: f64) -> MassProperties {
        let mut cylinder = MassProperties::from_cylinder(density, self.0.half_length_m(), self.0.radius_m());
        cylinder.principal_inertia_local_frame = rapier3d_f64::prelude::Rotation::from_xyzw(
            0.0,
            0.0,
            -std::f64::consts::FRAC_1_SQRT_2,
            std::f64::consts::FRAC_1_SQRT_2,
        );
        cylinder
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }

    fn ccd_thickness(&self) -> f64 {
        self.0.radius_m()
    }

    fn ccd_angular_thickness(&self) -> f64 {
        std::f64::consts::PI
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn as_support_map(&self) -> Option<&dyn SupportMap> {
        Some(self)
    }

    fn as_polygonal_feature_map(&self) -> Option<(&dyn PolygonalFeatureMap, f64)> {
        Some((self, self.0.edge_m()))
    }
}

/// Nothing in the simulation casts rays at rollers; the core is what they would hit.
impl RayCast for BarrelShape {
    fn cast_local_ray_and_get_normal(&self, ray: &Ray, most: f64, _: bool) -> Option<RayIntersection> {
        let mut simplex = VoronoiSimplex::new();
        let start = self.local_support_point(-ray.dir);
        simplex.reset(CsoPoint::single_point(start - ray.origin));
        gjk::cast_local_ray(self, &mut simplex, ray, most)
            .map(|(time, normal)| RayIntersection::new(time, normal, FeatureId::Unknown))
    }
}

impl PointQuery for BarrelShape {
    fn project_local_point(&self, point: Vector, solid: bool) -> PointProjection {
        local_point_projection_on_support_map(self, &mut VoronoiSimplex::new(), point, solid)
    }

    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        (self.project_local_point(point, false), FeatureId::Unknown)
    }
}
