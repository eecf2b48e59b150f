//! A part that grows with every row: a program that is killed loses no row that was done.

use std::time::SystemTime;

use super::store::named;
use super::{Row, Store};
use crate::Error;

/// Rows of a part at most: it is written anew, whole, each time it grows.
const MOST_ROWS: usize = 100;

/// The part that rows are added to.
pub(super) struct Part<'a> {
    store: &'a Store,
    name: Option<String>,
    rows: Vec<Row>,
}

impl<'a> Part<'a> {
    /// A part of its own.
    pub(super) fn new(store: &'a Store) -> Self {
        Self {
            store,
            name: None,
            rows: Vec::new(),
        }
    }

    /// The part of a batch, with the rows that it has already.
    pub(super) fn of_batch(store: &'a Store, name: String, rows: Vec<Row>) -> Self {
        Self {
            store,
            name: Some(name),
            rows,
        }
    }

    /// Writes some more rows; they are on the disk when this returns.
    pub(super) fn add(&mut self, mut rows: Vec<Row>) -> Result<(), Error> {
        self.rows.append(&mut rows);
        if self.rows.is_empty() {
            return Ok(());
        }
        let name = self.name.get_or_insert_with(|| own_name(&self.rows));
        self.store.write_as(name, &self.rows)?;
        if self.rows.len() >= MOST_ROWS {
            self.rows.clear();
            self.name = None;
        }
        Ok(())
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
