//! Routes on the command line: over an edge, around none, and why there is no way.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// The chart of `chugo7` under traction control: 51.2 mm up from the front, with a margin of 0.8.
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
        said.contains("| 0.70, 0.00       | up |        30.0 |         51.2 |          0 |"),
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
    // Within 5 cm of the goal; the plan says 12.1 s, without acceleration, after 3 s of rest.
    let arrived_s = outcome["arrived_s"].as_f64().unwrap();
    assert!((15.1..18.0).contains(&arrived_s), "{arrived_s}");
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

/// A map of 6 m by 3 m at 5 cm, all free, and its heights: a platform of 40 mm from x = 3 m on.
fn hall(folder: &Path) {
    let grey = |name: &str, grey: &dyn Fn(usize) -> u8| {
        let row: Vec<u8> = (0..120).map(grey).collect();
        fs::write(
            folder.join(name),
            [&b"P5\n120 60\n255\n"[..], &row.repeat(60)].concat(),
        )
        .unwrap();
    };
    grey("hall.pgm", &|_| 254);
    grey("heights.pgm", &|column| if column < 60 { 0 } else { 40 });
    let yaml = "image: hall.pgm\nresolution: 0.05\norigin: [-1.0, -1.5, 0.0]\n\
                negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n";
    fs::write(folder.join("hall.yaml"), yaml).unwrap();
}

#[test]
fn a_map_has_heights_and_areas_to_keep_out_of_and_gives_costmaps() {
    let folder = tempfile::tempdir().unwrap();
    hall(folder.path());
    let way = [
        "flat",
        "--to",
        "4,0",
        "--chart",
        CHART,
        "--map",
        "hall.yaml",
        "--json",
    ];
    let heights = ["--elevation", "heights.pgm", "--elevation-range", "0,0.255"];
    let route = |more: &[&str]| -> serde_json::Value {
        let output = plan(folder.path(), &[&way[..], more].concat());
        serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"))
    };
    let level = route(&[]);
    assert_eq!(level["crossings"].as_array().unwrap().len(), 0);
    assert_eq!(level["points"].as_array().unwrap().len(), 2);
    let over = route(&[&heights[..], &["--costmaps", "costs"]].concat());
    let edge = &over["crossings"][0];
    assert!((edge["height_m"].as_f64().unwrap() - 0.04).abs() < 1e-9, "{over}");
    assert!((edge["x_m"].as_f64().unwrap() - 2.0).abs() < 1e-9, "{over}");
    // An isotropic one, sixteen, and the speeds: a picture and a description each.
    assert_eq!(fs::read_dir(folder.path().join("costs")).unwrap().count(), 36);
    assert!(folder.path().join("costs/chugo7-heading-15.yaml").exists());
    let around = route(&["--keep-out", "1.5,2.5,-0.6,2.0"]);
    let least_y_m = around["points"]
        .as_array()
        .unwrap()
        .iter()
        .map(|point| point["y_m"].as_f64().unwrap());
    assert!(least_y_m.fold(0.0, f64::min) < -0.9, "{around}");
}

#[test]
fn where_there_is_no_way_the_edge_is_named_and_the_exit_code_is_1() {
    let folder = tempfile::tempdir().unwrap();
    let way = ["step", "--to", "2.5,0", "--chart", CHART, "--margin", "0.7"];
    let output = plan(folder.path(), &way);
    assert_eq!(output.status.code(), Some(1));
    let said = text(output.stderr);
    assert!(
        said.contains("no way from start to goal: edge at (0.70, ")
            && said.contains("50 mm up, at most 44.8 mm from the front (0.7 of 64)"),
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
        (
            vec!["step", "--to", "2,0", "--chart", CHART, "--keep-out", "1e9,2,0,1"],
            ["corner = 1000000000", "-100000 to 100000"],
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
