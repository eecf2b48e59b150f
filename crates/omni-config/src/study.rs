//! A study file: a scenario, axes of keys and values, seeds; every combination is a run.

mod points;
mod seeds;

use std::path::PathBuf;

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::Error;
use crate::file_kind::FileKind;
use crate::load::{Source, read};
use crate::override_key::{Override, dotted, too_long};
#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{self, AXIS_COUNT, is_name};
use crate::suggestion::did_you_mean;
pub use points::Point;
pub use seeds::Seeds;

/// A study file: a grid of scenarios, each run with every seed.
///
/// ```
/// use omni_config::Study;
/// let study = Study::load("climb_map")?;
/// assert_eq!(study.axis[1].values(), [0.03, 0.04, 0.05, 0.06].map(toml::Value::from));
/// assert_eq!((study.points(&[])?.len(), study.seeds.list().len()), (4 * 4 * 5, 5));
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Version of the file format; always 1.
    #[garde(skip)] // checked before anything else is read
    #[cfg_attr(feature = "schema", schemars(range(min = crate::SCHEMA_VERSION, max = crate::SCHEMA_VERSION)))]
    pub schema_version: u32,
    /// Name of the folder of results.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// A built-in scenario, or a path relative to the study's file.
    #[garde(skip)] // checked when it is read
    pub scenario: String,
    /// Keys of the scenario that are replaced in every run: `"vehicle.motor.stall_torque_n_m" = 1.0`.
    /// An inner table replaces only the keys that it names.
    #[serde(default)]
    #[garde(skip)]
    #[cfg_attr(
        feature = "schema",
        schemars(with = "std::collections::BTreeMap<String, serde_json::Value>")
    )]
    pub set: Table,
    /// Keys that vary; every combination of their values is run.
    #[serde(default)]
    #[garde(dive)]
    pub axis: Vec<Axis>,
    /// Seeds that each combination is run with.
    #[garde(skip)] // checked when it is read
    pub seeds: Seeds,
    /// The map of the results.
    #[serde(default)]
    #[garde(dive)]
    pub map: MapAxes,
    /// Path of the log.
    #[serde(skip)]
    #[garde(skip)]
    origin: Origin,
}

/// Name of the file in messages, and the folder for relative names inside.
#[derive(Clone, Debug, Default, PartialEq)]
struct Origin {
    file: String,
    folder: Option<PathBuf>,
    points: bool,
}

/// A key of the scenario and its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// The key, as after `--set`: `terrain.friction`, `vehicle.motor.stall_torque_n_m`, `control.policy`, `vehicle`.
    #[garde(custom(is_key))]
    pub key: String,
    /// The values, one or more; or else `from`, `to` and `count`.
    #[garde(custom(one_way(self.range())))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<Vec<serde_json::Value>>"))]
    values: Option<Vec<Value>>,
    /// First of `count` evenly spaced values.
    #[garde(custom(is_finite))]
    from: Option<f64>,
    /// Last of them.
    #[garde(custom(is_finite))]
    to: Option<f64>,
    /// Number of values, 2 to 10000.
    #[serde(default, deserialize_with = "crate::integers::axis_count")]
    #[garde(adapt(ranges), range(min = AXIS_COUNT.min, max = AXIS_COUNT.max))]
    count: Option<u32>,
}

/// Axes of the map, and the metrics of the outcome that it shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct MapAxes {
    /// Key of the axis along the columns; the first axis by default.
    #[garde(skip)] // checked with the axes
    pub x: Option<String>,
    /// Key of the axis along the rows; the next axis by default. Without one, metrics are the rows.
    #[garde(skip)]
    pub y: Option<String>,
    /// Metrics of the outcome; `climbed` by default.
    #[garde(length(min = 1))]
    pub metrics: Vec<String>,
}

impl Default for MapAxes {
    fn default() -> Self {
        Self {
            x: None,
            y: None,
            metrics: vec!["climbed".into()],
        }
    }
}

fn is_key(key: &str, _: &()) -> garde::Result {
    match key {
        "" => Err(garde::Error::new("\"\", allowed: a key of the scenario")),
        "seed" => Err(garde::Error::new(
            "\"seed\", allowed: any other key; set the seeds with `seeds`",
        )),
        _ => too_long(&dotted(key)).map_or(Ok(()), |reason| Err(garde::Error::new(reason))),
    }
}

fn is_finite(value: &Option<f64>, _: &()) -> garde::Result {
    match value {
        Some(value) if !value.is_finite() => Err(garde::Error::new(format!("{value}, allowed: finite"))),
        _ => Ok(()),
    }
}

/// What is given of `from`, `to` and `count`.
enum Range {
    Nothing,
    Part,
    Whole { from: f64, to: f64, count: u32 },
}

fn one_way(range: Range) -> impl FnOnce(&Option<Vec<Value>>, &()) -> garde::Result {
    move |values, _| match (values, range) {
        (Some(values), Range::Nothing) if values.is_empty() => {
            Err(garde::Error::new("[], allowed: one value or more"))
        }
        (Some(_), Range::Nothing) | (None, Range::Whole { .. }) => Ok(()),
        _ => Err(garde::Error::new(
            "allowed: either `values`, or `from`, `to` and `count`",
        )),
    }
}

impl Axis {
    /// An axis of values.
    pub fn new(key: impl Into<String>, values: Vec<Value>) -> Self {
        Self {
            key: dotted(&key.into()),
            values: Some(values),
            from: None,
            to: None,
            count: None,
        }
    }

    fn range(&self) -> Range {
        match (self.from, self.to, self.count) {
            (None, None, None) => Range::Nothing,
            (Some(from), Some(to), Some(count)) => Range::Whole { from, to, count },
            _ => Range::Part,
        }
    }

    /// The values in order. Those of a range are rounded to 12 digits; they are integers if all of them are whole.
    #[must_use]
    pub fn values(&self) -> Vec<Value> {
        let Range::Whole { from, to, count } = self.range() else {
            return self.values.clone().unwrap_or_default();
        };
        let at = |k: u32| {
            let exact = from + (to - from) * f64::from(k) / f64::from(count.max(2) - 1);
            format!("{exact:.11e}").parse().unwrap_or(exact)
        };
        let all: Vec<f64> = (0..count).map(at).collect();
        // Whole numbers fit keys of either type.
        if all.iter().all(|v| v.fract() == 0.0 && v.abs() < 1e15) {
            all.into_iter().map(|v| Value::Integer(v as i64)).collect()
        } else {
            all.into_iter().map(Value::Float).collect()
        }
    }
}

impl Study {
    /// Combinations of a study at most: each is held in memory, checked.
    pub const MOST_POINTS: usize = 100_000;

    /// The built-in study or the file of that name.
    ///
    /// # Errors
    /// Its first error, in one line that names file, key, value and the allowed range. The scenarios are not read yet:
    /// [`Study::points`] does that.
    pub fn load(name: &str) -> Result<Self, Error> {
        Self::from_source(&Source::study(name)?)
    }

    /// The study that a source describes.
    ///
    /// # Errors
    /// As [`Study::load`].
    pub fn from_source(source: &Source) -> Result<Self, Error> {
        let table = source.table()?;
        source.expect(FileKind::Study, &table)?;
        let mut study: Self = read(source, table)?;
        study.origin = Origin {
            file: source.file.clone(),
            folder: source.folder().map(PathBuf::from),
            points: false,
        };
        for axis in &mut study.axis {
            axis.key = dotted(&axis.key);
        }
        let settings = study.settings();
        if settings.iter().any(|set| set.key() == "seed") {
            return Err(source.refuse("set.seed", "allowed: any other key; set the seeds with `seeds`"));
        }
        for (i, axis) in study.axis.iter().enumerate() {
            if study.axis[..i].iter().any(|other| other.key == axis.key) {
                return Err(source.refuse(format!("axis[{i}].key"), format!("{:?} twice", axis.key)));
            }
            if settings.iter().any(|set| set.key() == axis.key) {
                let message = "is also an axis, allowed: one of the two";
                return Err(source.refuse(format!("set.{}", axis.key), message));
            }
        }
        for (name, key) in [("map.x", &mut study.map.x), ("map.y", &mut study.map.y)] {
            let Some(key) = key else { continue };
            *key = dotted(key);
            if !study.axis.iter().any(|axis| axis.key == *key) {
                let known: Vec<_> = study.axis.iter().map(|axis| axis.key.as_str()).collect();
                let meant = did_you_mean(key, known.iter().copied());
                return Err(source.refuse(name, format!("{key:?}{meant}, allowed: {}", known.join(", "))));
            }
        }
        if study.map.x.is_some() && study.map.x == study.map.y {
            return Err(source.refuse("map.y", "allowed: another axis than map.x"));
        }
        Ok(study)
    }

    /// A study of points that a program lists; `axis` lists the keys that differ and the values that occur.
    ///
    /// # Errors
    /// A name that no folder can have, or a key that is no axis', such as `seed`.
    ///
    /// ```
    /// use omni_config::{Axis, Seeds, Study};
    /// let axis = Axis::new("terrain.height_m", vec![0.03.into(), 0.05.into()]);
    /// let study = Study::of_points("heights", "step", vec![axis], Seeds::Count(3))?;
    /// assert_eq!((study.lists_points(), study.seeds.list()), (true, vec![0, 1, 2]));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn of_points(
        name: impl Into<String>,
        scenario: impl Into<String>,
        axis: Vec<Axis>,
        seeds: Seeds,
    ) -> Result<Self, Error> {
        let name = name.into();
        let study = Self {
            schema_version: crate::SCHEMA_VERSION,
            origin: Origin {
                file: name.clone(),
                folder: None,
                points: true,
            },
            name,
            scenario: scenario.into(),
            set: Table::new(),
            axis,
            seeds,
            map: MapAxes::default(),
        };
        study.validate().map_err(|report| {
            let (key, message) = report
                .iter()
                .next()
                .map_or_else(Default::default, |(path, error)| {
                    (path.to_string(), error.to_string())
                });
            study.refuse(key, message)
        })?;
        Ok(study)
    }

    /// Whether a program lists its points ([`Study::of_points`]). They need not be every combination of the axes'
    /// values.
    #[must_use]
    pub fn lists_points(&self) -> bool {
        self.origin.points
    }

    /// The axes along the map's columns and rows, as indices into `axis`.
    ///
    /// ```
    /// let study = omni_config::Study::load("climb_map")?;
    /// assert_eq!(study.map_axes(), (Some(0), Some(1)));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn map_axes(&self) -> (Option<usize>, Option<usize>) {
        let find = |key: &Option<String>| {
            key.as_ref()
                .and_then(|key| self.axis.iter().position(|axis| axis.key == *key))
        };
        let other = |than: Option<usize>| (0..self.axis.len()).find(|i| Some(*i) != than);
        let (x, y) = (find(&self.map.x), find(&self.map.y));
        let x = x.or_else(|| other(y));
        (x, y.or_else(|| other(x)))
    }

    /// Name of the file in messages.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.origin.file
    }

    /// The overrides of `set`, with inner tables flattened.
    fn settings(&self) -> Vec<Override> {
        Override::all_of(&self.set)
    }

    fn refuse(&self, key: impl Into<String>, message: impl Into<String>) -> Error {
        Error::Key {
            file: self.origin.file.clone(),
            key: key.into(),
            message: message.into(),
        }
    }
}
