//! The inverse mass that MuJoCo counts for a roller: what a contact's stiffness is measured in.
//!
//! It is the mean over three directions of the velocity that a unit impulse at the roller's middle gives that
//! point, all joints free and at their start (`body_invweight0` of MuJoCo). A roller's own spin has no part in it.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use omni_config::{RollerWheel, Vehicle, WheelSpec};

/// Unknowns of the base: its velocity and its angular velocity.
const BASE: usize = 6;

/// How an unknown moves a rigid part: an axis through a point \[m\].
struct Turn {
    unknown: usize,
    axis: Vector3<f64>,
    anchor_m: Vector3<f64>,
}

/// One inverse mass per wheel \[1/kg\], the mean over its rollers.
pub(super) fn mobilities_per_kg(vehicle: &Vehicle, rollers: &[RollerWheel]) -> Vec<f64> {
    let unknowns = BASE + vehicle.hinge.len() + vehicle.wheel.len();
    let mut mass = DMatrix::zeros(unknowns, unknowns);
    for body in &vehicle.body {
        let inertia = Matrix3::from_diagonal(&Vector3::from(body.inertia_kg_m2()));
        let turns = turns(vehicle, &body.name);
        add(&mut mass, &turns, body.com_m.into(), body.mass_kg, inertia);
    }
    for (i, wheel) in vehicle.wheel.iter().enumerate() {
        let axle = axle(wheel);
        // A disc has half of its inertia across its axle.
        let inertia = (Matrix3::identity() + axle * axle.transpose()) * (0.5 * wheel.inertia_kg_m2);
        let turns = wheel_turns(vehicle, i);
        add(&mut mass, &turns, centre(wheel), wheel.mass_kg, inertia);
    }
    let Some(inverse) = mass.try_inverse() else {
        return vec![0.0; rollers.len()]; // no vehicle that can be loaded is without mass
    };
    rollers
        .iter()
        .enumerate()
        .map(|(i, built)| {
            let (wheel, turns) = (&vehicle.wheel[i], wheel_turns(vehicle, i));
            let axle = axle(wheel);
            let rolling = axle.cross(&Vector3::z());
            let each = built.places().map(|(angle, along)| {
                let out = -rolling * libm::sin(angle) - Vector3::z() * libm::cos(angle);
                let at = centre(wheel) + out * built.pitch_radius_m + axle * along;
                (0..3)
                    .map(|k| {
                        let row = row(unknowns, &turns, at, k);
                        (&inverse * &row).dot(&row) / 3.0
                    })
                    .sum::<f64>()
            });
            each.sum::<f64>() / (built.count * built.rows) as f64
        })
        .collect()
}

fn centre(wheel: &WheelSpec) -> Vector3<f64> {
    let [x, y] = wheel.position_m;
    Vector3::new(x, y, wheel.radius_m)
}

fn axle(wheel: &WheelSpec) -> Vector3<f64> {
    let [x, y] = wheel.rolling_direction;
    Vector3::new(-y, x, 0.0).normalize()
}

/// The hinges between the base and a body.
fn turns(vehicle: &Vehicle, body: &str) -> Vec<Turn> {
    let (mut found, mut name) = (Vec::new(), body);
    // A loaded vehicle is a tree.
    while let Some((i, hinge)) = vehicle.hinge.iter().enumerate().find(|(_, h)| h.child == name) {
        found.push(Turn {
            unknown: BASE + i,
            axis: Vector3::from(hinge.axis).normalize(),
            anchor_m: hinge.anchor_m.into(),
        });
        name = &hinge.parent;
    }
    found
}

fn wheel_turns(vehicle: &Vehicle, index: usize) -> Vec<Turn> {
    let wheel = &vehicle.wheel[index];
    let mut turns = turns(vehicle, &wheel.body);
    turns.push(Turn {
        unknown: BASE + vehicle.hinge.len() + index,
        axis: axle(wheel),
        anchor_m: centre(wheel),
    });
    turns
}

/// The velocity of a point along the world's axis `k`, per unknown.
fn row(unknowns: usize, turns: &[Turn], at: Vector3<f64>, k: usize) -> DVector<f64> {
    let mut row = DVector::zeros(unknowns);
    row[k] = 1.0;
    for axis in 0..3 {
        row[3 + axis] = Vector3::ith_axis(axis).cross(&at)[k];
    }
    for turn in turns {
        row[turn.unknown] = turn.axis.cross(&(at - turn.anchor_m))[k];
    }
    row
}

/// Adds a rigid part with its centre of mass there.
fn add(mass: &mut DMatrix<f64>, turns: &[Turn], at: Vector3<f64>, mass_kg: f64, inertia: Matrix3<f64>) {
    let unknowns = mass.nrows();
    for k in 0..3 {
        let row = row(unknowns, turns, at, k);
        *mass += &row * row.transpose() * mass_kg;
    }
    let mut spin = DMatrix::zeros(3, unknowns);
    for axis in 0..3 {
        spin[(axis, 3 + axis)] = 1.0;
    }
    for turn in turns {
        spin.column_mut(turn.unknown).copy_from(&turn.axis);
    }
    *mass += spin.transpose() * inertia * spin;
}
