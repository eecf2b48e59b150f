//! The rectangle that a vehicle covers, and the cells that it covers at a heading.

use serde::{Deserialize, Serialize};

use crate::Error;
use crate::error::check_argument;

/// Longest and widest vehicle \[m\].
const MOST_M: f64 = 20.0;
/// Most cells from the origin to a corner.
const MOST_CELLS: f64 = 2000.0;
/// A side that only touches a cell does not cover it \[cells\].
const TOUCH: f64 = 1e-6;

/// The rectangle that a vehicle covers on the ground, in its own axes.
///
/// ```
/// let chugo7 = omni_plan::Footprint::rectangle(0.74, 0.54)?;
/// assert_eq!((chugo7.front_m, chugo7.left_m), (0.37, 0.27));
/// # Ok::<(), omni_plan::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Footprint {
    /// From the vehicle's origin to its front \[m\].
    pub front_m: f64,
    /// To its rear \[m\].
    pub rear_m: f64,
    /// To its left side \[m\].
    pub left_m: f64,
    /// To its right side \[m\].
    pub right_m: f64,
}

impl Footprint {
    /// A rectangle about the vehicle's origin, 1 cm to 20 m long and wide.
    ///
    /// # Errors
    /// If a length is out of its range.
    pub fn rectangle(length_m: f64, width_m: f64) -> Result<Self, Error> {
        check_argument("length_m", length_m, 0.01, MOST_M)?;
        check_argument("width_m", width_m, 0.01, MOST_M)?;
        Self::new(length_m / 2.0, length_m / 2.0, width_m / 2.0, width_m / 2.0)
    }

    /// A rectangle with these distances from the vehicle's origin to its front, rear, left and
    /// right side, 1 mm to 20 m each.
    ///
    /// # Errors
    /// If a distance is out of its range.
    pub fn new(front_m: f64, rear_m: f64, left_m: f64, right_m: f64) -> Result<Self, Error> {
        let footprint = Self {
            front_m,
            rear_m,
            left_m,
            right_m,
        };
        footprint.check()?;
        Ok(footprint)
    }

    /// It may have come out of a file.
    pub(crate) fn check(&self) -> Result<(), Error> {
        check_argument("front_m", self.front_m, 1e-3, MOST_M)?;
        check_argument("rear_m", self.rear_m, 1e-3, MOST_M)?;
        check_argument("left_m", self.left_m, 1e-3, MOST_M)?;
        check_argument("right_m", self.right_m, 1e-3, MOST_M)
    }

    /// The same rectangle, larger by a distance on every side \[m\].
    #[must_use]
    pub fn inflated(&self, by_m: f64) -> Self {
        Self {
            front_m: self.front_m + by_m,
            rear_m: self.rear_m + by_m,
            left_m: self.left_m + by_m,
            right_m: self.right_m + by_m,
        }
    }

    /// The corners at a heading \[rad\], from the vehicle's origin \[m\], counter-clockwise.
    #[must_use]
    pub fn corners_m(&self, heading_rad: f64) -> [[f64; 2]; 4] {
        let (sin, cos) = heading_rad.sin_cos();
        let turned = |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y];
        [
            [self.front_m, self.left_m],
            [-self.rear_m, self.left_m],
            [-self.rear_m, -self.right_m],
            [self.front_m, -self.right_m],
        ]
        .map(turned)
    }

    /// Its extent in a direction of its own axes \[rad\], from its origin \[m\].
    #[must_use]
    pub fn reach_m(&self, direction_rad: f64) -> f64 {
        let (sin, cos) = direction_rad.sin_cos();
        let along = if cos >= 0.0 { self.front_m } else { -self.rear_m };
        let aside = if sin >= 0.0 { self.left_m } else { -self.right_m };
        along * cos + aside * sin
    }

    /// From the origin to the farthest corner \[m\].
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        self.front_m.max(self.rear_m).hypot(self.left_m.max(self.right_m))
    }

    /// From the origin to the nearest side \[m\].
    #[must_use]
    pub fn inscribed_m(&self) -> f64 {
        self.front_m.min(self.rear_m).min(self.left_m).min(self.right_m)
    }

    /// The width of the narrowest passage that it fits through \[m\].
    #[must_use]
    pub fn narrowest_m(&self) -> f64 {
        (self.front_m + self.rear_m).min(self.left_m + self.right_m)
    }

    /// Is it the same rectangle when it is turned by half a turn?
    pub(crate) fn is_centred(&self) -> bool {
        self.front_m == self.rear_m && self.left_m == self.right_m
    }
}

/// A row of cells that a vehicle covers, from its own cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) row: isize,
    pub(crate) from: isize,
    pub(crate) to: isize,
}

/// The cells that a vehicle covers at a heading, or at one after the other: one run a row, without a gap.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mask {
    pub(crate) runs: Vec<Run>,
}

impl Mask {
    /// All cells that the rectangle touches at one of these headings, with its origin off the middle of its cell \[m\].
    pub(crate) fn new(
        footprint: &Footprint,
        headings_rad: &[f64],
        off_m: [f64; 2],
        resolution_m: f64,
    ) -> Self {
        let mut runs: Vec<Run> = Vec::new();
        let reach = (footprint.radius_m() / resolution_m).min(MOST_CELLS) as isize + 2;
        for row in -reach..=reach {
            let mut run: Option<Run> = None;
            for heading_rad in headings_rad {
                // In cells, from the corner of the own cell.
                let corners = footprint
                    .corners_m(*heading_rad)
                    .map(|corner| [0, 1].map(|k| (corner[k] + off_m[k]) / resolution_m + 0.5));
                if let Some([least, most]) = extent(&corners, row as f64 + TOUCH, (row + 1) as f64 - TOUCH) {
                    let from = (least + TOUCH).floor() as isize;
                    let to = ((most - TOUCH).floor() as isize).max(from);
                    run = Some(match run {
                        None => Run { row, from, to },
                        Some(run) => Run {
                            row,
                            from: run.from.min(from),
                            to: run.to.max(to),
                        },
                    });
                }
            }
            runs.extend(run);
        }
        Self { runs }
    }
}

/// From where to where a convex polygon reaches along x between two values of y.
fn extent(corners: &[[f64; 2]; 4], low: f64, high: f64) -> Option<[f64; 2]> {
    let mut extent: Option<[f64; 2]> = None;
    let mut add = |x: f64| {
        extent = Some(match extent {
            None => [x, x],
            Some([least, most]) => [least.min(x), most.max(x)],
        });
    };
    let mut before = corners[3];
    for corner in corners {
        if (low..=high).contains(&corner[1]) {
            add(corner[0]);
        }
        for level in [low, high] {
            if (before[1] > level) != (corner[1] > level) {
                let part = (level - before[1]) / (corner[1] - before[1]);
                add(before[0] + part * (corner[0] - before[0]));
            }
        }
        before = *corner;
    }
    extent
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_has_the_cells_that_the_rectangle_covers() {
        let footprint = Footprint::rectangle(0.5, 0.3).expect("a rectangle");
        let mask = Mask::new(&footprint, &[0.0], [0.0, 0.0], 0.1);
        let cells: isize = mask.runs.iter().map(|run| run.to - run.from + 1).sum();
        assert_eq!(cells, 15);
        assert_eq!(
            mask.runs[0],
            Run {
                row: -1,
                from: -2,
                to: 2
            }
        );
    }

    #[test]
    fn reach_is_the_farthest_corner_along_a_direction() {
        let footprint = Footprint::new(0.5, 0.2, 0.3, 0.1).expect("a rectangle");
        for step in 0..36 {
            let direction = f64::from(step) * 0.1745;
            let corners = footprint.corners_m(0.0);
            let farthest = corners
                .iter()
                .map(|[x, y]| x * direction.cos() + y * direction.sin())
                .fold(f64::NEG_INFINITY, f64::max);
            assert!((footprint.reach_m(direction) - farthest).abs() < 1e-12);
        }
    }
}
