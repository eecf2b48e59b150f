//! Vehicles that few numbers describe, and keys by name.

use std::fs;

use super::{omnistep, refused, stderr, stdout, words};

const SHORT: &str = r#"
schema_version = 1
name = "short"
total_mass_kg = 8.8
[[body]]
name = "frame"
inertia_box_m = [0.4, 0.35, 0.12]
[motor]
stall_torque_kg_cm = 24.3
no_load_rpm = 312
[mecanum4]
wheelbase_m = 0.336
track_m = 0.4
radius_m = 0.048
wheel_mass_kg = 0.35
"#;

#[test]
fn a_short_file_is_a_vehicle_also_where_its_body_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let (before, after) = SHORT.split_once("[[body]]").unwrap();
    let (_, motor_and_wheels) = after.split_once("[motor]").unwrap();
    fs::write(
        folder.path().join("short.toml"),
        format!("{before}[motor]{motor_and_wheels}"),
    )
    .unwrap();
    // As a scenario it would lack a vehicle.
    let said = refused(folder.path(), &["check", "short.toml"]);
    assert!(
        said.contains("body") && !said.contains("missing field `vehicle`"),
        "{said}"
    );
    fs::write(
        folder.path().join("short.toml"),
        SHORT.replace("no_load_rpm", "no_load_speed_rpm"),
    )
    .unwrap();
    let said = refused(folder.path(), &["check", "short.toml"]);
    assert!(said.contains("did you mean `no_load_rpm`?"), "{said}");
}

#[test]
fn what_a_short_file_leaves_out_is_assumed_aloud() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("short.toml"), SHORT).unwrap();
    let assumed = [
        "short: 4 wheels without inertia_kg_m2: up to 0.000403 kg.m2, that of a solid wheel",
        "short: body \"frame\" without com_m: [0, 0, 0.06], half way up its box",
        "short: body \"frame\" has what is left of total_mass_kg: 7.4 kg",
    ];
    let rolling = ["--set", "physics.wheel_model=rollers"];
    let run = [
        "run",
        "flat",
        "--vehicle",
        "short.toml",
        "--set",
        "duration_s=0.5",
        "--quiet",
    ];
    for (command, rollers) in [
        (vec!["check", "short.toml"], false),
        ([&run[..], &rolling].concat(), true),
    ] {
        let done = omnistep(folder.path(), &command);
        assert!(done.status.success(), "{}", stderr(&done));
        let said = stderr(&done);
        for line in assumed {
            assert!(said.contains(line), "{command:?}: {said}");
        }
        assert_eq!(
            said.contains("short: no [rollers]; nine a row"),
            rollers,
            "{said}"
        );
    }
    // What was logged needs no assumption: the run is repeated bit for bit.
    let replayed = omnistep(folder.path(), &["replay", "out/flat-traction.mcap"]);
    assert!(
        replayed.status.success() && !stderr(&replayed).contains("without"),
        "{}",
        stderr(&replayed)
    );
}

#[test]
fn every_command_of_a_scenario_takes_another_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    let export = |format: &str| {
        let args = "export flat --vehicle mecanum4 --set vehicle.wheel.*.radius_m=0.05 --format";
        let args: Vec<_> = args.split(' ').chain([format]).collect();
        let done = omnistep(folder.path(), &args);
        assert!(done.status.success(), "{}", stderr(&done));
        stdout(&done)
    };
    assert!(export("rust").contains("[[20.0, -20.0, ")); // one over 0.05 m
    assert!(export("mjcf").starts_with("<mujoco model=\"flat\">"));
    let run = omnistep(
        folder.path(),
        &words("run flat --vehicle omni3 --set duration_s=0.2 --quiet"),
    );
    assert!(
        stdout(&run).starts_with("omni3 on flat ground"),
        "{}",
        stdout(&run)
    );
    assert_eq!(
        refused(folder.path(), &["run", "flat", "--vehicle", "mecanum"]),
        "error: built-in flat: vehicle: \"mecanum\" (did you mean \"mecanum4\"?), allowed: chugo7, omni3, mecanum4, rocker_bogie6, \
         or the path of a .toml file\n"
    );
    let message = refused(
        folder.path(),
        &words("run flat --vehicle mecanum4 --set vehicle.wheel.left.gear=1"),
    );
    assert_eq!(
        message,
        "error: built-in mecanum4: wheel.left.gear: element \"left\", allowed: * for all, 0 to 3, or a name: front_left, \
         front_right, rear_left, rear_right\n"
    );
}
