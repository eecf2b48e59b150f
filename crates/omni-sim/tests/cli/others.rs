//! Files and logs of others: what they name, how large they are, what they say of themselves.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;
use std::process::Command as Program;
use std::time::Duration;

use assert_cmd::Command;
use omni_sim::config::Scenario;
use omni_sim::log::LoggedRun;
use toml::{Table, Value};

use super::logs::{copied, logged};
use super::{omnistep, refused, stdout};

/// As [`refused`], of what might wait for ever: no longer than a minute.
fn refused_soon(folder: &Path, args: &[&str]) -> String {
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

/// The same within 1 GB of address space: what asks for more is ended by a signal.
fn refused_small(folder: &Path, args: &str) -> String {
    let line = format!(
        "ulimit -v 1000000; exec {} {args}",
        env!("CARGO_BIN_EXE_omnistep")
    );
    let output = Program::new("bash")
        .current_dir(folder)
        .args(["-c", &line])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        matches!(output.status.code(), Some(1 | 2)),
        "{args}: {}: {said}",
        output.status
    );
    assert_eq!(said.lines().count(), 1, "{args}: {said}");
    assert!(said.chars().count() <= 300, "{args}: {said}");
    said
}

/// Every way to name a file, with `X` for it.
const WAYS: [&[&str]; 12] = [
    &["check", "X"],
    &["run", "X"],
    &["compare", "X"],
    &["run", "flat", "--set", "vehicle=X"],
    &["run", "height_map", "--set", "terrain.image=X"],
    &["study", "X"],
    &["wheels", "X"],
    &["urdf", "X"],
    &["inspect", "X"],
    &["replay", "X"],
    &["constants", "X"],
    &["run", "flat", "--controller", "qemu", "--firmware", "X"],
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

#[test]
fn a_scenario_in_a_log_names_no_file_of_this_machine() {
    let folder = tempfile::tempdir().unwrap();
    let log = logged(folder.path(), 0.1);
    let own = toml::to_string(Scenario::load("flat", &[]).unwrap().vehicle()).unwrap();
    fs::write(folder.path().join("v.toml"), own).unwrap();
    let there = folder.path().join("v.toml").display().to_string();
    let hills = Scenario::load("height_map", &[]).unwrap().to_toml().unwrap();
    for name in ["/dev/zero", "v.toml", &there, "nowhere.toml", "chugo7"] {
        let bad = folder.path().join("bad.mcap");
        copied(
            &log,
            &bad,
            |_, _| (),
            |text| {
                let mut scenario: Table = text.parse().unwrap();
                scenario.insert("vehicle".into(), name.into());
                scenario.to_string()
            },
        );
        for command in ["inspect", "replay"] {
            let said = refused_soon(folder.path(), &[command, "bad.mcap"]);
            let expected = format!(
                "error: bad.mcap (scenario.toml): vehicle: {name:?}, allowed: the vehicle itself: a scenario in a log or a pickle \
                 names no other file\n"
            );
            assert_eq!(said, expected);
        }
        copied(
            &log,
            &bad,
            |_, _| (),
            |_| {
                let mut scenario: Table = hills.parse().unwrap();
                scenario["terrain"]["image"] = Value::from(name);
                scenario.to_string()
            },
        );
        for command in ["inspect", "replay"] {
            let said = refused_soon(folder.path(), &[command, "bad.mcap"]);
            let expected = format!(
                "terrain.image: {name:?}, allowed: the picture itself: a scenario in a log or a pickle"
            );
            assert!(said.contains(&expected), "{said}");
        }
    }
    // Whole, it is read.
    copied(
        &log,
        &folder.path().join("good.mcap"),
        |_, _| (),
        |_| hills.clone(),
    );
    assert!(
        omnistep(folder.path(), &["inspect", "good.mcap"])
            .status
            .success()
    );
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// A file of these records behind a header.
fn mcap_of(path: &Path, records: &[Vec<u8>]) {
    let header = record(0x01, &[text(""), text("")].concat());
    fs::write(path, [mcap::MAGIC, &header, &records.concat()].concat()).unwrap();
}

#[test]
fn a_length_in_a_record_asks_for_no_memory_that_the_file_has_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let far = u32::MAX.to_le_bytes().to_vec();
    // Metadata, a channel, a schema, an attachment, the header itself and a chunk within a chunk, whose texts are said to be 4 GB
    // long; an attachment that ends before its checksum; a record and a chunk that are said to be 200 MB long.
    let inner = record(0x06, &[vec![0; 28], far.clone(), vec![0; 30]].concat());
    let length = (inner.len() as u64).to_le_bytes().to_vec();
    for records in [
        record(0x0c, &[far.clone(), vec![0; 30]].concat()),
        record(0x04, &[vec![0; 4], far.clone(), vec![0; 30]].concat()),
        record(0x03, &[vec![0; 2], far.clone(), vec![0; 30]].concat()),
        record(0x09, &[vec![0; 16], far.clone(), vec![0; 30]].concat()),
        record(0x09, &[vec![0; 16], text("a"), text("b"), vec![0; 8]].concat()),
        record(0x01, &far),
        record(
            0x06,
            &[vec![0; 16], length.clone(), vec![0; 4], text(""), length, inner].concat(),
        ),
        [&[0x0c][..], &200_000_000_u64.to_le_bytes()].concat(),
        record(
            0x06,
            &[
                vec![0; 16],
                200_000_000_u64.to_le_bytes().to_vec(),
                vec![1; 4],
                text("zstd"),
                vec![0; 8],
            ]
            .concat(),
        ),
    ] {
        mcap_of(&path, &[records]);
        let said = refused_small(folder.path(), "inspect x.mcap");
        assert!(said.starts_with("error: x.mcap: "), "{said}");
    }
}

/// A log of another program: messages of one topic, each with its bytes and its number.
fn foreign(
    path: &Path,
    topic: &str,
    encoding: &str,
    messages: impl Iterator<Item = (u32, Vec<u8>)>,
    scenario: Option<&str>,
) {
    let mut writer = mcap::Writer::new(BufWriter::new(File::create(path).unwrap())).unwrap();
    let channel = writer.add_channel(0, topic, encoding, &BTreeMap::new()).unwrap();
    for (i, (sequence, data)) in messages.enumerate() {
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence,
            log_time: 20_000_000 * i as u64,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    if let Some(text) = scenario {
        let attachment = mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: "scenario.toml".into(),
            media_type: "application/toml".into(),
            data: text.as_bytes().into(),
        };
        writer.attach(&attachment).unwrap();
    }
    writer.finish().unwrap();
}

/// An empty `tf2_msgs/msg/TFMessage`, or one with a frame, in CDR.
fn tf(frame: Option<&str>) -> Vec<u8> {
    let Some(frame) = frame else {
        return [[0, 1, 0, 0], [0; 4]].concat();
    };
    let mut body = vec![1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    for name in ["world", frame] {
        body.extend((name.len() as u32 + 1).to_le_bytes());
        body.extend(name.as_bytes());
        body.push(0);
        body.resize(body.len().next_multiple_of(4), 0);
    }
    body.resize(body.len().next_multiple_of(8) + 56, 0);
    [&[0, 1, 0, 0], &body[..]].concat()
}

#[test]
fn a_healthy_log_of_another_program_is_no_run_of_omnistep_and_not_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let no_run =
        "error: x.mcap: no attachment scenario.toml: not a run of omnistep, or killed at its start\n";
    let refused = |said: &str| {
        for command in ["inspect", "replay"] {
            assert_eq!(super::refused(folder.path(), &[command, "x.mcap"]), said);
        }
    };
    // As most writers leave the numbers of messages, or none counts from 0; a topic of ours in another encoding.
    foreign(&path, "/tf", "cdr", (0..5).map(|_| (0, tf(None))), None);
    refused(no_run);
    foreign(&path, "/tf", "cdr", (7..12).map(|i| (i, tf(None))), None);
    refused(no_run);
    foreign(
        &path,
        "/joint_states",
        "json",
        (0..5).map(|i| (i, b"{\"name\": []}".to_vec())),
        None,
    );
    refused(no_run);
    // Chunks that this program cannot open, nor writes.
    let chunk = [vec![0; 28], text("lz4"), 4_u64.to_le_bytes().to_vec(), vec![0; 4]].concat();
    mcap_of(&path, &[record(0x06, &chunk)]);
    refused("error: x.mcap: compressed by \"lz4\": not a run of omnistep\n");

    // With a scenario it is one of ours, wherever in the file that is, and then it is damaged.
    let scenario = Scenario::load("flat", &[]).unwrap().to_toml().unwrap();
    foreign(
        &path,
        "/tf",
        "cdr",
        (0..5).map(|_| (0, tf(None))),
        Some(&scenario),
    );
    let output = omnistep(folder.path(), &["inspect", "x.mcap"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        (output.status.code(), said.as_str()),
        (
            Some(1),
            "error: x.mcap: damaged: /tf: message 0 follows 1 messages\n"
        )
    );
}

#[test]
fn frames_of_a_log_are_the_vehicles_and_take_no_memory_before_that_is_known() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let scenario = Scenario::load("flat", &[]).unwrap().to_toml().unwrap();
    let said = || LoggedRun::read(&path).unwrap_err().to_string();
    // Many empty messages, then new names: each used to take a pose a message.
    let names: Vec<_> = (0..100).map(|i| format!("frame_{i}")).collect();
    let messages = (0..1000)
        .map(|_| tf(None))
        .chain(names.iter().map(|name| tf(Some(name))));
    let numbered = |messages: Vec<Vec<u8>>| (0..).zip(messages);
    foreign(&path, "/tf", "cdr", numbered(messages.collect()), Some(&scenario));
    assert_eq!(
        said(),
        format!(
            "{}: damaged: /tf at t = 20 s: 1 frames, not those of the first message",
            path.display()
        )
    );
    foreign(
        &path,
        "/tf",
        "cdr",
        numbered(vec![tf(Some("mine")); 10]),
        Some(&scenario),
    );
    let expected = format!(
        "{}: damaged: /tf: frame \"mine\", allowed: base_link, ",
        path.display()
    );
    assert!(said().starts_with(&expected), "{}", said());
    foreign(&path, "/tf", "cdr", numbered(vec![tf(None); 10]), Some(&scenario));
    assert!(
        said().contains("damaged: /tf: 0 frames, allowed: base_link, "),
        "{}",
        said()
    );
}

#[test]
fn a_small_file_unpacks_to_no_more_than_60_times_its_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let scenario = Scenario::load("flat", &[]).unwrap().to_toml().unwrap();
    // 1 GB of nothing in some 100 kB.
    foreign(
        &path,
        "/other",
        "cdr",
        (0..1000).map(|i| (i, vec![0; 1 << 20])),
        Some(&scenario),
    );
    let bytes = fs::metadata(&path).unwrap().len();
    assert!(bytes < 400_000, "{bytes}");
    let said = refused_small(folder.path(), "inspect x.mcap");
    assert!(
        said.starts_with(&format!("error: x.mcap: damaged: {bytes} bytes that unpack to ")),
        "{said}"
    );
}

#[test]
fn records_of_nothing_count_as_what_a_file_unpacks_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let mut writer = mcap::Writer::new(BufWriter::new(File::create(&path).unwrap())).unwrap();
    // 9 bytes each, 22 MB in chunks of 4.5: the smallest of files may unpack to 16.
    for _ in 0..5 {
        for _ in 0..500_000 {
            let within = mcap::write::PrivateRecordOptions::IncludeInChunks;
            writer.write_private_record(0x80, &[], within.into()).unwrap();
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
    let bytes = fs::metadata(&path).unwrap().len();
    assert!(bytes < 80_000, "{bytes}");
    let said = refused_small(folder.path(), "inspect x.mcap");
    assert!(
        said.starts_with(&format!("error: x.mcap: damaged: {bytes} bytes that unpack to ")),
        "{said}"
    );
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
fn a_study_of_a_hundred_thousand_combinations_is_checked_value_by_value() {
    let folder = tempfile::tempdir().unwrap();
    let keys = [
        "terrain.height_m",
        "terrain.friction",
        "command.vx_m_s",
        "vehicle.motor.stall_torque_n_m",
        "terrain.at_m",
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
    let study = omni_sim::config::Study::load(folder.path().join("s.toml").to_str().unwrap()).unwrap();
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
        wrong[(i + 1) % 5].1 = if wrong[(i + 1) % 5].0 == "terrain.at_m" {
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
    assert!(said.contains("are the same run, allowed: each once"), "{said}");
}

#[test]
fn what_only_two_values_together_break_is_said_before_anything_is_run() {
    let folder = tempfile::tempdir().unwrap();
    // 1000 is a multiple of 200 and of 250, 600 of 200 only.
    let axes = [
        ("physics.step_us", "200, 250"),
        ("control.period_us", "1000, 600"),
    ];
    assert!(checked(folder.path(), &axes).is_ok());
    let said = refused(folder.path(), &["study", "s.toml", "--quiet"]);
    assert_eq!(
        said,
        "error: s.toml: axis[1]: control.period_us = 600: 600, allowed: a multiple of physics.step_us, 250\n"
    );
    assert!(!folder.path().join("out").exists(), "nothing is written");
}

#[test]
fn no_message_is_longer_than_somebody_reads_whatever_a_file_holds() {
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
            ", expected f64\n",
        ),
        (
            "duration_s = 6.0",
            format!("duration_s = [{wide}]"),
            "expected f64\n",
        ),
        ("seed = 0", format!("seed = 0\n{long} = 1"), "\n"),
        (
            "policy = \"synchronised\"",
            format!("policy = \"{long}\""),
            "load_sharing\n",
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
        &["inspect", &name],
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
