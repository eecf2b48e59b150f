//! Laws of routes: which side leads over an edge, ways round, reasons why there is none, mirrors, costs, friction.

use super::common::{WALL_M, chart, chart_at, check_route, chugo7, world};
use omni_plan::{Area, Cost, CrossingKind, Footprint, Goal, NoRoute, Options, Planner, Pose, Route, Speeds};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

const FRONT_ONLY: [(f64, f64, f64); 3] = [(0.0, 0.06, 0.06), (90.0, 0.005, 0.005), (180.0, 0.01, 0.01)];

fn cart() -> Footprint {
    Footprint::rectangle(0.6, 0.4).expect("a rectangle")
}

fn planner(map: &omni_plan::Map, chart: &omni_plan::Chart, options: Options) -> Planner {
    Planner::new(map, chart, &cart(), options).expect("a planner")
}

fn walled(x: f64, y: f64, size: [f64; 2], height_m: f64) -> f64 {
    let inside = (0.1..size[0] - 0.1).contains(&x) && (0.1..size[1] - 0.1).contains(&y);
    if inside { height_m } else { WALL_M }
}

#[test]
fn a_step_that_the_front_alone_climbs_is_crossed_front_first_whatever_the_yaw_was() {
    let map = world([6.0, 4.0], 0.05, |x, y| {
        walled(x, y, [6.0, 4.0], if x > 3.0 { 0.04 } else { 0.0 })
    });
    let chart = chart(&FRONT_ONLY);
    let planner = planner(&map, &chart, Options::default());
    for yaw in [0.0, 1.0, 1.57, 3.1, -2.0, -0.4] {
        let route = planner
            .plan(&Pose::new(1.5, 2.0, yaw), &Goal::pose(4.5, 2.0, yaw))
            .expect("a route");
        let [crossing] = &*route.crossings else {
            panic!("{:?}", route.crossings)
        };
        assert_eq!((crossing.side_deg, crossing.kind), (0.0, CrossingKind::Up));
        assert!((crossing.height_m - 0.04).abs() < 1e-9);
        assert!((crossing.allowed_m - 0.048).abs() < 1e-9);
        assert!(crossing.normal_rad.abs() < 1e-9);
        // On the border of the cells.
        assert!((crossing.x_m - 3.0).abs() < 1e-9);
        check_route(&map, &chart, &cart(), &route, 0.8, 0.003);
        let (first, last) = (route.points[0], route.points[route.points.len() - 1]);
        assert_eq!((first.x_m, first.y_m, first.yaw_rad), (1.5, 2.0, yaw));
        assert!((last.x_m - 4.5).hypot(last.y_m - 2.0) < 1e-9 && (last.yaw_rad - yaw).abs() < 1e-9);
    }
}

#[test]
fn a_side_that_climbs_saves_the_turn() {
    let map = world([6.0, 4.0], 0.05, |x, y| {
        walled(x, y, [6.0, 4.0], if x > 3.0 { 0.04 } else { 0.0 })
    });
    let both = chart(&[(0.0, 0.06, 0.06), (90.0, 0.055, 0.055)]);
    let route = planner(&map, &both, Options::default())
        .plan(&Pose::new(1.5, 2.0, -1.57), &Goal::place(4.5, 2.0))
        .expect("a route");
    assert_eq!(route.crossings[0].side_deg, 90.0);
}

#[test]
fn a_kerb_too_high_is_bypassed_by_a_ramp() {
    // 70 mm along x = 3, but for a ramp between y = 4 and 5.5, which begins 1 m before.
    let height = |x: f64, y: f64| {
        let ramp = (4.0..5.5).contains(&y);
        let z = if ramp {
            0.07 * (x - 2.0).clamp(0.0, 1.0)
        } else if x > 3.0 {
            0.07
        } else {
            0.0
        };
        walled(x, y, [6.0, 6.0], z)
    };
    let map = world([6.0, 6.0], 0.05, height);
    let chart = chart(&FRONT_ONLY);
    let route = planner(&map, &chart, Options::default())
        .plan(&Pose::new(1.0, 1.0, 0.0), &Goal::pose(5.0, 1.0, 0.0))
        .expect("a route");
    assert!(route.crossings.is_empty());
    assert!(route.points.iter().any(|point| point.y_m > 4.2));
    // 3.5 mm of slope a cell are no edge.
    check_route(&map, &chart, &cart(), &route, 0.8, 0.004);
}

#[test]
fn a_room_behind_too_high_a_sill_names_the_sill() {
    let height = |x: f64, y: f64| {
        let z = if (2.95..3.05).contains(&x) {
            if (0.9..1.9).contains(&y) { 0.068 } else { WALL_M }
        } else {
            0.0
        };
        walled(x, y, [6.0, 4.0], z)
    };
    let map = world([6.0, 4.0], 0.05, height);
    let chart = chart(&[(0.0, 0.055, 0.08), (180.0, 0.03, 0.08)]);
    let reason = planner(&map, &chart, Options::default())
        .plan(&Pose::new(1.0, 2.0, 0.0), &Goal::place(5.0, 2.0))
        .expect_err("no route");
    let NoRoute::Edges { edges } = &reason else {
        panic!("{reason}")
    };
    // 68 mm up; the way down is within 0.8 of 80.
    let [down] = &edges[1..] else { panic!("{reason}") };
    assert!(!down.up && (down.allowed_m - 0.064).abs() < 1e-9);
    assert!((edges[0].x_m - 2.95).abs() < 0.06 && (0.9..1.9).contains(&edges[0].y_m));
    let text = reason.to_string();
    assert!(
        text.contains("68 mm up, at most 44 mm from the front (0.8 of 55)"),
        "{text}"
    );
    assert_eq!(text.lines().count(), 1);
}

#[test]
fn a_terrace_may_be_left_where_it_cannot_be_entered() {
    let map = world([6.0, 4.0], 0.05, |x, y| {
        walled(x, y, [6.0, 4.0], if x > 3.0 { 0.06 } else { 0.0 })
    });
    let chart = chart(&[(0.0, 0.03, 0.09), (180.0, 0.03, 0.03)]);
    let planner = planner(&map, &chart, Options::default());
    let (low, high) = (Pose::new(1.5, 2.0, 0.0), Pose::new(4.5, 2.0, 0.0));
    assert!(planner.plan(&low, &Goal::place(high.x_m, high.y_m)).is_err());
    let down = planner
        .plan(&high, &Goal::place(low.x_m, low.y_m))
        .expect("a route");
    assert_eq!(down.crossings[0].kind, CrossingKind::Down);
    // Front first: it turns before.
    assert_eq!(down.crossings[0].side_deg, 0.0);
    check_route(&map, &chart, &cart(), &down, 0.8, 0.003);
}

#[test]
fn a_slanted_kerb_is_crossed_along_its_normal() {
    for angle_deg in [7.0_f64, 28.6, 52.0, -40.0] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let map = world([8.0, 8.0], 0.05, |x, y| {
            let beyond = (x - 4.0) * cos + (y - 4.0) * sin > 0.0;
            walled(x, y, [8.0, 8.0], if beyond { 0.045 } else { 0.0 })
        });
        let chart = chart(&FRONT_ONLY);
        let start = Pose::new(4.0 - 2.5 * cos, 4.0 - 2.5 * sin, 0.0);
        let goal = Goal::place(4.0 + 2.5 * cos, 4.0 + 2.5 * sin);
        let route = planner(&map, &chart, Options::default())
            .plan(&start, &goal)
            .expect("a route");
        let off = (route.crossings[0].normal_rad.to_degrees() - angle_deg).abs();
        assert!(off < 0.3, "{angle_deg}: off by {off} degrees");
        check_route(&map, &chart, &cart(), &route, 0.8, 0.003);
    }
}

#[test]
fn an_edge_of_a_smoothed_picture_has_its_normal_and_its_height() {
    for resolution_m in [0.02, 0.05] {
        for angle_deg in [0.0_f64, 4.0, 10.0, 28.6, 45.0, 70.0] {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            let exact = |x: f64, y: f64| (x - 2.013) * cos + (y - 2.0) * sin > 0.0;
            // The mean over each cell.
            let map = world([4.0, 4.0], resolution_m, |x, y| {
                let mut count = 0;
                for i in 0..64 {
                    let part = |k: i32| resolution_m * ((f64::from(k) + 0.5) / 8.0 - 0.5);
                    count += i32::from(exact(x + part(i / 8), y + part(i % 8)));
                }
                0.045 * f64::from(count) / 64.0
            });
            let chart = chart(&FRONT_ONLY);
            let route = planner(&map, &chart, Options::default())
                .plan(
                    &Pose::new(2.0 - cos, 2.0 - sin, 0.0),
                    &Goal::place(2.0 + cos, 2.0 + sin),
                )
                .expect("a route");
            let [crossing] = &*route.crossings else {
                panic!("{:?}", route.crossings)
            };
            let off = (crossing.normal_rad.to_degrees() - angle_deg).abs();
            assert!(off < 0.2, "{angle_deg}: off by {off} degrees");
            // To the option `ignore_m`.
            assert!(
                (crossing.height_m - 0.045).abs() < 0.003,
                "{angle_deg}: {}",
                crossing.height_m
            );
            check_route(&map, &chart, &cart(), &route, 0.8, 0.003);
        }
    }
}

#[test]
fn routes_of_random_worlds_cross_only_what_the_chart_allows() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut draw = |from: f64, to: f64| from + (to - from) * (random.next_u32() as f64 / f64::from(u32::MAX));
    let chugo7 = chugo7();
    let footprint = Footprint::rectangle(0.74, 0.54).expect("a rectangle");
    let (mut routes, mut crossings, mut reasons) = (0, 0, 0);
    for number in 0..15 {
        // Three kerbs at any angle, a cable, and pillars.
        let kerbs: Vec<[f64; 4]> = (0..3)
            .map(|_| [draw(2.0, 8.0), draw(2.0, 8.0), draw(-3.1, 3.1), draw(0.005, 0.06)])
            .collect();
        let cable = [draw(2.0, 8.0), draw(2.0, 8.0), draw(-1.5, 1.5)];
        let pillars: Vec<[f64; 2]> = (0..4).map(|_| [draw(2.0, 8.0), draw(2.0, 8.0)]).collect();
        let map = world([10.0, 10.0], 0.05, |x, y| {
            let beyond = |[a, b, angle, height]: &[f64; 4]| {
                let along = (x - a) * angle.cos() + (y - b) * angle.sin();
                if along > 0.0 { *height } else { 0.0 }
            };
            let pillar = pillars.iter().any(|[a, b]| (x - a).hypot(y - b) < 0.25);
            let across = (x - cable[0]) * cable[2].cos() + (y - cable[1]) * cable[2].sin();
            let bump = if across.abs() < 0.05 { 0.012 } else { 0.0 };
            let z = if pillar {
                0.5
            } else {
                kerbs.iter().map(beyond).sum::<f64>() + bump
            };
            walled(x, y, [10.0, 10.0], z)
        });
        let cost = [Cost::Time, Cost::Energy, Cost::Risk][number % 3];
        let options = Options {
            cost,
            ..Options::default()
        };
        let planner = Planner::new(&map, &chugo7, &footprint, options).expect("a planner");
        for [x, y, goal_x, goal_y] in [[1.0, 1.0, 9.0, 9.0], [9.0, 1.0, 1.0, 9.0], [1.0, 5.0, 9.0, 5.0]] {
            match planner.plan(
                &Pose::new(x, y, draw(-3.1, 3.1)),
                &Goal::pose(goal_x, goal_y, draw(-3.1, 3.1)),
            ) {
                Ok(route) => {
                    routes += 1;
                    crossings += route.crossings.len();
                    check_route(&map, &chugo7, &footprint, &route, 0.8, 0.003);
                }
                Err(_) => reasons += 1,
            }
        }
    }
    assert!(
        routes >= 15 && crossings >= 30,
        "{routes} routes, {crossings} crossings, {reasons} without"
    );
}

#[test]
fn stairs_are_climbed_in_one_straight_way() {
    // Three steps of 30 mm, 0.25 m apart: the vehicle never stands even in between.
    let map = world([6.0, 4.0], 0.05, |x, y| {
        let z = 0.03 * ((x - 2.5) / 0.25).floor().clamp(0.0, 3.0);
        walled(x, y, [6.0, 4.0], z)
    });
    let chart = chart(&FRONT_ONLY);
    let route = planner(&map, &chart, Options::default())
        .plan(&Pose::new(1.0, 2.0, 1.57), &Goal::place(5.0, 2.0))
        .expect("a route");
    assert_eq!(route.crossings.len(), 3);
    assert_eq!(route.points.iter().filter(|point| point.crosses).count(), 1);
    check_route(&map, &chart, &cart(), &route, 0.8, 0.003);
    // Treads that are shorter than the option `merge_m` are one step of 90 mm.
    let merged = Options {
        merge_m: 0.3,
        ..Options::default()
    };
    assert!(
        planner(&map, &chart, merged)
            .plan(&Pose::new(1.0, 2.0, 1.57), &Goal::place(5.0, 2.0))
            .is_err()
    );
}

#[test]
fn an_edge_that_one_side_of_the_vehicle_alone_would_meet_is_not_crossed() {
    // A door of 0.7 m with a step over half of its width.
    let height = |x: f64, y: f64| {
        let door = (1.65..2.35).contains(&y);
        let z = match (x > 3.0 && x < 3.4, door) {
            (true, false) => WALL_M,
            (true, true) if y > 2.0 => 0.03,
            _ => 0.0,
        };
        walled(x, y, [6.0, 4.0], z)
    };
    let map = world([6.0, 4.0], 0.05, height);
    let reason = planner(&map, &chart(&FRONT_ONLY), Options::default())
        .plan(&Pose::new(1.0, 2.0, 0.0), &Goal::place(5.0, 2.0))
        .expect_err("no route");
    assert!(!matches!(reason, NoRoute::Edges { .. }), "{reason}");
}

#[test]
fn a_run_up_that_has_no_room_is_said() {
    // A step 0.35 m behind a corridor's end wall: the vehicle of 0.6 m cannot stand before it.
    let height = |x: f64, y: f64| {
        let corridor = (0.1..0.65).contains(&y) && x > 1.0;
        let hall = x <= 1.0;
        let z = if x > 1.35 { 0.04 } else { 0.0 };
        if corridor || hall {
            walled(x, y, [5.0, 3.0], z)
        } else {
            WALL_M
        }
    };
    let map = world([5.0, 3.0], 0.05, height);
    let options = Options {
        run_up_m: 1.5,
        ..Options::default()
    };
    let reason = planner(&map, &chart(&FRONT_ONLY), options)
        .plan(&Pose::new(0.55, 2.0, 1.57), &Goal::place(4.0, 0.4))
        .expect_err("no route");
    assert!(
        matches!(reason, NoRoute::NoRoom { run_up_m: 1.5, .. }),
        "{reason}"
    );
}

#[test]
fn ice_before_a_step_needs_a_chart_for_ice() {
    let map = world([6.0, 4.0], 0.05, |x, y| {
        walled(x, y, [6.0, 4.0], if x > 3.0 { 0.03 } else { 0.0 })
    });
    let ice = Area::rectangle([0.0, 6.0], [0.0, 2.4]).expect("an area");
    let (start, goal) = (Pose::new(1.5, 1.2, 0.0), Goal::place(4.5, 1.2));
    let dry = chart(&FRONT_ONLY);
    let everywhere = Area::rectangle([0.0, 6.0], [0.0, 4.0]).expect("an area");
    let slippery = map
        .clone()
        .with_friction_area(everywhere, 0.2)
        .expect("a friction");
    let reason = planner(&slippery, &dry, Options::default())
        .plan(&start, &goal)
        .expect_err("no route")
        .to_string();
    assert!(
        reason.ends_with(
            "30 mm up, on ground of friction 0.2, and the chart is for 0.7 or more (omnistep chart --friction 0.2)"
        ),
        "{reason}"
    );
    let map = map.with_friction_area(ice, 0.2).expect("a friction");
    let route = planner(&map, &dry, Options::default())
        .plan(&start, &goal)
        .expect("a route");
    // Where it is not icy over the vehicle's whole width.
    assert!(route.crossings[0].y_m > 2.4 + 0.2, "{:?}", route.crossings);
    let both = dry.with(chart_at(0.2, &[(0.0, 0.04, 0.04)])).expect("charts");
    let route = planner(&map, &both, Options::default())
        .plan(&start, &goal)
        .expect("a route");
    assert!((route.crossings[0].y_m - 1.2).abs() < 0.15);
    assert!((route.crossings[0].allowed_m - 0.032).abs() < 1e-9);
}

#[test]
fn ice_far_behind_a_sill_does_not_matter() {
    let map = world([8.0, 4.0], 0.05, |x, y| {
        walled(x, y, [8.0, 4.0], if (3.0..3.2).contains(&x) { 0.03 } else { 0.0 })
    });
    let ice = Area::rectangle([5.0, 8.0], [0.0, 4.0]).expect("an area");
    let map = map.with_friction_area(ice, 0.2).expect("a friction");
    let route = planner(&map, &chart(&FRONT_ONLY), Options::default())
        .plan(&Pose::new(1.0, 2.0, 0.0), &Goal::place(7.0, 2.0))
        .expect("a route");
    assert_eq!(route.crossings.len(), 2);
}

#[test]
fn ends_out_of_the_map_and_in_walls_are_said() {
    let map = world([6.0, 4.0], 0.05, |x, y| {
        walled(x, y, [6.0, 4.0], if x > 3.0 { 0.04 } else { 0.0 })
    });
    let keep_out = Area::rectangle([4.0, 5.0], [1.0, 2.0]).expect("an area");
    let map = map.with_keep_out(keep_out);
    let planner = planner(&map, &chart(&FRONT_ONLY), Options::default());
    let plan = |x: f64, y: f64, goal_x: f64, goal_y: f64| {
        let reason = planner.plan(&Pose::new(x, y, 0.0), &Goal::pose(goal_x, goal_y, 0.0));
        reason.expect_err("no route").to_string()
    };
    assert_eq!(
        plan(-1.0, 2.0, 4.0, 2.0),
        "start at (-1.00, 2.00) is out of the map, allowed: x 0 to 6, y 0 to 4"
    );
    assert!(plan(f64::NAN, 2.0, 4.0, 2.0).contains("is out of the map"));
    assert!(plan(1.0, 2.0, 1.0, f64::INFINITY).starts_with("goal at (1.00, inf)"));
    assert!(plan(1.0, 2.0, 4.5, 1.5).starts_with("goal at (4.50, 1.50): the vehicle would stand in a wall"));
    assert!(plan(2.9, 3.0, 4.5, 3.0).ends_with("stand on an edge"));
    assert!(plan(0.2, 3.0, 4.5, 3.0).contains("start at (0.20, 3.00)"));
}

#[test]
fn a_gap_that_is_too_narrow_is_measured() {
    let height = |x: f64, y: f64| {
        let wall = (2.9..3.1).contains(&x) && !(1.8..2.15).contains(&y);
        walled(x, y, [6.0, 4.0], if wall { WALL_M } else { 0.0 })
    };
    let map = world([6.0, 4.0], 0.05, height);
    let reason = planner(&map, &chart(&FRONT_ONLY), Options::default())
        .plan(&Pose::new(1.0, 2.0, 0.0), &Goal::place(5.0, 2.0))
        .expect_err("no route");
    let NoRoute::TooNarrow {
        x_m,
        width_m,
        needed_m,
        ..
    } = reason
    else {
        panic!("{reason}")
    };
    assert!((width_m - 0.35).abs() < 1e-6, "{width_m}");
    assert!((needed_m - 0.5).abs() < 1e-9);
    assert!((2.85..3.15).contains(&x_m));
}

#[test]
fn walls_all_around_are_said() {
    let height = |x: f64, y: f64| {
        walled(
            x,
            y,
            [6.0, 4.0],
            if (2.9..3.1).contains(&x) { WALL_M } else { 0.0 },
        )
    };
    let map = world([6.0, 4.0], 0.05, height);
    let reason = planner(&map, &chart(&FRONT_ONLY), Options::default())
        .plan(&Pose::new(1.0, 2.0, 0.0), &Goal::place(5.0, 2.0));
    assert_eq!(reason, Err(NoRoute::Enclosed));
}

#[test]
fn a_straight_way_on_even_ground_is_straight() {
    let map = world([8.0, 6.0], 0.05, |_, _| 0.0);
    let planner = planner(&map, &chugo7(), Options::default());
    let route = planner
        .plan(&Pose::new(1.0, 1.0, 0.0), &Goal::pose(6.8, 4.3, 0.0))
        .expect("a route");
    let straight = 5.8_f64.hypot(3.3);
    // The lattice's directions are straightened: what is left are its ends, and the way away from the border.
    assert!(
        route.length_m < 1.003 * straight,
        "{} of {straight}",
        route.length_m
    );
    assert!((route.duration_s - route.length_m / 0.4).abs() < 1e-6);
}

#[test]
fn slow_sides_are_turned_out_of_the_way() {
    let map = world([12.0, 4.0], 0.05, |_, _| 0.0);
    let mut speeds = Speeds::new(0.4, 0.7);
    speeds.by_side_m_s = vec![[-90.0, 0.1], [0.0, 0.4], [90.0, 0.1], [180.0, 0.4]];
    let options = Options {
        speeds,
        ..Options::default()
    };
    let route = planner(&map, &chugo7(), options)
        .plan(&Pose::new(1.0, 2.0, 1.57), &Goal::place(11.0, 2.0))
        .expect("a route");
    // 10 m at 0.1 m/s are 100 s; a quarter turn is 2.2 s, and 10 m at 0.4 m/s are 25 s.
    assert!((27.0..28.0).contains(&route.duration_s), "{}", route.duration_s);
}

/// A kerb of 40 mm to cross, or a ramp 3 m aside.
fn kerb_or_ramp() -> omni_plan::Map {
    let height = |x: f64, y: f64| {
        let ramp = (5.0..6.5).contains(&y);
        let z = if ramp {
            0.04 * (x - 2.2).clamp(0.0, 0.8) / 0.8
        } else if x > 3.0 {
            0.04
        } else {
            0.0
        };
        walled(x, y, [6.0, 7.0], z)
    };
    world([6.0, 7.0], 0.05, height)
}

#[test]
fn the_key_of_the_cost_decides_between_kerb_and_ramp() {
    let map = kerb_or_ramp();
    let chart = chart(&FRONT_ONLY);
    let route = |cost: Cost| {
        let options = Options {
            cost,
            ..Options::default()
        };
        planner(&map, &chart, options)
            .plan(&Pose::new(1.0, 2.5, 0.0), &Goal::place(5.0, 2.5))
            .expect("a route")
    };
    let [time, energy, risk] = [Cost::Time, Cost::Energy, Cost::Risk].map(route);
    assert_eq!(time.crossings.len(), 1);
    assert!(risk.crossings.is_empty());
    // The lift is the same on the ramp; the longer way is not.
    assert_eq!(energy.crossings.len(), 1);
    assert!(time.duration_s < risk.duration_s);
    // 0.04 m of lift and 4 m of rolling at 0.03: 9.81 (0.04 + 0.12) J/kg; near the kerb it counts
    // for up to half as much again.
    assert!((1.5..1.9).contains(&energy.cost), "{}", energy.cost);
}

#[test]
fn a_mirrored_map_and_chart_give_the_mirrored_route() {
    // A slanted edge is followed from its other end in the mirror, so that its line may have a
    // border of a cell more or less: crossings that are tried along it shift by half a cell. Edges
    // along the axes end at the same corners, and here crossings are in middles of cells.
    for (slant_rad, tolerance) in [(0.0_f64, 1e-6), (0.5, 0.01)] {
        let height = |x: f64, y: f64| {
            let (sin, cos) = slant_rad.sin_cos();
            let kerb = (x - 3.56) * cos + (y - 2.0) * sin > 0.0 && y < 4.05;
            let pillar = (x - 2.0).hypot(y - 3.0) < 0.3;
            let z = if pillar {
                WALL_M
            } else if kerb {
                0.03
            } else {
                0.0
            };
            walled(x, y, [7.0, 6.0], z)
        };
        let map = world([7.0, 6.0], 0.05, height);
        let mirror = world([7.0, 6.0], 0.05, |x, y| height(x, 6.0 - y));
        // Only its left side climbs.
        let left = chart(&[(90.0, 0.05, 0.05), (30.0, 0.02, 0.02)]);
        let right = chart(&[(-90.0, 0.05, 0.05), (-30.0, 0.02, 0.02)]);
        // Run-ups that begin off the borders of cells.
        let options = || Options {
            run_up_m: 0.21,
            ..Options::default()
        };
        let ends = [
            (1.01, 1.01, 0.3, 5.51, 3.01),
            (1.01, 5.01, 2.0, 6.01, 1.01),
            (6.01, 3.01, 0.1, 1.01, 4.01),
        ];
        for (x, y, yaw, goal_x, goal_y) in ends {
            let one = planner(&map, &left, options())
                .plan(&Pose::new(x, y, yaw), &Goal::place(goal_x, goal_y))
                .expect("a route");
            let other = planner(&mirror, &right, options())
                .plan(&Pose::new(x, 6.0 - y, -yaw), &Goal::place(goal_x, 6.0 - goal_y))
                .expect("a route");
            let off = (one.cost - other.cost).abs();
            assert!(
                off <= tolerance * one.cost + 1e-4,
                "{slant_rad}: {} {}",
                one.cost,
                other.cost
            );
            // Of two ways of the same cost the search may take either: lengths are within two cells.
            assert!((one.length_m - other.length_m).abs() <= 0.1);
            assert_eq!(one.crossings.len(), other.crossings.len());
            for (crossing, image) in one.crossings.iter().zip(&other.crossings) {
                assert_eq!(crossing.side_deg, -image.side_deg);
            }
        }
    }
}

#[test]
fn the_same_plan_is_the_same_bytes() {
    let map = kerb_or_ramp();
    let plan = || {
        planner(&map, &chugo7(), Options::default())
            .plan(&Pose::new(1.0, 2.5, 0.7), &Goal::pose(5.0, 2.5, -2.0))
            .expect("a route")
    };
    let (one, other) = (plan(), plan());
    assert_eq!(one.to_json().expect("JSON"), other.to_json().expect("JSON"));
    assert_eq!(
        one.points_to_csv().expect("CSV"),
        other.points_to_csv().expect("CSV")
    );
    let again: Route = serde_json::from_str(&one.to_json().expect("JSON")).expect("a route");
    assert_eq!(again, one);
    let csv = one.crossings_to_csv().expect("CSV");
    assert!(csv.starts_with("x_m,y_m,normal_rad,side_deg,kind,height_m,allowed_m,speed_m_s,time_s\n"));
    assert_eq!(csv.lines().count(), 1 + one.crossings.len());
}
