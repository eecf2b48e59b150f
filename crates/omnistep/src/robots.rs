//! Vehicle files of public robots, to start from: `omnistep new vehicle NAME --template ROBOT`.

use omni_config::{Error, Source, Vehicle, builtin_vehicles};
use serde::Deserialize;
use toml::Spanned;

/// The robots' names and files, in the order they are listed.
pub(crate) const ROBOTS: [(&str, &str); 8] = [
    ("youbot", include_str!("../assets/robots/youbot.toml")),
    ("ridgeback", include_str!("../assets/robots/ridgeback.toml")),
    ("rosbot_xl", include_str!("../assets/robots/rosbot_xl.toml")),
    ("rosmaster_x3", include_str!("../assets/robots/rosmaster_x3.toml")),
    ("strafer", include_str!("../assets/robots/strafer.toml")),
    ("lekiwi", include_str!("../assets/robots/lekiwi.toml")),
    ("robotino", include_str!("../assets/robots/robotino.toml")),
    ("osr", include_str!("../assets/robots/osr.toml")),
];

/// First lines that `omnistep new` writes, which are of the file's folder.
const SCHEMA_LINES: [&str; 2] = ["#:schema ", "# For completion in an editor: "];

/// The name of a vehicle, where it stands in the file.
#[derive(Deserialize)]
struct Named {
    name: Spanned<String>,
}

/// The file of a robot.
pub(crate) fn robot(name: &str) -> Option<&'static str> {
    let found = ROBOTS.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| *text)
}

/// The text of a vehicle with another name: of a built-in one, a robot or a .toml file.
pub(crate) fn like(like: &str, name: &str) -> Result<String, Error> {
    let source = match robot(like) {
        Some(text) => Source::text(format!("robot {like}"), text),
        None => Source::vehicle(like, None).map_err(|error| with_robots(error, like))?,
    };
    // What is no vehicle is rejected under its own file's name.
    Vehicle::from_source(&source, &[])?;
    Ok(renamed(&source.text, name))
}

/// The existing names, including the robots'.
fn with_robots(error: Error, name: &str) -> Error {
    let Error::UnknownName { kind, .. } = error else {
        return error;
    };
    let robots = ROBOTS.iter().map(|(name, _)| *name);
    let known: Vec<_> = builtin_vehicles().into_iter().chain(robots).collect();
    Error::UnknownName {
        kind,
        name: name.into(),
        known: format!("{}, or the path of a .toml file", known.join(", ")),
    }
}

/// The text without the line of its schema, under another name.
fn renamed(text: &str, name: &str) -> String {
    let mut text = text.to_owned();
    // The text of a vehicle, which has a name.
    if let Ok(named) = toml::from_str::<Named>(&text) {
        text.replace_range(named.name.span(), &format!("{name:?}"));
    }
    match text.split_once('\n') {
        Some((first, rest)) if SCHEMA_LINES.iter().any(|line| first.starts_with(line)) => rest.into(),
        _ => text,
    }
}

/// What a robot's file is, in a line: its first comment.
pub(crate) fn in_a_line(name: &str) -> &'static str {
    let first = robot(name).and_then(|text| text.lines().next());
    first.unwrap_or_default().trim_start_matches(['#', ' '])
}

/// How to drive a robot whose name is taken for that of a vehicle; nothing for other names.
pub(crate) fn hint(name: &str) -> Option<String> {
    robot(name).map(|_| format!("omnistep new vehicle my_{name} --template {name}"))
}
