//! Rows of several parts, merged.

use std::collections::{BTreeMap, BTreeSet};

use crate::Row;

/// Rows by their keys, from several parts: one without an error before one with.
#[derive(Debug, Default)]
pub(crate) struct MergedRows(BTreeMap<String, Row>);

impl MergedRows {
    pub(crate) fn add(&mut self, rows: Vec<Row>) {
        for row in rows {
            let known = self.0.get(&row.key);
            if known.is_none_or(|known| known.error.is_some() && row.error.is_none()) {
                self.0.insert(row.key.clone(), row);
            }
        }
    }

    pub(crate) fn has_all(&self, keys: &BTreeSet<String>) -> bool {
        keys.iter().all(|key| self.0.contains_key(key))
    }

    pub(crate) fn list(self) -> Vec<Row> {
        self.0.into_values().collect()
    }

    pub(crate) fn keys(self) -> BTreeSet<String> {
        self.0.into_keys().collect()
    }
}
