//! The poses that are searched: positions on a grid with sixteen headings, and where the vehicle can stand and turn.

use std::f64::consts::PI;

use crate::angles::HEADINGS;
use crate::footprint::Mask;
use crate::ground::Ground;
use crate::occupancy::{Occupancy, distances};
use crate::{Footprint, Grid, Options, Point};

/// Between two positions the vehicle's corners are off by so much of the spacing, at most: half of a diagonal step.
const BETWEEN: f64 = 0.71;
/// A turn to the next heading is looked at in so many parts.
const TURN_PARTS: usize = 6;
/// Steps from one position to another, counter-clockwise from x.
pub(crate) const STEPS: [[isize; 2]; 16] = [
    [1, 0],
    [2, 1],
    [1, 1],
    [1, 2],
    [0, 1],
    [-1, 2],
    [-1, 1],
    [-2, 1],
    [-1, 0],
    [-2, -1],
    [-1, -1],
    [-1, -2],
    [0, -1],
    [1, -2],
    [1, -1],
    [2, -1],
];

/// Positions and headings, and which of them are free of edges and obstacles.
#[derive(Debug)]
pub(crate) struct Lattice {
    grid: Grid,
    /// Cells of the map between two positions.
    pub(crate) stride: usize,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// Margin of the free footprint \[m\].
    pub(crate) inflation_m: f64,
    /// A bit for each heading with which the vehicle can stand at a position.
    free: Vec<u16>,
    /// And for each from which it can turn to the next.
    turns: Vec<u16>,
    /// From 0 (far from obstacles) to 1 (beside one).
    pub(crate) proximity: Vec<f32>,
    /// Height of each position \[m\].
    pub(crate) heights_m: Vec<f32>,
}

impl Lattice {
    pub(crate) fn new(
        ground: &Ground,
        occupancy: &Occupancy,
        footprint: &Footprint,
        options: &Options,
    ) -> Self {
        let grid = ground.grid;
        let resolution = grid.resolution_m;
        let stride = (options.lattice_m / resolution).round().max(1.0) as usize;
        let (columns, rows) = (grid.columns.div_ceil(stride), grid.rows.div_ceil(stride));
        let inflation_m = options.clearance_m.max(BETWEEN * stride as f64 * resolution);
        let inflated = footprint.inflated(inflation_m);
        let mut lattice = Self {
            grid,
            stride,
            columns,
            rows,
            inflation_m,
            free: vec![0; columns * rows],
            turns: vec![0; columns * rows],
            proximity: vec![0.0; columns * rows],
            heights_m: vec![0.0; columns * rows],
        };
        // A centred rectangle is the same after half a turn.
        let different = if footprint.is_centred() {
            HEADINGS / 2
        } else {
            HEADINGS
        };
        let mut masks = Vec::with_capacity(different);
        let mut turn_masks = Vec::with_capacity(different);
        for heading in 0..different {
            let angle =
                |part: usize| 2.0 * PI * (heading as f64 + part as f64 / TURN_PARTS as f64) / HEADINGS as f64;
            let swept: Vec<f64> = (0..=TURN_PARTS).map(angle).collect();
            masks.push(Mask::new(&inflated, &[angle(0)], [0.0, 0.0], resolution));
            turn_masks.push(Mask::new(&inflated, &swept, [0.0, 0.0], resolution));
        }
        let beside = |cell: usize| ground.closed[cell] || ground.is_beside_edge(cell);
        let away = distances(&grid, beside);
        // Farther away than that nothing is met, whatever the heading.
        let far = inflated.radius_m() / resolution + 1.5;
        let near = inflated.inscribed_m() / resolution - 1.5;
        for position in 0..columns * rows {
            let [column, row] = lattice.cell_of(position);
            let cell = grid.index(column, row);
            lattice.heights_m[position] = ground.heights_m[cell] as f32;
            if away[cell] < near {
                // Met with every heading.
            } else if away[cell] > far {
                lattice.free[position] = u16::MAX;
                lattice.turns[position] = u16::MAX;
            } else if !ground.closed[cell] {
                let place = [column as isize, row as isize];
                for heading in 0..different {
                    let bits = if different == HEADINGS { 1 } else { 0x101 } << heading;
                    if !occupancy.hits(&masks[heading], place) {
                        lattice.free[position] |= bits;
                        if !occupancy.hits(&turn_masks[heading], place) {
                            lattice.turns[position] |= bits;
                        }
                    }
                }
            }
            if options.prefer_clearance_m > 0.0 {
                let left_m = away[cell] * resolution - footprint.inscribed_m();
                let part = 1.0 - left_m / options.prefer_clearance_m;
                lattice.proximity[position] = part.clamp(0.0, 1.0) as f32;
            }
        }
        lattice
    }

    /// Distance between two positions \[m\].
    pub(crate) fn spacing_m(&self) -> f64 {
        self.stride as f64 * self.grid.resolution_m
    }

    /// The map's cell at a position.
    fn cell_of(&self, position: usize) -> [usize; 2] {
        let middle = |index: usize, most: usize| (index * self.stride + self.stride / 2).min(most - 1);
        [
            middle(position % self.columns, self.grid.columns),
            middle(position / self.columns, self.grid.rows),
        ]
    }

    /// World position \[m\].
    pub(crate) fn place_m(&self, position: usize) -> Point {
        self.grid.centre_of(self.cell_of(position))
    }

    /// The position that is nearest to a place; none outside the map.
    pub(crate) fn position_of(&self, place: Point) -> Option<usize> {
        let [column, row] = self.grid.cell_of(place)?;
        Some((row / self.stride) * self.columns + column / self.stride)
    }

    /// Can the vehicle stand at a position with a heading?
    pub(crate) fn is_free(&self, position: usize, heading: usize) -> bool {
        self.free[position] >> heading & 1 != 0
    }

    /// With any heading?
    pub(crate) fn is_free_somehow(&self, position: usize) -> bool {
        self.free[position] != 0
    }

    /// Can it turn there from a heading to the next one, counter-clockwise?
    pub(crate) fn turns(&self, position: usize, heading: usize) -> bool {
        self.turns[position] >> heading & 1 != 0
    }

    /// A position with a heading, as the search names it.
    pub(crate) fn node(&self, position: usize, heading: usize) -> u32 {
        (position * HEADINGS + heading) as u32
    }

    /// Position and heading of a node.
    pub(crate) fn of_node(node: u32) -> (usize, usize) {
        (node as usize / HEADINGS, node as usize % HEADINGS)
    }

    /// The position that a step leads to; none outside.
    pub(crate) fn step(&self, position: usize, [dx, dy]: [isize; 2]) -> Option<usize> {
        let column = (position % self.columns) as isize + dx;
        let row = (position / self.columns) as isize + dy;
        let inside = column >= 0 && row >= 0 && column < self.columns as isize && row < self.rows as isize;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    /// May the vehicle take a step with a heading from a free position? It ends free, and a long
    /// one passes two free positions.
    pub(crate) fn may_step(&self, position: usize, step: usize, heading: usize) -> Option<usize> {
        let [dx, dy] = STEPS[step];
        let to = self.step(position, [dx, dy])?;
        if !self.is_free(to, heading) {
            return None;
        }
        if dx.abs() + dy.abs() == 3 {
            let straight = self.step(position, [dx / 2, dy / 2])?;
            let aslant = self.step(position, [dx.signum(), dy.signum()])?;
            if !self.is_free(straight, heading) || !self.is_free(aslant, heading) {
                return None;
            }
        }
        Some(to)
    }
}

/// Length of a step, in spacings.
pub(crate) fn step_length(step: usize) -> f64 {
    let [dx, dy] = STEPS[step];
    (dx as f64).hypot(dy as f64)
}

/// Direction of a step \[rad\].
pub(crate) fn step_direction_rad(step: usize) -> f64 {
    let [dx, dy] = STEPS[step];
    (dy as f64).atan2(dx as f64)
}
