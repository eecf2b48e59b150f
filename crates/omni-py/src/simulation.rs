//! A user's own loop: one control period at a time.

use std::path::PathBuf;

use omni_core::BodyTwist;
use omni_sim::config::Scenario;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::exception;
use crate::sample::Sample;
use crate::scenario::load;

/// A scenario being simulated.
#[pyclass(module = "omnistep")]
pub(crate) struct Simulation {
    scenario: Scenario,
    inner: omni_sim::Simulation,
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scenario = PathBuf::from("step"), *, policy = None, overrides = None, seed = None))]
    fn new(
        scenario: PathBuf,
        policy: Option<&str>,
        overrides: Option<&Bound<'_, PyDict>>,
        seed: Option<u64>,
    ) -> PyResult<Self> {
        let scenario = load(scenario, policy, overrides, seed)?;
        let inner = omni_sim::Simulation::new(&scenario).map_err(|error| exception(&error))?;
        Ok(Self { scenario, inner })
    }

    /// One control period with a command (vx [m/s], vy [m/s], wz [rad/s]).
    fn step(&mut self, py: Python<'_>, command: [f64; 3]) -> PyResult<Sample> {
        let command = BodyTwist::from_array(command);
        py.detach(|| self.inner.step(&command))
            .map_err(|error| exception(&error))?;
        Ok(self.sample(self.inner.sample().clone()))
    }

    /// One control period with actuator torques [N.m] past the controller.
    fn step_torques(&mut self, py: Python<'_>, torques_n_m: Vec<f64>) -> PyResult<Sample> {
        py.detach(|| self.inner.step_torques(&torques_n_m))
            .map_err(|error| exception(&error))?;
        // The controller had no part in it: only what was applied is known of the wheels' signals.
        let signals = |applied_n_m: &f64| omni_sim::controller::WheelSignals {
            applied_n_m: *applied_n_m,
            ..Default::default()
        };
        let wheels = torques_n_m.iter().map(signals).collect();
        Ok(self.sample(omni_sim::controller::ControlSample {
            wheels,
            ..Default::default()
        }))
    }

    /// The scenario's own command at a time [s].
    fn command_at(&self, time_s: f64) -> (f64, f64, f64) {
        self.scenario.command.at(time_s).to_array().into()
    }

    /// Simulated time since the start [s].
    #[getter]
    fn time_s(&self) -> f64 {
        self.inner.time_ns() as f64 * 1e-9
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.scenario.control.period_us as f64 * 1e-6
    }

    /// Names of the wheels.
    #[getter]
    fn wheel_names(&self) -> Vec<String> {
        self.scenario
            .vehicle()
            .wheel
            .iter()
            .map(|wheel| wheel.name.clone())
            .collect()
    }

    /// Name of the coordination policy.
    #[getter]
    fn policy(&self) -> &str {
        &self.scenario.control.policy
    }

    fn __repr__(&self) -> String {
        let (name, policy) = (&self.scenario.name, &self.scenario.control.policy);
        format!(
            "<omnistep.Simulation of {name}, {policy}, at {:.3} s>",
            self.time_s()
        )
    }
}

impl Simulation {
    fn sample(&self, control: omni_sim::controller::ControlSample) -> Sample {
        let vehicle = self.scenario.vehicle();
        Sample::new(vehicle, control, self.inner.observation().clone())
    }
}
