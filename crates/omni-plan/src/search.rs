//! The search: the least cost to the goal in the plane, and with it A* over positions and headings.

use std::collections::HashMap;

use pathfinding::directed::astar::astar;
use pathfinding::directed::dijkstra::dijkstra_reach;

use crate::angles::{HEADING_STEP_RAD, HEADINGS, heading_rad, remainder};
use crate::cost::{Costs, whole, whole_below};
use crate::lattice::{Lattice, STEPS, step_direction_rad, step_length};
use crate::portals::Portal;

/// No cost is known: the place cannot be reached.
const UNREACHED: u64 = u64::MAX;
/// The plane is searched beyond the start by this part of its cost.
const BEYOND: f64 = 0.25;

/// Part of a turn's cost that is sure: each is a whole number.
const TURNS: f64 = 0.999;

/// Graph of a search.
#[derive(Debug)]
pub(crate) struct Search<'a> {
    lattice: &'a Lattice,
    portals: &'a [Portal],
    /// Portals by the node where they begin.
    by_node: &'a HashMap<u32, Vec<u32>>,
    costs: &'a Costs<'a>,
    /// Cost of each step for each difference of direction and heading, without obstacles near.
    sides_rad: Vec<f64>,
}

/// Result of a search.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) nodes: Vec<u32>,
    pub(crate) cost: u64,
    pub(crate) expanded: usize,
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        lattice: &'a Lattice,
        portals: &'a [Portal],
        by_node: &'a HashMap<u32, Vec<u32>>,
        costs: &'a Costs<'a>,
    ) -> Self {
        let mut sides_rad = Vec::with_capacity(STEPS.len() * HEADINGS);
        for step in 0..STEPS.len() {
            for heading in 0..HEADINGS {
                sides_rad.push(remainder(step_direction_rad(step) - heading_rad(heading)));
            }
        }
        Self {
            lattice,
            portals,
            by_node,
            costs,
            sides_rad,
        }
    }

    /// The cheapest way from a node to one of the goals, all at one position; and how many nodes
    /// were expanded. None if there is no way.
    pub(crate) fn cheapest(&self, start: u32, goals: &[u32]) -> Result<Found, usize> {
        let (from, _) = Lattice::of_node(start);
        let Some(goal) = goals.first().map(|goal| Lattice::of_node(*goal).0) else {
            return Err(0);
        };
        let least = self.least_costs(goal, from);
        if least[from] == UNREACHED {
            return Err(0);
        }
        // Turns are paid beside travel, wherever they are made.
        let turns: Vec<u64> = (0..HEADINGS)
            .map(|heading| self.least_turn(heading, goals))
            .collect();
        let mut expanded = 0;
        let found = astar(
            &start,
            |node| {
                expanded += 1;
                self.next(*node, &least)
            },
            |node| {
                let (position, heading) = Lattice::of_node(*node);
                least[position].saturating_add(turns[heading])
            },
            |node| goals.contains(node),
        );
        match found {
            Some((nodes, cost)) => Ok(Found {
                nodes,
                cost,
                expanded,
            }),
            None => Err(expanded),
        }
    }

    /// The least cost of turning from a heading to a goal's heading; a little less, because turns are rounded one by
    /// one.
    fn least_turn(&self, heading: usize, goals: &[u32]) -> u64 {
        let mut least = UNREACHED;
        for goal in goals {
            let (_, other) = Lattice::of_node(*goal);
            let angle = remainder(heading_rad(other) - heading_rad(heading));
            least = least.min(whole_below(TURNS * self.costs.turn(angle)));
        }
        least
    }

    /// Where one can get to from a node, and at which cost.
    fn next(&self, node: u32, least: &[u64]) -> Vec<(u32, u64)> {
        let (position, heading) = Lattice::of_node(node);
        let mut next = Vec::with_capacity(STEPS.len() + 4);
        for step in 0..STEPS.len() {
            if let Some(to) = self.lattice.may_step(position, step, heading)
                && least[to] != UNREACHED
            {
                let side = self.sides_rad[step * HEADINGS + heading];
                let cost = self.step_cost(position, to, step, Some(side));
                next.push((self.lattice.node(to, heading), whole(cost)));
            }
        }
        let turn = whole(self.costs.turn(HEADING_STEP_RAD));
        let (left, right) = ((heading + 1) % HEADINGS, (heading + HEADINGS - 1) % HEADINGS);
        if self.lattice.turns(position, heading) {
            next.push((self.lattice.node(position, left), turn));
        }
        if self.lattice.turns(position, right) {
            next.push((self.lattice.node(position, right), turn));
        }
        for portal in self.by_node.get(&node).into_iter().flatten() {
            let portal = &self.portals[*portal as usize];
            let (to, to_heading) = Lattice::of_node(portal.to);
            if least[to] != UNREACHED {
                let cost = self
                    .costs
                    .portal(portal, heading_rad(heading), heading_rad(to_heading));
                next.push((portal.to, whole(cost)));
            }
        }
        next
    }

    /// Cost of a step with a side in front, or the least for all sides.
    fn step_cost(&self, from: usize, to: usize, step: usize, side_rad: Option<f64>) -> f64 {
        let length_m = step_length(step) * self.lattice.spacing_m();
        let proximity = f64::from(self.lattice.proximity[to]);
        let rise_m = f64::from(self.lattice.heights_m[to] - self.lattice.heights_m[from]);
        match side_rad {
            Some(side_rad) => self.costs.travel(length_m, side_rad, proximity, rise_m),
            None => self.costs.least_travel(length_m, proximity, rise_m),
        }
    }

    /// The least cost from each position to the goal if headings did not matter: never more than with
    /// them. Positions that cost more than the start has that of the last one that was looked at.
    fn least_costs(&self, goal: usize, start: usize) -> Vec<u64> {
        let mut by_exit: HashMap<usize, Vec<(u32, u64)>> = HashMap::new();
        for portal in self.portals {
            let (from, _) = Lattice::of_node(portal.from);
            let (to, _) = Lattice::of_node(portal.to);
            let cost = whole_below(self.costs.crossing(portal));
            by_exit.entry(to).or_default().push((from as u32, cost));
        }
        let mut least = vec![UNREACHED; self.lattice.columns * self.lattice.rows];
        let mut bound = UNREACHED;
        let mut ended_early = None;
        let reached = dijkstra_reach(&(goal as u32), |to: &u32| {
            let to = *to as usize;
            let mut before = Vec::with_capacity(STEPS.len());
            for step in 0..STEPS.len() {
                let [dx, dy] = STEPS[step];
                if let Some(from) = self.lattice.step(to, [-dx, -dy])
                    && self.lattice.is_free_somehow(from)
                {
                    let cost = whole_below(self.step_cost(from, to, step, None));
                    before.push((from as u32, cost));
                }
            }
            before.extend(by_exit.get(&to).into_iter().flatten());
            before
        });
        for item in reached {
            if item.total_cost > bound {
                ended_early = Some(item.total_cost);
                break;
            }
            least[item.node as usize] = item.total_cost;
            if item.node as usize == start {
                bound = item.total_cost + (BEYOND * item.total_cost as f64) as u64;
            }
        }
        if let Some(cost) = ended_early {
            for least in least.iter_mut().filter(|least| **least == UNREACHED) {
                *least = cost;
            }
        }
        least
    }
}
