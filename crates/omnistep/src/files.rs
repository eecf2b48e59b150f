//! `omnistep check`, `omnistep new` and `omnistep schema`.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use omni_config::{DerivedGains, File, FileKind, Scenario, Source, Study, Vehicle, WheelSpec};

use crate::Error;
use crate::args::{FileKindArg, NewKind};
use crate::notices::{announce_gains, beyond_balls, warn_of};
use crate::output::print;

/// Control period and gravity that a vehicle's facts are for, where no scenario gives them: the built-in scenarios'.
const PERIOD_S: f64 = 1e-3;
const GRAVITY_M_S2: f64 = 9.81;

/// Says what a file describes, or what is wrong with it.
pub(super) fn check(file: &str, out: &mut dyn Write) -> Result<(), Error> {
    let said = match File::load(file)? {
        File::Vehicle(vehicle) => {
            let derived = match vehicle.gains {
                Some(_) => None,
                None => Some(vehicle.derived_gains(PERIOD_S)?),
            };
            announce_gains(&vehicle.name, PERIOD_S, derived.as_ref());
            let facts = facts(&vehicle, PERIOD_S, GRAVITY_M_S2, derived.as_ref())?;
            format!("vehicle {}{facts}{}", described(&vehicle), balls_ahead(&vehicle))
        }
        File::Scenario(scenario) => {
            let (vehicle, derived) = (scenario.vehicle(), scenario.derived_gains());
            announce_gains(&vehicle.name, scenario.period_s(), derived);
            warn_of(&scenario);
            format!(
                "scenario {}, {} s, policy {}, engine {}; vehicle {}{}{}",
                scenario.name,
                scenario.duration_s,
                scenario.control.law(),
                scenario.physics.engine.name(),
                described(vehicle),
                facts(
                    vehicle,
                    scenario.period_s(),
                    scenario.physics.gravity_m_s2,
                    derived
                )?,
                balls(&scenario)
            )
        }
        File::Experiment(experiment) => {
            format!("experiment {}, {} s", experiment.name, experiment.duration_s)
        }
        File::Study(study) => {
            let (described, warning) = checked(&study)?;
            match warning {
                Some(why) => format!("study {described}\n  {:<8} WARNING: {why}", "balls"),
                None => format!("study {described}"),
            }
        }
        _ => {
            return Err(Error::Argument {
                name: "FILE",
                value: file.into(),
                allowed: "a vehicle, a scenario, an experiment or a study",
            });
        }
    };
    print(out, &format!("{file}: {said}\n"))
}

/// What a study is, and what is to be said of those of its runs on balls that are not their wheels.
#[cfg(feature = "study")]
fn checked(study: &Study) -> Result<(String, Option<String>), Error> {
    crate::study::checked(study)
}

#[cfg(not(feature = "study"))]
fn checked(_: &Study) -> Result<(String, Option<String>), Error> {
    Err(Error::NotBuilt {
        what: "check STUDY",
        feature: "study",
    })
}

fn described(vehicle: &Vehicle) -> String {
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let mut parts = vec![
        match vehicle.body.len() {
            1 => "1 body".to_owned(),
            n => format!("{n} bodies"),
        },
        count(vehicle.hinge.len(), "hinge"),
    ];
    if !vehicle.coupling.is_empty() {
        parts.push(count(vehicle.coupling.len(), "coupling"));
    }
    parts.push(count(vehicle.wheel.len(), "wheel"));
    format!(
        "{}: {}, {:.3} kg",
        vehicle.name,
        parts.join(", "),
        vehicle.mass_kg()
    )
}

/// Does a wheel push across the vehicle's way ahead?
fn is_crosswise(wheel: &WheelSpec) -> bool {
    let [dx, dy] = wheel.rolling_direction;
    let (sin, cos) = wheel.roller_angle_rad.sin_cos();
    (cos * dx - sin * dy).abs() < 0.1 * dx.hypot(dy)
}

/// What follows from the vehicle's numbers, one indented line each.
fn facts(
    vehicle: &Vehicle,
    period_s: f64,
    gravity_m_s2: f64,
    derived: Option<&DerivedGains>,
) -> Result<String, Error> {
    let mut lines = String::new();
    let mut say = |what: &str, text: String| lines.push_str(&format!("\n  {what:<8} {text}"));
    say(
        "layout",
        format!("condition number {:.2} (1 is best)", vehicle.condition_number()?),
    );
    let [x, y, z] = vehicle
        .centre_of_mass_m()
        .map(|at| if at.abs() < 5e-5 { 0.0 } else { at });
    say("weight", format!("centre of mass at ({x:.3}, {y:.3}, {z:.3}) m"));
    if let Some(loads) = vehicle.static_loads_n(gravity_m_s2) {
        let each = vehicle
            .wheel
            .iter()
            .zip(&loads)
            .map(|(wheel, load)| format!("{} {load:.1}", wheel.name));
        say(
            "loads",
            format!(
                "at rest on flat ground [N]: {}",
                each.collect::<Vec<_>>().join(", ")
            ),
        );
        // What a crosswise wheel carries is lost to those that push.
        let shares = vehicle.rows().into_iter().filter_map(|row| {
            let carried: f64 = row.wheels.iter().map(|wheel| loads[*wheel]).sum();
            let crosswise: Vec<_> = row
                .wheels
                .iter()
                .filter(|wheel| is_crosswise(&vehicle.wheel[**wheel]))
                .collect();
            if crosswise.is_empty() || crosswise.len() == row.wheels.len() || carried <= 0.0 {
                return None;
            }
            let names: Vec<_> = crosswise
                .iter()
                .map(|wheel| vehicle.wheel[**wheel].name.as_str())
                .collect();
            let share = 100.0 * crosswise.iter().map(|wheel| loads[**wheel]).sum::<f64>() / carried;
            let (wheel, x_m) = (if names.len() == 1 { "wheel" } else { "wheels" }, row.x_m);
            Some(format!(
                "of the row at x = {x_m} m crosswise {wheel} {} {share:.0} %",
                names.join(", ")
            ))
        });
        let shares: Vec<_> = shares.collect();
        if !shares.is_empty() {
            say("shares", shares.join("; "));
        }
    } else if vehicle.wheel.iter().any(|wheel| wheel.preload_n != 0.0) {
        say(
            "loads",
            "WARNING: with these preloads some wheel does not stand on the ground".into(),
        );
    }
    if let Some(no_load) = vehicle.no_load_rad_s() {
        let [vx, vy, wz] = vehicle.speeds_at(no_load)?;
        say(
            "speed",
            format!(
                "motors reach {no_load:.1} rad/s without load: {vx:.2} m/s forward, {vy:.2} m/s sideways, {wz:.2} rad/s about"
            ),
        );
    }
    let gains = vehicle.gains_at(period_s)?;
    let origin = if derived.is_some() { "derived" } else { "given" };
    say(
        "gains",
        format!(
            "kp {:.4} N.m.s/rad, ki {:.4} N.m/rad, kd {} N.m.s2/rad, {origin}",
            gains.kp_n_m_s_rad, gains.ki_n_m_rad, gains.kd_n_m_s2_rad
        ),
    );
    Ok(lines)
}

/// Whether balls are the wheels of a scenario, as one of [`facts`].
fn balls(scenario: &Scenario) -> String {
    let wheels = 0..scenario.vehicle().wheel.len();
    let text = match beyond_balls(scenario) {
        Some(why) => format!("WARNING: {why}"),
        None if wheels.clone().all(|i| scenario.rollers(i).is_some()) => return String::new(),
        None => format!("stand for its wheels {}", scenario.terrain.described()),
    };
    format!("\n  {:<8} {text}", "balls")
}

/// Whether balls are a vehicle's wheels where it meets an obstacle straight ahead, as one of [`facts`].
fn balls_ahead(vehicle: &Vehicle) -> String {
    let text = match vehicle.beyond_balls_ahead() {
        Some(beyond) => {
            format!("stand for its wheels on level ground, not at an upright edge straight ahead: {beyond}")
        }
        None => "stand for its wheels on level ground and at an edge straight ahead".into(),
    };
    format!("\n  {:<8} {text}", "balls")
}

/// Prints the JSON Schema of a kind of file.
#[cfg(feature = "schema")]
pub(super) fn schema(kind: FileKindArg, out: &mut dyn Write) -> Result<(), Error> {
    let kind = match kind {
        FileKindArg::Vehicle => FileKind::Vehicle,
        FileKindArg::Scenario => FileKind::Scenario,
        FileKindArg::Experiment => FileKind::Experiment,
        FileKindArg::Study => FileKind::Study,
    };
    // Plain data, which can be written.
    let text = serde_json::to_string_pretty(&kind.schema()).unwrap_or_default();
    print(out, &format!("{text}\n"))
}

#[cfg(not(feature = "schema"))]
pub(super) fn schema(_: FileKindArg, _: &mut dyn Write) -> Result<(), Error> {
    Err(Error::NotBuilt {
        what: "schema",
        feature: "schema",
    })
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
        .and_then(|mut file| file.write_all(format!("{}{text}", schema_line(kind)).as_bytes()))
        .map_err(|source| Error::Io {
            source: match source.kind() {
                ErrorKind::AlreadyExists => {
                    let kept = "there is such a file already, and it stays as it is; give another name, or move it away first";
                    std::io::Error::new(ErrorKind::AlreadyExists, kept)
                }
                _ => source,
            },
            path: path.clone(),
        })?;
    print(
        out,
        &format!("{}: started from {like}; run it with: {hint}\n", path.display()),
    )
}

/// The first line of a new file: its schema, for editors, where it lies beside it; else how to get it. (A file whose schema is
/// missing is an error for some of them.)
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
