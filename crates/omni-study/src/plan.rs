//! The runs of a study, each with the key that says whether it is done.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use omni_config::{self as config, Axis, Override, Scenario, Seeds, Study};
use omni_sim::controller::AnyController;
use toml::Value;

use crate::columns::columns;
use crate::key::{Lines, POLICY, digest, leaves, lines, short, text};
use crate::{Cell, Columns, Error, Kind, OwnPolicy};

/// Runs of a study at most: each has a key in memory.
const MOST_RUNS: usize = 1_000_000;

/// A run of a study.
#[derive(Clone, Debug)]
pub struct Run {
    /// [`key`] of its scenario: 32 hexadecimal digits.
    pub key: String,
    /// Its seed.
    pub seed: u64,
    /// The value of each axis, in the study's order.
    pub axes: Arc<[Cell]>,
    pub(crate) columns: Arc<Columns>,
    pub(crate) scenario: Arc<Scenario>,
    pub(crate) own: Option<OwnPolicy>,
}

/// A scenario, and the value of each axis where it has one.
struct Planned {
    values: Vec<Option<Value>>,
    scenario: Scenario,
}

impl Run {
    /// The scenario, with the run's seed.
    #[must_use]
    pub fn scenario(&self) -> Scenario {
        let mut scenario = Scenario::clone(&self.scenario);
        scenario.seed = self.seed;
        scenario
    }

    /// The user's own controller, where it has one.
    #[must_use]
    pub fn own_policy(&self) -> Option<&OwnPolicy> {
        self.own.as_ref()
    }

    /// Why its vehicle cannot be across in time, where that is so ([`Scenario::too_short`]).
    #[must_use]
    pub fn too_short(&self) -> Option<String> {
        self.scenario.too_short()
    }
}

/// The runs of a study, every scenario checked.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::Plan;
/// let plan = Plan::new(&Study::load("climb_map")?, &[Override::parse("duration_s=0.5")?])?;
/// assert_eq!(plan.runs().len(), 4 * 4 * 5 * 5);
/// assert_eq!(plan.columns().axes[1].name, "terrain_height_m");
/// # Ok::<(), omni_study::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Plan {
    study: Study,
    columns: Arc<Columns>,
    runs: Vec<Run>,
    shared: Lines,
    own: Option<OwnPolicy>,
}

impl Plan {
    /// The runs of a study, with some more keys replaced in each.
    ///
    /// # Errors
    /// What is wrong with the first combination that is wrong, in one line that names the study's
    /// file, the axis, the value and what is allowed.
    pub fn new(study: &Study, overrides: &[Override]) -> Result<Self, Error> {
        Self::new_until(study, overrides, &AtomicBool::new(false))
    }

    /// [`Plan::new`], until `stop` is set.
    ///
    /// # Errors
    /// As [`Plan::new`]; [`Error::Stopped`].
    pub fn new_until(study: &Study, overrides: &[Override], stop: &AtomicBool) -> Result<Self, Error> {
        let each = study.each_point(overrides)?;
        Self::check_size(study.file(), each.len(), &study.seeds)?;
        let points = each.map(|point| {
            going(stop)?;
            let point = point?;
            Ok(Planned {
                values: point.values.into_iter().map(Some).collect(),
                scenario: point.scenario,
            })
        });
        Self::of(study, points, None, stop)
    }

    /// Number of combinations of a study; each value of each axis is checked alone and its scenario shown to `watch`:
    /// [`Study::each_value`]. Takes time and memory for the values, not for the combinations. [`Plan::new`] finds
    /// errors that only two values together cause, before anything is run.
    ///
    /// # Errors
    /// As [`Plan::new`].
    ///
    /// ```
    /// use omni_config::Study;
    /// use omni_study::Plan;
    /// let mut looked_at = 0;
    /// assert_eq!(Plan::check(&Study::load("climb_map")?, |_| looked_at += 1)?, 4 * 4 * 5);
    /// assert_eq!(looked_at, 1 + 3 + 3 + 4);
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    pub fn check(study: &Study, mut watch: impl FnMut(&Scenario)) -> Result<usize, Error> {
        let combinations = study.each_point(&[])?.len();
        Self::check_size(study.file(), combinations, &study.seeds)?;
        let first_seed = study.seeds.list().first().copied().unwrap_or_default();
        let mut values: Vec<Vec<Option<Value>>> = vec![Vec::new(); study.axis.len()];
        let mut known = BTreeMap::new();
        for (p, point) in study.each_value(&[])?.enumerate() {
            let point = point?;
            let named = |values: &[Value]| study.named(values);
            AnyController::new(&point.scenario)
                .map_err(|error| refuse(study, &named(&point.values), error.to_string()))?;
            let leaves = leaves(&point.scenario, None)?;
            for (i, axis) in study.axis.iter().enumerate() {
                values[i].push(typed(Some(&point.values[i]), leaves.get(&axis.key)));
            }
            if let Some(twin) = known.insert(digest(&text(&leaves), first_seed), p) {
                let twin = study.each_value(&[])?.nth(twin).transpose()?;
                let twin = twin.map_or_else(Vec::new, |point| point.values);
                return Err(twins(study, "axis", &named(&twin), &named(&point.values)));
            }
            watch(&point.scenario);
        }
        columns(study, &values, &|key, message| refuse(study, key, message))?;
        Ok(combinations)
    }

    /// Can so many points be run with these seeds? To be asked before many are made; `file` is what
    /// messages call the study.
    ///
    /// # Errors
    /// The number of points or seeds, and the allowed number.
    pub fn check_size(file: &str, points: usize, seeds: &Seeds) -> Result<(), Error> {
        let seeds = seeds.list().len();
        let (key, message) = if seeds == 0 {
            ("seeds", "0, allowed: one or more".into())
        } else if points == 0 {
            ("points", "none, allowed: one or more".into())
        } else if points > Study::MOST_POINTS {
            (
                "points",
                format!("{points}, allowed: {} at most", Study::MOST_POINTS),
            )
        } else if points.saturating_mul(seeds) > MOST_RUNS {
            let message = format!("{seeds} for {points} combinations, allowed: {MOST_RUNS} runs at most");
            ("seeds", message)
        } else {
            return Ok(());
        };
        Err(Error::from(config::Error::Key {
            file: file.into(),
            key: key.into(),
            message,
        }))
    }

    /// The runs of scenarios that need not be a grid, each with the keys that were replaced to make it and every seed.
    ///
    /// Each key that is replaced in any of them is a column; where a scenario has it unreplaced, it
    /// holds that scenario's own value: of the vehicle its name, and nothing if there is none or another table. Keys
    /// and rows equal a study's with the same scenarios.
    ///
    /// # Errors
    /// Which of the scenarios, counted from 0, cannot be run, is there twice or has its seed replaced, in one line.
    ///
    /// ```
    /// use omni_config::{Override, Scenario, Seeds};
    /// use omni_study::Plan;
    /// let points = [("terrain.height_m", 0.03), ("terrain.friction", 0.5)].map(|(key, value)| {
    ///     let replaced = vec![Override::new(key, value)];
    ///     Scenario::load("step", &replaced).map(|scenario| (replaced, scenario))
    /// });
    /// let points = points.into_iter().collect::<Result<Vec<_>, _>>()?;
    /// let plan = Plan::of_scenarios("two", points, Seeds::Count(3))?;
    /// assert_eq!((plan.runs().len(), plan.columns().axes.len()), (6, 2));
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    pub fn of_scenarios(
        name: &str,
        points: Vec<(Vec<Override>, Scenario)>,
        seeds: Seeds,
    ) -> Result<Self, Error> {
        Self::of_scenarios_until(name, points, seeds, None, &AtomicBool::new(false))
    }

    /// [`Plan::of_scenarios`], until `stop` is set, perhaps with a controller of one's own: then
    /// `control.policy` is a column, with its name.
    ///
    /// # Errors
    /// As [`Plan::of_scenarios`]; [`Error::Stopped`].
    pub fn of_scenarios_until(
        name: &str,
        points: Vec<(Vec<Override>, Scenario)>,
        seeds: Seeds,
        own: Option<OwnPolicy>,
        stop: &AtomicBool,
    ) -> Result<Self, Error> {
        Self::check_size(name, points.len(), &seeds)?;
        let mut keys: Vec<String> = own.iter().map(|_| POLICY.into()).collect();
        for key in points
            .iter()
            .flat_map(|(replaced, _)| replaced)
            .map(Override::key)
        {
            if key == "seed" {
                return Err(Error::from(config::Error::Key {
                    file: name.into(),
                    key: "points".into(),
                    message: "\"seed\", allowed: any other key; set the seeds with `seeds`".into(),
                }));
            }
            if !keys.iter().any(|known| known == key) {
                keys.push(key.into());
            }
        }
        let scenario = points
            .first()
            .map_or_else(String::new, |(_, scenario)| scenario.name.clone());
        let mut planned = Vec::with_capacity(points.len());
        for (replaced, scenario) in points {
            going(stop)?;
            let leaves = leaves(&scenario, own.as_ref())?;
            let value = |key: &String| {
                let given = replaced.iter().filter(|_| own.is_none() || key != POLICY);
                let given = given.rev().find(|each| each.key() == key);
                let own = if key == "vehicle" { "vehicle.name" } else { key };
                given.map(Override::value).or_else(|| leaves.get(own)).cloned()
            };
            planned.push(Planned {
                values: keys.iter().map(value).collect(),
                scenario,
            });
        }
        let axes = keys.iter().enumerate().map(|(i, key)| {
            let mut values = Vec::new();
            for value in planned.iter().filter_map(|point| point.values[i].as_ref()) {
                if !values.contains(value) {
                    values.push(value.clone());
                }
            }
            Axis::new(key.as_str(), values)
        });
        let study = Study::of_points(name, scenario, axes.collect(), seeds)?;
        Self::of(&study, planned.into_iter().map(Ok), own, stop)
    }

    fn of(
        study: &Study,
        points: impl Iterator<Item = Result<Planned, Error>>,
        policy: Option<OwnPolicy>,
        stop: &AtomicBool,
    ) -> Result<Self, Error> {
        let named = |i: usize, values: &[Option<Value>]| {
            let given: Option<Vec<Value>> = values.iter().cloned().collect();
            match given {
                Some(values) if !study.lists_points() && !values.is_empty() => study.named(&values),
                _ => format!("points[{i}]"),
            }
        };
        let seeds = study.seeds.list();
        let mut values: Vec<Vec<Option<Value>>> = vec![Vec::new(); study.axis.len()];
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        // Of each point no more is kept than its runs need: there may be many.
        let mut kept: Vec<(Vec<String>, Arc<Scenario>)> = Vec::new();
        let mut given: Vec<Vec<Option<Value>>> = Vec::new();
        let (mut first, mut derives) = (BTreeMap::new(), false);
        for (p, point) in points.enumerate() {
            going(stop)?;
            let Planned {
                values: own,
                scenario,
            } = point?;
            AnyController::new(&scenario)
                .map_err(|error| refuse(study, &named(p, &own), error.to_string()))?;
            let leaves = leaves(&scenario, policy.as_ref())?;
            for (i, axis) in study.axis.iter().enumerate() {
                values[i].push(typed(own[i].as_ref(), leaves.get(&axis.key)));
            }
            let text = text(&leaves);
            let keys: Vec<String> = seeds.iter().map(|seed| digest(&text, *seed)).collect();
            if let Some(twin) = keys.first().and_then(|key| known.insert(key.clone(), p)) {
                let key = if study.lists_points() { "points" } else { "axis" };
                return Err(twins(study, key, &named(twin, &given[twin]), &named(p, &own)));
            }
            // Gains that are not given follow what is, and with it the axes.
            derives |= scenario.derived_gains().is_some();
            if p == 0 {
                first = leaves;
            }
            given.push(own);
            kept.push((keys, Arc::new(scenario)));
        }
        let columns = Arc::new(columns(study, &values, &|key, message| {
            refuse(study, key, message)
        })?);
        let mut runs = Vec::with_capacity(kept.len() * seeds.len());
        for (p, (keys, scenario)) in kept.into_iter().enumerate() {
            let axes: Arc<[Cell]> = (0..study.axis.len())
                .map(|i| match &values[i][p] {
                    Some(value) => fitting(Cell::from(value), columns.axes[i].kind),
                    None => Cell::Missing,
                })
                .collect();
            runs.extend(keys.into_iter().zip(&seeds).map(|(key, seed)| Run {
                key,
                seed: *seed,
                axes: axes.clone(),
                columns: columns.clone(),
                scenario: scenario.clone(),
                own: policy.clone(),
            }));
        }
        let varies = |key: &str| {
            if derives && key.starts_with("vehicle.gains.") {
                return true;
            }
            let of = |axis: &Axis| {
                key.strip_prefix(&axis.key)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            study.axis.iter().any(of)
        };
        Ok(Self {
            study: study.clone(),
            columns,
            runs,
            shared: lines(&first)
                .filter(|(key, _)| !varies(key))
                .map(|(key, value)| (key, short(value)))
                .collect(),
            own: policy,
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

    /// The user's own controller of its runs, if they have one.
    #[must_use]
    pub fn own_policy(&self) -> Option<&OwnPolicy> {
        self.own.as_ref()
    }

    /// What all its runs share: the scenario without axes and seed.
    pub(crate) fn shared(&self) -> &Lines {
        &self.shared
    }
}

pub(crate) fn refuse(study: &Study, key: &str, message: String) -> Error {
    Error::from(config::Error::Key {
        file: study.file().into(),
        key: key.into(),
        message,
    })
}

fn twins(study: &Study, key: &str, one: &str, other: &str) -> Error {
    refuse(
        study,
        key,
        format!("{one} and {other} are the same run, allowed: each run once"),
    )
}

/// Is it still wanted?
fn going(stop: &AtomicBool) -> Result<(), Error> {
    if stop.load(Ordering::Relaxed) {
        return Err(Error::Stopped);
    }
    Ok(())
}

/// A value of an axis as the scenario holds it: 1 is 1.0 if a number with a fraction is meant. Names stay names.
fn typed(given: Option<&Value>, held: Option<&Value>) -> Option<Value> {
    match (given, held) {
        (Some(Value::Integer(_)), Some(held @ Value::Float(_))) => Some(held.clone()),
        _ => given.cloned(),
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
