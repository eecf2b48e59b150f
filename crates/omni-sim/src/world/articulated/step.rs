//! One step of the physics.

use rapier3d_f64::prelude::Vector as Vector3;

use super::World;
use super::balance::Mean;
use super::contact::{Contact, WarmStart};
use super::grip::Grip;
use super::linear::{add, add_outer, dot, times};
use super::meeting::Meeting;
use super::model::{MOST_WHEELS, WheelShape};
use super::solver::solve_step;
use super::spin::Spin;
use super::system::System;
use super::tree::FREE;

/// Minimum distance from a surface at which contacts are searched \[m\].
const AHEAD_M: f64 = 0.002;
/// The same for rollers, of which fewer are looked at then \[m\].
const AHEAD_OF_ROLLERS_M: f64 = 0.0002;
/// Natural frequency of a hinge at its stop \[rad/s\], critically damped: a hundred times per second.
const STOP_RAD_S: f64 = 632.0;

impl<const N: usize> World<N> {
    /// One step of the physics with torques on the wheels \[N.m\], in `torques_n_m`, and of each
    /// the damper of drags on it \[N.m.s/rad\] and the dry friction \[N.m\].
    pub(super) fn advance_step(&mut self, drags: impl Fn(usize) -> [f64; 2]) {
        let step_s = self.step_s;
        self.before_com = self.com();
        self.spins.clear();
        let mut motor_reaction = [0.0; N];
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let mut carried = [0.0; N];
            let axle = self.tree.rotation[wheel.body] * wheel.axle;
            self.tree.add_turning(&mut carried, wheel.body, axle);
            // The motor's reaction acts on the carrier.
            add(&mut motor_reaction, -self.torques_n_m[i], &carried);
            let gained = step_s * self.torques_n_m[i] / wheel.inertia_kg_m2;
            let [damper, hold] = drags(i);
            self.spins.push(Spin {
                inertia_kg_m2: wheel.inertia_kg_m2,
                free_rad_s: self.state.spin_rad_s[i] + gained,
                damper: step_s * damper,
                hold: step_s * hold,
                grip: Grip::Stick,
                held: 0.0,
                carried,
            });
        }
        let u0 = self.u();
        for (spin, rad_s) in self.spins.iter_mut().zip(&self.state.spin_rad_s) {
            if spin.hold > 0.0 {
                spin.guess(rad_s - dot(&spin.carried, &u0));
            }
        }
        self.bearings
            .release(&self.model, &self.tree, &self.state, step_s, &mut self.spins);
        self.meet();
        let mut system = System {
            matrix: self.tree.mass,
            right: times(&self.tree.mass, &u0),
        };
        add(&mut system.right, step_s, &self.tree.bias_force);
        add(&mut system.right, step_s, &motor_reaction);
        if self.model.rollers > 0 {
            let bearings = self.bearings.on_tree(&self.tree, &self.model);
            add(&mut system.right, step_s, &bearings);
        }
        system.right[2] -= step_s * self.model.gravity_m_s2 * self.model.mass_kg;
        self.hold_hinges(&mut system, &u0);
        self.spins_after.clone_from(&self.state.spin_rad_s);
        let mut u = solve_step(
            &system,
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
        let warm_start = |contact: &Contact<N>| WarmStart {
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
        let u = self.u();
        self.contacts.clear();
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let (origin, rotation) = (self.tree.origin[wheel.body], self.tree.rotation[wheel.body]);
            let centre = origin + rotation * wheel.centre_m;
            // How far its surface may come in two steps; no farther than the wheel is large.
            let surface_m_s = self.state.spin_rad_s[i].abs() * wheel.centre_m.z.abs();
            let speed_m_s = self
                .tree
                .velocity(wheel.body, centre, &u)
                .length()
                .max(0.5 * surface_m_s);
            let soon_m = (2.0 * self.step_s * speed_m_s).min(wheel.centre_m.z.abs());
            let ahead_m = AHEAD_M.max(soon_m);
            let (ball, radius_m) = match &wheel.shape {
                WheelShape::Ball { radius_m } => (centre, *radius_m),
                WheelShape::RollerBall { radius_m, centre_m } => (origin + rotation * *centre_m, *radius_m),
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
                    let from = self.contacts.len();
                    rollers.meet(&meeting, wheel, i, turn_rad, free, &mut self.contacts);
                    for contact in &mut self.contacts[from..] {
                        contact.warm_start(&self.warm_starts, &u, self.state.spin_rad_s[i]);
                    }
                    continue;
                }
            };
            self.touches.clear();
            self.ground
                .meet(ball + self.com(), radius_m, ahead_m, &mut self.touches);
            for touch in &self.touches {
                let (model, places) = (&self.model, [ball, centre]);
                let mut contact =
                    Contact::of_ball(model, &self.tree, i, touch, places, radius_m, self.step_s);
                contact.warm_start(&self.warm_starts, &u, self.state.spin_rad_s[i]);
                self.contacts.push(contact);
            }
        }
    }

    /// Adds dampers, stops and couplings of hinges to a step, as they are at its end.
    fn hold_hinges(&mut self, system: &mut System<N>, u: &[f64; N]) {
        let step_s = self.step_s;
        let held = &mut self.held;
        held.clear();
        let mut hold = |row: [f64; N], off: f64, stiffness: f64, damping: f64| {
            let (constant, per_rate) = (step_s * stiffness * off, step_s * (damping + step_s * stiffness));
            add_outer(&mut system.matrix, per_rate, &row, &row);
            for i in 0..N {
                system.right[i] -= constant * row[i];
            }
            held.push((row, [constant, per_rate]));
        };
        let unit = |body: usize| {
            let mut row = [0.0; N];
            row[FREE - 1 + body] = 1.0;
            row
        };
        for (b, body) in self.model.bodies.iter().enumerate().skip(1) {
            if body.damping_n_m_s_rad > 0.0 {
                hold(unit(b), 0.0, 0.0, body.damping_n_m_s_rad);
            }
            let angle = self.state.angle_rad[b];
            let beyond = angle - angle.clamp(-body.limit_rad, body.limit_rad);
            if beyond != 0.0 {
                let inertia = self.tree.mass[FREE - 1 + b][FREE - 1 + b];
                let (spring, damper) = (inertia * STOP_RAD_S * STOP_RAD_S, 2.0 * inertia * STOP_RAD_S);
                // A stop pushes and does not pull.
                if (spring * beyond + damper * u[FREE - 1 + b]) * beyond.signum() > 0.0 {
                    hold(unit(b), beyond, spring, damper);
                }
            }
        }
        for coupling in &self.model.couplings {
            let mut row = unit(coupling.a);
            row[FREE - 1 + coupling.b] += coupling.ratio;
            let off = self.state.angle_rad[coupling.a] + coupling.ratio * self.state.angle_rad[coupling.b];
            hold(row, off, coupling.stiffness_n_m_rad, coupling.damping_n_m_s_rad);
        }
    }

    /// Energies of a step, and how far the actuators turned.
    fn account(&mut self, u0: &[f64; N], u: &[f64; N]) {
        let middle: [f64; N] = std::array::from_fn(|i| f64::midpoint(u0[i], u[i]));
        let mut spins = [0.0; MOST_WHEELS];
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let (before, after) = (self.state.spin_rad_s[i], self.spins_after[i]);
            let carried = &self.spins[i].carried;
            spins[i] = f64::midpoint(before, after);
            let turned = spins[i] - dot(carried, &middle);
            let now = after - dot(carried, u);
            self.moved[i] = [turned * self.step_s / wheel.gear, now / wheel.gear];
            if wheel.rollers().is_some() {
                self.state.turn_rad[i] += turned * self.step_s;
            }
        }
        let mean = Mean {
            u: &middle,
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
                .map_or(0.0, |across| self.bearings.mean_rad_s[across.roller]);
            self.balance.contact(contact, &mean, roller);
        }
        for (row, held) in &self.held {
            self.balance.hinge(row, *held, u, &mean);
        }
    }
}
