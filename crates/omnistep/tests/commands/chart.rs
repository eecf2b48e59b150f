//! Climb charts on the command line: what is printed and written, and what is left after Ctrl-C.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

fn chart(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_omnistep"));
    command.current_dir(folder).args([&["chart"], args].concat());
    command.output().unwrap()
}

const SMALL: [&str; 7] = [
    "omni3",
    "--policy",
    "independent",
    "--edge",
    "step",
    "--quiet",
    "--side",
];

#[test]
fn a_chart_is_a_table_and_a_file_that_resume_adds_to() {
    let folder = tempfile::tempdir().unwrap();
    let made = |more: &[&str]| {
        let output = chart(folder.path(), &[&SMALL[..], more].concat());
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let whole = made(&["0,15", "--out", "whole.toml"]);
    assert!(
        whole.starts_with("omni3 under independent, friction 0.7, 0.3 m/s: "),
        "{whole}"
    );
    assert!(whole.contains("|          0 |          0 |"), "{whole}");
    assert!(
        whole.contains("2 cells; ") && whole.ends_with("whole.toml\n"),
        "{whole}"
    );
    made(&["15"]);
    let added = made(&["0", "--resume"]);
    assert!(added.contains("2 cells, 1 of them done before; "), "{added}");
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("out/chart-omni3-independent.toml"), read("whole.toml"));
    let lines = made(&["0,15", "--resume", "--json"]);
    let cells: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(cells.len(), 2);
    assert_eq!(cells[1]["side_deg"], 15.0);
}

#[test]
fn what_is_wrong_is_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("other.toml"), "schema_version = 3\n").unwrap();
    for (args, expected) in [
        (
            &["wheel"][..],
            "error: built-in flat: vehicle: \"wheel\", allowed: chugo7",
        ),
        (
            &["omni3", "--friction", "-1"],
            "error: chart: friction: -1, allowed: 0 to 2",
        ),
        (
            &["omni3", "--side", "181"],
            "error: chart: sides_deg: 181, allowed: -180 to 180",
        ),
        (
            &["omni3", "--set", "start.x_m=1"],
            "error: chart: start.x_m: replaced, allowed: ",
        ),
        (
            &["omni3", "--policy", "x"],
            "error: built-in flat: control.policy: \"x\", allowed: auto",
        ),
        (
            &["omni3", "--resume", "--out", "other.toml"],
            "error: other.toml: schema_version: 3, allowed: 1",
        ),
    ] {
        let output = chart(folder.path(), args);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.starts_with(expected) && said.lines().count() == 1, "{said}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn check_says_from_which_sides_a_charted_vehicle_climbs_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let made = chart(
        folder.path(),
        &[&SMALL[..], &["0,30,60", "--out", "omni3.toml"]].concat(),
    );
    assert!(made.status.success(), "{made:?}");
    let check = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_omnistep"));
        let output = command
            .current_dir(folder.path())
            .args([&["check"], args].concat())
            .output()
            .unwrap();
        let [said, warned] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
        (output.status.code().unwrap(), said, warned)
    };
    // The page's table: 4.0, 17.6 and 8.0 mm.
    for (height, line, warning) in [
        ("0.003", "from 0, 30, 60 deg; at most 17.6 mm, at 30 deg", None),
        (
            "0.008",
            "from 30, 60 deg; ",
            Some("omni3: its chart plans with 4.0 mm straight ahead, less than the step of 0.008 m: stalled"),
        ),
        (
            "0.03",
            "from none of 3 sides; at most 17.6 mm",
            Some("omni3: its chart plans with no step of 0.03 m from any side: at most 17.6 mm, at 30 deg"),
        ),
    ] {
        let (code, said, warned) = check(&["omni3", "--step", height, "--chart", "omni3.toml"]);
        assert_eq!(code, 0, "{warned}");
        let expected = format!("\n  chart    step of {height} m {line}");
        assert!(said.contains(&expected), "{said}");
        assert!(said.contains("(independent, friction 0.7, 0.3 m/s)"), "{said}");
        assert!(
            said.contains("; wheel 1 stands across and meets the edge with a roller"),
            "{said}"
        );
        match warning {
            Some(warning) => assert!(warned.contains(warning), "{warned}"),
            None => assert!(!warned.contains("chart"), "{warned}"),
        }
    }
    let (code, _, warned) = check(&["mecanum4", "--step", "0.01", "--chart", "omni3.toml"]);
    assert_eq!(code, 2);
    assert!(
        warned.starts_with("error: omni3.toml: vehicle_sha256: that of another vehicle omni3, allowed: "),
        "{warned}"
    );
    let (code, _, warned) = check(&["omni3", "--chart", "omni3.toml"]);
    assert!(code == 2 && warned.contains("--step"), "{warned}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_finished_cells_and_resume_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let sides = "0,15,30,45,60,75,90";
    let file = folder.path().join("a.toml");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_omnistep"))
        .current_dir(folder.path())
        .args([&["chart"], &SMALL[..], &[sides, "--out", "a.toml", "--jobs", "1"]].concat())
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let begun = std::time::Instant::now();
    while !file.exists() {
        assert!(begun.elapsed().as_secs() < 120, "no cell is done");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let sent = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let cells = |text: &str| text.matches("[[cell]]").count();
    let kept = fs::read_to_string(&file).unwrap();
    assert!((1..7).contains(&cells(&kept)), "{kept}");
    let resumed = chart(
        folder.path(),
        &[&SMALL[..], &[sides, "--out", "a.toml", "--resume"]].concat(),
    );
    assert!(resumed.status.success(), "{resumed:?}");
    let whole = chart(folder.path(), &[&SMALL[..], &[sides, "--out", "b.toml"]].concat());
    assert!(whole.status.success(), "{whole:?}");
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("a.toml"), read("b.toml"));
}
