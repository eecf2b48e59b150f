//! `omnistep check` and `omnistep new`.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;

use super::{NewKind, print};
use crate::Error;
use crate::config::{File, FileKind, Scenario, Source, Study, Vehicle};
use crate::study::Plan;

/// Says what each file describes, or what is wrong with the first that is wrong.
pub(super) fn check(files: &[String], out: &mut dyn Write) -> Result<(), Error> {
    for file in files {
        let said = match File::load(file)? {
            File::Vehicle(vehicle) => format!("vehicle {}", described(&vehicle)),
            File::Scenario(scenario) => format!(
                "scenario {}, {} s, policy {}; vehicle {}",
                scenario.name,
                scenario.duration_s,
                scenario.control.policy,
                described(scenario.vehicle())
            ),
            File::Experiment(experiment) => {
                format!("experiment {}, {} s", experiment.name, experiment.duration_s)
            }
            File::Study(study) => format!("study {}", super::study::described(&Plan::new(&study, &[])?)),
        };
        print(out, &format!("{file}: {said}\n"))?;
    }
    Ok(())
}

fn described(vehicle: &Vehicle) -> String {
    let masses = vehicle.body.iter().map(|body| body.mass_kg);
    let mass_kg: f64 = masses
        .chain(vehicle.wheel.iter().map(|wheel| wheel.mass_kg))
        .sum();
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    format!(
        "{}: {}, {}, {}, {mass_kg:.3} kg",
        vehicle.name,
        match vehicle.body.len() {
            1 => "1 body".to_owned(),
            n => format!("{n} bodies"),
        },
        count(vehicle.hinge.len(), "hinge"),
        count(vehicle.wheel.len(), "wheel"),
    )
}

/// Writes `NAME.toml`, unless there is such a file.
pub(super) fn new(kind: NewKind, name: &str, like: Option<&str>, out: &mut dyn Write) -> Result<(), Error> {
    let (kind, like) = match kind {
        NewKind::Vehicle => (FileKind::Vehicle, like.unwrap_or("chugo7")),
        NewKind::Scenario => (FileKind::Scenario, like.unwrap_or("step")),
        NewKind::Study => (FileKind::Study, like.unwrap_or("climb_map")),
    };
    let text = kind
        .template(like)?
        .replacen(&format!("name = \"{like}\""), &format!("name = \"{name}\""), 1);
    // What would be refused when it is read is not written.
    let source = Source::text(format!("new {name}"), &*text);
    let hint = match kind {
        FileKind::Vehicle => {
            Vehicle::from_source(&source, &[])?;
            format!("omnistep run flat --set vehicle={name}.toml")
        }
        FileKind::Study => {
            Study::from_source(&source)?;
            format!("omnistep study {name}.toml")
        }
        _ => {
            Scenario::from_source(&source, &[])?;
            format!("omnistep run {name}.toml")
        }
    };
    let path = PathBuf::from(format!("{name}.toml"));
    let written = OpenOptions::new().write(true).create_new(true).open(&path);
    written
        .and_then(|mut file| file.write_all(text.as_bytes()))
        .map_err(|source| Error::Io {
            path: path.clone(),
            source,
        })?;
    print(
        out,
        &format!("{}: started from {like}; run it with: {hint}\n", path.display()),
    )
}
