//! The key of a run: a hash of all that decides it.

use std::collections::BTreeMap;

use omni_config::{self as config, Scenario};
use sha2::{Digest, Sha256};
use toml::{Table, Value};

use crate::{Error, OwnPolicy};

/// Rows of another version of the simulation are rows of another program.
pub(crate) use omni_sim::VERSION;

/// Key of the coordination policy.
pub(crate) const POLICY: &str = "control.policy";

/// A scenario as `KEY = VALUE` lines in the order of their keys, in the format of `--set`.
pub(crate) type Lines = BTreeMap<String, String>;

/// The key of a run: 32 hexadecimal digits of a SHA-256 over the program's version and every key of
/// the scenario with its vehicle and seed. The same on every machine; another scenario, another key.
///
/// # Errors
/// [`omni_sim::Error::Config`] if the scenario cannot be written as TOML: its seed is above 2^63 - 1.
///
/// ```
/// use omni_config::{Override, Scenario};
/// use omni_study::key;
/// let (one, other) = (Scenario::load("step", &[])?, Scenario::load("step", &[Override::parse("seed=1")?])?);
/// assert_eq!(key(&one)?.len(), 32);
/// assert_ne!(key(&one)?, key(&other)?);
/// # Ok::<(), omni_study::Error>(())
/// ```
pub fn key(scenario: &Scenario) -> Result<String, Error> {
    key_with(scenario, None)
}

/// [`key`] of a run with that controller.
pub(crate) fn key_with(scenario: &Scenario, own: Option<&OwnPolicy>) -> Result<String, Error> {
    Ok(digest(&text(&leaves(scenario, own)?), scenario.seed))
}

pub(crate) fn digest(text: &str, seed: u64) -> String {
    let text = format!("omnistep {VERSION}\nseed = {seed}\n{text}");
    hex(&Sha256::digest(text), 16)
}

/// Every plain value of a scenario by its dotted key, without the seed. A controller of one's own
/// is a policy of that name.
pub(crate) fn leaves(scenario: &Scenario, own: Option<&OwnPolicy>) -> Result<BTreeMap<String, Value>, Error> {
    let mut all = BTreeMap::new();
    let table = Table::try_from(scenario).map_err(|error| {
        Error::from(config::Error::Key {
            file: format!("scenario {}", scenario.name),
            key: "top level".into(),
            message: error.to_string(),
        })
    })?;
    flatten("", Value::Table(table), &mut all);
    all.remove("seed");
    if let Some(own) = own {
        all.insert(POLICY.into(), Value::String(own.name().into()));
        all.insert("own_policy".into(), Value::String(own.identity().into()));
    }
    Ok(all)
}

fn flatten(key: &str, value: Value, into: &mut BTreeMap<String, Value>) {
    let below = |name: &str| match key {
        "" => name.to_owned(),
        _ => format!("{key}.{name}"),
    };
    match value {
        Value::Table(table) => {
            for (name, value) in table {
                flatten(&below(&name), value, into);
            }
        }
        Value::Array(items) if items.iter().any(Value::is_table) => {
            for (i, value) in items.into_iter().enumerate() {
                flatten(&below(&i.to_string()), value, into);
            }
        }
        value => {
            into.insert(key.to_owned(), value);
        }
    }
}

pub(crate) fn lines(leaves: &BTreeMap<String, Value>) -> impl Iterator<Item = (String, String)> {
    leaves.iter().map(|(key, value)| (key.clone(), value.to_string()))
}

/// A line's value; of a long one, such as a picture, its digest.
pub(crate) fn short(value: String) -> String {
    if value.len() <= 200 {
        return value;
    }
    format!("\"SHA-256 {}\"", hex(&Sha256::digest(value), 32))
}

/// The first bytes in hexadecimal digits.
pub(crate) fn hex(bytes: &[u8], count: usize) -> String {
    bytes
        .iter()
        .take(count)
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

pub(crate) fn text(leaves: &BTreeMap<String, Value>) -> String {
    lines(leaves)
        .map(|(key, value)| format!("{key} = {value}\n"))
        .collect()
}
