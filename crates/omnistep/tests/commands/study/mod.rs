//! Studies: which runs there are, what their rows hold, what is left after an interruption, what is said of bad input.

mod command;
mod damage;
#[cfg(unix)]
mod interrupted;
mod points;
mod workers;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::atomic::AtomicBool;

use assert_cmd::Command;
use omni_config::{Override, Scenario, Source, Study};
use omni_study::{Cell, Computed, Found, Plan, Store, cells, compute, key, row_with, rows};

/// Runs of 10 ms: 2 frictions, 3 torques, 4 seeds.
const SMALL: &str = r#"
schema_version = 1
name = "small"
scenario = "flat"
seeds = 4

[set]
duration_s = 0.01
physics.engine = "rapier"
perturbation.yaw_rad = 0.05

[[axis]]
key = "terrain.friction"
values = [0.5, 1]

[[axis]]
key = "vehicle.motor.stall_torque_n_m"
from = 1.0
to = 2.0
count = 3

[map]
metrics = ["climbed", "slip_rms"]
"#;

fn plan_of(text: &str) -> Plan {
    Plan::new(
        &Study::from_source(&Source::text("small.toml", text)).unwrap(),
        &[],
    )
    .unwrap()
}

/// Computes what is missing; the keys of it, and all that is there then.
fn go_on(plan: &Plan, folder: &Path) -> (Vec<String>, Found) {
    let store = Store::new(folder, plan).unwrap();
    let missing = plan.missing(&store.read().unwrap());
    let mut computed = Vec::new();
    let done = compute(&missing, &store, None, &AtomicBool::new(false), |row| {
        computed.push(row.key.clone())
    });
    assert_eq!(done.unwrap().rows, computed.len());
    (computed, store.read().unwrap())
}

fn all_of(plan: &Plan, folder: &Path) -> Found {
    go_on(plan, folder).1
}

fn parts(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut parts: Vec<_> = files
        .filter(|path| path.extension().is_some_and(|e| e == "parquet"))
        .collect();
    parts.sort();
    parts
}

/// Runs `omnistep` in a folder that has `small.toml`.
fn omnistep(folder: &Path, text: &str, args: &[&str]) -> Output {
    fs::write(folder.join("small.toml"), text).unwrap();
    let mut command = Command::cargo_bin("omnistep").unwrap();
    command.current_dir(folder).args(args).output().unwrap()
}

#[test]
fn the_grid_times_the_seeds_has_each_combination_once() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let found = all_of(&plan, folder.path());
    let mut seen: Vec<_> = found
        .rows
        .iter()
        .map(|row| (format!("{:?}", row.axes), row.seed))
        .collect();
    seen.sort();
    let mut expected = Vec::new();
    for friction in [0.5, 1.0] {
        for torque in [1.0, 1.5, 2.0] {
            // 1, an integer in the file, is the number that the scenario holds.
            let axes = format!("{:?}", [Cell::Float(friction), Cell::Float(torque)]);
            expected.extend((0..4).map(|seed| (axes.clone(), seed)));
        }
    }
    expected.sort();
    assert_eq!(seen, expected);
    let keys: BTreeSet<&str> = found.keys().collect();
    assert_eq!(keys.len(), 2 * 3 * 4);
}

#[test]
fn each_row_holds_what_its_run_alone_gives() {
    let plan = plan_of(SMALL);
    let run = &plan.runs()[7];
    let scenario = run.scenario();
    assert_eq!(
        (scenario.seed, scenario.vehicle().motor.stall_torque_n_m),
        (3, 1.5)
    );
    assert_eq!(key(&scenario).unwrap(), run.key);
    let folder = tempfile::tempdir().unwrap();
    let found = all_of(&plan, folder.path());
    let row = found.rows.iter().find(|row| row.key == run.key).unwrap();
    let (outcome, _) = omni_sim::Run::new(&scenario).outcome().unwrap();
    let serde_json::Value::Object(fields) = serde_json::to_value(outcome).unwrap() else {
        panic!("an outcome is an object")
    };
    let columns = &plan.columns().metrics;
    assert_eq!(fields.len(), columns.len(), "every field is a column");
    for (column, cell) in columns.iter().zip(&row.metrics) {
        assert_eq!(
            serde_json::to_value(cell).unwrap(),
            fields[&column.name],
            "{}",
            column.name
        );
    }
}

#[test]
fn the_same_study_has_the_same_rows_on_every_machine() {
    let plan = plan_of(SMALL);
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    assert_eq!(all_of(&plan, one.path()).rows, all_of(&plan, two.path()).rows);
    let scenario = Scenario::load("flat", &[]).unwrap();
    let same = Scenario::load("flat", &[Override::parse("duration_s=4").unwrap()]).unwrap();
    assert_eq!(
        key(&scenario).unwrap(),
        key(&same).unwrap(),
        "4 and 4.0 are one number"
    );
    let mut keys: Vec<_> = plan.runs().iter().map(|run| run.key.clone()).collect();
    keys.push(key(&scenario).unwrap());
    assert!(
        keys.iter()
            .all(|key| key.len() == 32 && key.bytes().all(|b| b.is_ascii_hexdigit()))
    );
}

#[test]
fn going_on_computes_exactly_what_is_missing() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path(), &plan).unwrap();
    let stopped = AtomicBool::new(true);
    let none = compute(plan.runs(), &store, None, &stopped, |_| ()).unwrap();
    assert_eq!(
        (none.rows, store.read().unwrap().rows.len()),
        (0, 0),
        "what is stopped has no row"
    );
    let going = AtomicBool::new(false);
    compute(&plan.runs()[3..8], &store, None, &going, |_| ()).unwrap();
    let first: Vec<_> = store.read().unwrap().keys().map(str::to_owned).collect();
    assert_eq!(first.len(), 5);
    let (second, found) = go_on(&plan, folder.path());
    let all: BTreeSet<_> = first.iter().chain(&second).collect();
    assert_eq!(
        (first.len() + second.len(), all.len(), found.rows.len()),
        (24, 24, 24)
    );
    let (third, _) = go_on(&plan, folder.path());
    assert_eq!(third.len(), 0);

    // More values and more seeds: only what is new.
    let more = plan_of(
        &SMALL
            .replace("[0.5, 1]", "[0.5, 0.7, 1]")
            .replace("seeds = 4", "seeds = [2, 3, 7]"),
    );
    let (fourth, _) = go_on(&more, folder.path());
    assert_eq!(fourth.len(), 3 * 3 * 3 - 2 * 3 * 2);
}

#[test]
fn a_batch_of_rows_written_as_a_part_is_read_back_as_it_was() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path(), &plan).unwrap();
    let mut batch = rows(&plan.runs()[..6], &AtomicBool::new(false));
    batch[0].error = Some("\"quoted\", and a sign: \u{b5}".into());
    batch[1].metrics.fill(Cell::Missing);
    let path = store.write(&batch).unwrap().unwrap();
    assert_eq!(parts(folder.path()), [path]);
    assert_eq!(store.write(&[]).unwrap(), None);
    batch.sort_by(|a, b| a.key.cmp(&b.key));
    assert_eq!(store.read().unwrap().rows, batch);
}

/// A motor so strong, under a gain so high, that it tears the vehicle apart at once.
const FAILING: &str = r#"
schema_version = 1
name = "failing"
scenario = "flat"
seeds = 3
set.duration_s = 0.01
set."control.policy" = "independent"
set."physics.engine" = "rapier"
set."vehicle.gains.kp_n_m_s_rad" = 1e6
axis = [{ key = "vehicle.motor.stall_torque_n_m", values = [2.0, 1e6] }]
"#;

#[test]
fn a_failed_run_is_a_row_and_the_others_finish() {
    let plan = plan_of(FAILING);
    let folder = tempfile::tempdir().unwrap();
    let found = all_of(&plan, folder.path());
    let (failed, fine): (Vec<_>, Vec<_>) = found.rows.iter().partition(|row| row.error.is_some());
    assert_eq!((failed.len(), fine.len()), (3, 3));
    for row in &failed {
        assert_eq!(row.axes, [Cell::Float(1e6)]);
        let error = row.error.as_deref().unwrap();
        assert!(error.contains("a joint separated at t = "), "{error}");
    }
    let map = cells(&plan, &found.rows);
    assert_eq!(
        map.iter()
            .map(|cell| (cell.runs, cell.errors))
            .collect::<Vec<_>>(),
        [(3, 0), (3, 3)]
    );
    assert_eq!(map[1].mean(0), None, "a run that failed has no share");

    // They stay as they are until they are asked for again.
    let (again, _) = go_on(&plan, folder.path());
    assert_eq!(again.len(), 0);
    let store = Store::new(folder.path(), &plan).unwrap();
    assert_eq!(store.forget_errors().unwrap(), 3);
    assert_eq!(store.read().unwrap().rows.len(), 3);
    let (again, found) = go_on(&plan, folder.path());
    assert_eq!((again.len(), found.rows.len()), (3, 6));
}

#[test]
fn a_panic_in_a_run_is_the_error_of_its_row() {
    let plan = plan_of(SMALL);
    let row = row_with(&plan.runs()[0], |_| panic!("wheel {} is\nnot there", 9)).unwrap();
    assert_eq!(row.error.as_deref(), Some("panic: wheel 9 is not there"));
    assert!(row.metrics.iter().all(|cell| *cell == Cell::Missing));
    assert_eq!(row.metrics.len(), plan.columns().metrics.len());
}

#[test]
fn a_part_cut_short_is_noticed_and_computed_again() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path(), &plan).unwrap();
    let batch = rows(&plan.runs()[..4], &AtomicBool::new(false));
    let kept = rows(&plan.runs()[4..6], &AtomicBool::new(false));
    store.write(&kept).unwrap();
    let path = store.write(&batch).unwrap().unwrap();
    let whole = fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(97).chain([whole.len() - 1]) {
        fs::write(&path, &whole[..length]).unwrap();
        let found = store.read().unwrap();
        assert_eq!(found.damaged.len(), 1, "{length} of {} bytes", whole.len());
        assert_eq!(found.damaged[0].0, path);
        assert_eq!(found.rows.len(), 2);
        assert_eq!(plan.missing(&found).len(), 22);
    }
    assert_eq!(parts(folder.path()).len(), 1, "no reader meets the damaged one");

    let output = omnistep(
        folder.path(),
        SMALL,
        &["study", "small.toml", "--out", "damaged", "--json"],
    );
    assert!(output.status.success());
    let part = parts(&folder.path().join("damaged")).remove(0);
    let whole = fs::read(&part).unwrap();
    fs::write(&part, &whole[..whole.len() / 2]).unwrap();
    let output = omnistep(folder.path(), SMALL, &["study", "small.toml", "--out", "damaged"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains(part.file_name().unwrap().to_str().unwrap()) && said.contains("cannot be read"),
        "{said}"
    );
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("\n24 runs; "), "all of them again:\n{table}");
}

#[test]
fn a_folder_of_another_study_is_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    all_of(&plan_of(SMALL), folder.path());
    let refusal = |text: &str| {
        let plan = plan_of(text);
        Store::new(folder.path(), &plan)
            .unwrap()
            .read()
            .unwrap_err()
            .to_string()
    };
    let said = refusal(&SMALL.replace("0.05", "0.06"));
    assert!(
        said.contains("holds results with perturbation.yaw_rad = 0.05, but now perturbation.yaw_rad = 0.06"),
        "{said}"
    );
    let said = refusal(
        &SMALL
            .replace("terrain.friction", "control.period_s")
            .replace("[0.5, 1]", "[0.001, 0.002]"),
    );
    assert!(said.contains("control.period_s = 0.001"), "{said}");
    let said = refusal(&SMALL.replace("perturbation.yaw_rad = 0.05", ""));
    assert!(said.contains("; use another folder"), "{said}");
}

#[test]
fn writing_that_fails_ends_the_study_with_the_file_named() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path().join("gone"), &plan).unwrap();
    fs::remove_dir(folder.path().join("gone")).unwrap();
    let stop = AtomicBool::new(false);
    let done: Result<Computed, _> = compute(plan.runs(), &store, None, &stop, |_| ());
    let said = done.unwrap_err().to_string();
    assert!(
        said.contains("gone/part-") && said.contains("No such file"),
        "{said}"
    );
}
