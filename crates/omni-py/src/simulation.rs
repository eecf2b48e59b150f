//! A user's own loop: one control period at a time.

use std::path::PathBuf;
use std::sync::Arc;

use omni_core::BodyTwist;
use omni_log::RunLog;
use omni_sim::config::{Scenario, Source};
use omni_sim::{Error, Period, ReportColumns, outcome_of, trace_of};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyMapping};

use crate::arrays::numbers;
use crate::error::{damaged_pickle, exception, refused};
use crate::in_turn::InTurn;
use crate::outcome::Outcome;
use crate::policy::{OwnPolicy, PolicyArg, Raised, controller, load_with};
use crate::sample::Sample;
use crate::scenario::{Scenario as PyScenario, ScenarioArg, warn_of};
use crate::trace::Trace;
use crate::values::Pickled;

/// A scenario being simulated, one control period at a time.
///
/// Several threads may share a simulation: their calls wait for each other, without the interpreter's lock. It can be
/// pickled with a controller of your own and the recorded periods; the copy's continuation is bit-identical.
///
/// Args:
///     scenario: a built-in name, the path of a .toml file or a :class:`Scenario`; the step by default.
///     policy: coordination policy instead of the scenario's, or a controller of your own, as in :func:`omnistep.run`.
///     overrides: keys to replace, as in :func:`omnistep.run`.
///     seed: seed of the scenario's perturbation.
///     record: keep every period, some 4 kB each, for ``trace``, ``outcome`` and ``finish``.
///
/// Raises:
///     ConfigError: a name, key or value is wrong.
///     TypeError: the policy is not a policy.
///
/// Warns:
///     UserWarning: one encoder count reads as a velocity for which the gains request more torque than the motor has;
///         or ``traction`` or ``traction_runup`` lacks sensors or motor speed that it requires.
///
/// Example:
///     >>> import omnistep
///     >>> simulation = omnistep.Simulation("flat")
///     >>> for _ in range(1000):
///     ...     sample = simulation.step((0.2, 0.0, 0.0))
///     >>> simulation.time_s, bool(abs(sample.twist[0] - 0.2) < 0.01)
///     (1.0, True)
///     >>> len(simulation.trace), simulation.outcome.verdict
///     (1000, 'completed')
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Simulation {
    scenario: Scenario,
    own: Option<OwnPolicy>,
    /// What the policy raises in a step.
    raised: Raised,
    inner: InTurn<Inner>,
}

struct Inner {
    simulation: omni_sim::Simulation,
    /// Every period so far, where they are recorded.
    kept: Option<Vec<Arc<Period>>>,
}

/// What pickle keeps of a simulation: scenario, policy, snapshot, recorded periods.
type State<'py> = (
    String,
    Option<Py<PyAny>>,
    Bound<'py, PyBytes>,
    Option<Bound<'py, PyBytes>>,
);

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (
        scenario = ScenarioArg::default(), *, policy = None, overrides = None, seed = None, record = true
    ))]
    fn new(
        py: Python<'_>,
        scenario: ScenarioArg,
        policy: Option<PolicyArg>,
        overrides: Option<&Bound<'_, PyMapping>>,
        seed: Option<&Bound<'_, PyAny>>,
        record: bool,
    ) -> PyResult<Self> {
        let (scenario, own) = load_with(scenario, policy, overrides, seed)?;
        if own.is_none() {
            warn_of(py, &scenario, 1)?;
        }
        let (controller, raised) = controller(py, &scenario, own.as_ref(), true)?;
        let simulation = omni_sim::Simulation::with_controller(&scenario, controller).map_err(exception)?;
        Ok(Self::of(scenario, own, raised, simulation, record.then(Vec::new)))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, State<'py>> {
        let (bytes, kept) = self.with(py, |inner| {
            let bytes = inner.simulation.save(&self.scenario);
            (bytes, inner.kept.clone())
        })?;
        let kept = kept.map(|kept| {
            let periods: Vec<&Period> = kept.iter().map(|period| &**period).collect();
            let bytes = postcard::to_allocvec(&periods);
            bytes.map(|bytes| PyBytes::new(py, &bytes))
        });
        let kept = kept
            .transpose()
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        let text = self.scenario.to_toml().map_err(exception)?;
        let policy = self.own.as_ref().map(|own| own.object(py));
        let made_by = py.get_type::<Self>().getattr("_of_state")?;
        Ok((
            made_by,
            (text, policy, PyBytes::new(py, &bytes.map_err(exception)?), kept),
        ))
    }

    /// A simulation out of its pickle.
    #[staticmethod]
    #[pyo3(signature = (scenario, policy, state, kept))]
    fn _of_state(
        py: Python<'_>,
        scenario: String,
        policy: Option<&Bound<'_, PyAny>>,
        state: &[u8],
        kept: Option<&[u8]>,
    ) -> PyResult<Self> {
        let source = Source::embedded("pickle", scenario);
        let scenario = Scenario::from_source(&source, &[]).map_err(exception)?;
        let own = policy.map(OwnPolicy::of).transpose()?;
        let kept = kept.map(postcard::from_bytes::<Vec<Period>>).transpose();
        let kept = kept.map_err(damaged_pickle)?;
        let kept = kept.map(|kept| kept.into_iter().map(Arc::new).collect());
        Self::resumed(py, scenario, own, state, kept)
    }

    /// Measure, control, and hold the torques for one control period.
    ///
    /// Args:
    ///     command: body twist (vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise).
    ///
    /// Raises:
    ///     ConfigError: not three components, or one is not finite; the state is unchanged.
    ///     TypeError: not a sequence of numbers; the state is unchanged.
    ///     SimulationError: the physics diverged (a value is not finite), or a policy of your own returned no valid
    ///         torques. An exception of the policy itself is raised unchanged. That period had no torque and is not
    ///         recorded.
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
        let period_ns = self.scenario.control.period_us * 1000;
        self.stepped(py, |simulation| {
            // It had no part in periods without the controller.
            self.raised.set_period(simulation.time_ns() / period_ns);
            simulation.step(&command)
        })
    }

    /// Hold actuator torques for one control period, without the controller.
    ///
    /// The sample's ``applied_n_m`` and all observations are as usual; the controller's other signals are NaN
    /// (``saturated`` is False). The controller's integrals do not change.
    ///
    /// Args:
    ///     torques_n_m: torque of every actuator [N.m], (N,).
    ///
    /// Raises:
    ///     ConfigError: not one finite torque for each wheel; the state is unchanged.
    ///     TypeError: not a sequence of numbers; the state is unchanged.
    ///     SimulationError: the physics diverged (a value is not finite).
    fn step_torques(&self, py: Python<'_>, torques_n_m: &Bound<'_, PyAny>) -> PyResult<Sample> {
        let torques_n_m = numbers("torques_n_m", torques_n_m, "one finite torque for each wheel")?;
        self.stepped(py, |simulation| simulation.step_torques(&torques_n_m))
    }

    /// Every signal of every period so far, including periods without the controller.
    ///
    /// Raises:
    ///     ConfigError: nothing was recorded.
    #[getter]
    fn trace(&self, py: Python<'_>) -> PyResult<Trace> {
        let (signals, policy, kept) = self.recorded(py)?;
        let trace = py.detach(|| trace_of(&self.scenario, &signals, kept.iter().map(|period| &**period)));
        Ok(Trace::new(self.scenario.clone(), policy, trace))
    }

    /// The metrics so far.
    ///
    /// Raises:
    ///     ConfigError: nothing was recorded.
    #[getter]
    fn outcome(&self, py: Python<'_>) -> PyResult<Outcome> {
        let (_, _, kept) = self.recorded(py)?;
        let outcome = py.detach(|| outcome_of(&self.scenario, kept.iter().map(|period| &**period)));
        Ok(Outcome::new(outcome))
    }

    /// The run so far, as a trace and as a log; the simulation can continue.
    ///
    /// Args:
    ///     mcap: path of an MCAP log to write.
    ///
    /// Raises:
    ///     ConfigError: nothing was recorded.
    ///     LogError: the log could not be written.
    #[pyo3(signature = (*, mcap = None))]
    fn finish(&self, py: Python<'_>, mcap: Option<PathBuf>) -> PyResult<Trace> {
        let trace = self.trace(py)?;
        let Some(path) = mcap else { return Ok(trace) };
        let (_, _, kept) = self.recorded(py)?;
        let written = self.with(py, |inner| -> Result<(), omni_log::Error> {
            let mut log = RunLog::create(path, &self.scenario, inner.simulation.controller())?;
            for period in &kept {
                log.push(period)?;
            }
            log.finish(&outcome_of(&self.scenario, kept.iter().map(|period| &**period)))?;
            Ok(())
        })?;
        written.map_err(exception)?;
        Ok(trace)
    }

    /// All data that :meth:`resume` needs for a bit-identical continuation.
    ///
    /// It excludes recorded periods and the state of a policy of your own; a pickle includes both.
    ///
    /// Raises:
    ///     SimulationError: the controller's state cannot be read.
    ///
    /// Example:
    ///     >>> import omnistep
    ///     >>> simulation = omnistep.Simulation("flat")
    ///     >>> sample = simulation.step((0.2, 0.0, 0.0))
    ///     >>> again = omnistep.Simulation.resume("flat", simulation.save())
    ///     >>> simulation.step((0.2, 0.0, 0.0)).twist[0] == again.step((0.2, 0.0, 0.0)).twist[0]
    ///     True
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.with(py, |inner| inner.simulation.save(&self.scenario))?;
        Ok(PyBytes::new(py, &bytes.map_err(exception)?))
    }

    /// A simulation of the same scenario at the time when ``state`` was saved; its trace begins there.
    ///
    /// Args:
    ///     scenario: the same scenario: a built-in name, the path of a .toml file or a :class:`Scenario`.
    ///     state: the result of :meth:`save`.
    ///     policy: the same policy; a controller of your own continues from the object's state and is not reset.
    ///     overrides: the same overrides.
    ///     seed: the same seed.
    ///
    /// Raises:
    ///     SimulationError: the state is damaged, or of another scenario or version.
    ///
    /// Example:
    ///     >>> import omnistep
    ///     >>> state = omnistep.Simulation("flat").save()
    ///     >>> omnistep.Simulation.resume("flat", state).time_s
    ///     0.0
    #[staticmethod]
    #[pyo3(signature = (scenario, state, *, policy = None, overrides = None, seed = None))]
    fn resume(
        py: Python<'_>,
        scenario: ScenarioArg,
        state: &[u8],
        policy: Option<PolicyArg>,
        overrides: Option<&Bound<'_, PyMapping>>,
        seed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (scenario, own) = load_with(scenario, policy, overrides, seed)?;
        Self::resumed(py, scenario, own, state, Some(Vec::new()))
    }

    /// The scenario's own command at a time [s], as a body twist for the present heading.
    fn command_at(&self, py: Python<'_>, time_s: f64) -> PyResult<(f64, f64, f64)> {
        let command = self.with(py, |inner| inner.simulation.scenario_command_at(time_s))?;
        Ok(command.to_array().into())
    }

    /// Simulated time since the start [s].
    #[getter]
    fn time_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |inner| inner.simulation.time_ns() as f64 * 1e-9)
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.scenario.control.period_us as f64 * 1e-6
    }

    /// Present encoder readings of the actuator velocities [rad/s], (N,), for a loop on `step_torques`.
    #[getter]
    fn measured_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, numpy::PyArray1<f64>>> {
        let measured = self.with(py, |inner| inner.simulation.measured_rad_s().to_vec())?;
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

    /// The simulated scenario.
    #[getter]
    fn scenario(&self) -> PyScenario {
        PyScenario::of(self.scenario.clone())
    }

    /// Name of the coordination policy, or of a controller of your own.
    #[getter]
    fn policy(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |inner| inner.simulation.controller().policy().to_owned())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (name, policy) = (&self.scenario.name, self.policy(py)?);
        let time_s = self.time_s(py)?;
        Ok(format!(
            "<omnistep.Simulation of {name}, {policy}, at {time_s:.3} s>"
        ))
    }
}

impl Simulation {
    fn of(
        scenario: Scenario,
        own: Option<OwnPolicy>,
        raised: Raised,
        simulation: omni_sim::Simulation,
        kept: Option<Vec<Arc<Period>>>,
    ) -> Self {
        Self {
            scenario,
            own,
            raised,
            inner: InTurn::new(
                Inner { simulation, kept },
                "a policy used the simulation that it controls, allowed: its observation",
            ),
        }
    }

    /// One that goes on from the state of another.
    fn resumed(
        py: Python<'_>,
        scenario: Scenario,
        own: Option<OwnPolicy>,
        state: &[u8],
        kept: Option<Vec<Arc<Period>>>,
    ) -> PyResult<Self> {
        let (controller, raised) = controller(py, &scenario, own.as_ref(), false)?;
        let resumed = omni_sim::Simulation::resume_with_controller(&scenario, controller, state);
        Ok(Self::of(scenario, own, raised, resumed.map_err(exception)?, kept))
    }

    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Inner) -> T + Send) -> PyResult<T> {
        self.inner.with(py, work)
    }

    /// The sample of a control period.
    fn stepped(
        &self,
        py: Python<'_>,
        step: impl FnOnce(&mut omni_sim::Simulation) -> Result<(), Error> + Send,
    ) -> PyResult<Sample> {
        let work = |inner: &mut Inner| -> Result<Arc<Period>, Error> {
            step(&mut inner.simulation)?;
            let period = Arc::new(inner.simulation.period().clone());
            if let Some(kept) = &mut inner.kept {
                kept.push(period.clone());
            }
            Ok(period)
        };
        let period = self.with(py, work)?;
        let period = period.map_err(|error| self.raised.take().unwrap_or_else(|| exception(error)))?;
        Ok(Sample::new(self.scenario.vehicle(), period))
    }

    /// What the controller reports, its name, and every period so far.
    fn recorded(&self, py: Python<'_>) -> PyResult<(ReportColumns, String, Vec<Arc<Period>>)> {
        let recorded = self.with(py, |inner| {
            let controller = inner.simulation.controller();
            let report = controller.columns().clone();
            inner
                .kept
                .clone()
                .map(|kept| (report, controller.policy().to_owned(), kept))
        })?;
        let message =
            "record = False: no period was recorded, allowed: record=True for trace, outcome and finish";
        recorded.ok_or_else(|| refused("record", message))
    }
}
