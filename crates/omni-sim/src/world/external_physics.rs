//! The interface for an external physics engine under our controller.

mod physics;

use omni_core::BodyTwist;
use rapier3d_f64::prelude::{Rotation, Vector};

use super::actuation::Actuation;
use super::faults::check_faults;
use super::interface::Plant;
use super::observed::{ContactSum, along_push, level_twist, load_rows, rim_speed, tilt};
use crate::Error;
use crate::config::{self, Engine, Fault, Scenario};
use crate::observation::{Energy, Observation};

pub use physics::{
    AxleDrive, BodyState, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep, Touch,
};

/// External physics as a plant. The losses of contacts and joints are not known, so that these parts of the energy
/// balance are NaN.
pub(super) struct External {
    physics: Box<dyn ExternalPhysics>,
    actuation: Actuation,
    wheels: Vec<Wheel>,
    rows: Vec<Vec<usize>>,
    base: String,
    weight_n: f64,
    start_potential_j: f64,
    momentum_n_s: Vector,
    steps_per_period: u64,
    step_ns: u64,
    time_ns: u64,
    axles: Vec<AxleDrive>,
    shown: ExternalStep,
    turned_rad: Vec<f64>,
    state: ExternalState,
    /// Why it cannot go on: from then on every step says so.
    failure: Option<ExternalFailure>,
}

/// What of a wheel never changes.
struct Wheel {
    body: usize,
    across_push: Vector,
    radius_m: f64,
    way_per_rad: f64,
    gear: f64,
}

impl External {
    /// The plant at its start, off it by the run's perturbation.
    pub(super) fn new(
        scenario: &Scenario,
        physics: Box<dyn ExternalPhysics>,
        x_m: f64,
        yaw_rad: f64,
    ) -> Result<Self, Error> {
        check_faults(scenario)?;
        let refused = |key: String, message: String| config::Error::Key {
            file: format!("scenario {}", scenario.name),
            key,
            message,
        };
        let engine = physics.engine().name();
        if let Some(k) = (scenario.fault.iter()).position(|fault| matches!(fault, Fault::LoadAdded(_))) {
            let message =
                format!("\"load_added\", allowed with physics.engine {engine:?}: every other fault");
            return Err(refused(format!("fault[{k}].kind"), message).into());
        }
        let mut changing = scenario.friction_patch.iter().enumerate();
        if let Some((k, key)) = changing.find_map(|(k, patch)| Some((k, patch.changes_by()?))) {
            let message =
                format!("set, allowed with physics.engine {engine:?}: only patches that never change");
            return Err(refused(format!("friction_patch[{k}].{key}"), message).into());
        }
        let vehicle = scenario.vehicle();
        let wheels = vehicle.wheel.iter().map(|wheel| {
            let ([x, y], (sin, cos)) = (wheel.rolling_direction, libm::sincos(wheel.roller_angle_rad));
            let push = Vector::new(cos * x - sin * y, sin * x + cos * y, 0.0).normalize();
            Wheel {
                // A loaded vehicle names bodies that exist.
                body: (vehicle.body.iter())
                    .position(|body| body.name == wheel.body)
                    .unwrap_or(0),
                across_push: Vector::Z.cross(push),
                radius_m: wheel.radius_m,
                way_per_rad: wheel.radius_m * cos,
                gear: wheel.gear,
            }
        });
        let count = vehicle.wheel.len();
        let mut external = Self {
            actuation: Actuation::new(scenario, scenario.physics.timestep_us as f64 * 1e-6),
            wheels: wheels.collect(),
            rows: vehicle.rows().into_iter().map(|row| row.wheels).collect(),
            base: vehicle.body[0].name.clone(),
            weight_n: vehicle.mass_kg() * scenario.physics.gravity_m_s2,
            start_potential_j: 0.0,
            momentum_n_s: Vector::ZERO,
            steps_per_period: scenario.control.period_us / scenario.physics.timestep_us,
            step_ns: scenario.physics.timestep_us * 1000,
            time_ns: 0,
            axles: vec![AxleDrive::default(); count],
            shown: ExternalStep {
                turned_rad: vec![0.0; count],
                rate_rad_s: vec![0.0; count],
                touches: Vec::new(),
            },
            turned_rad: vec![0.0; count],
            state: ExternalState {
                bodies: vec![BodyState::default(); vehicle.body.len()],
                hinges: vec![[0.0; 2]; vehicle.hinge.len()],
                wheels: vec![[[0.0; 3]; 2]; count],
                ..ExternalState::default()
            },
            physics,
            failure: None,
        };
        let started = external.physics.start(x_m, yaw_rad);
        let started = started.and_then(|()| external.look());
        started.map_err(|failure| external.failed(failure))?;
        external.start_potential_j = external.state.potential_j;
        Ok(external)
    }

    fn failed(&self, failure: ExternalFailure) -> Error {
        let time_s = self.time_ns as f64 * 1e-9;
        match failure {
            ExternalFailure::Diverged => Error::Diverged {
                time_s,
                body: self.base.clone(),
            },
            ExternalFailure::Failed(reason) => Error::External {
                engine: self.physics.engine().name(),
                time_s,
                reason,
            },
        }
    }

    /// Takes the present state.
    fn look(&mut self) -> Result<(), ExternalFailure> {
        let counts = |state: &ExternalState| [state.bodies.len(), state.hinges.len(), state.wheels.len()];
        let before = counts(&self.state);
        let observed = self.physics.observe(&mut self.state);
        observed.and_then(|()| {
            if counts(&self.state) != before {
                let found = counts(&self.state);
                return Err(ExternalFailure::Failed(format!(
                    "{found:?} bodies, hinges and wheels, allowed: {before:?}"
                )));
            }
            let at = |body: &BodyState| [body.pose.position_m, body.velocity_m_s, body.rate_rad_s];
            let bodies = self.state.bodies.iter();
            let numbers =
                bodies.flat_map(|body| at(body).into_iter().flatten().chain(body.pose.rotation_xyzw));
            if numbers.into_iter().all(f64::is_finite) {
                Ok(())
            } else {
                Err(ExternalFailure::Diverged)
            }
        })
    }

    /// The physics steps of a control period.
    fn step_period(
        &mut self,
        torques_n_m: &[f64],
        observation: &mut Observation,
    ) -> Result<(), ExternalFailure> {
        let share = 1.0 / self.steps_per_period as f64;
        for _ in 0..self.steps_per_period {
            self.step_once(torques_n_m, share, observation)?;
        }
        self.look()
    }

    /// One physics step with the torques that the actuators make of those that are asked for.
    fn step_once(
        &mut self,
        torques_n_m: &[f64],
        share: f64,
        observation: &mut Observation,
    ) -> Result<(), ExternalFailure> {
        let time_s = self.time_ns as f64 * 1e-9;
        self.actuation.follow(time_s, torques_n_m);
        for (i, (axle, wheel)) in self.axles.iter_mut().zip(&self.wheels).enumerate() {
            let geared = self.actuation.geared(i);
            *axle = AxleDrive {
                torque_n_m: geared.torque_n_m / wheel.gear,
                damper_n_m_s_rad: self.actuation.damper_n_m_s_rad(i, time_s),
                hold_n_m: geared.hold_n_m,
            };
        }
        self.shown.touches.clear();
        self.physics.step(&self.axles, &mut self.shown)?;
        let shown = [&self.shown.turned_rad, &self.shown.rate_rad_s];
        all_sound(shown, self.wheels.len())?;
        let Self {
            shown,
            turned_rad,
            wheels,
            axles,
            ..
        } = self;
        self.actuation.account(
            share,
            observation,
            |i, _| [shown.turned_rad[i] - turned_rad[i], shown.rate_rad_s[i]].map(|of| of / wheels[i].gear),
            |_, i| -axles[i].damper_n_m_s_rad * wheels[i].gear * shown.rate_rad_s[i],
            |geared, _, turned| -geared.hold_n_m.copysign(turned),
        );
        turned_rad.copy_from_slice(&shown.turned_rad);
        for (i, (wheel, seen)) in wheels.iter().zip(&mut observation.wheels).enumerate() {
            let mut sum = ContactSum::default();
            for touch in shown.touches.iter().filter(|touch| touch.wheel == i) {
                let (force, normal) = (Vector::from(touch.force_n), Vector::from(touch.normal));
                let size = force.dot(normal).max(0.0);
                sum.add(force, normal * size, touch.at_m.into(), size);
            }
            // Where the carrier was at the start of the period.
            let across = rotation(&self.state.bodies[wheel.body]) * wheel.across_push;
            sum.add_to(across, share, seen);
        }
        self.time_ns += self.step_ns;
        Ok(())
    }

    fn close(&mut self, period_s: f64, observation: &mut Observation) {
        let moved = self.actuation.state();
        observation.energy = Energy {
            work_in_j: moved.work_j,
            turnover_j: moved.turnover_j,
            kinetic_j: self.state.kinetic_j,
            potential_j: self.state.potential_j - self.start_potential_j,
            friction_loss_j: f64::NAN,
            impact_loss_j: f64::NAN,
            joint_loss_j: f64::NAN,
            drag_loss_j: moved.drag_loss_j,
        };
        let momentum = Vector::from(self.state.momentum_n_s);
        if period_s > 0.0 {
            let ground: Vector = observation
                .wheels
                .iter()
                .map(|wheel| Vector::from(wheel.force_n))
                .sum();
            let change = (momentum - self.momentum_n_s) / period_s;
            observation.newton_residual_n = (change - ground + Vector::Z * self.weight_n).length();
        }
        self.momentum_n_s = momentum;
    }
}

/// Are there as many finite numbers in each list?
fn all_sound(lists: [&Vec<f64>; 2], count: usize) -> Result<(), ExternalFailure> {
    if let Some(list) = lists.iter().find(|list| list.len() != count) {
        let found = list.len();
        return Err(ExternalFailure::Failed(format!(
            "{found} angles or rates of wheels, allowed: {count}"
        )));
    }
    if lists
        .iter()
        .all(|list| list.iter().all(|value| value.is_finite()))
    {
        Ok(())
    } else {
        Err(ExternalFailure::Diverged)
    }
}

fn rotation(body: &BodyState) -> Rotation {
    let [x, y, z, w] = body.pose.rotation_xyzw;
    Rotation::from_xyzw(x, y, z, w)
}

impl Plant for External {
    fn engine(&self) -> Option<Engine> {
        Some(self.physics.engine())
    }

    fn measure(&self, velocities_rad_s: &mut Vec<f64>) {
        velocities_rad_s.clear();
        let rates = self.shown.rate_rad_s.iter().zip(&self.wheels);
        velocities_rad_s.extend(rates.map(|(rate, wheel)| rate / wheel.gear));
    }

    fn angles_rad(&self) -> &[f64] {
        &self.actuation.state().angle_rad
    }

    fn brake(&mut self, motors: &[bool]) {
        self.actuation.brake(motors);
    }

    fn step(&mut self, torques_n_m: &[f64], observation: &mut Observation) -> Result<(), Error> {
        if self.failure.is_none() {
            observation.start_period();
            self.failure = self.step_period(torques_n_m, observation).err();
        }
        if let Some(failure) = self.failure.clone() {
            return Err(self.failed(failure));
        }
        observation.end_period();
        self.observe(observation);
        self.close((self.steps_per_period * self.step_ns) as f64 * 1e-9, observation);
        Ok(())
    }

    fn advance(&mut self, torques_n_m: &[f64]) {
        // What a benchmark measures: the end state does not matter.
        let mut observation = Observation {
            wheels: vec![crate::observation::WheelObservation::default(); self.wheels.len()],
            ..Observation::default()
        };
        let _ = self.step(torques_n_m, &mut observation);
    }

    fn start_energy_balance(&mut self, observation: &mut Observation) {
        self.close(0.0, observation);
    }

    fn observe(&self, observation: &mut Observation) {
        observation.time_ns = self.time_ns;
        let base = &self.state.bodies[0];
        observation.pose = base.pose;
        (observation.velocity_m_s, observation.rate_rad_s) = (base.velocity_m_s, base.rate_rad_s);
        let twist: BodyTwist<f64> = level_twist(
            rotation(base) * Vector::X,
            base.velocity_m_s.into(),
            base.rate_rad_s[2],
        );
        observation.twist = twist;
        let angles = (observation.body_nose_up_rad.iter_mut()).zip(&mut observation.body_lean_rad);
        for (body, (pitch, lean)) in self.state.bodies.iter().zip(angles) {
            let rotation = rotation(body);
            (*pitch, *lean) = tilt(rotation * Vector::X, rotation * Vector::Z);
        }
        for ([angle, rate], seen) in self.state.hinges.iter().zip(&mut observation.hinges) {
            (seen.angle_rad, seen.rate_rad_s) = (*angle, *rate);
        }
        let rates = self.shown.rate_rad_s.iter();
        let wheels = self.wheels.iter().zip(&self.state.wheels).zip(rates);
        for (((wheel, [centre, velocity]), rate), seen) in wheels.zip(&mut observation.wheels) {
            let body = &self.state.bodies[wheel.body];
            let across = rotation(body) * wheel.across_push;
            seen.centre_m = *centre;
            seen.rim_m_s = rim_speed(
                rate * wheel.way_per_rad,
                wheel.radius_m,
                across,
                body.rate_rad_s.into(),
            );
            seen.along_m_s = along_push((*velocity).into(), across, seen);
        }
        load_rows(&self.rows, observation);
    }

    fn time_ns(&self) -> u64 {
        self.time_ns
    }

    fn save(&self) -> Result<Vec<u8>, postcard::Error> {
        Err(postcard::Error::NotYetImplemented)
    }

    fn restore(&mut self, _: &[u8]) -> Result<(), postcard::Error> {
        Err(postcard::Error::NotYetImplemented)
    }
}
