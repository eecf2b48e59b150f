//! A grid of square cells in the world.

use serde::Serialize;

use crate::error::check_argument;
use crate::{Error, Point};

/// Most cells of a grid: 20 x 20 m at 1 cm.
pub(crate) const MOST_CELLS: usize = 4_000_000;
/// Smallest and largest cells \[m\].
pub(crate) const RESOLUTION_M: [f64; 2] = [1e-3, 10.0];
/// Largest distance of the origin from the world's origin \[m\].
pub(crate) const ORIGIN_M: f64 = 1e5;

/// A grid: `columns` cells along x, `rows` along y, row 0 at the least y.
///
/// ```
/// let grid = omni_plan::Grid::new(4, 3, 0.5, [-1.0, 0.0])?;
/// assert_eq!(grid.cell_of([0.3, 0.9]), Some([2, 1]));
/// assert_eq!(grid.centre_of([2, 1]), [0.25, 0.75]);
/// assert_eq!(grid.cell_of([1.1, 0.9]), None);
/// # Ok::<(), omni_plan::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Grid {
    /// Cells along x.
    pub columns: usize,
    /// Cells along y.
    pub rows: usize,
    /// Edge of a cell \[m\].
    pub resolution_m: f64,
    /// World x and y of the outer corner of the first cell \[m\].
    pub origin_m: Point,
}

impl Grid {
    /// A grid with cells of `resolution_m` (0.001 to 10 m), whose lower left corner is at `origin_m` (within 1e5 m).
    ///
    /// # Errors
    /// If a number is out of its range: a grid has 3 x 3 to 4 million cells.
    pub fn new(columns: usize, rows: usize, resolution_m: f64, origin_m: Point) -> Result<Self, Error> {
        check_argument("resolution_m", resolution_m, RESOLUTION_M[0], RESOLUTION_M[1])?;
        check_argument("origin_m[0]", origin_m[0], -ORIGIN_M, ORIGIN_M)?;
        check_argument("origin_m[1]", origin_m[1], -ORIGIN_M, ORIGIN_M)?;
        if columns < 3 || rows < 3 || columns.saturating_mul(rows) > MOST_CELLS {
            return Err(Error::Argument {
                name: "cells",
                value: format!("{columns} x {rows}"),
                allowed: format!("3 x 3 to {MOST_CELLS} cells"),
            });
        }
        Ok(Self {
            columns,
            rows,
            resolution_m,
            origin_m,
        })
    }

    /// Column and row of the cell at a place; none outside.
    #[must_use]
    pub fn cell_of(&self, [x, y]: Point) -> Option<[usize; 2]> {
        let column = (x - self.origin_m[0]) / self.resolution_m;
        let row = (y - self.origin_m[1]) / self.resolution_m;
        let inside = column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        inside.then_some([column as usize, row as usize])
    }

    /// The middle of a cell \[m\].
    #[must_use]
    pub fn centre_of(&self, [column, row]: [usize; 2]) -> Point {
        [
            self.origin_m[0] + (column as f64 + 0.5) * self.resolution_m,
            self.origin_m[1] + (row as f64 + 0.5) * self.resolution_m,
        ]
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Index of a cell in an array, row by row.
    pub(crate) fn index(&self, column: usize, row: usize) -> usize {
        row * self.columns + column
    }

    /// The place of so many cells from the origin's corner \[m\].
    pub(crate) fn place_of(&self, [u, v]: Point) -> Point {
        [
            self.origin_m[0] + u * self.resolution_m,
            self.origin_m[1] + v * self.resolution_m,
        ]
    }
}
