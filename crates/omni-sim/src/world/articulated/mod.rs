//! The plant in reduced coordinates: a tree of bodies on hinges, a spin a wheel, and one implicit solution a step for all contacts.
//!
//! The equations are in docs/derivations.md, when to use it in docs/physics.md. parry finds contacts; nothing else of rapier is here.

mod balance;
mod bearings;
mod contact;
mod ground;
mod linear;
mod model;
mod observe;
mod rollers;
mod solver;
#[cfg(test)]
mod tests;
mod tree;

use rapier3d_f64::prelude::Vector as Vector3;
use serde::{Deserialize, Serialize};

use super::actuation::{self, Actuation};
use super::loads::{Load, loads};
use super::{AnyPlant, Plant, check_faults};
use crate::Error;
use crate::config::Scenario;
use crate::error::unknown;
use crate::observation::Observation;
use balance::{Balance, Mean, Now};
use bearings::Bearings;
use contact::{Contact, Known};
use ground::{Ground, Touch};
use linear::{add, add_outer, dot, times};
use model::{Model, WheelShape};
use rollers::Meeting;
use solver::{Effort, Spin, System, solve_step};
use tree::{FREE, State, Tree};

/// How far ahead of a surface contacts are looked for at least \[m\].
const AHEAD_M: f64 = 0.002;
/// The same for rollers, of which fewer are looked at then \[m\].
const AHEAD_OF_ROLLERS_M: f64 = 0.0002;
/// Natural frequency of a hinge at its stop \[rad/s\], critically damped: a hundred times a second.
const STOP_RAD_S: f64 = 632.0;
/// Wheels that a vehicle file may have.
const MOST_WHEELS: usize = 8;

/// The plant with room for the unknowns of its tree. Sizes in between take the next.
///
/// # Errors
/// Ground or faults that are unknown here.
pub(super) fn plant(scenario: &Scenario, x_m: f64, yaw_rad: f64) -> Result<AnyPlant, Error> {
    // A vehicle file has at most 15 hinges.
    Ok(match scenario.vehicle().hinge.len() {
        0 => Box::new(World::<6>::new(scenario, x_m, yaw_rad)?),
        1..=2 => Box::new(World::<8>::new(scenario, x_m, yaw_rad)?),
        3..=6 => Box::new(World::<12>::new(scenario, x_m, yaw_rad)?),
        _ => Box::new(World::<21>::new(scenario, x_m, yaw_rad)?),
    })
}

/// A vehicle on the ground.
struct World<const N: usize> {
    scenario: Box<Scenario>,
    model: Model,
    ground: Ground,
    state: State,
    tree: Tree<N>,
    contacts: Vec<Contact<N>>,
    known: Vec<Known>,
    actuation: Actuation,
    balance: Balance,
    loads: Vec<Load>,
    /// Rows of wheels, for their loads.
    rows: Vec<Vec<usize>>,
    steps_per_period: u64,
    period_ns: u64,
    step_s: f64,
    /// The common centre of mass at the start of the last step \[m\], which its contacts are counted from.
    before_com: Vector3,
    time_ns: u64,
    effort: Effort,
    diverged: bool,
    bearings: Bearings,
    // Room that a step needs.
    touches: Vec<Touch>,
    spins: Vec<Spin<N>>,
    torques_n_m: Vec<f64>,
    moved: Vec<[f64; 2]>,
    spins_after: Vec<f64>,
    /// What hinges push with: along a row of the velocities, an impulse and more of it per rate.
    held: Vec<([f64; N], [f64; 2])>,
}

/// What a snapshot holds.
#[derive(Serialize, Deserialize)]
struct Snapshot {
    state: State,
    known: Vec<Known>,
    actuation: actuation::State,
    balance: Balance,
    time_ns: u64,
    loads_done: Vec<bool>,
}

impl<const N: usize> World<N> {
    fn new(scenario: &Scenario, x_m: f64, yaw_rad: f64) -> Result<Self, Error> {
        let Some(ground) = Ground::new(scenario) else {
            let what = format!("{}: ", scenario.terrain.described());
            return Err(unknown(scenario, "terrain.kind", &what).into());
        };
        check_faults(scenario)?;
        let loads = loads(scenario);
        let model = Model::new(scenario, &loads);
        let place = &scenario.start;
        let (sin, cos) = libm::sincos(0.5 * (place.heading_rad + yaw_rad));
        let wheels = model.wheels.len();
        let mut state = State {
            com_m: [0.0; 3],
            base: [0.0, 0.0, sin, cos],
            angle_rad: vec![0.0; model.bodies.len()],
            u: vec![0.0; N],
            spin_rad_s: vec![0.0; wheels],
            turn_rad: vec![0.0; wheels],
            roller_rad_s: vec![0.0; model.rollers],
        };
        let mut tree = Tree::new(&model);
        tree.place(&model, &state);
        state.com_m = (Vector3::new(place.x_m + x_m, place.y_m, 0.0) - tree.origin[0]).into();
        let substeps = if model.rollers > 0 {
            scenario.physics.roller_parts()
        } else {
            1
        };
        let step_s = scenario.physics.step_us as f64 * 1e-6 / substeps as f64;
        let mut world = Self {
            actuation: Actuation::new(scenario, step_s),
            balance: Balance::default(),
            rows: scenario
                .vehicle()
                .rows()
                .into_iter()
                .map(|row| row.wheels)
                .collect(),
            steps_per_period: scenario.control.period_us / scenario.physics.step_us * substeps,
            period_ns: scenario.control.period_us * 1000,
            step_s,
            before_com: Vector3::ZERO,
            time_ns: 0,
            effort: Effort::default(),
            diverged: false,
            contacts: Vec::new(),
            known: Vec::new(),
            bearings: Bearings::default(),
            touches: Vec::new(),
            spins: Vec::new(),
            torques_n_m: vec![0.0; wheels],
            moved: vec![[0.0; 2]; wheels],
            spins_after: Vec::new(),
            held: Vec::new(),
            scenario: Box::new(scenario.clone()),
            model,
            ground,
            state,
            tree,
            loads,
        };
        world.tree.update(&world.model, &world.state);
        world.balance = Balance::start(&world.now());
        Ok(world)
    }

    fn u(&self) -> [f64; N] {
        std::array::from_fn(|i| self.state.u[i])
    }

    fn com(&self) -> Vector3 {
        Vector3::from(self.state.com_m)
    }

    /// One step of the physics with torques on the wheels \[N.m\], in `torques_n_m`, and dampers of drags on them \[N.m.s/rad\].
    fn advance_step(&mut self, dampers: impl Fn(usize) -> f64) {
        let step_s = self.step_s;
        self.before_com = self.com();
        self.spins.clear();
        let mut held = [0.0; N];
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let mut carried = [0.0; N];
            let axle = self.tree.rotation[wheel.body] * wheel.axle;
            self.tree.add_turning(&mut carried, wheel.body, axle);
            // A motor holds on to the carrier.
            add(&mut held, -self.torques_n_m[i], &carried);
            let gained = step_s * self.torques_n_m[i] / wheel.inertia_kg_m2;
            self.spins.push(Spin {
                inertia_kg_m2: wheel.inertia_kg_m2,
                free_rad_s: self.state.spin_rad_s[i] + gained,
                damper: step_s * dampers(i),
                carried,
            });
        }
        self.bearings
            .release(&self.model, &self.tree, &self.state, step_s, &mut self.spins);
        self.meet();
        let u0 = self.u();
        let mut system = System {
            matrix: self.tree.mass,
            right: times(&self.tree.mass, &u0),
        };
        add(&mut system.right, step_s, &self.tree.push);
        add(&mut system.right, step_s, &held);
        if self.model.rollers > 0 {
            let bearings = self.bearings.on_tree(&self.tree, &self.model);
            add(&mut system.right, step_s, &bearings);
        }
        system.right[2] -= step_s * self.model.gravity_m_s2 * self.model.mass_kg;
        self.hold_hinges(&mut system, &u0);
        self.spins_after.clone_from(&self.state.spin_rad_s);
        let mut u = solve_step(
            &system,
            &self.spins,
            &mut self.contacts,
            &mut self.spins_after,
            &mut self.effort,
        );
        // The solution leaves 1e-10 m/s; from the impulses themselves the momentum is right to rounding.
        let pushed: Vector3 = self.contacts.iter().map(Contact::impulse).sum();
        for k in 0..3 {
            u[k] = u0[k] + pushed[k] / self.model.mass_kg;
        }
        u[2] -= step_s * self.model.gravity_m_s2;
        self.account(&u0, &u);
        self.known.clear();
        let known = |contact: &Contact<N>| Known {
            key: contact.key,
            mode: contact.mode,
        };
        self.known.extend(self.contacts.iter().map(known));
        self.state.u.copy_from_slice(&u);
        std::mem::swap(&mut self.state.spin_rad_s, &mut self.spins_after);
        self.state.advance(step_s);
        self.diverged |= !u.iter().all(|v| v.is_finite());
        if !self.diverged {
            self.tree.update(&self.model, &self.state);
        }
    }

    /// Finds the contacts of all wheels.
    fn meet(&mut self) {
        let u = self.u();
        let speed_m_s = Vector3::new(u[0], u[1], u[2]).length();
        let ahead_m = AHEAD_M.max(2.0 * self.step_s * speed_m_s);
        self.contacts.clear();
        for (i, wheel) in self.model.wheels.iter().enumerate() {
            let (origin, rotation) = (self.tree.origin[wheel.body], self.tree.rotation[wheel.body]);
            let centre = origin + rotation * wheel.centre_m;
            let (ball, radius_m) = match &wheel.shape {
                WheelShape::Ball { radius_m } => (centre, *radius_m),
                WheelShape::RollerBall { radius_m, centre_m } => (origin + rotation * *centre_m, *radius_m),
                WheelShape::Rollers(rollers) => {
                    let meeting = Meeting {
                        tree: &self.tree,
                        ground: &self.ground,
                        com: self.com(),
                        ahead_m: AHEAD_OF_ROLLERS_M.max(self.step_s * speed_m_s),
                        step_s: self.step_s,
                    };
                    let (turn_rad, free) =
                        (self.state.turn_rad[i], &self.bearings.free_rad_s[rollers.first..]);
                    let from = self.contacts.len();
                    rollers.meet(&meeting, wheel, i, turn_rad, free, &mut self.contacts);
                    for contact in &mut self.contacts[from..] {
                        contact.guess(&self.known, &u, self.state.spin_rad_s[i]);
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
                contact.guess(&self.known, &u, self.state.spin_rad_s[i]);
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

    /// Energies and momentum now.
    fn now(&self) -> Now {
        let u = self.u();
        let spinning: f64 = self
            .model
            .wheels
            .iter()
            .zip(&self.state.spin_rad_s)
            .map(|(wheel, spin)| 0.5 * wheel.inertia_kg_m2 * spin * spin)
            .sum::<f64>()
            + Bearings::kinetic_j(&self.model, &self.state.roller_rad_s);
        let weight_n = self.model.mass_kg * self.model.gravity_m_s2;
        Now {
            kinetic_j: 0.5 * dot(&times(&self.tree.mass, &u), &u) + spinning,
            potential_j: weight_n * self.state.com_m[2],
            momentum: Vector3::new(u[0], u[1], u[2]) * self.model.mass_kg,
            weight_n,
        }
    }

    /// Puts masses on bodies when their time has come: at rest with the body, so nothing jumps.
    fn add_loads(&mut self) {
        let time_ns = self.time_ns;
        if self
            .loads
            .iter_mut()
            .fold(false, |any, load| load.falls_due(time_ns) | any)
        {
            let before = self.now();
            let origin = self.com() + self.tree.origin[0];
            let velocity = self.tree.velocity(0, self.tree.origin[0], &self.u());
            self.model = Model::new(&self.scenario, &self.loads);
            // The base stays where it is, and moves as it does.
            self.tree.place(&self.model, &self.state);
            self.state.com_m = (origin - self.tree.origin[0]).into();
            self.tree.update(&self.model, &self.state);
            let mut u = self.u();
            let off = velocity - self.tree.velocity(0, self.tree.origin[0], &u);
            for k in 0..3 {
                u[k] += off[k];
            }
            self.state.u.copy_from_slice(&u);
            let after = self.now();
            self.balance.added(&before, &after);
        }
    }

    fn check(&self) -> Result<(), Error> {
        if self.diverged {
            let base = &self.scenario.vehicle().body[0];
            return Err(Error::Diverged {
                time_s: self.time_ns as f64 * 1e-9,
                body: base.name.clone(),
            });
        }
        Ok(())
    }
}

impl<const N: usize> Plant for World<N> {
    fn measure(&self, velocities_rad_s: &mut Vec<f64>) {
        velocities_rad_s.clear();
        velocities_rad_s
            .extend((0..self.model.wheels.len()).map(|i| self.wheel_rad_s(i) / self.model.wheels[i].gear));
    }

    fn angles_rad(&self) -> &[f64] {
        &self.actuation.state().angle_rad
    }

    fn step(&mut self, torques_n_m: &[f64], observation: &mut Observation) -> Result<(), Error> {
        self.check()?;
        observation.start_period();
        let (share, started_ns) = (1.0 / self.steps_per_period as f64, self.time_ns);
        for k in 1..=self.steps_per_period {
            let time_s = self.time_ns as f64 * 1e-9;
            self.add_loads();
            self.actuation.follow(time_s, torques_n_m);
            for (i, wheel) in self.model.wheels.iter().enumerate() {
                self.torques_n_m[i] = self.actuation.torques_n_m()[i] / wheel.gear;
            }
            let dampers: [f64; MOST_WHEELS] =
                std::array::from_fn(|i| self.actuation.damper_n_m_s_rad(i, time_s));
            self.advance_step(|i| dampers[i]);
            self.time_ns = started_ns + k * self.period_ns / self.steps_per_period;
            if self.diverged {
                return self.check();
            }
            let (moved, wheels) = (&self.moved, &self.model.wheels);
            self.actuation.account(
                share,
                observation,
                |i, _| moved[i],
                |_, i| -dampers[i] * wheels[i].gear * wheels[i].gear * moved[i][1],
            );
            self.observe_contacts(share, observation);
        }
        let period_s = self.period_ns as f64 * 1e-9;
        let now = self.now();
        self.observe(observation);
        self.balance
            .close(&now, self.actuation.state(), period_s, observation);
        Ok(())
    }

    fn advance(&mut self, torques_n_m: &[f64]) {
        for _ in 0..self.steps_per_period {
            for (i, wheel) in self.model.wheels.iter().enumerate() {
                self.torques_n_m[i] = torques_n_m[i] / wheel.gear;
            }
            self.advance_step(|_| 0.0);
        }
    }

    fn start_energy_balance(&mut self, observation: &mut Observation) {
        let now = self.now();
        self.balance.close(&now, self.actuation.state(), 0.0, observation);
    }

    fn observe(&self, observation: &mut Observation) {
        self.observe_motion(observation);
    }

    fn time_ns(&self) -> u64 {
        self.time_ns
    }

    fn save(&self) -> Result<Vec<u8>, postcard::Error> {
        postcard::to_allocvec(&Snapshot {
            state: self.state.clone(),
            known: self.known.clone(),
            actuation: self.actuation.state().clone(),
            balance: self.balance.clone(),
            time_ns: self.time_ns,
            loads_done: self.loads.iter().map(|load| load.done).collect(),
        })
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), postcard::Error> {
        let snapshot: Snapshot = postcard::from_bytes(bytes)?;
        let bodies = self.model.bodies.len();
        let wheels = self.model.wheels.len();
        let state = &snapshot.state;
        let sizes = [
            state.u.len(),
            state.angle_rad.len(),
            state.spin_rad_s.len(),
            state.turn_rad.len(),
        ];
        if sizes != [N, bodies, wheels, wheels] || state.roller_rad_s.len() != self.model.rollers {
            return Err(postcard::Error::DeserializeBadEncoding);
        }
        for (load, done) in self.loads.iter_mut().zip(snapshot.loads_done) {
            load.done = done;
        }
        self.model = Model::new(&self.scenario, &self.loads);
        self.state = snapshot.state;
        self.tree.update(&self.model, &self.state);
        self.known = snapshot.known;
        self.actuation.restore(snapshot.actuation);
        self.balance = snapshot.balance;
        self.time_ns = snapshot.time_ns;
        self.diverged = false;
        Ok(())
    }
}
