//! Straight edges: cells' borders where the ground steps, chained and fitted to lines with an exact normal.

use std::collections::VecDeque;

use crate::Point;
use crate::blurred_edges::BlurredEdges;
use crate::edge_line::{EdgeLine, NONE};
use crate::ground::Ground;

/// A border belongs to a line if its middle is no farther from it [cells]: a drawn line is off by at most half a cell.
const OFF_LINE: f64 = 0.75;
/// Minimum number of borders of a line.
const LEAST_BORDERS: usize = 3;
/// The ends of a line of so many borders may belong to a corner: they are left out of its fit.
const TRIMMED_FROM: usize = 6;

/// All straight edges of a ground, and which of them each cell's border belongs to.
#[derive(Debug)]
pub(crate) struct EdgeLines {
    pub(crate) lines: Vec<EdgeLine>,
    /// The line of the border to the next cell along x; [`NONE`] if there is none.
    pub(crate) of_x: Vec<u32>,
    /// And to the next cell along y.
    pub(crate) of_y: Vec<u32>,
}

/// A border between two cells where the ground steps.
#[derive(Clone, Copy)]
struct Border {
    cell: usize,
    /// To the next cell along x, or along y?
    x: bool,
    /// Its ends, as corners of the grid: uphill is on the left of the way from the first to the second.
    from: [usize; 2],
    to: [usize; 2],
}

impl Border {
    fn middle(&self) -> Point {
        [0, 1].map(|k| (self.from[k] + self.to[k]) as f64 / 2.0)
    }
}

impl EdgeLines {
    pub(crate) fn new(ground: &Ground) -> Self {
        let cells = ground.grid.cells();
        let mut found = Self {
            lines: Vec::new(),
            of_x: vec![NONE; cells],
            of_y: vec![NONE; cells],
        };
        let blurred = BlurredEdges::new(ground);
        for chain in chains(ground) {
            let mut parts = Vec::new();
            split(&chain, 0, chain.len(), &mut parts);
            join(&chain, &mut parts);
            for (from, to) in parts {
                let part = &chain[from..to];
                if part.len() < LEAST_BORDERS {
                    continue;
                }
                let trimmed = if part.len() >= TRIMMED_FROM {
                    &part[1..part.len() - 1]
                } else {
                    part
                };
                let Some(line) = fit(trimmed) else { continue };
                let line = with_ends(line, part);
                let places: Vec<(usize, bool)> = part.iter().map(|border| (border.cell, border.x)).collect();
                if !blurred.is_any(&places) {
                    found.add(line, &places);
                } else if !found.has_most(&places)
                    && let Some((line, places)) = blurred.grown(line)
                {
                    found.add(line, &places);
                }
            }
        }
        found
    }

    /// Adds a line, and says which borders belong to it: cells, and whether it is their border along x.
    fn add(&mut self, line: EdgeLine, places: &[(usize, bool)]) {
        let number = self.lines.len() as u32;
        for (cell, x) in places {
            let of = if *x { &mut self.of_x } else { &mut self.of_y };
            of[*cell] = number;
        }
        self.lines.push(line);
    }

    /// Do most of these borders belong to a line?
    fn has_most(&self, places: &[(usize, bool)]) -> bool {
        let of = |(cell, x): &(usize, bool)| if *x { self.of_x[*cell] } else { self.of_y[*cell] };
        let known = places.iter().filter(|place| of(place) != NONE).count();
        2 * known > places.len()
    }
}

/// Borders one after the other, uphill always on the left.
fn chains(ground: &Ground) -> Vec<Vec<Border>> {
    let grid = ground.grid;
    let mut borders = Vec::new();
    for row in 0..grid.rows {
        for column in 0..grid.columns {
            let cell = grid.index(column, row);
            let (low, right) = ([column + 1, row], [column + 1, row + 1]);
            let rise = ground.rise_x_m[cell];
            if rise != 0.0 {
                let (from, to) = if rise > 0.0 { (right, low) } else { (low, right) };
                borders.push(Border {
                    cell,
                    x: true,
                    from,
                    to,
                });
            }
            let (left, right) = ([column, row + 1], [column + 1, row + 1]);
            let rise = ground.rise_y_m[cell];
            if rise != 0.0 {
                let (from, to) = if rise > 0.0 { (left, right) } else { (right, left) };
                borders.push(Border {
                    cell,
                    x: false,
                    from,
                    to,
                });
            }
        }
    }
    let corner = |[x, y]: [usize; 2]| y * (grid.columns + 1) + x;
    let corners = (grid.columns + 1) * (grid.rows + 1);
    let begins = ByCorner::new(corners, borders.iter().map(|border| corner(border.from)));
    let ends = ByCorner::new(corners, borders.iter().map(|border| corner(border.to)));
    let mut used = vec![false; borders.len()];
    let mut chains = Vec::new();
    for first in 0..borders.len() {
        if used[first] {
            continue;
        }
        used[first] = true;
        let mut chain = VecDeque::from([borders[first]]);
        // To both sides, straight on where there is a choice.
        let mut here = borders[first];
        while let Some(next) = begins.next(corner(here.to), &here, &borders, &used) {
            used[next] = true;
            here = borders[next];
            chain.push_back(here);
        }
        here = borders[first];
        while let Some(before) = ends.next(corner(here.from), &here, &borders, &used) {
            used[before] = true;
            here = borders[before];
            chain.push_front(here);
        }
        let mut chain = Vec::from(chain);
        if chain.first().map(|border| border.from) == chain.last().map(|border| border.to) {
            begin_at_corner(&mut chain);
        }
        chains.push(chain);
    }
    chains
}

/// Borders that share a corner of the grid, at most four.
struct ByCorner {
    /// The first of each corner, [`NONE`] if there is none.
    first: Vec<u32>,
    /// The one after each.
    after: Vec<u32>,
}

impl ByCorner {
    fn new(corners: usize, of_borders: impl DoubleEndedIterator<Item = usize> + ExactSizeIterator) -> Self {
        let mut first = vec![NONE; corners];
        let mut after = vec![NONE; of_borders.len()];
        for (number, corner) in of_borders.enumerate().rev() {
            after[number] = std::mem::replace(&mut first[corner], number as u32);
        }
        Self { first, after }
    }

    /// A border at a corner that is not used: one straight on from another, if there is one.
    fn next(&self, corner: usize, from: &Border, borders: &[Border], used: &[bool]) -> Option<usize> {
        let mut best: Option<usize> = None;
        let mut candidate = self.first[corner];
        while candidate != NONE {
            let number = candidate as usize;
            if !used[number] && (best.is_none() || borders[number].x == from.x) {
                best = Some(number);
            }
            candidate = self.after[number];
        }
        best
    }
}

/// A ring begins at the border that is farthest from its middle: at a corner.
fn begin_at_corner(chain: &mut [Border]) {
    let count = chain.len() as f64;
    let mut middle = [0.0, 0.0];
    for border in chain.iter() {
        let at = border.middle();
        middle = [0, 1].map(|k| middle[k] + at[k] / count);
    }
    let mut farthest = (0, -1.0);
    for (number, border) in chain.iter().enumerate() {
        let at = border.from;
        let off = (at[0] as f64 - middle[0]).hypot(at[1] as f64 - middle[1]);
        if off > farthest.1 + 1e-9 {
            farthest = (number, off);
        }
    }
    chain.rotate_left(farthest.0);
}

/// Splits a chain until each part is straight (Ramer, Douglas and Peucker).
fn split(chain: &[Border], from: usize, to: usize, parts: &mut Vec<(usize, usize)>) {
    // A stack instead of a recursion: a chain may be long.
    let mut todo = vec![(from, to)];
    while let Some((from, to)) = todo.pop() {
        let part = &chain[from..to];
        if part.len() < 2 || is_straight(part) {
            parts.push((from, to));
            continue;
        }
        let (first, last) = (part[0].from, part[part.len() - 1].to);
        let chord = [last[0] as f64 - first[0] as f64, last[1] as f64 - first[1] as f64];
        let length = chord[0].hypot(chord[1]);
        let mut farthest = (1, -1.0);
        for (number, border) in part.iter().enumerate().skip(1) {
            let at = [
                border.from[0] as f64 - first[0] as f64,
                border.from[1] as f64 - first[1] as f64,
            ];
            let off = if length > 0.0 {
                (chord[0] * at[1] - chord[1] * at[0]).abs() / length
            } else {
                at[0].hypot(at[1])
            };
            if off > farthest.1 + 1e-9 {
                farthest = (number, off);
            }
        }
        // The first part is done first: parts stay in order.
        todo.push((from + farthest.0, to));
        todo.push((from, from + farthest.0));
    }
}

/// Joins neighbouring parts that are one line.
fn join(chain: &[Border], parts: &mut Vec<(usize, usize)>) {
    let mut joined: Vec<(usize, usize)> = Vec::with_capacity(parts.len());
    for part in parts.iter() {
        match joined.last_mut() {
            Some(last) if is_straight(&chain[last.0..part.1]) => last.1 = part.1,
            _ => joined.push(*part),
        }
    }
    *parts = joined;
}

fn is_straight(part: &[Border]) -> bool {
    let Some(line) = fit(part) else { return false };
    part.iter().all(|border| {
        let at = border.middle();
        let off = (at[0] - line.middle[0]) * line.normal[0] + (at[1] - line.middle[1]) * line.normal[1];
        off.abs() <= OFF_LINE
    })
}

/// The line with the least squares of distances; none if the part has no direction.
fn fit(part: &[Border]) -> Option<EdgeLine> {
    let count = part.len() as f64;
    let mut middle = [0.0, 0.0];
    for border in part {
        let at = border.middle();
        middle = [middle[0] + at[0] / count, middle[1] + at[1] / count];
    }
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for border in part {
        let at = border.middle();
        let (x, y) = (at[0] - middle[0], at[1] - middle[1]);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    let (first, last) = (part.first()?, part.last()?);
    let way = [0, 1].map(|k| last.to[k] as f64 - first.from[k] as f64);
    if way == [0.0, 0.0] {
        return None;
    }
    let mut along = if part.len() == 1 {
        way.map(|part| part / way[0].hypot(way[1]))
    } else {
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        [angle.cos(), angle.sin()]
    };
    if along[0] * way[0] + along[1] * way[1] < 0.0 {
        along = along.map(|part| -part);
    }
    // Exact along the axes.
    for k in [0, 1] {
        if along[k].abs() < 1e-9 {
            along[k] = 0.0;
            along[1 - k] = along[1 - k].signum();
        }
    }
    Some(EdgeLine {
        middle,
        normal: [-along[1], along[0]],
        half_length: 0.0,
    })
}

/// The same line with its middle between its ends.
fn with_ends(line: EdgeLine, part: &[Border]) -> EdgeLine {
    let along = line.along();
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for corner in part.iter().flat_map(|border| [border.from, border.to]) {
        let at =
            (corner[0] as f64 - line.middle[0]) * along[0] + (corner[1] as f64 - line.middle[1]) * along[1];
        least = least.min(at);
        most = most.max(at);
    }
    EdgeLine {
        middle: line.place(f64::midpoint(least, most)),
        half_length: (most - least) / 2.0,
        ..line
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_charts::square_chart;
    use crate::{Grid, Map, Options};

    fn lines(height: impl Fn(f64, f64) -> f64) -> Vec<EdgeLine> {
        let grid = Grid::new(80, 80, 0.05, [0.0, 0.0]).expect("a grid");
        let mut heights = Vec::new();
        for row in 0..80 {
            for column in 0..80 {
                let [x, y] = grid.centre_of([column, row]);
                heights.push(height(x, y));
            }
        }
        let map = Map::from_heights(grid, heights).expect("heights");
        EdgeLines::new(&Ground::new(&map, &square_chart(0.05), &Options::default())).lines
    }

    #[test]
    fn the_normal_of_a_long_edge_is_exact_to_a_tenth_of_a_degree() {
        for angle_deg in [0.0_f64, 3.0, 11.0, 28.6, 45.0, 61.0, 90.0, 133.0, 200.0, 275.0] {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            let found = lines(|x, y| {
                if (x - 2.01) * cos + (y - 1.98) * sin > 0.0 {
                    0.04
                } else {
                    0.0
                }
            });
            let longest = found
                .iter()
                .max_by(|one, other| one.half_length.total_cmp(&other.half_length));
            let longest = longest.expect("a line");
            assert!(longest.half_length > 38.0, "{angle_deg}: {longest:?}");
            let off = (longest.normal[0] * sin - longest.normal[1] * cos)
                .asin()
                .to_degrees();
            assert!(off.abs() < 0.15, "{angle_deg}: {off}");
            assert!(longest.normal[0] * cos + longest.normal[1] * sin > 0.99);
        }
    }

    #[test]
    fn a_terrace_has_four_lines_with_its_inside_uphill() {
        let found = lines(|x, y| {
            if (1.0..3.0).contains(&x) && (1.5..2.5).contains(&y) {
                0.04
            } else {
                0.0
            }
        });
        assert_eq!(found.len(), 4);
        for line in found {
            let inward = (40.0 - line.middle[0]) * line.normal[0] + (40.0 - line.middle[1]) * line.normal[1];
            assert!(inward > 0.0);
            let lengths = [10.0, 20.0];
            assert!(
                lengths
                    .iter()
                    .any(|length| (line.half_length - length).abs() < 1.01)
            );
        }
    }
}
