//! What is said where balls are not the wheels they stand for.

use std::path::Path;
use std::process::Output;

use super::{omnistep, rows, stderr, stdout};

const SIDE_ON: [&str; 6] = [
    "--set",
    "vehicle=mecanum4",
    "--set",
    "start.heading_rad=1.57",
    "--set",
    "command.frame=world",
];

/// A run of a tenth of a second of a scenario, and what it says.
fn run(folder: &Path, scenario: &str, more: &[&str]) -> Output {
    let short = ["run", scenario, "--quiet", "--set", "duration_s=0.1"];
    let output = omnistep(folder, &[&short[..], more].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    output
}

/// The small robot of docs/validation.md.
fn small_robot() -> String {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../scripts/measure/wheel_models/small_mecanum.toml"
    );
    format!("vehicle={path}")
}

#[test]
fn balls_that_are_asked_for_where_they_are_no_wheels_are_warned_of_once() {
    let folder = tempfile::tempdir().unwrap();
    let robot = small_robot();
    let head_on = ["--set", &robot];
    for keys in [&SIDE_ON[..], &head_on] {
        let low = [
            keys,
            &[
                "--set",
                "physics.wheel_model=ball",
                "--set",
                "terrain.height_m=0.02",
            ],
        ]
        .concat();
        let output = run(folder.path(), "step", &low);
        let said = stderr(&output);
        let warnings: Vec<_> = said.lines().filter(|line| line.contains("balls")).collect();
        assert_eq!(warnings.len(), 1, "{said}");
        assert!(
            warnings[0].contains("balls are no valid wheel model here"),
            "{said}"
        );
        assert!(warnings[0].ends_with("leave physics.wheel_model out"), "{said}");
        assert!(warnings[0].chars().count() <= 300, "{said}");
        let json = rows(&run(folder.path(), "step", &[&low[..], &["--json"]].concat()));
        assert_eq!(json[0]["wheel_model_valid"], false);
    }
}

#[test]
fn nothing_is_said_of_balls_that_are_the_wheels_nor_of_rollers() {
    let folder = tempfile::tempdir().unwrap();
    let runs: [(&str, &[&str]); 4] = [
        ("step", &[]),
        ("flat", &[]),
        ("flat", &["--set", "vehicle=mecanum4"]),
        ("step", &SIDE_ON),
    ];
    for (scenario, keys) in runs {
        let output = run(folder.path(), scenario, keys);
        assert!(!stderr(&output).contains("balls"), "{scenario} {keys:?}");
        let json = rows(&run(folder.path(), scenario, &[keys, &["--json"]].concat()));
        assert_eq!(json[0]["wheel_model_valid"], true, "{scenario} {keys:?}");
    }
}

#[test]
fn a_study_counts_runs_on_invalid_balls() {
    let folder = tempfile::tempdir().unwrap();
    let study = "schema_version = 1\nname = \"sides\"\nscenario = \"step\"\nseeds = 2\n[set]\nduration_s = 0.05\n\
         physics.wheel_model = \"ball\"\n[[axis]]\nkey = \"vehicle\"\nvalues = [\"chugo7\", \"mecanum4\"]\n";
    std::fs::write(folder.path().join("sides.toml"), study).unwrap();
    let output = omnistep(folder.path(), &["study", "sides.toml", "--quiet"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said = stderr(&output);
    let said: Vec<_> = said.lines().filter(|line| line.contains("balls")).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(
        said[0].starts_with("warning: 2 of 4 runs: mecanum4 over a step of 5.0 cm: "),
        "{said:?}"
    );
    let cells = rows(&omnistep(
        folder.path(),
        &["study", "sides.toml", "--quiet", "--json"],
    ));
    let beyond: Vec<_> = cells.iter().map(|cell| cell["beyond_balls"].as_u64()).collect();
    assert_eq!(beyond, [Some(0), Some(2)]);
    let checked = stdout(&omnistep(folder.path(), &["check", "sides.toml"]));
    assert!(checked.contains("WARNING: 2 of 4 runs"), "{checked}");
}

#[test]
fn check_says_how_wheels_are_simulated() {
    let folder = tempfile::tempdir().unwrap();
    let check = |text: &str| {
        std::fs::write(folder.path().join("some.toml"), text).unwrap();
        let output = omnistep(folder.path(), &["check", "some.toml"]);
        assert!(output.status.success(), "{}", stderr(&output));
        stdout(&output)
    };
    let step = include_str!("../../../../omni-config/assets/scenarios/step.toml");
    let mecanum = step.replace("\"chugo7\"", "\"mecanum4\"");
    let vehicle = include_str!("../../../../omni-config/assets/vehicles/chugo7.toml");
    for (text, said) in [
        (step, "balls, a valid model over a step of 5.0 cm"),
        (&mecanum, "rollers\n"),
        (
            &mecanum.replace("[physics]\n", "[physics]\nwheel_model = \"ball\"\n"),
            "WARNING: mecanum4 over a step of 5.0 cm: balls are no valid wheel model here",
        ),
        (vehicle, "balls on level ground and at an edge straight ahead"),
    ] {
        let text = check(text);
        assert!(text.contains(&format!("  wheels   {said}")), "{text}");
    }
}
