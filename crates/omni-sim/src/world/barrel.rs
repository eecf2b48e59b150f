//! A roller's shape for parry, exact and not a polyhedron, and where it meets a box.

use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingSphere};
use rapier3d_f64::parry::mass_properties::MassProperties;
use rapier3d_f64::parry::query::gjk::{self, CsoPoint, VoronoiSimplex};
use rapier3d_f64::parry::query::{
    PointProjection, PointQuery, Ray, RayCast, RayIntersection,
    details::local_point_projection_on_support_map,
};
use rapier3d_f64::parry::shape::{
    Ball, Cuboid, FeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, ShapeType, SupportMap, TypedShape,
};
use rapier3d_f64::prelude::{Matrix, Pose, Vector};

use crate::config::Barrel;

/// A barrel along its own x axis.
#[derive(Clone, Copy)]
pub(super) struct BarrelShape(pub(super) Barrel);

impl BarrelShape {
    /// How far it reaches from its middle at most \[m\].
    pub(super) fn reach_m(&self) -> f64 {
        let (length, radius) = (self.0.half_length_m(), self.0.radius_m());
        (length * length + radius * radius).sqrt() // not hypot, which differs from machine to machine
    }
}

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
        BoundingSphere::new(Vector::ZERO, self.reach_m())
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

    /// What the engine writes down in place of a shape that it does not know; who reads it puts the barrel back.
    fn as_typed_shape(&self) -> TypedShape<'_> {
        const STAND_IN: Ball = Ball { radius: 1.0 };
        TypedShape::Ball(&STAND_IN)
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

/// Where a box and a barrel are nearest, or overlap least.
pub(super) struct Touch {
    /// The points on the box and on the barrel, each in its own frame \[m\].
    pub(super) points: [Vector; 2],
    /// The outward normals there, likewise.
    pub(super) normals: [Vector; 2],
    /// Between the points along the normal \[m\], below 0 if the shapes overlap.
    pub(super) distance_m: f64,
}

/// The contact of a barrel, at a pose in the frame of a box, with that box.
///
/// The distance is the largest gap that any plane leaves between the shapes, overlaps being gaps below 0. The plane is
/// that of a face, or leans about an edge between two faces; a corner's planes are taken for those of its three edges.
pub(super) fn touch_box(cuboid: &Cuboid, barrel: &BarrelShape, pose: &Pose) -> Touch {
    let turned = Matrix::from_quat(pose.rotation);
    let nearest = nearest_to_box(cuboid, barrel, pose.translation, turned.x_axis);
    Touch {
        points: [nearest.on_box(), pose.inverse_transform_point(nearest.on_barrel)],
        normals: [nearest.normal, turned.transpose() * -nearest.normal],
        distance_m: nearest.gap_m,
    }
}

/// Where a barrel is nearest to a box, in the frame of the box.
pub(super) struct Nearest {
    /// Out of the box.
    pub(super) normal: Vector,
    on_barrel: Vector,
    pub(super) gap_m: f64,
}

impl Nearest {
    pub(super) fn on_box(&self) -> Vector {
        self.on_barrel - self.normal * self.gap_m
    }
}

/// The same for a barrel about a place and along a unit vector: it is round, so nothing else of its pose counts.
pub(super) fn nearest_to_box(cuboid: &Cuboid, barrel: &BarrelShape, place: Vector, along: Vector) -> Nearest {
    let half = cuboid.half_extents.to_array();
    let middle = place.to_array();
    let out = [0, 1, 2].map(|i| middle[i].abs() - half[i]);
    let axis = |i: usize| {
        let mut axis = [0.0; 3];
        axis[i] = 1.0_f64.copysign(middle[i]);
        Vector::from(axis)
    };
    // The point of the barrel that is first met along a normal, from outside.
    let nearest = |normal: Vector| {
        let sine = -along.dot(normal);
        let across = -normal - along * sine;
        let [on_axis, away] = barrel.0.core_support(sine.clamp(-1.0, 1.0));
        place + along * on_axis + across.normalize_or_zero() * away - normal * barrel.0.edge_m()
    };
    let gap = |normal: Vector| {
        let support: f64 = normal.to_array().iter().zip(half).map(|(n, h)| n.abs() * h).sum();
        let point = nearest(normal);
        (point.dot(normal) - support, point)
    };
    let reach = barrel.reach_m();
    // A gap is at most how far the middle is out, and less than that by the reach at most: most
    // faces cannot be the widest.
    let farthest = out.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (mut normal, mut widest, mut on_barrel) = (axis(0), f64::NEG_INFINITY, place);
    for (i, out) in out.iter().enumerate() {
        if *out < farthest - reach {
            continue;
        }
        let (found, point) = gap(axis(i));
        if found > widest {
            (normal, widest, on_barrel) = (axis(i), found, point);
        }
    }
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        if out[i] < -reach || out[j] < -reach {
            continue; // the edge is beyond the barrel
        }
        let (from, to) = (axis(i), axis(j));
        // A normal that leans from the one face, 0, to the other, 1, and what is at right angles to it.
        let leaning = |part: f64| {
            let length = (part * part + (1.0 - part) * (1.0 - part)).sqrt();
            let [a, b] = [(1.0 - part) / length, part / length];
            [from * a + to * b, to * a - from * b]
        };
        // The gap widens with the lean as long as the nearest point moves away from the edge.
        let edge = from * half[i] + to * half[j];
        let widens = |part: f64| {
            let [normal, turned] = leaning(part);
            turned.dot(nearest(normal) - edge)
        };
        let (first, last) = (widens(0.0), widens(1.0));
        let found = if first <= 0.0 {
            from
        } else if last > 0.0 {
            to
        } else {
            leaning(root([first, last], widens))[0]
        };
        let (found_gap, point) = gap(found);
        if found_gap > widest {
            (normal, widest, on_barrel) = (found, found_gap, point);
        }
    }
    Nearest {
        normal,
        on_barrel,
        gap_m: widest,
    }
}

/// Where a function that falls from `first` > 0 at 0 to `last` <= 0 at 1 is zero, to rounding: the
/// Illinois variant of false position.
fn root([mut first, mut last]: [f64; 2], function: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let mut moved = 0; // which end moved last, and so the other one's value is halved
    for _ in 0..60 {
        let at = (low * last - high * first) / (last - first);
        if !(at > low && at < high) {
            break;
        }
        let value = function(at);
        if value > 0.0 {
            (low, first) = (at, value);
            if moved == 1 {
                last *= 0.5;
            }
            moved = 1;
        } else {
            (high, last) = (at, value);
            if moved == -1 {
                first *= 0.5;
            }
            moved = -1;
        }
        if value.abs() < 1e-15 {
            return at;
        }
    }
    0.5 * (low + high)
}
