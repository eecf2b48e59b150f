//! The ground around a run's way, of boxes and bars: for URDF, which has no fields of heights, and for a log's scene.

use omni_config::Scenario;
use omni_sim::ground::{Shape, shapes};

/// Margin of the shown ground beyond the vehicle's path \[m\].
const MARGIN_M: f64 = 1.0;
/// Thickness of the lowest ground that is shown \[m\].
const THICKNESS_M: f64 = 0.1;
/// Largest number of columns that show a height field, along each side.
const MOST_COLUMNS: usize = 40;

/// Boxes and bars, no field: fields of heights are shown as columns, at most 40 along each side,
/// each as high as the mean of the field there; all else is as in the physics.
pub(crate) fn ground_around(scenario: &Scenario) -> Vec<Shape> {
    let way = scenario.farthest_m() + 2.0 * MARGIN_M;
    let [x, y] = [scenario.start.x_m, scenario.start.y_m];
    let around = [[x - way, x + way], [y - way, y + way]];
    let all = shapes(scenario, 1e3);
    // Everything reaches down to below the lowest ground: no holes under risers.
    let floor = all.iter().map(top_m).fold(f64::INFINITY, f64::min) - THICKNESS_M;
    all.iter().flat_map(|shape| cut(shape, around, floor)).collect()
}

/// What of a shape is within `around`: x and y, from and to \[m\].
fn cut(shape: &Shape, around: [[f64; 2]; 2], floor: f64) -> Vec<Shape> {
    match shape {
        Shape::Box {
            half_m,
            centre_m,
            turn_y_rad,
        } => {
            let span = |k: usize| clip([centre_m[k] - half_m[k], centre_m[k] + half_m[k]], around[k]);
            let top = centre_m[2] + half_m[2];
            if *turn_y_rad != 0.0 {
                // A ramp is between level ground on both sides, and as long as it is.
                let y = span(1).unwrap_or([0.0; 2]);
                return vec![of_box(
                    [2.0 * half_m[0], y[1] - y[0], 2.0 * half_m[2]],
                    *centre_m,
                    *turn_y_rad,
                )];
            }
            match (span(0), span(1)) {
                (Some(x), Some(y)) => vec![column(x, y, [floor, top])],
                _ => Vec::new(),
            }
        }
        Shape::Bar {
            half_length_m,
            radius_m,
            centre_m,
        } => {
            let Some([from, to]) = clip([-half_length_m, *half_length_m], around[1]) else {
                return Vec::new();
            };
            vec![Shape::Bar {
                half_length_m: (to - from) / 2.0,
                radius_m: *radius_m,
                centre_m: [centre_m[0], f64::midpoint(from, to), centre_m[2]],
            }]
        }
        Shape::Field {
            from_m,
            extent_m: [length, width],
            rows,
            columns,
            heights_m,
        } => {
            let (across, along) = (columns.min(&MOST_COLUMNS), rows.min(&MOST_COLUMNS));
            let part = |k: usize, of: usize, n: usize| k * n / of..((k + 1) * n).div_ceil(of);
            let cells = (0..*along).flat_map(|i| (0..*across).map(move |j| (i, j)));
            let mut shown = Vec::new();
            for (i, j) in cells {
                let places = part(i, *along, *rows)
                    .flat_map(|row| part(j, *across, *columns).map(move |column| row * columns + column));
                let (sum, count) =
                    places.fold((0.0, 0.0), |(sum, count), k| (sum + heights_m[k], count + 1.0));
                let x = |k: usize| from_m + length * k as f64 / *along as f64;
                let y = |k: usize| width / 2.0 - width * k as f64 / *across as f64;
                if let (Some(x), Some(y)) = (
                    clip([x(i), x(i + 1)], around[0]),
                    clip([y(j + 1), y(j)], around[1]),
                ) {
                    shown.push(column(x, y, [floor, sum / count]));
                }
            }
            shown
        }
    }
}

fn clip([from, to]: [f64; 2], [least, most]: [f64; 2]) -> Option<[f64; 2]> {
    let (from, to) = (from.max(least), to.min(most));
    (from < to).then_some([from, to])
}

/// The lowest height of a shape's upper side \[m\].
fn top_m(shape: &Shape) -> f64 {
    match shape {
        Shape::Box { half_m, centre_m, .. } => centre_m[2] + half_m[2],
        Shape::Bar { .. } => f64::INFINITY, // lies on other ground
        Shape::Field { heights_m, .. } => heights_m.iter().copied().fold(f64::INFINITY, f64::min),
    }
}

/// A box over a rectangle, from `low` to `top`.
fn column([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], [low, top]: [f64; 2]) -> Shape {
    let middle = [
        f64::midpoint(x0, x1),
        f64::midpoint(y0, y1),
        f64::midpoint(low, top),
    ];
    of_box([x1 - x0, y1 - y0, top - low], middle, 0.0)
}

fn of_box(size: [f64; 3], middle: [f64; 3], turn_y_rad: f64) -> Shape {
    // To the nanometre: without the rounding of sums.
    let [size, centre_m] = [size, middle].map(|v| v.map(|x| (x * 1e9).round() / 1e9));
    Shape::Box {
        half_m: size.map(|edge| edge / 2.0),
        centre_m,
        turn_y_rad,
    }
}
