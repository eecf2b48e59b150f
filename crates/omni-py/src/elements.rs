//! Numbers of any shape, one by one.

use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Array, array, as_array};
use crate::error::refused;

/// An array of any shape, or a number.
pub(crate) struct Elements {
    pub(crate) values: Vec<f64>,
    pub(crate) shape: Vec<usize>,
}

impl Elements {
    /// A copy of `value`. NaN and infinities pass.
    pub(crate) fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let array = as_array(name, value, "allowed: numbers")?;
        Ok(Self {
            values: array.try_readonly()?.as_slice()?.to_vec(),
            shape: array.shape().to_vec(),
        })
    }

    /// [`Elements::read`] beside others: of their shape, or a single number, or they are one.
    pub(crate) fn beside(self, name: &str, other: (&str, &Self)) -> PyResult<Self> {
        if self.shape == other.1.shape || self.shape.is_empty() || other.1.shape.is_empty() {
            return Ok(self);
        }
        let message = format!(
            "{name} = an array of shape {}, allowed: a number, or the shape of {}, {}",
            tuple(&self.shape),
            other.0,
            tuple(&other.1.shape)
        );
        Err(refused(name, &message))
    }

    fn at(&self, i: usize) -> f64 {
        if self.shape.is_empty() {
            self.values[0]
        } else {
            self.values[i]
        }
    }
}

/// A shape as Python prints it.
fn tuple(shape: &[usize]) -> String {
    let sizes: Vec<String> = shape.iter().map(ToString::to_string).collect();
    let comma = if sizes.len() == 1 { "," } else { "" };
    format!("({}{comma})", sizes.join(", "))
}

/// Two arguments of one shape, where a number serves for all.
pub(crate) struct Pairs {
    a: Elements,
    b: Elements,
}

impl Pairs {
    pub(crate) fn read(
        (first, a): (&str, &Bound<'_, PyAny>),
        (second, b): (&str, &Bound<'_, PyAny>),
    ) -> PyResult<Self> {
        let a = Elements::read(first, a)?;
        let b = Elements::read(second, b)?.beside(second, (first, &a))?;
        Ok(Self { a, b })
    }

    pub(crate) fn shape(&self) -> Vec<usize> {
        let longer = if self.a.shape.is_empty() { &self.b } else { &self.a };
        longer.shape.clone()
    }

    /// `of` for every pair.
    pub(crate) fn each<T>(&self, of: impl Fn(f64, f64) -> T) -> Vec<T> {
        let count = if self.a.shape.is_empty() {
            self.b.values.len()
        } else {
            self.a.values.len()
        };
        (0..count).map(|i| of(self.a.at(i), self.b.at(i))).collect()
    }

    /// The same as an array.
    pub(crate) fn map<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(f64, f64) -> f64,
    ) -> PyResult<Array<'py, f64>> {
        array(py, self.shape(), self.each(of))
    }
}
