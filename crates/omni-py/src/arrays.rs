//! Numbers from Python and back: what is not usable is rejected with the argument's name.

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
            let value = "an integer too large for a float".into();
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

/// `values` as one number for each wheel.
pub(crate) fn sized<'a, const N: usize>(name: &str, values: &'a [f64]) -> PyResult<&'a [f64; N]> {
    exactly(name, values, &format!("{N} numbers, one for each wheel"))
}

fn exactly<'a, const N: usize>(name: &str, values: &'a [f64], allowed: &str) -> PyResult<&'a [f64; N]> {
    values.try_into().map_err(|_| {
        let found = counted(values.len(), "value");
        refused(name, &format!("{name} = {found}, allowed: {allowed}"))
    })
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The error for `found` values, numbers or rows (`what`) where there must be as many as of another argument.
pub(crate) fn as_many((name, found): (&str, usize), what: &str, (other, count): (&str, usize)) -> PyErr {
    let found = counted(found, what);
    refused(
        name,
        &format!("{name} = {found}, allowed: as many as {other}, {count}"),
    )
}

/// [`as_many`] where a single one stays the same for all.
pub(crate) fn as_many_or_one(
    (name, found): (&str, usize),
    what: &str,
    (other, count): (&str, usize),
) -> PyErr {
    if count == 1 {
        return as_many((name, found), what, (other, count));
    }
    let found = counted(found, what);
    let message = format!("{name} = {found}, allowed: as many as {other}, {count}, or one");
    refused(name, &message)
}

/// How many rows, numbers or rows of them (`what`), two arguments make, where a single one stays the same for all; none
/// if both are single ones without a dimension of their own.
pub(crate) fn together(
    what: &str,
    (first, a): (&str, Option<usize>),
    (second, b): (&str, Option<usize>),
) -> PyResult<Option<usize>> {
    match (a, b) {
        (Some(a), Some(b)) if a != b && a != 1 && b != 1 => {
            Err(as_many_or_one((second, b), what, (first, a)))
        }
        (Some(0), _) | (_, Some(0)) => Ok(Some(0)),
        _ => Ok(a.max(b)),
    }
}

/// `value` if it is finite and above 0.
pub(crate) fn positive(name: &str, value: f64) -> PyResult<f64> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(refused(
            name,
            &format!("{name} = {value}, allowed: finite and > 0"),
        ))
    }
}

/// `of` for every row of `count`, one after the other, while others may use the interpreter; Ctrl-C stops it.
pub(crate) fn each_row(py: Python<'_>, count: usize, mut of: impl FnMut(usize) + Send) -> PyResult<()> {
    py.detach(|| {
        for i in 0..count {
            if i % STEPS_PER_LOOK == STEPS_PER_LOOK - 1 {
                Python::attach(|py| py.check_signals())?;
            }
            of(i);
        }
        Ok(())
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
        Self::with_gaps(name, value, columns)?.finite(name, columns)
    }

    /// [`Rows::read`] of as many columns as there are, one per wheel, and their number.
    pub(crate) fn of_wheels(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(usize, Self)> {
        let allowed = "allowed: shape (N,) or (T, N) of 3 to 8 wheels";
        let array = as_array(name, value, allowed)?;
        match *array.shape() {
            [columns] | [_, columns] if (3..=8).contains(&columns) => {
                Ok((columns, Self::of(name, &array, columns)?.finite(name, columns)?))
            }
            _ => Err(misshaped(name, &array, allowed)?),
        }
    }

    fn finite(self, name: &str, columns: usize) -> PyResult<Self> {
        let Some(at) = self.values.iter().position(|value| !value.is_finite()) else {
            return Ok(self);
        };
        let (row, column, value) = (at / columns, at % columns, self.values[at]);
        let index = match self.count {
            Some(_) => format!("{row}, {column}"),
            None => column.to_string(),
        };
        let message = format!("{name}[{index}] = {value}, allowed: finite numbers");
        Err(refused(name, &message))
    }

    /// [`Rows::read`] where NaN says that nothing was measured.
    pub(crate) fn with_gaps(name: &str, value: &Bound<'_, PyAny>, columns: usize) -> PyResult<Self> {
        Self::of(name, &as_array(name, value, &shapes(columns))?, columns)
    }

    fn of(name: &str, array: &Array<'_, f64>, columns: usize) -> PyResult<Self> {
        let count = match *array.shape() {
            [c] if c == columns => None,
            [t, c] if c == columns => Some(t),
            _ => return Err(misshaped(name, array, &shapes(columns))?),
        };
        let values = array.try_readonly()?.as_slice()?.to_vec();
        Ok(Self { values, count })
    }

    /// How many rows; none for a single one without a dimension of its own.
    pub(crate) fn count(&self) -> Option<usize> {
        self.count
    }

    /// How many rows, where a single one counts as one whatever its shape.
    pub(crate) fn len(&self) -> usize {
        self.count.unwrap_or(1)
    }

    /// The shape of these rows with other columns.
    pub(crate) fn shape(&self, columns: usize) -> Vec<usize> {
        self.count.into_iter().chain([columns]).collect()
    }

    /// The shape of one number per row: none for a single row.
    pub(crate) fn shape_of_scalars(&self) -> Vec<usize> {
        self.count.into_iter().collect()
    }
}

/// A number, or T of them, (T,), and their shape. NaN and infinities pass.
pub(crate) fn floats(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let allowed = "allowed: a number or shape (T,)";
    let array = as_array(name, value, allowed)?;
    match *array.shape() {
        [] | [_] => Ok((array.try_readonly()?.as_slice()?.to_vec(), array.shape().to_vec())),
        _ => Err(misshaped(name, &array, allowed)?),
    }
}

/// Yes or no, T of them, (T,), or a single one.
pub(crate) fn flags(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<bool>> {
    let allowed = "allowed: true or false, or shape (T,) of them";
    let array = converted(name, value, allowed)?;
    let flags = array.call_method0("ravel")?.extract();
    let flags =
        flags.map_err(|_| PyTypeError::new_err(format!("{name}: {}, {allowed}", value.get_type())))?;
    if array.getattr("ndim")?.extract::<usize>()? > 1 {
        return Err(misshaped(name, &array, allowed)?);
    }
    Ok(flags)
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
pub(crate) fn as_array<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    allowed: &str,
) -> PyResult<Array<'py, f64>> {
    let usable = |array: &Array<'py, f64>| {
        array.is_c_contiguous() && array.try_readonly().is_ok_and(|a| a.as_slice().is_ok())
    };
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && usable(array)
    {
        return Ok(array.clone());
    }
    let array = converted(name, value, allowed)?;
    let dtype = array.getattr("dtype")?;
    // Not text that reads as a number, not complex numbers, not objects.
    if !"fiu".contains(&*dtype.getattr("kind")?.cast::<PyString>()?.to_cow()?) {
        return Err(PyTypeError::new_err(format!(
            "{name}: an array of {dtype}, allowed: numbers"
        )));
    }
    let numpy = value.py().import("numpy")?;
    let array = numpy.call_method1("require", (array, "float64", ["C_CONTIGUOUS", "ALIGNED"]))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

/// `value` as an array of whatever is in it.
fn converted<'py>(name: &str, value: &Bound<'py, PyAny>, allowed: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let array = py.import("numpy")?.call_method1("asarray", (value,));
    array.map_err(|error| {
        if error.is_instance_of::<PyValueError>(py) {
            refused(name, &format!("{name} = rows of several lengths, {allowed}"))
        } else {
            error
        }
    })
}

/// The error for an array of another shape.
fn misshaped(name: &str, array: &Bound<'_, PyAny>, allowed: &str) -> PyResult<PyErr> {
    let shape = array.getattr("shape")?;
    Ok(refused(
        name,
        &format!("{name} = an array of shape {shape}, {allowed}"),
    ))
}
