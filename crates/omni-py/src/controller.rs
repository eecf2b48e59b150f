//! The controller that firmware runs, on recorded or invented measurements.

use numpy::PyArrayDyn;
use omni_core::BodyTwist;
use omni_sim::WheelSignals;
use omni_sim::config;
use omni_sim::controller::{AnyController, ControlSample as Step};
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::arrays::{Rows, STEPS_PER_LOOK, array, together};
use crate::error::{Stop, exception};
use crate::in_turn::InTurn;
use crate::scenario::{Scenario, ScenarioArg, load, warn_of};

/// The controller of a scenario, as firmware runs it.
///
/// It limits the command, maps it to the wheels, runs one PID loop per wheel within the motors' limits, and coordinates
/// the loops. It is stateful; a call with T rows is the same as T calls with one row. Several threads may share a
/// controller: their calls wait for each other.
///
/// Args:
///     scenario: a built-in name, the path of a .toml file or a :class:`Scenario`; only its vehicle and ``[control]``
///         are used. "flat" if left out.
///     policy: coordination policy instead of the scenario's.
///     overrides: keys to replace, as in :func:`omnistep.run`; ``{"control.precision": "f32"}`` is bit-identical to
///         firmware.
///
/// Raises:
///     ConfigError: a name, key or value is wrong, or the policy is ``traction`` or ``traction_runup``, which also read
///         hinges and an inertial unit: step them in a :class:`Simulation`.
///
/// Warns:
///     UserWarning: one encoder count reads as a velocity for which the gains request more torque than the motor
///         provides.
///
/// Example:
///     >>> import omnistep
///     >>> controller = omnistep.Controller("step", policy="scale_references")
///     >>> trace = omnistep.run("step", policy="scale_references", overrides={"duration_s": 0.2})
///     >>> commands = list(zip(*(trace[f"command_{axis}"] for axis in ("vx_m_s", "vy_m_s", "wz_rad_s"))))
///     >>> again = controller.step(commands, trace.wheels("measured_rad_s"))
///     >>> bool((again.applied_n_m == trace.wheels("applied_n_m")).all())
///     True
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Controller {
    scenario: config::Scenario,
    inner: InTurn<AnyController>,
}

fn started(scenario: &config::Scenario) -> PyResult<AnyController> {
    AnyController::new(scenario).map_err(exception)
}

#[pymethods]
impl Controller {
    #[new]
    #[pyo3(signature = (scenario = ScenarioArg::Name("flat".into()), *, policy = None, overrides = None))]
    fn new(
        py: Python<'_>,
        scenario: ScenarioArg,
        policy: Option<&str>,
        overrides: Option<&Bound<'_, PyMapping>>,
    ) -> PyResult<Self> {
        // Traction control reads hinges and an IMU, which a step here has not.
        let scenario = load(scenario, policy, overrides, None)?
            .with_loops("in a Controller, which does not read hinges (a Simulation does)")
            .map_err(exception)?;
        let own = "a signal handler used the controller that it interrupted, allowed: another one";
        let inner = InTurn::new(started(&scenario)?, own);
        warn_of(py, &scenario, 1)?;
        Ok(Self { scenario, inner })
    }

    /// One control step, or T of them, one after the other; Ctrl-C stops it.
    ///
    /// Args:
    ///     commands: body twists (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3); (3,) applies to every row of
    ///         ``measured_rad_s``.
    ///     measured_rad_s: actuator velocities [rad/s], (N,) or (T, N), likewise. NaN marks a wheel without an encoder
    ///         reading.
    ///
    /// Returns:
    ///     Every signal, one row each.
    ///
    /// Raises:
    ///     ConfigError: a shape is wrong, the lengths differ, or a command is not finite.
    ///     TypeError: not numbers.
    fn step(
        &self,
        py: Python<'_>,
        commands: &Bound<'_, PyAny>,
        measured_rad_s: &Bound<'_, PyAny>,
    ) -> PyResult<ControlSample> {
        let wheels = self.scenario.vehicle().wheel.len();
        let commands = Rows::read("commands", commands, 3)?;
        let measured = Rows::with_gaps("measured_rad_s", measured_rad_s, wheels)?;
        let (a, b) = (commands.count(), measured.count());
        let count = together("row", ("commands", a), ("measured_rad_s", b))?;
        let mut steps = Steps::default();
        let stepped = self.inner.with(py, |controller| -> Result<(), Stop> {
            let mut step = Step::default();
            for i in 0..count.unwrap_or(1) {
                if i % STEPS_PER_LOOK == STEPS_PER_LOOK - 1 {
                    Python::attach(|py| py.check_signals()).map_err(Stop::Interrupted)?;
                }
                // What is one row stays the same.
                let pick = |rows: &Rows| if rows.count() > Some(1) { i } else { 0 };
                let (c, m) = (3 * pick(&commands), wheels * pick(&measured));
                let c = &commands.values[c..c + 3];
                let command = BodyTwist::from_array([c[0], c[1], c[2]]);
                controller.step(&command, &measured.values[m..m + wheels], &mut step)?;
                steps.push(&step);
            }
            Ok(())
        })?;
        stepped?;
        steps.finish(py, count, wheels)
    }

    /// Return to the initial state.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        let fresh = started(&self.scenario)?;
        self.inner.with(py, |controller| *controller = fresh)
    }

    /// The scenario of the controller.
    #[getter]
    fn scenario(&self) -> Scenario {
        Scenario::of(self.scenario.clone())
    }

    /// Name of the coordination policy, with its replaced parts.
    #[getter]
    fn policy(&self) -> String {
        self.scenario.control.law()
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.scenario.period_s()
    }

    fn __repr__(&self) -> String {
        let (vehicle, policy) = (&self.scenario.vehicle().name, self.scenario.control.law());
        format!("<omnistep.Controller of {vehicle}, {policy}>")
    }
}

/// What steps did: a row each, but for the wheels, which are N rows.
#[derive(Default)]
struct Steps {
    command: Vec<f64>,
    estimated: Vec<f64>,
    common_factor: Vec<f64>,
    wheels: Vec<WheelSignals>,
}

impl Steps {
    fn push(&mut self, step: &Step) {
        self.command.extend(step.command.to_array());
        self.estimated.extend(step.estimated.to_array());
        self.common_factor.push(step.common_factor);
        self.wheels.extend_from_slice(&step.wheels);
    }

    fn finish(self, py: Python<'_>, count: Option<usize>, wheels: usize) -> PyResult<ControlSample> {
        let shape = |columns: Option<usize>| count.into_iter().chain(columns).collect::<Vec<_>>();
        let floats = |columns, values| Ok::<_, PyErr>(array(py, shape(columns), values)?.unbind());
        let of_wheels =
            |signal: fn(&WheelSignals) -> f64| floats(Some(wheels), self.wheels.iter().map(signal).collect());
        let saturated = self.wheels.iter().map(|wheel| wheel.saturated() == 1.0).collect();
        Ok(ControlSample {
            command: floats(Some(3), self.command)?,
            estimated: floats(Some(3), self.estimated)?,
            common_factor: floats(None, self.common_factor)?,
            reference_rad_s: of_wheels(|wheel| wheel.reference_rad_s)?,
            p_n_m: of_wheels(|wheel| wheel.p_n_m)?,
            i_n_m: of_wheels(|wheel| wheel.i_n_m)?,
            d_n_m: of_wheels(|wheel| wheel.d_n_m)?,
            requested_n_m: of_wheels(|wheel| wheel.requested_n_m)?,
            applied_n_m: of_wheels(|wheel| wheel.applied_n_m)?,
            limit_lower_n_m: of_wheels(|wheel| wheel.limit_lower_n_m)?,
            limit_upper_n_m: of_wheels(|wheel| wheel.limit_upper_n_m)?,
            residual_rad_s: of_wheels(|wheel| wheel.residual_rad_s)?,
            saturated: array(py, shape(Some(wheels)), saturated)?.unbind(),
        })
    }
}

/// Signals of one step of a :class:`Controller`, or of T steps; every shape below then begins with T.
#[pyclass(frozen, get_all, module = "omnistep")]
pub(crate) struct ControlSample {
    /// The command within the vehicle's limits, (3,).
    command: Py<PyArrayDyn<f64>>,
    /// The twist from the measured velocities, (3,).
    estimated: Py<PyArrayDyn<f64>>,
    /// Factor of the policy on all torques or all references, 0 to 1, ().
    common_factor: Py<PyArrayDyn<f64>>,
    /// References as commanded [rad/s], (N,).
    reference_rad_s: Py<PyArrayDyn<f64>>,
    /// Proportional terms [N.m], (N,).
    p_n_m: Py<PyArrayDyn<f64>>,
    /// Integral terms [N.m], (N,).
    i_n_m: Py<PyArrayDyn<f64>>,
    /// Derivative terms [N.m], (N,).
    d_n_m: Py<PyArrayDyn<f64>>,
    /// Torques requested with the whole reference [N.m], (N,).
    requested_n_m: Py<PyArrayDyn<f64>>,
    /// Torques to apply [N.m], (N,), within the limits.
    applied_n_m: Py<PyArrayDyn<f64>>,
    /// Lowest torques allowed [N.m], <= 0, (N,).
    limit_lower_n_m: Py<PyArrayDyn<f64>>,
    /// Highest torques allowed [N.m], >= 0, (N,).
    limit_upper_n_m: Py<PyArrayDyn<f64>>,
    /// Parts of the measured velocities that no motion of the vehicle explains [rad/s], (N,).
    residual_rad_s: Py<PyArrayDyn<f64>>,
    /// The request was outside the limits, (N,).
    saturated: Py<PyArrayDyn<bool>>,
}

#[pymethods]
impl ControlSample {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (applied, factor) = (
            self.applied_n_m.bind(py).repr()?,
            self.common_factor.bind(py).repr()?,
        );
        Ok(format!(
            "<omnistep.ControlSample: applied_n_m {applied}, common_factor {factor}>"
        ))
    }
}
