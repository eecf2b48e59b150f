//! State as bytes and back: the only place that writes a snapshot's bytes, and empty without the feature `snapshots`.

use postcard::Error;
use serde::{Serialize, de::DeserializeOwned};

/// Whether snapshots are built in. Without them neither serialisation of engines nor of controllers is compiled.
const BUILT_IN: bool = cfg!(feature = "snapshots");

/// Refuses what needs the bytes in a build that has none.
pub(crate) fn check_built_in() -> Result<(), crate::Error> {
    if BUILT_IN {
        return Ok(());
    }
    Err(crate::Error::Snapshot {
        reason: "this build of omni-sim is without its feature `snapshots`".into(),
    })
}

/// A state as bytes.
pub(crate) fn to_bytes<T: Serialize>(state: &T) -> Result<Vec<u8>, Error> {
    if BUILT_IN {
        postcard::to_allocvec(state)
    } else {
        Err(Error::NotYetImplemented)
    }
}

/// A state out of all the bytes.
pub(crate) fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Error> {
    match take_from_bytes(bytes)? {
        (state, []) => Ok(state),
        _ => Err(Error::DeserializeBadEncoding),
    }
}

/// A state out of the first bytes, and the rest.
pub(crate) fn take_from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, &[u8]), Error> {
    if BUILT_IN {
        postcard::take_from_bytes(bytes)
    } else {
        Err(Error::NotYetImplemented)
    }
}
