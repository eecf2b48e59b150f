//! What is doubtful, and the line that warns of it.

use std::fs;

use super::{omnistep, one_of_each, rows, stderr, stdout, words};

#[test]
fn a_duration_that_cannot_suffice_is_a_warning_in_one_line() {
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
    let study = "schema_version = 1\nname = \"cut\"\nscenario = \"step\"\nseeds = 2\n[set]\nperturbation.yaw_rad = 0.01\nphysics.timestep_s = 0.001\ncontrol.policy = \"independent\"\n\
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
fn a_run_that_stops_when_done_has_the_metrics_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let whole = omnistep(
        folder.path(),
        &["run", "step", "--json", "--quiet", "--out", "whole"],
    );
    let done = omnistep(
        folder.path(),
        &words("run step --json --quiet --out done --stop-when-done"),
    );
    let (whole, done) = (rows(&whole).remove(0), rows(&done).remove(0));
    let metrics = whole.as_object().unwrap();
    let timed = ["energy_residual", "steps_per_s", "realtime_factor", "mcap"];
    for (name, value) in metrics.iter().filter(|(name, _)| !timed.contains(&name.as_str())) {
        assert_eq!(&done[name], value, "{name}");
    }
    assert_eq!(done["verdict"], "climbed");
    let logs = [&done, &whole].map(|row| row["mcap"].as_str().unwrap().to_owned());
    let inspected = rows(&omnistep(folder.path(), &["info", &logs[0], &logs[1], "--json"]));
    let until = |k: usize| inspected[k]["until_s"].as_f64().unwrap();
    // 1.2 s to the riser, 2.5 s over it.
    assert!(
        until(0) > 3.0 && until(0) < 4.5 && until(1) == 6.0,
        "{} s",
        until(0)
    );
    assert_eq!(inspected[0]["complete"], true);
    // It is replayed to its end, bit for bit.
    assert!(stdout(&omnistep(folder.path(), &["replay", &logs[0]])).contains("bit-identical"));
    // On flat ground there is nothing to be done with.
    let flat = omnistep(
        folder.path(),
        &words("run flat --json --quiet --stop-when-done --set duration_s=0.5"),
    );
    assert_eq!(rows(&flat)[0]["verdict"], "completed");
}

#[test]
fn encoders_too_coarse_are_said_once_a_study_and_by_check() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let study = "schema_version = 1\nname = \"coarse\"\nscenario = \"flat\"\nseeds = 2\n[set]\nduration_s = 0.05\ncontrol.policy = \"independent\"\n[[axis]]\nkey = \"sensors.encoder_counts\"\nvalues = [64, 4096, 32]\n";
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
    // A degree in a millisecond; 1 m/s ahead and 2 rad/s about are not asked at once: 2 rad/s on
    // 0.45 m less than 1 m/s, 13.2 rad/s of 76 mm.
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
fn physics_that_gain_energy_are_a_failed_run_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let coarse = [
        "--set",
        "physics.timestep_s=0.05",
        "--set",
        "control.period_s=0.05",
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
    assert!(said.contains("use a physics.timestep_s below 0.05"), "{said}");
}

#[test]
fn fault_thresholds_below_a_count_are_warned_of_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let lines = |args: &[&str]| {
        let output = omnistep(path, args);
        let said = stderr(&output);
        let lines = said.lines().filter(|line| line.contains("drive.faults"));
        (
            lines.map(str::to_owned).collect::<Vec<_>>(),
            output.status.success(),
        )
    };
    let text = omni_config::FileKind::Scenario.template("flat").unwrap();
    let file = |counts: u32, velocity: &str, faults: &str| {
        let more = format!("\n[sensors]\nencoder_counts = {counts}\n{velocity}\n[drive.faults]\n{faults}\n");
        fs::write(path.join("s.toml"), format!("{text}{more}")).unwrap();
    };
    // 2 pi / 1024 in a millisecond; two of them are 12.27.
    file(1024, "", "jump_rad_s = 1.0\nstuck_rad_s = 4.5");
    let (said, well) = lines(&["check", "s.toml", "--strict"]);
    let less = "use sensors.encoder_velocity, more sensors.encoder_counts or at least 12.3";
    let below = [
        ("jump_rad_s = 1", "single counts are called jumps"),
        (
            "stuck_rad_s = 4.5",
            "single counts of other wheels make a standing wheel faulty",
        ),
    ]
    .map(|(key, effect)| {
        format!("warning: flat: drive.faults.{key}, but one encoder count reads as 6.14 rad/s, so that {effect}; {less}")
    });
    assert_eq!((said, well), (below.to_vec(), false));
    let run = ["run", "s.toml", "--quiet", "--set", "duration_s=0.01"];
    assert_eq!(lines(&run).0, below);
    // Left out, it is two counts, which wheels of 66 mm at 0.3 m/s do not reach; then coarse
    // readings have to go, and else the threshold.
    file(2000, "", "");
    let late = |stuck: &str, after: &str, mend: &str| {
        format!(
            "warning: flat: drive.faults.stuck_rad_s = {stuck}, but no wheel turns faster than 4.55 rad/s under the command, so that the \
             other wheels show a dead encoder after {after} s or later; use {mend}"
        )
    };
    let finer = "sensors.encoder_velocity or more sensors.encoder_counts";
    assert_eq!(lines(&["check", "s.toml"]).0, [late("6.28", "1.38", finer)]);
    file(65536, "", "stuck_rad_s = 9.1");
    assert_eq!(
        lines(&["check", "s.toml"]).0,
        [late("9.1", "2", "less than 4.55")]
    );
    // Three of 64 counts are 0.295 rad: at 1 rad/s as many milliseconds.
    file(
        64,
        "encoder_velocity = { kind = \"edges\" }",
        "stuck_periods = 100",
    );
    let held = "warning: flat: drive.faults.stuck_periods = 100, but a wheel of 1 rad/s takes 295 periods for three encoder counts, so that a \
                wheel that begins to turn is faulty; leave it out or use more sensors.encoder_counts";
    assert_eq!(lines(&["check", "s.toml"]).0, [held]);
    // A window of eight periods reads an eighth of that, and stamped edges nothing.
    for (counts, velocity) in [
        (2000, "encoder_velocity = { kind = \"window\", periods = 8 }"),
        (100, "encoder_velocity = { kind = \"edges\" }"),
        (0, ""),
    ] {
        file(counts, velocity, "jump_rad_s = 1.0");
        assert_eq!(
            lines(&["check", "s.toml"]).0,
            Vec::<String>::new(),
            "{counts} {velocity}"
        );
    }
}

#[test]
fn check_names_the_hinges_about_which_nothing_holds_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let text = omni_config::FileKind::Vehicle.template("rocker_bogie6").unwrap();
    let [from, end] = ["\n[[coupling]]", "\n[motor]"].map(|table| text.find(table).unwrap());
    fs::write(
        path.join("loose.toml"),
        format!("{}{}", &text[..from], &text[end..]),
    )
    .unwrap();
    fs::write(path.join("whole.toml"), text).unwrap();
    let output = omnistep(path, &["check", "loose.toml", "--strict"]);
    let said = stderr(&output);
    let expected = "warning: rocker_bogie6: hinge rocker_left, rocker_right: nothing holds body body about it: at rest on flat ground it falls to \
                    the stop, limit_rad = 0.5; add a [[coupling]] or move com_m, position_m or anchor_m";
    assert!(said.lines().any(|line| line == expected), "{said}");
    assert!(!output.status.success() && !stdout(&output).contains("loads"));
    assert!(
        omnistep(path, &["check", "whole.toml", "--strict"])
            .status
            .success()
    );
}
