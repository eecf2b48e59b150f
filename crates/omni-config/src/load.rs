//! From a name, a path or a text to a checked value.

use std::path::{Path, PathBuf};

use garde::Validate;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::file_kind::FileKind;
use crate::regular_file::{MOST_TOML_BYTES, read_regular};
use crate::suggestion::with_nearest;
use crate::tagged::INNER_KEY;
use crate::{Error, SCHEMA_VERSION};

/// Built-in files by name, in the order they are listed.
pub(crate) type Builtin = &'static [(&'static str, &'static str)];

pub(crate) const VEHICLES: Builtin = &[
    ("chugo7", include_str!("../assets/vehicles/chugo7.toml")),
    ("omni3", include_str!("../assets/vehicles/omni3.toml")),
    ("mecanum4", include_str!("../assets/vehicles/mecanum4.toml")),
    (
        "rocker_bogie6",
        include_str!("../assets/vehicles/rocker_bogie6.toml"),
    ),
];
pub(crate) const SCENARIOS: Builtin = &[
    ("step", include_str!("../assets/scenarios/step.toml")),
    ("flat", include_str!("../assets/scenarios/flat.toml")),
    ("step_down", include_str!("../assets/scenarios/step_down.toml")),
    ("stairs", include_str!("../assets/scenarios/stairs.toml")),
    ("ramp", include_str!("../assets/scenarios/ramp.toml")),
    ("half_step", include_str!("../assets/scenarios/half_step.toml")),
    ("ditch", include_str!("../assets/scenarios/ditch.toml")),
    ("bumps", include_str!("../assets/scenarios/bumps.toml")),
    ("rough", include_str!("../assets/scenarios/rough.toml")),
    ("height_map", include_str!("../assets/scenarios/height_map.toml")),
    ("ice", include_str!("../assets/scenarios/ice.toml")),
];
pub(crate) const EXPERIMENTS: Builtin = &[("wheels", include_str!("../assets/scenarios/wheels.toml"))];

pub(crate) const STUDIES: Builtin = &[
    ("climb_map", include_str!("../assets/studies/climb_map.toml")),
    ("ensemble", include_str!("../assets/studies/ensemble.toml")),
    (
        "wheel_models",
        include_str!("../assets/studies/wheel_models.toml"),
    ),
];

impl FileKind {
    /// What messages call built-in things of this kind, and what there is.
    fn builtin(self) -> (&'static str, Builtin) {
        match self {
            Self::Vehicle => ("vehicle", VEHICLES),
            Self::Scenario => ("scenario", SCENARIOS),
            Self::Experiment => ("wheels experiment", EXPERIMENTS),
            Self::Study => ("study", STUDIES),
        }
    }

    /// The built-in text of that name: what a file of one's own starts from.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    ///
    /// ```
    /// let text = omni_config::FileKind::Vehicle.template("omni3")?;
    /// assert!(text.starts_with("# Three omni wheels") && text.contains("name = \"omni3\""));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn template(self, name: &str) -> Result<&'static str, Error> {
        let (kind, builtin) = self.builtin();
        let found = builtin.iter().find(|(known, _)| *known == name);
        found.map(|(_, text)| *text).ok_or_else(|| Error::UnknownName {
            kind,
            name: name.into(),
            known: builtin
                .iter()
                .map(|(name, _)| *name)
                .collect::<Vec<_>>()
                .join(", "),
        })
    }
}

/// The kind that has a built-in thing of this name.
fn kind_of_builtin(name: &str) -> Option<FileKind> {
    use FileKind::{Experiment, Scenario, Study, Vehicle};
    let has = |kind: &FileKind| kind.builtin().1.iter().any(|(known, _)| *known == name);
    [Scenario, Vehicle, Study, Experiment].into_iter().find(has)
}

/// Names of the built-in vehicles.
#[must_use]
pub fn builtin_vehicles() -> Vec<&'static str> {
    VEHICLES.iter().map(|(name, _)| *name).collect()
}

/// Names of the built-in scenarios.
#[must_use]
pub fn builtin_scenarios() -> Vec<&'static str> {
    SCENARIOS.iter().map(|(name, _)| *name).collect()
}

/// Names of the built-in studies.
#[must_use]
pub fn builtin_studies() -> Vec<&'static str> {
    STUDIES.iter().map(|(name, _)| *name).collect()
}

/// A text and where it came from.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file, or `built-in NAME`: what messages call it.
    pub file: String,
    /// The TOML text.
    pub text: String,
    /// Folder that relative names inside are relative to.
    folder: Option<PathBuf>,
    /// May it name vehicles and pictures?
    refers: bool,
}

impl Source {
    /// A vehicle by built-in name or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`] or [`Error::Io`].
    pub fn vehicle(name: &str, relative_to: Option<&Path>) -> Result<Self, Error> {
        Self::find("vehicle", FileKind::Vehicle, VEHICLES, name, relative_to)
    }

    /// A scenario by built-in name or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`] or [`Error::Io`].
    pub fn scenario(name: &str) -> Result<Self, Error> {
        Self::scenario_in(name, None)
    }

    pub(crate) fn scenario_in(name: &str, relative_to: Option<&Path>) -> Result<Self, Error> {
        Self::find("scenario", FileKind::Scenario, SCENARIOS, name, relative_to)
    }

    /// A study by built-in name or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`] or [`Error::Io`].
    pub fn study(name: &str) -> Result<Self, Error> {
        Self::find("study", FileKind::Study, STUDIES, name, None)
    }

    /// The experiment of section 3.3 by built-in name (`wheels`) or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`] or [`Error::Io`].
    pub fn wheels(name: &str) -> Result<Self, Error> {
        Self::find("wheels experiment", FileKind::Experiment, EXPERIMENTS, name, None)
    }

    /// A text that messages call `file`.
    #[must_use]
    pub fn text(file: impl Into<String>, text: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            text: text.into(),
            folder: None,
            refers: true,
        }
    }

    /// A text out of a log, a pickle or a message: whoever made it does not say which files of this machine are read. A vehicle
    /// or a picture that it names, built-in or not, is refused: what we write holds both.
    ///
    /// ```
    /// use omni_config::{Scenario, Source};
    /// let text = Scenario::load("step", &[])?.to_toml()?;
    /// assert!(Scenario::from_source(&Source::embedded("log", &*text), &[]).is_ok());
    /// let error = Scenario::from_source(&Source::embedded("log", "schema_version = 1\nvehicle = '/etc/v.toml'"), &[]);
    /// assert_eq!(
    ///     error.unwrap_err().to_string(),
    ///     "log: vehicle: \"/etc/v.toml\", allowed: the vehicle itself: a scenario in a log or a pickle names no other file"
    /// );
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn embedded(file: impl Into<String>, text: impl Into<String>) -> Self {
        Self {
            refers: false,
            ..Self::text(file, text)
        }
    }

    /// What it names, `itself` in words, under this key: refused where it may name nothing.
    pub(crate) fn check_reference(&self, key: &str, name: &str, itself: &str) -> Result<(), Error> {
        if self.refers {
            return Ok(());
        }
        let message = format!(
            "{name:?}, allowed: {itself} itself: a scenario in a log or a pickle names no other file"
        );
        Err(self.refuse(key, message))
    }

    /// The file it was read from, if any.
    pub(crate) fn path(&self) -> Option<PathBuf> {
        self.folder.is_some().then(|| PathBuf::from(&self.file))
    }

    pub(crate) fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// The file at a path.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn file(path: impl Into<PathBuf>) -> Result<Self, Error> {
        Self::read(path.into())
    }

    fn read(path: PathBuf) -> Result<Self, Error> {
        let bytes = read_regular(&path, MOST_TOML_BYTES).map_err(|source| Error::Io {
            path: path.clone(),
            source,
        })?;
        let file = path.display().to_string();
        let text = crate::encoding::text(bytes, &file).map_err(|reason| Error::NotText {
            file: file.clone(),
            reason,
        })?;
        Ok(Self {
            file,
            text,
            folder: path.parent().map(Path::to_path_buf),
            refers: true,
        })
    }

    fn find(
        kind: &'static str,
        wanted: FileKind,
        builtin: Builtin,
        name: &str,
        relative_to: Option<&Path>,
    ) -> Result<Self, Error> {
        if let Some((_, text)) = builtin.iter().find(|(known, _)| *known == name) {
            return Ok(Self::text(format!("built-in {name}"), *text));
        }
        let path = relative_to.map_or_else(|| PathBuf::from(name), |folder| folder.join(name));
        // Whatever is there: a directory or a device is refused as such.
        if path.exists() || name.ends_with(".toml") {
            return Self::read(path);
        }
        if let Some(found) = kind_of_builtin(name) {
            return Err(Error::OtherKind {
                file: name.into(),
                found,
                wanted,
                command: "run",
            });
        }
        let known = builtin
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>()
            .join(", ");
        Err(Error::UnknownName {
            kind,
            name: name.into(),
            known: format!("{known}, or the path of a .toml file"),
        })
    }

    /// The text as a table of keys.
    pub(crate) fn table(&self) -> Result<Table, Error> {
        self.text.parse().map_err(|error: toml::de::Error| {
            let start = error.span().map_or(0, |span| span.start.min(self.text.len()));
            let line = 1 + self.text.bytes().take(start).filter(|b| *b == b'\n').count();
            Error::Syntax {
                file: self.file.clone(),
                line,
                message: one_line(error.message()),
            }
        })
    }

    /// Refuses a table that clearly describes something else.
    pub(crate) fn expect(&self, wanted: FileKind, table: &Table) -> Result<(), Error> {
        match FileKind::of(table) {
            Some(found) if found != wanted => Err(Error::OtherKind {
                file: self.file.clone(),
                found,
                wanted,
                command: "run",
            }),
            _ => Ok(()),
        }
    }

    pub(crate) fn refuse(&self, key: impl Into<String>, message: impl Into<String>) -> Error {
        Error::Key {
            file: self.file.clone(),
            key: key.into(),
            message: message.into(),
        }
    }
}

/// Comes before everything else: what the keys of another version mean is not for this program to say.
pub(crate) fn check_version(source: &Source, table: &Table) -> Result<(), Error> {
    let reads = i64::from(SCHEMA_VERSION);
    let message = match table.get("schema_version") {
        Some(Value::Integer(found)) if *found == reads => return Ok(()),
        Some(Value::Integer(found)) if *found > reads => {
            format!("{found}, this program reads version {reads}: update omnistep")
        }
        Some(Value::Integer(found)) => {
            format!("{found}, the first version is {reads}: write schema_version = {reads}")
        }
        Some(other) => format!("{other}, allowed: a whole number: write schema_version = {reads}"),
        None => format!("missing: write schema_version = {reads} at the top of the file"),
    };
    Err(source.refuse("schema_version", message))
}

/// The value that a table describes, every range checked.
pub(crate) fn read<T: DeserializeOwned + Validate<Context = ()>>(
    source: &Source,
    table: Table,
) -> Result<T, Error> {
    check_version(source, &table)?;
    let value: T = serde_path_to_error::deserialize(Value::Table(table)).map_err(|error| {
        let path = error.path().to_string();
        let message = with_nearest_inside(one_line(error.inner().message()));
        let inside = message
            .strip_prefix(INNER_KEY)
            .and_then(|rest| rest.split_once(INNER_KEY));
        match inside {
            Some((inner, message)) => source.refuse(format!("{path}.{inner}"), message),
            None if path == "." => source.refuse("top level", message),
            None => source.refuse(path, message),
        }
    })?;
    value.validate().map_err(|report| {
        let mut lines = report
            .iter()
            // garde counts what is inside a kind of contact; in the file it is the same table.
            .map(|(path, error)| {
                (
                    path.to_string().replace(".contact[0]", ".contact"),
                    error.to_string(),
                )
            });
        let (key, message) = lines.next().unwrap_or_default();
        let more = lines.count();
        let more = if more == 0 {
            String::new()
        } else {
            format!(" (and {more} more)")
        };
        source.refuse(key, format!("{message}{more}"))
    })?;
    Ok(value)
}

/// [`with_nearest`], also where the message is about a key of a table inside.
fn with_nearest_inside(message: String) -> String {
    match message
        .strip_prefix(INNER_KEY)
        .and_then(|rest| rest.split_once(INNER_KEY))
    {
        Some((key, inner)) => format!("{INNER_KEY}{key}{INNER_KEY}{}", with_nearest(inner.into())),
        None => with_nearest(message),
    }
}

/// `wheel[2].radius_m`, as messages write it, as `wheel.2.radius_m`.
pub(crate) fn dotted(key: &str) -> String {
    key.replace('[', ".").replace(']', "")
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A key of a scenario or, behind `vehicle.`, of its vehicle, and the value to put there: `terrain.friction=0.5`,
/// `vehicle.motor.stall_torque_n_m=1`, `vehicle.wheel[0].radius_m=0.07` or `vehicle.wheel.0.radius_m` (elements count from 0).
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    key: String,
    value: Value,
}

impl Override {
    /// `value` for `key`.
    pub fn new(key: impl Into<String>, value: impl Into<Value>) -> Self {
        Self {
            key: dotted(&key.into()),
            value: value.into(),
        }
    }

    /// `key=value`, the value as in TOML; a bare word is a string.
    ///
    /// # Errors
    /// [`Error::Override`] where there is no `=` or no key.
    ///
    /// ```
    /// use omni_config::Override;
    /// assert_eq!(Override::parse("terrain.friction=0.5")?, Override::new("terrain.friction", 0.5));
    /// assert_eq!(Override::parse("control.policy=paper")?, Override::new("control.policy", "paper"));
    /// assert!(Override::parse("friction").is_err());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, Error> {
        let malformed = |message: &str| Error::Override {
            text: text.into(),
            message: message.into(),
        };
        let (key, value) = text
            .split_once('=')
            .ok_or_else(|| malformed("allowed: KEY=VALUE"))?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() {
            return Err(malformed("allowed: KEY=VALUE with a key"));
        }
        let parsed = format!("value = {value}")
            .parse::<Table>()
            .ok()
            .and_then(|mut table| table.remove("value"));
        Ok(Self {
            key: dotted(key),
            value: parsed.unwrap_or_else(|| Value::String(value.into())),
        })
    }

    /// The key, elements of lists as `wheel.0`.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// The value to put there.
    #[must_use]
    pub fn value(&self) -> &Value {
        &self.value
    }

    /// The override without its leading `vehicle.`, if it has one and is not the vehicle's name itself.
    pub(crate) fn of_vehicle(&self) -> Option<Self> {
        self.key.strip_prefix("vehicle.").map(|key| Self {
            key: key.into(),
            value: self.value.clone(),
        })
    }

    /// Puts the value in its place. An unknown key is put there too: reading the table then names it.
    pub(crate) fn apply(&self, source: &Source, table: &mut Table) -> Result<(), Error> {
        let (parents, last) = self
            .key
            .rsplit_once('.')
            .map_or((None, self.key.as_str()), |(p, l)| (Some(p), l));
        let refuse = |reason: String| source.refuse(self.key.clone(), reason);
        let mut here: Option<&mut Value> = None;
        for part in parents.into_iter().flat_map(|p| p.split('.')) {
            here = Some(match here {
                None => table.entry(part).or_insert_with(|| Value::Table(Table::new())),
                Some(value) => child(value, part).map_err(refuse)?,
            });
        }
        match here {
            None => {
                table.insert(last.into(), self.value.clone());
            }
            Some(Value::Table(inner)) => {
                inner.insert(last.into(), self.value.clone());
            }
            Some(value) => *child(value, last).map_err(refuse)? = self.value.clone(),
        }
        Ok(())
    }
}

impl std::fmt::Display for Override {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.value {
            Value::String(text) => write!(f, "{}={text}", self.key),
            value => write!(f, "{}={value}", self.key),
        }
    }
}

fn child<'a>(value: &'a mut Value, part: &str) -> Result<&'a mut Value, String> {
    match value {
        Value::Table(table) => Ok(table.entry(part).or_insert_with(|| Value::Table(Table::new()))),
        Value::Array(items) => {
            let length = items.len();
            let index = part.parse::<usize>().ok().filter(|i| *i < length);
            index
                .and_then(|i| items.get_mut(i))
                .ok_or_else(|| format!("element {part:?}, allowed: 0 to {}", length.saturating_sub(1)))
        }
        _ => Err(format!(
            "{part:?} is inside a plain value; allowed: a key of a table"
        )),
    }
}
