//! Points that a program lists, and batches of runs for other processes.

use std::sync::atomic::Ordering;

use omni_config::Seeds;
use omni_study::Batch;

use super::*;

fn of_scenarios(points: &[&[&str]], seeds: Seeds) -> Result<Plan, omni_study::Error> {
    let points = points.iter().map(|texts| {
        let replaced: Vec<_> = texts.iter().map(|text| Override::parse(text).unwrap()).collect();
        let scenario = Scenario::load("flat", &replaced).unwrap();
        (replaced, scenario)
    });
    Plan::of_scenarios("listed", points.collect(), seeds)
}

pub(super) fn growing(folder: &Path) -> usize {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    names
        .filter(|path| path.extension().is_some_and(|ending| ending == "growing"))
        .count()
}

#[test]
fn listed_points_of_a_grid_are_the_runs_of_that_grid() {
    let study = plan_of(SMALL);
    let mut points = Vec::new();
    for friction in ["terrain.friction=0.5", "terrain.friction=1"] {
        for torque in ["1", "1.5", "2"] {
            let torque = format!("vehicle.motor.stall_torque_n_m={torque}");
            let all = [
                friction,
                &torque,
                "duration_s=0.01",
                "physics.engine=rapier",
                "perturbation.yaw_rad=0.05",
            ];
            points.push(all.map(str::to_owned));
        }
    }
    let points: Vec<Vec<&str>> = points
        .iter()
        .map(|point| point.iter().map(String::as_str).collect())
        .collect();
    let points: Vec<&[&str]> = points.iter().map(Vec::as_slice).collect();
    let listed = of_scenarios(&points, Seeds::Count(4)).unwrap();
    let known = |plan: &Plan| {
        plan.runs()
            .iter()
            .map(|run| (run.key.clone(), run.seed))
            .collect::<Vec<_>>()
    };
    assert_eq!(known(&listed), known(&study));
    let metrics = |plan: &Plan| -> Vec<_> {
        let rows = rows(&plan.runs()[..6], &AtomicBool::new(false));
        rows.into_iter()
            .map(|row| (row.key, row.metrics, row.error))
            .collect()
    };
    assert_eq!(metrics(&listed), metrics(&study));
    assert_eq!(listed.runs()[7].axes[..2], study.runs()[7].axes[..]);
}

#[test]
fn a_key_that_a_point_leaves_has_the_scenarios_value() {
    let points: [&[&str]; 4] = [
        &["terrain.friction=0.5"],
        &["control.policy=scale_torques"],
        &[
            "command.vx_m_s=0.2",
            "heading_hold.gain_per_s=2.0",
            "heading_hold.limit_rad_s=1.0",
        ],
        &[],
    ];
    let plan = of_scenarios(&points, Seeds::List(vec![7])).unwrap();
    let own = Scenario::load("flat", &[]).unwrap();
    let (friction, policy) = (own.terrain.friction(), own.control.policy.clone());
    assert_ne!((friction, policy.as_str()), (0.5, "scale_torques"));
    let axes = |i: usize| plan.runs()[i].axes[..4].to_vec();
    let speed = Cell::Float(own.command.vx_m_s);
    let text = |text: &str| Cell::Text(text.into());
    assert_eq!(
        axes(0),
        [Cell::Float(0.5), text(&policy), speed.clone(), Cell::Missing]
    );
    assert_eq!(
        axes(1),
        [
            Cell::Float(friction),
            text("scale_torques"),
            speed.clone(),
            Cell::Missing
        ]
    );
    assert_eq!(
        axes(2),
        [
            Cell::Float(friction),
            text(&policy),
            Cell::Float(0.2),
            Cell::Float(2.0)
        ]
    );
    assert_eq!(
        axes(3),
        [Cell::Float(friction), text(&policy), speed, Cell::Missing]
    );
    assert_eq!(plan.runs()[2].scenario().seed, 7);
    // Of a vehicle, which is a table, its name; of another table nothing.
    let plan = of_scenarios(
        &[
            &[],
            &["vehicle=rocker_bogie6"],
            &["heading_hold={gain_per_s=2.0, limit_rad_s=1.0}"],
        ],
        Seeds::Count(1),
    )
    .unwrap();
    let axes: Vec<_> = plan.runs().iter().map(|run| run.axes.to_vec()).collect();
    assert_eq!(axes[0], [text(&own.vehicle().name), Cell::Missing]);
    assert_eq!(axes[1], [text("rocker_bogie6"), Cell::Missing]);
    assert_eq!(axes[2][0], text(&own.vehicle().name));
}

#[test]
fn listed_points_that_are_equal_or_none_are_refused() {
    let said = |points: &[&[&str]]| of_scenarios(points, Seeds::Count(2)).unwrap_err().to_string();
    let (once, twice): (&[&str], &[&str]) = (&["terrain.friction=0.5"], &["terrain.friction=0.50"]);
    let expected = "listed: points: points[0] and points[2] are the same run, allowed: each run once";
    assert_eq!(said(&[once, &[], twice]), expected);
    assert_eq!(said(&[]), "listed: points: none, allowed: one or more");
    let seed = said(&[&["seed=3"]]);
    assert_eq!(
        seed,
        "listed: points: \"seed\", allowed: any other key; set the seeds with `seeds`"
    );
    let both: &[&str] = &["terrain.friction=0.5", "seed=3"];
    let many = of_scenarios(&[both; 11], Seeds::Count(100_000));
    let expected = "listed: seeds: 100000 for 11 combinations, allowed: 1000000 runs at most";
    assert_eq!(
        many.unwrap_err().to_string(),
        expected,
        "before any point is looked at"
    );
    let none = of_scenarios(&[once], Seeds::Count(0)).unwrap_err().to_string();
    assert_eq!(none, "listed: seeds: 0, allowed: one or more");
}

#[test]
fn a_row_is_in_the_folder_before_it_is_reported() {
    let plan = plan_of(&SMALL.replace("seeds = 4", "seeds = 20"));
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path(), &plan).unwrap();
    let mut received = 0;
    let done = compute(plan.runs(), &store, None, &AtomicBool::new(false), |row| {
        received += 1;
        let found = store.read().unwrap();
        assert!(found.keys().any(|key| key == row.key), "{received}");
        assert!(found.damaged.is_empty());
    });
    assert_eq!((done.unwrap().rows, received), (120, 120));
    assert!(!parts(folder.path()).is_empty());
    assert_eq!(growing(folder.path()), 0, "every part is whole at the end");
}

#[test]
fn a_batch_that_was_ended_in_the_middle_goes_on_where_it_was() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path(), &plan).unwrap();
    let _lock = store.lock().unwrap();
    let text = Batch::new(&plan, &plan.runs()[2..20]).unwrap().to_text();
    let one = std::num::NonZeroUsize::new(1);
    let mut keys = Vec::new();
    let stop = AtomicBool::new(false);
    let first = Batch::from_text(&text)
        .unwrap()
        .compute(folder.path(), one, &stop, |row| {
            keys.push(row.key.clone());
            stop.store(keys.len() >= 5, Ordering::Relaxed);
        });
    assert!((5..18).contains(&first.unwrap().rows), "{}", keys.len());
    let going = AtomicBool::new(false);
    let second = Batch::from_text(&text)
        .unwrap()
        .compute(folder.path(), one, &going, |row| keys.push(row.key.clone()));
    let distinct: BTreeSet<_> = keys.iter().collect();
    assert_eq!((keys.len(), distinct.len()), (18, 18), "each run once");
    assert!(second.unwrap().rows > 0);
    assert_eq!(parts(folder.path()).len(), 1);
    let mut expected = rows(&plan.runs()[2..20], &going);
    expected.sort_by(|a, b| a.key.cmp(&b.key));
    assert_eq!(store.read().unwrap().rows, expected, "as without a batch");
}

#[test]
fn a_batch_of_another_folder_or_program_is_refused() {
    let plan = plan_of(SMALL);
    let batch = Batch::new(&plan, &plan.runs()[..4]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let stop = AtomicBool::new(false);
    let said = batch
        .compute(folder.path(), None, &stop, |_| ())
        .unwrap_err()
        .to_string();
    assert!(said.contains("every worker must see the same folder"), "{said}");
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        0,
        "nothing is written"
    );

    let version = format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    let older = batch.to_text().replacen(&version, "\"version\":\"0.0.7\"", 1);
    let said = Batch::from_text(&older).unwrap_err().to_string();
    assert!(
        said.starts_with("batch of runs: of omnistep 0.0.7, but this worker has "),
        "{said}"
    );

    let store = Store::new(folder.path(), &plan).unwrap();
    let _lock = store.lock().unwrap();
    let changed = batch.to_text().replacen("vx_m_s = 0.3", "vx_m_s = 0.4", 1);
    assert_ne!(changed, batch.to_text());
    let changed = Batch::from_text(&changed).unwrap();
    let said = changed
        .compute(folder.path(), None, &stop, |_| ())
        .unwrap_err()
        .to_string();
    assert!(
        said.contains("batch of runs: run ") && said.ends_with(" has another scenario"),
        "{said}"
    );
}

#[test]
fn a_metric_by_another_name_is_the_same_column() {
    let own = plan_of(SMALL);
    let called = SMALL.replace("\"slip_rms\"", "\"torque_squared_n2m2s\"");
    let plan = plan_of(&called);
    assert_eq!(plan.study().map.metrics, ["climbed", "torque_squared_n2m2s"]);
    assert_eq!(plan.columns(), own.columns());
    let keys = |plan: &Plan| plan.runs().iter().map(|run| run.key.clone()).collect::<Vec<_>>();
    assert_eq!(keys(&plan), keys(&own));
}
