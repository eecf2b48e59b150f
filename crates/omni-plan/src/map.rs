//! A map: heights on a grid, walls, friction and areas to keep out of.

mod csv_table;
mod map_server;
mod picture;

use crate::error::check_argument;
use crate::{Area, Error, Grid, Point};

pub use map_server::Elevation;
pub use picture::PictureScale;

/// Highest and lowest ground \[m\].
const HEIGHT_M: f64 = 1e4;
/// Greatest friction coefficient.
const FRICTION: f64 = 2.0;
/// Default friction of a map, as in a chart.
const USUAL_FRICTION: f64 = 0.7;

/// Properties of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Cell {
    /// Ground to drive on.
    Free,
    /// A wall, or another thing that no vehicle drives over.
    Occupied,
    /// Never seen.
    Unknown,
}

/// A map.
///
/// ```
/// use omni_plan::{Area, Cell, Grid, Map};
/// let grid = Grid::new(40, 40, 0.1, [0.0, 0.0])?;
/// let heights_m = (0..1600).map(|cell| if cell % 40 < 20 { 0.0 } else { 0.03 }).collect();
/// let map = Map::from_heights(grid, heights_m)?
///     .with_keep_out(Area::rectangle([0.0, 1.0], [0.0, 1.0])?)
///     .with_friction_area(Area::rectangle([2.0, 4.0], [3.0, 4.0])?, 0.1)?;
/// assert_eq!(map.height_m([21, 5]), 0.03);
/// assert_eq!(map.friction([30, 35]), 0.1);
/// assert_eq!(map.cell([5, 5]), Cell::Occupied);
/// # Ok::<(), omni_plan::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    grid: Grid,
    heights_m: Vec<f64>,
    cells: Vec<Cell>,
    friction: Vec<f32>,
}

impl Map {
    /// Ground of these heights \[m\] (within 10 km), row by row, the first row at the least y; its friction is 0.7.
    ///
    /// # Errors
    /// If there are more or fewer heights than cells, or one is out of its range or no number.
    pub fn from_heights(grid: Grid, heights_m: Vec<f64>) -> Result<Self, Error> {
        let cells = grid.cells();
        if heights_m.len() != cells {
            return Err(Error::Argument {
                name: "heights_m",
                value: format!("{} heights", heights_m.len()),
                allowed: format!("{cells}, one a cell"),
            });
        }
        for height in &heights_m {
            check_argument("heights_m", *height, -HEIGHT_M, HEIGHT_M)?;
        }
        Ok(Self {
            grid,
            heights_m,
            cells: vec![Cell::Free; cells],
            friction: vec![USUAL_FRICTION as f32; cells],
        })
    }

    /// Its grid.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Height of a cell \[m\].
    ///
    /// # Panics
    /// If there is no such cell.
    #[must_use]
    pub fn height_m(&self, [column, row]: [usize; 2]) -> f64 {
        self.heights_m[self.grid.index(column, row)]
    }

    /// Properties of a cell.
    ///
    /// # Panics
    /// If there is no such cell.
    #[must_use]
    pub fn cell(&self, [column, row]: [usize; 2]) -> Cell {
        self.cells[self.grid.index(column, row)]
    }

    /// Coulomb friction coefficient of a cell.
    ///
    /// # Panics
    /// If there is no such cell.
    #[must_use]
    pub fn friction(&self, [column, row]: [usize; 2]) -> f64 {
        // As it was given: 0.7, not 0.699999988.
        (1e6 * f64::from(self.friction[self.grid.index(column, row)])).round() / 1e6
    }

    /// The same map with this Coulomb friction coefficient everywhere, 0 to 2.
    ///
    /// # Errors
    /// If it is out of its range.
    pub fn with_friction(mut self, friction: f64) -> Result<Self, Error> {
        check_argument("friction", friction, 0.0, FRICTION)?;
        self.friction.fill(friction as f32);
        Ok(self)
    }

    /// The same map with another friction in an area, 0 to 2: ice, a carpet.
    ///
    /// # Errors
    /// If the friction is out of its range.
    pub fn with_friction_area(mut self, area: Area, friction: f64) -> Result<Self, Error> {
        check_argument("friction", friction, 0.0, FRICTION)?;
        self.each_inside(&area, |map, cell| map.friction[cell] = friction as f32);
        Ok(self)
    }

    /// The same map with an area that no part of the vehicle may enter.
    #[must_use]
    pub fn with_keep_out(mut self, area: Area) -> Self {
        self.each_inside(&area, |map, cell| map.cells[cell] = Cell::Occupied);
        self
    }

    /// Does something with each cell whose middle is in an area.
    fn each_inside(&mut self, area: &Area, mut what: impl FnMut(&mut Self, usize)) {
        let grid = self.grid;
        for row in 0..grid.rows {
            for column in 0..grid.columns {
                let centre: Point = grid.centre_of([column, row]);
                if area.contains(centre) {
                    what(self, grid.index(column, row));
                }
            }
        }
    }
}
