//! `omnistep list`.

use std::io::Write;

use clap::ValueEnum;
use omni_config::{
    FileKind, POLICIES, builtin_scenarios, builtin_studies, builtin_vehicles, policy_in_a_line,
};

use crate::Error;
use crate::output::print;
use crate::robots::{self, ROBOTS};

/// Built-in items.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Listed {
    Scenarios,
    Vehicles,
    Robots,
    Policies,
    Studies,
    Experiments,
}

impl Listed {
    fn names(self) -> Vec<&'static str> {
        match self {
            Self::Scenarios => builtin_scenarios(),
            Self::Vehicles => builtin_vehicles(),
            Self::Robots => ROBOTS.map(|(name, _)| name).to_vec(),
            Self::Policies => POLICIES.to_vec(),
            Self::Studies => builtin_studies(),
            Self::Experiments => vec!["motor_bench"],
        }
    }

    /// What one of them is, in a line: of a file its first comment.
    fn about(self, name: &str) -> &'static str {
        let kind = match self {
            Self::Scenarios => FileKind::Scenario,
            Self::Vehicles => FileKind::Vehicle,
            Self::Robots => return robots::in_a_line(name),
            Self::Policies => return policy_in_a_line(name),
            Self::Studies => FileKind::Study,
            Self::Experiments => FileKind::Experiment,
        };
        let first = kind.template(name).ok().and_then(|text| text.lines().next());
        first.unwrap_or_default().trim_start_matches(['#', ' '])
    }
}

/// Names of everything, or of one kind with a line on each.
pub(super) fn list(kind: Option<Listed>, out: &mut dyn Write) -> Result<(), Error> {
    if let Some(kind) = kind {
        let names = kind.names();
        let width = names.iter().map(|name| name.len()).max().unwrap_or(0);
        return names
            .iter()
            .try_for_each(|name| print(out, &format!("{name:width$}  {}\n", kind.about(name))));
    }
    for (title, kind, note) in [
        ("scenarios:  ", Listed::Scenarios, ""),
        ("vehicles:   ", Listed::Vehicles, ""),
        (
            "robots:     ",
            Listed::Robots,
            " (make a vehicle: `omnistep new vehicle NAME --template ROBOT`)",
        ),
        ("policies:   ", Listed::Policies, ""),
        ("studies:    ", Listed::Studies, ""),
        (
            "experiments:",
            Listed::Experiments,
            " (run with `omnistep motor-bench`)",
        ),
    ] {
        print(out, &format!("{title} {}{note}\n", kind.names().join(", ")))?;
    }
    Ok(())
}
