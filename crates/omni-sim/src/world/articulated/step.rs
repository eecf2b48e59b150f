//! One step of the physics.

use rapier3d_f64::prelude::Vector as Vector3;

use super::World;
use super::balance::Mean;
use super::contact::{Contact, WarmStart};
use super::grip::Grip;
use super::hinges;
use super::linear::{add, middle};
use super::meeting::Meeting;
use super::model::WheelShape;
use super::solver::solve_step;
use super::spin::Spin;
use super::tree::twist;
use crate::config::MOST_WHEELS;

/// Minimum distance from a surface at which contacts are searched \[m\].
const AHEAD_M: f64 = 0.002;
/// The same for rollers, of which fewer are looked at then \[m\].
const AHEAD_OF_ROLLERS_M: f64 = 0.0002;

impl<const N: usize> World<N> {
    /// One step of the physics with torques on the wheels \[N.m\], in `torques_n_m`, and of each
    /// the damper of drags on it \[N.m.s/rad\] and the dry friction \[N.m\].
    pub(super) fn advance_step(&mut self, drags: impl Fn(usize) -> [f64; 2]) {
        let step_s = self.step_s;
        self.before_com = self.com();
        self.spins.clear();
        let u0 = self.u();
        let (tree, bodies) = (&self.tree, &mut self.equations.bodies);
        for (b, body) in bodies.iter_mut().enumerate() {
            body.matrix = tree.inertia[b];
            body.right = tree.momentum[b];
            add(&mut body.right, step_s, &tree.bias_force[b]);
        }
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let impulse = step_s * self.torques_n_m[i];
            let [damper, hold] = drags(i);
            let mut spin = Spin {
                body: wheel.body,
                inertia_kg_m2: wheel.inertia_kg_m2,
                free_rad_s: self.state.spin_rad_s[i] + impulse / wheel.inertia_kg_m2,
                damper: step_s * damper,
                hold: step_s * hold,
                grip: Grip::Stick,
                held: 0.0,
                axle: tree.axle[i],
            };
            if spin.hold > 0.0 {
                spin.guess(spin.turning_rad_s(&tree.twist[wheel.body], self.state.spin_rad_s[i]));
            }
            // The motor's reaction acts on the carrier.
            add(&mut bodies[wheel.body].right, -impulse, &spin.carried());
            self.spins.push(spin);
        }
        self.bearings
            .release(&self.model, &self.tree, &self.state, step_s, &mut self.spins);
        for (wheel, moment) in self.model.wheels.iter().zip(&self.bearings.on_carrier) {
            let moment = twist(Vector3::ZERO, *moment);
            add(&mut bodies[wheel.body].right, step_s, &moment);
        }
        self.meet();
        hinges::hold(&self.model, &self.tree, &self.state, step_s, &mut self.held);
        hinges::start(&self.held, self.model.bodies.len(), &mut self.equations.tree);
        self.equations.tree.right[2] -= step_s * self.model.gravity_m_s2 * self.model.mass_kg;
        self.spins_after.clone_from(&self.state.spin_rad_s);
        let mut u = solve_step(
            &self.tree,
            &mut self.equations,
            &mut self.spins,
            &mut self.contacts,
            &mut self.spins_after,
            &mut self.stats,
        );
        // The solution leaves 1e-10 m/s; from the impulses themselves the momentum is right to rounding.
        let pushed: Vector3 = self.contacts.iter().map(Contact::impulse).sum();
        for k in 0..3 {
            u[k] = u0[k] + pushed[k] / self.model.mass_kg;
        }
        u[2] -= step_s * self.model.gravity_m_s2;
        self.account(&u0, &u);
        self.warm_starts.clear();
        let warm_start = |contact: &Contact| WarmStart {
            key: contact.key,
            mode: contact.mode,
        };
        self.warm_starts.extend(self.contacts.iter().map(warm_start));
        self.state.u.copy_from_slice(&u);
        std::mem::swap(&mut self.state.spin_rad_s, &mut self.spins_after);
        self.state.advance(step_s);
        self.diverged |= !self.state.is_sound();
        if !self.diverged {
            self.tree.update(&self.model, &self.state);
        }
    }

    /// Finds the contacts of all wheels.
    fn meet(&mut self) {
        self.contacts.clear();
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let centre = self.tree.centre[i];
            // How far its surface may come in two steps; no farther than the wheel is large.
            let surface_m_s = self.state.spin_rad_s[i].abs() * wheel.radius_m;
            let velocity = self.tree.velocity(wheel.body, centre);
            let speed_m_s = velocity.length().max(0.5 * surface_m_s);
            let soon_m = (2.0 * self.step_s * speed_m_s).min(wheel.radius_m);
            let (ball, radius_m) = match &wheel.shape {
                WheelShape::Ball { radius_m } => (centre, *radius_m),
                WheelShape::RollerBall { radius_m, centre_m } => {
                    let at = self.tree.rotation[wheel.body] * *centre_m;
                    (self.tree.origin[wheel.body] + at, *radius_m)
                }
                WheelShape::Rollers(rollers) => {
                    let meeting = Meeting {
                        tree: &self.tree,
                        ground: &self.ground,
                        com: self.com(),
                        ahead_m: AHEAD_OF_ROLLERS_M.max(soon_m),
                        step_s: self.step_s,
                    };
                    let (turn_rad, free) = (
                        self.state.turn_rad[i],
                        &self.bearings.in_touch_rad_s[rollers.first..],
                    );
                    rollers.meet(&meeting, wheel, i, turn_rad, free, &mut self.contacts);
                    continue;
                }
            };
            let (at, ahead_m, step_s) = (ball + self.com(), AHEAD_M.max(soon_m), self.step_s);
            let (tree, contacts) = (&self.tree, &mut self.contacts);
            self.ground.meet(at, radius_m, ahead_m, |touch| {
                contacts.push(Contact::of_ball(wheel, i, tree, touch, ball, radius_m, step_s));
            });
        }
        for (number, contact) in self.contacts.iter_mut().enumerate() {
            let (carrier, spin) = (
                &self.tree.twist[contact.body],
                self.state.spin_rad_s[contact.wheel],
            );
            contact.warm_start(&self.warm_starts, number, carrier, spin);
        }
    }

    /// Energies of a step, and how far the actuators turned.
    fn account(&mut self, u0: &[f64; N], u: &[f64; N]) {
        let (mean_u, after) = (middle(u0, u), self.tree.twists(u));
        let mut twists = self.tree.twist;
        for (twist, after) in twists.iter_mut().zip(&after).take(self.model.bodies.len()) {
            *twist = middle(twist, after);
        }
        let mut spins = [0.0; MOST_WHEELS];
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let (before, spin) = (self.state.spin_rad_s[i], self.spins_after[i]);
            spins[i] = 0.5 * (before + spin);
            let turned = self.spins[i].turning_rad_s(&twists[wheel.body], spins[i]);
            let now = self.spins[i].turning_rad_s(&after[wheel.body], spin);
            self.moved[i] = [turned * self.step_s / wheel.gear, now / wheel.gear];
            if wheel.rollers().is_some() {
                self.state.turn_rad[i] += turned * self.step_s;
            }
        }
        let mean = Mean {
            u: &mean_u,
            twists: &twists,
            spins: &spins,
        };
        let (model, contacts) = (&self.model, &self.contacts);
        self.bearings.turn(
            model,
            contacts,
            &mut self.state.roller_rad_s,
            self.step_s,
            &mut self.balance,
        );
        for contact in contacts {
            let roller = contact
                .across
                .as_ref()
                .map_or(0.0, |across| self.bearings.mean_rad_s[across.roller]);
            self.balance.contact(contact, &mean, roller);
        }
        for held in &self.held {
            self.balance.hinge(held, u, &mean);
        }
    }
}
