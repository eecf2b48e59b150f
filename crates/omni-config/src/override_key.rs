//! An override: a key and its value.

use toml::{Table, Value};

use crate::{Error, Source};

/// Parts of a key and its characters at most, more than any key of a file has. Each part may make a
/// table in the one before it, and dropping a million tables in one another overflows the stack.
const MOST_PARTS: usize = 16;
const MOST_CHARACTERS: usize = 200;

/// A key of a scenario or, behind `vehicle.`, of its vehicle, and the value to put there:
/// `terrain.friction=0.5`, `vehicle.motor.stall_torque_n_m=1`, `vehicle.wheel[0].radius_m=0.07` or
/// `vehicle.wheel.0.radius_m` (elements count from 0). An element may be named, as in
/// `vehicle.body.platform.mass_kg`; `vehicle.wheel.*.radius_m` means every wheel.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    key: String,
    value: Value,
}

impl Override {
    /// `value` for `key`. A key of more than 16 parts or 200 characters is rejected where it is used.
    pub fn new(key: impl Into<String>, value: impl Into<Value>) -> Self {
        Self {
            key: dotted(&key.into()),
            value: value.into(),
        }
    }

    /// The overrides of a table, with inner tables flattened: each replaces only the keys that it names.
    pub(crate) fn all_of(table: &Table) -> Vec<Self> {
        let mut all = Vec::new();
        flatten("", table, &mut all);
        all
    }

    /// `key=value`, the value as in TOML; a bare word is a string.
    ///
    /// # Errors
    /// [`Error::Override`] if there is no `=` or no key, or a key of more than 16 parts or 200 characters.
    ///
    /// ```
    /// use omni_config::Override;
    /// assert_eq!(Override::parse("terrain.friction=0.5")?, Override::new("terrain.friction", 0.5));
    /// assert_eq!(Override::parse("control.policy=scale_torques")?, Override::new("control.policy", "scale_torques"));
    /// assert!(Override::parse("friction").is_err());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, Error> {
        let malformed = |message: &str| Error::Override {
            text: text.into(),
            message: message.into(),
        };
        let (key, value) = text
            .split_once('=')
            .ok_or_else(|| malformed("allowed: KEY=VALUE"))?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() {
            return Err(malformed("allowed: KEY=VALUE with a key"));
        }
        let key = dotted(key);
        if let Some(reason) = too_long(&key) {
            return Err(malformed(&reason));
        }
        let parsed = format!("value = {value}")
            .parse::<Table>()
            .ok()
            .and_then(|mut table| table.remove("value"));
        Ok(Self {
            key,
            value: parsed.unwrap_or_else(|| Value::String(value.into())),
        })
    }

    /// The key, elements of lists as `wheel.0`.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// The value to put there.
    #[must_use]
    pub fn value(&self) -> &Value {
        &self.value
    }

    /// Does it replace what stands at this dotted key, alone or with a table around it?
    pub(crate) fn replaces(&self, key: &str) -> bool {
        let inside = key.strip_prefix(&self.key);
        inside.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }

    /// The override without its leading `vehicle.`, if it has one and is not the vehicle's name itself.
    pub(crate) fn of_vehicle(&self) -> Option<Self> {
        self.key.strip_prefix("vehicle.").map(|key| Self {
            key: key.into(),
            value: self.value.clone(),
        })
    }

    /// Puts the value in its place. An unknown key is put there too: reading the table then names it.
    pub(crate) fn apply(&self, source: &Source, table: &mut Table) -> Result<(), Error> {
        let refuse = |reason: String| source.refuse(self.key.clone(), reason);
        if let Some(reason) = too_long(&self.key) {
            return Err(refuse(reason));
        }
        let parts: Vec<&str> = self.key.split('.').collect();
        put_in(table, &parts, &self.value).map_err(refuse)
    }
}

/// Puts a value where the parts of a key lead from a table.
fn put_in(table: &mut Table, parts: &[&str], new: &Value) -> Result<(), String> {
    let Some((part, rest)) = parts.split_first() else {
        return Ok(()); // no key is empty
    };
    let inner = table.entry(*part).or_insert_with(|| Value::Table(Table::new()));
    put(inner, rest, new)
}

/// The same from any value: elements of lists are meant by number, by name, or all of them.
fn put(here: &mut Value, parts: &[&str], new: &Value) -> Result<(), String> {
    let Some((part, rest)) = parts.split_first() else {
        *here = new.clone();
        return Ok(());
    };
    match here {
        Value::Table(table) => put_in(table, parts, new),
        Value::Array(items) => elements(items, part)?
            .into_iter()
            .try_for_each(|i| put(&mut items[i], rest, new)),
        _ => Err(format!(
            "{part:?} is below a plain value, allowed: a key of a table"
        )),
    }
}

/// Which elements of a list a part of a key means.
fn elements(items: &[Value], part: &str) -> Result<Vec<usize>, String> {
    if part == "*" && !items.is_empty() {
        return Ok((0..items.len()).collect());
    }
    // A name that is a number would be mistaken for an element's.
    let is_name = |name: &&str| name.parse::<usize>().is_err();
    let name = |item: &Value| Some(item.get("name")?.as_str()?.to_owned());
    let names: Vec<_> = items.iter().map(name).collect();
    let index = match part.parse::<usize>() {
        Ok(index) => Some(index).filter(|index| *index < items.len()),
        Err(_) => names.iter().position(|name| name.as_deref() == Some(part)),
    };
    index.map(|index| vec![index]).ok_or_else(|| {
        let last = items.len().saturating_sub(1);
        let named: Vec<_> = names
            .iter()
            .flatten()
            .map(String::as_str)
            .filter(is_name)
            .collect();
        let or_name = match named.as_slice() {
            [] => String::new(),
            named => format!(", or a name: {}", named.join(", ")),
        };
        format!("element {part:?}, allowed: * for all, 0 to {last}{or_name}")
    })
}

impl std::fmt::Display for Override {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.value {
            Value::String(text) => write!(f, "{}={text}", self.key),
            value => write!(f, "{}={value}", self.key),
        }
    }
}

/// Why a dotted key cannot be one of a file, if it is too long.
pub(crate) fn too_long(key: &str) -> Option<String> {
    let (parts, characters) = (key.split('.').count(), key.chars().count());
    (parts > MOST_PARTS || characters > MOST_CHARACTERS).then(|| {
        format!(
            "a key of {parts} parts and {characters} characters, allowed: {MOST_PARTS} parts and {MOST_CHARACTERS} characters at most"
        )
    })
}

/// `wheel[2].radius_m`, as messages write it, as `wheel.2.radius_m`.
pub(crate) fn dotted(key: &str) -> String {
    key.replace('[', ".").replace(']', "")
}

fn flatten(above: &str, table: &Table, into: &mut Vec<Override>) {
    for (key, value) in table {
        let key = if above.is_empty() {
            key.clone()
        } else {
            format!("{above}.{key}")
        };
        match value {
            Value::Table(inner) => flatten(&key, inner, into),
            value => into.push(Override::new(key, value.clone())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Scenario, Seeds, Study};

    /// A million parts, and 17; then 201 characters in two parts.
    fn long_keys() -> [String; 3] {
        [1_000_000, 17, 0].map(|parts| match parts {
            0 => format!("terrain.{}", "a".repeat(193)),
            parts => vec!["a"; parts].join("."),
        })
    }

    #[test]
    fn a_key_of_more_than_16_parts_or_200_characters_is_refused_in_one_short_line() {
        let allowed = "allowed: 16 parts and 200 characters at most";
        for key in long_keys() {
            let axis = Axis::new(&*key, vec![1.into()]);
            let of_axis = Study::of_points("long", "step", vec![axis], Seeds::Count(1)).expect_err("refused");
            let file = format!(
                "schema_version = 1\nname = \"long\"\nscenario = \"step\"\nseeds = 1\n[set]\n\"{key}\" = 1\n"
            );
            let study = Study::from_source(&Source::text("y.toml", file)).expect("read");
            for error in [
                Override::parse(&format!("{key}=1")).expect_err("refused"),
                Scenario::load("step", &[Override::new(&*key, 1)]).expect_err("refused"),
                Scenario::load("step", &[Override::new(format!("vehicle.{key}"), 1)]).expect_err("refused"),
                study.points(&[]).expect_err("refused"),
                of_axis,
            ] {
                let said = error.to_string();
                assert!(said.contains(allowed), "{said}");
                assert!(said.len() <= 400 && said.lines().count() == 1, "{said}");
            }
        }
    }

    #[test]
    fn elements_are_named_or_numbered_or_all() {
        let loaded = |name: &str, keys: &[&str]| {
            let keys: Vec<_> = keys
                .iter()
                .map(|key| Override::parse(key).expect("a key"))
                .collect();
            Scenario::load("step", &[&[Override::new("vehicle", name)], &keys[..]].concat())
        };
        let keys = [
            "vehicle.wheel.*.radius_m=0.06",
            "vehicle.wheel.rear_left.radius_m=0.07",
            "vehicle.body.0.mass_kg=9",
        ];
        let scenario = loaded("mecanum4", &keys).expect("whole");
        let vehicle = scenario.vehicle();
        let radii: Vec<_> = vehicle.wheel.iter().map(|wheel| wheel.radius_m).collect();
        assert_eq!(
            (radii, vehicle.body[0].mass_kg),
            (vec![0.06, 0.06, 0.07, 0.06], 9.0)
        );
        // Wheels that are named by numbers are counted: 1 is the second.
        let counted = loaded("chugo7", &["vehicle.wheel.1.mass_kg=2"]).expect("whole");
        assert_eq!(
            counted
                .vehicle()
                .wheel
                .iter()
                .position(|wheel| wheel.mass_kg == 2.0),
            Some(1)
        );
        let message = loaded("mecanum4", &["vehicle.wheel.front.radius_m=1"])
            .expect_err("wrong")
            .to_string();
        let said = "element \"front\", allowed: * for all, 0 to 3, or a name: front_left, front_right";
        assert!(message.contains(said), "{message}");
    }

    #[test]
    fn a_key_of_16_parts_or_200_characters_is_looked_for() {
        for key in [["a"; 16].join("."), format!("terrain.{}", "a".repeat(192))] {
            let set = Override::parse(&format!("{key}=1")).expect("read");
            let said = Scenario::load("step", &[set]).expect_err("refused").to_string();
            assert!(said.contains("unknown field"), "{said}");
        }
    }
}
