//! Scenarios by name or path, with overrides from a dictionary.

use std::path::PathBuf;

use omni_sim::Error;
use omni_sim::config::{self, Override, Scenario};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::Value;

use crate::error::exception;

/// The scenario of that name or path with some keys replaced.
pub(crate) fn load(
    scenario: PathBuf,
    policy: Option<&str>,
    overrides: Option<&Bound<'_, PyDict>>,
    seed: Option<u64>,
) -> PyResult<Scenario> {
    let name = scenario.to_string_lossy();
    let overrides = from_dict(overrides)?;
    let build = || -> Result<Scenario, Error> {
        let mut scenario = Scenario::load(&name, &overrides)?;
        if let Some(policy) = policy {
            scenario = scenario.with_policy(policy)?;
        }
        scenario.seed = seed.unwrap_or(scenario.seed);
        Ok(scenario)
    };
    build().map_err(|error| exception(&error))
}

/// `{"terrain.height_m": 0.03}` as overrides.
pub(crate) fn from_dict(overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<Override>> {
    let Some(overrides) = overrides else {
        return Ok(Vec::new());
    };
    overrides
        .iter()
        .map(|(key, value)| Ok(Override::new(key.extract::<String>()?, to_toml(&key, &value)?)))
        .collect()
}

fn to_toml(key: &Bound<'_, PyAny>, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(Value::Integer(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract()?));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        return value
            .try_iter()?
            .map(|item| to_toml(key, &item?))
            .collect::<PyResult<_>>()
            .map(Value::Array);
    }
    // Python floats, and NumPy scalars through __float__.
    if value.is_instance_of::<PyFloat>() || value.hasattr("__float__")? {
        return Ok(Value::Float(value.extract()?));
    }
    let found = value.get_type();
    Err(PyTypeError::new_err(format!(
        "override {key}: {found}, allowed: a number, a string, a bool or a list of them"
    )))
}

/// Names of the coordination presets.
#[pyfunction]
pub(crate) fn policies() -> Vec<&'static str> {
    omni_core::Coordination::<f64>::PRESETS.to_vec()
}

/// Names of the built-in scenarios.
#[pyfunction]
pub(crate) fn scenarios() -> Vec<&'static str> {
    config::builtin_scenarios()
}

/// Names of the built-in vehicles.
#[pyfunction]
pub(crate) fn vehicles() -> Vec<&'static str> {
    config::builtin_vehicles()
}
