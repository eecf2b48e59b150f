//! Routes on the command line: over an edge, around none, and why there is no way.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// The chart of `chugo7` under traction control: 48 mm up from the front, with a margin of 0.8.
const CHART: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../omni-plan/tests/charts/chugo7.toml"
);

fn plan(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_omnistep"));
    command.current_dir(folder).args([&["plan"], args].concat());
    command.output().unwrap()
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap()
}

#[test]
fn a_route_over_stairs_is_driven_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let output = plan(
        folder.path(),
        &["stairs", "--to", "4,1", "--chart", CHART, "--out", "route.toml"],
    );
    assert!(output.status.success(), "{output:?}");
    let said = text(output.stdout);
    assert!(
        said.starts_with("chugo7 on stairs: ") && said.contains("over 3 edges"),
        "{said}"
    );
    // 3 cm each, the first at x = 0.7 m, and the front leads.
    assert!(
        said.contains("| 0.70, 0.00       | up |        30.0 |         48.0 |          0 |"),
        "{said}"
    );
    let mut run = Command::new(env!("CARGO_BIN_EXE_omnistep"));
    let run = run
        .current_dir(folder.path())
        .args(["run", "route.toml", "--json"])
        .output()
        .unwrap();
    let outcome: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(outcome["verdict"], "climbed", "{outcome}");
    // Within 5 cm of the goal; the plan says 12.1 s, which has no acceleration in it.
    let arrived_s = outcome["arrived_s"].as_f64().unwrap();
    assert!((12.0..16.0).contains(&arrived_s), "{arrived_s}");
}

#[test]
fn a_route_is_written_as_numbers_too() {
    let folder = tempfile::tempdir().unwrap();
    let way = ["stairs", "--to", "2.5,0", "--chart", CHART];
    let output = plan(
        folder.path(),
        &[&way[..], &["--json", "--out", "route.csv"]].concat(),
    );
    let route: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let points = route["points"].as_array().unwrap();
    assert_eq!(route["crossings"].as_array().unwrap().len(), 3);
    let table = fs::read_to_string(folder.path().join("route.csv")).unwrap();
    assert_eq!(table.lines().count(), points.len() + 1);
    assert!(
        table.starts_with("x_m,y_m,yaw_rad,speed_m_s,time_s,crosses\n"),
        "{table}"
    );
}

#[test]
fn where_there_is_no_way_the_edge_is_named_and_the_exit_code_is_1() {
    let folder = tempfile::tempdir().unwrap();
    let output = plan(folder.path(), &["step", "--to", "2.5,0", "--chart", CHART]);
    assert_eq!(output.status.code(), Some(1));
    let said = text(output.stderr);
    assert!(
        said.contains("no way from start to goal: edge at (0.70, ")
            && said.contains("50 mm up, at most 48 mm from the front (0.8 of 60)"),
        "{said}"
    );
}

#[test]
fn what_is_wrong_is_one_line_with_the_range_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let mecanum = CHART.replace("chugo7", "mecanum4");
    for (args, parts) in [
        (
            vec!["step", "--to", "1", "--chart", CHART],
            ["to = 1", "x and y [m]"],
        ),
        (
            vec!["step", "--to", "nan,0", "--chart", CHART],
            ["to = NaN,0", "-100 to 100"],
        ),
        (
            vec!["step", "--to", "1e300,0", "--chart", CHART],
            ["to = 1", "-100 to 100"],
        ),
        (
            vec!["step", "--to", "0.7,0", "--chart", CHART],
            ["goal at (0.70, 0.00)", "edges"],
        ),
        (
            vec!["step", "--to", "2,0"],
            ["out/chart-chugo7-traction.toml", "omnistep chart"],
        ),
        (
            vec!["step", "--to", "2,0", "--chart", &mecanum],
            ["vehicle_sha256", "chugo7"],
        ),
        (
            vec!["step", "--to", "2,0", "--chart", CHART, "--out", "x.txt"],
            ["--out = x.txt", ".json, .csv or .toml"],
        ),
        (
            vec!["step", "--to", "2,0", "--chart", CHART, "--resolution", "-1"],
            ["resolution_m = -1", "0.001 to 10"],
        ),
        (
            vec!["step", "--to", "2,0", "--chart", CHART, "--around", "0"],
            ["around_m = 0", "1 to 100"],
        ),
        (
            vec!["step", "--to", "2,0", "--chart", CHART, "--margin", "2"],
            ["margin = 2", "0.1 to 1"],
        ),
        (
            vec!["step", "--to", "2,0", "--chart", CHART, "--map", "none.yaml"],
            ["none.yaml", "map_server"],
        ),
    ] {
        let output = plan(folder.path(), &args);
        let said = text(output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(parts.iter().all(|part| said.contains(part)), "{args:?}: {said}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
