//! A log in memory, for browsers, which have no files.

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::part_file::Place;

/// Receives a log's bytes; the owner of a clone removes them while the log grows.
#[derive(Clone, Debug, Default)]
pub struct InMemory {
    name: PathBuf,
    bytes: Rc<RefCell<Vec<u8>>>,
}

impl InMemory {
    /// Nothing yet, of a log that messages call `name`.
    pub(crate) fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            bytes: Rc::default(),
        }
    }

    /// Bytes written since the last call.
    pub(crate) fn take(&self) -> Vec<u8> {
        self.bytes.take()
    }
}

impl Place for InMemory {
    type Sink = Self;

    fn path(&self) -> &Path {
        &self.name
    }
}

impl Write for InMemory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
