//! Finds out why there is no route: the way of a point that lacks least, and the widest way.

use pathfinding::directed::bfs::bfs;
use pathfinding::directed::dijkstra::dijkstra;

use crate::ground::Ground;
use crate::occupancy::distances;
use crate::{Chart, Footprint, LackingEdge, NoRoute, Options};

/// Cost of a millimetre that an edge lacks, in cells of way: a way round is better, however long.
const LACKING_MM: f64 = 1e5;
/// Cost of an edge that the chart allows, in cells of way.
const ALLOWED_EDGE: u64 = 20;
/// Searches for the widest way.
const HALVINGS: usize = 14;

/// Input of a diagnosis.
pub(crate) struct Diagnosis<'a> {
    pub(crate) ground: &'a Ground,
    pub(crate) chart: &'a Chart,
    pub(crate) footprint: &'a Footprint,
    pub(crate) options: &'a Options,
    /// Clearance on even ground \[m\].
    pub(crate) inflation_m: f64,
}

/// The ground as a point meets it.
struct Plane {
    /// Edges along x and y, those of one sign near each other added up \[m\].
    rises_m: [Vec<f64>; 2],
    /// From each cell to the nearest wall, in cells.
    away: Vec<f64>,
}

impl Diagnosis<'_> {
    /// Why there is no way between two cells.
    pub(crate) fn reason(&self, start: [usize; 2], goal: [usize; 2]) -> NoRoute {
        let grid = self.ground.grid;
        let plane = self.plane();
        let (start, goal) = (grid.index(start[0], start[1]), grid.index(goal[0], goal[1]));
        // A disc of the vehicle's width, to a cell.
        let needed = self.footprint.narrowest_m() / 2.0 / grid.resolution_m - 0.5;
        let wide = |cell: usize| cell == start || cell == goal || plane.away[cell] >= needed + 0.5;
        let found = dijkstra(
            &(start as u32),
            |cell| {
                self.neighbours(*cell as usize, &plane)
                    .into_iter()
                    .filter(|(next, _)| wide(*next))
                    .map(|(next, rise_m)| (next as u32, self.lacking_cost(*cell as usize, next, rise_m)))
                    .collect::<Vec<_>>()
            },
            |cell| *cell as usize == goal,
        );
        let Some((way, _)) = found else {
            return self.narrowest(&plane, start, goal);
        };
        let crossed = self.crossed(&way, &plane);
        let lacking: Vec<LackingEdge> = crossed
            .iter()
            .filter(|edge| edge.height_m > edge.allowed_m)
            .cloned()
            .collect();
        if !lacking.is_empty() {
            return NoRoute::Edges { edges: lacking };
        }
        match crossed.first() {
            Some(edge) => NoRoute::NoRoom {
                x_m: edge.x_m,
                y_m: edge.y_m,
                height_m: edge.height_m,
                run_up_m: self.options.run_up_m,
            },
            None => self.narrowest(&plane, start, goal),
        }
    }

    fn plane(&self) -> Plane {
        let grid = self.ground.grid;
        let rises_m = self.ground.merged(self.options.merge_m);
        // Of a wall's two cells the higher one is the wall.
        let mut wall = self.ground.closed.clone();
        for (rises, next) in rises_m.iter().zip([1, grid.columns]) {
            for (cell, rise) in rises.iter().enumerate() {
                if rise.abs() > self.options.wall_m {
                    wall[if *rise > 0.0 { cell + next } else { cell }] = true;
                }
            }
        }
        let away = distances(&grid, |cell| wall[cell]);
        Plane { rises_m, away }
    }

    /// The four cells beside a cell that no wall parts from it, and how much the ground rises to them at an edge.
    fn neighbours(&self, cell: usize, plane: &Plane) -> Vec<(usize, f64)> {
        let grid = self.ground.grid;
        let (column, row) = (cell % grid.columns, cell / grid.columns);
        let [rises_x, rises_y] = &plane.rises_m;
        let mut beside = Vec::with_capacity(4);
        if column + 1 < grid.columns {
            beside.push((cell + 1, rises_x[cell]));
        }
        if column > 0 {
            beside.push((cell - 1, -rises_x[cell - 1]));
        }
        if row + 1 < grid.rows {
            beside.push((cell + grid.columns, rises_y[cell]));
        }
        if row > 0 {
            beside.push((cell - grid.columns, -rises_y[cell - grid.columns]));
        }
        beside.retain(|(next, rise_m)| !self.ground.closed[*next] && rise_m.abs() <= self.options.wall_m);
        beside
    }

    /// The best that any side may do at an edge between two cells.
    fn edge(&self, cell: usize, next: usize, rise_m: f64) -> LackingEdge {
        let grid = self.ground.grid;
        let centre = |cell: usize| grid.centre_of([cell % grid.columns, cell / grid.columns]);
        let (from, to) = (centre(cell), centre(next));
        let friction = self.ground.friction[cell].min(self.ground.friction[next]);
        let up = rise_m > 0.0;
        let table = self.chart.at(friction);
        let best = table.and_then(|table| table.best(up).map(|(side, limit)| (table, side, limit)));
        let (allowed_m, side_deg, limit_m) = best.map_or((0.0, 0.0, 0.0), |(table, side, limit)| {
            let allowed_m = table.allowed_m(limit, self.options.margin);
            (allowed_m, side.side_deg, limit.limit_m)
        });
        LackingEdge {
            x_m: f64::midpoint(from[0], to[0]),
            y_m: f64::midpoint(from[1], to[1]),
            height_m: rise_m.abs(),
            up,
            friction,
            needs_friction: self.chart.least_friction().filter(|_| table.is_none()),
            charted: best.is_some(),
            allowed_m,
            side_deg,
            limit_m,
            margin: self.options.margin,
        }
    }

    fn lacking_cost(&self, cell: usize, next: usize, rise_m: f64) -> u64 {
        if rise_m == 0.0 {
            return 1;
        }
        let edge = self.edge(cell, next, rise_m);
        let lacking_mm = 1e3 * (edge.height_m - edge.allowed_m).max(0.0);
        ALLOWED_EDGE + (LACKING_MM * lacking_mm) as u64
    }

    /// The edges on a way; those that were added up count once.
    fn crossed(&self, way: &[u32], plane: &Plane) -> Vec<LackingEdge> {
        let within = self.options.merge_m + self.ground.grid.resolution_m;
        let mut crossed: Vec<LackingEdge> = Vec::new();
        for pair in way.windows(2) {
            let (cell, next) = (pair[0] as usize, pair[1] as usize);
            let beside = self.neighbours(cell, plane);
            let rise_m = beside
                .iter()
                .find(|(other, _)| *other == next)
                .map_or(0.0, |(_, rise)| *rise);
            if rise_m == 0.0 {
                continue;
            }
            let edge = self.edge(cell, next, rise_m);
            let again = crossed.last().is_some_and(|last| {
                last.up == edge.up && (last.x_m - edge.x_m).hypot(last.y_m - edge.y_m) <= within
            });
            if !again {
                crossed.push(edge);
            }
        }
        crossed
    }

    /// The narrowest place of the widest way.
    fn narrowest(&self, plane: &Plane, start: usize, goal: usize) -> NoRoute {
        let grid = self.ground.grid;
        let way = |wide: f64| {
            bfs(
                &(start as u32),
                |cell| {
                    self.neighbours(*cell as usize, plane)
                        .into_iter()
                        .map(|(next, _)| next)
                        .filter(|next| *next == goal || plane.away[*next] >= wide)
                        .map(|next| next as u32)
                        .collect::<Vec<_>>()
                },
                |cell| *cell as usize == goal,
            )
        };
        let Some(mut widest) = way(0.0) else {
            return NoRoute::Enclosed;
        };
        let (mut low, mut high) = (0.0, plane.away.iter().copied().fold(0.0, f64::max));
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(low, high);
            match way(middle) {
                Some(found) => {
                    widest = found;
                    low = middle;
                }
                None => high = middle,
            }
        }
        // Start and goal themselves may stand beside a wall.
        let inner = widest
            .iter()
            .map(|cell| *cell as usize)
            .filter(|cell| *cell != start && *cell != goal);
        let narrowest = inner
            .min_by(|one, other| plane.away[*one].total_cmp(&plane.away[*other]))
            .unwrap_or(start);
        let [x_m, y_m] = grid.centre_of([narrowest % grid.columns, narrowest / grid.columns]);
        let width_m = (2.0 * plane.away[narrowest] - 1.0) * grid.resolution_m;
        let needed_m = self.footprint.narrowest_m() + 2.0 * self.inflation_m;
        if width_m < needed_m {
            NoRoute::TooNarrow {
                x_m,
                y_m,
                width_m,
                needed_m,
            }
        } else {
            NoRoute::NoTurn { x_m, y_m, width_m }
        }
    }
}
