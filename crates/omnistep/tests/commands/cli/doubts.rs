//! What `omnistep check` warns of.

use std::fs;
use std::path::Path;

use super::{omnistep, refused, stdout};

/// Writes a built-in vehicle with some of its text replaced.
fn edited(folder: &Path, like: &str, changes: &[(&str, &str)]) {
    let file = folder.join("own.toml");
    if file.exists() {
        fs::remove_file(&file).unwrap();
    }
    let made = omnistep(folder, &["new", "vehicle", "own", "--template", like]);
    assert!(made.status.success());
    let mut text = fs::read_to_string(&file).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    fs::write(file, text).unwrap();
}

/// The warnings of a check, and its exit code.
fn checked(folder: &Path, args: &[&str]) -> (Vec<String>, Option<i32>) {
    let said = omnistep(folder, &[&["check", "own.toml"], args].concat());
    let warnings = String::from_utf8(said.stderr).unwrap();
    let warnings = warnings
        .lines()
        .filter_map(|line| line.strip_prefix("warning: own: "));
    (warnings.map(str::to_owned).collect(), said.status.code())
}

#[test]
fn doubts_of_a_vehicle_are_lines_and_errors_with_strict() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    edited(path, "mecanum4", &[]);
    assert_eq!(
        checked(path, &["--strict"]),
        (vec![], Some(0)),
        "nothing is doubtful of it"
    );

    // Every roller the other way round: |0.25 - 0.20| / sqrt 2 = 35 mm instead of 0.45 / sqrt 2 = 318 mm.
    edited(
        path,
        "mecanum4",
        &[
            ("roller_angle_rad = -0.7853981634", "roller_angle_rad = turned"),
            (
                "roller_angle_rad = 0.7853981634",
                "roller_angle_rad = -0.7853981634",
            ),
            ("roller_angle_rad = turned", "roller_angle_rad = 0.7853981634"),
        ],
    );
    let (warnings, code) = checked(path, &[]);
    assert_eq!((warnings.len(), code), (1, Some(0)), "{warnings:?}");
    let expected = "roller_angle_rad: the wheels' forces have a lever arm of 0.035 m about the centre of the wheels, 0.318 m with the other sign";
    assert!(warnings[0].starts_with(expected), "{}", warnings[0]);
    assert_eq!(checked(path, &["--strict"]).1, Some(1));

    // Of 1 kg at 76 mm: m r^2 = 0.0058. Only such wheels are named.
    edited(
        path,
        "mecanum4",
        &[("inertia_kg_m2 = 0.0035 ", "inertia_kg_m2 = 0.0060 ")],
    );
    let (warnings, _) = checked(path, &[]);
    assert_eq!(warnings.len(), 4, "every wheel: {warnings:?}");
    assert!(
        warnings
            .iter()
            .all(|line| line.contains("all its mass at the rim gives 0.00578 (m r^2)")),
        "{warnings:?}"
    );

    // With a geared rotor that the file states, none is, whether the vehicle is checked or a scenario that names it.
    edited(
        path,
        "mecanum4",
        &[
            ("inertia_kg_m2 = 0.0035 ", "# "),
            (
                "[motor]",
                "[motor]\nrotor_inertia_kg_m2 = 1e-5\ngear_ratio = 30.0",
            ),
        ],
    );
    assert_eq!(checked(path, &["--strict"]).1, Some(0));
    let made = omnistep(
        path,
        &[
            "new",
            "scenario",
            "mine",
            "--template",
            "flat",
            "--vehicle",
            "own.toml",
        ],
    );
    assert!(made.status.success());
    let said = omnistep(path, &["check", "--strict", "mine.toml"]);
    assert!(said.status.success(), "{said:?}");

    // 2800 kg with motors of a toy, and no gains: the derived ones follow in seconds.
    let start = "[gains]";
    let text = {
        edited(path, "mecanum4", &[("mass_kg = 20.0 ", "mass_kg = 2800.0 ")]);
        fs::read_to_string(path.join("own.toml")).unwrap()
    };
    let (before, after) = text.split_once(start).unwrap();
    let (_, after) = after.split_once("[limits]").unwrap();
    fs::write(path.join("own.toml"), format!("{before}[limits]{after}")).unwrap();
    let (warnings, _) = checked(path, &[]);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0].starts_with("gains: the derived time constant is "),
        "{}",
        warnings[0]
    );

    edited(path, "omni3", &[]);
    let (warnings, code) = checked(path, &["--strict"]);
    assert_eq!(
        (warnings.len(), code),
        (0, Some(0)),
        "that three wheels need every encoder is no fault of the file: {warnings:?}"
    );
}

#[test]
fn motors_that_are_too_weak_for_a_step_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // At 1.6 cm the front row needs 1.39 N.m, the rear row 1.69 (tests/physics/touch.rs), and the motor has 3.0.
    edited(path, "mecanum4", &[]);
    let said = omnistep(path, &["check", "own.toml", "--step", "0.016", "--strict"]);
    assert_eq!(said.status.code(), Some(0));
    assert!(
        stdout(&said).contains("front_left front_right 1.39, rear_left rear_right 1.69"),
        "{}",
        stdout(&said)
    );
    edited(
        path,
        "mecanum4",
        &[("stall_torque_n_m = 3.0", "stall_torque_n_m = 1.5")],
    );
    let (warnings, code) = checked(path, &["--step", "0.016", "--strict"]);
    assert_eq!(code, Some(1));
    let expected = "step of 0.016 m, friction 0.7: wheel rear_left rear_right needs 1.69 N.m per actuator to leave the ground, but the motor has 1.5";
    assert_eq!(warnings, [expected]);
    // Of the paper's vehicle the bound says it: 0.2 N.m lift nothing.
    edited(
        path,
        "chugo7",
        &[("stall_torque_n_m = 2.0", "stall_torque_n_m = 0.2")],
    );
    let (warnings, _) = checked(path, &["--step", "0.05"]);
    // Gains for ten times the torque are none for these motors, and no others are fast.
    let [kp, ki, motor, step] = &warnings[..] else {
        panic!("{warnings:?}")
    };
    assert!(kp.starts_with("gains: kp_n_m_s_rad = 0.3 is 11.4 times"), "{kp}");
    assert!(ki.starts_with("gains: ki_n_m_rad = 2 is "), "{ki}");
    let weak = "motor.stall_torque_n_m = 0.2: no gains move 20.000 kg with a time constant below 1.";
    assert!(motor.starts_with(weak), "{motor}");
    assert!(
        step.contains("impossible at 0.3 m/s with the motor's 0.2 N.m"),
        "{step}"
    );
    let allowed = |step: &str, file: &str| refused(path, &["check", file, "--step", step]);
    let wall = "allowed: less than the radius of every wheel: wheels cannot climb an edge above their axle\n";
    assert_eq!(allowed("0.2", "mecanum4"), format!("error: --step = 0.2, {wall}"));
    assert_eq!(
        allowed("0.066", "chugo7"),
        format!("error: --step = 0.066, {wall}")
    );
    assert_eq!(
        allowed("0", "chugo7"),
        "error: --step = 0, allowed: 1e-6 to 10 [m]\n"
    );
    for file in ["climb_map", "motor_bench"] {
        let expected = "error: --step = 0.05, allowed: with a vehicle or a scenario\n";
        assert_eq!(allowed("0.05", file), expected);
    }
}

#[test]
fn a_step_above_the_clearance_of_the_front_body_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    edited(
        path,
        "mecanum4",
        &[("clearance_m = 0.05 ", "clearance_m = 0.005 ")],
    );
    let (warnings, code) = checked(path, &["--step", "0.016", "--strict"]);
    let expected = "the step of 0.016 m is higher than the clearance of 0.005 m under `platform`";
    assert_eq!((&warnings[..], code), (&[expected.to_owned()][..], Some(1)));
    assert!(checked(path, &["--step", "0.004", "--strict"]).0.is_empty());
    // A box that reaches into the ground is no shape: no clearance is known, and nothing is warned of.
    let deep = (
        "inertia_box_m = [0.60, 0.40, 0.20] ",
        "inertia_box_m = [0.60, 0.40, 0.24] ",
    );
    edited(path, "mecanum4", &[deep, ("clearance_m = 0.05 ", "# ")]);
    assert!(checked(path, &["--step", "0.016", "--strict"]).0.is_empty());
    let said = stdout(&omnistep(path, &["check", "own.toml"]));
    assert!(said.contains("clearance [m]: unknown under platform"), "{said}");
}

#[test]
fn units_that_were_mixed_up_are_doubtful() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // mecanum4's motors reach 3.0 / 0.1 = 30 rad/s: 2.28 m/s on wheels of 76 mm, which are 0.64 m
    // apart from corner to corner.
    let slope = "slope_n_m_s_rad = 0.10 ";
    for (old, new, expected) in [
        (
            "vx_m_s = 1.0 ",
            "vx_m_s = 6.0 ",
            "limits.vx_m_s = 6, but the motors reach only 2.28 without load",
        ),
        (
            slope,
            "no_load_rad_s = 286.0 ",
            "motor: 286 rad/s without load, 21.7 m/s at the rim of wheel front_left; use no_load_rpm if the value is in rpm",
        ),
        (
            "com_m = [0.0, 0.0, 0.12] ",
            "com_m = [0.0, 0.0, 12.0] ",
            "com_m: the centre of mass is 10 m up, the wheels are 0.64 m apart; write com_m in metres",
        ),
    ] {
        edited(path, "mecanum4", &[(old, new)]);
        let (warnings, code) = checked(path, &[]);
        assert!(warnings.iter().any(|warning| warning == expected), "{warnings:?}");
        assert_eq!(code, Some(0));
    }
}

#[test]
fn short_runs_and_impossible_commands_are_doubtful() {
    let folder = tempfile::tempdir().unwrap();
    let warned = |args: &[&str]| {
        let said = omnistep(folder.path(), args);
        assert!(said.status.success());
        String::from_utf8(said.stderr).unwrap()
    };
    let short = warned(&["run", "square", "--set", "duration_s=2"]);
    assert!(
        short.contains("warning: square: duration_s = 2 is too short: the path takes "),
        "{short}"
    );
    let table = "time_s,vx_m_s,vy_m_s,wz_rad_s\n0,0.3,0,90\n2000,0,0,0\n2001,0,0,0\n";
    fs::write(folder.path().join("cmd.csv"), table).unwrap();
    let table = warned(&[
        "run",
        "flat",
        "--set",
        "command={ file = \"cmd.csv\" }",
        "--set",
        "duration_s=0.1",
    ]);
    let [turn, late] = [
        "warning: flat: command: up to 90 rad/s in yaw, but the vehicle's [limits] allow only 2",
        "warning: flat: command.file: 2 rows come after the run's end at 0.1 s, the last at 2001 s",
    ];
    assert!(table.contains(turn) && table.contains(late), "{table}");
}

#[test]
fn implausible_wheels_motors_and_commands_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let doubts = |changes: &[(&str, &str)]| {
        edited(path, "mecanum4", changes);
        checked(path, &[]).0
    };
    assert!(doubts(&[]).is_empty());
    // 40 N.m * sqrt(2) / 0.076 m at each of four wheels are 2977 N, 24 kg weigh 235 N.
    let strong = doubts(&[("stall_torque_n_m = 3.0", "stall_torque_n_m = 40.0")]);
    let said =
        "motor.stall_torque_n_m = 40: the wheels push with 12.6 times the weight; 40 kg.cm are 3.92 N.m";
    assert!(strong.iter().any(|line| line == said), "{strong:?}");
    // 36 kg in a cylinder of 152 mm, as wide as it is high: 2.76 litres.
    let dense = doubts(&[
        ("mass_kg = 1.0", "mass_kg = 36.0"),
        ("inertia_kg_m2 = 0.0035", "inertia_kg_m2 = 0.1"),
    ]);
    assert!(
        dense
            .iter()
            .any(|line| line.contains("13.1 kg a litre") && line.contains("steel has 7.9")),
        "{dense:?}"
    );
    // The rollers of a wheel of 76 mm on one of 47.5 mm.
    let gaps = doubts(&[
        ("radius_m = 0.076 ", "radius_m = 0.0475 "),
        ("inertia_kg_m2 = 0.0035", "inertia_kg_m2 = 0.0014"),
    ]);
    let (said, mend) = (
        "between its 9 rollers of radius_m = 0.015 are gaps, the axle falls by 3.2 %",
        "with radius_m = 0.009784 they leave none",
    );
    assert!(
        gaps.iter()
            .any(|line| line.contains(said) && line.ends_with(mend)),
        "{gaps:?}"
    );
    let closed = doubts(&[
        ("radius_m = 0.076 ", "radius_m = 0.0475 "),
        ("inertia_kg_m2 = 0.0035", "inertia_kg_m2 = 0.0014"),
        ("radius_m = 0.015 ", "radius_m = 0.009784 "),
    ]);
    assert!(closed.iter().all(|line| !line.contains("gaps")), "{closed:?}");
}
