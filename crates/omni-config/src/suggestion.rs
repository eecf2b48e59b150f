//! Suggestions for a misspelt name.

use toml::{Table, Value};

use crate::Error;

/// What something is called here, and what others call it.
const ALIASES: [(&str, &[&str]); 6] = [
    ("independent", &["pid"]),
    ("bumps", &["sill", "cable", "threshold", "hump", "rail"]),
    ("step", &["curb", "kerb", "ledge", "edge"]),
    ("ditch", &["gap", "gutter", "trench", "groove"]),
    ("ramp", &["slope", "incline"]),
    ("flat", &["plane", "floor", "level"]),
];

/// Likeness (Jaro and Winkler's, 0 to 1) from which on a name is taken for a slip of another.
const ALIKE: f64 = 0.8;

/// ` (did you mean "step"?)` where one of the names is much like this one, else nothing: to be put behind the name in a message.
///
/// ```
/// use omni_config::did_you_mean;
/// assert_eq!(did_you_mean("setp", ["step", "flat"]), " (did you mean \"step\"?)");
/// assert_eq!(did_you_mean("moon", ["step", "flat"]), "");
/// ```
#[must_use]
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, known).map_or_else(String::new, |near| format!(" (did you mean {near:?}?)"))
}

/// The most like of the names, if any is much like this one.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Names end at 40 letters, keys somewhat later; what is longer is no slip of one.
    if name.len() > 80 {
        return None;
    }
    let name = name.to_lowercase();
    let known: Vec<_> = known.into_iter().collect();
    // What is called otherwise here.
    if let Some((ours, _)) = ALIASES.iter().find(|(_, theirs)| theirs.contains(&name.as_str()))
        && let Some(found) = known.iter().find(|known| *known == ours)
    {
        return Some(found);
    }
    let alike = |known: &'a str| (likeness(&name, &known.to_lowercase()), known);
    let best = known.into_iter().map(alike).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(likeness, _)| *likeness > ALIKE)
        .map(|(_, known)| known)
}

/// How alike a name is to another, or to words in it, as `noise` to `gyro_noise_rad_s`, 0 to 1.
fn likeness(name: &str, known: &str) -> f64 {
    let words: Vec<_> = known.split('_').collect();
    let runs = (0..words.len()).flat_map(|from| (from + 1..=words.len()).map(move |to| (from, to)));
    let of_run = |(from, to)| {
        let run = words.get(from..to).unwrap_or_default().join("_");
        match run == name {
            true => PART,
            // Words of a few letters are like too many others.
            false if run.len() < 4 => 0.0,
            false => PART * strsim::jaro_winkler(name, &run),
        }
    };
    runs.map(of_run).fold(strsim::jaro_winkler(name, known), f64::max)
}

/// What likeness to a part of a name counts for, against likeness to the whole of it.
const PART: f64 = 0.9;

/// A refusal with what the whole file shows about it: the place of a key that is in another table, as `terrain.friction` for a `friction`
/// at the top level, and an example of a key that is missing or whose value is of another type.
pub(crate) fn with_place(mut error: Error, whole: impl FnOnce() -> Option<Table>) -> Error {
    let Error::Key { key, message, .. } = &mut error else {
        return error;
    };
    let named = |start: &str| Some(message.strip_prefix(start)?.split_once('`')?.0.to_owned());
    let is_wrong_type = message.contains("expected") && message.starts_with("invalid ");
    let (unknown, missing) = (named("unknown field `"), named("missing field `"));
    if unknown.is_none() && missing.is_none() && !is_wrong_type {
        return error;
    }
    let whole = Value::Table(whole().unwrap_or_default());
    if let Some(name) = unknown {
        let mut places = Vec::new();
        collect(&whole, "", &mut places);
        let of_table = |place: &&String| place.rsplit('.').next() == Some(&name) && !place.contains(".0.");
        let found: Vec<_> = places.iter().filter(of_table).cloned().collect();
        // That very name elsewhere is meant rather than one alike here; in a table of another kind it is no key at all.
        if !found.is_empty() && found.iter().all(|place| place != key) {
            *message = format!("unknown field `{name}`; use `{}`", found.join("` or `"));
        }
        return error;
    }
    let place = match (missing, key.as_str()) {
        (Some(name), "top level") => name,
        (Some(name), table) => format!("{table}.{name}"),
        (None, key) => key.to_owned(),
    };
    if let Some(example) = example(&whole, &place) {
        *message += &format!("; for example {example}");
    }
    error
}

/// What a file says at a place such as `body[1].mass_kg`, as it is written; nothing that is long.
fn example(whole: &Value, place: &str) -> Option<String> {
    let (mut value, mut name) = (whole, "");
    for part in place.split(['.', '[']) {
        value = match (value, part.strip_suffix(']')) {
            (Value::Array(items), Some(index)) => items.get(index.parse::<usize>().ok()?).or(items.first())?,
            (Value::Table(table), None) => table.get(part)?,
            _ => return None,
        };
        name = if part.ends_with(']') { name } else { part };
    }
    let written = match value {
        Value::Table(_) => format!("[{place}]"),
        plain => format!("{name} = {plain}"),
    };
    (written.len() <= LONGEST_EXAMPLE).then_some(written)
}

/// Longest example in a message, in bytes.
const LONGEST_EXAMPLE: usize = 60;

/// The keys of a value and of what is in it, those in tables before those deeper inside.
fn collect(value: &Value, before: &str, places: &mut Vec<String>) {
    let inside: Vec<_> = match value {
        Value::Table(table) => table.iter().map(|(key, inner)| (key.clone(), inner)).collect(),
        // The elements of a list are alike.
        Value::Array(items) => items
            .iter()
            .take(1)
            .map(|inner| ("0".to_owned(), inner))
            .collect(),
        _ => return,
    };
    let path = |key: &str| match before {
        "" => key.to_owned(),
        before => format!("{before}.{key}"),
    };
    places.extend(inside.iter().map(|(key, _)| path(key)));
    for (key, inner) in inside {
        collect(inner, &path(&key), places);
    }
}

/// Keys that are written out before serde reads a table, which lists only what it reads, by keys of that table.
const WRITTEN_OUT: [(&str, &str); 3] = [
    ("`coupling`, `wheel`", ", `mecanum4`, `omni3`, `total_mass_kg`"),
    (
        "`stall_torque_n_m`",
        ", `stall_torque_kg_cm`, `stall_torque_oz_in`, `rotor_inertia_kg_m2`, `gear_ratio`",
    ),
    ("`roller_angle_rad`", ", `roller_angle_deg`"),
];

/// serde's message about a key or a kind that there is not, with the one that was meant.
pub(crate) fn with_nearest(message: String) -> String {
    let unknown = ["unknown field `", "unknown variant `"];
    let Some(rest) = unknown.iter().find_map(|start| message.strip_prefix(start)) else {
        return message;
    };
    let Some((name, read)) = rest.split_once("`, expected ") else {
        return message;
    };
    let written_out = WRITTEN_OUT.iter().find(|(keys, _)| read.contains(keys));
    let rest = &format!("{read}{}", written_out.map_or("", |(_, more)| more));
    // Every second piece between backticks is a name.
    let near = nearest(name, rest.split('`').skip(1).step_by(2));
    let meant = near.map_or_else(String::new, |near| format!(" (did you mean `{near}`?)"));
    let start = message
        .split_at(message.len() - read.len() - ", expected ".len())
        .0;
    format!("{start}{meant}, expected {rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_a_key_is_answered_with_the_key_and_anything_else_with_what_there_is() {
        let said = |name: &str| {
            with_nearest(format!(
                "unknown field `{name}`, expected one of `friction`, `height_m`, `start_x_m`"
            ))
        };
        assert_eq!(
            said("hight_m"),
            "unknown field `hight_m` (did you mean `height_m`?), expected one of `friction`, `height_m`, `start_x_m`"
        );
        assert_eq!(
            said("colour"),
            "unknown field `colour`, expected one of `friction`, `height_m`, `start_x_m`"
        );
        let alone = "unknown field `radios`, expected `radius`".to_owned();
        assert_eq!(
            with_nearest(alone),
            "unknown field `radios` (did you mean `radius`?), expected `radius`"
        );
        assert!(said("friktion_coefficient").contains("did you mean `friction`"));
        assert!(said("start_m").contains("did you mean `start_x_m`"));
        let kind = with_nearest("unknown variant `Sill`, expected one of `step`, `bumps`".to_owned());
        assert!(kind.contains("did you mean `bumps`"), "{kind}");
        let other = "missing field `name`".to_owned();
        assert_eq!(with_nearest(other.clone()), other);
    }
}
