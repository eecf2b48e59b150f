//! The planner: prepares a map for a vehicle, then plans routes on it.

use std::collections::HashMap;

use crate::angles::{HEADINGS, heading_rad, nearest_heading, remainder};
use crate::cost::{Costs, from_whole};
use crate::diagnosis::Diagnosis;
use crate::edge_lines::EdgeLines;
use crate::error::check_argument;
use crate::footprint::Mask;
use crate::ground::Ground;
use crate::lattice::Lattice;
use crate::no_route::Obstacle;
use crate::occupancy::Occupancy;
use crate::portals::{Portal, PortalMaker, turn_is_free};
use crate::search::Search;
use crate::waypoints::PathMaker;
use crate::{Chart, End, Error, Footprint, Goal, Map, NoRoute, Options, Pose, Route};

/// Longest reach of a vehicle, in cells of the map.
const MOST_REACH: f64 = 1000.0;
/// A start or goal is joined to positions of the lattice so many rings around it.
const RINGS: isize = 3;

/// Plans routes of a vehicle on a map.
///
/// ```
/// use omni_plan::{Chart, Footprint, Goal, Grid, Map, Options, Planner, Pose};
/// // A step of 40 mm at x = 2; the vehicle climbs 60 mm, with its front only.
/// let grid = Grid::new(80, 60, 0.05, [0.0, 0.0])?;
/// let heights_m = (0..4800).map(|cell| if cell % 80 < 40 { 0.0 } else { 0.04 }).collect();
/// let map = Map::from_heights(grid, heights_m)?;
/// let chart = Chart::from_toml("cart.toml", r#"
/// schema_version = 1
/// vehicle = "cart"
/// friction = 0.7
/// speed_m_s = 0.3
/// margin = 0.8
/// cell = [{ edge = "step", side_deg = 0.0, skew_deg = 0.0, climbs_m = 0.048, limit_m = 0.06 }]
/// "#)?;
/// let footprint = Footprint::rectangle(0.6, 0.4)?;
/// let planner = Planner::new(&map, &chart, &footprint, Options::default())?;
/// let route = planner.plan(&Pose::new(0.8, 1.5, 1.57), &Goal::place(3.2, 1.5)).expect("a route");
/// assert_eq!(route.crossings.len(), 1);
/// assert_eq!(route.crossings[0].side_deg, 0.0);
/// assert!((route.crossings[0].height_m - 0.04).abs() < 1e-9);
/// // And back it does not get: nothing is known of steps down.
/// let error = planner.plan(&Pose::new(3.2, 1.5, 0.0), &Goal::place(0.8, 1.5)).unwrap_err();
/// assert!(error.to_string().contains("40 mm down, and the chart has no steps down"));
/// # Ok::<(), omni_plan::Error>(())
/// ```
#[derive(Debug)]
pub struct Planner {
    pub(crate) ground: Ground,
    pub(crate) occupancy: Occupancy,
    pub(crate) lines: EdgeLines,
    pub(crate) lattice: Lattice,
    pub(crate) portals: Vec<Portal>,
    by_node: HashMap<u32, Vec<u32>>,
    pub(crate) chart: Chart,
    pub(crate) footprint: Footprint,
    pub(crate) options: Options,
}

impl Planner {
    /// Prepares a map: finds its edges, where the vehicle can stand, and where it may cross which edge.
    ///
    /// # Errors
    /// If a number of the options or of the footprint is out of its range.
    pub fn new(map: &Map, chart: &Chart, footprint: &Footprint, options: Options) -> Result<Self, Error> {
        options.check()?;
        footprint.check()?;
        let grid = *map.grid();
        let reach = (footprint.radius_m() + options.clearance_m) / grid.resolution_m;
        check_argument("footprint in cells of the map", reach, 0.0, MOST_REACH)?;
        let ground = Ground::new(map, chart, &options);
        let occupancy = Occupancy::new(&ground);
        let lines = EdgeLines::new(&ground);
        let lattice = Lattice::new(&ground, &occupancy, footprint, &options);
        let portals = PortalMaker {
            ground: &ground,
            lines: &lines,
            occupancy: &occupancy,
            lattice: &lattice,
            chart,
            footprint,
            options: &options,
        }
        .portals();
        let mut by_node: HashMap<u32, Vec<u32>> = HashMap::new();
        for (number, portal) in portals.iter().enumerate() {
            by_node.entry(portal.from).or_default().push(number as u32);
        }
        Ok(Self {
            ground,
            occupancy,
            lines,
            lattice,
            portals,
            by_node,
            chart: chart.clone(),
            footprint: *footprint,
            options,
        })
    }

    /// The route from a pose to a goal.
    ///
    /// # Errors
    /// Why there is none.
    pub fn plan(&self, start: &Pose, goal: &Goal) -> Result<Route, NoRoute> {
        let grid = self.ground.grid;
        let start_nodes = self.nodes_at(End::Start, start.x_m, start.y_m, Some(start.yaw_rad))?;
        let goal_nodes = self.nodes_at(End::Goal, goal.x_m, goal.y_m, goal.yaw_rad)?;
        let costs = Costs::new(&self.options, &self.footprint);
        let search = Search::new(&self.lattice, &self.portals, &self.by_node, &costs);
        let found = match start_nodes.first() {
            Some(first) => search.cheapest(*first, &goal_nodes),
            None => Err(0),
        };
        let Ok(found) = found else {
            let cell = |x_m, y_m| grid.cell_of([x_m, y_m]).unwrap_or_default();
            let diagnosis = Diagnosis {
                ground: &self.ground,
                chart: &self.chart,
                footprint: &self.footprint,
                options: &self.options,
                inflation_m: self.lattice.inflation_m,
            };
            return Err(diagnosis.reason(cell(start.x_m, start.y_m), cell(goal.x_m, goal.y_m)));
        };
        let mut maker = PathMaker {
            lattice: &self.lattice,
            portals: &self.portals,
            costs: &costs,
            options: &self.options,
            points: Vec::new(),
            crossings: Vec::new(),
        };
        let by_node = |node: u32| self.by_node.get(&node).cloned().unwrap_or_default();
        maker.path(*start, &found.nodes, by_node, goal);
        let mut length_m = 0.0;
        for pair in maker.points.windows(2) {
            length_m += (pair[1].x_m - pair[0].x_m).hypot(pair[1].y_m - pair[0].y_m);
        }
        Ok(Route {
            length_m,
            duration_s: maker.points.last().map_or(0.0, |last| last.time_s),
            cost: from_whole(found.cost),
            expanded: found.expanded,
            points: maker.points,
            crossings: maker.crossings,
        })
    }

    /// Number of straight crossings of edges that the chart and the available room allow.
    #[must_use]
    pub fn portal_count(&self) -> usize {
        self.portals.len()
    }

    /// The nodes that a start or goal is joined to, all at one position: the nearest one that can
    /// be reached. Any heading of a goal without a yaw.
    fn nodes_at(&self, end: End, x_m: f64, y_m: f64, yaw_rad: Option<f64>) -> Result<Vec<u32>, NoRoute> {
        let grid = self.ground.grid;
        let Some(cell) = grid
            .cell_of([x_m, y_m])
            .filter(|_| yaw_rad.unwrap_or(0.0).is_finite())
        else {
            let [from_x, from_y] = grid.origin_m;
            let [to_x, to_y] = grid.place_of([grid.columns as f64, grid.rows as f64]);
            return Err(NoRoute::OutOfMap {
                end,
                x_m,
                y_m,
                x_range_m: [from_x, to_x],
                y_range_m: [from_y, to_y],
            });
        };
        let blocked = |by: Obstacle| NoRoute::Blocked { end, x_m, y_m, by };
        if self.ground.closed[grid.index(cell[0], cell[1])] {
            return Err(blocked(Obstacle::Closed));
        }
        let headings: Vec<usize> = match yaw_rad {
            Some(yaw_rad) => {
                let pose = Pose::new(x_m, y_m, yaw_rad);
                if let Some(by) = self.stands_on(&pose) {
                    return Err(blocked(by));
                }
                let nearest = nearest_heading(yaw_rad);
                // The other neighbour, where the nearest heading is not free.
                let beyond = remainder(yaw_rad - heading_rad(nearest)) >= 0.0;
                let other = nearest + if beyond { 1 } else { HEADINGS - 1 };
                vec![nearest, other % HEADINGS]
            }
            None => (0..HEADINGS).collect(),
        };
        let Some(own) = self.lattice.position_of([x_m, y_m]) else {
            return Err(blocked(Obstacle::Near));
        };
        let mut places: Vec<(f64, usize)> = Vec::new();
        for dx in -RINGS..=RINGS {
            for dy in -RINGS..=RINGS {
                if let Some(position) = self.lattice.step(own, [dx, dy]) {
                    let [x, y] = self.lattice.place_m(position);
                    places.push(((x - x_m).hypot(y - y_m), position));
                }
            }
        }
        places.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        for (_, position) in places {
            let mut nodes = Vec::new();
            for heading in &headings {
                let joined = self.lattice.is_free(position, *heading)
                    && self.is_joined([x_m, y_m], yaw_rad, position, *heading);
                if joined {
                    nodes.push(self.lattice.node(position, *heading));
                    if yaw_rad.is_some() {
                        return Ok(nodes);
                    }
                }
            }
            if !nodes.is_empty() {
                return Ok(nodes);
            }
        }
        Err(blocked(Obstacle::Near))
    }

    /// What stands under the vehicle at a pose; none if it is even ground.
    fn stands_on(&self, pose: &Pose) -> Option<Obstacle> {
        if turn_is_free(
            &self.occupancy,
            &self.footprint,
            &self.ground.grid,
            pose,
            pose.yaw_rad,
            0.0,
        ) {
            return None;
        }
        let grid = self.ground.grid;
        let [column, row] = grid.cell_of([pose.x_m, pose.y_m])?;
        let centre = grid.centre_of([column, row]);
        let off = [pose.x_m - centre[0], pose.y_m - centre[1]];
        let mask = Mask::new(&self.footprint, &[pose.yaw_rad], off, grid.resolution_m);
        let is_wall = |cell: usize| {
            let rises = [self.ground.rise_x_m[cell], self.ground.rise_y_m[cell]];
            self.ground.closed[cell] || rises.iter().any(|rise| rise.abs() > self.options.wall_m)
        };
        for run in &mask.runs {
            for x in run.from..=run.to {
                let (x, y) = (column as isize + x, row as isize + run.row);
                let inside = x >= 0 && y >= 0 && x < grid.columns as isize && y < grid.rows as isize;
                if !inside || is_wall(grid.index(x as usize, y as usize)) {
                    return Some(Obstacle::Closed);
                }
            }
        }
        Some(Obstacle::Edge)
    }

    /// Can the vehicle turn to a heading where it is, and then go to a position?
    fn is_joined(&self, [x_m, y_m]: [f64; 2], yaw_rad: Option<f64>, position: usize, heading: usize) -> bool {
        let grid = &self.ground.grid;
        let free = |pose: &Pose, to_rad: f64| {
            turn_is_free(&self.occupancy, &self.footprint, grid, pose, to_rad, 0.0)
        };
        let turned = heading_rad(heading);
        let here = Pose::new(x_m, y_m, yaw_rad.unwrap_or(turned));
        if !free(&here, turned) {
            return false;
        }
        let [x, y] = self.lattice.place_m(position);
        let steps = ((x - x_m).hypot(y - y_m) / (0.25 * grid.resolution_m)).ceil() as i32;
        (0..=steps).all(|step| {
            let part = f64::from(step) / f64::from(steps.max(1));
            let pose = Pose::new(x_m + part * (x - x_m), y_m + part * (y - y_m), turned);
            free(&pose, turned)
        })
    }
}
