//! Worlds, charts and an independent check of routes for the tests.

use omni_plan::{Cell, Chart, CrossingKind, Footprint, Grid, Map, Route};

/// Height of walls in the worlds of these tests \[m\].
pub(crate) const WALL_M: f64 = 0.4;

/// A map of a height at each place, with a resolution of `resolution_m` and its corner at the origin.
pub(crate) fn world(size_m: [f64; 2], resolution_m: f64, height_m: impl Fn(f64, f64) -> f64) -> Map {
    let cells = size_m.map(|size| (size / resolution_m).round() as usize);
    let grid = Grid::new(cells[0], cells[1], resolution_m, [0.0, 0.0]).expect("a grid");
    let mut heights_m = Vec::with_capacity(grid.cells());
    for row in 0..grid.rows {
        for column in 0..grid.columns {
            let [x, y] = grid.centre_of([column, row]);
            heights_m.push(height_m(x, y));
        }
    }
    Map::from_heights(grid, heights_m).expect("heights")
}

/// A chart at friction 0.7 and 0.3 m/s: sides \[deg\] with their limits up and down \[m\].
pub(crate) fn chart(sides: &[(f64, f64, f64)]) -> Chart {
    chart_at(0.7, sides)
}

/// A chart at a friction.
pub(crate) fn chart_at(friction: f64, sides: &[(f64, f64, f64)]) -> Chart {
    let mut text = format!(
        "schema_version = 1\nvehicle = \"test\"\nfriction = {friction}\nspeed_m_s = 0.3\nmargin = 0.8\n"
    );
    for (side_deg, up_m, down_m) in sides {
        for (edge, limit_m) in [("step", up_m), ("drop", down_m)] {
            text += &format!(
                "[[cell]]\nedge = \"{edge}\"\nside_deg = {side_deg:?}\nskew_deg = 0.0\nclimbs_m = {:?}\nlimit_m = {limit_m:?}\n",
                0.8 * limit_m
            );
        }
    }
    Chart::from_toml("test", &text).expect("a chart")
}

/// A real chart of the program.
pub(crate) fn chugo7() -> Chart {
    Chart::from_toml("chugo7.toml", include_str!("../charts/chugo7.toml")).expect("a chart")
}

/// What covers an edge or a closed cell along a route, found without any of the planner's code: the rectangle
/// itself, every centimetre, against every border of cells. What a crossing goes over is compared with the chart.
pub(crate) fn check_route(
    map: &Map,
    chart: &Chart,
    footprint: &Footprint,
    route: &Route,
    margin: f64,
    ignore_m: f64,
) {
    let poses = route.sampled(0.01).expect("a path");
    assert!(poses.len() > 1);
    for pair in poses.windows(2) {
        let (before, here) = (pair[0], pair[1]);
        let corners = footprint
            .corners_m(here.yaw_rad)
            .map(|[x, y]| [here.x_m + x, here.y_m + y]);
        let under = edges_under(map, &corners, ignore_m);
        if under.is_empty() {
            continue;
        }
        let place = format!("at ({:.3}, {:.3}, {:.3})", here.x_m, here.y_m, here.yaw_rad);
        assert!(here.crosses, "an edge under the vehicle {place}: {under:?}");
        let way = [here.x_m - before.x_m, here.y_m - before.y_m];
        let length = way[0].hypot(way[1]);
        assert!(
            length > 0.0 && before.yaw_rad == here.yaw_rad,
            "a turn on an edge {place}"
        );
        let side_deg = (way[1].atan2(way[0]) - here.yaw_rad).to_degrees();
        let side_deg = side_deg - 360.0 * (side_deg / 360.0).round();
        let side_deg = if side_deg.round() == -180.0 {
            180.0
        } else {
            side_deg.round()
        };
        for [across_x, across_y, rise_m] in under {
            // Up or down along the way.
            let along = (way[0] * across_x + way[1] * across_y) / length;
            if along.abs() < 1e-3 {
                continue; // a border of a slanted edge that is parallel to the way
            }
            let up = rise_m * along > 0.0;
            let friction = 0.7;
            let allowed = if up {
                chart.step_m(side_deg, friction, margin)
            } else {
                chart.drop_m(side_deg, friction, margin)
            };
            assert!(
                rise_m.abs() <= allowed + 1e-6,
                "{} mm of {} mm allowed from side {side_deg} {place}",
                1e3 * rise_m,
                1e3 * allowed
            );
        }
    }
    for crossing in &route.crossings {
        assert!(crossing.height_m <= crossing.allowed_m + 1e-6);
        let allowed = match crossing.kind {
            CrossingKind::Up => chart.step_m(crossing.side_deg, 0.7, margin),
            CrossingKind::Down => chart.drop_m(crossing.side_deg, 0.7, margin),
            _ => f64::INFINITY,
        };
        assert!(crossing.height_m <= allowed + 1e-6);
    }
}

/// Borders between cells that rise by more than `ignore_m` and lie in a convex polygon: direction
/// across (lower to higher index) and rise. A closed cell is a border that rises by 1000 m. Slopes
/// count as edges, so worlds with ramps rise by less than `ignore_m` a cell.
fn edges_under(map: &Map, corners: &[[f64; 2]; 4], ignore_m: f64) -> Vec<[f64; 3]> {
    let grid = map.grid();
    let least = |k: usize| {
        corners
            .iter()
            .map(|corner| corner[k])
            .fold(f64::INFINITY, f64::min)
    };
    let most = |k: usize| {
        corners
            .iter()
            .map(|corner| corner[k])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let inside = |x: f64, y: f64| {
        (0..4).all(|number| {
            let (one, other) = (corners[number], corners[(number + 1) % 4]);
            (other[0] - one[0]) * (y - one[1]) - (other[1] - one[1]) * (x - one[0]) >= 0.0
        })
    };
    let first = grid.cell_of([least(0), least(1)]).expect("on the map");
    let last = grid.cell_of([most(0), most(1)]).expect("on the map");
    let mut found = Vec::new();
    let half = grid.resolution_m / 2.0;
    for row in first[1]..=last[1] {
        for column in first[0]..=last[0] {
            let [x, y] = grid.centre_of([column, row]);
            if map.cell([column, row]) == Cell::Occupied && inside(x, y) {
                found.push([1.0, 0.0, 1000.0]);
            }
            for (dx, dy) in [(1.0, 0.0), (0.0, 1.0)] {
                let next = [column + dx as usize, row + dy as usize];
                if next[0] >= grid.columns || next[1] >= grid.rows {
                    continue;
                }
                let rise_m = map.height_m(next) - map.height_m([column, row]);
                let on_it = (-2..=2).any(|part| {
                    let part = half * f64::from(part) / 2.0 * 0.99;
                    inside(x + half * dx + part * dy, y + half * dy + part * dx)
                });
                if rise_m.abs() > ignore_m && on_it {
                    found.push([dx, dy, rise_m]);
                }
            }
        }
    }
    found
}
