//! The plant in rapier: bodies, hinges, wheels and ground as its rigid bodies, joints and colliders.

mod contact;
mod energy_balance;
mod snapshot;
mod terrain;
#[cfg(test)]
mod tests;
mod vehicle;
mod wheel;

use rapier3d_f64::prelude::*;

use super::actuation::Actuation;
use super::faults::check_faults;
use super::interface::Plant;
use super::loads::{Load, loads};
use crate::Error;
use crate::config::{FrictionPatch, RollerWheel, Scenario};
use crate::error::unknown;
use crate::observation::Observation;
use energy_balance::EnergyBalance;
use terrain::Patches;
pub use terrain::ground_heights_m;
use vehicle::VehicleBodies;

/// A vehicle on the ground, without a controller.
pub(super) struct World {
    physics: PhysicsWorld,
    vehicle: VehicleBodies,
    actuation: Actuation,
    energy: EnergyBalance,
    patches: Vec<FrictionPatch>,
    loads: Vec<Load>,
    steps_per_period: u64,
    /// Steps of the engine in one of those: more than one where wheels have rollers.
    substeps: u64,
    time_ns: u64,
    step_ns: u64,
    /// Why nothing is simulated any more.
    failed: Option<Failure>,
}

/// Where the physics left what a vehicle can do.
#[derive(Clone)]
enum Failure {
    Diverged { time_s: f64, body: String },
    FellApart { time_s: f64, part: String, gap_m: f64 },
}

impl World {
    /// The scenario's vehicle at its start, at rest, `yaw_rad` and `x_m` off the pose that it asks for.
    ///
    /// # Errors
    /// Ground or faults that are unknown here.
    pub(super) fn new(scenario: &Scenario, x_m: f64, yaw_rad: f64) -> Result<Self, Error> {
        let mut physics = PhysicsWorld::new();
        let settings = &scenario.physics;
        physics.gravity = Vector::new(0.0, 0.0, -settings.gravity_m_s2);
        let wheels = 0..scenario.vehicle().wheel.len();
        let rollers: Vec<_> = wheels.map(|wheel| scenario.rollers(wheel)).collect();
        let stiffer = stiffer_for_rollers(scenario, &rollers);
        if stiffer.is_some() {
            physics.narrow_phase = NarrowPhase::with_query_dispatcher(wheel::FreshContacts);
        }
        let substeps = stiffer.map_or(1, |_| scenario.roller_parts());
        integrate(
            &mut physics.integration_parameters,
            settings.timestep_us as f64 * 1e-6 / substeps as f64,
            settings.iterations(substeps),
            [
                settings.contact_frequency_hz * stiffer.unwrap_or(1.0),
                settings.contact_damping_ratio * stiffer.unwrap_or(1.0),
            ],
        );
        // The push-out of a roller shakes its bearing unless friction acts in the same pass.
        physics.integration_parameters.friction_in_bias_pass = stiffer.is_some();
        if !terrain::insert(&mut physics, scenario) {
            let what = format!("{}: ", scenario.terrain.described());
            return Err(unknown(scenario, "terrain.kind", &what).into());
        }
        check_faults(scenario)?;
        let place = &scenario.start;
        let start = Pose::new(
            Vector::new(place.x_m + x_m, place.y_m, 0.0),
            AngVector::new(0.0, 0.0, place.heading_rad + yaw_rad),
        );
        let vehicle = VehicleBodies::insert(&mut physics, scenario, &rollers, start);
        // Masses are known from here on: the energy balance needs them.
        let handles: Vec<_> = physics.bodies.iter().map(|(handle, _)| handle).collect();
        for handle in handles {
            physics.bodies[handle].recompute_mass_properties_from_colliders(&physics.colliders);
        }
        Ok(Self {
            actuation: Actuation::new(scenario, physics.integration_parameters.dt),
            energy: EnergyBalance::new(&physics),
            patches: scenario.friction_patch.clone(),
            loads: loads(scenario),
            physics,
            vehicle,
            steps_per_period: scenario.control.period_us / settings.timestep_us,
            substeps,
            time_ns: 0,
            step_ns: settings.timestep_us * 1000,
            failed: None,
        })
    }

    /// Puts masses on bodies when their time has come: at rest with the body, so nothing jumps.
    fn add_loads(&mut self) {
        let Self {
            loads,
            energy,
            physics,
            vehicle,
            time_ns,
            ..
        } = self;
        for load in loads.iter_mut() {
            if !load.falls_due(*time_ns) {
                continue;
            }
            energy.around(physics, |physics| {
                let body = &mut physics.bodies[vehicle.bodies[load.body]];
                let (centre, turning) = (body.center_of_mass(), body.angvel());
                let point = MassProperties::new(load.at_m.into(), load.mass_kg, AngVector::ZERO);
                let all = body.mass_properties().local_mprops + point;
                body.set_additional_mass_properties(all, true);
                body.recompute_mass_properties_from_colliders(&physics.colliders);
                let moved = body.linvel() + turning.cross(body.center_of_mass() - centre);
                body.set_linvel(moved, true);
            });
        }
    }

    /// The error of a world that has failed.
    fn check(&self) -> Result<(), Error> {
        match self.failed.clone() {
            None => Ok(()),
            Some(Failure::Diverged { time_s, body }) => Err(Error::Diverged { time_s, body }),
            Some(Failure::FellApart { time_s, part, gap_m }) => Err(Error::FellApart { time_s, part, gap_m }),
        }
    }
}

impl Plant for World {
    fn measure(&self, velocities_rad_s: &mut Vec<f64>) {
        velocities_rad_s.clear();
        velocities_rad_s.extend(
            self.vehicle
                .wheels
                .iter()
                .map(|wheel| wheel.actuator_velocity(&self.physics)),
        );
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
        let steps = self.steps_per_period * self.substeps;
        let (share, started_ns) = (1.0 / steps as f64, self.time_ns);
        for k in 1..=steps {
            let time_s = self.time_ns as f64 * 1e-9;
            self.add_loads();
            self.actuation.follow(time_s, torques_n_m);
            self.vehicle.reset(&mut self.physics);
            for (i, wheel) in self.vehicle.wheels.iter().enumerate() {
                let drag = self.actuation.explicit_drag_n_m(i, time_s);
                let geared = self.actuation.geared(i);
                wheel.apply(&mut self.physics, geared.torque_n_m + drag);
                wheel.hold(&mut self.physics, geared.hold_n_m);
            }
            self.energy.open(&self.physics);
            if self.patches.is_empty() {
                self.physics.step();
            } else {
                let patches = Patches {
                    patches: &self.patches,
                    time_s,
                };
                self.physics.step_with_events(&patches, &());
            }
            self.time_ns = started_ns + k * self.step_ns / self.substeps;
            if let Some(handle) = self.physics.quarantine().bodies().first() {
                self.failed = Some(Failure::Diverged {
                    time_s: self.time_ns as f64 * 1e-9,
                    body: self.vehicle.name_of(*handle).to_owned(),
                });
                return self.check();
            }
            let (physics, wheels) = (&self.physics, &self.vehicle.wheels);
            self.actuation.account(
                share,
                observation,
                |i, before| {
                    let after = wheels[i].actuator_velocity(physics);
                    [
                        f64::midpoint(before, after) * physics.integration_parameters.dt,
                        after,
                    ]
                },
                |actuation, i| actuation.explicit_drag_n_m(i, time_s),
                // What it sticks with is not known, but nothing turns then.
                |geared, _, turned| -geared.hold_n_m.copysign(turned),
            );
            contact::accumulate(&self.physics, &self.vehicle, share, &mut self.energy, observation);
            self.energy.joints(&self.physics);
        }
        if let Some((part, gap_m)) = self.vehicle.torn(&self.physics) {
            self.failed = Some(Failure::FellApart {
                time_s: self.time_ns as f64 * 1e-9,
                part,
                gap_m,
            });
        }
        observation.end_period();
        self.observe(observation);
        let period_s = (self.steps_per_period * self.step_ns) as f64 * 1e-9;
        self.energy
            .close(&self.physics, &self.actuation, period_s, observation);
        self.check()
    }

    fn advance(&mut self, torques_n_m: &[f64]) {
        for _ in 0..self.steps_per_period * self.substeps {
            self.vehicle.reset(&mut self.physics);
            for (wheel, torque) in self.vehicle.wheels.iter().zip(torques_n_m) {
                wheel.apply(&mut self.physics, *torque);
            }
            self.physics.step();
        }
    }

    fn start_energy_balance(&mut self, observation: &mut Observation) {
        self.energy
            .close(&self.physics, &self.actuation, 0.0, observation);
    }

    fn observe(&self, observation: &mut Observation) {
        observation.time_ns = self.time_ns;
        self.vehicle.observe(&self.physics, observation);
    }

    fn time_ns(&self) -> u64 {
        self.time_ns
    }

    fn save(&self) -> Result<Vec<u8>, postcard::Error> {
        self.to_bytes()
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), postcard::Error> {
        self.go_on_from(bytes)
    }
}

/// Parameters of the solver; `contact` is natural frequency \[Hz\] and damping ratio.
fn integrate(p: &mut IntegrationParameters, step_s: f64, iterations: usize, contact: [f64; 2]) {
    p.dt = step_s;
    p.num_solver_iterations = iterations;
    p.contact_softness = SpringCoefficients::new(contact[0], contact[1]);
    p.static_contact_softness = p.contact_softness;
    p.friction_model = FrictionModel::Coulomb;
    // Without these, joints and contacts lag behind the load: see docs/physics.md.
    p.warmstart_joints = true;
    p.contact_recycling = false;
    p.normalized_prediction_distance = 0.002;
    p.normalized_allowed_linear_error = 0.0005;
    p.max_ccd_substeps = 0;
}

/// What the contacts' frequency and damping ratio are multiplied by so that a light roller's
/// contact is the spring and the damper that a whole wheel's is: the engine makes these of the
/// ratios and the mass that it pushes, k = m w^2 and c = 2 z m w. None if no wheel has rollers.
fn stiffer_for_rollers(scenario: &Scenario, rollers: &[Option<RollerWheel>]) -> Option<f64> {
    let wheels = scenario.vehicle().wheel.iter().zip(rollers);
    wheels
        .filter_map(|(wheel, rollers)| Some((wheel.mass_kg / rollers.as_ref()?.roller_mass_kg).sqrt()))
        .reduce(f64::max)
}
