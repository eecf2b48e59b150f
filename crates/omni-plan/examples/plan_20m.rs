//! Plans over 20 x 20 m at 5 cm and prints how long it takes: rooms, sills, a slanted kerb, a
//! terrace with a ramp, pillars, ice.
//!
//! `cargo run -p omni-plan --release --example plan_20m [FILE]`: with a file the heights and the
//! routes are written there as JSON.
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;
use std::time::Instant;

use omni_plan::{Area, Chart, Footprint, Goal, Grid, Map, Options, Planner, Pose};

const WALL_M: f64 = 0.4;

/// Height at a place \[m\].
fn height_m(x: f64, y: f64) -> f64 {
    let outside = !(0.1..19.9).contains(&x) || !(0.1..19.9).contains(&y);
    // A wall at x = 7 with two doors; the wide one has a sill of 35 mm.
    let wall = (6.9..7.1).contains(&x);
    let sill_door = (4.0..5.6).contains(&y);
    let door = (17.0..18.2).contains(&y);
    // A wall at y = 10 beyond it.
    let second = (9.9..10.1).contains(&y) && x > 7.0 && !(9.0..10.5).contains(&x) && x < 16.0;
    let pillars = [
        [3.0, 3.0],
        [3.5, 8.0],
        [4.5, 12.0],
        [10.0, 6.0],
        [12.0, 14.0],
        [16.0, 4.0],
    ];
    let pillar = pillars.iter().any(|[a, b]| (x - a).hypot(y - b) < 0.3);
    if outside || pillar || second || (wall && !sill_door && !door) {
        return WALL_M;
    }
    if wall && sill_door {
        return 0.035;
    }
    // A kerb of 40 mm, slanted by 28.6 degrees.
    let kerb = (x - 12.0) * 0.878 + (y - 5.0) * 0.479 > 0.0 && y < 9.9 && x > 7.1;
    // A terrace of 70 mm with a ramp at its far side.
    let terrace = (12.0..16.0).contains(&x) && (14.5..18.5).contains(&y);
    let ramp = (16.0..17.5).contains(&x) && (16.0..18.5).contains(&y);
    if kerb {
        0.04 * ((9.9 - y) / 0.8).clamp(0.0, 1.0)
    } else if terrace {
        0.07
    } else if ramp {
        0.07 * (17.5 - x) / 1.5
    } else {
        0.0
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let grid = Grid::new(400, 400, 0.05, [0.0, 0.0])?;
    let mut heights_m = Vec::with_capacity(grid.cells());
    for row in 0..grid.rows {
        for column in 0..grid.columns {
            let [x, y] = grid.centre_of([column, row]);
            heights_m.push(height_m(x, y));
        }
    }
    let map = Map::from_heights(grid, heights_m.clone())?
        .with_friction_area(Area::rectangle([10.0, 13.0], [4.0, 6.5])?, 0.3)?
        .with_keep_out(Area::rectangle([1.0, 2.0], [14.0, 15.0])?);
    let chart = Chart::from_toml("chugo7.toml", include_str!("../tests/charts/chugo7.toml"))?;
    let footprint = Footprint::rectangle(0.74, 0.54)?;
    let begin = Instant::now();
    let planner = Planner::new(&map, &chart, &footprint, Options::default())?;
    println!(
        "prepared in {:.3} s, {} portals",
        begin.elapsed().as_secs_f64(),
        planner.portal_count()
    );
    let ends = [
        ("over a sill", [1.0, 1.0, 0.0], [9.0, 4.0]),
        ("over sill and kerb", [1.0, 18.5, 1.57], [17.5, 7.0]),
        ("onto the terrace", [1.0, 10.0, 0.0], [14.0, 16.5]),
        ("across the map", [1.0, 1.0, 0.0], [19.0, 19.0]),
        ("within a room", [1.0, 1.0, 0.0], [5.5, 18.5]),
    ];
    let mut routes = Vec::new();
    for (name, [x, y, yaw], [goal_x, goal_y]) in ends {
        let begin = Instant::now();
        let route = planner.plan(&Pose::new(x, y, yaw), &Goal::pose(goal_x, goal_y, 0.0));
        let seconds = begin.elapsed().as_secs_f64();
        match route {
            Ok(route) => {
                println!(
                    "{name}: {seconds:.3} s, {} poses, {:.2} m, {:.1} s of driving, {} crossings",
                    route.expanded,
                    route.length_m,
                    route.duration_s,
                    route.crossings.len()
                );
                routes.push(route);
            }
            Err(reason) => println!("{name}: {seconds:.3} s, {reason}"),
        }
    }
    if let Some(file) = std::env::args().nth(1) {
        let text = serde_json::to_string(&(grid, heights_m, routes))?;
        std::fs::write(file, text)?;
    }
    Ok(())
}
