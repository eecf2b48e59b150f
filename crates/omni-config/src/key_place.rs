//! The place that a misplaced key belongs to, and an example of one that is missing or of the wrong type.

use toml::{Table, Value};

use crate::Error;

/// An error with a hint from the whole file: the place of a key that is in another table, such as `terrain.friction`
/// for a `friction` at the top level, and an example of a key that is missing or whose value is of another type.
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
