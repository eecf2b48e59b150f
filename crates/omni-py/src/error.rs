//! Errors of simulation, logs and studies as the exceptions of `omnistep.errors`, with the key and file they concern.

use std::path::PathBuf;

use omnistep::Error;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::nested::nested;

/// The Python exception for an error.
pub(crate) fn exception(error: impl Into<Error>) -> PyErr {
    let error = error.into();
    Python::attach(|py| build(py, &error).unwrap_or_else(|failed| failed))
}

/// The exception for a pickle whose bytes are not what was written.
pub(crate) fn damaged_pickle(error: impl std::fmt::Display) -> PyErr {
    let why = error.to_string();
    PyValueError::new_err(format!("the pickle is damaged: {}", shortened(&why)))
}

fn build(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    use omni_study::Error as OfStudy;
    let (class, key, file) = match error {
        Error::Simulation(error) | Error::Study(OfStudy::Simulation(error)) => of_simulation(error),
        Error::Log(omni_log::Error::Simulation(error)) => of_simulation(error),
        Error::Log(omni_log::Error::Log(error)) => ("LogError", None, error.path().to_str()),
        Error::ClimbLimits(omni_bound::Error::Argument { name, .. }) => ("ConfigError", Some(*name), None),
        Error::ClimbLimits(omni_bound::Error::Vehicle { .. }) => ("ConfigError", Some("vehicle"), None),
        Error::Plan(omni_plan::Error::Argument { name, .. }) => ("ConfigError", Some(*name), None),
        Error::NoRoute(_) => ("NoRouteError", None, None),
        // The folder of results is an argument of that name.
        Error::Study(OfStudy::Study { folder, .. }) => ("ConfigError", Some("out"), folder.to_str()),
        Error::Study(OfStudy::Io { path, .. }) => ("StudyError", None, path.to_str()),
        _ => ("SimulationError", None, None),
    };
    let line = error.to_string();
    raised(py, class, &omni_sim::config::shortened_line(&line), key, file)
}

/// The class of exception for an error of the simulation, the key and the file concerned.
fn of_simulation(error: &omni_sim::Error) -> (&'static str, Option<&str>, Option<&str>) {
    use omni_sim::Error::{Argument, Config, Signal};
    use omni_sim::config::Error as Bad;
    match error {
        Config(Bad::Key { file, key, .. }) => ("ConfigError", Some(key), Some(file)),
        Config(Bad::Syntax { file, .. } | Bad::NotText { file, .. } | Bad::OtherKind { file, .. }) => {
            ("ConfigError", None, Some(file))
        }
        // The experiment of section 3.3 is an argument of that name.
        Config(Bad::UnknownName { kind, .. }) => {
            ("ConfigError", Some(kind.trim_start_matches("wheels ")), None)
        }
        Config(Bad::Override { text, .. }) => ("ConfigError", Some(text), None),
        Config(Bad::Missing { path, .. } | Bad::Io { path, .. }) => ("ConfigError", None, path.to_str()),
        Config(_) => ("ConfigError", None, None),
        Argument { name, .. } => ("ConfigError", Some(name), None),
        Signal { .. } => ("ConfigError", Some("policy"), None),
        _ => ("SimulationError", None, None),
    }
}

/// An argument, by its name, that is not usable; `message` is the one line that says so, however long the value in it.
pub(crate) fn refused(key: &str, message: &str) -> PyErr {
    let message = shortened(message);
    Python::attach(|py| raised(py, "ConfigError", &message, Some(key), None).unwrap_or_else(|failed| failed))
}

/// A message with its values cut at 200 characters; the allowed values are kept.
#[pyfunction]
pub(crate) fn shortened(message: &str) -> String {
    omni_sim::config::shortened(message).into_owned()
}

/// Suggest a similarly named file next to a missing one, as a suffix for the name in a message, or nothing.
#[pyfunction]
pub(crate) fn did_you_mean_file(path: PathBuf) -> String {
    omni_sim::config::did_you_mean_file(&path, &[])
}

/// The same refusal, said of `place`; another exception stays what it is.
pub(crate) fn about(py: Python<'_>, place: &str, error: PyErr) -> PyErr {
    let said = || -> PyResult<PyErr> {
        let value = error.value(py);
        let key: Option<String> = value.getattr("key")?.extract()?;
        let file: Option<String> = value.getattr("file")?.extract()?;
        let message = format!("{place}: {value}");
        raised(py, "ConfigError", &message, key.as_deref(), file.as_deref())
    };
    let class = py
        .import("omnistep.errors")
        .and_then(|errors| errors.getattr("ConfigError"));
    match class {
        Ok(class) if error.is_instance(py, &class) => said().unwrap_or_else(|failed| failed),
        _ if error.is_instance_of::<PyTypeError>(py) => {
            PyTypeError::new_err(format!("{place}: {}", shortened(&error.value(py).to_string())))
        }
        _ => error,
    }
}

/// A refusal of the control library, in its words; `key` is the argument concerned.
pub(crate) fn of_core(key: &str, error: &omni_core::ConfigError) -> PyErr {
    refused(key, &error.to_string())
}

fn raised(
    py: Python<'_>,
    class: &str,
    message: &str,
    key: Option<&str>,
    file: Option<&str>,
) -> PyResult<PyErr> {
    let class = py.import("omnistep.errors")?.getattr(class)?;
    let kwargs = PyDict::new(py);
    if let Some(key) = key {
        kwargs.set_item("key", key)?;
    }
    if let Some(file) = file {
        kwargs.set_item("file", file)?;
    }
    Ok(PyErr::from_value(class.call((message,), Some(&kwargs))?))
}

/// Ctrl-C, and a callback for how far a long call is: the part done, 0 to 1.
pub(crate) fn looked(py: Python<'_>, on_progress: Option<&Py<PyAny>>, part: f64) -> PyResult<()> {
    py.check_signals()?;
    on_progress.map_or(Ok(()), |callback| {
        nested(|| callback.call1(py, (part,)).map(drop))
    })
}

/// What ends a run early: its own error, or a signal such as Ctrl-C.
pub(crate) enum Stop {
    Failed(Error),
    Interrupted(PyErr),
}

impl<E: Into<Error>> From<E> for Stop {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

impl From<Stop> for PyErr {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::Failed(error) => exception(error),
            Stop::Interrupted(error) => error,
        }
    }
}
