//! Tables with a `kind`: an error names the key inside, which serde's own tagged enums do not.

use serde::de::{Deserialize, Deserializer, Error};
use toml::{Table, Value};

/// Around the key inside, in an error's message: [`crate::load`] joins it to the path of the table.
pub(super) const INNER_KEY: char = '\u{1f}';

/// Reads `{ kind = "x", ... }` by way of the externally tagged `{ x = { ... } }`, which `external` reads.
pub(super) fn by_kind<'de, D, T>(
    deserializer: D,
    external: fn(serde_path_to_error::Deserializer<'_, '_, Value>) -> Result<T, toml::de::Error>,
) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
{
    let mut table = Table::deserialize(deserializer)?;
    let kind = match table.remove("kind") {
        Some(Value::String(kind)) => kind,
        Some(other) => return Err(Error::custom(format!("kind: {other}, allowed: a string"))),
        None => return Err(Error::missing_field("kind")),
    };
    let value = Value::Table(Table::from_iter([(kind.clone(), Value::Table(table))]));
    let mut track = serde_path_to_error::Track::new();
    external(serde_path_to_error::Deserializer::new(value, &mut track)).map_err(|error| {
        let path = track.path().to_string();
        let key = path
            .strip_prefix(&kind)
            .map_or("kind", |rest| rest.trim_start_matches('.'));
        let message = error.message();
        Error::custom(if key.is_empty() {
            message.to_owned()
        } else {
            format!("{INNER_KEY}{key}{INNER_KEY}{message}")
        })
    })
}

/// Implements `Deserialize` for an enum whose mirror `$external` says what each kind holds.
macro_rules! deserialize_by_kind {
    ($enum:ty, $external:ident) => {
        impl<'de> serde::Deserialize<'de> for $enum {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                crate::kind_tables::by_kind(deserializer, |value| $external::deserialize(value))
            }
        }
    };
}
pub(super) use deserialize_by_kind;
