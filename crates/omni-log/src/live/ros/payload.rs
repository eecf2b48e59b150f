//! Messages as bytes: this crate encodes and decodes them itself, so that a log and ROS 2 have the same.

use std::fmt;

use ros2_client::{Message, MessageTypeName, QosProfile, qos};
use serde::de::{Deserialize, DeserializeSeed, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Longest accepted message \[bytes\].
const LONGEST: usize = 64 << 10;
/// Messages that are kept for a reader that is behind.
const DEPTH: usize = 10;

/// A message in CDR, without its encapsulation header.
#[derive(Clone)]
pub(super) struct Cdr(pub(super) Vec<u8>);

impl Serialize for Cdr {
    /// Bytes one behind another: neither a length nor a gap comes between.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut bytes = serializer.serialize_tuple(self.0.len())?;
        for byte in &self.0 {
            bytes.serialize_element(byte)?;
        }
        bytes.end()
    }
}

impl<'de> Deserialize<'de> for Cdr {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Whole.deserialize(deserializer).map(Self)
    }
}

impl Message for Cdr {}

/// Takes what there is of a message, whatever its type; nothing of one that is too long.
#[derive(Clone, Copy)]
pub(super) struct Whole;

impl<'de> DeserializeSeed<'de> for Whole {
    type Value = Vec<u8>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Vec<u8>, D::Error> {
        deserializer.deserialize_tuple(LONGEST + 1, self)
    }
}

impl<'de> Visitor<'de> for Whole {
    type Value = Vec<u8>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut bytes: A) -> Result<Vec<u8>, A::Error> {
        let mut all = Vec::new();
        // The end of the message is an error of the next element: its length is not in it.
        while let Ok(Some(byte)) = bytes.next_element() {
            all.push(byte);
        }
        if all.len() > LONGEST {
            all.clear();
        }
        Ok(all)
    }
}

/// A type such as `nav_msgs/msg/Odometry`, by its parts.
pub(super) fn type_name(full: &str) -> MessageTypeName {
    let (package, name) = full.split_once("/msg/").unwrap_or(("", full));
    MessageTypeName::new(package, name)
}

/// Reliable, and never blocked by a reader that does not read its messages.
pub(super) fn reliable() -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(qos::WhenFull::Fail)
        .history(qos::History::KeepLast { depth: DEPTH })
}

/// The same, with the last message kept for who comes later.
pub(super) fn latched() -> QosProfile {
    reliable()
        .durability(qos::Durability::TransientLocal)
        .history(qos::History::KeepLast { depth: 1 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use byteorder::LittleEndian;
    use cdr_encoding::CdrDeserializer;

    #[test]
    fn bytes_go_out_as_they_are_and_come_back_to_their_last() {
        let message: Vec<u8> = (0..=250).collect();
        let encoded = cdr_encoding::to_vec::<_, LittleEndian>(&Cdr(message.clone())).expect("bytes");
        assert_eq!(encoded, message);
        let mut reader = CdrDeserializer::<LittleEndian>::new(&encoded);
        assert_eq!(Whole.deserialize(&mut reader).expect("bytes"), message);
    }

    #[test]
    fn a_message_that_is_too_long_is_not_kept() {
        let long = vec![7; LONGEST + 1];
        let mut reader = CdrDeserializer::<LittleEndian>::new(&long);
        assert_eq!(Whole.deserialize(&mut reader).expect("bytes"), Vec::<u8>::new());
    }
}
