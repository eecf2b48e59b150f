//! The path of a route: segments at one heading are straightened if they stay clear, crossings are inserted exactly.

use crate::angles::{HEADINGS, heading_rad, remainder};
use crate::cost::Costs;
use crate::lattice::Lattice;
use crate::portals::Portal;
use crate::{Crossing, Goal, Options, Point, Pose, RoutePoint};

/// A straight way is looked at in steps of this part of the lattice's spacing.
const SAMPLES: f64 = 0.25;
/// Points that are nearer to each other are one \[m\], and so are yaws \[rad\].
const SAME: f64 = 1e-9;

/// Longest turn between two points \[rad\].
const MOST_TURN_RAD: f64 = 3.1;

/// Makes the path of a chain of nodes.
pub(crate) struct PathMaker<'a> {
    pub(crate) lattice: &'a Lattice,
    pub(crate) portals: &'a [Portal],
    pub(crate) costs: &'a Costs<'a>,
    pub(crate) options: &'a Options,
    pub(crate) points: Vec<RoutePoint>,
    pub(crate) crossings: Vec<Crossing>,
}

impl PathMaker<'_> {
    /// The path from a start over nodes to a goal.
    pub(crate) fn path(
        &mut self,
        start: Pose,
        nodes: &[u32],
        by_node: impl Fn(u32) -> Vec<u32>,
        goal: &Goal,
    ) {
        self.points.push(RoutePoint {
            x_m: start.x_m,
            y_m: start.y_m,
            yaw_rad: remainder(start.yaw_rad),
            speed_m_s: 0.0,
            time_s: 0.0,
            crosses: false,
        });
        // A way at one heading, which begins where the vehicle is.
        let mut way = vec![[start.x_m, start.y_m]];
        let mut heading = nodes.first().map_or(0, |node| Lattice::of_node(*node).1);
        for (number, node) in nodes.iter().enumerate() {
            let (position, new_heading) = Lattice::of_node(*node);
            let before = number.checked_sub(1).map(|before| nodes[before]);
            let portal = before.and_then(|before| self.portal(before, *node, by_node(before)));
            if let Some(portal) = portal {
                let portal = self.portals[portal as usize].clone();
                way.push([portal.entry.x_m, portal.entry.y_m]);
                self.travel(&way, heading);
                self.cross(&portal);
                way = vec![[portal.exit.x_m, portal.exit.y_m]];
            } else if new_heading != heading {
                self.travel(&way, heading);
                way = way.last().copied().into_iter().collect();
            }
            heading = new_heading;
            way.push(self.lattice.place_m(position));
        }
        way.push([goal.x_m, goal.y_m]);
        self.travel(&way, heading);
        if let Some(yaw_rad) = goal.yaw_rad {
            self.turn(yaw_rad);
        }
    }

    /// The portal between two nodes; none if it is a step or a turn.
    fn portal(&self, before: u32, after: u32, of_node: Vec<u32>) -> Option<u32> {
        let ((from, heading), (to, new_heading)) = (Lattice::of_node(before), Lattice::of_node(after));
        let turned = (new_heading + HEADINGS - heading) % HEADINGS;
        let is_turn = from == to && (turned == 1 || turned == HEADINGS - 1);
        let columns = self.lattice.columns;
        let step = (to % columns)
            .abs_diff(from % columns)
            .max((to / columns).abs_diff(from / columns));
        if is_turn || (heading == new_heading && step <= 2) {
            return None;
        }
        let leads = |portal: &u32| self.portals[*portal as usize].to == after;
        let cost = |portal: &u32| {
            let portal = &self.portals[*portal as usize];
            self.costs
                .portal(portal, heading_rad(heading), heading_rad(new_heading))
        };
        of_node
            .into_iter()
            .filter(leads)
            .min_by(|one, other| cost(one).total_cmp(&cost(other)))
    }

    /// Turns in place, where the yaw is another.
    fn turn(&mut self, yaw_rad: f64) {
        let Some(last) = self.points.last().copied() else {
            return;
        };
        let turn = remainder(yaw_rad - last.yaw_rad);
        if turn.abs() < SAME {
            return;
        }
        // Turns that follow each other are one, up to half a turn: beyond, the shorter way would be the other.
        if let [.., before, last] = &mut *self.points
            && (before.x_m, before.y_m) == (last.x_m, last.y_m)
        {
            let so_far = remainder(last.yaw_rad - before.yaw_rad);
            if so_far * turn > 0.0 && (so_far + turn).abs() < MOST_TURN_RAD {
                last.yaw_rad = remainder(yaw_rad);
                last.time_s += turn.abs() / self.options.speeds.yaw_rad_s;
                return;
            }
        }
        self.points.push(RoutePoint {
            yaw_rad: remainder(yaw_rad),
            speed_m_s: 0.0,
            time_s: last.time_s + turn.abs() / self.options.speeds.yaw_rad_s,
            crosses: false,
            ..last
        });
    }

    /// Goes straight to a place at a speed.
    fn go(&mut self, [x_m, y_m]: Point, speed_m_s: f64, crosses: bool) {
        let Some(last) = self.points.last().copied() else {
            return;
        };
        let way_m = (x_m - last.x_m).hypot(y_m - last.y_m);
        if way_m < SAME {
            return;
        }
        self.points.push(RoutePoint {
            x_m,
            y_m,
            yaw_rad: last.yaw_rad,
            speed_m_s,
            time_s: last.time_s + way_m / speed_m_s,
            crosses,
        });
    }

    /// A crossing, from where the vehicle is.
    fn cross(&mut self, portal: &Portal) {
        self.turn(portal.entry.yaw_rad);
        let time_s = self.points.last().map_or(0.0, |last| last.time_s);
        for part in &portal.parts {
            let [x_m, y_m] = part.place_m;
            let way_m = (x_m - portal.entry.x_m).hypot(y_m - portal.entry.y_m);
            self.crossings.push(Crossing {
                x_m,
                y_m,
                normal_rad: remainder(portal.direction_rad),
                side_deg: portal.side_deg,
                kind: part.kind,
                height_m: part.height_m,
                allowed_m: part.allowed_m,
                speed_m_s: portal.speed_m_s,
                time_s: time_s + way_m / portal.speed_m_s,
            });
        }
        self.go([portal.exit.x_m, portal.exit.y_m], portal.speed_m_s, true);
    }

    /// A way at one heading, straightened: from each point to the farthest that a straight way reaches at no more cost.
    fn travel(&mut self, way: &[Point], heading: usize) {
        if way.len() < 2 {
            return;
        }
        self.turn(heading_rad(heading));
        let mut here = 0;
        while here + 1 < way.len() {
            let mut cost = self.straight_cost(way[here], way[here + 1], heading);
            let mut farthest = here + 1;
            for there in here + 2..way.len() {
                let last = self.straight_cost(way[there - 1], way[there], heading);
                let (Some(before), Some(last)) = (cost, last) else {
                    break;
                };
                match self.straight_cost(way[here], way[there], heading) {
                    Some(straight) if straight <= (before + last) * (1.0 + 1e-6) => {
                        cost = Some(straight);
                        farthest = there;
                    }
                    _ => break,
                }
            }
            let side = self.side_rad(way[here], way[farthest], heading);
            self.go(way[farthest], self.options.speeds.speed_m_s(side), false);
            here = farthest;
        }
    }

    /// Direction of a straight way in the vehicle's axes \[rad\].
    fn side_rad(&self, from: Point, to: Point, heading: usize) -> f64 {
        remainder((to[1] - from[1]).atan2(to[0] - from[0]) - heading_rad(heading))
    }

    /// Cost of a straight segment; none if it is not free.
    fn straight_cost(&self, from: Point, to: Point, heading: usize) -> Option<f64> {
        let length_m = (to[0] - from[0]).hypot(to[1] - from[1]);
        let steps = (length_m / (SAMPLES * self.lattice.spacing_m())).ceil().max(1.0) as usize;
        let side = self.side_rad(from, to, heading);
        let part_m = length_m / steps as f64;
        let mut cost = 0.0;
        let mut height_m: Option<f64> = None;
        for step in 0..=steps {
            let part = step as f64 / steps as f64;
            let place = [0, 1].map(|k| from[k] + part * (to[k] - from[k]));
            let position = self.lattice.position_of(place)?;
            if !self.lattice.is_free(position, heading) {
                return None;
            }
            let here_m = f64::from(self.lattice.heights_m[position]);
            let rise_m = height_m.map_or(0.0, |before| here_m - before);
            height_m = Some(here_m);
            if step > 0 {
                let proximity = f64::from(self.lattice.proximity[position]);
                cost += self.costs.travel(part_m, side, proximity, rise_m);
            }
        }
        Some(cost)
    }
}
