//! From a study to its scenarios, each checked; an error names the axis that it came from.

use std::path::Path;

use toml::Value;

use super::Study;
use crate::builtin::VEHICLES;
use crate::command_file::CommandFile;
use crate::height_map::HeightMap;
use crate::load::Source;
use crate::override_key::{Override, dotted};
use crate::suggestion::did_you_mean;
use crate::{Error, Scenario};

/// A combination of the axes' values, and the scenario it makes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Point {
    /// The value of each axis, in the axes' order.
    pub values: Vec<Value>,
    /// The scenario, checked; each run uses another seed.
    pub scenario: Scenario,
}

impl Study {
    /// Every combination of the axes' values, the last axis fastest, with some more keys replaced.
    ///
    /// # Errors
    /// The first error, in one line that names the study's file, the axis, the value and the allowed range.
    ///
    /// ```
    /// use omni_config::{Source, Study};
    /// let text = "schema_version = 1\nname = 'slip'\nscenario = 'step'\nseeds = 3\n
    ///     [[axis]]\nkey = 'terrain.friction'\nvalues = [0.5, -1.0]";
    /// let error = Study::from_source(&Source::text("slip.toml", text))?.points(&[]).unwrap_err();
    /// assert_eq!(error.to_string(), "slip.toml: axis[0]: terrain.friction = -1.0: -1, allowed: 0 to 2");
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn points(&self, overrides: &[Override]) -> Result<Vec<Point>, Error> {
        self.each_point(overrides)?.collect()
    }

    /// [`Study::points`] one by one, each made when it is asked for.
    ///
    /// # Errors
    /// As [`Study::points`], here what is wrong with all of them.
    pub fn each_point<'a>(
        &'a self,
        overrides: &'a [Override],
    ) -> Result<impl ExactSizeIterator<Item = Result<Point, Error>> + 'a, Error> {
        let grid = self.grid(overrides)?;
        Ok((0..grid.count).map(move |index| grid.point(combination(&grid.values, index))))
    }

    /// Each value of each axis once: the first combination, then every other value with the first
    /// ones of all other axes. As many points as there are values, where [`Study::each_point`] has
    /// as many as their product. All of them are points of the study: what is wrong with one is
    /// wrong with the study. Errors that only two values together cause are not found.
    ///
    /// ```
    /// let study = omni_config::Study::load("climb_map")?; // three axes of four and five values
    /// assert_eq!((study.each_value(&[])?.len(), study.each_point(&[])?.len()), (1 + 3 + 3 + 4, 4 * 4 * 5));
    /// assert_eq!(study.each_value(&[])?.next().transpose()?, study.each_point(&[])?.next().transpose()?);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Study::each_point`].
    pub fn each_value<'a>(
        &'a self,
        overrides: &'a [Override],
    ) -> Result<impl ExactSizeIterator<Item = Result<Point, Error>> + 'a, Error> {
        let grid = self.grid(overrides)?;
        let others: usize = grid.values.iter().map(|values| values.len() - 1).sum();
        Ok((0..others + 1).map(move |index| grid.point(single(&grid.values, index))))
    }

    fn grid<'a>(&'a self, overrides: &'a [Override]) -> Result<Grid<'a>, Error> {
        for each in overrides {
            if each.key() == "seed" {
                return Err(Error::Override {
                    text: each.to_string(),
                    message: "allowed: any other key; set the seeds with `seeds`, or --seeds".into(),
                });
            }
            if self.axis.iter().any(|axis| axis.key == each.key()) {
                return Err(Error::Override {
                    text: each.to_string(),
                    message: format!("is an axis of {}, allowed: any other key", self.origin.file),
                });
            }
        }
        let values: Vec<Vec<Value>> = self.axis.iter().map(super::Axis::values).collect();
        let count = values
            .iter()
            .try_fold(1_usize, |product, values| product.checked_mul(values.len()))
            .filter(|count| *count <= Self::MOST_POINTS);
        let Some(count) = count else {
            let message = format!("too many combinations, allowed: {} at most", Self::MOST_POINTS);
            return Err(self.refuse("axis", message));
        };
        Ok(Grid {
            study: self,
            overrides,
            source: self.scenario_source()?,
            settings: self.settings(),
            values,
            count,
        })
    }

    fn scenario_source(&self) -> Result<Source, Error> {
        Source::scenario_in(&self.scenario, self.origin.folder.as_deref()).map_err(|error| match error {
            Error::UnknownName { name, known, .. } => {
                let meant = did_you_mean(&name, known.split(", "));
                self.refuse("scenario", format!("{name:?}{meant}, allowed: {known}"))
            }
            other => other,
        })
    }

    /// An override; a path in it, relative to the study's file, made absolute.
    fn located(&self, key: &str, value: &Value) -> Override {
        let mut value = value.clone();
        for path_key in ["vehicle", "terrain.image", "command.file"] {
            if let (Some(folder), Some(Value::String(name))) =
                (&self.origin.folder, part(key, &mut value, path_key))
                && is_path(path_key, name, folder)
                && let Ok(path) = std::path::absolute(folder.join(&*name))
            {
                *name = path.display().to_string();
            }
        }
        Override::new(key, value)
    }

    /// The error of a combination, attributed to its axis or setting.
    fn explained(
        &self,
        error: Error,
        settings: &[Override],
        overrides: &[Override],
        chosen: &[Value],
    ) -> Error {
        let Error::Key { key, message, .. } = &error else {
            return self.of_combination(&error, chosen);
        };
        let key = dotted(key);
        let best = |keys: &mut dyn Iterator<Item = &str>| {
            keys.enumerate()
                .map(|(i, own)| (shared(own, &key), i))
                .filter(|(length, _)| *length > 0)
                .max_by_key(|(length, i)| (*length, std::cmp::Reverse(*i)))
        };
        let axis = best(&mut self.axis.iter().map(|axis| axis.key.as_str()));
        let set = best(&mut settings.iter().map(Override::key));
        let flag = best(&mut overrides.iter().map(Override::key));
        match [axis, set, flag]
            .into_iter()
            .flatten()
            .max_by_key(|(length, _)| *length)
        {
            None => self.of_combination(&error, chosen),
            found if found == axis => {
                let i = axis.map_or(0, |(_, i)| i);
                let message = format!("{} = {}: {message}", self.axis[i].key, chosen[i]);
                self.refuse(format!("axis[{i}]"), message)
            }
            found if found == set => {
                let i = set.map_or(0, |(_, i)| i);
                let message = format!("{} = {}: {message}", settings[i].key(), settings[i].value());
                self.refuse("set", message)
            }
            _ => error, // of --set, with the same message as elsewhere
        }
    }

    fn of_combination(&self, error: &Error, chosen: &[Value]) -> Error {
        self.refuse(
            if chosen.is_empty() {
                "scenario".into()
            } else {
                self.named(chosen)
            },
            error.to_string(),
        )
    }

    /// `terrain.height_m = 0.03, control.policy = "scale_torques"`.
    #[must_use]
    pub fn named(&self, values: &[Value]) -> String {
        let pairs = self.axis.iter().zip(values);
        let pairs: Vec<_> = pairs
            .map(|(axis, value)| format!("{} = {value}", axis.key))
            .collect();
        pairs.join(", ")
    }
}

/// The common part of all points of a study.
struct Grid<'a> {
    study: &'a Study,
    overrides: &'a [Override],
    source: Source,
    settings: Vec<Override>,
    /// Of each axis, one or more.
    values: Vec<Vec<Value>>,
    /// Of combinations.
    count: usize,
}

impl Grid<'_> {
    fn point(&self, chosen: Vec<Value>) -> Result<Point, Error> {
        let Self {
            study,
            overrides,
            settings,
            ..
        } = self;
        let own = settings.iter().map(|set| study.located(set.key(), set.value()));
        let varied = study.axis.iter().zip(&chosen);
        let varied = varied.map(|(axis, value)| study.located(&axis.key, value));
        let all: Vec<_> = own.chain(overrides.iter().cloned()).chain(varied).collect();
        let scenario = Scenario::from_source(&self.source, &all)
            .map_err(|error| study.explained(error, settings, overrides, &chosen))?;
        Ok(Point {
            values: chosen,
            scenario,
        })
    }
}

/// Is the text of this key a path, and neither a built-in name nor the thing itself? A name without
/// the ending of a vehicle's file is one where the folder has it.
fn is_path(key: &str, name: &str, folder: &Path) -> bool {
    match key {
        "terrain.image" => HeightMap::is_path(name),
        "command.file" => CommandFile::is_path(name),
        _ => {
            !VEHICLES.iter().any(|(known, _)| *known == name)
                && (name.ends_with(".toml") || folder.join(name).is_file())
        }
    }
}

/// What a value for `key` puts at the key `wanted`, if anything.
fn part<'a>(key: &str, value: &'a mut Value, wanted: &str) -> Option<&'a mut Value> {
    match wanted.strip_prefix(key)? {
        "" => Some(value),
        inside => value.get_mut(inside.strip_prefix('.')?),
    }
}

/// The first value of each axis, but for the one that has that index among all the others of all
/// axes; 0 is none of them.
fn single(values: &[Vec<Value>], index: usize) -> Vec<Value> {
    let mut others = index;
    let chosen = values.iter().map(|values| {
        let here = if others < values.len() { others } else { 0 };
        others = others.saturating_sub(values.len() - 1);
        values[here].clone()
    });
    chosen.collect()
}

/// The combination of that index, the last axis fastest.
fn combination(values: &[Vec<Value>], mut index: usize) -> Vec<Value> {
    let mut chosen: Vec<Value> = values
        .iter()
        .rev()
        .map(|values| {
            let value = values[index % values.len()].clone();
            index /= values.len();
            value
        })
        .collect();
    chosen.reverse();
    chosen
}

/// How much of a key that is rejected is this key's: its length where one is the other or within it, with `vehicle.` or
/// without, as messages about vehicles are; 0 otherwise.
fn shared(own: &str, refused: &str) -> usize {
    let within = |a: &str, b: &str| {
        b.strip_prefix(a)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    [own, own.strip_prefix("vehicle.").unwrap_or(own)]
        .into_iter()
        .filter(|own| within(own, refused) || within(refused, own))
        .map(|own| own.len().min(refused.len()))
        .max()
        .unwrap_or(0)
}
