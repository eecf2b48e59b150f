//! What files hold, from Python and back: TOML's values.

use std::hash::{DefaultHasher, Hash, Hasher};

use omni_sim::Error;
use omni_sim::config::{self, Override, shortened};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple};
use toml::{Table, Value};

use crate::error::exception;

/// What pickle wants: who makes a thing again, and of what.
pub(crate) type Pickled<'py, A> = PyResult<(Bound<'py, PyAny>, A)>;

/// How pickle makes a thing again that its constructor made of keywords.
pub(crate) fn rebuilt<'py>(
    class: &Bound<'py, PyAny>,
    keywords: &Bound<'py, PyDict>,
) -> Pickled<'py, Bound<'py, PyTuple>> {
    let py = class.py();
    let partial = py.import("functools")?.getattr("partial")?;
    Ok((partial.call((class,), Some(keywords))?, PyTuple::empty(py)))
}

/// A hash of a file's text; values that are equal have the same.
pub(crate) fn hash(text: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    text.replace("-0.0\n", "0.0\n").hash(&mut hasher);
    hasher.finish()
}

/// `{"terrain.height_m": 0.03}` as overrides.
pub(crate) fn overrides(given: Option<&Bound<'_, PyMapping>>) -> PyResult<Vec<Override>> {
    let Some(given) = given else {
        return Ok(Vec::new());
    };
    let items = given.items()?;
    let each = items.iter().map(|item| {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let key = name("overrides", &key)?;
        let value = from_python("overrides", &key, &value)?;
        Ok(Override::new(key, value))
    });
    each.collect()
}

/// A dictionary as the table of a file; `file` is what messages call it.
pub(crate) fn table(file: &str, given: &Bound<'_, PyMapping>) -> PyResult<Table> {
    tables(file, "", given, DEEPEST)
}

/// Lists in lists and tables in tables at most: no file needs more, and what holds itself has no end.
const DEEPEST: usize = 16;

fn tables(file: &str, parent: &str, given: &Bound<'_, PyMapping>, deeper: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for item in given.items()?.iter() {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let key = name(file, &key)?;
        let path = if parent.is_empty() {
            key.clone()
        } else {
            format!("{parent}.{key}")
        };
        if !value.is_none() {
            table.insert(key, value_at(file, &path, &value, deeper)?);
        }
    }
    Ok(table)
}

fn name(file: &str, key: &Bound<'_, PyAny>) -> PyResult<String> {
    key.extract().map_err(|_| {
        PyTypeError::new_err(shortened(&format!("{file}: the key {key}, allowed: strings")).into_owned())
    })
}

/// A value as a file holds it; `key` is the whole path, for messages.
pub(crate) fn from_python(file: &str, key: &str, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    value_at(file, key, value, DEEPEST)
}

fn value_at(file: &str, key: &str, value: &Bound<'_, PyAny>, deeper: usize) -> PyResult<Value> {
    let Some(deeper) = deeper.checked_sub(1) else {
        let message = format!("{file}: {key}: lists nested too deeply, allowed: {DEEPEST} levels");
        return Err(PyTypeError::new_err(message));
    };
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        let integer = value.extract().map_err(|_| {
            exception(Error::Config(config::Error::Key {
                file: file.into(),
                key: key.into(),
                message: format!("{value}, allowed: an integer of 64 bits"),
            }))
        })?;
        return Ok(Value::Integer(integer));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract()?));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?.enumerate();
        let items = items.map(|(i, item)| value_at(file, &format!("{key}[{i}]"), &item?, deeper));
        return items.collect::<PyResult<_>>().map(Value::Array);
    }
    // NumPy's arrays and scalars know what they are in Python: an int64 stays an integer.
    let numpy = value.py().import("numpy")?;
    if value.is_instance(&numpy.getattr("ndarray")?)? || value.is_instance(&numpy.getattr("generic")?)? {
        return value_at(file, key, &value.call_method0("tolist")?, deeper);
    }
    // Last, since it asks in Python: a Ctrl-C that comes meanwhile is lost there.
    if let Ok(mapping) = value.cast::<PyMapping>() {
        return tables(file, key, mapping, deeper).map(Value::Table);
    }
    if value.hasattr("__float__")? {
        return Ok(Value::Float(value.extract()?));
    }
    let found = value.get_type();
    Err(PyTypeError::new_err(format!(
        "{file}: {key}: {found}, allowed: a number, a string, a bool, or lists and dictionaries of them"
    )))
}

/// A value of a file as Python's own.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Boolean(value) => PyBool::new(py, *value).to_owned().into_any(),
        Value::Integer(value) => value.into_pyobject(py)?.into_any(),
        Value::Float(value) => value.into_pyobject(py)?.into_any(),
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Array(items) => {
            let list = PyList::empty(py);
            for item in items {
                list.append(to_python(py, item)?)?;
            }
            list.into_any()
        }
        Value::Table(table) => {
            let dict = PyDict::new(py);
            for (key, value) in table {
                dict.set_item(key, to_python(py, value)?)?;
            }
            dict.into_any()
        }
        Value::Datetime(time) => time.to_string().into_pyobject(py)?.into_any(),
    })
}

/// The value at a dotted key; elements of lists count from 0.
///
/// A `KeyError` names the keys that there are.
pub(crate) fn at<'py>(py: Python<'py>, table: &Table, key: &str) -> PyResult<Bound<'py, PyAny>> {
    let dotted = key.replace('[', ".").replace(']', "");
    let (mut path, mut parts) = (String::new(), dotted.split('.'));
    let first = parts.next().unwrap_or_default();
    let missing = |inside: &str, known: String| {
        let inside = if inside.is_empty() { "top level" } else { inside };
        PyKeyError::new_err(format!("{}: {} has {known}", shortened(key), shortened(inside)))
    };
    let names = |table: &Table| table.keys().cloned().collect::<Vec<_>>().join(", ");
    let mut value = table.get(first).ok_or_else(|| missing(&path, names(table)))?;
    path.push_str(first);
    for part in parts {
        value = match value {
            Value::Table(inner) => inner.get(part).ok_or_else(|| missing(&path, names(inner)))?,
            Value::Array(items) => {
                let item = part.parse().ok().and_then(|i: usize| items.get(i));
                item.ok_or_else(|| missing(&path, format!("{} elements, from 0", items.len())))?
            }
            _ => return Err(missing(&path, "no keys".into())),
        };
        path.push('.');
        path.push_str(part);
    }
    to_python(py, value)
}
