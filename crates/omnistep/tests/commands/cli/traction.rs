//! What is said of runs under traction control: their retries, what they do without, where they are refused.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Output;

use super::{omnistep, refused, rows, stderr, stdout};

/// A step of 10 cm, higher than the wheels' radius of 6.6 cm: no friction brings a row onto it.
const HOPELESS: [&str; 6] = [
    "--quiet",
    "--set",
    "physics.engine=articulated",
    "--set",
    "terrain.height_m=0.1",
    "--set",
];

/// What a command says of the hopeless step.
fn hopeless(folder: &Path, command: &[&str], more: &[&str]) -> Output {
    let output = omnistep(folder, &[command, &HOPELESS, more].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    output
}

#[test]
fn retries_are_a_row_where_some_run_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let shown = stdout(&hopeless(folder.path(), &["compare", "step"], &["duration_s=6"]));
    assert!(
        shown.contains("\npolicy traction: still retrying at the end (retry "),
        "{shown}"
    );
    // Each table has a row of policies and one of retries.
    let rows_of = |title: &str| {
        let lines = shown
            .lines()
            .filter(|line| line.starts_with(&format!("| {title} ")));
        let cells = lines.flat_map(|line| {
            line.split('|')
                .skip(2)
                .map(str::trim)
                .filter(|cell| !cell.is_empty())
        });
        cells.map(str::to_owned).collect::<Vec<_>>()
    };
    let retries_of: BTreeMap<_, _> = rows_of("policy").into_iter().zip(rows_of("retries")).collect();
    let cells = |policy: &str| retries_of[policy].clone();
    assert_eq!(cells("scale_torques"), "-");
    let retries: u64 = cells("traction").parse().unwrap();
    let inspected = stdout(&omnistep(
        folder.path(),
        &["info", "out/step-traction-articulated.mcap"],
    ));
    assert!(inspected.contains("\n| retries "), "{inspected}");
    let of_log = rows(&omnistep(
        folder.path(),
        &["info", "--json", "out/step-traction-articulated.mcap"],
    ));
    assert_eq!(of_log[0]["outcome"]["retries"].as_u64(), Some(retries));
    assert!(retries > 0);
    // Of runs that did not try again the row would say nothing; JSON has it all the same.
    let run = ["run", "flat", "--quiet", "--set", "duration_s=0.2", "--policy"];
    let flat = |policy: &'static str, more: &[&'static str]| {
        omnistep(folder.path(), &[&run[..], &[policy], more].concat())
    };
    assert!(!stdout(&flat("traction", &[])).contains("retries"));
    assert_eq!(rows(&flat("traction", &["--json"]))[0]["retries"], 0);
    assert!(rows(&flat("scale_torques", &["--json"]))[0]["retries"].is_null());
}

#[test]
fn a_run_that_ends_between_two_retries_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let run = ["run", "step", "--policy", "traction"];
    let trying = stdout(&hopeless(folder.path(), &run, &["duration_s=6"]));
    assert!(
        trying.contains("\nstill retrying at the end (retry ")
            && trying.contains("); use a longer duration_s\n"),
        "{trying}"
    );
    // One retry, which lasts some 2 s.
    let once = ["duration_s=12", "--set", "control.max_retries=1"];
    let shown = stdout(&hopeless(folder.path(), &run, &once));
    assert!(
        !shown.contains("still retrying")
            && shown.contains("\ngave up after retry 1, and rests without torque\n"),
        "{shown}"
    );
    // It stands for good: a longer run would not help.
    assert!(
        shown.contains(" stalled ") && !shown.contains(" unfinished "),
        "{shown}"
    );
    let never = ["duration_s=6", "--set", "control.max_retries=0"];
    let shown = stdout(&hopeless(folder.path(), &run, &never));
    assert!(
        shown.contains("\ngave up without a retry, and rests without torque\n"),
        "{shown}"
    );
}

#[test]
fn an_edge_beyond_the_chart_is_named_and_the_run_replays_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut args = vec!["run", "step", "--quiet", "--policy", "traction"];
    for key in [
        "terrain.height_m=0.07",
        "duration_s=16",
        "control.climbs_m=0.055",
        "odometry.kind=ground",
        "physics.engine=articulated",
        "physics.wheel_model=rollers",
    ] {
        args.extend(["--set", key]);
    }
    let shown = stdout(&omnistep(folder.path(), &args));
    assert!(
        shown.contains(": edge 70 mm, chart 55, and rests without torque\n"),
        "{shown}"
    );
    let log = "out/step-traction+climbs_m=0.055-articulated.mcap";
    let replayed = stdout(&omnistep(folder.path(), &["replay", log]));
    assert!(
        replayed.ends_with("16000 control periods, bit-identical\n"),
        "{replayed}"
    );
}

#[test]
fn sensors_that_traction_control_lacks_are_said_in_every_run() {
    let folder = tempfile::tempdir().unwrap();
    let lacks = [
        "--quiet",
        "--set",
        "duration_s=0.1",
        "--set",
        "sensors.no_hinge_encoders=true",
    ];
    let said = |command: &[&str], more: &[&str]| {
        let output = omnistep(folder.path(), &[command, &lacks, more].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output)
    };
    let what = "without hinge encoders: it cannot tell a climbing row from slipping wheels";
    for policy in ["traction", "traction_runup"] {
        let run = said(&["run", "flat", "--policy", policy], &[]);
        assert_eq!(run, format!("warning: flat: {policy} {what}\n"));
    }
    assert_eq!(said(&["run", "flat", "--policy", "scale_torques"], &[]), "");
    assert_eq!(
        said(&["compare", "flat"], &[]),
        format!("warning: flat: traction_runup {what}\nwarning: flat: traction {what}\n")
    );
    let study = "schema_version = 1\nname = \"some\"\nscenario = \"flat\"\nseeds = 3\n[set]\nsensors.no_hinge_encoders = true\n\
                 [[axis]]\nkey = \"control.policy\"\nvalues = [\"scale_torques\", \"traction_runup\", \"traction\"]\n";
    fs::write(folder.path().join("some.toml"), study).unwrap();
    let of_study = said(&["study", "some.toml"], &[]);
    assert_eq!(of_study, format!("warning: 6 of 9 runs: traction_runup {what}\n"));
    let checked = stderr(&omnistep(folder.path(), &["check", "some.toml"]));
    assert_eq!(
        checked,
        format!("warning: some: 6 of 9 runs: traction_runup {what}\n")
    );
}

#[test]
fn the_log_of_any_policy_holds_what_traction_control_reads() {
    let folder = tempfile::tempdir().unwrap();
    let run = [
        "run",
        "flat",
        "--policy",
        "scale_torques",
        "--quiet",
        "--set",
        "duration_s=0.1",
    ];
    assert!(omnistep(folder.path(), &run).status.success());
    let replay = ["replay", "out/flat-scale_torques.mcap", "--policy", "traction"];
    let replayed = omnistep(folder.path(), &replay);
    assert!(replayed.status.success(), "{replayed:?}");
    // The loops of a vehicle at rest and of one that begins to drive are not the same under both.
    let said = String::from_utf8(replayed.stdout).unwrap();
    assert!(
        said.contains("policy traction: ") && said.contains(" of 100 control periods differ"),
        "{said}"
    );
}

#[test]
fn a_policy_that_is_not_named_is_the_best_that_sensors_and_motors_allow() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let file = |name: &str, more: &str| {
        let text = format!(
            "schema_version = 1\nname = \"{name}\"\nvehicle = \"chugo7\"\nduration_s = 0.1\n\
             terrain = {{ kind = \"flat\", friction = 0.7 }}\ncommand = {{ vx_m_s = 0.3 }}\n{more}"
        );
        fs::write(path.join(format!("{name}.toml")), text).unwrap();
    };
    file("prompt", "sensors = { no_hinge_encoders = true }\n");
    file("late", "actuators = { torque_lag_s = 0.05 }\n");
    file(
        "named",
        "control = { policy = \"traction\" }\nactuators = { torque_lag_s = 0.05 }\n",
    );
    file(
        "tries",
        "control = { max_retries = 3 }\nactuators = { torque_lag_s = 0.05 }\n",
    );
    file("shared", "control = { integral = \"shared\" }\n");
    let why = "actuators.torque_lag_s: 0.05, allowed with traction control: 0 to 0.03: later, and slip cannot be controlled";
    for (name, expected) in [
        ("prompt", "traction if none is named: the best that sensors and motors allow\n  policy   traction without hinge encoders: ".to_owned()),
        ("late", format!("scale_references if none is named, because traction control is rejected: scenario late: {why}\n")),
        ("shared", "scale_references if none is named, because control.integral is given\n".to_owned()),
        ("chugo7", "traction if none is named: the best that sensors and motors allow\n".to_owned()),
    ] {
        let file = if name == "chugo7" { name.to_owned() } else { format!("{name}.toml") };
        let said = stdout(&omnistep(path, &["check", &file]));
        assert!(said.contains(&format!("\n  policy   {expected}")), "{said}");
    }
    // As with the key that a command shall be given, whatever the file is.
    for (given, key) in [
        ("prompt.toml", "actuators.torque_lag_s=0.05"),
        ("chugo7", "gains.kp_n_m_s_rad=1e6"),
    ] {
        let said = stdout(&omnistep(path, &["check", given, "--set", key]));
        assert!(
            said.contains("scale_references if none is named, because traction control is rejected: "),
            "{said}"
        );
    }
    assert_eq!(
        refused(path, &["check", "ensemble", "--set", "seed=1"]),
        "error: --set = seed, allowed: with a vehicle, a scenario or an experiment\n"
    );
    // A study whose axis crosses the limit compares policies, and says so.
    fs::write(
        path.join("lags.toml"),
        "schema_version = 1\nname = \"lags\"\nscenario = \"prompt.toml\"\nseeds = 2\n\
         [[axis]]\nkey = \"actuators.torque_lag_s\"\nvalues = [0.0, 0.02, 0.05]\n",
    )
    .unwrap();
    let study = omnistep(path, &["study", "lags.toml", "--quiet"]);
    let said = String::from_utf8(study.stderr).unwrap();
    assert!(
        said.contains(&format!(
            "2 of 6 runs: policy scale_references, because traction control is rejected: scenario prompt: {why}\n"
        )),
        "{said}"
    );
    // What is wrong is said of the key that was written, and only where traction control was asked for.
    for name in ["named", "tries"] {
        let said = refused(path, &["run", &format!("{name}.toml"), "--quiet"]);
        assert_eq!(said, format!("error: scenario {name}: {why}\n"));
    }
    assert_eq!(
        refused(path, &["check", "tries.toml"]),
        format!("error: scenario tries: {why}\n")
    );
    // A limit holds in what the controller computes in.
    for precision in ["f32", "f64"] {
        let at = [
            "actuators.torque_lag_s=0.0300000001",
            &format!("control.precision={precision}"),
        ];
        let args = [
            "run",
            "prompt.toml",
            "--quiet",
            "--json",
            "--set",
            at[0],
            "--set",
            at[1],
        ];
        assert!(omnistep(path, &args).status.success());
    }
    let quiet = |command: &[&str]| {
        let output = omnistep(path, command);
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(
            stderr(&output),
            "",
            "what it does without is said where it was asked for"
        );
        stdout(&output)
    };
    // The log says what ran, whatever would be chosen with other keys.
    assert!(quiet(&["run", "prompt.toml", "--quiet"]).ends_with("out/prompt-traction.mcap\n"));
    assert!(quiet(&["run", "late.toml", "--quiet"]).ends_with("out/late-scale_references.mcap\n"));
    assert!(
        quiet(&["replay", "out/prompt-traction.mcap"])
            .contains("policy traction: 100 control periods, bit-identical")
    );
    let other = [
        "replay",
        "out/prompt-traction.mcap",
        "--set",
        "actuators.torque_lag_s=0.05",
    ];
    assert_eq!(refused(path, &other), format!("error: scenario prompt: {why}\n"));
    // Firmware has traction control where it is named: nothing shows that it reads hinges and an inertial unit.
    let reads = "prompt: no policy is named, so this is scale_references, which needs encoders only; what is simulated: \
                 --set control.policy=traction\n";
    let export = ["export", "prompt.toml", "--format", "c"];
    assert_eq!(stderr(&omnistep(path, &export)), reads);
    assert_eq!(
        stderr(&omnistep(
            path,
            &[&export[..], &["--set", "control.policy=scale_references"]].concat()
        )),
        ""
    );
}
