//! How high the ground is at a place, and at most within a rectangle.

use super::Shape;

/// From and to along x, then along y \[m\].
pub(crate) type Rectangle = [[f64; 2]; 2];

impl Shape {
    /// Height of its upper side at a place \[m\]; none if it does not lie there.
    pub(crate) fn height_m(&self, [x, y]: [f64; 2]) -> Option<f64> {
        match self {
            Self::Field {
                from_m,
                extent_m: [length, width],
                rows,
                columns,
                heights_m,
            } => {
                let (along, aside) = ((x - from_m) / length, 0.5 - y / width);
                let inside = (0.0..=1.0).contains(&along) && (0.0..=1.0).contains(&aside);
                inside.then(|| {
                    let (i, u) = cell(along, *rows);
                    let (j, v) = cell(aside, *columns);
                    let height = |i: usize, j: usize| heights_m[i * columns + j];
                    // Two triangles per cell, as in the engines.
                    let (ahead, right) = (height(i + 1, j), height(i, j + 1));
                    if u + v <= 1.0 {
                        let here = height(i, j);
                        here + u * (ahead - here) + v * (right - here)
                    } else {
                        let beyond = height(i + 1, j + 1);
                        beyond + (1.0 - u) * (right - beyond) + (1.0 - v) * (ahead - beyond)
                    }
                })
            }
            _ => self.highest_m([[x, x], [y, y]]),
        }
    }

    /// The most that its height can be within a rectangle \[m\]; none if it does not lie there.
    pub(crate) fn highest_m(&self, [[from_x, to_x], [from_y, to_y]]: Rectangle) -> Option<f64> {
        match self {
            Self::Box {
                half_m: [half_x, half_y, half_z],
                centre_m: [x, y, z],
                turn_y_rad,
            } => {
                let (sin, cos) = if *turn_y_rad == 0.0 {
                    (0.0, 1.0)
                } else {
                    libm::sincos(*turn_y_rad)
                };
                let middle = x + half_z * sin;
                let from = from_x.max(middle - half_x * cos);
                let to = to_x.min(middle + half_x * cos);
                let height = |at: f64| z + half_z / cos - (at - x) * sin / cos;
                let meets = from <= to && from_y <= y + half_y && to_y >= y - half_y;
                meets.then(|| height(from).max(height(to)))
            }
            Self::Bar {
                radius_m,
                centre_m: [x, _, z],
                ..
            } => {
                let off = x - x.clamp(from_x, to_x);
                (off.abs() < *radius_m).then(|| z + (radius_m * radius_m - off * off).sqrt())
            }
            Self::Field {
                from_m,
                extent_m: [length, width],
                rows,
                columns,
                heights_m,
            } => {
                let i = nodes((from_x - from_m) / length, (to_x - from_m) / length, *rows)?;
                let j = nodes(0.5 - to_y / width, 0.5 - from_y / width, *columns)?;
                let rows = i.map(|i| &heights_m[i * columns + j.start()..=i * columns + j.end()]);
                Some(
                    rows.flatten()
                        .fold(f64::NEG_INFINITY, |most, height| most.max(*height)),
                )
            }
        }
    }
}

/// The cell between nodes at a part of an extent, 0 to 1, and the part of the cell.
fn cell(part: f64, nodes: usize) -> (usize, f64) {
    let at = part * (nodes - 1) as f64;
    let first = (at as usize).min(nodes - 2);
    (first, at - first as f64)
}

/// The nodes around all cells between two parts of an extent; none if these lie beside it.
fn nodes(from: f64, to: f64, nodes: usize) -> Option<std::ops::RangeInclusive<usize>> {
    let last = (nodes - 1) as f64;
    let meets = from <= 1.0 && to >= 0.0;
    meets.then(|| {
        let first = (from.max(0.0) * last).floor() as usize;
        first..=(to.min(1.0) * last).ceil() as usize
    })
}

#[cfg(test)]
mod tests {
    use crate::config::Scenario;
    use crate::ground::{reach_m, shapes};
    use crate::ground_heights_m;

    /// Rays that fall on the ground of the physics say how high it is there.
    #[test]
    fn heights_are_those_of_the_ground_of_the_physics_and_no_rectangle_has_higher_ones() {
        for name in [
            "flat",
            "step",
            "step_down",
            "stairs",
            "ramp",
            "half_step",
            "ditch",
            "bumps",
            "rough",
            "height_map",
        ] {
            let scenario = Scenario::load(name, &[]).expect("built in");
            let shapes = shapes(&scenario, reach_m(&scenario));
            // No multiple of an edge's or a cell's place.
            let places: Vec<_> = (0..2000)
                .map(|k| [0.001_37 * f64::from(k) - 0.1, 0.019_3 * f64::from(k % 89) - 0.85])
                .collect();
            for (at, expected) in places.iter().zip(ground_heights_m(&scenario, &places)) {
                let height = |shape: &crate::ground::Shape| shape.height_m(*at);
                let found = shapes.iter().filter_map(height).fold(f64::NEG_INFINITY, f64::max);
                // Rays find a round bar by iterations, whose digits its 400 m of length take:
                // 1.5e-6 m off at most. All else they find by planes, 5e-14 m off at most.
                let tolerance_m = if name == "bumps" { 1e-5 } else { 1e-9 };
                assert!(
                    (found - expected).abs() < tolerance_m,
                    "{name} at {at:?}: {found}, {expected}"
                );
                let around = at.map(|at| [at - 0.05, at + 0.05]);
                let most = shapes.iter().filter_map(|shape| shape.highest_m(around));
                assert!(
                    most.fold(f64::NEG_INFINITY, f64::max) >= found,
                    "{name} at {at:?}"
                );
            }
        }
    }

    #[test]
    fn a_bump_is_as_high_as_its_circle() {
        let shapes = shapes(&Scenario::load("bumps", &[]).expect("built in"), 10.0);
        // Half round, of 2 cm, the first from 0.7 m on: its middle is at 0.72 m.
        for off_m in [0.0, 0.0012, -0.012, 0.016, 0.0199] {
            let heights = shapes
                .iter()
                .filter_map(|shape| shape.height_m([0.72 + off_m, 0.1]));
            let expected = (0.02_f64.powi(2) - off_m * off_m).sqrt();
            // 0.72 m is rounded to 1e-16, which the slope at its foot makes ten times as much.
            assert!(
                (heights.fold(f64::NEG_INFINITY, f64::max) - expected).abs() < 1e-14,
                "{off_m}"
            );
        }
    }
}
