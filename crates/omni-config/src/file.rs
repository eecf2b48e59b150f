//! A file of any kind.

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
        let table = source.table()?;
        Ok(if table.contains_key("wheel") || table.contains_key("body") {
            Self::Vehicle(Box::new(Vehicle::from_source(&source, &[])?))
        } else if table.contains_key("load") {
            Self::Experiment(Box::new(WheelsExperiment::from_source(&source, &[])?))
        } else if table.contains_key("seeds") || table.contains_key("axis") {
            Self::Study(Box::new(Study::from_source(&source)?))
        } else {
            Self::Scenario(Box::new(Scenario::from_source(&source, &[])?))
        })
    }
}
