//! Robots to start a vehicle from, and vehicles of one's own.

use std::fs;
use std::path::{Path, PathBuf};

use super::{omnistep, refused, rows, stderr, stdout};

/// The names that `omnistep list robots` prints.
fn names() -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let listed = stdout(&omnistep(folder.path(), &["list", "robots"]));
    let first = |line: &str| line.split_whitespace().next().map(str::to_owned);
    listed.lines().filter_map(first).collect()
}

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/robots")
}

#[test]
fn every_file_of_a_robot_is_listed_with_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let entries = fs::read_dir(assets()).unwrap();
    let mut files: Vec<_> = entries
        .map(|entry| {
            entry
                .unwrap()
                .path()
                .file_stem()
                .unwrap()
                .to_str()
                .unwrap()
                .to_owned()
        })
        .collect();
    let mut listed = names();
    let all = stdout(&omnistep(folder.path(), &["list"]));
    let line = all.lines().find(|line| line.starts_with("robots: ")).unwrap();
    assert!(line.contains(&listed.join(", ")), "{line}");
    files.sort();
    listed.sort();
    assert_eq!(files, listed);
    let shown = stdout(&omnistep(folder.path(), &["list", "robots"]));
    assert!(
        shown.contains("ridgeback     Clearpath Ridgeback: 195 kg"),
        "{shown}"
    );
}

#[test]
fn a_vehicle_of_a_robot_has_no_doubts_and_drives_straight() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for robot in names() {
        let (own, file) = (format!("my_{robot}"), format!("my_{robot}.toml"));
        let new = omnistep(path, &["new", "vehicle", &own, "--template", &robot]);
        assert!(new.status.success(), "{}", stderr(&new));
        assert!(stdout(&new).starts_with(&format!("{file}: started from {robot}; run it with: ")));
        let checked = omnistep(path, &["check", &file, "--strict"]);
        assert!(checked.status.success(), "{robot}: {}", stderr(&checked));
        assert!(stdout(&checked).starts_with(&format!("{file}: vehicle {own}: ")));
        let run = ["run", "flat", "--vehicle", &file, "--json", "--quiet"];
        let sets = [
            "duration_s=2",
            "command.vx_m_s=0.15",
            "physics.engine=articulated",
        ];
        let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let run = omnistep(path, &[&run[..], &sets].concat());
        assert!(run.status.success(), "{robot}: {}", stderr(&run));
        let outcome = &rows(&run)[0];
        let metric = |key: &str| outcome[key].as_f64().unwrap();
        // 0.15 m/s for 2 s, of which 0.3 s are a ramp. Gains are derived for a time constant of 0.1 s: some mm of lag.
        let distance_m = 0.15 * (2.0 - 0.3 / 2.0);
        assert!(
            (metric("final_x_m") - distance_m).abs() < 0.005,
            "{robot}: {outcome}"
        );
        // Centres of mass are up to 2 mm off the middle: nothing else turns a vehicle on flat ground.
        assert!(metric("final_y_m").abs() < 1e-3, "{robot}: {outcome}");
        assert!(metric("final_yaw_rad").abs() < 2e-3, "{robot}: {outcome}");
    }
}

/// Words that a file's head explains: `#   urdf: GitHub ...`.
fn sources(text: &str) -> Vec<&str> {
    let head = text.lines().take_while(|line| line.starts_with('#'));
    head.filter_map(|line| line.strip_prefix("#   ")?.split_once(": "))
        .map(|(word, _)| word)
        .chain(["assumption"])
        .collect()
}

/// Lines with a number whose comment, or that of whose table, does not begin with one of the words.
fn without_source<'a>(text: &'a str, words: &[&str]) -> Vec<&'a str> {
    let named = |comment: Option<&str>| {
        comment.is_some_and(|comment| {
            let word = comment.trim().split_once(": ").map(|(word, _)| word);
            word.is_some_and(|word| words.contains(&word))
        })
    };
    let (mut of_table, mut found) = (false, Vec::new());
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let (keys, comment) = match line.split_once('#') {
            Some((keys, comment)) => (keys, Some(comment)),
            None => (line, None),
        };
        if keys.starts_with('[') {
            of_table = named(comment);
        }
        let value = keys.split_once('=').map(|(_, value)| value.trim());
        let number = value
            .is_some_and(|value| !value.starts_with('"') && value.contains(|c: char| c.is_ascii_digit()));
        // How a wheel rolls and a version are definitions.
        let defined = keys.starts_with("rolling_direction") || keys.starts_with("schema_version");
        if number && !defined && !named(comment) && (comment.is_some() || !of_table) {
            found.push(line);
        }
    }
    found
}

#[test]
fn every_number_of_a_robot_names_its_source_or_is_an_assumption() {
    for robot in names() {
        let text = fs::read_to_string(assets().join(format!("{robot}.toml"))).unwrap();
        let words = sources(&text);
        assert!(words.len() > 1, "{robot} names no source");
        assert_eq!(without_source(&text, &words), Vec::<&str>::new(), "{robot}");
    }
    // That the search finds something.
    let words = ["urdf", "assumption"];
    for line in [
        "mass_kg = 1.0",
        "mass_kg = 1.0 # a guess",
        "com_m = [0, 0, 1] # data: x",
    ] {
        assert_eq!(
            without_source(&format!("[[body]] # urdf: base\n{line}"), &words).len(),
            usize::from(line.contains('#'))
        );
        assert_eq!(without_source(&format!("[[body]]\n{line}"), &words), [line]);
    }
}

#[test]
fn an_unknown_vehicle_is_answered_with_all_names() {
    let folder = tempfile::tempdir().unwrap();
    let said = refused(
        folder.path(),
        &["new", "vehicle", "mine", "--template", "ridgeback2"],
    );
    assert_eq!(
        said,
        "error: unknown vehicle \"ridgeback2\" (did you mean \"ridgeback\"?), allowed: chugo7, omni3, mecanum4, \
         rocker_bogie6, youbot, ridgeback, rosbot_xl, rosmaster_x3, strafer, lekiwi, robotino, osr, or the path of a \
         .toml file\n"
    );
    let said = refused(
        folder.path(),
        &["new", "vehicle", "mine", "--template", "absent.toml"],
    );
    assert!(said.starts_with("error: absent.toml: No such file"), "{said}");
}

#[test]
fn a_robot_in_place_of_a_vehicle_is_answered_with_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let way = "; first: omnistep new vehicle my_youbot --template youbot\n";
    for args in [
        &["run", "flat", "--vehicle", "youbot"][..],
        &["check", "youbot"],
        &["new", "scenario", "ground", "--vehicle", "youbot"],
    ] {
        let said = refused(folder.path(), args);
        assert!(said.ends_with(way), "{args:?}: {said}");
    }
}

#[test]
fn a_vehicle_is_started_from_a_file_of_ones_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let read = |file: &str| fs::read_to_string(path.join(file)).unwrap();
    assert!(
        omnistep(path, &["new", "vehicle", "first", "--template", "strafer"])
            .status
            .success()
    );
    // A comment before the name, no spaces, single quotes: only the name is another one.
    let own = read("first.toml").replace("name = \"first\"", "name='first' # as painted");
    fs::write(path.join("first.toml"), &own).unwrap();
    let said = omnistep(path, &["new", "vehicle", "second", "--template", "first.toml"]);
    assert!(said.status.success(), "{}", stderr(&said));
    assert_eq!(read("second.toml"), own.replace("'first'", "\"second\""));
    // The schema beside the copy is that of its own folder.
    fs::write(path.join("vehicle.schema.json"), "{}").unwrap();
    assert!(
        omnistep(path, &["new", "vehicle", "third", "--template", "second.toml"])
            .status
            .success()
    );
    let third = read("third.toml");
    assert!(
        third.starts_with("#:schema ./vehicle.schema.json\n# goBILDA Strafer"),
        "{third}"
    );
    // What is no vehicle is refused under its own name, and nothing is written.
    assert!(omnistep(path, &["new", "scenario", "ground"]).status.success());
    let said = refused(path, &["new", "vehicle", "fourth", "--template", "ground.toml"]);
    assert!(
        said.starts_with("error: ground.toml: this is a scenario file, not a vehicle"),
        "{said}"
    );
    fs::write(
        path.join("bad.toml"),
        own.replace("radius_m = 0.048", "radius_m = 48"),
    )
    .unwrap();
    let said = refused(path, &["new", "vehicle", "fourth", "--template", "bad.toml"]);
    assert!(
        said.starts_with("error: bad.toml: mecanum4.radius_m: 48, allowed: 0.001 to 10"),
        "{said}"
    );
    assert!(!path.join("fourth.toml").exists());
}
