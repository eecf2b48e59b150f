//! A file of any kind.

use toml::Table;

use crate::load::{Builtin, EXPERIMENTS, SCENARIOS, STUDIES, VEHICLES};
use crate::{Error, Scenario, Source, Study, Vehicle, WheelsExperiment};

/// Kinds of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A vehicle.
    Vehicle,
    /// A scenario.
    Scenario,
    /// An experiment of section 3.3.
    Experiment,
    /// A study.
    Study,
}

impl FileKind {
    /// What a table describes, if its keys say so: a scenario has a ground and a command, a vehicle wheels and bodies, an experiment of section 3.3 loads, a
    /// study seeds or axes.
    pub(crate) fn of(table: &Table) -> Option<Self> {
        let has = |keys: [&str; 2]| keys.iter().any(|key| table.contains_key(*key));
        if has(["terrain", "command"]) {
            Some(Self::Scenario)
        } else if has(["wheel", "body"]) {
            Some(Self::Vehicle)
        } else if has(["load", "speed_rpm"]) {
            Some(Self::Experiment)
        } else if has(["seeds", "axis"]) {
            Some(Self::Study)
        } else {
            None
        }
    }

    /// Refuses a table that clearly describes something else.
    pub(crate) fn expect(self, source: &Source, table: &Table) -> Result<(), Error> {
        match Self::of(table) {
            Some(found) if found != self => Err(Error::OtherKind {
                file: source.file.clone(),
                found,
                wanted: self,
                command: "run",
            }),
            _ => Ok(()),
        }
    }

    /// What it is called, as `a vehicle`; what is in a file of one's own, `a vehicle file`.
    pub(crate) fn called(self, file: &str) -> String {
        let what = match self {
            Self::Vehicle => "a vehicle",
            Self::Scenario => "a scenario",
            Self::Experiment => return "the experiment of section 3.3".into(),
            Self::Study => "a study",
        };
        let own = if file.contains(['.', '/', '\\']) {
            " file"
        } else {
            ""
        };
        format!("{what}{own}")
    }

    /// The kind that has a built-in thing of this name.
    pub(crate) fn of_builtin(name: &str) -> Option<Self> {
        let kinds = [Self::Scenario, Self::Vehicle, Self::Study, Self::Experiment];
        kinds.into_iter().find(|kind| kind.template(name).is_ok())
    }

    /// What to type for a file of this kind, where `command` is what would be done with a scenario.
    pub(crate) fn how_to(self, command: &str, file: &str) -> String {
        match self {
            Self::Vehicle => format!("omnistep {command} flat --set vehicle={file}"),
            Self::Scenario => format!("omnistep {command} {file}"),
            Self::Experiment => format!("omnistep wheels {file}"),
            Self::Study => format!("omnistep study {file}"),
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
        let (kind, builtin): (_, Builtin) = match self {
            Self::Vehicle => ("vehicle", VEHICLES),
            Self::Scenario => ("scenario", SCENARIOS),
            Self::Experiment => ("wheels experiment", EXPERIMENTS),
            Self::Study => ("study", STUDIES),
        };
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

/// A file that has been checked.
#[derive(Clone, Debug)]
pub enum File {
    /// A vehicle.
    Vehicle(Box<Vehicle>),
    /// A scenario, with its vehicle.
    Scenario(Box<Scenario>),
    /// An experiment of section 3.3.
    Experiment(Box<WheelsExperiment>),
    /// A study; its scenarios are checked by [`Study::points`].
    Study(Box<Study>),
}

impl File {
    /// The file at a path, whatever it describes: a vehicle has wheels, an experiment of section 3.3 has loads, a study
    /// has seeds or axes, anything else is taken for a scenario.
    ///
    /// # Errors
    /// What is wrong with it, in one line.
    ///
    /// ```
    /// let error = omni_config::File::load("nowhere.toml").unwrap_err();
    /// assert!(error.to_string().starts_with("nowhere.toml: No such file"));
    /// ```
    pub fn load(path: &str) -> Result<Self, Error> {
        let source = Source::file(path)?;
        Ok(
            match FileKind::of(&source.table()?).unwrap_or(FileKind::Scenario) {
                FileKind::Vehicle => Self::Vehicle(Box::new(Vehicle::from_source(&source, &[])?)),
                FileKind::Experiment => {
                    Self::Experiment(Box::new(WheelsExperiment::from_source(&source, &[])?))
                }
                FileKind::Study => Self::Study(Box::new(Study::from_source(&source)?)),
                FileKind::Scenario => Self::Scenario(Box::new(Scenario::from_source(&source, &[])?)),
            },
        )
    }
}
