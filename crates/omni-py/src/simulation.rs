//! A user's own loop: one control period at a time.

use std::time::Duration;

use omni_core::BodyTwist;
use omni_sim::Error;
use omni_sim::config::Scenario;
use omni_sim::controller::ControlSample;
use parking_lot::{Mutex, MutexGuard};
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::arrays::numbers;
use crate::error::exception;
use crate::sample::Sample;
use crate::scenario::{Scenario as PyScenario, ScenarioArg, load, warn_of_coarse_encoder};

/// Time between two looks at Ctrl-C while another thread steps the simulation.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// A scenario being simulated, one control period at a time.
///
/// Several threads may use one: their calls wait for each other, outside the interpreter's lock.
///
/// Args:
///     scenario: a built-in name, the path of a .toml file or a :class:`Scenario`; the step by default.
///     policy: coordination policy instead of the scenario's.
///     overrides: keys to replace, as in :func:`omnistep.run`.
///     seed: seed of the scenario's perturbation.
///
/// Raises:
///     ConfigError: a name, key or value is wrong.
///
/// Warns:
///     UserWarning: one encoder count reads as a velocity of which the gains make more torque than the motor has.
///
/// Example:
///     >>> import omnistep
///     >>> simulation = omnistep.Simulation("flat")
///     >>> for _ in range(1000):
///     ...     sample = simulation.step((0.2, 0.0, 0.0))
///     >>> simulation.time_s, bool(abs(sample.twist[0] - 0.2) < 0.01)
///     (1.0, True)
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Simulation {
    scenario: Scenario,
    /// Whoever holds it never asks for the interpreter's lock: nobody waits for both.
    inner: Mutex<omni_sim::Simulation>,
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scenario = ScenarioArg::default(), *, policy = None, overrides = None, seed = None))]
    fn new(
        py: Python<'_>,
        scenario: ScenarioArg,
        policy: Option<&str>,
        overrides: Option<&Bound<'_, PyMapping>>,
        seed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let scenario = load(scenario, policy, overrides, seed)?;
        warn_of_coarse_encoder(py, &scenario, 1)?;
        let inner = omni_sim::Simulation::new(&scenario).map_err(exception)?;
        let inner = Mutex::new(inner);
        Ok(Self { scenario, inner })
    }

    /// Measure, control, and hold the torques for one control period.
    ///
    /// Args:
    ///     command: body twist (vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise).
    ///
    /// Raises:
    ///     ConfigError: not three components, or one is not finite; nothing happened then.
    ///     TypeError: not a sequence of numbers; nothing happened then.
    ///     SimulationError: the physics left the finite numbers.
    fn step(&self, py: Python<'_>, command: &Bound<'_, PyAny>) -> PyResult<Sample> {
        const ALLOWED: &str = "three finite numbers, vx [m/s], vy [m/s], wz [rad/s]";
        let components = numbers("command", command, ALLOWED)?;
        let components: [f64; 3] = components.try_into().map_err(|components: Vec<f64>| {
            exception(Error::Argument {
                name: "command",
                value: format!("{} values", components.len()),
                allowed: ALLOWED,
            })
        })?;
        let command = BodyTwist::from_array(components);
        self.stepped(py, |simulation| {
            simulation.step(&command)?;
            Ok(simulation.sample().clone())
        })
    }

    /// Hold actuator torques for one control period, past the controller.
    ///
    /// The sample's ``applied_n_m`` and all that is observed are as ever; the controller's other signals are NaN
    /// (``saturated`` is False). The controller's integrals stay as they are.
    ///
    /// Args:
    ///     torques_n_m: torque of every actuator [N.m], (N,).
    ///
    /// Raises:
    ///     ConfigError: not one finite torque a wheel; nothing happened then.
    ///     TypeError: not a sequence of numbers; nothing happened then.
    ///     SimulationError: the physics left the finite numbers.
    fn step_torques(&self, py: Python<'_>, torques_n_m: &Bound<'_, PyAny>) -> PyResult<Sample> {
        let torques_n_m = numbers("torques_n_m", torques_n_m, "one finite torque a wheel")?;
        self.stepped(py, |simulation| {
            simulation.step_torques(&torques_n_m)?;
            Ok(ControlSample::past_the_controller(&torques_n_m))
        })
    }

    /// The scenario's own command at a time [s], as a body twist for the present heading.
    fn command_at(&self, py: Python<'_>, time_s: f64) -> PyResult<(f64, f64, f64)> {
        let heading_rad = self.with(py, |simulation| simulation.observation().pose.yaw_rad())?;
        let command = self.scenario.command.for_heading(time_s, heading_rad);
        Ok(command.to_array().into())
    }

    /// Simulated time since the start [s].
    #[getter]
    fn time_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |simulation| simulation.time_ns() as f64 * 1e-9)
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.scenario.control.period_us as f64 * 1e-6
    }

    /// Actuator velocities as the encoders see them now [rad/s], (N,): what a loop on `step_torques` measures.
    #[getter]
    fn measured_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, numpy::PyArray1<f64>>> {
        let measured = self.with(py, |simulation| simulation.measured_rad_s().to_vec())?;
        Ok(numpy::PyArray1::from_vec(py, measured))
    }

    /// Names of the N wheels.
    #[getter]
    fn wheel_names(&self) -> Vec<String> {
        self.scenario
            .vehicle()
            .wheel
            .iter()
            .map(|wheel| wheel.name.clone())
            .collect()
    }

    /// What is being simulated.
    #[getter]
    fn scenario(&self) -> PyScenario {
        PyScenario::of(self.scenario.clone())
    }

    /// Name of the coordination policy, with what is chosen instead of its parts.
    #[getter]
    fn policy(&self) -> String {
        self.scenario.control.law()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (name, policy) = (&self.scenario.name, self.scenario.control.law());
        let time_s = self.time_s(py)?;
        Ok(format!(
            "<omnistep.Simulation of {name}, {policy}, at {time_s:.3} s>"
        ))
    }
}

impl Simulation {
    /// Does something with the simulation as soon as no other thread has it, outside the interpreter's lock; Ctrl-C ends the waiting.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut omni_sim::Simulation) -> T + Send,
    ) -> PyResult<T> {
        let mut work = Some(work);
        loop {
            let done = py.detach(|| {
                let mut simulation = self.inner.try_lock_for(LOOK_EVERY)?;
                let done = work.take()?(&mut simulation);
                // To whoever has waited longest: a thread in a loop would take it again and again.
                MutexGuard::unlock_fair(simulation);
                Some(done)
            });
            if let Some(done) = done {
                return Ok(done);
            }
            py.check_signals()?;
        }
    }

    /// The sample of a control period.
    fn stepped(
        &self,
        py: Python<'_>,
        step: impl FnOnce(&mut omni_sim::Simulation) -> Result<ControlSample, Error> + Send,
    ) -> PyResult<Sample> {
        let work = |simulation: &mut omni_sim::Simulation| -> Result<_, Error> {
            let control = step(simulation)?;
            Ok((control, simulation.observation().clone()))
        };
        let (control, observation) = self.with(py, work)?.map_err(exception)?;
        Ok(Sample::new(self.scenario.vehicle(), control, observation))
    }
}
