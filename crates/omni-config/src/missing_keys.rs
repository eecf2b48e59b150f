//! Every key that a file lacks, found in one reading.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::kind_tables::INNER_KEY;

/// Keys looked for at most: more are not read.
const MOST: usize = 40;
/// Characters of a message that name them.
const SHOWN: usize = 80;

/// A part of the way to a value in a file.
#[derive(Clone, PartialEq)]
enum Step {
    Key(String),
    Index(usize),
}

/// The first thing that is wrong with a value: where, and serde's words about it.
struct Trouble {
    place: Vec<Step>,
    message: String,
}

/// `, also ...` with the keys that are missing beside the first one, or nothing: each is filled in
/// with some value of a type that fits until what is wrong is no missing key.
pub(crate) fn others_missing<T: DeserializeOwned>(mut value: Value) -> String {
    let mut found = Vec::new();
    let mut trouble = first_trouble::<T>(&value);
    while found.len() < MOST {
        let Some(place) = trouble.as_ref().and_then(Trouble::missing) else {
            break;
        };
        let Some(next) = filled::<T>(&mut value, &place) else {
            found.push(written(&place));
            break;
        };
        found.push(written(&place));
        trouble = next;
    }
    listed(found.get(1..).unwrap_or_default())
}

/// Puts in some value whose type fits, and says what is wrong then; nothing if none fits.
fn filled<T: DeserializeOwned>(value: &mut Value, place: &[Step]) -> Option<Option<Trouble>> {
    let some: [Value; 7] = [
        1.0.into(),
        1.into(),
        true.into(),
        "a".into(),
        vec![1.0; 2].into(),
        vec![1.0; 3].into(),
        Table::new().into(),
    ];
    some.into_iter().find_map(|candidate| {
        let is_table = candidate.is_table();
        put(value, place, candidate)?;
        let trouble = first_trouble::<T>(value);
        let refused = trouble
            .as_ref()
            .is_some_and(|trouble| trouble.place == place && !(is_table && trouble.missing().is_some()));
        (!refused).then_some(trouble)
    })
}

fn first_trouble<T: DeserializeOwned>(value: &Value) -> Option<Trouble> {
    use serde_path_to_error::Segment;
    let error = serde_path_to_error::deserialize::<_, T>(value.clone()).err()?;
    let steps = error.path().iter().filter_map(|segment| match segment {
        Segment::Seq { index } => Some(Step::Index(*index)),
        Segment::Map { key } => Some(Step::Key(key.clone())),
        _ => None,
    });
    let mut place: Vec<_> = steps.collect();
    let message = error.inner().message();
    let inside = message
        .strip_prefix(INNER_KEY)
        .and_then(|rest| rest.split_once(INNER_KEY));
    let message = match inside {
        Some((inner, message)) => {
            place.extend(inner.split('.').map(|key| Step::Key(key.to_owned())));
            message
        }
        None => message,
    };
    Some(Trouble {
        place,
        message: message.to_owned(),
    })
}

impl Trouble {
    /// Path of the missing key, if the error is a missing key.
    fn missing(&self) -> Option<Vec<Step>> {
        let (key, _) = self.message.strip_prefix("missing field `")?.split_once('`')?;
        let key = Step::Key(key.to_owned());
        Some(self.place.iter().cloned().chain([key]).collect())
    }
}

/// Puts a value at a place whose table is there.
fn put(mut value: &mut Value, place: &[Step], new: Value) -> Option<()> {
    let (Step::Key(last), before) = place.split_last()? else {
        return None;
    };
    for step in before {
        value = match step {
            Step::Key(key) => value.get_mut(key)?,
            Step::Index(index) => value.get_mut(index)?,
        };
    }
    value.as_table_mut()?.insert(last.clone(), new);
    Some(())
}

fn written(place: &[Step]) -> String {
    place.iter().fold(String::new(), |before, step| match step {
        Step::Index(index) => format!("{before}[{index}]"),
        Step::Key(key) if before.is_empty() => key.clone(),
        Step::Key(key) => format!("{before}.{key}"),
    })
}

/// As many as fit, and how many more.
fn listed(keys: &[String]) -> String {
    let mut text = String::new();
    for (i, key) in keys.iter().enumerate() {
        if text.len() + key.len() > SHOWN {
            return format!("{text} and {} more", keys.len() - i);
        }
        text += if i == 0 { ", also " } else { ", " };
        text += key;
    }
    text
}
