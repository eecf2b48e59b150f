//! Small random maps against an exhaustive search of a plain lattice, in both directions.
//!
//! How strict: where the planner finds a way, the route itself is checked against every cell, with the bare
//! footprint. Where it finds none, the exhaustive search finds none either with a footprint that is larger by
//! what the planner keeps clear and a cell, with three even cells before an edge and two behind it. Where the
//! planner finds one, the exhaustive search does with the bare footprint and one even cell before an edge. It
//! turns by 22.5 degrees, goes from cell to cell, and crosses edges straight and over its whole width.

use std::collections::VecDeque;

use super::common::{WALL_M, chart, check_route, world};
use omni_plan::{Chart, Footprint, Goal, Map, Options, Planner, Pose};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

const CELLS: usize = 50;
const CELL_M: f64 = 0.1;
const MARGIN: f64 = 0.8;

/// A random number below `below`.
fn draw(random: &mut impl RngCore, below: usize) -> usize {
    (random.next_u64() % below as u64) as usize
}

/// Two walls across the map, each with a door that may have a sill, a platform, and blocks.
fn random_heights(random: &mut impl RngCore) -> Vec<f64> {
    let mut heights = vec![0.0; CELLS * CELLS];
    let fill = |heights: &mut Vec<f64>, x: [usize; 2], y: [usize; 2], height: f64| {
        for row in y[0]..y[1].min(CELLS) {
            for column in x[0]..x[1].min(CELLS) {
                heights[row * CELLS + column] = height;
            }
        }
    };
    let edges = [0.01, 0.02, 0.03, 0.045, 0.06];
    let (x, y) = (14 + draw(random, 20), 10 + draw(random, 20));
    let (wide, high) = (9 + draw(random, 8), 9 + draw(random, 8));
    let height = edges[draw(random, 5)];
    fill(&mut heights, [x, x + wide], [y, y + high], height);
    for _ in 0..2 {
        let wall = 15 + draw(random, 20);
        let door = 3 + draw(random, 36);
        let width = 7 + draw(random, 7);
        let sill = [0.0, 0.0, 0.01, 0.03, 0.045, 0.06][draw(random, 6)];
        let along_x = draw(random, 2) == 0;
        let mut span = |from: usize, to: usize, height: f64| {
            if along_x {
                fill(&mut heights, [from, to], [wall, wall + 2], height);
            } else {
                fill(&mut heights, [wall, wall + 2], [from, to], height);
            }
        };
        span(0, CELLS, WALL_M);
        span(door, door + width, sill);
    }
    for _ in 0..2 {
        let (x, y) = (draw(random, 45), draw(random, 45));
        fill(&mut heights, [x, x + 3], [y, y + 3], WALL_M);
    }
    for each in 0..CELLS {
        fill(&mut heights, [each, each + 1], [0, 1], WALL_M);
        fill(&mut heights, [each, each + 1], [CELLS - 1, CELLS], WALL_M);
        fill(&mut heights, [0, 1], [each, each + 1], WALL_M);
        fill(&mut heights, [CELLS - 1, CELLS], [each, each + 1], WALL_M);
    }
    heights
}

/// What an exhaustive search looks at.
struct Exhaustive<'a> {
    map: &'a Map,
    chart: &'a Chart,
    footprint: Footprint,
    /// Even cells ahead before it meets an edge, and behind it.
    room: [isize; 2],
    /// Borders of cells under the vehicle at each 32nd of a turn, from its own cell: x, y, dx, dy.
    borders: Vec<Vec<[isize; 4]>>,
}

/// The borders of cells that a rectangle touches, each looked at in five places.
fn borders(footprint: &Footprint, part: usize) -> Vec<[isize; 4]> {
    let (sin, cos) = (part as f64 * std::f64::consts::TAU / 32.0).sin_cos();
    let inside = |dx: f64, dy: f64| {
        let (along, aside) = (cos * dx + sin * dy, cos * dy - sin * dx);
        (-footprint.rear_m..=footprint.front_m).contains(&along)
            && (-footprint.right_m..=footprint.left_m).contains(&aside)
    };
    let reach = (footprint.radius_m() / CELL_M).ceil() as isize + 1;
    let mut found = Vec::new();
    for y in -reach..=reach {
        for x in -reach..=reach {
            for [dx, dy] in [[1_isize, 0_isize], [0, 1]] {
                let touched = (-2..=2).any(|part| {
                    let part = f64::from(part) / 4.0;
                    inside(
                        CELL_M * (x as f64 + 0.5 * dx as f64 + part * dy as f64),
                        CELL_M * (y as f64 + 0.5 * dy as f64 + part * dx as f64),
                    )
                });
                if touched {
                    found.push([x, y, dx, dy]);
                }
            }
        }
    }
    found
}

impl<'a> Exhaustive<'a> {
    fn new(map: &'a Map, chart: &'a Chart, footprint: Footprint, room: [isize; 2]) -> Self {
        let borders = (0..32).map(|part| borders(&footprint, part)).collect();
        Self {
            map,
            chart,
            footprint,
            room,
            borders,
        }
    }

    /// Edges under the vehicle at a cell and an angle in 32nds of a turn: across (dx, dy) and rise.
    /// None where it reaches out of the map.
    fn under(&self, column: usize, row: usize, part: usize) -> Option<Vec<[f64; 3]>> {
        let mut found = Vec::new();
        for [x, y, dx, dy] in &self.borders[part] {
            let (a, b) = (column as isize + x, row as isize + y);
            let last = CELLS as isize;
            if a < 0 || b < 0 || a + dx >= last || b + dy >= last {
                return None;
            }
            let here = self.map.height_m([a as usize, b as usize]);
            let next = self.map.height_m([(a + dx) as usize, (b + dy) as usize]);
            if (next - here).abs() > 1e-6 {
                found.push([*dx as f64, *dy as f64, next - here]);
            }
        }
        Some(found)
    }

    fn is_even(&self, column: usize, row: usize, part: usize) -> bool {
        self.under(column, row, part)
            .is_some_and(|under| under.is_empty())
    }

    /// All nodes (cell and one of 16 headings) that are reached from a cell, with any heading.
    fn reached(&self, start: [usize; 2]) -> Vec<bool> {
        let node = |column: usize, row: usize, heading: usize| (row * CELLS + column) * 16 + heading;
        let mut even = vec![false; CELLS * CELLS * 16];
        for row in 0..CELLS {
            for column in 0..CELLS {
                for heading in 0..16 {
                    even[node(column, row, heading)] = self.is_even(column, row, 2 * heading);
                }
            }
        }
        let mut reached = vec![false; even.len()];
        let mut todo = VecDeque::new();
        for heading in 0..16 {
            let first = node(start[0], start[1], heading);
            if even[first] {
                reached[first] = true;
                todo.push_back((start[0], start[1], heading));
            }
        }
        while let Some((column, row, heading)) = todo.pop_front() {
            let mut next = Vec::new();
            // Half-way the corners reach farthest.
            for (turned, middle) in [
                ((heading + 1) % 16, 2 * heading + 1),
                ((heading + 15) % 16, 2 * heading + 31),
            ] {
                if self.is_even(column, row, middle % 32) && even[node(column, row, turned)] {
                    next.push((column, row, turned));
                }
            }
            for (dx, dy) in [(1_isize, 0_isize), (-1, 0), (0, 1), (0, -1)] {
                let beside = |steps: isize| {
                    let (x, y) = (column as isize + steps * dx, row as isize + steps * dy);
                    ((1..CELLS as isize - 1).contains(&x) && (1..CELLS as isize - 1).contains(&y))
                        .then_some((x as usize, y as usize))
                };
                if let Some((x, y)) = beside(1)
                    && even[node(x, y, heading)]
                {
                    next.push((x, y, heading));
                }
                // Straight over edges along x or y, if the side that leads is one of the chart.
                if heading % 4 == 0
                    && let Some(exit) = self.crossed(column, row, heading, [dx, dy])
                {
                    next.push((exit[0], exit[1], heading));
                }
            }
            for (x, y, heading) in next {
                let reached = &mut reached[node(x, y, heading)];
                if !*reached {
                    *reached = true;
                    todo.push_back((x, y, heading));
                }
            }
        }
        reached
    }

    /// Where the vehicle is off an edge that begins ahead, if it may cross it.
    fn crossed(&self, column: usize, row: usize, heading: usize, [dx, dy]: [isize; 2]) -> Option<[usize; 2]> {
        let yaw = heading as f64 * std::f64::consts::TAU / 16.0;
        let side_deg = ((dy as f64).atan2(dx as f64) - yaw).to_degrees().round();
        let side_deg = side_deg - 360.0 * (side_deg / 360.0).round();
        let side_deg = if side_deg == -180.0 { 180.0 } else { side_deg };
        let (up_m, down_m) = (
            self.chart.step_m(side_deg, 0.7, MARGIN),
            self.chart.drop_m(side_deg, 0.7, MARGIN),
        );
        let mut met = false;
        for steps in 1..40 {
            let (x, y) = (column as isize + steps * dx, row as isize + steps * dy);
            if !(1..CELLS as isize - 1).contains(&x) || !(1..CELLS as isize - 1).contains(&y) {
                return None;
            }
            let under = self.under(x as usize, y as usize, 2 * heading)?;
            if under.is_empty() {
                // Even on, with cells to spare.
                if met {
                    let spare = (1..=self.room[1]).all(|more| {
                        let (x, y) = (x + more * dx, y + more * dy);
                        let place = (0..CELLS as isize).contains(&x) && (0..CELLS as isize).contains(&y);
                        place && self.is_even(x as usize, y as usize, 2 * heading)
                    });
                    return spare
                        .then_some([(x + self.room[1] * dx) as usize, (y + self.room[1] * dy) as usize]);
                }
                continue;
            }
            if !met && steps <= self.room[0] {
                return None;
            }
            met = true;
            // Each edge squarely, over the whole width, and within the chart.
            let mut rows = std::collections::BTreeMap::new();
            for [across_x, across_y, rise_m] in &under {
                let along = across_x * dx as f64 + across_y * dy as f64;
                if along == 0.0 {
                    return None;
                }
                let rise_m = rise_m * along;
                if rise_m > up_m + 1e-9 || -rise_m > down_m + 1e-9 {
                    return None;
                }
                *rows.entry((1e6 * rise_m).round() as i64).or_insert(0) += 1;
            }
            let width = if dx != 0 {
                extent(&self.footprint, yaw)[1]
            } else {
                extent(&self.footprint, yaw)[0]
            };
            let whole = (width / CELL_M) as i32;
            if rows.values().any(|count| *count < whole) {
                return None;
            }
        }
        None
    }
}

/// Extent along x and y.
fn extent(footprint: &Footprint, yaw: f64) -> [f64; 2] {
    let corners = footprint.corners_m(yaw);
    [0, 1].map(|k| {
        let most = corners
            .iter()
            .map(|corner| corner[k])
            .fold(f64::NEG_INFINITY, f64::max);
        let least = corners
            .iter()
            .map(|corner| corner[k])
            .fold(f64::INFINITY, f64::min);
        most - least
    })
}

#[test]
fn twenty_random_maps_agree_with_an_exhaustive_search() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let chart = chart(&[
        (0.0, 0.06, 0.08),
        (180.0, 0.04, 0.08),
        (90.0, 0.02, 0.05),
        (-90.0, 0.02, 0.05),
    ]);
    let footprint = Footprint::rectangle(0.6, 0.4).expect("a rectangle");
    let (mut ways, mut none, mut crossings, mut between) = (0, 0, 0, 0);
    for number in 0..20 {
        let heights = random_heights(&mut random);
        let map = world([CELLS as f64 * CELL_M; 2], CELL_M, |x, y| {
            heights[(y / CELL_M) as usize * CELLS + (x / CELL_M) as usize]
        });
        let options = Options {
            portal_spacing_m: 0.05,
            ..Options::default()
        };
        let planner = Planner::new(&map, &chart, &footprint, options).expect("a planner");
        // What the planner keeps clear on a lattice of 0.1 m, and a cell.
        let large = Exhaustive::new(&map, &chart, footprint.inflated(0.071 + CELL_M), [3, 2]);
        let small = Exhaustive::new(&map, &chart, footprint, [1, 0]);
        let start = [7, 7];
        let (large, small) = (large.reached(start), small.reached(start));
        let any = |reached: &[bool], goal: [usize; 2]| {
            let first = (goal[1] * CELLS + goal[0]) * 16;
            reached[first..first + 16].contains(&true)
        };
        if !any(&large, start) {
            continue;
        }
        for goal in [[42, 42], [42, 7], [7, 42], [25, 25], [35, 15]] {
            let [x, y] = map.grid().centre_of(goal);
            let [from_x, from_y] = map.grid().centre_of(start);
            let route = planner.plan(&Pose::new(from_x, from_y, 0.0), &Goal::place(x, y));
            let (sure, possible) = (any(&large, goal), any(&small, goal));
            match route {
                Ok(route) => {
                    ways += 1;
                    crossings += route.crossings.len();
                    check_route(&map, &chart, &footprint, &route, MARGIN, 0.003);
                    assert!(
                        possible,
                        "map {number}, goal {goal:?}: a way that the exhaustive search has not"
                    );
                }
                Err(reason) => {
                    none += 1;
                    assert!(!sure, "map {number}, goal {goal:?}: {reason}");
                    between += usize::from(possible);
                }
            }
        }
    }
    // The maps are of both kinds.
    assert!(
        ways >= 20 && none >= 20 && crossings >= 8,
        "{ways} {none} {crossings} {between}"
    );
    // Between both footprints either answer is right: those are few.
    assert!(between <= 5, "{between}");
}
