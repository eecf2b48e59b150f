//! The values in the columns of a study's results.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use toml::Value as Toml;

/// A value in a column of results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
// Not `non_exhaustive`, nor is `Kind`: a writer of tables has to write every cell.
pub enum Cell {
    /// Nothing was measured: null.
    Missing,
    /// Yes or no.
    Bool(bool),
    /// An integer.
    Integer(i64),
    /// A number; never NaN, which is [`Cell::Missing`].
    Float(f64),
    /// Text.
    Text(String),
}

/// The type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// `BOOLEAN`.
    Bool,
    /// `INT64`.
    Integer,
    /// `DOUBLE`.
    Float,
    /// `BYTE_ARRAY` of UTF-8.
    Text,
}

/// A column of results.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Column {
    /// Its name, which needs no quotes in a query.
    pub name: String,
    /// Its type.
    pub kind: Kind,
}

/// The columns of a study's results besides `key`, `seed` and `error`: the same in every part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Columns {
    /// One an axis, in the study's order: the axis' key with `_` for each dot.
    pub axes: Vec<Column>,
    /// One a field of [`Outcome`](omni_sim::Outcome), by name.
    pub metrics: Vec<Column>,
}

impl Columns {
    /// Every column: `key`, `seed`, the axes, the metrics, `error`.
    #[must_use]
    pub fn all(&self) -> Vec<Column> {
        let column = |name: &str, kind| Column {
            name: name.into(),
            kind,
        };
        let mut all = vec![column("key", Kind::Text), column("seed", Kind::Integer)];
        all.extend(self.axes.iter().chain(&self.metrics).cloned());
        all.push(column("error", Kind::Text));
        all
    }
}

impl From<&Toml> for Cell {
    /// A value of a file; arrays and tables as their text.
    fn from(value: &Toml) -> Self {
        match value {
            Toml::Boolean(value) => Self::Bool(*value),
            Toml::Integer(value) => Self::Integer(*value),
            Toml::Float(value) => Self::Float(*value),
            Toml::String(text) => Self::Text(text.clone()),
            other => Self::Text(other.to_string()),
        }
    }
}

impl Cell {
    /// What kind of column it fits; any if it is missing.
    pub(crate) fn kind(&self) -> Option<Kind> {
        match self {
            Self::Missing => None,
            Self::Bool(_) => Some(Kind::Bool),
            Self::Integer(_) => Some(Kind::Integer),
            Self::Float(_) => Some(Kind::Float),
            Self::Text(_) => Some(Kind::Text),
        }
    }

    /// A value of a serialised outcome; arrays and objects as their text.
    pub(crate) fn of_json(value: &Json) -> Self {
        match value {
            Json::Null => Self::Missing,
            Json::Bool(value) => Self::Bool(*value),
            Json::String(text) => Self::Text(text.clone()),
            Json::Number(number) => number
                .as_i64()
                .map(Self::Integer)
                .or_else(|| number.as_f64().map(Self::Float))
                .unwrap_or(Self::Missing),
            other => Self::Text(other.to_string()),
        }
    }

    /// The number for a mean: 1 for yes, 0 for no.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Bool(value) => Some(f64::from(u8::from(*value))),
            Self::Integer(value) => Some(*value as f64),
            Self::Float(value) => Some(*value),
            Self::Missing | Self::Text(_) => None,
        }
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str("-"),
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            // Many noughts are no help.
            Self::Float(value) if *value != 0.0 && !(1e-4..1e7).contains(&value.abs()) => {
                write!(f, "{value:e}")
            }
            Self::Float(value) => write!(f, "{value}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}
