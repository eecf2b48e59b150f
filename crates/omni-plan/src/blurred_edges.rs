//! Lines of edges that a smoothed picture draws over some cells.
//!
//! The rises near a line, weighted by their heights, determine its position and normal.

use crate::edge_line::EdgeLine;
use crate::ground::Ground;

/// Rises belong to a line if they are no farther from it \[cells\].
const NEAR: f64 = 2.0;
/// A rise counts if it is across the line by this part at least, as cosine.
const ACROSS: f64 = 0.2;
/// An edge is drawn over more cells where its rises add up to this much more than each.
const MORE: f64 = 1.05;
/// Rises that follow each other by so many cells may be one edge.
const TOGETHER: f64 = 2.0;
/// Most rounds of a line's growth.
const ROUNDS: usize = 24;
/// A line is good if its rises are no farther from it, as root mean square \[cells\].
const SPREAD: f64 = 0.9;
/// A line has grown if it changes by less: its normal, and its half length \[cells\].
const SAME: [f64; 2] = [1e-4, 0.5];

/// Where edges are drawn over some cells.
pub(crate) struct BlurredEdges<'a> {
    ground: &'a Ground,
    /// Edges along x and y, those near each other added up \[m\].
    merged_m: [Vec<f64>; 2],
}

impl<'a> BlurredEdges<'a> {
    pub(crate) fn new(ground: &'a Ground) -> Self {
        Self {
            ground,
            merged_m: ground.merged(TOGETHER * ground.grid.resolution_m),
        }
    }

    /// Is a fifth of these borders a part of an edge that is drawn over more cells?
    pub(crate) fn is_any(&self, places: &[(usize, bool)]) -> bool {
        let blurred = places.iter().filter(|(cell, x)| {
            let (merged, rises) = if *x {
                (&self.merged_m[0], &self.ground.rise_x_m)
            } else {
                (&self.merged_m[1], &self.ground.rise_y_m)
            };
            merged[*cell].abs() > MORE * rises[*cell].abs()
        });
        5 * blurred.count() >= places.len()
    }

    /// A line that has grown along the rises near it, and their borders; none if they are no line.
    pub(crate) fn grown(&self, line: EdgeLine) -> Option<(EdgeLine, Vec<(usize, bool)>)> {
        let mut line = line;
        for _ in 0..ROUNDS {
            let rises = self.near(&line);
            let next = fitted(&rises, &line)?;
            let turned = (next.normal[0] - line.normal[0]).hypot(next.normal[1] - line.normal[1]);
            let longer = next.half_length - line.half_length;
            line = next;
            if turned < SAME[0] && longer.abs() < SAME[1] {
                break;
            }
        }
        let rises = self.near(&line);
        let (mut weights, mut squares) = (0.0, 0.0);
        for rise in &rises {
            weights += rise.weight;
            squares += rise.weight * off_line(&line, rise.place).powi(2);
        }
        let places = rises.iter().map(|rise| (rise.cell, rise.x)).collect();
        (weights > 0.0 && (squares / weights).sqrt() <= SPREAD).then_some((line, places))
    }

    /// The rises near a line and somewhat beyond its ends.
    fn near(&self, line: &EdgeLine) -> Vec<Rise> {
        let grid = self.ground.grid;
        let along = line.along();
        let reach = line.half_length + line.half_length.max(3.0);
        let mut rises = Vec::new();
        // Row by row, or column by column: that to which the line is more slanted.
        let k = usize::from(along[1].abs() > along[0].abs());
        let slope = along[1 - k] / along[k];
        let counts = [grid.columns, grid.rows];
        let begin = (line.middle[k] - reach * along[k].abs()).floor().max(0.0) as usize;
        let end = (line.middle[k] + reach * along[k].abs()).ceil().max(0.0) as usize;
        for major in begin..end.min(counts[k]) {
            let middle = line.middle[1 - k] + slope * (major as f64 + 0.5 - line.middle[k]);
            let from = (middle - 2.0 * NEAR).floor().max(0.0) as usize;
            let to = (middle + 2.0 * NEAR).ceil().max(0.0) as usize;
            for minor in from..to.min(counts[1 - k]) {
                let [column, row] = if k == 0 { [major, minor] } else { [minor, major] };
                let cell = grid.index(column, row);
                for (x, rise_m) in [
                    (true, self.ground.rise_x_m[cell]),
                    (false, self.ground.rise_y_m[cell]),
                ] {
                    let across = line.normal[usize::from(!x)];
                    if rise_m * across <= 0.0 || across.abs() < ACROSS {
                        continue;
                    }
                    let place = if x {
                        [column as f64 + 1.0, row as f64 + 0.5]
                    } else {
                        [column as f64 + 0.5, row as f64 + 1.0]
                    };
                    if off_line(line, place).abs() <= NEAR {
                        rises.push(Rise {
                            place,
                            weight: rise_m.abs() * across.abs(),
                            cell,
                            x,
                        });
                    }
                }
            }
        }
        rises
    }
}

/// A rise near a line.
struct Rise {
    place: [f64; 2],
    weight: f64,
    cell: usize,
    x: bool,
}

/// How far a place is from a line, uphill \[cells\].
fn off_line(line: &EdgeLine, place: [f64; 2]) -> f64 {
    (place[0] - line.middle[0]) * line.normal[0] + (place[1] - line.middle[1]) * line.normal[1]
}

/// The line through rises, with the normal's sign of another, as far as they reach without a gap.
fn fitted(rises: &[Rise], before: &EdgeLine) -> Option<EdgeLine> {
    let along = before.along();
    let at = |rise: &Rise| {
        (rise.place[0] - before.middle[0]) * along[0] + (rise.place[1] - before.middle[1]) * along[1]
    };
    // From its middle to both sides.
    let mut places: Vec<f64> = rises.iter().map(at).collect();
    places.sort_by(f64::total_cmp);
    let (mut least, mut most) = (-before.half_length, before.half_length);
    for place in &places {
        if *place > most && *place - most <= NEAR {
            most = *place;
        }
    }
    for place in places.iter().rev() {
        if *place < least && least - *place <= NEAR {
            least = *place;
        }
    }
    let (mut weights, mut x, mut y) = (0.0, 0.0, 0.0);
    let inside = || rises.iter().filter(|rise| (least..=most).contains(&at(rise)));
    for rise in inside() {
        weights += rise.weight;
        x += rise.weight * rise.place[0];
        y += rise.weight * rise.place[1];
    }
    if weights <= 0.0 {
        return None;
    }
    let middle = [x / weights, y / weights];
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for rise in inside() {
        let (dx, dy) = (rise.place[0] - middle[0], rise.place[1] - middle[1]);
        xx += rise.weight * dx * dx;
        xy += rise.weight * dx * dy;
        yy += rise.weight * dy * dy;
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sin, cos) = angle.sin_cos();
    let same = -sin * before.normal[0] + cos * before.normal[1] >= 0.0;
    let normal = if same { [-sin, cos] } else { [sin, -cos] };
    let line = EdgeLine {
        middle,
        normal,
        half_length: (most - least) / 2.0,
    };
    // Between its ends.
    let centre = f64::midpoint(least, most);
    let place = [
        before.middle[0] + centre * along[0] - middle[0],
        before.middle[1] + centre * along[1] - middle[1],
    ];
    let ahead = line.along();
    let shift = place[0] * ahead[0] + place[1] * ahead[1];
    Some(EdgeLine {
        middle: line.place(shift),
        ..line
    })
}
