//! The name of a body, where metrics are copied.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Names in files are no longer.
const MOST: usize = 40;

/// The name of a body of a vehicle.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct BodyName {
    bytes: [u8; MOST],
    length: usize,
}

impl BodyName {
    /// None if it is longer than a file's names are: 40 bytes.
    #[must_use]
    pub(crate) fn new(name: &str) -> Option<Self> {
        let mut bytes = [0; MOST];
        bytes.get_mut(..name.len())?.copy_from_slice(name.as_bytes());
        Some(Self {
            bytes,
            length: name.len(),
        })
    }

    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        // It was text, whole.
        std::str::from_utf8(&self.bytes[..self.length]).unwrap_or_default()
    }
}

impl fmt::Display for BodyName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Debug for BodyName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

impl Serialize for BodyName {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for BodyName {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        Self::new(&name).ok_or_else(|| de::Error::custom(format!("{name:?}, allowed: at most {MOST} bytes")))
    }
}
