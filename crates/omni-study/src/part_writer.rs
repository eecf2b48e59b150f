//! A part that grows with every row: a killed program loses no finished row.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use crate::part_names::unique;
use crate::{Error, Row, Store};

/// A part is whole when it has this many rows or was begun that long ago. Until then it has a name that
/// other programs do not look for: they would not like a file that is replaced while they read it.
const MOST_ROWS: usize = 1000;
const LONGEST: Duration = Duration::from_secs(5);

/// The part that rows are added to.
pub(crate) struct PartWriter<'a> {
    store: &'a Store,
    name: Option<String>,
    rows: Vec<Row>,
    begun: Instant,
    batch: Option<OfBatch>,
}

/// The name of a batch's part and the keys of its runs.
struct OfBatch {
    name: String,
    keys: BTreeSet<String>,
}

impl<'a> PartWriter<'a> {
    /// Parts of its own, one after the other.
    pub(crate) fn new(store: &'a Store) -> Self {
        Self {
            store,
            name: None,
            rows: Vec::new(),
            begun: Instant::now(),
            batch: None,
        }
    }

    /// What one worker adds to the part of a batch. Others may have the same batch, and none touches another's rows.
    pub(crate) fn of_batch(store: &'a Store, name: String, keys: BTreeSet<String>) -> Self {
        Self {
            name: Some(format!("{name}-{}", unique())),
            batch: Some(OfBatch { name, keys }),
            ..Self::new(store)
        }
    }

    /// Writes some more rows; they are on the disk when this returns.
    pub(crate) fn add(&mut self, mut rows: Vec<Row>) -> Result<(), Error> {
        if self.rows.is_empty() {
            self.begun = Instant::now();
        }
        self.rows.append(&mut rows);
        let name = self.name.get_or_insert_with(unique);
        self.store.grow(name, &self.rows)?;
        if self.batch.is_none() && (self.rows.len() >= MOST_ROWS || self.begun.elapsed() >= LONGEST) {
            self.finish()?;
        }
        Ok(())
    }

    /// Gives the part its name; that of a batch when all of it is done.
    pub(crate) fn finish(&mut self) -> Result<(), Error> {
        if let Some(batch) = &self.batch {
            return self.store.complete_batch(&batch.name, &batch.keys);
        }
        self.rows.clear();
        self.name.take().map_or(Ok(()), |name| self.store.complete(&name))
    }
}
