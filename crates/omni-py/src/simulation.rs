//! A user's own loop: one control period at a time.

use omni_core::BodyTwist;
use omni_sim::Error;
use omni_sim::config::Scenario;
use omni_sim::controller::{ControlSample, WheelSignals};
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::arrays::numbers;
use crate::error::exception;
use crate::sample::Sample;
use crate::scenario::{Scenario as PyScenario, ScenarioArg, load};

/// A scenario being simulated, one control period at a time.
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
/// Example:
///     >>> import omnistep
///     >>> simulation = omnistep.Simulation("flat")
///     >>> for _ in range(1000):
///     ...     sample = simulation.step((0.2, 0.0, 0.0))
///     >>> simulation.time_s, bool(abs(sample.twist[0] - 0.2) < 0.01)
///     (1.0, True)
#[pyclass(module = "omnistep")]
pub(crate) struct Simulation {
    scenario: Scenario,
    inner: omni_sim::Simulation,
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scenario = ScenarioArg::default(), *, policy = None, overrides = None, seed = None))]
    fn new(
        scenario: ScenarioArg,
        policy: Option<&str>,
        overrides: Option<&Bound<'_, PyMapping>>,
        seed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let scenario = load(scenario, policy, overrides, seed)?;
        let inner = omni_sim::Simulation::new(&scenario).map_err(|error| exception(&error))?;
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
    fn step(&mut self, py: Python<'_>, command: &Bound<'_, PyAny>) -> PyResult<Sample> {
        const ALLOWED: &str = "three finite numbers, vx [m/s], vy [m/s], wz [rad/s]";
        let components = numbers("command", command, ALLOWED)?;
        let components: [f64; 3] = components.try_into().map_err(|components: Vec<f64>| {
            exception(&Error::Argument {
                name: "command",
                value: format!("{} values", components.len()),
                allowed: ALLOWED,
            })
        })?;
        let command = BodyTwist::from_array(components);
        py.detach(|| self.inner.step(&command))
            .map_err(|error| exception(&error))?;
        Ok(self.sample(self.inner.sample().clone()))
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
    fn step_torques(&mut self, py: Python<'_>, torques_n_m: &Bound<'_, PyAny>) -> PyResult<Sample> {
        let torques_n_m = numbers("torques_n_m", torques_n_m, "one finite torque a wheel")?;
        py.detach(|| self.inner.step_torques(&torques_n_m))
            .map_err(|error| exception(&error))?;
        Ok(self.sample(past_the_controller(&torques_n_m)))
    }

    /// The scenario's own command at a time [s], as a body twist for the present heading.
    fn command_at(&self, time_s: f64) -> (f64, f64, f64) {
        let heading_rad = self.inner.observation().pose.yaw_rad();
        let command = self.scenario.command.for_heading(time_s, heading_rad);
        command.to_array().into()
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

    /// Actuator velocities as the encoders see them now [rad/s], (N,): what a loop on `step_torques` measures.
    #[getter]
    fn measured_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<f64>> {
        numpy::PyArray1::from_slice(py, self.inner.measured_rad_s())
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
    fn sample(&self, control: ControlSample) -> Sample {
        let vehicle = self.scenario.vehicle();
        Sample::new(vehicle, control, self.inner.observation().clone())
    }
}

/// The controller had no part in it: of its signals only the torque applied is known, and a zero would be taken for a
/// measurement.
fn past_the_controller(torques_n_m: &[f64]) -> ControlSample {
    const UNKNOWN: f64 = f64::NAN;
    let signals = |applied_n_m: &f64| WheelSignals {
        reference_rad_s: UNKNOWN,
        measured_rad_s: UNKNOWN,
        p_n_m: UNKNOWN,
        i_n_m: UNKNOWN,
        d_n_m: UNKNOWN,
        requested_n_m: UNKNOWN,
        applied_n_m: *applied_n_m,
        limit_lower_n_m: UNKNOWN,
        limit_upper_n_m: UNKNOWN,
        saturated: false,
        residual_rad_s: UNKNOWN,
    };
    ControlSample {
        asked: BodyTwist::from_array([UNKNOWN; 3]),
        gyro_rad_s: UNKNOWN,
        command: BodyTwist::from_array([UNKNOWN; 3]),
        estimated: BodyTwist::from_array([UNKNOWN; 3]),
        common_factor: UNKNOWN,
        wheels: torques_n_m.iter().map(signals).collect(),
    }
}
