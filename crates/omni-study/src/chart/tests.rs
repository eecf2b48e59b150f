//! Laws of charts.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};

use omni_config::{Override, Vehicle};
use omni_sim::Verdict;

use super::*;
use crate::Error;

fn keys(texts: &[&str]) -> Vec<Override> {
    texts.iter().map(|text| Override::parse(text).unwrap()).collect()
}

/// Steps up under plain loops, which do not try again: their runs are short.
fn plain(vehicle: &str, sides_deg: &[f64], overrides: &[&str]) -> ChartPlan {
    let setup = ChartSetup {
        overrides: keys(overrides),
        policy: Some("independent".into()),
        edges: vec![Edge::Step],
        sides_deg: sides_deg.into(),
        ..ChartSetup::new(vehicle)
    };
    ChartPlan::new(&setup).unwrap()
}

fn made(plan: &ChartPlan, jobs: usize) -> Chart {
    let stop = AtomicBool::new(false);
    chart(plan, &plan.empty(), NonZeroUsize::new(jobs), &stop, |_| Ok(())).unwrap()
}

/// The verdict of one run.
fn verdict(plan: &ChartPlan, approach: &Approach, size_m: f64, start: &ChartStart) -> Verdict {
    let scenario = plan.scenario(approach, size_m, start).unwrap();
    omni_sim::run(&scenario).unwrap().outcome().verdict
}

#[test]
fn a_vehicle_that_is_its_own_mirror_image_climbs_alike_on_its_left_and_right() {
    let chart = made(&plain("mecanum4", &[-90.0, -15.0, 15.0, 90.0], &[]), 2);
    let limit_m = |side_deg: f64| {
        let mut cells = chart.cell.iter();
        cells.find(|cell| cell.side_deg == side_deg).unwrap().limit_m
    };
    for side_deg in [15.0, 90.0] {
        // The starts' headings are not mirrored: the size that fails may be a neighbour, two of 1 mm.
        let off_m = (limit_m(side_deg) - limit_m(-side_deg)).abs();
        assert!(off_m < 0.0021 && limit_m(side_deg) > 0.004, "{side_deg}: {off_m}");
    }
    for (vehicle, mirrored) in [
        ("chugo7", true),
        ("mecanum4", true),
        ("omni3", true),
        ("rocker_bogie6", true),
    ] {
        assert_eq!(
            symmetry::is_mirrored(&Vehicle::load(vehicle).unwrap()),
            mirrored,
            "{vehicle}"
        );
    }
    let mut lopsided = Vehicle::load("mecanum4").unwrap();
    lopsided.body[0].com_m[1] = 0.01;
    assert!(!symmetry::is_mirrored(&lopsided));
}

#[test]
fn nothing_climbs_beyond_the_clearance_and_the_run_touches_where_the_formula_says() {
    let low = ["vehicle.body.platform.clearance_m=0.014"];
    let plan = plain("mecanum4", &[0.0], &low);
    let ahead = plan.approaches()[0];
    let bound_m = clearance_m(plan.level().vehicle(), 0.0).unwrap();
    // A run compares points 20 mm apart every 3 mm of its way: tilted by 1 in 27 they miss 0.9 mm.
    let start = plan.empty().start[0];
    assert_eq!(verdict(&plan, &ahead, bound_m - 0.001, &start), Verdict::Climbed);
    assert_eq!(verdict(&plan, &ahead, bound_m + 0.002, &start), Verdict::Touched);
    let cell = made(&plan, 1).cell.remove(0);
    assert!(
        cell.limit_m <= bound_m && cell.limit_m > bound_m - 0.002,
        "{cell:?} of {bound_m}"
    );
    assert!(
        cell.clearance_m
            .is_some_and(|clearance_m| (clearance_m - bound_m).abs() < 1e-4)
    );
    assert!(["clearance", "touched"].contains(&&*cell.because), "{cell:?}");
}

#[test]
fn a_box_that_reaches_ahead_of_the_wheels_clears_its_clearance_and_no_more() {
    let mut mecanum4 = Vehicle::load("mecanum4").unwrap();
    // 0.25 m to the front axle, and 71 mm to where its wheels meet a riser of 52 mm: the box of 0.6 m ends before that.
    let straddling_m = clearance_m(&mecanum4, 0.0).unwrap();
    assert!(straddling_m > 0.052, "{straddling_m}");
    mecanum4.body[0].inertia_box_m[0] = 0.66;
    let overhanging_m = clearance_m(&mecanum4, 0.0).unwrap();
    assert!((overhanging_m - 0.052).abs() < 1e-12, "{overhanging_m}"); // 50 mm and the 2 mm of the verdict
    // Neither rule is one of a vehicle whose wheels stand on more than two rows, and whose box ends within them.
    assert_eq!(clearance_m(&Vehicle::load("chugo7").unwrap(), 30.0), None);
}

#[test]
fn nothing_is_climbed_beyond_what_the_balance_of_forces_excludes() {
    let weak = ["vehicle.motor.stall_torque_n_m=0.5"];
    let cell = made(&plain("chugo7", &[0.0], &weak), 1).cell.remove(0);
    let bound_m = cell.climb_limits_m.unwrap();
    assert!(bound_m < 0.05, "{cell:?}");
    assert!(
        cell.limit_m <= bound_m && cell.climbs_m <= 0.8 * cell.limit_m + 1e-9,
        "{cell:?}"
    );
    // Traction control backs off and runs up faster: what holds at the commanded speed does not bound it.
    let setup = ChartSetup {
        overrides: keys(&weak),
        policy: Some("traction_runup".into()),
        ..ChartSetup::new("chugo7")
    };
    let plan = ChartPlan::new(&setup).unwrap();
    let ahead = plan
        .approaches()
        .iter()
        .find(|approach| approach.side_deg == 0.0)
        .unwrap();
    let scenario = |mm| plan.scenario(ahead, edge::size_m(mm), &plan.empty().start[0]);
    assert_eq!(bounds::climb_limits_mm(scenario, ahead, 50).unwrap(), None);
}

/// The whole chart of every vehicle: `make climb-charts`.
#[test]
fn what_is_called_climbed_is_climbed_from_nineteen_of_twenty_unseen_starts() {
    let plan = plain("omni3", &[30.0, 90.0], &[]);
    for cell in made(&plan, 2).cell {
        assert!(cell.climbs_m > 0.01, "{cell:?}");
        let climbed = (1..=20).filter(|number| {
            // Multiples of another irrational part than the chart's own.
            let part = (f64::from(*number) * std::f64::consts::SQRT_2).fract();
            let start = ChartStart {
                x_m: -0.06 * part,
                heading_deg: 2.0 * (f64::from(*number) * std::f64::consts::E).fract() - 1.0,
            };
            verdict(&plan, &cell.approach(), cell.climbs_m, &start) == Verdict::Climbed
        });
        assert!(climbed.count() >= 19, "{cell:?}");
    }
}

#[test]
fn any_number_of_threads_and_any_stop_on_the_way_give_the_same_bytes() {
    let plan = plain("omni3", &[0.0, 15.0, 165.0], &[]);
    let whole = made(&plan, 1).to_toml().unwrap();
    assert_eq!(made(&plan, 2).to_toml().unwrap(), whole);
    // Stopped after its first cell, and gone on from what was kept.
    let stop = AtomicBool::new(false);
    let mut kept = String::new();
    let first = chart(&plan, &plan.empty(), NonZeroUsize::new(1), &stop, |chart| {
        kept = chart.to_toml()?;
        stop.store(true, Ordering::Relaxed);
        Ok(())
    });
    // On a loaded machine the second may be done before the stop is seen.
    assert!(first.unwrap().cell.len() < 3);
    let begun = Chart::from_toml("kept", &kept).unwrap();
    let rest = chart(&plan, &begun, None, &AtomicBool::new(false), |_| Ok(())).unwrap();
    assert_eq!(rest.to_toml().unwrap(), whole);
}

#[test]
fn a_chart_of_other_runs_is_not_continued_and_an_error_of_the_caller_ends_it() {
    let plan = plain("omni3", &[0.0], &[]);
    let goes_on = |plan: &ChartPlan, begun: &Chart| {
        chart(plan, begun, None, &AtomicBool::new(false), |_| {
            Err(Error::Stopped)
        })
        .unwrap_err()
    };
    assert!(matches!(goes_on(&plan, &plan.empty()), Error::Stopped));
    let refused = |key: &str| {
        let other = plain("omni3", &[0.0], &[key]);
        goes_on(&other, &plan.empty()).to_string()
    };
    let torque = refused("vehicle.motor.stall_torque_n_m=0.7");
    assert!(
        torque.starts_with("chart: vehicle_sha256: ") && torque.lines().count() == 1,
        "{torque}"
    );
    assert!(refused("sensors.delay_s=0.002").starts_with("chart: scenario_key: "));
    assert_eq!(
        refused("control.policy=scale_torques"),
        "chart: policy: independent, allowed: scale_torques, as the chart that it shall continue"
    );
}

#[test]
fn what_is_wrong_with_a_request_or_a_file_is_one_line() {
    let refused = |change: &dyn Fn(&mut ChartSetup)| {
        let mut setup = ChartSetup::new("omni3");
        change(&mut setup);
        let line = ChartPlan::new(&setup).unwrap_err().to_string();
        assert_eq!(line.lines().count(), 1, "{line}");
        line
    };
    assert_eq!(
        refused(&|setup| setup.friction = -1.0),
        "chart: friction: -1, allowed: 0 to 2"
    );
    assert_eq!(
        refused(&|setup| setup.starts = 2),
        "chart: starts: 2, allowed: 3 to 100"
    );
    assert_eq!(
        refused(&|setup| setup.edges.clear()),
        "chart: edges: empty, allowed: one or more"
    );
    assert_eq!(
        refused(&|setup| setup.sides_deg = vec![f64::NAN]),
        "chart: sides_deg: NaN, allowed: -180 to 180"
    );
    assert_eq!(
        refused(&|setup| setup.overrides = keys(&["terrain.height_m=1"])),
        "chart: terrain.height_m: replaced, allowed: keys that a chart does not vary itself"
    );
    assert!(
        refused(&|setup| setup.policy = Some("nice".into())).contains("control.policy: \"nice\", allowed: ")
    );

    let whole = plain("omni3", &[0.0], &[]).empty().to_toml().unwrap();
    let of_file = |text: &str| {
        let line = Chart::from_toml("a.toml", text).unwrap_err().to_string();
        assert!(
            line.starts_with("a.toml: ") && line.lines().count() == 1,
            "{line}"
        );
        line
    };
    assert_eq!(of_file(""), "a.toml: schema_version: missing, allowed: 1");
    assert!(of_file(&whole.replace("margin = 0.8", "margin = \"a\"")).contains("line "));
    assert!(of_file(&format!("{whole}nonsense = 1")).contains("nonsense"));
    let cell = "\n[[cell]]\nedge = \"step\"\nside_deg = 0.0\nskew_deg = 0.0\nclimbs_m = -1.0\nlimit_m = 0.1\nbecause = \"\"\n";
    assert_eq!(
        of_file(&format!("{whole}{cell}")),
        "a.toml: cell[0].climbs_m: -1, allowed: 0 to 100"
    );
}

#[test]
fn every_edge_has_its_ground_and_an_obstacle_of_its_length() {
    let setup = ChartSetup {
        edges: Edge::ALL.into(),
        sides_deg: vec![0.0],
        ..ChartSetup::new("omni3")
    };
    let plan = ChartPlan::new(&setup).unwrap();
    for approach in plan.approaches() {
        let run = plan.scenario(approach, 0.02, &plan.empty().start[1]).unwrap();
        let obstacle = run.terrain.obstacle().unwrap();
        let length_m = obstacle.to_m - obstacle.from_m;
        assert!(
            (length_m - approach.edge.length_m(0.02)).abs() < 1e-12,
            "{approach:?}"
        );
        assert!(run.too_short().is_none(), "{approach:?}");
    }
    // On 1 m, measured level.
    let slope = plan
        .scenario(&plan.approaches()[3], 0.02, &plan.empty().start[0])
        .unwrap();
    assert!((slope.terrain.level_beyond_m(0.0) - 0.02).abs() < 1e-12);
}
