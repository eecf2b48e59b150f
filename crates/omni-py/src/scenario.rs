//! Scenarios by name or path, with overrides from a dictionary.

use std::path::PathBuf;

use omni_sim::Error;
use omni_sim::config::{self, Override, Scenario};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple};
use toml::Value;

use crate::error::exception;

/// The scenario of that name or path with some keys replaced.
pub(crate) fn load(
    scenario: PathBuf,
    policy: Option<&str>,
    overrides: Option<&Bound<'_, PyMapping>>,
    seed: Option<&Bound<'_, PyAny>>,
) -> PyResult<Scenario> {
    let name = scenario.to_string_lossy();
    let overrides = from_mapping(overrides)?;
    let seed = seed.map(checked_seed).transpose()?;
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
pub(crate) fn from_mapping(overrides: Option<&Bound<'_, PyMapping>>) -> PyResult<Vec<Override>> {
    let Some(overrides) = overrides else {
        return Ok(Vec::new());
    };
    overrides
        .items()?
        .iter()
        .map(|item| {
            let (key, value): (String, Bound<'_, PyAny>) = item.extract()?;
            let value = to_toml(&key, &value)?;
            Ok(Override::new(key, value))
        })
        .collect()
}

/// A seed that TOML can hold too: what a log says of its scenario must read back.
fn checked_seed(seed: &Bound<'_, PyAny>) -> PyResult<u64> {
    match seed.extract::<i64>().map(u64::try_from) {
        Ok(Ok(seed)) => Ok(seed),
        Err(error) if !error.is_instance_of::<PyOverflowError>(seed.py()) => Err(error),
        _ => Err(exception(&Error::Argument {
            name: "seed",
            value: seed.to_string(),
            allowed: "0 to 9223372036854775807",
        })),
    }
}

pub(crate) fn to_toml(key: &str, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        let integer = value.extract().map_err(|_| {
            exception(&Error::Config(config::Error::Key {
                file: "overrides".into(),
                key: key.into(),
                message: format!("{value}, allowed: an integer of 64 bits"),
            }))
        })?;
        return Ok(Value::Integer(integer));
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
    // NumPy's arrays and scalars know what they are in Python: an int64 stays an integer.
    if value.hasattr("tolist")? {
        return to_toml(key, &value.call_method0("tolist")?);
    }
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
