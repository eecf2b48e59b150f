//! The names of parts.

use std::hash::{BuildHasher, RandomState};
use std::io::{self, ErrorKind};
use std::path::Path;
use std::time::SystemTime;

use sha2::{Digest, Sha256};

use crate::Error;
use crate::key::hex;

/// How the name of a part ends, for any reader; and while it grows.
pub(crate) const WHOLE: &str = ".parquet";
pub(crate) const GROWING: &str = ".growing";

/// A part's name: 16 hexadecimal digits that say which runs it is of.
pub(crate) fn named<'a>(keys: impl Iterator<Item = &'a str>) -> String {
    let mut digest = Sha256::new();
    keys.for_each(|key| digest.update(key));
    hex(&digest.finalize(), 8)
}

/// A name that is given nowhere else, in this program, in another or on another machine.
pub(crate) fn unique() -> String {
    let now = SystemTime::UNIX_EPOCH
        .elapsed()
        .map_or(0, |since| since.as_nanos());
    // A new one each time, and random in each thread of each program.
    let random = RandomState::new().hash_one(now);
    named([format!("{} {now} {random}", std::process::id()).as_str()].into_iter())
}

pub(crate) fn grows(path: &Path) -> bool {
    file_name(path).ends_with(GROWING)
}

pub(crate) fn file_name(path: &Path) -> &str {
    path.file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default()
}

/// Another process was faster: no error.
pub(crate) fn unless_gone(done: io::Result<()>) -> io::Result<()> {
    match done {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        done => done,
    }
}

pub(crate) fn io_error(path: &Path) -> impl Fn(io::Error) -> Error {
    let path = path.to_owned();
    move |source| Error::Io {
        path: path.clone(),
        source,
    }
}
