//! What people get wrong: files of another kind, seeds, encodings; and how long an answer is.

use std::fs;
use std::path::Path;

use super::{omnistep, one_of_each, refused, rows, stderr, stdout};

#[test]
fn a_map_and_a_chart_are_named_with_the_command_that_reads_them() {
    let folder = tempfile::tempdir().unwrap();
    let made = omnistep(
        folder.path(),
        &["new", "import-map", "m", "--vehicle", "mecanum4"],
    );
    assert!(made.status.success(), "{made:?}");
    assert_eq!(
        refused(folder.path(), &["check", "m.toml"]),
        "error: m.toml: top level: this is a map, which omnistep import reads with --map, not a scenario file\n"
    );
    let chart = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../omni-plan/tests/charts/mecanum4.toml"
    );
    fs::copy(chart, folder.path().join("c.toml")).unwrap();
    assert_eq!(
        refused(folder.path(), &["run", "c.toml"]),
        "error: c.toml: top level: this is a climb chart, which omnistep plan reads with --chart, not a scenario file\n"
    );
}

#[test]
fn a_file_of_another_kind_is_named_with_its_command() {
    let folder = one_of_each();
    for (args, expected) in [
        (
            &["run", "v.toml"][..],
            "v.toml: this is a vehicle file, not a scenario; use: omnistep run flat --set vehicle=v.toml",
        ),
        (
            &["compare", "v.toml"],
            "v.toml: this is a vehicle file, not a scenario; use: omnistep compare flat --set vehicle=v.toml",
        ),
        (
            &["study", "v.toml"],
            "v.toml: this is a vehicle file, not a study; use: omnistep run flat --set vehicle=v.toml",
        ),
        (
            &["motor-bench", "v.toml"],
            "v.toml: this is a vehicle file, not a motor bench experiment; use: omnistep run flat --set vehicle=v.toml",
        ),
        (
            &["run", "y.toml"],
            "y.toml: this is a study file, not a scenario; use: omnistep study y.toml",
        ),
        (
            &["export", "y.toml", "--format", "rust"],
            "y.toml: this is a study file, not a scenario; use: omnistep study y.toml",
        ),
        (
            &["export", "y.toml", "--format", "urdf"],
            "y.toml: this is a study file, not a vehicle; use: omnistep study y.toml",
        ),
        (
            &["run", "w.toml"],
            "w.toml: this is a motor bench experiment, not a scenario; use: omnistep motor-bench w.toml",
        ),
        (
            &["study", "s.toml"],
            "s.toml: this is a scenario file, not a study; use: omnistep run s.toml",
        ),
        (
            &["export", "s.toml", "--format", "urdf"],
            "s.toml: this is a scenario file, not a vehicle; use: omnistep run s.toml",
        ),
        (
            &["wheel-ripple", "s.toml"],
            "s.toml: this is a scenario file, not a vehicle; use: omnistep run s.toml",
        ),
        (
            &["motor-bench", "s.toml"],
            "s.toml: this is a scenario file, not a motor bench experiment; use: omnistep run s.toml",
        ),
        (
            &["run", "mecanum4"],
            "mecanum4: this is a vehicle, not a scenario; use: omnistep run flat --set vehicle=mecanum4",
        ),
        (
            &["run", "climb_map"],
            "climb_map: this is a study, not a scenario; use: omnistep study climb_map",
        ),
        (
            &["study", "step"],
            "step: this is a scenario, not a study; use: omnistep run step",
        ),
    ] {
        assert_eq!(
            refused(folder.path(), args),
            format!("error: {expected}\n"),
            "{args:?}"
        );
    }
    // What it says to type works.
    let said = omnistep(
        folder.path(),
        &["export", "flat", "--format", "rust", "--set", "vehicle=v.toml"],
    );
    assert!(said.status.success(), "{}", stderr(&said));
}

#[test]
fn check_and_info_go_on_after_a_bad_file_and_end_as_the_worst() {
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
    let output = omnistep(path, &["info", &flipped, &good]);
    // A damaged log is a failure, not a wrong request.
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stdout(&output).contains("all checksums are correct"),
        "{}",
        stdout(&output)
    );
    assert!(
        stdout(&output).contains("completed"),
        "the table of the good ones: {}",
        stdout(&output)
    );
    assert_eq!(stderr(&output).lines().count(), 1, "{}", stderr(&output));
    let output = omnistep(path, &["info", &flipped, "missing.mcap", &good, "--json"]);
    assert_eq!((output.status.code(), rows(&output).len()), (Some(2), 1));
    assert_eq!(stderr(&output).lines().count(), 2, "{}", stderr(&output));
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
            "log.toml: this is an MCAP log, not TOML; use: omnistep info log.toml",
        ),
    ] {
        for command in [
            &["check"][..],
            &["run"],
            &["export", "--format", "rust"],
            &["study"],
        ] {
            let said = refused(path, &[command, &[file]].concat());
            assert!(said.contains(expected) && said.len() < 300, "{command:?}: {said}");
        }
    }
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
fn no_line_has_more_than_300_characters() {
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
