//! The columns of a study's results.

use std::collections::BTreeMap;

use omni_config::{Override, Scenario, Study};
use omni_sim::{Outcome, Run};
use serde_json::Value as Json;
use toml::Value;

use crate::{Cell, Column, Columns, Error, Kind};

/// One column an axis, one a metric; `values` are each axis' values over all combinations.
pub(crate) fn columns(
    study: &Study,
    values: &[Vec<Option<Value>>],
    refuse: &dyn Fn(&str, String) -> Error,
) -> Result<Columns, Error> {
    let metrics = metrics()?;
    for metric in &study.map.metrics {
        if !metrics
            .iter()
            .any(|column| column.name == *metric && column.kind != Kind::Text)
        {
            let known: Vec<_> = metrics
                .iter()
                .filter(|column| column.kind != Kind::Text)
                .map(|column| column.name.as_str())
                .collect();
            return Err(refuse(
                "map.metrics",
                format!(
                    "{metric:?}{}, allowed: {}",
                    omni_config::did_you_mean(metric, known.iter().copied()),
                    known.join(", ")
                ),
            ));
        }
    }
    let mut axes: Vec<Column> = Vec::new();
    for (i, axis) in study.axis.iter().enumerate() {
        let name = axis.key.replace(['.', '-'], "_");
        let taken = ["key", "seed", "error"].contains(&name.as_str())
            || axes.iter().chain(&metrics).any(|column| column.name == name);
        if taken {
            let message = format!(
                "{:?}, allowed: a key whose column, {name}, no other key has",
                axis.key
            );
            return Err(refuse(&format!("axis[{i}].key"), message));
        }
        let mut kinds = values[i]
            .iter()
            .flatten()
            .filter_map(|value| Cell::from(value).kind());
        let first = kinds.next().unwrap_or(Kind::Text);
        let kind = if kinds.all(|kind| kind == first) {
            first
        } else {
            Kind::Text
        };
        axes.push(Column { name, kind });
    }
    Ok(Columns { axes, metrics })
}

/// Metrics that are words, and null in most runs.
const WORDS: [&str; 2] = ["limited_by", "touched_body"];

/// The fields of an outcome with their types, from a short run. A metric that is null there is a number, unless it is a
/// word.
fn metrics() -> Result<Vec<Column>, Error> {
    let scenario = Scenario::load("flat", &[Override::parse("duration_s=0.01")?])?;
    let (outcome, _) = Run::new(&scenario).outcome()?;
    Ok(fields(&outcome)
        .into_iter()
        .map(|(name, cell)| Column {
            kind: match cell.kind() {
                Some(kind) => kind,
                None if WORDS.contains(&name.as_str()) => Kind::Text,
                None => Kind::Float,
            },
            name,
        })
        .collect())
}

/// The fields of an outcome, by name.
pub(crate) fn fields(outcome: &Outcome) -> BTreeMap<String, Cell> {
    // Plain numbers and names: they can be written as JSON.
    let Ok(Json::Object(fields)) = serde_json::to_value(outcome) else {
        return BTreeMap::new();
    };
    fields
        .into_iter()
        .map(|(name, value)| (name, Cell::of_json(&value)))
        .collect()
}
