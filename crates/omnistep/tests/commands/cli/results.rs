//! What runs print and write.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{omnistep, refused, rows, stdout};

/// Keys that are null where the riser was never reached, and no path is followed.
const METRICS: [&str; 24] = [
    "crossing_s",
    "pitch_peak_deg",
    "nose_down_peak_deg",
    "slip_rms",
    "speed_error_rms",
    "speed_error_realised_rms",
    "speed_ratio_std",
    "slip_speed_std",
    "torque_squared_n2m2s",
    "stalled_at_m",
    "stalled_row",
    "yaw_error_deg",
    "shape_error_rms_rad_s",
    "work_j",
    "cost_of_transport",
    "e_over_mgh",
    "required_friction",
    "path_error_rms_m",
    "path_error_peak_m",
    "arrived_s",
    "odometry_error_m",
    "final_x_m",
    "final_y_m",
    "final_yaw_rad",
];

#[test]
fn engines_are_compared_side_by_side_and_named_in_each_log() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "compare",
        "step",
        "--engines",
        "--quiet",
        "--set",
        "duration_s=0.1",
    ];
    let output = omnistep(folder.path(), &arguments);
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    for engine in ["rapier", "articulated"] {
        assert_eq!(text.matches(&format!(" {engine} |")).count(), 6, "{text}");
    }
    // Both engines of a policy stand side by side, in tables that are no wider than the others.
    for line in text.lines().filter(|line| line.starts_with("| policy ")) {
        let names: Vec<_> = line
            .split('|')
            .skip(2)
            .map(str::trim)
            .filter(|name| !name.is_empty())
            .collect();
        assert!(
            names.chunks(2).all(|pair| pair[0] == pair[1]) && line.chars().count() <= 100,
            "{line}"
        );
    }
    let logs = [
        "out/step-scale_torques.mcap",
        "out/step-scale_torques-articulated.mcap",
    ];
    let output = omnistep(folder.path(), &["info", logs[0], logs[1]]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("seed 0, engine rapier,") && text.contains("seed 0, engine articulated,"),
        "{text}"
    );
    // The log of a scenario's own engine keeps its name, also where the engine is asked for.
    let own = [
        "run",
        "step",
        "--quiet",
        "--set",
        "physics.engine=rapier",
        "--set",
        "duration_s=0.1",
    ];
    let output = omnistep(folder.path(), &own);
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .ends_with("out/step-traction.mcap\n")
    );
}

#[test]
fn compare_json_prints_only_one_object_per_policy() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &["compare", "step", "--json"]);
    assert!(output.status.success());
    let rows = rows(&output);
    let policies: Vec<_> = rows.iter().map(|row| row["policy"].as_str().unwrap()).collect();
    assert_eq!(
        policies,
        [
            "independent",
            "scale_torques",
            "scale_references",
            "shared_integral",
            "traction_runup",
            "traction"
        ]
    );
    let others = [
        "policy",
        "verdict",
        "climbed",
        "engine",
        "wheel_model_valid",
        "retries", // null of loops, a number of traction control
        "stall_s",
        "stall_from_s",
        "limited_by",
        "limited_wheels",
        "touched_body",
        "touched_s",
        "touched_x_m",
        "touched_y_m",
        "touched_depth_m",
        "energy_residual",
        "steps_per_s",
        "realtime_factor",
        "mcap",
    ];
    let keys = [&METRICS[..], &others].concat();
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
        6,
        "no half-written files"
    );
}

#[test]
fn without_arguments_it_prints_its_help_and_runs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &[]);
    assert!(output.status.success());
    let help = stdout(&output);
    assert!(
        help.contains("omnistep compare step ") && help.contains("Commands:"),
        "{help}"
    );
    // Each command has its line: help must not be longer than what a terminal shows.
    assert!(help.lines().all(|line| line.chars().count() <= 90), "{help}");
    assert!(help.lines().count() <= 45, "{help}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn the_first_command_prints_tables_of_eighty_columns() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &["compare", "step"]);
    assert!(output.status.success());
    let table = stdout(&output);
    let mut of_tables = table.lines().filter(|line| line.starts_with('|'));
    assert!(of_tables.all(|line| line.chars().count() <= 80), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
    for word in [
        "chugo7",
        "5.0 cm",
        "independent",
        "scale_torques",
        "scale_references",
        "shared_integral",
        "| real-time factor ",
    ] {
        assert!(table.contains(word), "{word} is missing:\n{table}");
    }
    assert!(folder.path().join("out/step-scale_references.mcap").is_file());
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
        fs::read(folder.path().join("out/step-traction-seed7.mcap")).unwrap()
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
fn without_a_climb_the_table_says_where_the_vehicle_ended() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["flat", "--quiet", "--set", "duration_s=1.5"];
    let text = stdout(&omnistep(folder.path(), &[&["run"], &arguments[..]].concat()));
    for heading in [
        "final x [m]",
        "final y [m]",
        "final heading [deg]",
        "odometry error [m]",
    ] {
        assert!(text.contains(&format!("\n| {heading} ")), "{heading}: {text}");
    }
    assert!(!text.contains("crossing"), "{text}");
    let row = &rows(&omnistep(
        folder.path(),
        &[&["run", "--json"], &arguments[..]].concat(),
    ))[0];
    let [x_m, y_m, yaw_rad, error_m] =
        ["final_x_m", "final_y_m", "final_yaw_rad", "odometry_error_m"].map(|key| row[key].as_f64().unwrap());
    // 0.3 m/s for 1.5 s, less the ramp and what the loops lag behind it.
    assert!(
        (0.3..0.45).contains(&x_m) && y_m.abs() < 0.01 && yaw_rad.abs() < 0.01,
        "{row}"
    );
    assert!(
        text.contains(&format!(" {x_m:.3} |")) && text.contains(&format!(" {error_m:.4} |")),
        "{text}"
    );
}

#[test]
fn explain_says_what_each_metric_of_the_table_means() {
    let folder = tempfile::tempdir().unwrap();
    let run = ["run", "flat", "--quiet", "--set", "duration_s=0.3"];
    let plain = stdout(&omnistep(folder.path(), &run));
    let explained = stdout(&omnistep(folder.path(), &[&run[..], &["--explain"]].concat()));
    let same = |text: &str| text.split("| real-time factor").next().unwrap().to_owned();
    assert_eq!(same(&plain), same(&explained));
    let rows = plain.lines().filter(|line| line.starts_with("| ")).skip(1);
    let titles: Vec<_> = rows
        .map(|line| line.split('|').nth(1).unwrap().trim().to_owned())
        .collect();
    assert!(titles.len() > 8, "{titles:?}");
    for title in titles {
        let sentences = explained
            .lines()
            .filter(|line| line.starts_with(&format!("- {title} (`")));
        assert_eq!(
            sentences.filter(|line| line.ends_with('.')).count(),
            1,
            "{title}: {explained}"
        );
    }
    let inspected = stdout(&omnistep(
        folder.path(),
        &["info", "out/flat-traction.mcap", "--explain"],
    ));
    assert!(inspected.contains("\n- slip rms (`slip_rms`): "), "{inspected}");
    assert!(
        !omnistep(folder.path(), &[&run[..], &["--explain", "--json"]].concat())
            .status
            .success()
    );
}

#[test]
fn wheels_json_has_the_times_of_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &["motor-bench", "--json"]);
    let rows = rows(&output);
    assert_eq!(
        rows.iter()
            .map(|r| r["policy"].as_str().unwrap())
            .collect::<Vec<_>>(),
        ["independent", "scale_torques", "scale_references"]
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
fn computed_gains_are_said_on_standard_error_only() {
    let folder = tempfile::tempdir().unwrap();
    let expected = "rocker_bogie6: no [gains]; derived for a control period of 1 ms: kp 0.412 N.m.s/rad, ki 1.03 N.m/rad, \
                    from 0.0412 kg.m2 at a wheel and a time constant of 100 ms\n";
    let sets = ["--set", "vehicle=rocker_bogie6", "--set", "duration_s=0.05"];
    // Its motors reach 20 rad/s, of which `traction_runup`, one of the policies compared, would use more.
    let slow = "warning: flat: traction_runup with motors of 20.0 rad/s without load: before a retry wheels are spun up by 0.41 m/s instead of 2.64, so that its retries are weaker\n";
    for (command, more) in [("run", ""), ("compare", slow)] {
        let args = [&[command, "flat", "--json", "--quiet"], &sets[..]].concat();
        let output = omnistep(folder.path(), &args);
        assert!(output.status.success());
        let said = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(said, format!("{expected}{more}"));
        assert_eq!(rows(&output).len(), if command == "run" { 1 } else { 6 });
    }
    assert!(
        omnistep(
            folder.path(),
            &["new", "vehicle", "r", "--template", "rocker_bogie6"]
        )
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
            .contains("  gains    kp 0.4121 N.m.s/rad, ki 1.0301 N.m/rad, kd 0 N.m.s2/rad, derived\n")
    );
    // A file that gives them is not spoken of.
    let output = omnistep(
        folder.path(),
        &["run", "flat", "--quiet", "--set", "duration_s=0.05"],
    );
    assert!(output.stderr.is_empty());
}

#[test]
fn metrics_are_null_where_the_riser_was_never_reached() {
    let folder = tempfile::tempdir().unwrap();
    let output = omnistep(folder.path(), &["run", "--json", "--set", "duration_s=0.5"]);
    let row: Value = serde_json::from_str(&stdout(&output)).unwrap();
    for key in METRICS {
        assert!(row[key].is_null(), "{row}");
    }
    let table = stdout(&omnistep(folder.path(), &["run", "--set", "duration_s=0.5"]));
    assert!(!table.contains("NaN") && !table.contains("0.000"), "{table}");
}

#[test]
fn a_vehicle_that_falls_apart_leaves_log_verdict_and_error() {
    // A step of 50 ms and a vehicle that drops off an edge: eight iterations do not hold the joints.
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "run",
        "step_down",
        "--json",
        "--set",
        "physics.engine=rapier",
        "--set",
        "physics.timestep_s=0.05",
        "--set",
        "control.period_s=0.05",
        "--set",
        "physics.solver_iterations=8", // left out, there would be 100 of them
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
        said.starts_with("error: a joint separated at t = ") && said.contains(" mm"),
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
        "time_limit_s=0.2",
    ];
    let output = omnistep(folder.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("the run took longer than time_limit_s, 0.2 s"),
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
fn an_unwritable_folder_is_named_before_anything_runs() {
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

#[test]
fn run_and_info_say_what_the_drive_found_and_when() {
    let folder = tempfile::tempdir().unwrap();
    let keys = [
        "drive.command_timeout_s=0.1",
        "drive.faults={}",
        "fault=[{kind='encoder_silent',wheel='2',from_s=0.2,until_s=0.3},{kind='command_lost',from_s=0.5,until_s=0.7},\
         {kind='emergency_stop',from_s=0.8}]",
        "duration_s=1",
    ];
    let mut arguments = vec!["run", "flat", "--quiet"];
    for key in &keys {
        arguments.extend(["--set", key]);
    }
    let output = omnistep(folder.path(), &arguments);
    let said = String::from_utf8(output.stdout).unwrap();
    let notes: Vec<_> = said
        .lines()
        .skip_while(|line| *line != "events of the drive:")
        .skip(1)
        .filter_map(|line| line.strip_prefix("  "))
        .collect();
    // 20 periods without a reading; 200 good ones until it is used again; 100 ms without a command.
    let expected = [
        ("wheel 2 does not report", 0.2, 0.23),
        ("wheel 2 is used again", 0.3, 0.55),
        ("the command timed out", 0.59, 0.62),
        ("emergency stop", 0.8, 0.802),
    ];
    assert_eq!(notes.len(), expected.len(), "{said}");
    for (note, (words, from_s, until_s)) in notes.iter().zip(expected) {
        let (time, shown) = note.split_once(" s: ").unwrap();
        assert_eq!(shown, words);
        assert!((from_s..until_s).contains(&time.parse().unwrap()), "{note}");
    }
    // The table says what stopped it for good: not the time-out, after which commands came again.
    let stopped = |said: &str| -> Vec<String> {
        let rows = said.lines().filter(|line| line.starts_with("| stopped by"));
        rows.map(String::from).collect()
    };
    assert_eq!(stopped(&said).len(), 1, "{said}");
    assert!(
        stopped(&said)[0].ends_with(" emergency stop at 0.80 s |"),
        "{said}"
    );
    // Its log says the same, in the same words.
    let found = |said: &str| -> Vec<String> {
        let lines = said.lines().skip_while(|line| *line != "events of the drive:");
        let (heading, notes) = (lines.clone().take(1), lines.skip(1));
        let notes = notes.take_while(|line| line.starts_with("  "));
        heading.chain(notes).map(String::from).collect()
    };
    let inspected = omnistep(folder.path(), &["info", said.lines().last().unwrap()]);
    let inspected = String::from_utf8(inspected.stdout).unwrap();
    assert_eq!(found(&inspected), found(&said));
    assert!(
        stopped(&inspected)[0].ends_with(" emergency stop at 0.80 s |"),
        "{inspected}"
    );
    assert_eq!(found(&inspected).len(), 1 + expected.len(), "{inspected}");
    // Without a drive there is nothing to say.
    let output = omnistep(
        folder.path(),
        &["run", "flat", "--quiet", "--set", "duration_s=0.1"],
    );
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!said.contains("events of the drive") && stopped(&said).is_empty());
}
