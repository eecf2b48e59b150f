//! Occupancy: closed cells and edges as bits, a row at a time.

use crate::Grid;
use crate::footprint::Mask;
use crate::ground::Ground;

/// Bits of closed cells, and of edges to the next cell along x and along y.
#[derive(Debug)]
pub(crate) struct Occupancy {
    grid: Grid,
    words: usize,
    /// For each row and word: closed, edge along x, edge along y.
    bits: Vec<[u64; 3]>,
}

impl Occupancy {
    pub(crate) fn new(ground: &Ground) -> Self {
        let grid = ground.grid;
        let words = grid.columns.div_ceil(64);
        let mut bits = vec![[0; 3]; words * grid.rows];
        for row in 0..grid.rows {
            for column in 0..grid.columns {
                let cell = grid.index(column, row);
                let word = &mut bits[row * words + column / 64];
                let bit = 1 << (column % 64);
                if ground.closed[cell] {
                    word[0] |= bit;
                }
                if ground.rise_x_m[cell] != 0.0 {
                    word[1] |= bit;
                }
                if ground.rise_y_m[cell] != 0.0 {
                    word[2] |= bit;
                }
            }
        }
        Self { grid, words, bits }
    }

    /// Would a vehicle that covers these cells about a cell reach out of the map, into a closed cell or over an edge?
    pub(crate) fn hits(&self, mask: &Mask, [column, row]: [isize; 2]) -> bool {
        let (columns, rows) = (self.grid.columns as isize, self.grid.rows as isize);
        for (number, run) in mask.runs.iter().enumerate() {
            let y = row + run.row;
            let (from, to) = (column + run.from, column + run.to);
            if y < 0 || y >= rows || from < 0 || to >= columns {
                return true;
            }
            let (y, from, to) = (y as usize, from as usize, to as usize);
            if self.any(0, y, from, to) || (from < to && self.any(1, y, from, to - 1)) {
                return true;
            }
            // An edge along y is under it if both of its cells are.
            if let Some(next) = mask.runs.get(number + 1) {
                let from = from.max((column + next.from).max(0) as usize);
                let to = to.min((column + next.to).max(0) as usize);
                if from <= to && self.any(2, y, from, to) {
                    return true;
                }
            }
        }
        false
    }

    /// Is a bit set in a part of a row?
    fn any(&self, layer: usize, row: usize, from: usize, to: usize) -> bool {
        let row = row * self.words;
        let (first, last) = (from / 64, to / 64);
        let begin = u64::MAX << (from % 64);
        let end = u64::MAX >> (63 - to % 64);
        if first == last {
            return self.bits[row + first][layer] & begin & end != 0;
        }
        if self.bits[row + first][layer] & begin != 0 || self.bits[row + last][layer] & end != 0 {
            return true;
        }
        (first + 1..last).any(|word| self.bits[row + word][layer] != 0)
    }
}

/// Distance from each cell's middle to the middle of the nearest marked cell, in cells; the border of the map counts as
/// marked.
pub(crate) fn distances(grid: &Grid, marked: impl Fn(usize) -> bool) -> Vec<f64> {
    let (columns, rows) = (grid.columns, grid.rows);
    let far = ((columns + rows) as f64).powi(2);
    let mut squares: Vec<f64> = (0..grid.cells())
        .map(|cell| if marked(cell) { 0.0 } else { far })
        .collect();
    let mut line = Vec::new();
    for column in 0..columns {
        line.clear();
        line.extend((0..rows).map(|row| squares[grid.index(column, row)]));
        for (row, square) in nearest(&line).into_iter().enumerate() {
            squares[grid.index(column, row)] = square;
        }
    }
    for row in 0..rows {
        let here = row * columns;
        let found = nearest(&squares[here..here + columns]);
        squares[here..here + columns].copy_from_slice(&found);
    }
    for row in 0..rows {
        for column in 0..columns {
            let border = (column + 1).min(columns - column).min((row + 1).min(rows - row));
            let square = &mut squares[grid.index(column, row)];
            *square = square.sqrt().min(border as f64);
        }
    }
    squares
}

/// The lower envelope of parabolas over a line (Felzenszwalb and Huttenlocher 2012): at each place
/// the least of `line[i] + (place - i)^2`.
fn nearest(line: &[f64]) -> Vec<f64> {
    let mut vertices: Vec<usize> = Vec::with_capacity(line.len());
    let mut begins: Vec<f64> = Vec::with_capacity(line.len());
    for place in 0..line.len() {
        let lifted = |place: usize| line[place] + (place * place) as f64;
        let mut begin = f64::NEG_INFINITY;
        while let (Some(vertex), Some(last)) = (vertices.last(), begins.last()) {
            let width = 2.0 * (place - vertex) as f64;
            begin = (lifted(place) - lifted(*vertex)) / width;
            if begin > *last {
                break;
            }
            vertices.pop();
            begins.pop();
            begin = f64::NEG_INFINITY;
        }
        vertices.push(place);
        begins.push(begin);
    }
    let mut found = Vec::with_capacity(line.len());
    let mut part = 0;
    for place in 0..line.len() {
        while part + 1 < begins.len() && begins[part + 1] < place as f64 {
            part += 1;
        }
        let off = place as f64 - vertices[part] as f64;
        found.push(line[vertices[part]] + off * off);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_every_pair() {
        let grid = Grid::new(17, 13, 0.1, [0.0, 0.0]).expect("a grid");
        let marked = |cell: usize| cell % 37 == 5 || cell == 200;
        let found = distances(&grid, marked);
        for row in 0..13 {
            for column in 0..17 {
                let mut least = (column + 1).min(17 - column).min(row + 1).min(13 - row) as f64;
                for other in (0..grid.cells()).filter(|cell| marked(*cell)) {
                    let (x, y) = (other % 17, other / 17);
                    least = least.min((x as f64 - column as f64).hypot(y as f64 - row as f64));
                }
                assert!((found[grid.index(column, row)] - least).abs() < 1e-9);
            }
        }
    }
}
