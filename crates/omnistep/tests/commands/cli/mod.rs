//! The command line as its users meet it: what it prints, what it writes, what it says of bad input.

mod balls;
mod climb_limits;
mod doubts;
#[cfg(unix)]
mod drive;
mod export;
mod files;
mod foreign_logs;
mod grid;
mod logs;
mod messages;
mod paths;
mod refusals;
mod results;
mod robots;
mod rollers;
mod ros2_control;
mod ros2_control_urdf;
mod short_vehicles;
mod side_by_side;
mod stopped;
mod suggestions;
mod traction;
mod untrusted_files;
mod warnings;
mod wheel_layouts;

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

/// Runs `omnistep` in a folder.
pub(crate) fn omnistep(folder: &Path, args: &[&str]) -> Output {
    Command::cargo_bin("omnistep")
        .unwrap()
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// The arguments of a line as it is typed.
pub(crate) fn words(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// The objects of standard output, one a line.
pub(crate) fn rows(output: &Output) -> Vec<Value> {
    let text = stdout(output);
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// The one line on standard error of a refused request: exit code 2, nothing on standard output.
pub(crate) fn refused(folder: &Path, args: &[&str]) -> String {
    let output = omnistep(folder, args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    assert!(output.stdout.is_empty(), "{args:?}");
    assert_eq!(said.lines().count(), 1, "{args:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    said
}

/// A folder with a file of each kind: `v.toml`, `s.toml`, `y.toml`, `w.toml`, and a short log `l.mcap`.
pub(crate) fn one_of_each() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../omni-config/assets");
    for (from, to) in [
        ("vehicles/omni3.toml", "v.toml"),
        ("scenarios/flat.toml", "s.toml"),
        ("studies/climb_map.toml", "y.toml"),
        ("scenarios/motor_bench.toml", "w.toml"),
    ] {
        fs::copy(assets.join(from), folder.path().join(to)).unwrap();
    }
    folder
}
