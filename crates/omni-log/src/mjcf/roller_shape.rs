//! Shape of a roller for MuJoCo, which has no barrel.
//!
//! No single shape that it has follows the rim: between rollers a capsule is off by half of its own length squared
//! over the wheel's diameter, the ellipsoid that osculates the rim by `p R t^4 / (8 rho)` (0.4 mm on a wheel of 66 mm
//! with twelve rollers), and a polyhedron's facets are a staircase to a contact that gives 14 um. Ellipsoids about
//! one centre, each of which touches the rim at two angles +-t_k and is inside of it elsewhere, follow it better with
//! the square of their number n: where the squares of the t_k are evenly spaced up to that of the last angle T at
//! which the crown carries the wheel, they are inside by `p R T^4 / (32 rho n^2)` at most. Where neighbours carry the
//! wheel together, their ends are cylinders: an ellipsoid that goes on beyond T is off there by 30 um on `mecanum4`.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use omni_config::RollerWheel;

/// Ellipsoids a roller: three follow the rim of the built-in wheels within a ten-thousandth of their radius.
const PIECES: usize = 3;
/// Part of the wheel's radius by which the ellipsoids' outline may be off; rollers that are further off are polyhedra.
const OFF: f64 = 5e-4;
/// Slices along a polyhedron and corners around it.
const FACETS: [usize; 2] = [48, 96];
/// Where slopes are taken over: a part of the angle.
const APART: f64 = 1e-4;

/// An ellipsoid of revolution about the roller's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Half axes along the roller's axis and across it \[m\].
    pub(super) along_m: f64,
    pub(super) across_m: f64,
}

/// A cylinder about the roller's axis, whose edges are on the roller's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ends {
    pub(super) radius_m: f64,
    pub(super) half_length_m: f64,
}

/// A roller.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum RollerShape {
    /// Its crown, and its ends where they carry the wheel.
    Pieces(Vec<Piece>, Option<Ends>),
    /// Corners \[m\]; the axis is x.
    Mesh(Vec<[f64; 3]>),
}

impl RollerShape {
    pub(super) fn of(wheel: &RollerWheel) -> Self {
        pieces(wheel).map_or_else(
            || Self::Mesh(mesh(wheel)),
            |pieces| Self::Pieces(pieces, ends(wheel)),
        )
    }
}

/// The ellipsoids; none if they do not do.
fn pieces(wheel: &RollerWheel) -> Option<Vec<Piece>> {
    let cos = libm::cos(wheel.roller_angle_rad);
    let sine = |turn: f64| cos * libm::sin(turn);
    let most = crowned_rad(wheel);
    let at = |k: usize| most * ((2 * k + 1) as f64 / (2 * PIECES) as f64).sqrt();
    let pieces: Option<Vec<_>> = (0..PIECES).map(|k| touching(wheel, at(k), sine)).collect();
    let pieces = pieces?;
    let outline = |turn: f64| {
        pieces
            .iter()
            .map(|piece| piece.reach_m(sine(turn)))
            .fold(0.0, f64::max)
    };
    let half_pitch = half_pitch_rad(wheel);
    let off = (0..=64).map(|k| {
        let turn = half_pitch * f64::from(k) / 64.0;
        (outline(turn) - wheel.barrel.reach_m(sine(turn))).abs()
    });
    (off.fold(0.0, f64::max) <= OFF * wheel.radius_m).then_some(pieces)
}

/// How far the wheel turns from a roller's middle to where its neighbour's part begins.
fn half_pitch_rad(wheel: &RollerWheel) -> f64 {
    PI / (wheel.count * wheel.rows) as f64
}

/// How far the wheel may turn from a roller's middle while its crown is under the axle: to where its own edge begins.
fn crowned_rad(wheel: &RollerWheel) -> f64 {
    let cos = libm::cos(wheel.roller_angle_rad);
    let end_m = (wheel.barrel.half_length_m() - wheel.barrel.edge_m()) * (1.0 - 1e-9);
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if wheel.barrel.core_support(cos * libm::sin(middle))[0] < end_m {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The ends of a roller that carries the wheel together with its neighbours: where its edge begins,
/// and a cylinder on from there.
fn ends(wheel: &RollerWheel) -> Option<Ends> {
    let turn = crowned_rad(wheel);
    let sine = libm::cos(wheel.roller_angle_rad) * libm::sin(turn);
    let ([along, away], edge_m) = (wheel.barrel.core_support(sine), wheel.barrel.edge_m());
    (turn > half_pitch_rad(wheel)).then(|| Ends {
        radius_m: away + edge_m * (1.0 - sine * sine).sqrt(),
        half_length_m: along + edge_m * sine,
    })
}

/// The ellipsoid that touches what the roller touches where the wheel has turned by an angle.
fn touching(wheel: &RollerWheel, turn: f64, sine: impl Fn(f64) -> f64) -> Option<Piece> {
    // An ellipsoid's reach squared is a straight line over the sine squared.
    let square = |turn: f64| [sine(turn), wheel.barrel.reach_m(sine(turn))].map(|value| value * value);
    let [[s0, r0], [s1, r1], [s2, r2]] = [turn * (1.0 - APART), turn, turn * (1.0 + APART)].map(square);
    let slope = (r2 - r0) / (s2 - s0);
    let across = r1 - slope * s1;
    let along = across + slope;
    (across > 0.0 && along > 0.0).then(|| Piece {
        along_m: along.sqrt(),
        across_m: across.sqrt(),
    })
}

impl Piece {
    /// How far it reaches in a direction at an angle to the plane across its axis of this sine \[m\].
    fn reach_m(self, sine: f64) -> f64 {
        let [along, across] = [self.along_m * sine, self.across_m];
        (along * along + across * across * (1.0 - sine * sine)).sqrt()
    }
}

/// Corners of the barrel. Those around it are so much further out that facets and arcs are as far
/// from the axis in the mean.
fn mesh(wheel: &RollerWheel) -> Vec<[f64; 3]> {
    let [slices, around] = FACETS;
    let barrel = &wheel.barrel;
    let out = PI / around as f64 / libm::sin(PI / around as f64);
    let mut points = Vec::with_capacity((slices + 1) * around);
    for slice in 0..=slices {
        // Angles of the normal, evenly spaced where the barrel is crowned; the last one is the edge of its end.
        let lean = 0.5 * PI * (2.0 * slice as f64 / slices as f64 - 1.0);
        let (sin, cos) = libm::sincos(lean);
        let [along, away] = barrel.core_support(sin);
        let (x, radius) = (
            along + barrel.edge_m() * sin,
            (away + barrel.edge_m() * cos) * out,
        );
        points.extend((0..around).map(|k| {
            let (sin, cos) = libm::sincos(TAU * k as f64 / around as f64);
            [x, radius * cos, radius * sin].map(|v| (v * 1e9).round() * 1e-9)
        }));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use omni_config::{Vehicle, WheelModel};

    #[test]
    fn a_wheel_of_ellipsoids_is_as_round_as_its_barrels_within_a_ten_thousandth() {
        for name in ["chugo7", "omni3", "mecanum4", "rocker_bogie6"] {
            let wheel = Vehicle::load(name)
                .expect("built in")
                .rollers(0, WheelModel::Rollers);
            let wheel = wheel.expect("it has rollers");
            let pieces = pieces(&wheel).expect("they follow the rim");
            let cos = libm::cos(wheel.roller_angle_rad);
            let most = crowned_rad(&wheel);
            let off = |turn: f64| {
                let sine = cos * libm::sin(turn);
                let reach = pieces.iter().map(|piece| piece.reach_m(sine)).fold(0.0, f64::max);
                reach - wheel.barrel.reach_m(sine)
            };
            for k in 0..=200 {
                let turn = most * f64::from(k) / 200.0;
                // Inside all along, by p R T^4 / (32 rho n^2) and what the next order adds: 20 um on mecanum4.
                let bound = wheel.pitch_radius_m * wheel.radius_m * most.powi(4)
                    / (32.0 * wheel.barrel.radius_m() * (PIECES * PIECES) as f64);
                assert!(
                    (-1.05 * bound..1e-9).contains(&off(turn)),
                    "{name} at {turn}: {} of {bound}",
                    off(turn)
                );
            }
        }
    }

    #[test]
    fn rollers_that_carry_together_have_ends_as_barrels_have_within_two_micrometres() {
        let of = |name: &str| {
            let vehicle = Vehicle::load(name).expect("built in");
            vehicle.rollers(0, WheelModel::Rollers).expect("it has rollers")
        };
        for name in ["omni3", "mecanum4"] {
            let wheel = of(name);
            let (ends, pieces) = (
                ends(&wheel).expect("they overlap"),
                pieces(&wheel).expect("a rim"),
            );
            let (cos, from) = (libm::cos(wheel.roller_angle_rad), crowned_rad(&wheel));
            // From where the edge begins to where it is 15 um above the ground, more than a
            // contact's spring gives there.
            for k in 0..=20 {
                let turn = from + 0.02 * f64::from(k) / 20.0;
                let sine = cos * libm::sin(turn);
                let reach = pieces.iter().map(|piece| piece.reach_m(sine));
                let edge = ends.half_length_m * sine + ends.radius_m * (1.0 - sine * sine).sqrt();
                let off = reach.fold(edge, f64::max) - wheel.barrel.reach_m(sine);
                assert!(off.abs() < 2e-6, "{name} at {turn}: {off}");
            }
        }
        // With a gap between them one ends before the next begins.
        for name in ["chugo7", "rocker_bogie6"] {
            assert_eq!(ends(&of(name)), None);
        }
    }
}
