//! The grid of coordination laws as keys: rows, names of logs, what `list` says.

use super::{omnistep, rows};

const SHORT: [&str; 3] = ["--quiet", "--set", "duration_s=0.1"];

#[test]
fn a_point_of_the_grid_that_is_no_preset_is_a_row_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        &[
            "compare",
            "step",
            "--json",
            "--set",
            "control.policy=scale_references",
            "--set",
            "control.saturation.scale_references.floor=0.5",
        ],
        &SHORT[..],
    ]
    .concat();
    let policies: Vec<_> = rows(&omnistep(folder.path(), &arguments))
        .iter()
        .map(|row| row["policy"].as_str().unwrap().to_owned())
        .collect();
    let presets = [
        "independent",
        "scale_torques",
        "scale_references",
        "shared_integral",
        "traction_runup",
        "traction",
    ];
    assert_eq!(policies[..6], presets);
    assert_eq!(
        policies[6..],
        ["scale_references+saturation=scale_references+floor=0.5"]
    );
    assert!(
        folder
            .path()
            .join("out/step-scale_references+saturation=scale_references+floor=0.5.mcap")
            .is_file()
    );
    // Its log says what it was, and is the same law again.
    let log = "out/step-scale_references+saturation=scale_references+floor=0.5.mcap";
    let output = omnistep(folder.path(), &["replay", log]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("policy scale_references+saturation=scale_references+floor=0.5: 100 control periods, bit-identical"),
        "{said}"
    );
}

#[test]
fn a_policy_on_the_command_line_goes_with_keys_of_the_grid() {
    let folder = tempfile::tempdir().unwrap();
    let asked = ["run", "step", "--json", "--policy", "independent"];
    let keys = ["--set", "control.integral=shared"];
    let arguments = [&asked[..], &keys, &SHORT].concat();
    assert_eq!(
        rows(&omnistep(folder.path(), &arguments))[0]["policy"],
        "independent+integral=shared"
    );
}

#[test]
fn list_says_what_each_of_a_kind_is_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, name, words) in [
        (
            "policies",
            "scale_references",
            "all references are scaled together",
        ),
        ("policies", "traction", "less where one slips"),
        ("scenarios", "ice", "Ice under the left wheels"),
        ("scenarios", "square", "a stop at every corner"),
        ("vehicles", "omni3", "Three omni wheels at 120 degrees"),
        ("studies", "climb_map", "Where each policy climbs"),
        ("experiments", "motor_bench", "Section 3.3"),
    ] {
        let output = omnistep(folder.path(), &["list", kind]);
        let text = String::from_utf8(output.stdout).unwrap();
        let named = |line: &&str| line.split_whitespace().next() == Some(name);
        let line = text.lines().find(named).expect(name);
        assert!(line.contains(words), "{line}");
        assert!(
            text.lines().all(|line| line.split_whitespace().count() > 3),
            "{text}"
        );
    }
    let output = omnistep(folder.path(), &["list", "motor_bench"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(2) && said.contains("policies"),
        "{said}"
    );
}
