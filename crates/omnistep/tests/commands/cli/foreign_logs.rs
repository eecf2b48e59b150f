//! Logs of others: what they name, how much they unpack to, what they say of themselves.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;
use std::process::Command as Program;

use omni_config::Scenario;
use omni_log::LoggedRun;
use toml::{Table, Value};

use super::logs::{copied, logged};
use super::omnistep;
use super::untrusted_files::refused_soon;

/// As [`refused`](super::refused), within 1 GB of address space: what asks for more is ended by a signal.
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
        for command in ["info", "replay"] {
            let said = refused_soon(folder.path(), &[command, "bad.mcap"]);
            let expected = format!(
                "error: bad.mcap (scenario.toml): vehicle: {name:?}, allowed: the vehicle itself: a scenario in a log or a \
                 pickle cannot name another file\n"
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
        for command in ["info", "replay"] {
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
    assert!(omnistep(folder.path(), &["info", "good.mcap"]).status.success());
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
fn a_record_asks_for_no_memory_beyond_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let far = u32::MAX.to_le_bytes().to_vec();
    // Metadata, a channel, a schema, an attachment, the header itself and a chunk within a chunk,
    // whose texts are said to be 4 GB long; an attachment that ends before its checksum; a record
    // and a chunk that are said to be 200 MB long.
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
        let said = refused_small(folder.path(), "info x.mcap");
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
fn a_healthy_foreign_log_is_no_run_and_not_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let no_run = "error: x.mcap: no attachment scenario.toml: not a log of omnistep, or of a run that was killed at its start\n";
    let refused = |said: &str| {
        for command in ["info", "replay"] {
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
    refused("error: x.mcap: compressed with \"lz4\": not a log of omnistep\n");

    // With a scenario it is one of ours, wherever in the file that is, and then it is damaged.
    let scenario = Scenario::load("flat", &[]).unwrap().to_toml().unwrap();
    foreign(
        &path,
        "/tf",
        "cdr",
        (0..5).map(|_| (0, tf(None))),
        Some(&scenario),
    );
    let output = omnistep(folder.path(), &["info", "x.mcap"]);
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
fn frames_of_a_log_are_checked_before_they_take_memory() {
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
            "{}: damaged: /tf at t = 20 s: 1 frames, other frames than in the first message",
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
    let said = refused_small(folder.path(), "info x.mcap");
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
    let said = refused_small(folder.path(), "info x.mcap");
    assert!(
        said.starts_with(&format!("error: x.mcap: damaged: {bytes} bytes that unpack to ")),
        "{said}"
    );
}
