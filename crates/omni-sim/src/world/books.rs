//! Energy and momentum, booked so that they close.
//!
//! In a step every impulse J changes the kinetic energy by J times the mean of the velocities before and after it, at the point
//! where it acts. So friction, impacts and motors are booked with such means, and what is left over is what the joints of a
//! soft solver take or give, and the gravity of a step in which velocities jump.

use rapier3d_f64::prelude::*;
use serde::{Deserialize, Serialize};

use super::actuation::Actuation;
use super::vehicle::VehicleBodies;
use crate::observation::{Energy, Observation};

/// The books of a world.
pub(super) struct Books {
    state: State,
    /// Velocities before the step by the body's index: linear, angular.
    before: Vec<(Vector, AngVector)>,
    momentum: Vector,
}

/// What a snapshot keeps.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct State {
    friction_loss_j: f64,
    impact_loss_j: f64,
    hinge_loss_j: f64,
    added_j: f64,
    start_potential_j: f64,
    momentum: [f64; 3],
}

impl Books {
    pub(super) fn new(physics: &PhysicsWorld) -> Self {
        Self {
            state: State {
                start_potential_j: potential(physics),
                ..State::default()
            },
            before: Vec::new(),
            momentum: Vector::ZERO,
        }
    }

    pub(super) fn state(&self) -> State {
        State {
            momentum: self.momentum.into(),
            ..self.state.clone()
        }
    }

    pub(super) fn restore(&mut self, state: State) {
        self.momentum = Vector::from(state.momentum);
        self.state = state;
    }

    /// Before a physics step: remembers velocities.
    pub(super) fn open(&mut self, physics: &PhysicsWorld) {
        self.before.clear();
        for (handle, body) in physics.bodies.iter() {
            let index = handle.into_raw_parts().0 as usize;
            if index >= self.before.len() {
                self.before.resize(index + 1, (Vector::ZERO, AngVector::ZERO));
            }
            self.before[index] = (body.linvel(), body.angvel());
        }
    }

    /// After a physics step: the hinges' dampers.
    pub(super) fn hinges(&mut self, physics: &PhysicsWorld, vehicle: &VehicleBodies) {
        let dt = physics.integration_parameters.dt;
        for hinge in &vehicle.hinges {
            let axis = hinge.axis_world(physics);
            let rate =
                |at: &dyn Fn(RigidBodyHandle) -> AngVector| (at(hinge.child) - at(hinge.parent)).dot(axis);
            let now = rate(&|handle| physics.bodies[handle].angvel());
            let then = rate(&|handle| self.before(handle).1);
            let mean = f64::midpoint(now, then);
            self.state.hinge_loss_j += hinge.damping_n_m_s_rad * mean * mean * dt;
        }
    }

    /// Velocities of a body before the step.
    fn before(&self, handle: RigidBodyHandle) -> (Vector, AngVector) {
        let index = handle.into_raw_parts().0 as usize;
        self.before
            .get(index)
            .copied()
            .unwrap_or((Vector::ZERO, AngVector::ZERO))
    }

    /// After a physics step: what a contact's impulses on a body took, at `arm` from its centre of mass.
    pub(super) fn contact(
        &mut self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        arm: Vector,
        normal: Vector,
        tangent: Vector,
    ) {
        let (v, w) = self.before(handle);
        let mean = (v + body.linvel() + (w + body.angvel()).cross(arm)) * 0.5;
        self.state.impact_loss_j -= normal.dot(mean);
        self.state.friction_loss_j -= tangent.dot(mean);
    }

    /// A mass that appears brings its energy with it.
    pub(super) fn around(&mut self, physics: &mut PhysicsWorld, change: impl FnOnce(&mut PhysicsWorld)) {
        let before = kinetic(physics) + potential(physics);
        change(physics);
        self.state.added_j += kinetic(physics) + potential(physics) - before;
        self.momentum = momentum(physics);
    }

    /// At the end of a control period: the energies, and the force that Newton's second law misses.
    pub(super) fn close(
        &mut self,
        physics: &PhysicsWorld,
        actuation: &Actuation,
        period_s: f64,
        seen: &mut Observation,
    ) {
        let (state, moved) = (&self.state, actuation.state());
        seen.energy = Energy {
            work_in_j: moved.work_j + state.added_j,
            kinetic_j: kinetic(physics),
            potential_j: potential(physics) - state.start_potential_j,
            friction_loss_j: state.friction_loss_j,
            impact_loss_j: state.impact_loss_j,
            damping_loss_j: state.hinge_loss_j + moved.drag_loss_j,
        };
        let now = momentum(physics);
        let ground: Vector = seen.wheels.iter().map(|w| Vector::from(w.force_n)).sum();
        let weight = physics.gravity * mass(physics);
        if period_s > 0.0 {
            seen.newton_residual_n = ((now - self.momentum) / period_s - ground - weight).length();
        }
        self.momentum = now;
    }
}

fn dynamic(physics: &PhysicsWorld) -> impl Iterator<Item = &RigidBody> {
    physics
        .bodies
        .iter()
        .map(|(_, body)| body)
        .filter(|body| body.is_dynamic())
}

fn kinetic(physics: &PhysicsWorld) -> f64 {
    dynamic(physics).map(RigidBody::kinetic_energy).sum()
}

fn potential(physics: &PhysicsWorld) -> f64 {
    dynamic(physics)
        .map(|body| -body.mass() * physics.gravity.dot(body.center_of_mass()))
        .sum()
}

fn mass(physics: &PhysicsWorld) -> f64 {
    dynamic(physics).map(RigidBody::mass).sum()
}

fn momentum(physics: &PhysicsWorld) -> Vector {
    dynamic(physics).map(|body| body.linvel() * body.mass()).sum()
}
