//! Portals: straight crossings of edges along their normal, sampled along every edge, that the chart allows.

use std::f64::consts::PI;

use crate::angles::{heading_rad, nearest_heading, remainder};
use crate::chart::Table;
use crate::edge_line::{EdgeLine, NONE};
use crate::edge_lines::EdgeLines;
use crate::footprint::Mask;
use crate::ground::Ground;
use crate::lattice::Lattice;
use crate::occupancy::Occupancy;
use crate::scan::{Scan, Strip, TRACKS};
use crate::{Chart, CrossingKind, Footprint, Options, Point, Pose};

/// Largest distance from the line of a riser that belongs to it without being fitted to it \[cells\].
const NEAR_LINE: f64 = 1.5;
/// Heights may be above a limit by so much: rounding of heights in files \[m\].
const ROUNDING_M: f64 = 1e-6;
/// Longest straight way over edges that follow each other \[m\].
const LONGEST_M: f64 = 6.0;
/// Most places at which a crossing may end.
const MOST_EXITS: usize = 4;
/// Turns between headings are looked at in steps of this \[rad\].
const TURN_STEP_RAD: f64 = 0.07;
/// Most places along one edge that are tried.
const MOST_PLACES: f64 = 2000.0;

/// An edge on the way of a portal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// Where the vehicle's origin crosses it \[m\].
    pub(crate) place_m: Point,
    pub(crate) kind: CrossingKind,
    pub(crate) height_m: f64,
    /// Size for planning there \[m\].
    pub(crate) allowed_m: f64,
}

/// A straight crossing.
#[derive(Clone, Debug)]
pub(crate) struct Portal {
    /// Start of the run-up.
    pub(crate) entry: Pose,
    /// Position at which the vehicle is off the edges.
    pub(crate) exit: Pose,
    /// Direction of travel \[rad\].
    pub(crate) direction_rad: f64,
    pub(crate) side_deg: f64,
    pub(crate) speed_m_s: f64,
    pub(crate) parts: Vec<Part>,
    /// The lattice's nodes where it begins and ends.
    pub(crate) from: u32,
    pub(crate) to: u32,
}

impl Portal {
    /// From its entry to its exit \[m\].
    pub(crate) fn length_m(&self) -> f64 {
        (self.exit.x_m - self.entry.x_m).hypot(self.exit.y_m - self.entry.y_m)
    }
}

/// Input of portals.
pub(crate) struct PortalMaker<'a> {
    pub(crate) ground: &'a Ground,
    pub(crate) lines: &'a EdgeLines,
    pub(crate) occupancy: &'a Occupancy,
    pub(crate) lattice: &'a Lattice,
    pub(crate) chart: &'a Chart,
    pub(crate) footprint: &'a Footprint,
    pub(crate) options: &'a Options,
}

/// A direction of travel over an edge with one side in front, in metres.
struct Approach {
    direction_rad: f64,
    heading_rad: f64,
    /// The heading of the lattice that is nearest.
    heading: usize,
    /// Extent of the vehicle forward and backward, for either direction of the turn to that heading.
    ahead_m: f64,
    behind_m: f64,
    left_m: f64,
    right_m: f64,
}

/// The ground about a place, as wide and long as any side needs it.
struct Seen {
    strip: Strip,
    scan: Scan,
}

/// The edges along a strip: all of their places, the first to cross, and the last that is part of its crossing.
struct Edges {
    scan: Scan,
    places: Vec<f64>,
    first: f64,
    last: f64,
}

impl PortalMaker<'_> {
    /// All portals of all edges.
    pub(crate) fn portals(&self) -> Vec<Portal> {
        let mut portals = Vec::new();
        let resolution = self.ground.grid.resolution_m;
        for line in &self.lines.lines {
            let half_m = line.half_length * resolution;
            let narrowest_m = self.footprint.narrowest_m();
            if 2.0 * half_m + 2.0 * resolution < narrowest_m {
                continue;
            }
            // The same to both sides of its middle.
            let spacing_m = self.options.portal_spacing_m.max(half_m / MOST_PLACES);
            let each_way = (half_m / spacing_m) as i32;
            for number in -each_way..=each_way {
                let place = line.place(f64::from(number) * spacing_m / resolution);
                for sign in [1.0, -1.0] {
                    let along = line.normal.map(|part| sign * part);
                    self.over(line, place, along, &mut portals);
                }
            }
        }
        portals
    }

    /// The portals at a place in one direction, one for each side that may lead.
    fn over(&self, line: &EdgeLine, place: Point, along: Point, portals: &mut Vec<Portal>) {
        let resolution = self.ground.grid.resolution_m;
        let merge = self.options.merge_m / resolution;
        // What the middle of the vehicle crosses decides whether there is more to look at.
        let probe = Scan::new(
            self.ground,
            &Strip {
                place,
                along,
                from: -NEAR_LINE,
                to: NEAR_LINE + merge,
                left: 0.0,
                right: 0.0,
                clearance: 0.0,
            },
        );
        let Some(table) = self.chart.at(probe.friction(f64::NEG_INFINITY, f64::INFINITY)) else {
            return;
        };
        let [up, down] = probe.up_and_down(f64::NEG_INFINITY, f64::INFINITY, merge);
        if up == 0.0 && down == 0.0 {
            return;
        }
        let mut approaches = Vec::new();
        for side in 0..table.sides.len() {
            if self.allowed(table, side, up, down).is_some() {
                let side_deg = table.sides[side].side_deg;
                let approach = self.approach(along, side_deg);
                approaches.push((side_deg, self.strip(place, along, &approach), approach));
            }
        }
        // One look at the ground for all sides.
        let Some((_, first, _)) = approaches.first() else {
            return;
        };
        let mut wide = *first;
        for (_, strip, _) in &approaches {
            wide.from = wide.from.min(strip.from);
            wide.to = wide.to.max(strip.to);
            wide.left = wide.left.max(strip.left);
            wide.right = wide.right.max(strip.right);
        }
        let mut seen = Seen {
            scan: Scan::new(self.ground, &wide),
            strip: wide,
        };
        for (side_deg, strip, approach) in &approaches {
            self.with_side(line, *side_deg, approach, *strip, &mut seen, portals);
        }
    }

    /// How much room a side keeps clear before it meets the edge, and how much it runs up
    /// \[cells\]: positions of the lattice about both ends are clear of the edge.
    fn room(&self) -> [f64; 2] {
        let resolution = self.ground.grid.resolution_m;
        let clear = self.lattice.inflation_m / resolution + 0.8 * self.lattice.stride as f64;
        [clear, (self.options.run_up_m / resolution).max(clear)]
    }

    /// What a crossing goes over, if no other edge follows.
    fn strip(&self, place: Point, along: Point, approach: &Approach) -> Strip {
        let cells = |length_m: f64| length_m / self.ground.grid.resolution_m;
        let [clear, run_up] = self.room();
        let (ahead, behind) = (cells(approach.ahead_m), cells(approach.behind_m));
        Strip {
            place,
            along,
            from: -(NEAR_LINE + run_up + ahead + behind + clear),
            to: ahead + behind + clear + ahead + run_up,
            left: cells(approach.left_m),
            right: cells(approach.right_m),
            clearance: cells(self.options.clearance_m),
        }
    }

    fn approach(&self, along: Point, side_deg: f64) -> Approach {
        let direction_rad = along[1].atan2(along[0]);
        let exact = direction_rad - side_deg.to_radians();
        let heading = nearest_heading(exact);
        let turn = remainder(heading_rad(heading) - exact);
        let steps = (turn.abs() / TURN_STEP_RAD).ceil() as i32;
        let most = |way_rad: f64| {
            let mut most = f64::NEG_INFINITY;
            for step in 0..=steps {
                let part = f64::from(step) / f64::from(steps.max(1));
                most = most.max(self.footprint.reach_m(way_rad - exact - part * turn));
            }
            most
        };
        Approach {
            direction_rad,
            heading_rad: exact,
            heading,
            ahead_m: most(direction_rad),
            behind_m: most(direction_rad + PI),
            left_m: self.footprint.reach_m(direction_rad + PI / 2.0 - exact),
            right_m: self.footprint.reach_m(direction_rad - PI / 2.0 - exact),
        }
    }

    /// The portals at a position with one side in front: one for each place at which the vehicle may stop being on
    /// edges.
    fn with_side(
        &self,
        line: &EdgeLine,
        side_deg: f64,
        approach: &Approach,
        strip: Strip,
        seen: &mut Seen,
        portals: &mut Vec<Portal>,
    ) {
        let grid = self.ground.grid;
        let cells = |length_m: f64| length_m / grid.resolution_m;
        let (place, along) = (strip.place, strip.along);
        let merge = cells(self.options.merge_m);
        let [clear, run_up] = self.room();
        let (ahead, behind) = (cells(approach.ahead_m), cells(approach.behind_m));
        let standing = ahead + behind + clear;
        let Some(edges) = self.edges_along(strip, [standing, ahead, run_up], seen) else {
            return;
        };
        let Edges {
            scan,
            places,
            first,
            last,
        } = edges;
        let end = last + standing;
        let entry = first - run_up - ahead;
        let begin = entry - behind - clear;
        if places.iter().any(|at| *at >= begin && *at < first) || scan.is_closed(begin, first + standing) {
            return;
        }
        let entry_m = grid.place_of([place[0] + entry * along[0], place[1] + entry * along[1]]);
        let stands = self.lattice.position_of(entry_m);
        if stands.is_none_or(|position| !self.lattice.is_free(position, approach.heading)) {
            return;
        }
        // The ground beside the middle may be more slippery: another chart.
        let Some(table) = self.chart.at(scan.friction(begin, end)) else {
            return;
        };
        let Some(side) = table.sides.iter().position(|side| side.side_deg == side_deg) else {
            return;
        };
        let mut exits = 0;
        let mut parts = Vec::new();
        let mut group = first;
        let mut last = first;
        let ends = places
            .iter()
            .copied()
            .filter(|at| *at >= first)
            .chain([f64::INFINITY]);
        for at in ends {
            if at - last > merge {
                // A group of edges ends at `last`.
                let Some(part) = self.part(&scan, table, side, [group, last], strip.place, along) else {
                    return;
                };
                if !self.is_square(&scan, line, [group, last], place, along) {
                    return;
                }
                parts.push(part);
                group = at;
                let exit = last + behind + clear;
                if at - last >= ahead + behind + 2.0 * clear {
                    if exit > cells(LONGEST_M) || scan.is_closed(first, exit + ahead) {
                        return;
                    }
                    portals.extend(self.portal(approach, table, side, place, along, [entry, exit], &parts));
                    exits += 1;
                    let next_is_far = at > exit + ahead + run_up;
                    if next_is_far || exits == MOST_EXITS {
                        return;
                    }
                }
            }
            last = at;
        }
    }

    /// The edges along a strip from the first one on, and those that follow before the vehicle can stand and run up
    /// again: they are part of the crossing. The strip is looked at as far as that takes.
    fn edges_along(
        &self,
        strip: Strip,
        [standing, ahead, run_up]: [f64; 3],
        seen: &mut Seen,
    ) -> Option<Edges> {
        let longest = LONGEST_M / self.ground.grid.resolution_m;
        let mut to = strip.to;
        loop {
            let scan = seen.scan.within(&Strip { to, ..strip });
            let mut places: Vec<f64> = scan.risers.iter().map(|riser| riser.at).collect();
            places.sort_by(f64::total_cmp);
            let first = places.iter().copied().find(|at| *at >= -NEAR_LINE)?;
            let mut last = first;
            for at in places.iter().copied().filter(|at| *at > first) {
                if at - last > standing + run_up {
                    break;
                }
                last = at;
            }
            let needed = last + standing + ahead + run_up;
            if needed <= to || to > longest {
                return Some(Edges {
                    scan,
                    places,
                    first,
                    last,
                });
            }
            to = needed;
            if to > seen.strip.to {
                // As far as any crossing goes, once for all sides.
                seen.strip.to = to.max(longest + strip.to);
                seen.scan = Scan::new(self.ground, &seen.strip);
            }
        }
    }

    /// A group of edges: what it is, if the chart allows it.
    fn part(
        &self,
        scan: &Scan,
        table: &Table,
        side: usize,
        [from, to]: [f64; 2],
        place: Point,
        along: Point,
    ) -> Option<Part> {
        let merge = self.options.merge_m / self.ground.grid.resolution_m;
        let [up, down] = scan.up_and_down(from, to, merge);
        let allowed_m = self.allowed(table, side, up, down)?;
        if !scan.is_whole(from, to) {
            return None;
        }
        let at = f64::midpoint(from, to);
        let kind = match (up > 0.0, down > 0.0) {
            (true, true) => CrossingKind::Over,
            (true, false) => CrossingKind::Up,
            _ => CrossingKind::Down,
        };
        Some(Part {
            place_m: self
                .ground
                .grid
                .place_of([place[0] + at * along[0], place[1] + at * along[1]]),
            kind,
            height_m: up.max(down),
            allowed_m,
        })
    }

    /// What a side may climb of an edge that goes up and down by so much \[m\]; none if it may not.
    fn allowed(&self, table: &Table, side: usize, up_m: f64, down_m: f64) -> Option<f64> {
        let side = &table.sides[side];
        let mut allowed_m = f64::INFINITY;
        let mut needed = Vec::with_capacity(3);
        if up_m > 0.0 {
            needed.push((up_m, side.step));
        }
        if down_m > 0.0 {
            needed.push((down_m, side.drop));
        }
        if up_m > 0.0 && down_m > 0.0 && side.bar.is_some() {
            needed.push((up_m.max(down_m), side.bar));
        }
        for (height_m, limit) in needed {
            let limit_m = table.allowed_m(limit?, self.options.margin);
            if height_m > limit_m + ROUNDING_M {
                return None;
            }
            allowed_m = allowed_m.min(limit_m);
        }
        Some(allowed_m)
    }

    /// Are all edges of a group met squarely?
    fn is_square(
        &self,
        scan: &Scan,
        line: &EdgeLine,
        [from, to]: [f64; 2],
        place: Point,
        along: Point,
    ) -> bool {
        let square = self.options.square_deg.to_radians();
        // A straight edge is drawn in steps: over the vehicle's width it may seem slanted by a cell.
        let width = (scan.under[1] - scan.under[0]).max(1) as f64 * TRACKS;
        if scan.slant(from, to).abs() > square.tan() + 1.0 / width {
            return false;
        }
        let least = square.cos();
        scan.risers.iter().all(|riser| {
            if riser.at < from || riser.at > to {
                return true;
            }
            let of = if riser.x {
                &self.lines.of_x
            } else {
                &self.lines.of_y
            };
            let number = of[riser.cell];
            if number != NONE {
                let normal = self.lines.lines[number as usize].normal;
                if (normal[0] * along[0] + normal[1] * along[1]).abs() >= least {
                    return true;
                }
            }
            // The line itself, where a border of it was not fitted to it.
            let behind =
                (place[0] - line.middle[0]) * line.normal[0] + (place[1] - line.middle[1]) * line.normal[1];
            (riser.at - behind).abs() <= NEAR_LINE
        })
    }

    /// A portal, if the vehicle can turn at both ends to a heading of the lattice.
    #[expect(
        clippy::too_many_arguments,
        reason = "what a crossing is: its approach, its side and its ends"
    )]
    fn portal(
        &self,
        approach: &Approach,
        table: &Table,
        side: usize,
        place: Point,
        along: Point,
        [entry, exit]: [f64; 2],
        parts: &[Part],
    ) -> Option<Portal> {
        let grid = self.ground.grid;
        let pose = |at: f64| {
            let [x_m, y_m] = grid.place_of([place[0] + at * along[0], place[1] + at * along[1]]);
            Pose::new(x_m, y_m, remainder(approach.heading_rad))
        };
        let (entry, exit) = (pose(entry), pose(exit));
        let node = |pose: &Pose| {
            let position = self.lattice.position_of([pose.x_m, pose.y_m])?;
            let free = self.lattice.is_free(position, approach.heading);
            let turns = || {
                turn_is_free(
                    self.occupancy,
                    self.footprint,
                    &grid,
                    pose,
                    heading_rad(approach.heading),
                    self.options.clearance_m,
                )
            };
            (free && turns()).then(|| self.lattice.node(position, approach.heading))
        };
        let (from, to) = (node(&entry)?, node(&exit)?);
        Some(Portal {
            entry,
            exit,
            direction_rad: approach.direction_rad,
            side_deg: table.sides[side].side_deg,
            speed_m_s: table.speed_m_s,
            parts: parts.to_vec(),
            from,
            to,
        })
    }
}

/// Can a vehicle turn at a place from its heading to another, over the smaller angle?
pub(crate) fn turn_is_free(
    occupancy: &Occupancy,
    footprint: &Footprint,
    grid: &crate::Grid,
    pose: &Pose,
    to_rad: f64,
    clearance_m: f64,
) -> bool {
    let Some([column, row]) = grid.cell_of([pose.x_m, pose.y_m]) else {
        return false;
    };
    let centre = grid.centre_of([column, row]);
    let turn = remainder(to_rad - pose.yaw_rad);
    let steps = (turn.abs() / TURN_STEP_RAD).ceil() as i32;
    let headings: Vec<f64> = (0..=steps)
        .map(|step| pose.yaw_rad + turn * f64::from(step) / f64::from(steps.max(1)))
        .collect();
    let off = [pose.x_m - centre[0], pose.y_m - centre[1]];
    let mask = Mask::new(
        &footprint.inflated(clearance_m),
        &headings,
        off,
        grid.resolution_m,
    );
    !occupancy.hits(&mask, [column as isize, row as isize])
}
