//! A file of any kind.

use crate::file_kind::FileKind;
use crate::{Error, MotorBench, Override, Scenario, Source, Study, Vehicle};

/// A file that has been checked.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum File {
    /// A vehicle.
    Vehicle(Box<Vehicle>),
    /// A scenario, with its vehicle.
    Scenario(Box<Scenario>),
    /// An experiment of section 3.3.
    Experiment(Box<MotorBench>),
    /// A study; its scenarios are checked by [`Study::points`].
    Study(Box<Study>),
}

impl File {
    /// The built-in item of a name, or otherwise the file at a path, of any kind: a vehicle has wheels, an experiment
    /// of section 3.3 has loads, a study has seeds or axes, and anything else counts as a scenario. Overrides name its
    /// own keys; a study accepts none here.
    ///
    /// # Errors
    /// Its first error, in one line.
    ///
    /// ```
    /// let error = omni_config::File::load("nowhere.toml", &[]).unwrap_err();
    /// assert!(error.to_string().starts_with("nowhere.toml: No such file"));
    /// assert!(matches!(omni_config::File::load("omni3", &[]), Ok(omni_config::File::Vehicle(_))));
    /// ```
    pub fn load(name: &str, overrides: &[Override]) -> Result<Self, Error> {
        let source = Source::of_any_kind(name)?;
        Ok(
            match FileKind::of(&source.table()?).unwrap_or(FileKind::Scenario) {
                FileKind::Vehicle => Self::Vehicle(Box::new(Vehicle::from_source(&source, overrides)?)),
                FileKind::Experiment => {
                    Self::Experiment(Box::new(MotorBench::from_source(&source, overrides)?))
                }
                FileKind::Study => Self::Study(Box::new(Study::from_source(&source)?)),
                FileKind::Scenario => Self::Scenario(Box::new(Scenario::from_source(&source, overrides)?)),
            },
        )
    }
}
