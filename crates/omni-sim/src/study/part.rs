//! A part that grows with every row: a program that is killed loses no row that was done.

use std::time::{Duration, Instant, SystemTime};

use super::store::named;
use super::{Row, Store};
use crate::Error;

/// A part is whole when it has this many rows or was begun that long ago. Until then it has a name that other programs do
/// not look for: they would not like a file that is replaced while they read it.
const MOST_ROWS: usize = 1000;
const LONGEST: Duration = Duration::from_secs(5);

/// The part that rows are added to.
pub(super) struct Part<'a> {
    store: &'a Store,
    name: Option<String>,
    rows: Vec<Row>,
    begun: Instant,
    of_batch: bool,
}

impl<'a> Part<'a> {
    /// Parts of its own, one after the other.
    pub(super) fn new(store: &'a Store) -> Self {
        Self {
            store,
            name: None,
            rows: Vec::new(),
            begun: Instant::now(),
            of_batch: false,
        }
    }

    /// The part of a batch, with the rows that it has already.
    pub(super) fn of_batch(store: &'a Store, name: String, rows: Vec<Row>) -> Self {
        Self {
            name: Some(name),
            rows,
            of_batch: true,
            ..Self::new(store)
        }
    }

    /// Writes some more rows; they are on the disk when this returns.
    pub(super) fn add(&mut self, mut rows: Vec<Row>) -> Result<(), Error> {
        if self.rows.is_empty() {
            self.begun = Instant::now();
        }
        self.rows.append(&mut rows);
        let name = self.name.get_or_insert_with(|| own_name(&self.rows));
        self.store.grow(name, &self.rows)?;
        if !self.of_batch && (self.rows.len() >= MOST_ROWS || self.begun.elapsed() >= LONGEST) {
            self.finish()?;
        }
        Ok(())
    }

    /// Gives the part its name.
    pub(super) fn finish(&mut self) -> Result<(), Error> {
        match self.name.take() {
            Some(name) if !self.rows.is_empty() => self.store.seal(&name, &std::mem::take(&mut self.rows)),
            _ => Ok(()),
        }
    }
}

/// A name that no other program gives: on a file system without locks two may compute the same runs, and neither may
/// replace the other's part.
fn own_name(rows: &[Row]) -> String {
    let now = SystemTime::UNIX_EPOCH
        .elapsed()
        .map_or(0, |since| since.as_nanos());
    let own = format!("{} {now}", std::process::id());
    named(rows.iter().map(|row| row.key.as_str()).chain([own.as_str()]))
}
