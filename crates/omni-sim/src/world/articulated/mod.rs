//! The plant in reduced coordinates: a tree of bodies on hinges, one implicit solution a step for all contacts.
//!
//! The equations are in docs/derivations.md, when to use it in docs/physics.md. parry finds
//! contacts; nothing else of rapier is here.

mod balance;
mod bearings;
mod contact;
mod grip;
mod ground;
mod hinges;
mod linear;
mod meeting;
mod model;
mod observe;
mod rollers;
mod solver;
mod spin;
mod step;
mod sweeps;
mod system;
#[cfg(test)]
mod tests;
mod tree;

use rapier3d_f64::prelude::Vector as Vector3;
use serde::{Deserialize, Serialize};

use super::actuation::{self, Actuation};
use super::faults::check_faults;
use super::interface::{AnyPlant, Plant};
use super::loads::{Load, loads};
use crate::config::{MOST_WHEELS, Scenario};
use crate::error::unknown;
use crate::observation::Observation;
use crate::{Error, state_bytes};
use balance::{Balance, Now};
use bearings::Bearings;
use contact::{Contact, WarmStart};
use ground::Ground;
use hinges::Held;
use model::Model;
use solver::SolverStats;
use spin::Spin;
use system::{Equations, System};
use tree::{State, Tree};

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
    contacts: Vec<Contact>,
    warm_starts: Vec<WarmStart>,
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
    stats: SolverStats,
    diverged: bool,
    bearings: Bearings,
    // Room that a step needs.
    equations: Equations<N>,
    spins: Vec<Spin>,
    torques_n_m: Vec<f64>,
    moved: Vec<[f64; 2]>,
    spins_after: Vec<f64>,
    held: Vec<Held>,
}

/// The saved state.
#[derive(Serialize, Deserialize)]
struct Snapshot {
    state: State,
    warm_starts: Vec<WarmStart>,
    actuation: actuation::State,
    balance: Balance,
    stats: SolverStats,
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
            scenario.roller_parts()
        } else {
            1
        };
        let step_s = scenario.physics.timestep_us as f64 * 1e-6 / substeps as f64;
        let mut world = Self {
            actuation: Actuation::new(scenario, step_s),
            balance: Balance::default(),
            rows: scenario
                .vehicle()
                .rows()
                .into_iter()
                .map(|row| row.wheels)
                .collect(),
            steps_per_period: scenario.control.period_us / scenario.physics.timestep_us * substeps,
            period_ns: scenario.control.period_us * 1000,
            step_s,
            before_com: Vector3::ZERO,
            time_ns: 0,
            stats: SolverStats::default(),
            diverged: false,
            contacts: Vec::new(),
            warm_starts: Vec::new(),
            bearings: Bearings::default(),
            equations: Equations {
                tree: System::ZERO,
                bodies: vec![System::ZERO; model.bodies.len()],
                with_contacts: Vec::new(),
            },
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
        let mut u = [0.0; N];
        u.copy_from_slice(&self.state.u);
        u
    }

    fn com(&self) -> Vector3 {
        Vector3::from(self.state.com_m)
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
            kinetic_j: self.tree.kinetic_j() + spinning,
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
            let velocity = self.tree.velocity(0, self.tree.origin[0]);
            self.model = Model::new(&self.scenario, &self.loads);
            // The base stays where it is, and moves as it does.
            self.tree.place(&self.model, &self.state);
            self.state.com_m = (origin - self.tree.origin[0]).into();
            self.tree.update(&self.model, &self.state);
            let off = velocity - self.tree.velocity(0, self.tree.origin[0]);
            for k in 0..3 {
                self.state.u[k] += off[k];
            }
            self.tree.update(&self.model, &self.state);
            let after = self.now();
            self.balance.added(&before, &after);
        }
    }

    fn check(&self) -> Result<(), Error> {
        if self.stats.is_too_much() {
            return Err(Error::Unsettled {
                time_s: self.time_ns as f64 * 1e-9,
                timestep_s: self.scenario.physics.timestep_us as f64 / 1e6,
            });
        }
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

    fn brake(&mut self, motors: &[bool]) {
        self.actuation.brake(motors);
    }

    fn step(&mut self, torques_n_m: &[f64], observation: &mut Observation) -> Result<(), Error> {
        self.check()?;
        observation.start_period();
        let (share, started_ns) = (1.0 / self.steps_per_period as f64, self.time_ns);
        for k in 1..=self.steps_per_period {
            let time_s = self.time_ns as f64 * 1e-9;
            self.ground.time_s = time_s;
            self.add_loads();
            self.actuation.follow(time_s, torques_n_m);
            let mut drags = [[0.0; 2]; MOST_WHEELS];
            for (i, wheel) in self.model.wheels.iter().enumerate() {
                let geared = self.actuation.geared(i);
                self.torques_n_m[i] = geared.torque_n_m / wheel.gear;
                drags[i] = [self.actuation.damper_n_m_s_rad(i, time_s), geared.hold_n_m];
            }
            self.advance_step(|i| drags[i]);
            self.time_ns = started_ns + k * self.period_ns / self.steps_per_period;
            self.check()?;
            let (moved, wheels, spins) = (&self.moved, &self.model.wheels, &self.spins);
            let step_s = self.step_s;
            self.actuation.account(
                share,
                observation,
                |i, _| moved[i],
                |_, i| -drags[i][0] * wheels[i].gear * wheels[i].gear * moved[i][1],
                |_, i, _| spins[i].held / step_s,
            );
            self.observe_contacts(share, observation);
        }
        let period_s = self.period_ns as f64 * 1e-9;
        let now = self.now();
        observation.end_period();
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
            self.advance_step(|_| [0.0; 2]);
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
        state_bytes::to_bytes(&Snapshot {
            state: self.state.clone(),
            warm_starts: self.warm_starts.clone(),
            actuation: self.actuation.state().clone(),
            balance: self.balance.clone(),
            stats: self.stats,
            time_ns: self.time_ns,
            loads_done: self.loads.iter().map(|load| load.done).collect(),
        })
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), postcard::Error> {
        let (snapshot, rest): (Snapshot, _) = state_bytes::take_from_bytes(bytes)?;
        let bodies = self.model.bodies.len();
        let wheels = self.model.wheels.len();
        let state = &snapshot.state;
        let sizes = [
            state.u.len(),
            state.angle_rad.len(),
            state.spin_rad_s.len(),
            state.turn_rad.len(),
        ];
        if sizes != [N, bodies, wheels, wheels]
            || state.roller_rad_s.len() != self.model.rollers
            || !snapshot.actuation.fits(wheels)
            || snapshot.loads_done.len() != self.loads.len()
            || !rest.is_empty()
        {
            return Err(postcard::Error::DeserializeBadEncoding);
        }
        for (load, done) in self.loads.iter_mut().zip(snapshot.loads_done) {
            load.done = done;
        }
        self.model = Model::new(&self.scenario, &self.loads);
        self.state = snapshot.state;
        self.tree.update(&self.model, &self.state);
        self.warm_starts = snapshot.warm_starts;
        self.actuation.restore(snapshot.actuation);
        self.balance = snapshot.balance;
        self.stats = snapshot.stats;
        self.time_ns = snapshot.time_ns;
        self.diverged = false;
        Ok(())
    }
}
