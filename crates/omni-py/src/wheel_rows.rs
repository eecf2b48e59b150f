//! Arrays of one number for each wheel that belong together, row by row.

use pyo3::prelude::*;

use crate::arrays::{Rows, as_many_or_one, each_row};

/// Rows of one number for each wheel. The first array says how many columns and rows there are; one row serves for all.
pub(crate) fn wheels<const K: usize>(
    given: [(&'static str, &Bound<'_, PyAny>); K],
) -> PyResult<(usize, Vec<Rows>)> {
    let (first_name, first) = given[0];
    let (columns, first) = Rows::of_wheels(first_name, first)?;
    let count = first.len();
    let mut rows = vec![first];
    for &(name, value) in &given[1..] {
        let each = Rows::read(name, value, columns)?;
        if each.len() != count && each.len() != 1 {
            return Err(as_many_or_one((name, each.len()), "row", (first_name, count)));
        }
        rows.push(each);
    }
    Ok((columns, rows))
}

/// Row i of rows; the only one of a single row.
fn row<const N: usize>(rows: &Rows, i: usize) -> [f64; N] {
    let (each, _) = rows.values.as_chunks();
    let last = each.len() - 1;
    each[i.min(last)]
}

/// `of` for the rows of `K` arrays that are beside each other: `M` numbers each, one after the other.
pub(crate) fn every<const K: usize, const N: usize, const M: usize>(
    py: Python<'_>,
    rows: &[Rows],
    of: impl Fn([[f64; N]; K]) -> [f64; M] + Sync,
) -> PyResult<Vec<f64>> {
    let mut values = Vec::with_capacity(M * rows[0].len());
    each_row(py, rows[0].len(), |i| {
        values.extend(of(core::array::from_fn(|k| row(&rows[k], i))));
    })?;
    Ok(values)
}
