//! Areas of a map: polygons with a friction of their own, or to keep out of.

use crate::error::check_argument;
use crate::grid::ORIGIN_M;
use crate::{Error, Point};

/// Most corners of an area.
const MOST_CORNERS: usize = 1000;

/// A polygon in the world.
///
/// ```
/// let area = omni_plan::Area::polygon(&[[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]])?;
/// assert!(area.contains([0.5, 0.5]) && !area.contains([1.5, 1.5]));
/// # Ok::<(), omni_plan::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Area {
    corners_m: Vec<Point>,
}

impl Area {
    /// A polygon of 3 to 1000 corners, each within 1e5 m of the world's origin.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn polygon(corners_m: &[Point]) -> Result<Self, Error> {
        check_argument("corners", corners_m.len() as f64, 3.0, MOST_CORNERS as f64)?;
        for coordinate in corners_m.iter().flatten() {
            check_argument("corner", *coordinate, -ORIGIN_M, ORIGIN_M)?;
        }
        Ok(Self {
            corners_m: corners_m.to_vec(),
        })
    }

    /// A rectangle along the world's axes, from and to along x, then along y \[m\].
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn rectangle([from_x, to_x]: Point, [from_y, to_y]: Point) -> Result<Self, Error> {
        Self::polygon(&[[from_x, from_y], [to_x, from_y], [to_x, to_y], [from_x, to_y]])
    }

    /// Whether this position is in it. By the number of sides that a ray crosses.
    #[must_use]
    pub fn contains(&self, [x, y]: Point) -> bool {
        let mut inside = false;
        let mut before = self.corners_m.last().copied().unwrap_or_default();
        for corner in &self.corners_m {
            let between = (before[1] > y) != (corner[1] > y);
            if between {
                let part = (y - before[1]) / (corner[1] - before[1]);
                if x < before[0] + part * (corner[0] - before[0]) {
                    inside = !inside;
                }
            }
            before = *corner;
        }
        inside
    }
}
