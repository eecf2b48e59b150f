//! The kinds of files.

use toml::Table;

/// Kinds of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
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
    /// The kind of a table, if its keys show it: a scenario has a ground and a command, a vehicle wheels, bodies or a
    /// motor, an experiment of section 3.3 loads, a study seeds or axes.
    pub(crate) fn of(table: &Table) -> Option<Self> {
        let has = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
        if has(&["terrain", "command"]) {
            Some(Self::Scenario)
        } else if has(&["wheel", "body", "mecanum4", "omni3", "motor"]) {
            Some(Self::Vehicle)
        } else if has(&["load", "speed_rpm"]) {
            Some(Self::Experiment)
        } else if has(&["seeds", "axis"]) {
            Some(Self::Study)
        } else {
            None
        }
    }

    /// Its name as a word, as `vehicle` in `vehicle.schema.json`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Vehicle => "vehicle",
            Self::Scenario => "scenario",
            Self::Experiment => "experiment",
            Self::Study => "study",
        }
    }

    /// The JSON Schema (draft 2020-12) of files of this kind: their keys, with types, ranges and descriptions, for
    /// completion in editors. Only loading finds errors across several keys (names that refer to each other, wheels
    /// that intersect).
    ///
    /// ```
    /// let schema = omni_config::FileKind::Vehicle.schema();
    /// assert!(schema.contains(r#""description": "Mass [kg], 0.001 to 10000.""#));
    /// ```
    #[must_use]
    pub fn schema(self) -> &'static str {
        // Generated once and not in every build: the derives compile for as long as all that reads the files.
        match self {
            Self::Vehicle => include_str!("../schemas/vehicle.schema.json"),
            Self::Scenario => include_str!("../schemas/scenario.schema.json"),
            Self::Experiment => include_str!("../schemas/experiment.schema.json"),
            Self::Study => include_str!("../schemas/study.schema.json"),
        }
    }

    /// Its name, such as `a vehicle`, or `a vehicle file` for a user's file.
    pub(crate) fn called(self, file: &str) -> String {
        let what = match self {
            Self::Vehicle => "a vehicle",
            Self::Scenario => "a scenario",
            Self::Experiment => return "a motor bench experiment".into(),
            Self::Study => "a study",
        };
        let own = if file.contains(['.', '/', '\\']) {
            " file"
        } else {
            ""
        };
        format!("{what}{own}")
    }

    /// Command line for a file of this kind, where `command` is the command for a scenario.
    pub(crate) fn how_to(self, command: &str, file: &str) -> String {
        match self {
            Self::Vehicle => format!("omnistep {command} flat --set vehicle={file}"),
            Self::Scenario => format!("omnistep {command} {file}"),
            Self::Experiment => format!("omnistep motor-bench {file}"),
            Self::Study => format!("omnistep study {file}"),
        }
    }
}

#[cfg(test)]
mod tests {
    /// Everything that loads names kinds of files: were they in a module that loads, modules would
    /// import one another in a circle.
    #[test]
    fn kinds_of_files_are_a_leaf_that_imports_no_other_room() {
        let own = include_str!("file_kind.rs").split_once("#[cfg(test)]");
        let (code, _) = own.expect("this module");
        assert!(!code.contains("crate::") && !code.contains("super::"), "a leaf");
        for (module, text) in [
            ("load", include_str!("load.rs")),
            ("error", include_str!("error.rs")),
            ("scenario", include_str!("scenario.rs")),
            ("study", include_str!("study.rs")),
            ("vehicle", include_str!("vehicle.rs")),
            ("motor_bench", include_str!("motor_bench.rs")),
        ] {
            assert!(text.contains("use crate::file_kind::FileKind;"), "{module}");
            assert!(!text.contains("crate::file::"), "{module} imports the top module");
        }
    }
}
