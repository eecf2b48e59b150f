//! A map's content for a vehicle: edges between cells, slopes, and closed cells.

use crate::map::Cell;
use crate::{Chart, Grid, Map, Options};

/// The ground of a plan.
#[derive(Debug)]
pub(crate) struct Ground {
    pub(crate) grid: Grid,
    pub(crate) heights_m: Vec<f64>,
    pub(crate) friction: Vec<f64>,
    /// Cells that no part of the vehicle may enter: walls, unknown cells, keep-out areas, ground that is too steep.
    pub(crate) closed: Vec<bool>,
    /// How much the ground rises at the edge to the next cell along x \[m\], less its slope; 0 if there is no edge.
    pub(crate) rise_x_m: Vec<f64>,
    /// And to the next cell along y.
    pub(crate) rise_y_m: Vec<f64>,
}

impl Ground {
    pub(crate) fn new(map: &Map, chart: &Chart, options: &Options) -> Self {
        let grid = *map.grid();
        let mut ground = Self {
            grid,
            heights_m: Vec::with_capacity(grid.cells()),
            friction: Vec::with_capacity(grid.cells()),
            closed: Vec::with_capacity(grid.cells()),
            rise_x_m: vec![0.0; grid.cells()],
            rise_y_m: vec![0.0; grid.cells()],
        };
        for row in 0..grid.rows {
            for column in 0..grid.columns {
                ground.heights_m.push(map.height_m([column, row]));
                ground.friction.push(map.friction([column, row]));
                ground.closed.push(match map.cell([column, row]) {
                    Cell::Free => false,
                    Cell::Occupied => true,
                    Cell::Unknown => !options.unknown_is_free,
                });
            }
        }
        let slope_x = ground.edges_along(true, options.ignore_m);
        let slope_y = ground.edges_along(false, options.ignore_m);
        for cell in 0..grid.cells() {
            let most = chart
                .slope(ground.friction[cell], options.margin)
                .map_or(options.slope, |slope| slope.min(options.slope));
            // Beside an edge heights along it may be those of the edge, drawn over some cells.
            let steep = slope_x[cell].hypot(slope_y[cell]) > most + 1e-9;
            if steep && !ground.is_beside_edge(cell) {
                ground.closed[cell] = true;
            }
        }
        ground
    }

    /// Has a cell an edge at one of its four borders?
    pub(crate) fn is_beside_edge(&self, cell: usize) -> bool {
        let columns = self.grid.columns;
        let left = !cell.is_multiple_of(columns) && self.rise_x_m[cell - 1] != 0.0;
        let below = cell >= columns && self.rise_y_m[cell - columns] != 0.0;
        self.rise_x_m[cell] != 0.0 || self.rise_y_m[cell] != 0.0 || left || below
    }

    /// Finds the edges along x or y, and returns the slope of each cell along it.
    ///
    /// Between two cells the ground rises by d. What of d is not the slope of the ground beside is the edge.
    fn edges_along(&mut self, x: bool, ignore_m: f64) -> Vec<f64> {
        let grid = self.grid;
        let mut slope = vec![0.0_f64; grid.cells()];
        let (lines, length) = if x {
            (grid.rows, grid.columns)
        } else {
            (grid.columns, grid.rows)
        };
        let mut differences = vec![0.0; length - 1];
        let mut slopes = vec![0.0; length - 1];
        let mut edges = vec![0.0; length - 1];
        for line in 0..lines {
            let at = |place: usize| {
                if x {
                    grid.index(place, line)
                } else {
                    grid.index(line, place)
                }
            };
            for place in 0..length - 1 {
                let (here, next) = (at(place), at(place + 1));
                // What a wall's height is in a map does not matter.
                let open = !self.closed[here] && !self.closed[next];
                differences[place] = if open {
                    self.heights_m[next] - self.heights_m[here]
                } else {
                    0.0
                };
            }
            slopes_of(&differences, &mut slopes);
            edges_of(&differences, &mut slopes, ignore_m, &mut edges);
            for place in 0..length - 1 {
                if edges[place] != 0.0 {
                    let rises = if x { &mut self.rise_x_m } else { &mut self.rise_y_m };
                    rises[at(place)] = edges[place];
                }
                for cell in [at(place), at(place + 1)] {
                    slope[cell] = slope[cell].max(slopes[place].abs() / grid.resolution_m);
                }
            }
        }
        slope
    }

    /// Edges of one sign that follow each other within `merge_m` along x or y count as one: what each adds up to \[m\].
    pub(crate) fn merged(&self, merge_m: f64) -> [Vec<f64>; 2] {
        let grid = self.grid;
        let within = (merge_m / grid.resolution_m + 1e-9) as usize;
        [true, false].map(|x| {
            let rises = if x { &self.rise_x_m } else { &self.rise_y_m };
            let mut merged = rises.clone();
            if within == 0 {
                return merged;
            }
            for row in 0..grid.rows {
                for column in 0..grid.columns {
                    let here = rises[grid.index(column, row)];
                    if here == 0.0 {
                        continue;
                    }
                    let (place, length) = if x {
                        (column, grid.columns)
                    } else {
                        (row, grid.rows)
                    };
                    // The window of that width which adds up to most.
                    let from = place.saturating_sub(within);
                    let mut most: f64 = 0.0;
                    for first in from..=place {
                        let mut sum = 0.0;
                        for each in first..=(first + within).min(length - 1) {
                            let cell = if x {
                                grid.index(each, row)
                            } else {
                                grid.index(column, each)
                            };
                            if rises[cell] * here > 0.0 {
                                sum += rises[cell];
                            }
                        }
                        if sum.abs() > most.abs() {
                            most = sum;
                        }
                    }
                    merged[grid.index(column, row)] = most;
                }
            }
            merged
        })
    }
}

/// The slope at each difference of height along a line, as a difference: that of the two sides which is nearer
/// to it; of a side the smaller of its next two differences, so that a second edge beside the first is not a
/// slope. A difference between the slopes of both sides is a slope itself: a ramp that begins within a cell.
fn slopes_of(differences: &[f64], slopes: &mut [f64]) {
    let difference = |place: isize| {
        let last = differences.len() as isize - 1;
        differences[place.clamp(0, last) as usize]
    };
    for (place, rise) in differences.iter().enumerate() {
        let at = place as isize;
        let before = smaller(difference(at - 1), difference(at - 2));
        let after = smaller(difference(at + 1), difference(at + 2));
        slopes[place] = if (rise - before) * (rise - after) <= 0.0 {
            *rise
        } else if (rise - before).abs() < (rise - after).abs() {
            before
        } else {
            after
        };
    }
}

/// The edge at each difference of height along a line. A difference beside an edge is a part of it,
/// as far as it is steeper than the ground beyond: edges may be drawn over some cells. Parts below
/// `ignore_m` are added to the edge itself.
fn edges_of(differences: &[f64], slopes: &mut [f64], ignore_m: f64, edges: &mut [f64]) {
    let count = differences.len();
    let least = ignore_m.max(1e-9);
    for place in 0..count {
        let edge = differences[place] - slopes[place];
        edges[place] = if edge.abs() >= least { edge } else { 0.0 };
    }
    let alone: Vec<f64> = edges.to_vec();
    for place in 0..count {
        let rise = differences[place];
        if alone[place] != 0.0 || rise == 0.0 {
            continue;
        }
        let (previous, next) = (place.wrapping_sub(1), place + 1);
        for (beside, beyond) in [(previous, next), (next, previous)] {
            let beyond = differences.get(beyond).copied().unwrap_or(0.0);
            let part = rise - smaller(beyond, rise);
            let is_part = alone.get(beside).is_some_and(|edge| edge * part > 0.0);
            if !is_part || part * rise <= 0.0 {
                continue;
            }
            if part.abs() >= least {
                edges[place] = part;
                slopes[place] = rise - part;
            } else {
                edges[beside] += part;
            }
            break;
        }
    }
}

/// That of two differences which is nearer to zero.
fn smaller(one: f64, other: f64) -> f64 {
    if one.abs() < other.abs() { one } else { other }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_charts::square_chart;

    fn ground(height: impl Fn(f64, f64) -> f64) -> Ground {
        let grid = Grid::new(60, 20, 0.05, [0.0, 0.0]).expect("a grid");
        let mut heights = Vec::new();
        for row in 0..20 {
            for column in 0..60 {
                let [x, y] = grid.centre_of([column, row]);
                heights.push(height(x, y));
            }
        }
        let map = Map::from_heights(grid, heights).expect("heights");
        Ground::new(&map, &square_chart(0.05), &Options::default())
    }

    #[test]
    fn a_step_is_one_edge_of_its_height_and_no_slope() {
        let ground = ground(|x, _| if x > 1.0 { 0.06 } else { 0.0 });
        for row in 0..20 {
            for column in 0..59 {
                let rise = ground.rise_x_m[ground.grid.index(column, row)];
                assert!((rise - if column == 19 { 0.06 } else { 0.0 }).abs() < 1e-12);
            }
        }
        assert!(!ground.closed.contains(&true));
    }

    #[test]
    fn a_ramp_has_no_edge_and_is_closed_where_it_is_too_steep() {
        let gentle = ground(|x, _| 0.15 * (x - 1.0).clamp(0.0, 1.0));
        assert!(gentle.rise_x_m.iter().all(|rise| *rise == 0.0));
        assert!(!gentle.closed.contains(&true));
        let steep = ground(|x, _| 0.4 * (x - 1.0).clamp(0.0, 1.0));
        assert!(steep.rise_x_m.iter().all(|rise| *rise == 0.0));
        assert!(steep.closed[steep.grid.index(30, 5)]);
    }

    #[test]
    fn an_edge_that_is_drawn_over_two_cells_adds_up_to_its_height() {
        let ground = ground(|x, _| {
            if x > 1.05 {
                0.06
            } else if x > 1.0 {
                0.025
            } else {
                0.0
            }
        });
        let [merged, _] = ground.merged(0.12);
        assert!((merged[ground.grid.index(19, 3)] - 0.06).abs() < 1e-12);
        assert!((merged[ground.grid.index(20, 3)] - 0.06).abs() < 1e-12);
        assert!(!ground.closed.contains(&true));
    }
}
