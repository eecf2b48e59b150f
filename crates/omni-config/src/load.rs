//! Loading: from a name, a path or a text to a checked value.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use garde::Validate;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::builtin::{Builtin, EXPERIMENTS, SCENARIOS, STUDIES, VEHICLES, kind_of_builtin};
use crate::file_kind::FileKind;
use crate::kind_tables::INNER_KEY;
use crate::missing_keys::others_missing;
use crate::regular_file::{MOST_TOML_BYTES, read_regular};
use crate::suggestion::{did_you_mean_file, with_nearest};
use crate::{Error, SCHEMA_VERSION};

/// A text and where it came from.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file, or `built-in NAME`, as in messages.
    pub file: String,
    /// The TOML text.
    pub text: String,
    /// Folder that relative names inside are relative to.
    folder: Option<PathBuf>,
    /// Whether it may name vehicles and pictures.
    refers: bool,
}

impl Source {
    /// A vehicle by built-in name or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`], [`Error::Missing`] or [`Error::Io`].
    pub fn vehicle(name: &str, relative_to: Option<&Path>) -> Result<Self, Error> {
        Self::find("vehicle", FileKind::Vehicle, VEHICLES, name, relative_to)
    }

    /// A scenario by built-in name or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`], [`Error::Missing`] or [`Error::Io`].
    pub fn scenario(name: &str) -> Result<Self, Error> {
        Self::scenario_in(name, None)
    }

    pub(crate) fn scenario_in(name: &str, relative_to: Option<&Path>) -> Result<Self, Error> {
        Self::find("scenario", FileKind::Scenario, SCENARIOS, name, relative_to)
    }

    /// A study by built-in name or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`], [`Error::Missing`] or [`Error::Io`].
    pub fn study(name: &str) -> Result<Self, Error> {
        Self::find("study", FileKind::Study, STUDIES, name, None)
    }

    /// The experiment of section 3.3 by built-in name (`motor_bench`) or path.
    ///
    /// # Errors
    /// [`Error::UnknownName`], [`Error::Missing`] or [`Error::Io`].
    pub fn wheels(name: &str) -> Result<Self, Error> {
        Self::find(
            "motor bench experiment",
            FileKind::Experiment,
            EXPERIMENTS,
            name,
            None,
        )
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

    /// A text out of a log, a pickle or a message: its author does not choose which files of this machine are
    /// read. A vehicle or a picture that it names, built-in or not, is rejected: what we write holds both.
    ///
    /// ```
    /// use omni_config::{Scenario, Source};
    /// let text = Scenario::load("step", &[])?.to_toml()?;
    /// assert!(Scenario::from_source(&Source::embedded("log", &*text), &[]).is_ok());
    /// let error = Scenario::from_source(&Source::embedded("log", "schema_version = 1\nvehicle = '/etc/v.toml'"), &[]);
    /// assert_eq!(
    ///     error.unwrap_err().to_string(),
    ///     "log: vehicle: \"/etc/v.toml\", allowed: the vehicle itself: a scenario in a log or a pickle cannot name another file"
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

    /// Checks a reference under this key, `itself` in words: rejected if this source may name nothing.
    pub(crate) fn check_reference(&self, key: &str, name: &str, itself: &str) -> Result<(), Error> {
        if self.refers {
            return Ok(());
        }
        let message = format!(
            "{name:?}, allowed: {itself} itself: a scenario in a log or a pickle cannot name another file"
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
    /// [`Error::Missing`] or [`Error::Io`].
    pub fn file(path: impl Into<PathBuf>) -> Result<Self, Error> {
        Self::read(path.into(), &[])
    }

    /// What is built in by a name, else the file at a path, of whatever kind.
    ///
    /// # Errors
    /// [`Error::Missing`] or [`Error::Io`].
    pub(crate) fn of_any_kind(name: &str) -> Result<Self, Error> {
        match kind_of_builtin(name) {
            Some(kind) => Ok(Self::text(format!("built-in {name}"), kind.template(name)?)),
            None => {
                let read = Self::read(PathBuf::from(name), &[VEHICLES, SCENARIOS, EXPERIMENTS, STUDIES]);
                read.map_err(|error| match error {
                    Error::Missing { path, meant, source }
                        if meant.is_empty() && !name.ends_with(".toml") =>
                    {
                        let meant = " (omnistep list prints what is built in)".into();
                        Error::Missing { path, meant, source }
                    }
                    other => other,
                })
            }
        }
    }

    /// The file at a path; if there is none, one beside it or what is built in may have been meant.
    fn read(path: PathBuf, builtin: &[Builtin]) -> Result<Self, Error> {
        let known: Vec<_> = builtin
            .iter()
            .flat_map(|kind| kind.iter())
            .map(|(name, _)| *name)
            .collect();
        let bytes = read_regular(&path, MOST_TOML_BYTES).map_err(|source| match source.kind() {
            ErrorKind::NotFound => Error::Missing {
                meant: did_you_mean_file(&path, &known),
                path: path.clone(),
                source,
            },
            _ => Error::Io {
                path: path.clone(),
                source,
            },
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
        // Whatever is there: a directory or a device is rejected as such.
        if path.exists() || name.ends_with(".toml") {
            return Self::read(path, &[builtin]);
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
                message: format!("{}{}", one_line(error.message()), decimal_comma(&self.text, line)),
            }
        })
    }

    /// Refuses a table that clearly describes something else.
    pub(crate) fn expect(&self, wanted: FileKind, table: &Table) -> Result<(), Error> {
        let has = |keys: [&str; 2]| keys.iter().all(|key| table.contains_key(*key));
        let others = [
            (
                ["time", "wheels"],
                "a map, which omnistep import reads with --map",
            ),
            (
                ["cell", "start"],
                "a climb chart, which omnistep plan reads with --chart",
            ),
        ];
        if let Some((_, other)) = others.into_iter().find(|(keys, _)| has(*keys)) {
            return Err(self.refuse(
                "top level",
                format!("this is {other}, not {}", wanted.called(&self.file)),
            ));
        }
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
    checked(source, Value::Table(table))
}

/// The same of a table inside, or of another value.
pub(crate) fn checked<T: DeserializeOwned + Validate<Context = ()>>(
    source: &Source,
    value: Value,
) -> Result<T, Error> {
    let value: T = serde_path_to_error::deserialize(value.clone()).map_err(|error| {
        let path = error.path().to_string();
        let mut message = with_nearest_inside(one_line(error.inner().message()));
        // The playground has no files that lack keys, and no room.
        if cfg!(not(target_family = "wasm")) && message.contains("missing field `") {
            message += &others_missing::<T>(value);
        }
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
            format!(" (and {more} more wrong values)")
        };
        source.refuse(key, format!("{message}{more}"))
    })?;
    Ok(value)
}

/// A hint where the line has a number with a decimal comma, as in `height_m = 0,03`.
fn decimal_comma(text: &str, line: usize) -> &'static str {
    let value = text
        .lines()
        .nth(line.saturating_sub(1))
        .and_then(|line| Some(line.split_once('=')?.1));
    let is_digit = |letter: Option<char>| letter.is_some_and(|letter| letter.is_ascii_digit());
    match value.and_then(|value| value.split_once(',')) {
        Some((before, after)) if is_digit(before.trim().chars().next()) && is_digit(after.chars().next()) => {
            "; numbers are written with a decimal point, as 0.03"
        }
        _ => "",
    }
}

/// [`with_nearest`], even if the message is about a key of a table inside.
fn with_nearest_inside(message: String) -> String {
    match message
        .strip_prefix(INNER_KEY)
        .and_then(|rest| rest.split_once(INNER_KEY))
    {
        Some((key, inner)) => format!("{INNER_KEY}{key}{INNER_KEY}{}", with_nearest(inner.into())),
        None => with_nearest(message),
    }
}

/// A message of a library in one line and in the words of a file: serde names types of Rust.
fn one_line(message: &str) -> String {
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    match message.split_once("expected ") {
        Some((before, "f64")) => format!("{before}expected a number"),
        Some((before, "fewer elements in array")) => format!("{before}expected fewer elements"),
        Some((before, "a boolean")) => format!("{before}expected true or false"),
        _ => message,
    }
}
