//! What the command prints, and what it says of bad input.

use std::fs;

use assert_cmd::Command;
use omni_config::Study;
use omni_study::{Cell, Plan};

use super::{FAILING, SMALL, omnistep};

/// The one line that refuses a study file.
fn refused(text: &str, args: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), text, &[&["study", "small.toml"], args].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(output.stdout.is_empty());
    assert_eq!(said.lines().count(), 1, "{said}");
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        1,
        "nothing is written"
    );
    said
}

#[test]
fn a_bad_study_is_one_line_with_file_axis_value_and_range() {
    for (from, to, expected) in [
        (
            "values = [0.5, 1]",
            "values = [0.5, 3]",
            "small.toml: axis[0]: terrain.friction = 3: 3, allowed: 0 to 2",
        ),
        (
            "terrain.friction",
            "terrain.frictoin",
            "small.toml: axis[0]: terrain.frictoin = 0.5: unknown field `frictoin`",
        ),
        (
            "from = 1.0",
            "from = -1.0",
            "small.toml: axis[1]: vehicle.motor.stall_torque_n_m = -1.0: -1, allowed: 0.000001 to 1000000",
        ),
        ("count = 3", "count = 1", "small.toml: axis[1].count: "),
        (
            "count = 3",
            "",
            "small.toml: axis[1].values: allowed: either `values`, or `from`, `to` and `count`",
        ),
        (
            "to = 2.0",
            "to = inf",
            "small.toml: axis[1].to: inf, allowed: finite",
        ),
        (
            "[0.5, 1]",
            "[]",
            "small.toml: axis[0].values: [], allowed: one value or more",
        ),
        (
            "[0.5, 1]",
            "[1, 1.0]",
            "small.toml: axis: terrain.friction = 1, vehicle.motor.stall_torque_n_m = 1.0 and",
        ),
        (
            "terrain.friction",
            "seed",
            "small.toml: axis[0].key: \"seed\", allowed: any other key",
        ),
        (
            "vehicle.motor.stall_torque_n_m",
            "terrain.friction",
            "small.toml: axis[1].key: \"terrain.friction\" twice",
        ),
        (
            "terrain.friction",
            "perturbation.yaw_rad",
            "small.toml: set.perturbation.yaw_rad: is also an axis",
        ),
        (
            "duration_s = 0.01",
            "duration_s = 0.01\nseed = 3",
            "small.toml: set.seed: allowed: any other key; set the seeds with `seeds`",
        ),
        (
            "yaw_rad = 0.05",
            "yaw_rad = -0.05",
            "small.toml: set: perturbation.yaw_rad = -0.05: -0.05, allowed: 0 to 3.2",
        ),
        (
            "seeds = 4",
            "seeds = 0",
            "small.toml: seeds: 0, allowed: how many, 1 to 100000, or a list of seeds",
        ),
        (
            "seeds = 4",
            "seeds = [1, 1]",
            "small.toml: seeds: 1, allowed: how many",
        ),
        (
            "\"flat\"",
            "\"plain\"",
            "small.toml: scenario: \"plain\", allowed: step, hard_step, flat",
        ),
        (
            "\"slip_rms\"",
            "\"slip_rm\"",
            "small.toml: map.metrics: \"slip_rm\" (did you mean \"slip_rms\"?), allowed: arrived_s, climbed, ",
        ),
        (
            "[map]",
            "[map]\nx = \"friction\"",
            "small.toml: map.x: \"friction\", allowed: terrain.friction, vehicle.motor",
        ),
        (
            "[map]",
            "[maps]",
            "small.toml: maps: unknown field `maps` (did you mean `map`?), expected one of",
        ),
    ] {
        assert!(SMALL.contains(from), "{from:?} is there");
        let said = refused(&SMALL.replace(from, to), &[]);
        assert!(
            said.starts_with("error: ") && said.contains(expected),
            "expected {expected:?} in: {said}"
        );
    }
    let said = refused(SMALL, &["--set", "terrain.friction=0.4"]);
    assert!(
        said.contains("\"terrain.friction=0.4\": is an axis of small.toml, allowed: any other key"),
        "{said}"
    );
    let said = refused(SMALL, &["--set", "seed=3"]);
    assert!(
        said.contains("\"seed=3\": allowed: any other key; set the seeds with `seeds`, or --seeds"),
        "{said}"
    );
    let said = refused(SMALL, &["--set", "terrain.fricton=0.4"]);
    assert!(
        said.contains("built-in flat: terrain.fricton: unknown field"),
        "{said}"
    );
}

#[test]
fn the_command_prints_a_map_and_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), SMALL, &["study", "small.toml", "--jobs", "1"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("| vehicle.motor.stall_torque_n_m \\ terrain.friction |          0.5 |            1 |"),
        "{said}"
    );
    // None of four: by Wilson's score up to 1.96^2 / (4 + 1.96^2) = 49 % may climb.
    assert!(
        said.contains("| 1.5                                               | 0/4 (0-49 %) | 0/4 (0-49 %) |"),
        "{said}"
    );
    // All four slip alike in 10 ms but for rounding: an interval stands behind every mean of two runs or more.
    assert_eq!(said.matches(" +- ").count(), 6, "{said}");
    assert!(
        said.contains("\n24 runs; ") && said.contains("; engine rapier; 0 failed; out/small\n"),
        "{said}"
    );
    let output = omnistep(
        folder.path(),
        SMALL,
        &["study", "small.toml", "--seeds", "5", "--json"],
    );
    let lines: Vec<serde_json::Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 6, "one a cell");
    for key in [
        "terrain_friction",
        "vehicle_motor_stall_torque_n_m",
        "climbed",
        "slip_rms",
    ] {
        assert!(lines[0][key].is_number(), "{key}: {}", lines[0]);
    }
    assert_eq!((&lines[0]["runs"], &lines[0]["errors"]), (&5.into(), &0.into()));
    assert_eq!(lines[0]["climbed_low"], 0.0);
    let ends = ["slip_rms_low", "slip_rms", "slip_rms_high"].map(|key| lines[0][key].as_f64().unwrap());
    assert!(ends.is_sorted(), "{ends:?}");
    let output = omnistep(folder.path(), SMALL, &["study", "small.toml", "--seeds", "5"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("\n30 runs, 30 of them done before; engine rapier; 0 failed; out/small\n"),
        "{said}"
    );
    let said = omnistep(folder.path(), FAILING, &["study", "small.toml"]);
    assert!(said.status.success(), "failed runs are results");
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(
        said.contains("| 0/3 (0-56 %) | 0/0 (3 failed) |")
            && said.contains("the first of 3 failed runs, seed "),
        "{said}"
    );
}

#[test]
fn a_baseline_is_compared_seed_by_seed() {
    let folder = tempfile::tempdir().unwrap();
    let text = SMALL.replace("\"slip_rms\"", "\"work_j\"");
    let baseline = [
        "study",
        "small.toml",
        "--baseline",
        "vehicle.motor.stall_torque_n_m=1.5",
    ];
    let output = omnistep(folder.path(), &text, &baseline);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("difference from vehicle.motor.stall_torque_n_m = 1.5, seed by seed\n"),
        "{said}"
    );
    assert_eq!(
        said.matches("| +0 -0 of 4 |").count(),
        4,
        "two frictions, two torques: {said}"
    );
    let output = omnistep(folder.path(), &text, &[&baseline[..], &["--json"]].concat());
    let cells: Vec<serde_json::Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let compared: Vec<_> = cells.iter().filter(|cell| cell["work_j_pairs"] == 4).collect();
    assert_eq!((cells.len(), compared.len()), (6, 4), "not with themselves");
    for cell in compared {
        let same = |other: &&serde_json::Value| {
            other["terrain_friction"] == cell["terrain_friction"]
                && other["vehicle_motor_stall_torque_n_m"] == 1.5
        };
        let work = |cell: &serde_json::Value| cell["work_j"].as_f64().unwrap();
        // Every seed has a pair: the mean difference is that of the means, but for rounding.
        let expected = work(cell) - work(cells.iter().find(same).unwrap());
        assert!(
            (cell["work_j_difference"].as_f64().unwrap() - expected).abs() < 1e-12,
            "{cell}"
        );
        assert_eq!(
            (&cell["climbed_only_here"], &cell["climbed_only_there"]),
            (&0.into(), &0.into())
        );
    }
    for (value, expected) in [
        (
            "terrain.frction=1",
            "baseline: \"terrain.frction\" (did you mean \"terrain.friction\"?), allowed: terrain.friction, vehicle",
        ),
        (
            "terrain.friction=0.7",
            "baseline: terrain.friction = 0.7, allowed: 0.5, 1",
        ),
    ] {
        let said = refused(&text, &["--baseline", value]);
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn a_study_file_finds_scenario_and_vehicles_beside_itself() {
    let folder = tempfile::tempdir().unwrap();
    let beside = folder.path().join("mine");
    fs::create_dir(&beside).unwrap();
    let made = |args: &[&str]| {
        let mut command = Command::cargo_bin("omnistep").unwrap();
        let output = command.current_dir(&beside).args(args).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    made(&["new", "vehicle", "rover", "--template", "omni3"]);
    made(&["new", "scenario", "kerb", "--template", "flat"]);
    assert!(made(&["new", "study", "grid"]).ends_with("run it with: omnistep study grid.toml\n"));
    assert!(
        made(&["check", "grid.toml"]).contains(
            "grid.toml: study grid: 400 runs, 80 combinations of 3 axes with 5 seeds; scenario step"
        )
    );
    let text = "schema_version = 1\nname = 'two'\nscenario = 'kerb.toml'\nseeds = 1\nset.duration_s = 0.01\n\
                axis = [{ key = 'vehicle', values = ['mecanum4', 'rover.toml'] }]";
    fs::write(beside.join("two.toml"), text).unwrap();
    let study = Study::load(folder.path().join("mine/two.toml").to_str().unwrap()).unwrap();
    let plan = Plan::new(&study, &[]).unwrap();
    let wheels: Vec<_> = plan
        .runs()
        .iter()
        .map(|run| run.scenario().vehicle().wheel.len())
        .collect();
    assert_eq!(wheels, [4, 3]);
    assert_eq!(plan.runs()[1].axes[..], [Cell::Text("rover.toml".into())]);
}
