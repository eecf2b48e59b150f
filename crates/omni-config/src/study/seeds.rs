//! The seeds of a study.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::de::{Deserializer, Error as _};
use serde::{Deserialize, Serialize};
use toml::Value;

/// Largest number of seeds of a study.
const MOST_SEEDS: usize = 100_000;

/// Seeds: a number of seeds, counted from 0, or a list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(untagged)]
#[non_exhaustive]
pub enum Seeds {
    /// 0 to one less than this.
    Count(u32),
    /// These, each once.
    List(Vec<u64>),
}

impl Seeds {
    /// The seeds in order.
    #[must_use]
    pub fn list(&self) -> Vec<u64> {
        match self {
            Self::Count(count) => (0..u64::from(*count)).collect(),
            Self::List(list) => list.clone(),
        }
    }

    /// The seeds that a value of a file means.
    ///
    /// # Errors
    /// The value and the allowed range.
    ///
    /// ```
    /// use omni_config::Seeds;
    /// assert_eq!(Seeds::from_value(3.into())?.list(), [0, 1, 2]);
    /// assert!(Seeds::from_value(vec![1, 5, 1].into()).is_err());
    /// # Ok::<(), String>(())
    /// ```
    pub fn from_value(value: Value) -> Result<Self, String> {
        let refuse = |value: &dyn std::fmt::Display| {
            format!("{value}, allowed: how many, 1 to {MOST_SEEDS}, or a list of seeds, each once and >= 0")
        };
        match value {
            Value::Integer(count) if (1..=MOST_SEEDS as i64).contains(&count) => {
                u32::try_from(count).map(Self::Count).map_err(|_| refuse(&count))
            }
            Value::Array(items) if (1..=MOST_SEEDS).contains(&items.len()) => {
                let seed = |item: &Value| item.as_integer().and_then(|seed| u64::try_from(seed).ok());
                let mut known = std::collections::BTreeSet::new();
                let list = items.iter().map(|item| {
                    seed(item)
                        .filter(|seed| known.insert(*seed))
                        .ok_or_else(|| refuse(item))
                });
                Ok(Self::List(list.collect::<Result<_, _>>()?))
            }
            other => Err(refuse(&other)),
        }
    }
}

impl<'de> Deserialize<'de> for Seeds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::from_value(Value::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}
