//! The plant: bodies, hinges, wheels and ground in rapier. The only room that names rapier.

mod contact;
mod terrain;
mod vehicle;
mod wheel;

use rapier3d_f64::prelude::*;

use crate::Error;
use crate::config::Scenario;
use crate::observation::{Observation, Pose3};
use vehicle::VehicleBodies;

/// A vehicle on the ground, without a controller.
pub(crate) struct World {
    physics: PhysicsWorld,
    vehicle: VehicleBodies,
    steps_per_period: u64,
    /// Steps of the engine in one of those: more than one where wheels have rollers.
    substeps: u64,
    time_ns: u64,
    step_ns: u64,
    /// Where the physics left the finite numbers; nothing is simulated after that.
    diverged: Option<(f64, String)>,
}

impl World {
    /// The scenario's vehicle at its start, at rest, `yaw_rad` and `x_m` off the nominal pose.
    pub(crate) fn new(scenario: &Scenario, x_m: f64, yaw_rad: f64) -> Self {
        let mut physics = PhysicsWorld::new();
        let settings = &scenario.physics;
        physics.gravity = Vector::new(0.0, 0.0, -settings.gravity_m_s2);
        let p = &mut physics.integration_parameters;
        let stiffer = stiffer_for_rollers(scenario);
        let substeps = stiffer.map_or(1, |_| settings.roller_substeps);
        p.dt = settings.step_us as f64 * 1e-6 / substeps as f64;
        p.num_solver_iterations = settings.solver_iterations;
        let hz = settings.contact_hz * stiffer.unwrap_or(1.0);
        p.contact_softness = SpringCoefficients::new(hz, settings.contact_damping);
        p.static_contact_softness = p.contact_softness;
        p.friction_model = FrictionModel::Coulomb;
        // Without these, joints and contacts lag behind the load: see docs/physics.md.
        p.warmstart_joints = true;
        p.contact_recycling = false;
        p.normalized_prediction_distance = 0.002;
        p.normalized_allowed_linear_error = 0.0005;
        p.max_ccd_substeps = 0;
        // The push-out of a roller shakes its bearing unless friction acts in the same pass.
        p.friction_in_bias_pass = stiffer.is_some();
        terrain::insert(&mut physics, &scenario.terrain);
        let start = Pose::new(Vector::new(x_m, 0.0, 0.0), AngVector::new(0.0, 0.0, yaw_rad));
        let vehicle = VehicleBodies::insert(&mut physics, scenario, start);
        Self {
            physics,
            vehicle,
            steps_per_period: scenario.control.period_us / settings.step_us,
            substeps,
            time_ns: 0,
            step_ns: settings.step_us * 1000,
            diverged: None,
        }
    }

    /// Actuator velocities as ideal encoders see them \[rad/s\], one a wheel.
    pub(crate) fn measure(&self, velocities_rad_s: &mut Vec<f64>) {
        velocities_rad_s.clear();
        velocities_rad_s.extend(
            self.vehicle
                .wheels
                .iter()
                .map(|wheel| wheel.actuator_velocity(&self.physics)),
        );
    }

    /// Holds actuator torques \[N.m\], one a wheel, for one control period; contact forces are averaged over it.
    pub(crate) fn step(&mut self, torques_n_m: &[f64], observation: &mut Observation) -> Result<(), Error> {
        self.check()?;
        observation
            .wheels
            .iter_mut()
            .for_each(|wheel| wheel.start_period());
        let steps = self.steps_per_period * self.substeps;
        let started_ns = self.time_ns;
        for k in 1..=steps {
            self.vehicle.apply(&mut self.physics, torques_n_m);
            self.physics.step();
            self.time_ns = started_ns + k * self.step_ns / self.substeps;
            if let Some(handle) = self.physics.quarantine().bodies().first() {
                let body = self.vehicle.name_of(*handle).to_owned();
                self.diverged = Some((self.time_ns as f64 * 1e-9, body));
                return self.check();
            }
            contact::accumulate(
                &self.physics,
                &self.vehicle,
                1.0 / steps as f64,
                observation,
            );
        }
        self.observe(observation);
        Ok(())
    }

    /// The error of a world that has diverged.
    fn check(&self) -> Result<(), Error> {
        match &self.diverged {
            None => Ok(()),
            Some((time_s, body)) => Err(Error::Diverged {
                time_s: *time_s,
                body: body.clone(),
            }),
        }
    }

    /// Writes the present poses and velocities; leaves the contact averages alone.
    pub(crate) fn observe(&self, observation: &mut Observation) {
        observation.time_ns = self.time_ns;
        self.vehicle.observe(&self.physics, observation);
    }

    /// Nanoseconds since the start.
    pub(crate) fn time_ns(&self) -> u64 {
        self.time_ns
    }
}

/// What the contacts' frequency is multiplied by so that a light roller's contact is as stiff as that of a whole wheel: the
/// solver makes a spring of a frequency and the mass that it pushes. None where no wheel has rollers.
fn stiffer_for_rollers(scenario: &Scenario) -> Option<f64> {
    let wheels = scenario.vehicle().wheel.iter().enumerate();
    wheels
        .filter_map(|(i, wheel)| {
            let rollers = scenario.rollers(i)?;
            Some((wheel.mass_kg / rollers.roller_mass_kg).sqrt())
        })
        .reduce(f64::max)
}

fn pose3(pose: &Pose) -> Pose3 {
    let (t, q) = (pose.translation, pose.rotation);
    Pose3 {
        position_m: t.into(),
        rotation_xyzw: [q.x, q.y, q.z, q.w],
    }
}
