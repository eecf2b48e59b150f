//! A file inside another one, as a data URL, so that a log can be run again.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Deserializer, de};

/// Bytes behind a prefix such as `data:image/png;base64,`.
pub(crate) fn data_url(prefix: &str, bytes: &[u8]) -> String {
    format!("{prefix}{}", STANDARD.encode(bytes))
}

/// Decodes the result of [`data_url`].
pub(crate) fn bytes_of<'de, D: Deserializer<'de>>(
    prefix: &str,
    deserializer: D,
) -> Result<Vec<u8>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let encoded = text
        .strip_prefix(prefix)
        .ok_or_else(|| de::Error::custom(format!("allowed: a file, or {prefix}...")))?;
    STANDARD.decode(encoded).map_err(de::Error::custom)
}
