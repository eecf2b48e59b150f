//! Wheel counts that Python may ask for.

use pyo3::prelude::*;

use crate::error::refused;

/// Fewest and most wheels, in words.
pub(crate) const ALLOWED: &str = "3 to 8 wheels";

/// The error for a wheel count outside the range.
pub(crate) fn unusable(count: usize) -> PyErr {
    refused("wheels", &format!("wheels = {count}, allowed: {ALLOWED}"))
}

/// [`unusable`] as a result: what [`omni_sim::config::for_wheel_count!`] does with other counts.
pub(crate) fn refuse<T>(count: usize) -> PyResult<T> {
    Err(unusable(count))
}
