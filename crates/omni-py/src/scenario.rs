//! Scenarios by name, path, text or dictionary, with overrides.

use std::ffi::CString;
use std::path::PathBuf;

use omni_sim::Error;
use omni_sim::config::{self, Source};
use pyo3::exceptions::{PyOverflowError, PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyMapping, PyTuple};
use toml::{Table, Value};

use crate::error::{exception, refused};
use crate::follower::HolonomicFollower;
use crate::trajectory::Trajectory;
use crate::values::{self, Pickled};
use crate::vehicle::{Vehicle, VehicleArg};

/// A vehicle, its ground and its commands, checked. It is immutable, and it pickles.
///
/// ``scenario["terrain.height_m"]`` and ``scenario["vehicle.wheel.0.radius_m"]`` are values of the file.
///
/// Args:
///     scenario: a built-in name (see :func:`list_scenarios`), the path of a .toml file or another :class:`Scenario`.
///     policy: coordination policy instead of the scenario's (see :func:`list_policies`).
///     vehicle: a vehicle instead of the scenario's: a name, a path or a :class:`Vehicle`.
///     overrides: keys to replace, as in :func:`omnistep.run`.
///     seed: seed of perturbation and noise, 0 to 2**63 - 1.
///
/// Raises:
///     ConfigError: a name, key or value is wrong; the message names it and what is allowed.
///     TypeError: a value is none of what a key can hold.
///
/// Example:
///     >>> import omnistep
///     >>> low = omnistep.Scenario("step", policy="scale_torques", overrides={"terrain.height_m": 0.03})
///     >>> low["terrain.height_m"], low.vehicle.name, low.policy
///     (0.03, 'chugo7', 'scale_torques')
///     >>> omnistep.Scenario.from_dict(low.to_dict()) == low
///     True
#[pyclass(frozen, eq, module = "omnistep")]
#[derive(Clone, PartialEq)]
pub(crate) struct Scenario {
    inner: config::Scenario,
}

/// A scenario, or where to find one.
#[derive(Clone)]
pub(crate) enum ScenarioArg {
    Loaded(Box<config::Scenario>),
    Name(String),
}

impl Default for ScenarioArg {
    fn default() -> Self {
        Self::Name("step".into())
    }
}

impl<'py> FromPyObject<'_, 'py> for ScenarioArg {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(scenario) = given.cast::<Scenario>() {
            return Ok(Self::Loaded(Box::new(scenario.get().inner.clone())));
        }
        let name = given.extract::<PathBuf>().map_err(|_| {
            let found = given.get_type();
            PyTypeError::new_err(format!(
                "scenario: {found}, allowed: a name, a path or an omnistep.Scenario"
            ))
        })?;
        Ok(Self::Name(name.to_string_lossy().into_owned()))
    }
}

/// The scenario given, with some keys replaced.
pub(crate) fn load(
    scenario: ScenarioArg,
    policy: Option<&str>,
    overrides: Option<&Bound<'_, PyMapping>>,
    seed: Option<&Bound<'_, PyAny>>,
) -> PyResult<config::Scenario> {
    match scenario {
        ScenarioArg::Name(name) => {
            let source = Source::scenario(&name).map_err(exception)?;
            read(&source, policy, None, overrides, seed)
        }
        ScenarioArg::Loaded(scenario) => changed(*scenario, policy, None, overrides, seed),
    }
}

/// Warns of encoders of which one count is more than the motor has, and of what traction control does without.
pub(crate) fn warn_of(py: Python<'_>, scenario: &config::Scenario, level: i32) -> PyResult<()> {
    let coarse = scenario.coarse_encoder().map_err(exception)?;
    for text in coarse.into_iter().chain(scenario.traction_notes()) {
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(text)?, level)?;
    }
    Ok(())
}

fn changed(
    scenario: config::Scenario,
    policy: Option<&str>,
    vehicle: Option<VehicleArg>,
    overrides: Option<&Bound<'_, PyMapping>>,
    seed: Option<&Bound<'_, PyAny>>,
) -> PyResult<config::Scenario> {
    if vehicle.is_none() && overrides.is_none() {
        return finished(scenario, policy, seed);
    }
    let file = format!("scenario {}", scenario.name);
    let text = scenario.to_toml().map_err(exception)?;
    read(&Source::text(file, text), policy, vehicle, overrides, seed)
}

fn read(
    source: &Source,
    policy: Option<&str>,
    vehicle: Option<VehicleArg>,
    overrides: Option<&Bound<'_, PyMapping>>,
    seed: Option<&Bound<'_, PyAny>>,
) -> PyResult<config::Scenario> {
    let overrides = values::overrides(overrides)?;
    for (argument, key, given) in [
        ("policy", "control.policy", policy.is_some()),
        ("vehicle", "vehicle", vehicle.is_some()),
        ("seed", "seed", seed.is_some()),
    ] {
        if given && overrides.iter().any(|each| each.key() == key) {
            let message = format!("{argument} is given and overrides has {key}, allowed: one of the two");
            return Err(refused(key, &message));
        }
    }
    // Keys that only some policies take, as `control.max_retries` or `drive`, are with the policy
    // that is asked for, not with the file's.
    let (mut overrides, mut policy) = (overrides, policy);
    if let Some(name) = policy
        && !overrides.is_empty()
    {
        overrides.insert(0, config::Override::new("control.policy", name));
        policy = None;
    }
    let build = || {
        let Some(vehicle) = vehicle else {
            return config::Scenario::from_source(source, &overrides);
        };
        // First the vehicle: other keys may be its own.
        let mut all = overrides.clone();
        let inline = Value::try_from(vehicle.load()?);
        all.extend(inline.ok().map(|table| config::Override::new("vehicle", table)));
        all.rotate_right(1);
        config::Scenario::from_source(source, &all)
    };
    let scenario = build().map_err(exception)?;
    finished(scenario, policy, seed)
}

fn finished(
    scenario: config::Scenario,
    policy: Option<&str>,
    seed: Option<&Bound<'_, PyAny>>,
) -> PyResult<config::Scenario> {
    let mut scenario = match policy {
        // What is chosen instead of the policy's parts stays, as with an override.
        Some(policy) if scenario.control.is_preset() => scenario.with_policy(policy).map_err(exception)?,
        Some(policy) => {
            let file = format!("scenario {}", scenario.name);
            let policy = config::Override::new("control.policy", policy);
            scenario.with(&file, &[policy]).map_err(exception)?
        }
        None => scenario,
    };
    if let Some(seed) = seed {
        scenario.seed = checked_seed(seed)?;
    }
    Ok(scenario)
}

/// A seed that TOML can hold too: what a log says of its scenario must read back.
pub(crate) fn checked_seed(seed: &Bound<'_, PyAny>) -> PyResult<u64> {
    const ALLOWED: &str = "0 to 9223372036854775807";
    match seed.extract::<i64>().map(u64::try_from) {
        Ok(Ok(found)) if !seed.is_instance_of::<PyBool>() => Ok(found),
        Err(error) if !error.is_instance_of::<PyOverflowError>(seed.py()) => {
            let found = seed.get_type();
            Err(PyTypeError::new_err(format!(
                "seed: {found}, allowed: a whole number, {ALLOWED}"
            )))
        }
        _ => Err(exception(Error::Argument {
            name: "seed",
            value: seed.to_string(),
            allowed: ALLOWED,
        })),
    }
}

impl Scenario {
    pub(crate) fn of(inner: config::Scenario) -> Self {
        Self { inner }
    }

    pub(crate) fn inner(&self) -> &config::Scenario {
        &self.inner
    }

    /// Its seed is one that TOML can hold.
    fn text(&self) -> String {
        self.inner.to_toml().unwrap_or_default()
    }

    fn table(&self) -> Table {
        self.text().parse().unwrap_or_default()
    }
}

#[pymethods]
impl Scenario {
    #[new]
    #[pyo3(signature = (
        scenario = ScenarioArg::default(), *, policy = None, vehicle = None, overrides = None, seed = None
    ))]
    fn new(
        scenario: ScenarioArg,
        policy: Option<&str>,
        vehicle: Option<VehicleArg>,
        overrides: Option<&Bound<'_, PyMapping>>,
        seed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let inner = match scenario {
            ScenarioArg::Loaded(scenario) => changed(*scenario, policy, vehicle, overrides, seed)?,
            ScenarioArg::Name(name) => {
                let source = Source::scenario(&name).map_err(exception)?;
                read(&source, policy, vehicle, overrides, seed)?
            }
        };
        Ok(Self { inner })
    }

    /// The scenario that the text of a file describes; paths in it are relative to the working directory.
    ///
    /// Raises:
    ///     ConfigError: a key or value is wrong.
    #[staticmethod]
    #[pyo3(signature = (text, *, overrides = None))]
    fn from_toml(text: String, overrides: Option<&Bound<'_, PyMapping>>) -> PyResult<Self> {
        let inner = read(&Source::text("scenario", text), None, None, overrides, None)?;
        Ok(Self { inner })
    }

    /// The scenario that a file with these keys would describe; None is a key that is not there.
    ///
    /// Raises:
    ///     ConfigError: a key or value is wrong.
    ///     TypeError: a value is none of what a key can hold.
    #[staticmethod]
    fn from_dict(keys: &Bound<'_, PyMapping>) -> PyResult<Self> {
        let table = values::table("scenario", keys)?;
        Self::from_toml(table.to_string(), None)
    }

    /// The same scenario with other keys.
    ///
    /// Raises:
    ///     ConfigError: a name, key or value is wrong.
    #[pyo3(signature = (overrides = None, *, policy = None, vehicle = None, seed = None))]
    fn replace(
        &self,
        overrides: Option<&Bound<'_, PyMapping>>,
        policy: Option<&str>,
        vehicle: Option<VehicleArg>,
        seed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let inner = changed(self.inner.clone(), policy, vehicle, overrides, seed)?;
        Ok(Self { inner })
    }

    /// The scenario as a file, with its vehicle; derived gains are left out.
    fn to_toml(&self) -> String {
        self.text()
    }

    /// Vehicle and ground as MJCF, for MuJoCo: every roller a body of its own.
    ///
    /// Raises:
    ///     ConfigError: a wheel without rollers, or patches of friction on ground that is not level.
    fn mjcf(&self) -> PyResult<String> {
        omni_log::mjcf(&self.inner).map_err(exception)
    }

    /// Every key of that file, the vehicle's under ``vehicle``.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        values::to_python(py, &Value::Table(self.table()))
    }

    /// The value at a dotted key; elements of lists count from 0.
    ///
    /// Raises:
    ///     KeyError: there is none; the message names the existing keys.
    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        values::at(py, &self.table(), key)
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Name of the coordination policy, with its replaced parts.
    #[getter]
    fn policy(&self) -> String {
        self.inner.control.law()
    }

    /// Seed of perturbation and noise.
    #[getter]
    fn seed(&self) -> u64 {
        self.inner.seed
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.inner.period_s()
    }

    /// Length of a run at most [s].
    #[getter]
    fn duration_s(&self) -> f64 {
        self.inner.duration_s
    }

    /// The path of its command, planned for its vehicle from where that starts; None of a command without a path.
    #[getter]
    fn trajectory(&self) -> PyResult<Option<Trajectory>> {
        let path = self.inner.planned_path().map_err(exception)?;
        Ok(path.as_ref().map(Trajectory::of))
    }

    /// Who follows that path, with the gains of the file; None of a command without a path.
    #[getter]
    fn follower(&self) -> PyResult<Option<HolonomicFollower>> {
        let path = self.inner.planned_path().map_err(exception)?;
        Ok(path.map(|path| HolonomicFollower::of(path.follower)))
    }

    /// The vehicle; gains that its file leaves out are derived here.
    #[getter]
    fn vehicle(&self) -> Vehicle {
        Vehicle {
            inner: self.inner.vehicle().clone(),
        }
    }

    /// How each wheel is simulated, ``"ball"`` or ``"rollers"``: what ``physics.wheel_model`` is on this ground.
    ///
    /// Example:
    ///     >>> import omnistep
    ///     >>> omnistep.Scenario("step", vehicle="mecanum4").wheel_models
    ///     ['rollers', 'rollers', 'rollers', 'rollers']
    #[getter]
    fn wheel_models(&self) -> Vec<&'static str> {
        let wheels = 0..self.inner.vehicle().wheel.len();
        let model = |wheel| {
            if self.inner.rollers(wheel).is_some() {
                "rollers"
            } else {
                "ball"
            }
        };
        wheels.map(model).collect()
    }

    fn __hash__(&self) -> u64 {
        values::hash(&self.text())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, Bound<'py, PyTuple>> {
        let read = py.get_type::<Self>().getattr("_of_state")?;
        Ok((read, PyTuple::new(py, [self.text()])?))
    }

    /// A scenario out of its pickle, which holds its vehicle.
    #[staticmethod]
    fn _of_state(text: String) -> PyResult<Self> {
        let inner = read(&Source::embedded("pickle", text), None, None, None, None)?;
        Ok(Self { inner })
    }

    fn __repr__(&self) -> String {
        let scenario = &self.inner;
        format!(
            "<omnistep.Scenario {}: {}, {}, seed {}, {} s>",
            scenario.name,
            scenario.vehicle().name,
            scenario.control.policy,
            scenario.seed,
            scenario.duration_s
        )
    }
}

/// Names of the coordination policies.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.list_policies()
///     ['independent', 'scale_torques', 'scale_references', 'shared_integral', 'traction_runup', 'traction']
#[pyfunction]
pub(crate) fn list_policies() -> Vec<&'static str> {
    omni_sim::config::POLICIES.to_vec()
}

/// Names of the built-in scenarios.
///
/// Example:
///     >>> import omnistep
///     >>> "step" in omnistep.list_scenarios()
///     True
#[pyfunction]
pub(crate) fn list_scenarios() -> Vec<&'static str> {
    config::builtin_scenarios()
}

/// Names of the built-in vehicles.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.list_vehicles()
///     ['chugo7', 'omni3', 'mecanum4', 'rocker_bogie6']
#[pyfunction]
pub(crate) fn list_vehicles() -> Vec<&'static str> {
    config::builtin_vehicles()
}
