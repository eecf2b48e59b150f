//! From a study to its runs, each with the key that says whether it is done.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde_json::Value as Json;
use sha2::{Digest, Sha256};
use toml::{Table, Value};

use super::{Cell, Column, Columns, Found, Kind};
use crate::config::{self, Override, Scenario, Study};
use crate::controller::AnyController;
use crate::{Error, Outcome, record};

/// Runs of a study at most: each has a key in memory.
const MOST_RUNS: usize = 1_000_000;
/// The program's version: rows of another one are rows of another program.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A run of a study.
#[derive(Clone, Debug)]
pub struct Run {
    /// [`key`] of its scenario: 32 hexadecimal digits.
    pub key: String,
    /// Its seed.
    pub seed: u64,
    /// The value of each axis, in the study's order.
    pub axes: Arc<[Cell]>,
    pub(super) columns: Arc<Columns>,
    scenario: Arc<Scenario>,
}

impl Run {
    /// The scenario, with the run's seed.
    #[must_use]
    pub fn scenario(&self) -> Scenario {
        let mut scenario = Scenario::clone(&self.scenario);
        scenario.seed = self.seed;
        scenario
    }
}

/// The runs of a study, every scenario checked.
///
/// ```
/// use omni_sim::{config::{Override, Study}, study::Plan};
/// let plan = Plan::new(&Study::load("climb_map")?, &[Override::parse("duration_s=0.5")?])?;
/// assert_eq!(plan.runs().len(), 4 * 4 * 4 * 5);
/// assert_eq!(plan.columns().axes[1].name, "terrain_height_m");
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Plan {
    study: Study,
    columns: Arc<Columns>,
    runs: Vec<Run>,
    shared: Lines,
}

/// A scenario as `KEY = VALUE` lines in the order of their keys, as `--set` takes them.
pub(super) type Lines = BTreeMap<String, String>;

impl Plan {
    /// The runs of a study, with some more keys replaced in each.
    ///
    /// # Errors
    /// What is wrong with the first combination that is wrong, in one line that names the study's file, the axis, the value and
    /// what is allowed.
    pub fn new(study: &Study, overrides: &[Override]) -> Result<Self, Error> {
        let refuse = |key: &str, message: String| {
            Error::Config(config::Error::Key {
                file: study.file().into(),
                key: key.into(),
                message,
            })
        };
        let points = study.points(overrides)?;
        let seeds = study.seeds.list();
        if points.len().saturating_mul(seeds.len()) > MOST_RUNS {
            let message = format!(
                "{} for {} combinations, allowed: {MOST_RUNS} runs at most",
                seeds.len(),
                points.len()
            );
            return Err(refuse("seeds", message));
        }
        let mut tables = Vec::with_capacity(points.len());
        let mut values: Vec<Vec<Value>> = vec![Vec::new(); study.axis.len()];
        for point in &points {
            AnyController::new(&point.scenario)
                .map_err(|error| refuse(&study.named(&point.values), error.to_string()))?;
            let leaves = leaves(&point.scenario)?;
            for (i, axis) in study.axis.iter().enumerate() {
                values[i].push(typed(&point.values[i], leaves.get(&axis.key)));
            }
            tables.push(leaves);
        }
        let columns = Arc::new(columns(study, &values, &refuse)?);
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        let mut runs = Vec::with_capacity(points.len() * seeds.len());
        for (p, (point, leaves)) in points.iter().zip(&tables).enumerate() {
            let text = text(leaves);
            if let Some(twin) = known.insert(digest(&text, seeds[0]), p) {
                let (one, other) = (study.named(&points[twin].values), study.named(&point.values));
                return Err(refuse(
                    "axis",
                    format!("{one} and {other} are the same run, allowed: each once"),
                ));
            }
            let axes: Arc<[Cell]> = (0..study.axis.len())
                .map(|i| fitting(Cell::of_toml(&values[i][p]), columns.axes[i].kind))
                .collect();
            let scenario = Arc::new(point.scenario.clone());
            runs.extend(seeds.iter().map(|seed| Run {
                key: digest(&text, *seed),
                seed: *seed,
                axes: axes.clone(),
                columns: columns.clone(),
                scenario: scenario.clone(),
            }));
        }
        let varies = |key: &str| {
            let of = |axis: &config::Axis| {
                key.strip_prefix(&axis.key)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            study.axis.iter().any(of)
        };
        let first = tables.into_iter().next().unwrap_or_default();
        Ok(Self {
            study: study.clone(),
            columns,
            runs,
            shared: lines(&first)
                .filter(|(key, _)| !varies(key))
                .map(|(key, value)| (key, short(value)))
                .collect(),
        })
    }

    /// The study.
    #[must_use]
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// The columns of its results.
    #[must_use]
    pub fn columns(&self) -> &Columns {
        &self.columns
    }

    /// Every run, all seeds of a combination together.
    #[must_use]
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// The runs that have no row yet.
    #[must_use]
    pub fn missing(&self, found: &Found) -> Vec<Run> {
        let done: BTreeSet<&str> = found.keys().collect();
        let missing = self.runs.iter().filter(|run| !done.contains(run.key.as_str()));
        missing.cloned().collect()
    }

    /// What all its runs share: the scenario without axes and seed.
    pub(super) fn shared(&self) -> &Lines {
        &self.shared
    }
}

/// The key of a run: 32 hexadecimal digits of a SHA-256 over the program's version and every key of the scenario with its
/// vehicle and seed. The same on every machine; another scenario, another key.
///
/// # Errors
/// [`Error::Config`] where the scenario cannot be written as TOML: its seed is above 2^63 - 1.
///
/// ```
/// use omni_sim::{config::{Override, Scenario}, study::key};
/// let (one, other) = (Scenario::load("step", &[])?, Scenario::load("step", &[Override::parse("seed=1")?])?);
/// assert_eq!(key(&one)?.len(), 32);
/// assert_ne!(key(&one)?, key(&other)?);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn key(scenario: &Scenario) -> Result<String, Error> {
    Ok(digest(&text(&leaves(scenario)?), scenario.seed))
}

fn digest(text: &str, seed: u64) -> String {
    let text = format!("omnistep {VERSION}\nseed = {seed}\n{text}");
    hex(&Sha256::digest(text), 16)
}

/// Every plain value of a scenario by its dotted key, without the seed.
fn leaves(scenario: &Scenario) -> Result<BTreeMap<String, Value>, Error> {
    let mut all = BTreeMap::new();
    let table = Table::try_from(scenario).map_err(|error| {
        Error::Config(config::Error::Key {
            file: format!("scenario {}", scenario.name),
            key: "top level".into(),
            message: error.to_string(),
        })
    })?;
    flatten("", Value::Table(table), &mut all);
    all.remove("seed");
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

fn lines(leaves: &BTreeMap<String, Value>) -> impl Iterator<Item = (String, String)> {
    leaves.iter().map(|(key, value)| (key.clone(), value.to_string()))
}

/// A line's value; of a long one, such as a picture, its digest.
fn short(value: String) -> String {
    if value.len() <= 200 {
        return value;
    }
    format!("\"SHA-256 {}\"", hex(&Sha256::digest(value), 32))
}

/// The first bytes in hexadecimal digits.
pub(super) fn hex(bytes: &[u8], count: usize) -> String {
    bytes
        .iter()
        .take(count)
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn text(leaves: &BTreeMap<String, Value>) -> String {
    lines(leaves)
        .map(|(key, value)| format!("{key} = {value}\n"))
        .collect()
}

/// A value of an axis as the scenario holds it: 1 is 1.0 where a number with a fraction is meant. Names stay names.
fn typed(given: &Value, held: Option<&Value>) -> Value {
    match (given, held) {
        (Value::Integer(_), Some(held @ Value::Float(_))) => held.clone(),
        _ => given.clone(),
    }
}

/// A column's value in the column's type: a mixture is text.
fn fitting(cell: Cell, kind: Kind) -> Cell {
    if cell.kind() == Some(kind) {
        cell
    } else {
        Cell::Text(cell.to_string())
    }
}

/// One column an axis, one a figure; `values` are each axis' values over all combinations.
fn columns(
    study: &Study,
    values: &[Vec<Value>],
    refuse: &dyn Fn(&str, String) -> Error,
) -> Result<Columns, Error> {
    let figures = figures()?;
    for figure in &study.map.figures {
        if !figures
            .iter()
            .any(|column| column.name == *figure && column.kind != Kind::Text)
        {
            let known: Vec<_> = figures
                .iter()
                .filter(|column| column.kind != Kind::Text)
                .map(|column| column.name.as_str())
                .collect();
            return Err(refuse(
                "map.figures",
                format!("{figure:?}, allowed: {}", known.join(", ")),
            ));
        }
    }
    let mut axes: Vec<Column> = Vec::new();
    for (i, axis) in study.axis.iter().enumerate() {
        let name = axis.key.replace(['.', '-'], "_");
        let taken = ["key", "seed", "error"].contains(&name.as_str())
            || axes.iter().chain(&figures).any(|column| column.name == name);
        if taken {
            let message = format!(
                "{:?}, allowed: a key whose column, {name}, is not another's",
                axis.key
            );
            return Err(refuse(&format!("axis[{i}].key"), message));
        }
        let mut kinds = values[i].iter().filter_map(|value| Cell::of_toml(value).kind());
        let first = kinds.next().unwrap_or(Kind::Text);
        let kind = if kinds.all(|kind| kind == first) {
            first
        } else {
            Kind::Text
        };
        axes.push(Column { name, kind });
    }
    Ok(Columns { axes, figures })
}

/// The fields of an outcome with their types, as a short run gives them. A figure that is null there is a number.
fn figures() -> Result<Vec<Column>, Error> {
    let scenario = Scenario::load("flat", &[Override::parse("duration_s=0.01")?])?;
    let outcome = record(&scenario, None, |_, _| Ok::<(), Error>(()))?.outcome;
    Ok(fields(&outcome)
        .into_iter()
        .map(|(name, cell)| Column {
            name,
            kind: cell.kind().unwrap_or(Kind::Float),
        })
        .collect())
}

/// The fields of an outcome, by name.
pub(super) fn fields(outcome: &Outcome) -> BTreeMap<String, Cell> {
    // Plain numbers and names: they can be written as JSON.
    let Ok(Json::Object(fields)) = serde_json::to_value(outcome) else {
        return BTreeMap::new();
    };
    fields
        .into_iter()
        .map(|(name, value)| (name, Cell::of_json(&value)))
        .collect()
}
