//! Controllers of one's own, written in Python.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use numpy::{PyArray1, PyArrayDescrMethods, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use omni_core::{Policy, Readings};
use omni_sim::Error;
use omni_sim::config::{self, shortened};
use omni_sim::controller::{AnyController, check_name};
use parking_lot::Mutex;
use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyMapping, PySequence, PyString, PyType};

use crate::error::{exception, refused};
use crate::nested::nested;
use crate::policy_observation::Observation;
use crate::scenario::{Scenario, ScenarioArg, load};

const ALLOWED: &str = "a name, an object with reset(info) and step(observation), or a function";

/// A coordination policy by name, or a controller of one's own.
pub(crate) enum PolicyArg {
    Preset(String),
    Own(OwnPolicy),
}

impl<'py> FromPyObject<'_, 'py> for PolicyArg {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(name) = given.cast::<PyString>() {
            return Ok(Self::Preset(name.to_str()?.into()));
        }
        OwnPolicy::of(&given).map(Self::Own)
    }
}

/// The scenario given with some keys replaced, and the controller of one's own where one is given.
pub(crate) fn load_with(
    scenario: ScenarioArg,
    policy: Option<PolicyArg>,
    overrides: Option<&Bound<'_, PyMapping>>,
    seed: Option<&Bound<'_, PyAny>>,
) -> PyResult<(config::Scenario, Option<OwnPolicy>)> {
    match policy {
        Some(PolicyArg::Own(own)) => {
            let keys = overrides.map(|given| given.keys()).transpose()?;
            for key in keys.iter().flatten() {
                // What is no text, or no key at all, is said where the overrides are read.
                let key = key.to_string();
                if config::Control::is_of_policy(&key) {
                    let message = format!("policy is given and overrides has {key}, allowed: one of the two");
                    return Err(refused(&key, &message));
                }
            }
            Ok((load(scenario, None, overrides, seed)?, Some(own)))
        }
        Some(PolicyArg::Preset(name)) => Ok((load(scenario, Some(&name), overrides, seed)?, None)),
        None => Ok((load(scenario, None, overrides, seed)?, None)),
    }
}

/// Name of a policy in tables and traces.
#[pyfunction]
pub(crate) fn policy_name(policy: PolicyArg) -> String {
    match policy {
        PolicyArg::Preset(name) => name,
        PolicyArg::Own(own) => own.name,
    }
}

/// The controller of a run: one's own where one is given, else the scenario's. `fresh` starts one's
/// own; else it goes on as it is.
pub(crate) fn controller(
    py: Python<'_>,
    scenario: &config::Scenario,
    own: Option<&OwnPolicy>,
    fresh: bool,
) -> PyResult<(AnyController, Raised)> {
    match own {
        Some(own) if fresh => own.start(py, scenario),
        Some(own) => own.go_on(py, scenario),
        None => {
            let controller = AnyController::new(scenario).map_err(exception)?;
            Ok((controller, Raised::default()))
        }
    }
}

/// A controller of one's own, not started.
pub(crate) struct OwnPolicy {
    object: Py<PyAny>,
    name: String,
    /// It has `reset` and `step`; else it is a function.
    is_object: bool,
}

impl OwnPolicy {
    pub(crate) fn of(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let refuse = |found: String| {
            let message = format!("policy: {found}, allowed: {ALLOWED}");
            Err(PyTypeError::new_err(shortened(&message).into_owned()))
        };
        let class = given.get_type();
        if let Ok(class) = given.cast::<PyType>() {
            return refuse(format!("the class {} instead of an object of it", class.name()?));
        }
        let callable = |name: &str| given.getattr(name).is_ok_and(|method| method.is_callable());
        let is_object = given.hasattr("step")?;
        if is_object && !(callable("step") && callable("reset")) {
            return refuse(format!("{} with step but without reset(info)", class.name()?));
        }
        if !is_object && !given.is_callable() {
            return refuse(class.to_string());
        }
        let name = match given.getattr_opt("name")? {
            Some(name) => match name.extract::<String>() {
                Ok(name) => name,
                Err(_) => return refuse(format!("{} whose name is not a string", class.name()?)),
            },
            // Of a function its own.
            None => match given.getattr_opt("__name__")? {
                Some(name) => name.extract()?,
                None => class.name()?.extract()?,
            },
        };
        check_name(&name).map_err(exception)?;
        Ok(Self {
            object: given.clone().unbind(),
            name,
            is_object,
        })
    }

    /// The object or function.
    pub(crate) fn object(&self, py: Python<'_>) -> Py<PyAny> {
        self.object.clone_ref(py)
    }

    /// Calls its `reset`; a function has none.
    fn reset(&self, py: Python<'_>, scenario: &config::Scenario) -> PyResult<()> {
        if self.is_object {
            let info = info(py, scenario)?;
            let reset = nested(|| self.object.bind(py).call_method1(intern!(py, "reset"), (info,)));
            reset.inspect_err(|error| noted(py, error, &format!("in reset of policy {}", self.name)))?;
        }
        Ok(())
    }

    /// The controller, freshly started for a scenario.
    fn start(&self, py: Python<'_>, scenario: &config::Scenario) -> PyResult<(AnyController, Raised)> {
        self.reset(py, scenario)?;
        self.go_on(py, scenario)
    }

    /// The controller as it is, for a scenario that it was started with before.
    fn go_on(&self, py: Python<'_>, scenario: &config::Scenario) -> PyResult<(AnyController, Raised)> {
        let running = Running::new(py, self, scenario)?;
        let raised = running.raised.clone();
        let controller = AnyController::own(scenario, Box::new(running)).map_err(exception)?;
        Ok((controller, raised))
    }
}

/// What a policy gets once.
fn info<'py>(py: Python<'py>, scenario: &config::Scenario) -> PyResult<Bound<'py, PyAny>> {
    let class = py.import("omnistep.own_policy")?.getattr("PolicyInfo")?;
    class.call_method1("of", (Scenario::of(scenario.clone()),))
}

fn noted(py: Python<'_>, error: &PyErr, note: &str) {
    // Whatever cannot be noted is raised as it is.
    let _ = error.value(py).call_method1("add_note", (note,));
}

/// An exception in one line.
fn said(py: Python<'_>, error: &PyErr) -> String {
    let class = error.get_type(py);
    let class = class
        .name()
        .map_or_else(|_| "an exception".into(), |name| name.to_string());
    format!("{class}: {}", error.value(py))
}

/// What the runner of the controller shares with it.
#[derive(Clone, Default)]
pub(crate) struct Raised(Arc<Shared>);

#[derive(Default)]
struct Shared {
    error: Mutex<Option<PyErr>>,
    period: AtomicU64,
}

impl Raised {
    /// What the policy raised, to be raised in its place.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.0.error.lock().take()
    }

    /// The next period's number: it counts by itself as long as the controller has a part in every period.
    pub(crate) fn set_period(&self, period: u64) {
        self.0.period.store(period, Ordering::Relaxed);
    }
}

/// Why there are no torques.
enum Failure {
    Raised(PyErr),
    Gave(String),
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self::Raised(error)
    }
}

/// A controller of one's own at work. Nothing is made anew in a period but what Python makes for a call.
struct Running {
    own: OwnPolicy,
    step: Py<PyAny>,
    observation: Py<Observation>,
    names: Vec<String>,
    attributes: Vec<Py<PyString>>,
    values: Vec<f64>,
    period_s: f64,
    failure: Option<String>,
    raised: Raised,
    /// For `reset`.
    scenario: config::Scenario,
}

impl Running {
    fn new(py: Python<'_>, own: &OwnPolicy, scenario: &config::Scenario) -> PyResult<Self> {
        let object = own.object.bind(py);
        let step = if own.is_object {
            object.getattr("step")?
        } else {
            object.clone()
        };
        let names = match object.getattr_opt("signals")? {
            None => Vec::new(),
            Some(names) => {
                let no_text = !names.is_instance_of::<PyString>() && names.cast::<PySequence>().is_ok();
                let read = if no_text {
                    names.extract::<Vec<String>>().ok()
                } else {
                    None
                };
                read.ok_or_else(|| {
                    let message = format!(
                        "policy {}: signals = {names}, allowed: names in a tuple",
                        own.name
                    );
                    PyTypeError::new_err(shortened(&message).into_owned())
                })?
            }
        };
        let vehicle = scenario.vehicle();
        Ok(Self {
            own: OwnPolicy {
                object: own.object(py),
                name: own.name.clone(),
                is_object: own.is_object,
            },
            step: step.unbind(),
            observation: Py::new(
                py,
                Observation::new(py, vehicle.wheel.len(), vehicle.hinge.len())?,
            )?,
            attributes: names
                .iter()
                .map(|name| PyString::intern(py, name).unbind())
                .collect(),
            values: vec![f64::NAN; names.len()],
            names,
            period_s: scenario.period_s(),
            failure: None,
            raised: Raised::default(),
            scenario: scenario.clone(),
        })
    }

    fn asked(
        &mut self,
        py: Python<'_>,
        period: u64,
        readings: &Readings<'_, f64>,
        torques_n_m: &mut [f64],
    ) -> Result<(), Failure> {
        let observation = self.observation.bind(py);
        observation
            .get()
            .set(py, period, period as f64 * self.period_s, readings)?;
        let given = nested(|| self.step.bind(py).call1((observation,)))?;
        read_torques(&given, torques_n_m).map_err(|found| {
            let wheels = torques_n_m.len();
            Failure::Gave(format!(
                "it returned {found}, allowed: {wheels} finite torques [N.m], one for each wheel"
            ))
        })?;
        for ((attribute, value), name) in self.attributes.iter().zip(&mut self.values).zip(&self.names) {
            let found = self.own.object.bind(py).getattr(attribute.bind(py))?;
            *value = found
                .extract()
                .map_err(|_| Failure::Gave(format!("its signal {name} is {found}, allowed: a number")))?;
        }
        Ok(())
    }
}

impl Policy<f64> for Running {
    fn reset(&mut self) {
        self.raised.set_period(0);
        self.failure = Python::attach(|py| {
            let done = self.own.reset(py, &self.scenario);
            done.err().map(|error| said(py, &error))
        });
    }

    fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
        let period = self.raised.0.period.fetch_add(1, Ordering::Relaxed);
        self.failure = Python::attach(|py| match self.asked(py, period, readings, torques_n_m) {
            Ok(()) => None,
            Err(Failure::Gave(reason)) => Some(reason),
            Err(Failure::Raised(error)) => {
                let time_s = period as f64 * self.period_s;
                noted(
                    py,
                    &error,
                    &format!(
                        "in period {period}, t = {time_s:.3} s, of policy {}",
                        self.own.name
                    ),
                );
                let reason = said(py, &error);
                *self.raised.0.error.lock() = Some(error);
                Some(reason)
            }
        });
        if self.failure.is_some() {
            torques_n_m.fill(0.0);
        }
    }

    fn name(&self) -> &str {
        &self.own.name
    }

    fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    fn signal_name(&self, index: usize) -> Option<&str> {
        self.names.get(index).map(String::as_str)
    }

    fn signals(&self, values: &mut [f64]) {
        values.copy_from_slice(&self.values);
    }
}

/// Torques as a policy gives them: an array of float64 is read where it is. Else what it gave, for the message.
fn read_torques(given: &Bound<'_, PyAny>, torques_n_m: &mut [f64]) -> Result<(), String> {
    let wheels = torques_n_m.len();
    if let Ok(array) = given.cast::<PyArray1<f64>>()
        && array.len() == wheels
        && let Ok(array) = array.try_readonly()
    {
        for (torque, given) in torques_n_m.iter_mut().zip(array.as_array()) {
            *torque = *given;
        }
        return Ok(());
    }
    let class = || {
        given
            .get_type()
            .name()
            .map_or_else(|_| "something".into(), |name| name.to_string())
    };
    if given.is_none() {
        return Err("None".into());
    }
    if let Ok(array) = given.cast::<PyUntypedArray>() {
        match array.shape() {
            [count] if *count == wheels => {}
            [count] => return Err(format!("{count} values")),
            shape => return Err(format!("an array of shape {shape:?}")),
        }
        // NumPy would drop the imaginary parts.
        if array.dtype().kind() == b'c' {
            return Err("an array of complex numbers".into());
        }
    }
    // Sequences too, of numbers even.
    let is_text = given.is_instance_of::<PyString>()
        || given.is_instance_of::<PyBytes>()
        || given.is_instance_of::<PyByteArray>();
    if is_text || given.cast::<PySequence>().is_err() && !given.hasattr("__array__").unwrap_or_default() {
        return Err(format!("a value of type {}", class()));
    }
    let found: Vec<f64> = given
        .extract()
        .map_err(|_| format!("{} with a value that is not a number", class()))?;
    if found.len() != wheels {
        return Err(format!("{} values", found.len()));
    }
    torques_n_m.copy_from_slice(&found);
    Ok(())
}

/// A controller of one's own on its way to a worker: name, identity, pickle.
pub(crate) type Packed<'py> = (String, String, Bound<'py, PyBytes>);

/// The policy of a study's runs, of which each has its own: one that was never used.
pub(crate) fn of_study(packed: Packed<'_>) -> PyResult<omni_study::OwnPolicy> {
    fn unpacked(py: Python<'_>, pickle: &Py<PyBytes>) -> PyResult<OwnPolicy> {
        OwnPolicy::of(&py.import("pickle")?.call_method1("loads", (pickle,))?)
    }
    let (name, identity, pickle) = packed;
    let (py, pickle) = (pickle.py(), pickle.unbind());
    // Whether it can be read here is said once, not by every row.
    unpacked(py, &pickle)
        .inspect_err(|error| noted(py, error, &format!("in the pickle of policy {name}")))?;
    let policy = name.clone();
    let make = move |scenario: &config::Scenario| {
        Python::attach(|py| {
            let started = unpacked(py, &pickle).and_then(|own| own.start(py, scenario));
            started
                .map(|(controller, _)| controller)
                .map_err(|error| Error::PolicyFailed {
                    policy: policy.clone(),
                    period: 0,
                    time_s: 0.0,
                    reason: said(py, &error),
                })
        })
    };
    Ok(omni_study::OwnPolicy::new(name, identity, make))
}
