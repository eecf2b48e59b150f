//! Linear programs over contact forces; the only module that names microlp.

use microlp::{ComparisonOp, Error as LpError, OptimizationDirection, Problem, SolveOutcome, Variable};

use crate::Error;
use crate::climb_path::{Posture, along, less, moment};
use crate::linkage::Linkage;
use crate::step::Step;

/// What is asked of the contact forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ask {
    /// The least torque of an actuator \[N.m\] that keeps the balance at rest.
    Torque,
    /// The largest acceleration along the path \[rad/s^2\] with this torque of an actuator \[N.m\].
    Acceleration(f64),
}

/// The best that contact forces can do at a point of the path of a row; none if no forces keep all rows on the ground.
///
/// Unknown are a normal force and a force along the way for each row, and what is asked for. Four equations: the
/// vehicle's forces forward and up, and the moment of each frame about the hinge, where the hinge's own force has none.
pub(crate) fn best(
    linkage: &Linkage,
    step: &Step,
    row: usize,
    posture: &Posture,
    ask: Ask,
) -> Result<Option<f64>, Error> {
    // Forces in weights, lengths in radii, accelerations in units of gravity: numbers near 1, however large the
    // vehicle.
    let (length, fall) = (linkage.rows[row].radius_m, step.gravity_m_s2);
    let weight_n = linkage.mass_kg() * fall;
    let unit = match ask {
        Ask::Torque => weight_n * length,
        Ask::Acceleration(_) => fall / length,
    };
    let free = (f64::NEG_INFINITY, f64::INFINITY);
    let (direction, bounds, torque_n_m) = match ask {
        Ask::Torque => (OptimizationDirection::Minimize, (0.0, f64::INFINITY), None),
        Ask::Acceleration(torque) => (OptimizationDirection::Maximize, free, Some(torque)),
    };
    let mut program = Problem::new(direction);
    let asked = program.add_var(1.0, bounds);
    let forces: [[Variable; 2]; 3] = std::array::from_fn(|_| {
        let normal = program.add_var(0.0, (0.0, f64::INFINITY));
        [normal, program.add_var(0.0, free)]
    });

    let mut equations: [(Vec<(Variable, f64)>, f64); 4] = Default::default();
    let at_hinge = posture.hinge.at;
    for each in 0..3 {
        let (normal, spec) = (posture.normals[each], &linkage.rows[each]);
        let contact = less(posture.axles[each].at, normal.map(|part| spec.radius_m * part));
        for (variable, way) in forces[each].into_iter().zip([normal, along(normal)]) {
            equations[0].0.push((variable, way[0]));
            equations[1].0.push((variable, way[1]));
            equations[2 + spec.frame]
                .0
                .push((variable, moment(less(contact, at_hinge), way) / length));
        }
        // Friction, of the wheels that roll along the way; all of the climbing row's load is theirs.
        let load = if each == row { 1.0 } else { 1.0 - spec.crosswise };
        let [pressed, pushed] = forces[each];
        // Weights for each N.m of an actuator, and those that speed the wheels up.
        let most = spec.torques / spec.radius_m / weight_n;
        let turn = spec.spin_kg_m2 * linkage.spin(posture, each) / spec.radius_m / weight_n;
        for sign in [1.0, -1.0] {
            let grip = [(pushed, sign), (pressed, -step.friction * load)];
            program.add_constraint(grip, ComparisonOp::Le, 0.0);
            match torque_n_m {
                None => {
                    program.add_constraint([(pushed, sign), (asked, -most * unit)], ComparisonOp::Le, 0.0)
                }
                Some(torque) => {
                    let push = [(pushed, sign), (asked, sign * turn * unit)];
                    program.add_constraint(push, ComparisonOp::Le, most * torque);
                }
            }
        }
    }
    let mut inertia = [0.0; 4];
    for (frame, spec) in linkage.frames.iter().enumerate() {
        let (centre, (_, turning)) = (posture.centres[frame], posture.noses[frame]);
        let arm = less(centre.at, at_hinge);
        let weight = [0.0, spec.mass_kg * step.gravity_m_s2];
        let change = centre.rate.map(|rate| spec.mass_kg * rate);
        equations[1].1 += weight[1];
        equations[2 + frame].1 += moment(arm, weight);
        inertia[0] += change[0];
        inertia[1] += change[1];
        inertia[2 + frame] += moment(arm, change) + spec.inertia_kg_m2 * turning;
    }
    for each in 0..3 {
        // Rolling forward is turning nose down.
        let spec = &linkage.rows[each];
        inertia[2 + spec.frame] -= spec.spin_kg_m2 * linkage.spin(posture, each);
    }
    let units = [weight_n, weight_n, weight_n * length, weight_n * length];
    for (((mut terms, given), inertia), of_it) in equations.into_iter().zip(inertia).zip(units) {
        if torque_n_m.is_some() {
            terms.push((asked, -inertia * unit / of_it));
        }
        program.add_constraint(terms, ComparisonOp::Eq, given / of_it);
    }

    let failed = |reason: String| Error::Solver { row, reason };
    match program.solve() {
        Ok(SolveOutcome::Solution(found)) => Ok(Some(found.var_value(asked) * unit)),
        Ok(_) => Err(failed("it was interrupted".into())),
        Err(LpError::Infeasible) => Ok(None),
        Err(other) => Err(failed(other.to_string())),
    }
}
