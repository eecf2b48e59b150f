//! Numbers from Python and back: what is not usable is refused with the argument's name.

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use omni_sim::Error;
use omni_sim::config::shortened;
use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::error::{exception, refused};

/// Steps of a loop over rows between two looks at Ctrl-C: some milliseconds.
pub(crate) const STEPS_PER_LOOK: usize = 4096;

/// Any number of dimensions, as NumPy has them.
pub(crate) type Array<'py, T> = Bound<'py, PyArrayDyn<T>>;

/// A sequence or an array of numbers; the errors name the argument.
pub(crate) fn numbers(
    name: &'static str,
    value: &Bound<'_, PyAny>,
    allowed: &'static str,
) -> PyResult<Vec<f64>> {
    let py = value.py();
    value.extract::<Vec<f64>>().map_err(|error| {
        if error.is_instance_of::<PyTypeError>(py) {
            PyTypeError::new_err(
                shortened(&format!("{name}: {}, allowed: {allowed}", error.value(py))).into_owned(),
            )
        } else if error.is_instance_of::<PyOverflowError>(py) {
            let value = "an integer beyond every float".into();
            exception(Error::Argument { name, value, allowed })
        } else {
            error
        }
    })
}

/// [`numbers`], `N` of them.
pub(crate) fn fixed<const N: usize>(
    name: &'static str,
    value: &Bound<'_, PyAny>,
    allowed: &'static str,
) -> PyResult<[f64; N]> {
    let found = numbers(name, value, allowed)?;
    exactly(name, &found, allowed).copied()
}

/// `values` as one number a wheel.
pub(crate) fn sized<'a, const N: usize>(name: &str, values: &'a [f64]) -> PyResult<&'a [f64; N]> {
    exactly(name, values, &format!("{N} numbers, one a wheel"))
}

fn exactly<'a, const N: usize>(name: &str, values: &'a [f64], allowed: &str) -> PyResult<&'a [f64; N]> {
    values.try_into().map_err(|_| {
        let found = values.len();
        let plural = if found == 1 { "" } else { "s" };
        refused(
            name,
            &format!("{name} = {found} value{plural}, allowed: {allowed}"),
        )
    })
}

/// A whole number >= 0.
pub(crate) fn whole(name: &str, value: &Bound<'_, PyAny>, allowed: &str) -> PyResult<usize> {
    value.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyOverflowError>(value.py()) {
            refused(name, &format!("{name} = {value}, allowed: {allowed}"))
        } else {
            PyTypeError::new_err(format!("{name}: {}, allowed: {allowed}", value.get_type()))
        }
    })
}

/// One of the names that an argument may have.
pub(crate) fn choice<T: Copy>(argument: &str, name: &str, known: &[(&str, T)]) -> PyResult<T> {
    let found = known.iter().find(|(each, _)| *each == name);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let known: Vec<&str> = known.iter().map(|&(each, _)| each).collect();
        refused(
            argument,
            &format!(
                "{argument} = {name:?}{}, allowed: {}",
                omni_sim::config::did_you_mean(name, known.iter().copied()),
                known.join(", ")
            ),
        )
    })
}

/// One row of numbers, (C,), or T of them, (T, C): finite, one after the other.
pub(crate) struct Rows {
    /// The numbers of all rows.
    pub(crate) values: Vec<f64>,
    /// T; none for a single row.
    count: Option<usize>,
}

impl Rows {
    /// A copy of `value`, which is an array of `columns` columns or converts to one.
    pub(crate) fn read(name: &str, value: &Bound<'_, PyAny>, columns: usize) -> PyResult<Self> {
        let rows = Self::with_gaps(name, value, columns)?;
        if let Some(at) = rows.values.iter().position(|value| !value.is_finite()) {
            let (row, column, value) = (at / columns, at % columns, rows.values[at]);
            let index = match rows.count {
                Some(_) => format!("{row}, {column}"),
                None => column.to_string(),
            };
            return Err(refused(
                name,
                &format!("{name}[{index}] = {value}, allowed: finite numbers"),
            ));
        }
        Ok(rows)
    }

    /// [`Rows::read`] where NaN says that nothing was measured.
    pub(crate) fn with_gaps(name: &str, value: &Bound<'_, PyAny>, columns: usize) -> PyResult<Self> {
        let array = as_array(name, value, &shapes(columns))?;
        let count = match *array.shape() {
            [c] if c == columns => None,
            [t, c] if c == columns => Some(t),
            _ => {
                let shape = array.getattr("shape")?;
                return Err(refused(
                    name,
                    &format!("{name} = an array of shape {shape}, {}", shapes(columns)),
                ));
            }
        };
        let values = array.try_readonly()?.as_slice()?.to_vec();
        Ok(Self { values, count })
    }

    /// How many rows; none for a single one without a dimension of its own.
    pub(crate) fn count(&self) -> Option<usize> {
        self.count
    }

    /// The shape of these rows with other columns.
    pub(crate) fn shape(&self, columns: usize) -> Vec<usize> {
        self.count.into_iter().chain([columns]).collect()
    }

    /// The shape of one number a row: none for a single row.
    pub(crate) fn shape_of_scalars(&self) -> Vec<usize> {
        self.count.into_iter().collect()
    }
}

/// A number, or T of them, (T,), and their shape. NaN and infinities pass.
pub(crate) fn floats(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array = as_array(name, value, "allowed: a number or shape (T,)")?;
    match *array.shape() {
        [] | [_] => Ok((array.try_readonly()?.as_slice()?.to_vec(), array.shape().to_vec())),
        _ => {
            let shape = array.getattr("shape")?;
            let message = format!("{name} = an array of shape {shape}, allowed: a number or shape (T,)");
            Err(refused(name, &message))
        }
    }
}

/// A new array of that shape, whose values are in this order.
pub(crate) fn array<T: numpy::Element>(
    py: Python<'_>,
    shape: Vec<usize>,
    values: Vec<T>,
) -> PyResult<Array<'_, T>> {
    let array = numpy::ndarray::ArrayD::from_shape_vec(shape, values)
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(PyArrayDyn::from_owned_array(py, array))
}

fn shapes(columns: usize) -> String {
    format!("allowed: shape ({columns},) or (T, {columns})")
}

/// `value` itself where it is an array of float64 in the order of C, else a copy that is.
fn as_array<'py>(name: &str, value: &Bound<'py, PyAny>, allowed: &str) -> PyResult<Array<'py, f64>> {
    let usable = |array: &Array<'py, f64>| {
        array.is_c_contiguous() && array.try_readonly().is_ok_and(|a| a.as_slice().is_ok())
    };
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && usable(array)
    {
        return Ok(array.clone());
    }
    let py = value.py();
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (value,)).map_err(|error| {
        if error.is_instance_of::<PyValueError>(py) {
            refused(name, &format!("{name} = rows of several lengths, {allowed}"))
        } else {
            error
        }
    })?;
    let dtype = array.getattr("dtype")?;
    // Not text that reads as a number, not complex numbers, not objects.
    if !"fiu".contains(&*dtype.getattr("kind")?.cast::<PyString>()?.to_cow()?) {
        return Err(PyTypeError::new_err(format!(
            "{name}: an array of {dtype}, allowed: numbers"
        )));
    }
    let array = numpy.call_method1("require", (array, "float64", ["C_CONTIGUOUS", "ALIGNED"]))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}
