//! The ground, and where a ball meets it. parry knows the shapes; what touches, and which way it pushes, is said here.

use rapier3d_f64::parry::bounding_volume::Aabb;
use rapier3d_f64::parry::query::PointQuery;
use rapier3d_f64::parry::shape::{Cuboid, Cylinder, HeightField, HeightFieldFlags, Triangle};
use rapier3d_f64::prelude::{AngVector, Pose, Rotation, Vector};

use crate::config::{FrictionPatch, Scenario};
use crate::ground::{Shape, reach_m, shapes};
use crate::world::height_field::height_field;

/// A place where something meets the ground, or is about to.
#[derive(Clone, Copy)]
pub(super) struct Touch {
    /// Unit vector out of the ground.
    pub(super) normal: Vector,
    /// On the ground \[m\].
    pub(super) point: Vector,
    /// Between the two \[m\], below 0 if they overlap.
    pub(super) gap_m: f64,
    pub(super) friction: f64,
    /// Which part of the ground, and which face of it: the same as long as the contact lasts.
    pub(super) key: [u32; 2],
}

/// The ground.
pub(super) struct Ground {
    pub(super) parts: Vec<Part>,
    friction: f64,
    patches: Vec<FrictionPatch>,
    /// At which the patches are where they are \[s\].
    pub(super) time_s: f64,
}

pub(super) enum Solid {
    Box(Cuboid),
    /// Along its own y.
    Bar(Cylinder),
    Field(HeightField),
}

pub(super) struct Part {
    pub(super) solid: Solid,
    pub(super) pose: Pose,
    /// Whether its axes are the world's.
    unturned: bool,
    bounds: Aabb,
}

/// Two points this close are one \[m\].
const SAME_POINT_M: f64 = 1e-9;

impl Ground {
    /// The ground of a scenario; none if its kind is unknown.
    pub(super) fn new(scenario: &Scenario) -> Option<Self> {
        let parts: Vec<_> = shapes(scenario, reach_m(scenario))
            .into_iter()
            .map(Part::new)
            .collect();
        (!parts.is_empty()).then(|| Self {
            parts,
            friction: scenario.terrain.friction(),
            patches: scenario.friction_patch.clone(),
            time_s: 0.0,
        })
    }

    /// The coefficient of friction at a place: the last patch that holds it sets it.
    pub(super) fn friction_at(&self, point: Vector) -> f64 {
        let mut patches = self.patches.iter().rev();
        let patch = patches.find(|patch| patch.holds(point.x, point.y, self.time_s));
        patch.map_or(self.friction, |patch| patch.friction)
    }

    /// The parts that come within a distance of a point, with their indices.
    pub(super) fn near(&self, point: Vector, reach_m: f64) -> impl Iterator<Item = (u32, &Part)> {
        (0..).zip(&self.parts).filter(move |(_, part)| {
            let (low, high) = (part.bounds.mins, part.bounds.maxs);
            let out = (low - point).max(point - high);
            out.max_element() <= reach_m
        })
    }

    /// The places where a ball is nearer to the ground than `ahead_m`.
    pub(super) fn meet(&self, centre: Vector, radius_m: f64, ahead_m: f64, mut found: impl FnMut(&Touch)) {
        let reach_m = radius_m + ahead_m;
        for (index, part) in self.near(centre, reach_m) {
            let at = part.inwards(centre);
            let of = |on: Vector, inside: bool| {
                let away = at - on;
                let distance_m = away.length();
                let side = if inside { -1.0 } else { 1.0 };
                let meets = distance_m <= reach_m && distance_m > 0.0;
                meets.then(|| (on, away * (side / distance_m), side * distance_m - radius_m))
            };
            let mut add = |(on, normal, gap_m): (Vector, Vector, f64), face: u32| {
                let point = part.outwards(on);
                found(&Touch {
                    normal: part.turned(normal),
                    point,
                    gap_m,
                    friction: self.friction_at(point),
                    key: [index, face],
                });
            };
            match &part.solid {
                Solid::Box(shape) => {
                    let (on, inside) = nearest_on_box(shape, at);
                    if let Some(place) = of(on, inside) {
                        add(place, 0);
                    }
                }
                Solid::Bar(shape) => {
                    let nearest = shape.project_local_point(at, false);
                    if let Some(place) = of(nearest.point, nearest.is_inside) {
                        add(place, 0);
                    }
                }
                Solid::Field(shape) => {
                    // A field has no inside: what is below its faces is under the ground.
                    let nearest = |triangle: &Triangle| {
                        let on = triangle.project_local_point(at, false).point;
                        let up = triangle.normal()?;
                        let up = if up.y < 0.0 { -up } else { up };
                        match (at - on).dot(up) {
                            0.0 => Some((on, up, -radius_m)),
                            height => of(on, height < 0.0),
                        }
                    };
                    for (found, face) in nearest_on_field(shape, at, reach_m, nearest) {
                        add(found, face);
                    }
                }
            }
        }
    }
}

/// A place on the ground, the normal there, and the gap above it \[m\].
pub(super) type Place = (Vector, Vector, f64);

/// The places of a height field where the distance to something is least, nearest first, with their faces.
///
/// `nearest` is the place of a triangle that is nearest to it. Where that lies on another triangle too, on an edge
/// or a corner, it counts only if that one has no place as near: the edges inside a smooth field do not push.
pub(super) fn nearest_on_field(
    field: &HeightField,
    at: Vector,
    reach_m: f64,
    nearest: impl Fn(&Triangle) -> Option<Place>,
) -> Vec<(Place, u32)> {
    let around = Aabb::new(at - Vector::splat(reach_m), at + Vector::splat(reach_m));
    let mut found: Vec<(Place, u32, Triangle)> = Vec::new();
    field.map_elements_in_local_aabb(&around, &mut |face, triangle: &Triangle| {
        if let Some(place) = nearest(triangle) {
            found.push((place, face, *triangle));
        }
    });
    found.sort_by(|a, b| a.0.2.total_cmp(&b.0.2).then(a.1.cmp(&b.1)));
    let mut kept: Vec<(Place, u32)> = Vec::new();
    for (i, (place, face, _)) in found.iter().enumerate() {
        let (point, _, _) = *place;
        // Those next in order are next to it.
        let nearer = found[..i].iter().rev().any(|(_, _, triangle)| {
            (triangle.project_local_point(point, false).point - point).length() < SAME_POINT_M
        });
        if !nearer {
            kept.push((*place, *face));
        }
    }
    kept
}

/// The direction of a part from a point.
pub(super) enum PartDirection {
    Towards(Vector),
    /// In several.
    Around,
}

impl Part {
    /// The vector from a point to the nearest place of a part \[m\]; none if that is farther than `reach_m`.
    pub(super) fn direction_from(&self, point: Vector, reach_m: f64) -> Option<PartDirection> {
        let at = self.inwards(point);
        let (on, inside) = match &self.solid {
            Solid::Box(shape) => nearest_on_box(shape, at),
            Solid::Bar(shape) => {
                let nearest = shape.project_local_point(at, false);
                (nearest.point, nearest.is_inside)
            }
            Solid::Field(_) => return Some(PartDirection::Around),
        };
        if inside {
            return Some(PartDirection::Around);
        }
        let way = self.turned(on - at);
        (way.length() <= reach_m).then_some(PartDirection::Towards(way))
    }

    /// A point of the world in the frame of the part.
    pub(super) fn inwards(&self, point: Vector) -> Vector {
        if self.unturned {
            point - self.pose.translation
        } else {
            self.pose.inverse_transform_point(point)
        }
    }

    /// A point in the frame of the part in the world.
    pub(super) fn outwards(&self, point: Vector) -> Vector {
        self.turned(point) + self.pose.translation
    }

    /// A direction in the frame of the part in the world.
    pub(super) fn turned(&self, direction: Vector) -> Vector {
        if self.unturned {
            direction
        } else {
            self.pose.rotation * direction
        }
    }

    /// A direction of the world in the frame of the part.
    pub(super) fn turned_back(&self, direction: Vector) -> Vector {
        if self.unturned {
            direction
        } else {
            self.pose.rotation.inverse() * direction
        }
    }

    fn new(shape: Shape) -> Self {
        let (solid, pose, bounds) = match shape {
            Shape::Box {
                half_m,
                centre_m,
                turn_y_rad,
            } => {
                let shape = Cuboid::new(half_m.into());
                let pose = Pose::new(centre_m.into(), AngVector::new(0.0, turn_y_rad, 0.0));
                let bounds = shape.aabb(&pose);
                (Solid::Box(shape), pose, bounds)
            }
            Shape::Bar {
                half_length_m,
                radius_m,
                centre_m,
            } => {
                let shape = Cylinder::new(half_length_m, radius_m);
                let pose = Pose::new(centre_m.into(), AngVector::ZERO);
                let bounds = shape.aabb(&pose);
                (Solid::Bar(shape), pose, bounds)
            }
            Shape::Field {
                from_m,
                extent_m,
                rows,
                columns,
                heights_m,
            } => {
                let (heights, scale, pose) = height_field(from_m, extent_m, [rows, columns], &heights_m);
                let shape = HeightField::with_flags(heights, scale, HeightFieldFlags::empty());
                let bounds = shape.aabb(&pose);
                (Solid::Field(shape), pose, bounds)
            }
        };
        Self {
            unturned: pose.rotation == Rotation::IDENTITY,
            solid,
            pose,
            bounds,
        }
    }
}

/// The place of a box's surface that is nearest to a point, and whether the point is inside.
fn nearest_on_box(shape: &Cuboid, at: Vector) -> (Vector, bool) {
    let half = shape.half_extents;
    let mut on = at.clamp(-half, half);
    if on != at {
        return (on, false);
    }
    // Out through the nearest face.
    let depth = half - at.abs();
    let axis = if depth.x <= depth.y.min(depth.z) {
        0
    } else if depth.y <= depth.z {
        1
    } else {
        2
    };
    on[axis] = if at[axis] < 0.0 { -half[axis] } else { half[axis] };
    (on, true)
}
