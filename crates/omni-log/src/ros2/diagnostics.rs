//! Messages about the health of a part.

use serde::{Deserialize, Serialize};

use super::geometry::Header;

/// `diagnostic_msgs/msg/DiagnosticArray`: parts and what is wrong with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// Time; the frame is unused.
    pub header: Header,
    /// One entry per part.
    pub status: Vec<DiagnosticStatus>,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`: a part and what is wrong with it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// [`DiagnosticStatus::OK`], [`DiagnosticStatus::WARN`] or [`DiagnosticStatus::ERROR`].
    pub level: u8,
    /// Node and part.
    pub name: String,
    /// What is wrong with it, or that nothing is.
    pub message: String,
    /// Which hardware it is of.
    pub hardware_id: String,
    /// More about it.
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// Nothing is wrong.
    pub const OK: u8 = 0;
    /// It works, but not as well as it could.
    pub const WARN: u8 = 1;
    /// It does not work.
    pub const ERROR: u8 = 2;
}

/// `diagnostic_msgs/msg/KeyValue`: a name and a value.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// The name.
    pub key: String,
    /// The value as text.
    pub value: String,
}
