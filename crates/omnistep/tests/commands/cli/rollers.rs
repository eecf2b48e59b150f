//! Wheels of rollers on the command line.

use super::{omnistep, refused, rows, stderr, stdout};

#[test]
fn ripple_of_straight_rollers_is_that_of_a_polygon() {
    let folder = tempfile::tempdir().unwrap();
    let mut args = vec!["wheel-ripple", "chugo7", "--json"];
    for set in ["rollers.count=8", "rollers.radius_m=0.00001", "rollers.crown_m=0"] {
        args.extend(["--set", set]);
    }
    let rows = rows(&omnistep(folder.path(), &args));
    assert_eq!(rows.len(), 7);
    for row in rows {
        let figure = |key: &str| row[key].as_f64().unwrap();
        let low = 0.066 * (std::f64::consts::PI / 8.0).cos();
        // Needles as thick as a hair, and the gap between them.
        assert!((figure("min_m") - low).abs() < 3e-5, "{row}, expected {low}");
        assert!((figure("max_m") - 0.066).abs() < 3e-5, "{row}");
        assert!((figure("ripple_m") - (figure("max_m") - figure("min_m"))).abs() < 1e-15);
    }
}

#[test]
fn ripple_is_a_table_with_a_line_a_wheel() {
    let folder = tempfile::tempdir().unwrap();
    let text = stdout(&omnistep(folder.path(), &["wheel-ripple", "mecanum4"]));
    assert!(
        text.starts_with("mecanum4: height of each axle over a turn, lengths in mm\n"),
        "{text}"
    );
    assert_eq!(
        text.lines().filter(|line| line.contains(" 1 x 9 |")).count(),
        4,
        "{text}"
    );
}

#[test]
fn missing_rollers_are_assumed_and_misfits_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let model = [
        "run",
        "flat",
        "--set",
        "physics.engine=rapier",
        "--set",
        "physics.wheel_model=rollers",
        "--set",
    ];
    let with = |more: &str| refused(folder.path(), &[&model[..], &[more]].concat());
    let text = omni_config::FileKind::Vehicle.template("omni3").unwrap();
    let (before, rollers) = text.split_once("[rollers]").unwrap();
    let (_, wheels) = rollers.split_once("[[wheel]]").unwrap();
    std::fs::write(
        folder.path().join("bare.toml"),
        format!("{before}[[wheel]]{wheels}"),
    )
    .unwrap();
    // A file without rollers has those that close the gaps: two rows of nine on an omni wheel.
    let bare = omnistep(folder.path(), &["wheel-ripple", "bare.toml"]);
    assert!(
        bare.status.success() && stdout(&bare).matches(" 2 x 9 |").count() == 3,
        "{}",
        stdout(&bare)
    );
    let exported = omnistep(folder.path(), &["export", "bare.toml", "--format", "mjcf"]);
    assert!(exported.status.success(), "{}", stderr(&exported));
    assert_eq!(
        with("physics.roller_substeps=1"),
        "error: built-in flat: physics.roller_substeps: 1, allowed: 2 to 16 at physics.timestep_s = 0.0005: rollers vibrate in \
         parts of more than 0.00025 s\n"
    );
    let slow = ["control.period_s=0.01", "--set", "physics.timestep_s=0.005"];
    assert_eq!(
        refused(folder.path(), &[&model[..], &slow].concat()),
        "error: built-in flat: physics.timestep_s: 0.005, allowed: up to 0.004 where wheels have rollers\n"
    );
    assert_eq!(
        with("vehicle.rollers.radius_m=0.05"),
        "error: built-in chugo7: rollers.radius_m: 0.05, allowed: less than half the wheel's, 0.033 (on wheel \"1\")\n"
    );
    let own = "vehicle.wheel[2].contact={kind = \"rollers\", count = 2, radius_m = 0.006}";
    assert_eq!(
        refused(folder.path(), &["run", "flat", "--set", own]),
        "error: built-in chugo7: wheel[2].contact.count: 2, allowed: 3 to 32\n"
    );
}
