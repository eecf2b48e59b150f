//! Symmetry check of a vehicle.

use omni_config::{Body, Hinge, Vehicle, WheelSpec};

/// Places and directions may differ by so much.
const SAME: f64 = 1e-6;

/// Does each wheel, body and hinge have a fellow that is its mirror image?
pub(super) fn is_mirrored(vehicle: &Vehicle) -> bool {
    let wheels = &vehicle.wheel;
    let bodies = &vehicle.body;
    let hinges = &vehicle.hinge;
    wheels
        .iter()
        .all(|one| wheels.iter().any(|other| wheels_mirror(one, other)))
        && bodies
            .iter()
            .all(|one| bodies.iter().any(|other| bodies_mirror(one, other)))
        && hinges
            .iter()
            .all(|one| hinges.iter().any(|other| hinges_mirror(one, other)))
}

fn same(one: f64, other: f64) -> bool {
    (one - other).abs() <= SAME
}

/// A direction and its opposite are one: a wheel turns both ways.
fn wheels_mirror(one: &WheelSpec, other: &WheelSpec) -> bool {
    let [dx, dy] = one.rolling_direction;
    let [ex, ey] = other.rolling_direction;
    let turned = dx * ey + dy * ex;
    same(one.position_m[0], other.position_m[0])
        && same(one.position_m[1], -other.position_m[1])
        && turned.abs() <= SAME * dx.hypot(dy) * ex.hypot(ey)
        && same(one.roller_angle_rad, -other.roller_angle_rad)
        && same(one.radius_m, other.radius_m)
        && same(one.mass_kg, other.mass_kg)
        && same(one.inertia_kg_m2, other.inertia_kg_m2)
        && same(one.preload_n, other.preload_n)
        && one.contact == other.contact
}

fn bodies_mirror(one: &Body, other: &Body) -> bool {
    let ([x, y, z], [u, v, w]) = (one.com_m, other.com_m);
    same(x, u)
        && same(y, -v)
        && same(z, w)
        && same(one.mass_kg, other.mass_kg)
        && one.clearance_m == other.clearance_m
        && (0..3).all(|k| same(one.inertia_box_m[k], other.inertia_box_m[k]))
}

/// An axis and its opposite are one.
fn hinges_mirror(one: &Hinge, other: &Hinge) -> bool {
    let ([x, y, z], [u, v, w]) = (one.anchor_m, other.anchor_m);
    // The image of an axis is that of a rotation: it keeps y, and turns x and z.
    let image = [-one.axis[0], one.axis[1], -one.axis[2]];
    let along = |sign: f64| (0..3).all(|k| same(sign * image[k], other.axis[k]));
    same(x, u)
        && same(y, -v)
        && same(z, w)
        && same(one.limit_rad, other.limit_rad)
        && (along(1.0) || along(-1.0))
}
