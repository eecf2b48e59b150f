//! `omnistep new` and `omnistep schema`.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use omni_config::{FileKind, Scenario, Source, Study, Vehicle};

use crate::Error;
use crate::args::{FileKindArg, NewKind};
use crate::output::print;
use crate::room::{behind_m, obstacle_at_m};
use crate::{excitation, import_map, robots};

/// Prints the JSON Schema of a kind of file.
pub(super) fn schema(kind: FileKindArg, out: &mut dyn Write) -> Result<(), Error> {
    let kind = match kind {
        FileKindArg::Vehicle => FileKind::Vehicle,
        FileKindArg::Scenario => FileKind::Scenario,
        FileKindArg::Experiment => FileKind::Experiment,
        FileKindArg::Study => FileKind::Study,
    };
    print(out, kind.schema())
}

/// Writes `NAME.toml`, unless there is such a file.
pub(super) fn new(
    kind: NewKind,
    name: &str,
    template: Option<&str>,
    vehicle: Option<&str>,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let of_a_vehicle = matches!(kind, NewKind::Excitation | NewKind::ImportMap);
    if let (Some(vehicle), NewKind::Vehicle | NewKind::Study) = (vehicle, kind) {
        return Err(Error::Argument {
            name: "--vehicle",
            value: vehicle.to_owned(),
            allowed: "only with new scenario, new excitation and new import-map",
        });
    }
    if let (Some(template), true) = (template, of_a_vehicle) {
        return Err(Error::Argument {
            name: "--template",
            value: template.to_owned(),
            allowed: "only with new vehicle, new scenario and new study; use --vehicle to set the vehicle",
        });
    }
    let kind_of_new = kind;
    let (kind, template) = match kind {
        NewKind::Vehicle => (FileKind::Vehicle, template.unwrap_or("chugo7")),
        NewKind::Scenario => (FileKind::Scenario, template.unwrap_or("step")),
        NewKind::Study => (FileKind::Study, template.unwrap_or("climb_map")),
        NewKind::Excitation => (FileKind::Scenario, vehicle.unwrap_or("chugo7")),
        NewKind::ImportMap => return new_import_map(name, vehicle.unwrap_or("chugo7"), out),
    };
    let text = match kind_of_new {
        NewKind::Excitation => excitation::text(name, template)?,
        NewKind::Vehicle => robots::like(template, name)?,
        NewKind::Scenario => driven(named(kind, template, name)?, template, vehicle)?,
        _ => named(kind, template, name)?,
    };
    // What would be rejected when it is read is not written.
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
    let path = written(name, &format!("{}{text}", schema_line(kind)))?;
    let started = match kind_of_new {
        NewKind::Excitation => "an excitation for",
        _ => "started from",
    };
    print(
        out,
        &format!("{path}: {started} {template}; run it with: {hint}\n"),
    )
}

/// Writes a map for `omnistep import`. There is no name in it; the file's is what a scenario's may be.
fn new_import_map(name: &str, vehicle: &str, out: &mut dyn Write) -> Result<(), Error> {
    let scenario = named(FileKind::Scenario, "flat", name)?;
    Scenario::from_source(&Source::text(format!("new {name}"), scenario), &[])?;
    let path = written(name, &import_map::text(vehicle)?)?;
    let hint =
        format!("write the names of your log's columns into it, then: omnistep import LOG --map {path}");
    print(out, &format!("{path}: an import map for {vehicle}; {hint}\n"))
}

/// The text of a built-in file with another name in it.
fn named(kind: FileKind, template: &str, name: &str) -> Result<String, Error> {
    let text = kind.template(template)?;
    Ok(text.replacen(
        &format!("name = \"{template}\""),
        &format!("name = \"{name}\""),
        1,
    ))
}

/// The text of a scenario with another vehicle in it, if one is named.
fn driven(text: String, template: &str, vehicle: Option<&str>) -> Result<String, Error> {
    let Some(vehicle) = vehicle else {
        return Ok(text);
    };
    let own = text.lines().find(|line| line.starts_with("vehicle = "));
    // Every built-in scenario has the line, as a test says.
    let own = own.unwrap_or_default();
    let source = Source::vehicle(vehicle, None)?;
    let other = Vehicle::from_source(&source, &[])?;
    let text =
        with_room(&text, template, &other)?.replacen(own, &format!("vehicle = {}", toml_text(vehicle)), 1);
    Scenario::from_source(&Source::text(template, &*text), &[])?;
    Ok(text)
}

/// The text of a built-in scenario with its obstacle as far ahead as a long vehicle needs it, and
/// time for the longer way.
fn with_room(text: &str, template: &str, vehicle: &Vehicle) -> Result<String, Error> {
    let usual = Scenario::from_source(&Source::text(template, text), &[])?;
    let Some(obstacle) = usual.terrain.obstacle() else {
        return Ok(text.into());
    };
    let at_m = obstacle_at_m(vehicle, obstacle.from_m);
    if at_m <= obstacle.from_m {
        return Ok(text.into());
    }
    let longer_m = (behind_m(vehicle) - behind_m(usual.vehicle())).max(0.0) + at_m - obstacle.from_m;
    let speed_m_s = usual.command.vx_m_s.abs().max(0.1);
    let duration_s = (usual.duration_s + longer_m / speed_m_s).ceil();
    let text = with_value(text, "start_x_m", &format!("{at_m:.1}"));
    Ok(with_value(&text, "duration_s", &format!("{duration_s:.1}")))
}

/// The text with another value in the first line of a key, whose comment was about the value before.
fn with_value(text: &str, key: &str, value: &str) -> String {
    let start = format!("{key} = ");
    let line = text.lines().find(|line| line.starts_with(&start));
    // Every built-in scenario with an obstacle has the lines, as a test says.
    let other = format!(
        "{:<27} # for the length of this vehicle",
        format!("{start}{value}")
    );
    let line = line.unwrap_or_default();
    text.replacen(&format!("\n{line}\n"), &format!("\n{other}\n"), 1)
}

/// A text as TOML writes it.
fn toml_text(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// The name of the file `NAME.toml`, written unless there is such a file.
fn written(name: &str, text: &str) -> Result<String, Error> {
    let path = format!("{name}.toml");
    let file = OpenOptions::new().write(true).create_new(true).open(&path);
    file.and_then(|mut file| file.write_all(text.as_bytes()))
        .map_err(|source| Error::Io {
            source: match source.kind() {
                ErrorKind::AlreadyExists => {
                    let kept = "the file exists and was not changed; use another name, or move it away first";
                    std::io::Error::new(ErrorKind::AlreadyExists, kept)
                }
                _ => source,
            },
            path: PathBuf::from(&path),
        })?;
    Ok(path)
}

/// The first line of a new file: its schema, for editors, where it lies beside it; else how to get
/// it. (A file whose schema is missing is an error for some of them.)
fn schema_line(kind: FileKind) -> String {
    let kind = kind.name();
    let schema = format!("{kind}.schema.json");
    // An empty one is what a shell leaves of a schema that could not be written.
    if std::fs::metadata(&schema).is_ok_and(|file| file.is_file() && file.len() > 0) {
        format!("#:schema ./{schema}\n")
    } else {
        format!(
            "# For completion in an editor: omnistep schema {kind} > {schema}, and \"#:schema ./{schema}\" as the first line.\n"
        )
    }
}
