//! What people get wrong, and what the command tells them to type; what is doubtful, and the line that warns of it.

use std::fs;
use std::path::Path;

use super::{omnistep, refused, rows, stdout};

fn stderr(output: &std::process::Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// A folder with a file of each kind: `v.toml`, `s.toml`, `y.toml`, `w.toml`, and a short log `l.mcap`.
fn one_of_each() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../omni-config/assets");
    for (from, to) in [
        ("vehicles/omni3.toml", "v.toml"),
        ("scenarios/flat.toml", "s.toml"),
        ("studies/climb_map.toml", "y.toml"),
        ("scenarios/wheels.toml", "w.toml"),
    ] {
        fs::copy(assets.join(from), folder.path().join(to)).unwrap();
    }
    folder
}

#[test]
fn a_file_of_another_kind_is_named_with_the_command_that_it_is_for() {
    let folder = one_of_each();
    for (args, expected) in [
        (
            ["run", "v.toml"],
            "v.toml: this is a vehicle file, not a scenario; use: omnistep run flat --set vehicle=v.toml",
        ),
        (
            ["compare", "v.toml"],
            "v.toml: this is a vehicle file, not a scenario; use: omnistep compare flat --set vehicle=v.toml",
        ),
        (
            ["constants", "v.toml"],
            "v.toml: this is a vehicle file, not a scenario; use: omnistep constants flat --set vehicle=v.toml",
        ),
        (
            ["study", "v.toml"],
            "v.toml: this is a vehicle file, not a study; use: omnistep run flat --set vehicle=v.toml",
        ),
        (
            ["wheels", "v.toml"],
            "v.toml: this is a vehicle file, not a wheels experiment; use: omnistep run flat --set vehicle=v.toml",
        ),
        (
            ["run", "y.toml"],
            "y.toml: this is a study file, not a scenario; use: omnistep study y.toml",
        ),
        (
            ["constants", "y.toml"],
            "y.toml: this is a study file, not a scenario; use: omnistep study y.toml",
        ),
        (
            ["urdf", "y.toml"],
            "y.toml: this is a study file, not a vehicle; use: omnistep study y.toml",
        ),
        (
            ["run", "w.toml"],
            "w.toml: this is a wheels experiment, not a scenario; use: omnistep wheels w.toml",
        ),
        (
            ["study", "s.toml"],
            "s.toml: this is a scenario file, not a study; use: omnistep run s.toml",
        ),
        (
            ["urdf", "s.toml"],
            "s.toml: this is a scenario file, not a vehicle; use: omnistep run s.toml",
        ),
        (
            ["ripple", "s.toml"],
            "s.toml: this is a scenario file, not a vehicle; use: omnistep run s.toml",
        ),
        (
            ["wheels", "s.toml"],
            "s.toml: this is a scenario file, not a wheels experiment; use: omnistep run s.toml",
        ),
        (
            ["run", "mecanum4"],
            "mecanum4: this is a vehicle, not a scenario; use: omnistep run flat --set vehicle=mecanum4",
        ),
        (
            ["run", "climb_map"],
            "climb_map: this is a study, not a scenario; use: omnistep study climb_map",
        ),
        (
            ["study", "step"],
            "step: this is a scenario, not a study; use: omnistep run step",
        ),
    ] {
        assert_eq!(
            refused(folder.path(), &args),
            format!("error: {expected}\n"),
            "{args:?}"
        );
    }
    // What it says to type works.
    let said = omnistep(folder.path(), &["constants", "flat", "--set", "vehicle=v.toml"]);
    assert!(said.status.success(), "{}", stderr(&said));
}

#[test]
fn check_and_inspect_go_on_after_a_bad_file_and_end_as_the_worst() {
    let folder = one_of_each();
    let path = folder.path();
    let bad = fs::read_to_string(path.join("v.toml"))
        .unwrap()
        .replace("mass_kg = 6.0", "mass_kg = -6.0");
    fs::write(path.join("bad.toml"), bad).unwrap();
    let output = omnistep(path, &["check", "missing.toml", "v.toml", "bad.toml", "s.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let (shown, said) = (stdout(&output), stderr(&output));
    assert!(
        shown.contains("v.toml: vehicle omni3") && shown.contains("s.toml: scenario flat"),
        "{shown}"
    );
    assert_eq!(
        said.lines().filter(|line| line.starts_with("error: ")).count(),
        2,
        "{said}"
    );
    assert!(
        said.contains("missing.toml") && said.contains("bad.toml: body[0].mass_kg: -6"),
        "{said}"
    );

    for seed in ["1", "2"] {
        let made = omnistep(
            path,
            &[
                "run",
                "s.toml",
                "--set",
                "duration_s=0.1",
                "--seed",
                seed,
                "--out",
                seed,
            ],
        );
        assert!(made.status.success(), "{}", stderr(&made));
    }
    let log = |folder: &str| {
        let found = fs::read_dir(path.join(folder)).unwrap().next().unwrap().unwrap();
        format!("{folder}/{}", found.file_name().to_string_lossy())
    };
    let (good, flipped) = (log("1"), log("2"));
    let mut bytes = fs::read(path.join(&flipped)).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(path.join(&flipped), bytes).unwrap();
    let output = omnistep(path, &["inspect", &flipped, &good]);
    // A damaged log is a failure, not a wrong request.
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stdout(&output).contains("all checksums are correct"),
        "{}",
        stdout(&output)
    );
    assert!(
        stdout(&output).contains("driven"),
        "the table of the good ones: {}",
        stdout(&output)
    );
    assert_eq!(stderr(&output).lines().count(), 1, "{}", stderr(&output));
    let output = omnistep(path, &["inspect", &flipped, "missing.mcap", &good, "--json"]);
    assert_eq!((output.status.code(), rows(&output).len()), (Some(2), 1));
    assert_eq!(stderr(&output).lines().count(), 2, "{}", stderr(&output));
}

#[test]
fn a_slip_in_a_key_or_a_name_is_answered_with_the_nearest_one() {
    let folder = one_of_each();
    let path = folder.path();
    for (args, expected) in [
        (
            ["run", "flat", "--set", "terain.friction=0.5"],
            "terain: unknown field `terain` (did you mean `terrain`?), expected one of",
        ),
        (
            ["run", "flat", "--set", "terrain.fricton=0.5"],
            "terrain.fricton: unknown field `fricton` (did you mean `friction`?)",
        ),
        (
            ["run", "flat", "--set", "vehicle.motor.stal_torque=1"],
            "motor.stal_torque: unknown field `stal_torque` (did you mean `stall_torque_n_m`?)",
        ),
        (
            ["run", "flat", "--set", "control.policy=synchronized"],
            "control.policy: \"synchronized\" (did you mean \"synchronised\"?), allowed: independent",
        ),
        // The key of another table, and a word of a longer key.
        (
            ["run", "flat", "--set", "friction=0.5"],
            "friction: unknown field `friction`; use `terrain.friction`\n",
        ),
        (
            ["run", "flat", "--set", "stall_torque_n_m=1"],
            "stall_torque_n_m: unknown field `stall_torque_n_m`; use `vehicle.motor.stall_torque_n_m`\n",
        ),
        (
            ["run", "flat", "--set", "vehicle.kp_n_m_s_rad=1"],
            "kp_n_m_s_rad: unknown field `kp_n_m_s_rad`; use `gains.kp_n_m_s_rad`\n",
        ),
        // No key of this kind of ground; in a list of the vehicle; nowhere else alone.
        (
            ["run", "flat", "--set", "terrain.height_m=0.1"],
            "terrain.height_m: unknown field `height_m`, expected `friction`",
        ),
        (
            ["run", "flat", "--set", "mass_kg=3"],
            "mass_kg: unknown field `mass_kg`, expected one of schema_version",
        ),
        (
            ["run", "flat", "--set", "control.policy=pid"],
            "control.policy: \"pid\" (did you mean \"independent\"?), allowed: independent",
        ),
        (
            ["run", "flat", "--set", "vehicle.wheel.radius_m=0.1"],
            "wheel.radius_m: element \"radius_m\", allowed: the number of one of the elements, 0 to 6",
        ),
        (
            ["run", "flat", "--set", "sensors.gyro=1"],
            "sensors.gyro: unknown field `gyro` (did you mean `gyro_bias_rad_s`?)",
        ),
        (
            ["run", "flat", "--set", "vehicle=chugo"],
            "vehicle: \"chugo\" (did you mean \"chugo7\"?), allowed: chugo7",
        ),
        (
            ["run", "flat", "--policy", "synchronized"],
            "unknown policy \"synchronized\" (did you mean \"synchronised\"?), allowed: independent",
        ),
        (
            ["run", "setp", "--out", "x"],
            "unknown scenario \"setp\" (did you mean \"step\"?), allowed: step, flat",
        ),
    ] {
        let said = refused(path, &args);
        assert!(said.contains(expected), "{said}\nhas no\n{expected}");
    }
    let study = fs::read_to_string(path.join("y.toml")).unwrap();
    fs::write(path.join("y.toml"), study.replace("[[axis]]", "[[axes]]")).unwrap();
    let said = refused(path, &["check", "y.toml"]);
    assert!(
        said.contains("y.toml: axes: unknown field `axes` (did you mean `axis`?)"),
        "{said}"
    );
}

#[test]
fn help_and_message_of_a_python_command_name_the_same_extra() {
    let folder = tempfile::tempdir().unwrap();
    let help = stdout(&omnistep(folder.path(), &["help"]));
    let commands: Vec<_> = help
        .lines()
        .filter(|line| line.ends_with("[Python]"))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert_eq!(commands.len(), 7, "{help}");
    let extra = |text: &str| {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let named = text
            .split_once("its extra \"")
            .and_then(|(_, rest)| rest.split_once('"'));
        named.map(|(extra, _)| extra.to_owned())
    };
    for command in commands {
        let of_help = extra(&stdout(&omnistep(folder.path(), &["help", command])));
        let said = refused(folder.path(), &[command]);
        assert!(
            of_help.is_some() && of_help == extra(&said),
            "{command}: {of_help:?}, {said}"
        );
        assert!(
            said.contains(&format!("\".[{}]\"", of_help.unwrap_or_default())),
            "{said}"
        );
    }
}

#[test]
fn a_file_that_is_missing_is_answered_with_the_name_that_was_meant() {
    let folder = one_of_each();
    let path = folder.path();
    fs::copy(path.join("v.toml"), path.join("mybot.toml")).unwrap();
    for (args, expected) in [
        (&["check", "setp"][..], "error: setp (did you mean \"step\"?): "),
        (
            &["check", "mecanum"],
            "error: mecanum (did you mean \"mecanum4\"?): ",
        ),
        (
            &["check", "climbmap"],
            "error: climbmap (did you mean \"climb_map\"?): ",
        ),
        (
            &["check", "mybot"],
            "error: mybot (did you mean \"mybot.toml\"?): ",
        ),
        (
            &["check", "mybto.toml"],
            "error: mybto.toml (did you mean \"mybot.toml\"?): ",
        ),
        (
            &["check", "moon"],
            "error: moon (omnistep list prints what is built in): ",
        ),
        (&["check", "moon.toml"], "error: moon.toml: "),
        (
            &["run", "mybto.toml"],
            "error: mybto.toml (did you mean \"mybot.toml\"?): ",
        ),
        (
            &["run", "flat.toml"],
            "error: flat.toml (did you mean \"flat\"?): ",
        ),
        (&["study", "x/../yy.toml"], "error: x/../yy.toml: "),
        (
            &["urdf", "mybto.toml"],
            "error: mybto.toml (did you mean \"mybot.toml\"?): ",
        ),
    ] {
        let said = refused(path, args);
        assert!(said.starts_with(expected), "{said}has no\n{expected}");
        // Of Windows: "The system cannot find the file specified."
        assert!(
            said.contains("No such file") || said.contains("cannot find"),
            "{said}"
        );
    }
}

#[test]
fn a_seed_out_of_range_is_one_line_with_the_range() {
    let folder = tempfile::tempdir().unwrap();
    let allowed = "allowed: a whole number, 0 to 9223372036854775807";
    for (args, value) in [
        (&["run", "flat", "--seed", "-1"][..], "-1"),
        (&["run", "flat", "--seed=-1"], "-1"),
        (&["compare", "flat", "--seed", "1.5"], "1.5"),
        (
            &["run", "flat", "--seed", "9223372036854775808"],
            "9223372036854775808",
        ),
        (&["run", "flat", "--seed", "one"], "one"),
    ] {
        assert_eq!(
            refused(folder.path(), args),
            format!("error: --seed = {value}, {allowed}\n")
        );
    }
    let said = refused(folder.path(), &["study", "ensemble", "--seeds", "-1"]);
    assert_eq!(
        said,
        "error: --seeds = -1, allowed: a whole number, 1 to 100000\n"
    );
}

#[test]
fn text_in_another_encoding_is_named_with_what_to_do() {
    let folder = one_of_each();
    let path = folder.path();
    let text = fs::read_to_string(path.join("s.toml")).unwrap();
    let utf_16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(path.join("utf16.toml"), [b"\xff\xfe".to_vec(), utf_16].concat()).unwrap();
    fs::write(
        path.join("latin.toml"),
        [b"# gr\xfcn\n", text.as_bytes()].concat(),
    )
    .unwrap();
    fs::write(path.join("log.toml"), b"\x89MCAP0\r\n").unwrap();
    for (file, expected) in [
        (
            "utf16.toml",
            "utf16.toml: this is text in UTF-16, allowed: UTF-8: save it as UTF-8",
        ),
        (
            "latin.toml",
            "latin.toml: line 1 has the byte 0xfc, in Latin-1 'ü': this is text in another encoding",
        ),
        (
            "log.toml",
            "log.toml: this is an MCAP log, not TOML; use: omnistep inspect log.toml",
        ),
    ] {
        for command in ["check", "run", "constants", "study"] {
            let said = refused(path, &[command, file]);
            assert!(said.contains(expected) && said.len() < 300, "{command}: {said}");
        }
    }
}

#[test]
fn a_duration_that_cannot_suffice_is_warned_of_in_one_line_and_is_no_error() {
    let folder = one_of_each();
    let path = folder.path();
    let step = "schema_version = 1\nname = \"short\"\nscenario = \"step\"\nseeds = 2\n[set]\nduration_s = 0.5\n[[axis]]\nkey = \"command.vx_m_s\"\nvalues = [0.3, 30.0]\n";
    fs::write(path.join("short.toml"), step).unwrap();
    let said = omnistep(
        path,
        &["run", "step", "--set", "duration_s=0.5", "--json", "--quiet"],
    );
    assert_eq!(said.status.code(), Some(0));
    // 1.0 m at 0.3 m/s after a ramp of 0.3 s: 0.15 s more than 1.0 / 0.3.
    assert_eq!(
        stderr(&said),
        "warning: step: duration_s = 0.5 is too short: the rear wheels start 1.00 m before the obstacle's far side, and the command needs \
         at least 3.48 s to move them there\n"
    );
    assert_eq!(rows(&said)[0]["verdict"], "unfinished");
    for (args, first) in [
        (&["check", "short.toml"][..], "the first"),
        (
            &["study", "short.toml", "--quiet"],
            "the first with command.vx_m_s = 0.3",
        ),
    ] {
        let one_line = format!(
            "warning: short: 2 of 4 runs cannot finish in time; {first}: duration_s = 0.5 is too short"
        );
        let said = omnistep(path, args);
        assert_eq!(said.status.code(), Some(0), "{}", stderr(&said));
        assert!(
            stderr(&said).starts_with(&one_line) && stderr(&said).lines().count() == 1,
            "{}",
            stderr(&said)
        );
    }
    for enough in ["duration_s=3.5", "duration_s=6.0"] {
        let said = omnistep(path, &["run", "step", "--set", enough, "--json", "--quiet"]);
        assert_eq!(stderr(&said), "", "{enough}");
    }
}

#[test]
fn a_map_counts_runs_that_were_cut_off_apart_from_stalls() {
    let folder = tempfile::tempdir().unwrap();
    // 2 s end on the way to the riser; a step of 20 cm is a stall after 6 s; the rest climbs.
    let study = "schema_version = 1\nname = \"cut\"\nscenario = \"step\"\nseeds = 2\n[set]\nperturbation.yaw_rad = 0.01\nphysics.step_us = 1000\ncontrol.policy = \"independent\"\n\
                 [[axis]]\nkey = \"duration_s\"\nvalues = [2.0, 6.0]\n[[axis]]\nkey = \"terrain.height_m\"\nvalues = [0.02, 0.2]\n";
    fs::write(folder.path().join("cut.toml"), study).unwrap();
    let output = omnistep(folder.path(), &["study", "cut.toml", "--quiet"]);
    let shown = stdout(&output);
    assert!(
        shown.contains("| 0.02                          | 0/2 (0-66 %), 2 unfinished | 2/2 (34-100 %) |"),
        "{shown}"
    );
    assert!(
        shown.contains("| 0.2                           | 0/2 (0-66 %), 2 unfinished |   0/2 (0-66 %) |"),
        "{shown}"
    );
    let cells = rows(&omnistep(
        folder.path(),
        &["study", "cut.toml", "--quiet", "--json"],
    ));
    let unfinished: Vec<_> = cells.iter().map(|cell| cell["unfinished"].as_u64()).collect();
    assert_eq!(unfinished, [Some(2), Some(2), Some(0), Some(0)]);
}

#[test]
fn a_run_that_stops_when_done_has_the_figures_of_the_whole_one_and_a_shorter_log() {
    let folder = tempfile::tempdir().unwrap();
    let whole = omnistep(
        folder.path(),
        &["run", "step", "--json", "--quiet", "--out", "whole"],
    );
    let done = omnistep(
        folder.path(),
        &[
            "run",
            "step",
            "--json",
            "--quiet",
            "--out",
            "done",
            "--stop-when-done",
        ],
    );
    let (whole, done) = (rows(&whole).remove(0), rows(&done).remove(0));
    let figures = whole.as_object().unwrap();
    let timed = ["energy_residual", "steps_per_s", "realtime_factor", "mcap"];
    for (name, value) in figures.iter().filter(|(name, _)| !timed.contains(&name.as_str())) {
        assert_eq!(&done[name], value, "{name}");
    }
    assert_eq!(done["verdict"], "climbed");
    let logs = [&done, &whole].map(|row| row["mcap"].as_str().unwrap().to_owned());
    let inspected = rows(&omnistep(
        folder.path(),
        &["inspect", &logs[0], &logs[1], "--json"],
    ));
    let until = |k: usize| inspected[k]["until_s"].as_f64().unwrap();
    // 1.2 s to the riser, 2.5 s over it.
    assert!(
        until(0) > 3.0 && until(0) < 4.5 && until(1) == 6.0,
        "{} s",
        until(0)
    );
    assert_eq!(inspected[0]["complete"], true);
    // It is replayed to its end, bit for bit.
    assert!(stdout(&omnistep(folder.path(), &["replay", &logs[0]])).contains("equal in every bit"));
    // On flat ground there is nothing to be done with.
    let flat = omnistep(
        folder.path(),
        &[
            "run",
            "flat",
            "--json",
            "--quiet",
            "--stop-when-done",
            "--set",
            "duration_s=0.5",
        ],
    );
    assert_eq!(rows(&flat)[0]["verdict"], "driven");
}

/// Every line on standard error, none of more than 300 characters.
fn short_lines(folder: &Path, args: &[&str]) -> String {
    let said = stderr(&omnistep(folder, args));
    for line in said.lines() {
        let length = line.chars().count();
        assert!(length <= 300, "{args:?}: {length} characters: {line}");
    }
    said
}

#[test]
fn no_line_has_more_than_300_characters_whatever_key_path_or_study_it_names() {
    let folder = one_of_each();
    let path = folder.path();
    let text = fs::read_to_string(path.join("s.toml")).unwrap();
    for length in 80..=210 {
        let key = "k".repeat(length);
        fs::write(path.join("key.toml"), format!("{key} = 1\n{text}")).unwrap();
        let said = short_lines(path, &["check", "key.toml"]);
        assert!(said.starts_with("error: key.toml: kkk"), "{said}");
        if length % 13 == 0 {
            short_lines(path, &["run", "flat", "--set", &format!("{key}=1")]);
            short_lines(path, &["run", "flat", "--set", &format!("terrain.{key}=1")]);
        }
    }
    // A file of another kind, whose path would be said twice.
    let deep = format!("{0}/{0}", "d".repeat(140));
    fs::create_dir_all(path.join(&deep)).unwrap();
    let file = format!("{deep}/y.toml");
    fs::copy(path.join("y.toml"), path.join(&file)).unwrap();
    let said = short_lines(path, &["run", &file]);
    assert!(
        said.ends_with(": this is a study file, not a scenario; use: omnistep study FILE\n"),
        "{said}"
    );
    // What is doubtful is said before the folder is refused, so that nothing is run.
    fs::write(path.join("taken"), "").unwrap();
    for study in omni_config::builtin_studies() {
        let args = ["study", study, "--set", "duration_s=0.5", "--out", "taken"];
        let said = short_lines(path, &args);
        assert!(
            said.contains("cannot finish in time; the first with ")
                && said.contains(" s to move them there\n"),
            "{said}"
        );
    }
}

#[test]
fn encoders_too_coarse_are_said_once_a_study_and_by_check() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let study = "schema_version = 1\nname = \"coarse\"\nscenario = \"flat\"\nseeds = 2\n[set]\nduration_s = 0.05\n[[axis]]\nkey = \"sensors.encoder_counts\"\nvalues = [64, 4096, 32]\n";
    fs::write(path.join("coarse.toml"), study).unwrap();
    for args in [
        &["check", "coarse.toml"][..],
        &["study", "coarse.toml", "--quiet"],
    ] {
        let output = omnistep(path, args);
        let said = stderr(&output);
        assert!(output.status.success(), "{said}");
        let lines: Vec<_> = said
            .lines()
            .filter(|line| line.contains("encoder_counts"))
            .collect();
        assert_eq!(lines.len(), 1, "{said}");
        assert!(
            lines[0].starts_with("warning: ")
                && lines[0].contains("4 of 6 runs: sensors.encoder_counts = 64: one count"),
            "{said}"
        );
    }
}

#[test]
fn check_says_what_one_count_a_period_is_of_the_top_speed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let text = omni_config::FileKind::Scenario.template("flat").unwrap();
    let check = |counts: &str, velocity: &str| {
        let sensors = format!("\n[sensors]\nencoder_counts = {counts}\n{velocity}\n");
        let text = text.replace("\"chugo7\"", "\"mecanum4\"");
        fs::write(path.join("s.toml"), format!("{text}{sensors}")).unwrap();
        let output = omnistep(path, &["check", "s.toml", "--strict"]);
        let said = String::from_utf8(output.stdout).unwrap();
        let mut lines = said.lines().filter(|line| line.starts_with("  encoder"));
        let warned = String::from_utf8(output.stderr).unwrap();
        let of_readings = warned.lines().filter(|line| line.contains("a reading is off"));
        (
            lines.next().expect("a line").to_owned(),
            of_readings.map(str::to_owned).collect::<Vec<_>>(),
            output.status.success(),
        )
    };
    // A degree in a millisecond; 1 m/s ahead and 2 rad/s about are not asked at once: 2 rad/s on 0.45 m less than 1 m/s, 13.2 rad/s of 76 mm.
    let one = "17.45 rad/s, 132.6 % of the top speed of 13.2 rad/s";
    let (line, warned, well) = check("360", "");
    assert_eq!(
        line,
        format!("  encoder  360 counts a turn: one count in a control period reads as {one}")
    );
    let said = "flat: sensors.encoder_counts = 360: a reading is off by up to 132.6 % of the top speed of 13.2 rad/s; \
                use more counts or sensors.encoder_velocity";
    assert!(warned.len() == 1 && warned[0].ends_with(said), "{warned:?}");
    assert!(!well);
    // 2 pi / 10000 in a millisecond: below a twentieth.
    let (line, warned, well) = check("10000", "");
    assert_eq!(
        line,
        "  encoder  10000 counts a turn: one count in a control period reads as 0.63 rad/s, 4.8 % of the top speed of 13.2 rad/s"
    );
    assert!(warned.is_empty() && well, "{warned:?}");
    // What an observer leaves: its bandwidth times a count, over e.
    let (line, warned, _) = check(
        "360",
        "encoder_velocity = { kind = \"observer\", bandwidth_rad_s = 50.0 }",
    );
    let left = "sensors.encoder_velocity reduces this to 0.32 rad/s, 2.4 %";
    assert_eq!(
        line,
        format!("  encoder  360 counts a turn: one count in a control period reads as {one}; {left}")
    );
    assert!(warned.is_empty(), "{warned:?}");
}

#[test]
fn physics_that_gain_energy_are_a_verdict_one_line_and_a_failed_run() {
    let folder = tempfile::tempdir().unwrap();
    let coarse = [
        "--set",
        "physics.step_us=50000",
        "--set",
        "control.period_us=50000",
    ];
    let output = omnistep(
        folder.path(),
        &[&["run", "step", "--json", "--quiet"][..], &coarse].concat(),
    );
    assert_eq!(
        rows(&output)[0]["verdict"],
        "gained_energy",
        "{}",
        stderr(&output)
    );
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(
        said.starts_with("error: the physics gained ") && said.lines().count() == 1,
        "{said}"
    );
    assert!(said.contains("use a physics.step_us below 50000"), "{said}");
}
