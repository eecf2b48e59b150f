//! The built-in files.

use crate::Error;
use crate::file_kind::FileKind;

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
    ("hard_step", include_str!("../assets/scenarios/hard_step.toml")),
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
    ("square", include_str!("../assets/scenarios/square.toml")),
    (
        "figure_eight",
        include_str!("../assets/scenarios/figure_eight.toml"),
    ),
];
pub(crate) const EXPERIMENTS: Builtin = &[(
    "motor_bench",
    include_str!("../assets/scenarios/motor_bench.toml"),
)];

pub(crate) const STUDIES: Builtin = &[
    ("climb_map", include_str!("../assets/studies/climb_map.toml")),
    ("ensemble", include_str!("../assets/studies/ensemble.toml")),
    ("engines", include_str!("../assets/studies/engines.toml")),
    (
        "wheel_models",
        include_str!("../assets/studies/wheel_models.toml"),
    ),
    ("traction", include_str!("../assets/studies/traction.toml")),
    (
        "traction_runup",
        include_str!("../assets/studies/traction_runup.toml"),
    ),
];

impl FileKind {
    /// Name of built-in items of this kind in messages, and the items.
    fn builtin(self) -> (&'static str, Builtin) {
        match self {
            Self::Vehicle => ("vehicle", VEHICLES),
            Self::Scenario => ("scenario", SCENARIOS),
            Self::Experiment => ("motor bench experiment", EXPERIMENTS),
            Self::Study => ("study", STUDIES),
        }
    }

    /// The built-in text of that name, as a template of a new file.
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
pub(crate) fn kind_of_builtin(name: &str) -> Option<FileKind> {
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
