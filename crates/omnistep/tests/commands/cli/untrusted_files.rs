//! Files of others: what they name, how large they are, how many combinations they ask for.

use std::fs::{self, File};
use std::path::Path;
use std::process::Command as Program;
use std::time::Duration;

use super::{omnistep, refused, stdout};
use assert_cmd::Command;
use omni_config::Scenario;

/// As [`refused`], of what might wait for ever: no longer than a minute.
pub(super) fn refused_soon(folder: &Path, args: &[&str]) -> String {
    let output = Command::cargo_bin("omnistep")
        .unwrap()
        .current_dir(folder)
        .args(args)
        .timeout(Duration::from_secs(60))
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    assert_eq!(said.lines().count(), 1, "{args:?}: {said}");
    said
}

/// Every way to name a file, with `X` for it.
const WAYS: [&[&str]; 13] = [
    &["check", "X"],
    &["run", "X"],
    &["compare", "X"],
    &["run", "flat", "--set", "vehicle=X"],
    &["run", "height_map", "--set", "terrain.image=X"],
    &["study", "X"],
    &["motor-bench", "X"],
    &["export", "X", "--format", "urdf"],
    &["export", "X", "--format", "mjcf"],
    &["info", "X"],
    &["replay", "X"],
    &["export", "X", "--format", "rust"],
    &[
        "run",
        "flat",
        "--policy",
        "independent",
        "--controller",
        "qemu",
        "--firmware",
        "X",
    ],
];

#[test]
#[cfg(unix)]
fn what_is_no_regular_file_is_one_line_wherever_a_file_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let made = Program::new("mkfifo")
        .arg(folder.path().join("pipe"))
        .status()
        .unwrap();
    assert!(made.success());
    fs::create_dir(folder.path().join("directory")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.path().join("zero")).unwrap();
    for (name, kind) in [
        ("pipe", "a pipe"),
        ("directory", "a directory"),
        ("zero", "a device"),
    ] {
        for way in WAYS {
            let args: Vec<_> = way.iter().map(|arg| arg.replace('X', name)).collect();
            let said = refused_soon(
                folder.path(),
                &args.iter().map(String::as_str).collect::<Vec<_>>(),
            );
            assert!(
                said.contains(&format!("{name}: {kind}, allowed: a regular file")),
                "{args:?}: {said}"
            );
        }
    }
}

#[test]
fn a_file_that_is_too_large_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let make = |name: &str, bytes| {
        File::create(folder.path().join(name))
            .unwrap()
            .set_len(bytes)
            .unwrap()
    };
    make("large.toml", 16_000_001);
    make("large.png", 64_000_001);
    for way in &WAYS[..8] {
        let image = way.contains(&"terrain.image=X");
        let name = if image { "large.png" } else { "large.toml" };
        let args: Vec<_> = way.iter().map(|arg| arg.replace('X', name)).collect();
        let said = refused_soon(
            folder.path(),
            &args.iter().map(String::as_str).collect::<Vec<_>>(),
        );
        let allowed = if image {
            "64000001 bytes, allowed: 64000000 at most"
        } else {
            "16000001 bytes, allowed: 16000000 at most"
        };
        assert!(said.contains(&format!("{name}: {allowed}")), "{args:?}: {said}");
    }
}

/// What a study of these axes is refused with, or what it is.
fn checked(folder: &Path, axes: &[(&str, &str)]) -> Result<String, String> {
    let axes: String = axes
        .iter()
        .map(|(key, values)| format!("[[axis]]\nkey = \"{key}\"\nvalues = [{values}]\n"))
        .collect();
    let study = format!("schema_version = 1\nname = \"s\"\nscenario = \"step\"\nseeds = 1\n{axes}");
    fs::write(folder.join("s.toml"), study).unwrap();
    let output = omnistep(folder, &["check", "s.toml"]);
    if output.status.success() {
        Ok(stdout(&output))
    } else {
        Err(refused(folder, &["check", "s.toml"]))
    }
}

/// Ten numbers from here on in steps.
fn ten(from: f64, step: f64) -> String {
    (0..10)
        .map(|i| format!("{:.3}", from + step * f64::from(i)))
        .collect::<Vec<_>>()
        .join(", ")
}

#[test]
fn a_huge_study_is_checked_value_by_value() {
    let folder = tempfile::tempdir().unwrap();
    let keys = [
        "terrain.height_m",
        "terrain.friction",
        "command.vx_m_s",
        "vehicle.motor.stall_torque_n_m",
        "terrain.start_x_m",
    ];
    let values: Vec<_> = [(0.01, 0.005), (0.2, 0.1), (0.05, 0.05), (1.0, 0.2), (1.0, 0.1)]
        .map(|(from, step)| ten(from, step))
        .into();
    let axes: Vec<_> = keys
        .iter()
        .copied()
        .zip(values.iter().map(String::as_str))
        .collect();
    assert_eq!(
        checked(folder.path(), &axes),
        Ok(
            "s.toml: study s: 100000 runs, 100000 combinations of 5 axes with 1 seeds; scenario step\n"
                .into()
        )
    );
    let study = omni_config::Study::load(folder.path().join("s.toml").to_str().unwrap()).unwrap();
    assert_eq!(study.each_value(&[]).unwrap().len(), 1 + 5 * 9);
    // Every value of every axis is looked at, the last of each too.
    for (i, (key, bad, allowed)) in [
        ("terrain.height_m", "11.0", "0.0001 to 10"),
        ("terrain.friction", "2.1", "0 to 2"),
        ("command.vx_m_s", "101.0", "-100 to 100"),
    ]
    .into_iter()
    .enumerate()
    {
        let mut wrong = axes.clone();
        let values = format!("{}, {bad}", wrong[i].1);
        let short = "0.5, 0.6".to_owned();
        wrong[(i + 1) % 5].1 = if wrong[(i + 1) % 5].0 == "terrain.start_x_m" {
            "1.0"
        } else {
            &short
        };
        wrong[i].1 = &values;
        let said = checked(folder.path(), &wrong).unwrap_err();
        let shown = bad.parse::<f64>().unwrap();
        assert_eq!(
            said,
            format!("error: s.toml: axis[{i}]: {key} = {bad}: {shown}, allowed: {allowed}\n")
        );
    }
    // Too many, and a value twice.
    let more = format!("{}, 0.9", values[0]);
    let said = checked(folder.path(), &[&[(keys[0], more.as_str())], &axes[1..]].concat()).unwrap_err();
    assert_eq!(
        said,
        "error: s.toml: axis: too many combinations, allowed: 100000 at most\n"
    );
    let said = checked(
        folder.path(),
        &[
            ("terrain.friction", "0.5, 0.6, 0.60"),
            ("terrain.height_m", "0.02, 0.03"),
        ],
    )
    .unwrap_err();
    assert!(
        said.contains("are the same run, allowed: each run once"),
        "{said}"
    );
}

#[test]
fn invalid_pairs_of_values_are_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    // 1 ms is a multiple of 0.2 and of 0.25 ms, 0.6 ms of 0.2 ms only.
    let axes = [
        ("physics.timestep_s", "0.0002, 0.00025"),
        ("control.period_s", "0.001, 0.0006"),
    ];
    assert!(checked(folder.path(), &axes).is_ok());
    let said = refused(folder.path(), &["study", "s.toml", "--quiet"]);
    assert_eq!(
        said,
        "error: s.toml: axis[1]: control.period_s = 0.0006: 0.0006, allowed: a multiple of physics.timestep_s, 0.00025\n"
    );
    assert!(!folder.path().join("out").exists(), "nothing is written");
}

#[test]
fn no_message_exceeds_its_length_whatever_a_file_holds() {
    let folder = tempfile::tempdir().unwrap();
    let step = toml::to_string(&Scenario::load("step", &[]).unwrap()).unwrap();
    let long = "a".repeat(10_000_000);
    let wide = "9, ".repeat(1_000_000);
    for (from, to, end) in [
        (
            "name = \"step\"",
            format!("name = \"{long}\""),
            ", allowed: 1 to 40 letters, digits, '_' or '-'\n",
        ),
        (
            "name = \"step\"",
            format!("name = \"{}\"", "漢\\u001b".repeat(1_000_000)),
            ", allowed: 1 to 40 letters, digits, '_' or '-'\n",
        ),
        (
            "duration_s = 6.0",
            format!("duration_s = \"{long}\""),
            ", expected a number; for example duration_s = 6.0\n",
        ),
        (
            "duration_s = 6.0",
            format!("duration_s = [{wide}]"),
            "expected a number; for example duration_s = 6.0\n",
        ),
        ("seed = 0", format!("seed = 0\n{long} = 1"), "\n"),
        (
            "policy = \"traction\"",
            format!("policy = \"{long}\""),
            "shared_integral, traction_runup, traction\n",
        ),
        ("kind = \"step\"", format!("kind = \"{long}\""), "\n"),
        (
            "schema_version = 1",
            format!("schema_version = \"{long}\""),
            "write schema_version = 1\n",
        ),
        ("schema_version = 1", format!("schema_version = 1 {long}"), "\n"),
    ] {
        assert!(step.contains(from), "{from}");
        fs::write(folder.path().join("s.toml"), step.replacen(from, &to, 1)).unwrap();
        for command in ["check", "run"] {
            let said = refused(folder.path(), &[command, "s.toml"]);
            let count = said.chars().count();
            assert!(
                count <= 300 && said.ends_with(end),
                "{from}: {count}: {said:.400}"
            );
            assert!(!said.contains('\u{1b}'));
        }
    }
    let name = "b".repeat(100_000);
    for args in [
        &["run", &name][..],
        &["run", "flat", "--set", &format!("vehicle={name}")],
        &["run", "flat", "--set", &format!("{name}=1")],
        &["run", "flat", "--set", &name],
        &["run", "flat", "--policy", &name],
        &["info", &name],
        &["check", &name],
    ] {
        let said = refused(folder.path(), args);
        assert!(
            said.chars().count() <= 300,
            "{:.40?}: {}",
            args,
            said.chars().count()
        );
    }
    let study = format!("schema_version = 1\nname = \"s\"\nscenario = \"step\"\nseeds = [{wide}]\n");
    fs::write(folder.path().join("s.toml"), study).unwrap();
    assert!(refused(folder.path(), &["check", "s.toml"]).chars().count() <= 300);
    let said = checked(
        folder.path(),
        &[("vehicle", &format!("\"{long}\"")), ("terrain.height_m", "0.02")],
    )
    .unwrap_err();
    assert!(said.chars().count() <= 300, "{said}");
}
