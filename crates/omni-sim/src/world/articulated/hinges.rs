//! Dampers, stops and couplings of hinges.

use super::linear::Vector;
use super::model::{Body, Coupling, Model};
use super::system::System;
use super::tree::{FREE, State, Tree};

/// Natural frequency of a hinge at its stop \[rad/s\], critically damped: a hundred times per second.
const STOP_RAD_S: f64 = 632.0;

/// What holds a hinge in a step, or two that are coupled: the impulse `-(constant + per_rate rate)`,
/// the rate being that at the end of the step.
pub(super) struct Held {
    /// Unknowns of the tree; the same one twice for a single hinge.
    hinges: [usize; 2],
    /// Of the second hinge's rate; 0 for a single hinge.
    ratio: f64,
    pub(super) constant: f64,
    pub(super) per_rate: f64,
}

impl Held {
    fn new([a, b]: [usize; 2], ratio: f64, off: f64, [stiffness, damping]: [f64; 2], step_s: f64) -> Self {
        Self {
            hinges: [FREE - 1 + a, FREE - 1 + b],
            ratio,
            constant: step_s * stiffness * off,
            per_rate: step_s * (damping + step_s * stiffness),
        }
    }

    fn damper(b: usize, body: &Body, step_s: f64) -> Self {
        Self::new([b, b], 0.0, 0.0, [0.0, body.damping_n_m_s_rad], step_s)
    }

    fn coupling(coupling: &Coupling, angles_rad: &[f64], step_s: f64) -> Self {
        let (hinges, ratio) = ([coupling.a, coupling.b], coupling.ratio);
        let off = angles_rad[coupling.a] + ratio * angles_rad[coupling.b];
        let spring = [coupling.stiffness_n_m_rad, coupling.damping_n_m_s_rad];
        Self::new(hinges, ratio, off, spring, step_s)
    }

    pub(super) fn rate<const N: usize>(&self, u: &Vector<N>) -> f64 {
        let [a, b] = self.hinges;
        u[a] + self.ratio * u[b]
    }

    fn add_to<const N: usize>(&self, system: &mut System<N>) {
        let parts = [1.0, self.ratio];
        for (i, own) in self.hinges.into_iter().zip(parts) {
            for (j, other) in self.hinges.into_iter().zip(parts) {
                system.matrix[i][j] += self.per_rate * own * other;
            }
            system.right[i] -= self.constant * own;
        }
    }
}

/// Dampers, stops and couplings of hinges in a step.
pub(super) fn hold<const N: usize>(
    model: &Model,
    tree: &Tree<N>,
    state: &State,
    step_s: f64,
    held: &mut Vec<Held>,
) {
    let angles_rad = &state.angle_rad;
    held.clear();
    for (b, body) in model.bodies.iter().enumerate().skip(1) {
        if body.damping_n_m_s_rad > 0.0 {
            held.push(Held::damper(b, body, step_s));
        }
        let beyond = angles_rad[b] - angles_rad[b].clamp(-body.limit_rad, body.limit_rad);
        if beyond != 0.0 {
            let inertia = tree.hinge_inertia_kg_m2(b);
            let (spring, damper) = (inertia * STOP_RAD_S * STOP_RAD_S, 2.0 * inertia * STOP_RAD_S);
            // A stop pushes and does not pull.
            if (spring * beyond + damper * state.u[FREE - 1 + b]) * beyond.signum() > 0.0 {
                held.push(Held::new([b, b], 0.0, beyond, [spring, damper], step_s));
            }
        }
    }
    for coupling in &model.couplings {
        held.push(Held::coupling(coupling, angles_rad, step_s));
    }
}

/// Starts a tree's equations with what holds its hinges, as it is at the end of the step.
pub(super) fn start<const N: usize>(held: &[Held], bodies: usize, system: &mut System<N>) {
    *system = System::ZERO;
    // Hinges that there are not: unknowns that stay zero.
    for i in FREE - 1 + bodies..N {
        system.matrix[i][i] = 1.0;
    }
    for held in held {
        held.add_to(system);
    }
}
