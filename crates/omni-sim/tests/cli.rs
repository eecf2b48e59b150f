//! The command line as its users meet it: what it prints, what it writes, what it says of bad input.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

/// Keys that are null where the riser was never reached.
const FIGURES: [&str; 14] = [
    "crossing_s",
    "pitch_peak_deg",
    "slip_rms",
    "disturbed_rms",
    "spread_rms",
    "heat_n2m2s",
    "stalled_at_m",
    "stalled_row",
    "yaw_error_deg",
    "shape_error_rms_rad_s",
    "work_j",
    "cost_of_transport",
    "e_over_mgh",
    "required_friction",
];

/// Runs `omnistep` in a folder.
fn omnistep(folder: &Path, args: &[&str]) -> Output {
    Command::cargo_bin("omnistep")
        .unwrap()
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// The objects of standard output, one a line.
fn rows(output: &Output) -> Vec<Value> {
    let text = stdout(output);
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// The one line on standard error of a refused request: exit code 2, nothing on standard output.
fn refused(folder: &Path, args: &[&str]) -> String {
    let output = omnistep(folder, args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    assert!(output.stdout.is_empty(), "{args:?}");
    assert_eq!(said.lines().count(), 1, "{args:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    said
}

#[test]
fn compare_json_prints_one_object_a_policy_with_the_keys_agreed_on_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &["compare", "step", "--json"]);
    assert!(output.status.success());
    let rows = rows(&output);
    let policies: Vec<_> = rows.iter().map(|row| row["policy"].as_str().unwrap()).collect();
    assert_eq!(policies, ["independent", "paper", "synchronised", "load_sharing"]);
    let others = [
        "policy",
        "verdict",
        "climbed",
        "energy_residual",
        "steps_per_s",
        "realtime_factor",
        "mcap",
    ];
    let keys = [&FIGURES[..], &others].concat();
    for row in &rows {
        let object = row.as_object().unwrap();
        assert_eq!(object.len(), keys.len(), "{row}");
        assert!(keys.iter().all(|key| object.contains_key(*key)), "{row}");
        assert!(folder.path().join(row["mcap"].as_str().unwrap()).is_file());
    }
    assert_eq!(rows[0]["climbed"], true, "independent climbs at 2 N.m");
    // Pictures of the paper's Fig. 9 show the front row up and the middle down: asin(0.05 / 0.30) = 9.594 degrees.
    assert!((rows[0]["pitch_peak_deg"].as_f64().unwrap() - 9.594).abs() < 0.5);
    assert_eq!(
        fs::read_dir(folder.path().join("out")).unwrap().count(),
        4,
        "no half-written files"
    );
}

#[test]
fn without_arguments_it_compares_the_policies_on_the_step() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &[]);
    assert!(output.status.success());
    let table = stdout(&output);
    for word in [
        "chugo7",
        "5.0 cm",
        "independent",
        "paper",
        "synchronised",
        "load_sharing",
        "x real time",
    ] {
        assert!(table.contains(word), "{word} is missing:\n{table}");
    }
    assert!(folder.path().join("out/step-synchronised.mcap").is_file());
}

#[test]
fn same_scenario_and_seed_write_the_same_bytes() {
    let run = || {
        let folder = tempfile::tempdir().unwrap();
        let args = [
            "run",
            "step",
            "--seed",
            "7",
            "--set",
            "perturbation.yaw_rad=0.05",
            "--set",
            "duration_s=2.5",
            "--quiet",
        ];
        assert!(omnistep(folder.path(), &args).status.success());
        fs::read(folder.path().join("out/step-synchronised.mcap")).unwrap()
    };
    let (one, two) = (run(), run());
    assert!(
        one.len() > 100_000,
        "2.5 s at 1 kHz are more than {} bytes",
        one.len()
    );
    assert!(one == two, "the files differ");
}

#[test]
fn wheels_json_has_the_times_of_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &["wheels", "--json"]);
    let rows = rows(&output);
    assert_eq!(
        rows.iter()
            .map(|r| r["policy"].as_str().unwrap())
            .collect::<Vec<_>>(),
        ["independent", "paper", "synchronised"]
    );
    for row in rows {
        let times: Vec<f64> = row["t_s"]
            .as_array()
            .unwrap()
            .iter()
            .map(|t| t.as_f64().unwrap())
            .collect();
        for time in [4.0, 6.5, 13.0, 20.0, 30.0, 45.0, 54.0, 59.9, 64.0] {
            assert!(times.contains(&time), "{time} s exactly");
        }
        for wheel in ["A", "B", "C"] {
            assert_eq!(row["speed_rpm"][wheel].as_array().unwrap().len(), times.len());
        }
    }
}

#[test]
fn a_new_file_is_checked_runs_and_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let said = omnistep(folder.path(), &["new", "vehicle", "rover", "--like", "omni3"]);
    assert_eq!(
        stdout(&said),
        "rover.toml: started from omni3; run it with: omnistep run flat --set vehicle=rover.toml\n"
    );
    let said = omnistep(folder.path(), &["new", "scenario", "kerb"]);
    assert_eq!(
        stdout(&said),
        "kerb.toml: started from step; run it with: omnistep run kerb.toml\n"
    );
    let said = omnistep(folder.path(), &["check", "rover.toml", "kerb.toml"]);
    assert_eq!(
        stdout(&said),
        "rover.toml: vehicle rover: 1 body, 0 hinges, 3 wheels, 7.200 kg\n  \
         layout   condition number 1.00 (1 is best)\n  \
         weight   centre of mass at (0.017, 0.000, 0.075) m\n  \
         loads    at rest on flat ground [N]: 1 27.9, 2 21.4, 3 21.4\n  \
         speed    motors reach 33.3 rad/s without load: 1.92 m/s forward, 1.67 m/s sideways, 9.26 rad/s about\n  \
         gains    kp 0.1500 N.m.s/rad, ki 0.8000 N.m/rad, kd 0 N.m.s2/rad, given\n\
         kerb.toml: scenario kerb, 6 s, policy synchronised; vehicle chugo7: 3 bodies, 2 hinges, 7 wheels, 20.000 kg\n  \
         layout   condition number 1.58 (1 is best)\n  \
         weight   centre of mass at (0.000, 0.000, 0.134) m\n  \
         loads    at rest on flat ground [N]: 1 21.6, 2 21.6, 3 21.6, 4 66.7, 5 21.6, 6 21.6, 7 21.6\n  \
         gains    kp 0.3000 N.m.s/rad, ki 2.0000 N.m/rad, kd 0 N.m.s2/rad, given\n"
    );
    let run = [
        "run",
        "flat",
        "--set",
        "vehicle=rover.toml",
        "--set",
        "duration_s=0.1",
        "--json",
    ];
    assert!(omnistep(folder.path(), &run).status.success());

    let own = fs::read_to_string(folder.path().join("rover.toml"))
        .unwrap()
        .replace("mass_kg = 6.0", "mass_kg = -6.0");
    fs::write(folder.path().join("rover.toml"), &own).unwrap();
    let said = refused(folder.path(), &["new", "vehicle", "rover"]);
    assert_eq!(said, "error: rover.toml: File exists (os error 17)\n");
    assert_eq!(fs::read_to_string(folder.path().join("rover.toml")).unwrap(), own);
    let said = refused(folder.path(), &["check", "rover.toml"]);
    assert_eq!(
        said,
        "error: rover.toml: body[0].mass_kg: -6, allowed: 0.001 to 10000\n"
    );
    let said = refused(folder.path(), &["new", "vehicle", "my robot"]);
    assert_eq!(
        said,
        "error: new my robot: name: \"my robot\", allowed: 1 to 40 letters, digits, '_' or '-'\n"
    );
    let said = refused(folder.path(), &["new", "vehicle", "a", "--like", "b"]);
    assert_eq!(
        said,
        "error: unknown vehicle \"b\", allowed: chugo7, omni3, mecanum4, rocker_bogie6\n"
    );
}

/// The built-in vehicle and step with one text replaced, as files `v.toml` and `s.toml`; refused with this message.
fn refused_file(file: &str, from: &str, to: &str, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../omni-config/assets");
    let vehicle = fs::read_to_string(assets.join("vehicles/chugo7.toml")).unwrap();
    let scenario = fs::read_to_string(assets.join("scenarios/step.toml")).unwrap();
    let scenario = scenario.replace("vehicle = \"chugo7\"", "vehicle = \"v.toml\"");
    let change = |text: &str, name: &str| {
        if name == file {
            assert!(text.contains(from), "{name} has no {from:?}");
            text.replacen(from, to, 1)
        } else {
            text.to_owned()
        }
    };
    fs::write(folder.path().join("v.toml"), change(&vehicle, "v.toml")).unwrap();
    fs::write(folder.path().join("s.toml"), change(&scenario, "s.toml")).unwrap();
    let said = refused(folder.path(), &["compare", "s.toml"]);
    assert!(said.contains(file), "names the file: {said}");
    assert!(said.contains(expected), "expected {expected:?} in: {said}");
    assert!(!folder.path().join("out").exists(), "nothing is written");
}

#[test]
fn a_typo_in_a_key_is_named_with_the_keys_there_are() {
    refused_file(
        "s.toml",
        "height_m =",
        "hight_m =",
        "terrain.hight_m: unknown field `hight_m`, expected one of",
    );
    refused_file(
        "v.toml",
        "\nradius_m = 0.066",
        "\nradios_m = 0.066",
        "wheel[0].radios_m: unknown field `radios_m`, expected one of",
    );
}

#[test]
fn a_missing_field_is_named() {
    refused_file("s.toml", "duration_s = 6.0", "", "missing field `duration_s`");
    refused_file("v.toml", "mass_kg = 6.0", "", "body[1]: missing field `mass_kg`");
}

#[test]
fn a_wrong_type_is_named_with_its_key() {
    refused_file(
        "s.toml",
        "height_m = 0.05",
        "height_m = \"high\"",
        "terrain.height_m: invalid type: string",
    );
    refused_file(
        "s.toml",
        "kind = \"step\"",
        "kind = \"steps\"",
        "unknown variant `steps`, expected one of `flat`, `step`,",
    );
    refused_file("s.toml", "kind = \"step\"", "", "missing field `kind`");
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = true",
        "body[1].mass_kg: invalid type: boolean",
    );
}

#[test]
fn text_that_is_not_toml_is_refused_with_its_line() {
    refused_file("s.toml", "name = \"step\"", "name = \"step", "s.toml:3: ");
}

#[test]
fn values_out_of_range_are_named_with_the_range() {
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = nan",
        "body[1].mass_kg: NaN, allowed: 0.001 to 10000",
    );
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = -6.0",
        "body[1].mass_kg: -6, allowed: 0.001 to 10000",
    );
    refused_file(
        "v.toml",
        "radius_m = 0.066",
        "radius_m = 0.0",
        "wheel[0].radius_m: 0, allowed: 0.001 to 10",
    );
    refused_file(
        "v.toml",
        "limit_rad = 0.9",
        "limit_rad = 9.0",
        "hinge[0].limit_rad: 9, allowed: 0 to 3",
    );
    refused_file(
        "s.toml",
        "friction = 0.7",
        "friction = nan",
        "terrain.friction: NaN, allowed: 0 to 2",
    );
    refused_file(
        "s.toml",
        "vx_m_s = 0.3",
        "vx_m_s = inf",
        "command.vx_m_s: inf, allowed: -100 to 100",
    );
    refused_file(
        "s.toml",
        "period_us = 1000",
        "period_us = 750",
        "control.period_us: 750, allowed: a multiple of physics.step_us, 500",
    );
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = 1e300",
        "body[1].mass_kg: 1e300, allowed: 0.001 to 10000",
    );
    refused_file(
        "v.toml",
        "com_m = [0.18, 0.0, 0.18]",
        "com_m = [180, 0.0, 180]",
        "body[1].com_m: [180, 0, 180], allowed: -100 to 100",
    );
}

#[test]
fn another_version_of_a_file_says_what_to_do_whatever_else_is_in_it() {
    for file in ["s.toml", "v.toml"] {
        // Keys that a later version may have are no reason to speak of keys.
        refused_file(
            file,
            "schema_version = 1",
            "schema_version = 2\nfrom_the_future = true",
            "schema_version: 2, this program reads version 1: update omnistep",
        );
        refused_file(
            file,
            "schema_version = 1",
            "schema_version = 0",
            "schema_version: 0, the first version is 1: write schema_version = 1",
        );
        refused_file(
            file,
            "schema_version = 1",
            "",
            "schema_version: missing: write schema_version = 1 at the top of the file",
        );
        refused_file(
            file,
            "schema_version = 1",
            "schema_version = \"1\"",
            "schema_version: \"1\", allowed: a whole number: write schema_version = 1",
        );
    }
}

#[test]
fn a_shape_that_cannot_be_or_cannot_stand_is_refused() {
    refused_file(
        "v.toml",
        "position_m = [-0.30, 0.23]",
        "position_m = [-0.30, -0.11]",
        "wheel[2].position_m: [-0.3, -0.11], allowed: clear of other wheels: wheels \"1\" and \"3\" intersect",
    );
    // As balls on the ground they are clear of each other, the rollers being small; their rims cross.
    refused_file(
        "v.toml",
        "position_m = [-0.30, 0.00]",
        "position_m = [-0.24, -0.17]",
        "wheels \"1\" and \"2\" intersect",
    );
    // Millimetres for metres.
    refused_file(
        "v.toml",
        "anchor_m = [0.0, 0.0, 0.066] ",
        "anchor_m = [0.0, 0.0, 66] ",
        "hinge[0].anchor_m: [0.0, 0.0, 66.0], allowed: ",
    );
    refused_file(
        "v.toml",
        "com_m = [0.18, 0.0, 0.18]",
        "com_m = [1.8, 0.0, 0.18]",
        "body[1].com_m: [1.8, 0.0, 0.18] puts the vehicle's centre of mass at (0.486, 0.000), where it tips at rest; \
         allowed: over the wheels, whose polygon is within x -0.300 to 0.300, y -0.230 to 0.230",
    );
}

#[test]
fn couplings_join_two_hinges_that_are_there_and_that_the_physics_step_resolves() {
    let coupling = |rest: &str| format!("[[coupling]]\nname = \"c\"\nhinge_a = \"pitch\"\n{rest}\n\n[motor]");
    for (rest, expected) in [
        (
            "hinge_b = \"yaw\"",
            "coupling[0].hinge_b: \"yaw\", allowed: pitch, roll",
        ),
        (
            "hinge_b = \"pitch\"",
            "coupling[0].hinge_b: \"pitch\", allowed: another hinge than hinge_a",
        ),
        (
            "hinge_b = \"roll\"\nratio = 0.0",
            "coupling[0].ratio: 0, allowed: at least 0.001 or at most -0.001",
        ),
    ] {
        refused_file("v.toml", "[motor]", &coupling(rest), expected);
    }
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "vehicle=rocker_bogie6",
        "physics.step_us=2000",
        "control.period_us=2000",
    ];
    let args = ["run", "flat"]
        .into_iter()
        .chain(sets.iter().flat_map(|s| ["--set", s]));
    let said = refused(folder.path(), &args.collect::<Vec<_>>());
    assert!(
        said.contains("physics.step_us: 2000, allowed: up to 1165 with the stiffness and damping of the coupling \"differential\""),
        "{said}"
    );
}

#[test]
fn gains_that_a_file_leaves_out_are_said_on_standard_error_and_never_among_results() {
    let folder = tempfile::tempdir().unwrap();
    let expected = "rocker_bogie6: no [gains]; derived for a control period of 1 ms: kp 0.412 N.m.s/rad, ki 1.03 N.m/rad, \
                    from 0.0412 kg.m2 at a wheel and a time constant of 100 ms\n";
    let sets = ["--set", "vehicle=rocker_bogie6", "--set", "duration_s=0.05"];
    for command in ["run", "compare"] {
        let args = [&[command, "flat", "--json", "--quiet"], &sets[..]].concat();
        let output = omnistep(folder.path(), &args);
        assert!(output.status.success());
        assert_eq!(String::from_utf8(output.stderr.clone()).unwrap(), expected);
        assert_eq!(rows(&output).len(), if command == "run" { 1 } else { 4 });
    }
    assert!(
        omnistep(folder.path(), &["new", "vehicle", "r", "--like", "rocker_bogie6"])
            .status
            .success()
    );
    let output = omnistep(folder.path(), &["check", "r.toml"]);
    assert_eq!(
        String::from_utf8(output.stderr.clone()).unwrap(),
        expected.replace("rocker_bogie6", "r")
    );
    assert!(
        stdout(&output).contains("r.toml: vehicle r: 5 bodies, 4 hinges, 1 coupling, 6 wheels, 16.000 kg\n")
    );
    assert!(
        stdout(&output)
            .ends_with("gains    kp 0.4121 N.m.s/rad, ki 1.0301 N.m/rad, kd 0 N.m.s2/rad, derived\n")
    );
    // A file that gives them is not spoken of.
    let output = omnistep(
        folder.path(),
        &["run", "flat", "--quiet", "--set", "duration_s=0.05"],
    );
    assert!(output.stderr.is_empty());
}

#[test]
fn schemas_are_printed_and_a_new_file_names_the_one_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let first = |name: &str| {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        text.lines().next().unwrap().to_owned()
    };
    assert!(omnistep(folder.path(), &["new", "vehicle", "a"]).status.success());
    assert!(
        first("a.toml")
            .starts_with("# For completion in an editor: omnistep schema vehicle > vehicle.schema.json")
    );
    for kind in ["vehicle", "scenario", "experiment"] {
        let text = stdout(&omnistep(folder.path(), &["schema", kind]));
        let schema: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
        assert_eq!(schema["properties"]["schema_version"]["maximum"], 1);
        fs::write(folder.path().join(format!("{kind}.schema.json")), text).unwrap();
    }
    assert!(omnistep(folder.path(), &["new", "vehicle", "b"]).status.success());
    assert_eq!(first("b.toml"), "#:schema ./vehicle.schema.json");
    assert!(
        omnistep(folder.path(), &["new", "scenario", "c"])
            .status
            .success()
    );
    assert_eq!(first("c.toml"), "#:schema ./scenario.schema.json");
    assert!(
        omnistep(folder.path(), &["check", "a.toml", "b.toml", "c.toml"])
            .status
            .success()
    );
}

#[test]
fn more_that_no_single_key_shows_is_named() {
    refused_file(
        "s.toml",
        "at_m = 0.7",
        "at_m = 0.3",
        "terrain.at_m: 0.3, allowed: more than 0.366",
    );
    refused_file(
        "s.toml",
        "solver_iterations = 8",
        "solver_iterations = 0",
        "solver_iterations: 0, allowed: 1 to 100",
    );
    refused_file(
        "s.toml",
        "v.toml",
        "chugo8",
        "s.toml: vehicle: \"chugo8\", allowed: chugo7",
    );
}

#[test]
fn figures_are_null_where_the_riser_was_never_reached() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &["run", "--json", "--set", "duration_s=0.5"]);
    let row: Value = serde_json::from_str(&stdout(&output)).unwrap();
    for key in FIGURES {
        assert!(row[key].is_null(), "{row}");
    }
    let table = stdout(&omnistep(folder.path(), &["run", "--set", "duration_s=0.5"]));
    assert!(!table.contains("NaN") && !table.contains("0.000"), "{table}");
}

#[test]
fn a_vehicle_that_falls_apart_leaves_its_log_a_verdict_and_an_error() {
    // A step of 100 ms and a vehicle that drops off an edge: no solver holds the joints.
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "run",
        "step_down",
        "--json",
        "--set",
        "physics.step_us=50000",
        "--set",
        "control.period_us=50000",
        "--set",
        "terrain.height_m=2",
        "--set",
        "duration_s=20",
    ];
    let output = omnistep(folder.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    let row: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(row["verdict"], "diverged");
    assert!(folder.path().join(row["mcap"].as_str().unwrap()).is_file());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.starts_with("error: the vehicle fell apart at t = ") && said.contains(" parted by "),
        "{said}"
    );
}

#[test]
fn a_run_ends_with_an_error_when_its_time_on_the_clock_is_up() {
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "run",
        "flat",
        "--set",
        "duration_s=3600",
        "--set",
        "wall_clock_s=0.2",
    ];
    let output = omnistep(folder.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("the run took longer than wall_clock_s, 0.2 s"),
        "{said}"
    );
}

#[test]
fn results_that_cannot_be_written_are_an_error() {
    if Path::new("/dev/full").exists() {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_omnistep"));
        let output = command.arg("list").stdout(full).output().unwrap();
        assert_ne!(output.status.code(), Some(0));
        assert!(
            String::from_utf8(output.stderr)
                .unwrap()
                .contains("standard output")
        );
    } else {
        eprintln!("skipped: this system has no /dev/full");
    }
}

#[test]
fn wheels_that_cannot_move_the_vehicle_three_ways_are_refused() {
    // Every wheel rolling along x: forward and yaw only.
    let folder = tempfile::tempdir().unwrap();
    let sets = (0..7)
        .map(|i| format!("vehicle.wheel.{i}.rolling_direction=[1,0]"))
        .collect::<Vec<_>>();
    let args = ["compare"]
        .into_iter()
        .chain(sets.iter().flat_map(|s| ["--set", s.as_str()]))
        .collect::<Vec<_>>();
    let said = refused(folder.path(), &args);
    assert!(
        said.contains(
            "built-in chugo7: wheel: layout = 2, allowed: rank 3: wheels that move the vehicle in 3 directions"
        ),
        "{said}"
    );
}

#[test]
fn references_to_bodies_that_are_not_there_are_refused() {
    refused_file(
        "v.toml",
        "child = \"front\"",
        "child = \"nose\"",
        "hinge[0].child: \"nose\", allowed: middle, front, rear",
    );
    refused_file(
        "v.toml",
        "body = \"rear\"",
        "body = \"tail\"",
        "wheel[0].body: \"tail\", allowed: middle, front, rear",
    );
    refused_file(
        "v.toml",
        "name = \"rear\"",
        "name = \"front\"",
        "body[2].name: \"front\" twice",
    );
}

#[test]
fn unknown_names_are_refused_with_the_names_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let said = refused(folder.path(), &["compare", "stairway"]);
    assert!(
        said.contains("unknown scenario \"stairway\", allowed: step, flat, step_down, stairs, ramp, half_step, ditch, bumps, rough, height_map, ice, or the path"),
        "{said}"
    );
    let said = refused(folder.path(), &["run", "step", "--policy", "papier"]);
    assert!(
        said.contains("unknown policy \"papier\", allowed: independent, paper, synchronised, load_sharing"),
        "{said}"
    );
    let said = refused(folder.path(), &["run", "--set", "control.policy=papier"]);
    assert!(
        said.contains("control.policy: \"papier\", allowed: independent, paper, synchronised, load_sharing"),
        "{said}"
    );
    let said = refused(folder.path(), &["compare", "missing.toml"]);
    assert!(said.contains("missing.toml"), "{said}");
    let said = refused(folder.path(), &["compare", "--set", "terrain.friction"]);
    assert!(
        said.contains("terrain.friction") && said.contains("KEY=VALUE"),
        "{said}"
    );
    let said = refused(
        folder.path(),
        &["compare", "--set", "vehicle.wheel[9].radius_m=0.1"],
    );
    assert!(said.contains("element \"9\", allowed: 0 to 6"), "{said}");
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        0,
        "nothing is written"
    );
}

#[test]
fn an_output_folder_that_cannot_be_written_is_named_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("taken"), "a file, not a folder").unwrap();
    assert!(refused(folder.path(), &["compare", "--out", "taken"]).contains("taken"));
    assert!(refused(folder.path(), &["compare", "--out", "taken/inside"]).contains("taken/inside"));
    // A folder stands where the log would be, or where it would grow.
    fs::create_dir_all(folder.path().join("runs/step-independent.mcap")).unwrap();
    assert!(refused(folder.path(), &["compare", "--out", "runs"]).contains("step-independent.mcap"));
    assert_eq!(
        fs::read_dir(folder.path().join("runs")).unwrap().count(),
        1,
        "nothing half-written"
    );
    fs::create_dir_all(folder.path().join("logs/step-independent.mcap.part")).unwrap();
    assert!(refused(folder.path(), &["compare", "--out", "logs"]).contains("step-independent.mcap"));
}
