use std::fs;

use mcap::read::Options;

use super::*;
use crate::ros2::{Header, StringMessage, Twist, TwistStamped, Vector3};

/// Ten messages per second, as incompressible as doubles are, for `seconds`, on two topics.
fn fill(log: &mut LogWriter, seconds: u64) -> Result<(), LogError> {
    log.metadata("run", BTreeMap::from([("seed".to_owned(), "7".to_owned())]))?;
    log.attachment("scenario.toml", "application/toml", b"seed = 7\n")?;
    let twist = log.channel::<TwistStamped>("/twist")?;
    let text = log.channel::<StringMessage>("/text")?;
    log.write(
        &text,
        0,
        &StringMessage {
            data: "x".repeat(3 * CHUNK_BYTES as usize / 2),
        },
    )?;
    for step in 0..10 * seconds {
        let time_ns = step * SECOND_NS / 10;
        let linear = Vector3 {
            x: (step as f64).sqrt(),
            y: 1.0 / (step as f64 + 1.0),
            z: 0.0,
        };
        let twist_now = Twist {
            linear,
            ..Twist::default()
        };
        log.write(
            &twist,
            time_ns,
            &TwistStamped {
                header: Header::new(time_ns, "base"),
                twist: twist_now,
            },
        )?;
    }
    Ok(())
}

/// Topic, sequence and log time of every message, in the order of a file that is `complete` or was cut off.
fn messages(bytes: &[u8], complete: bool) -> Vec<(String, u32, u64)> {
    let options = if complete {
        Default::default()
    } else {
        Options::IgnoreEndMagic.into()
    };
    mcap::MessageStream::new_with_options(bytes, options)
        .expect("an MCAP")
        .map_while(Result::ok)
        .map(|message| (message.channel.topic.clone(), message.sequence, message.log_time))
        .collect()
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(dir)
        .expect("readable")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

#[test]
fn the_same_messages_give_the_same_bytes() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut logs = Vec::new();
    for name in ["a.mcap", "b.mcap"] {
        let mut log = LogWriter::create(dir.path().join(name))?;
        fill(&mut log, 5)?;
        assert_eq!(log.finish()?.path(), dir.path().join(name));
        logs.push(fs::read(dir.path().join(name)).expect("readable"));
    }
    assert!(logs[0] == logs[1]);
    assert_eq!(names(dir.path()), ["a.mcap", "b.mcap"]);
    Ok(())
}

#[test]
fn every_message_comes_back_in_order_with_its_time() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut log = LogWriter::create(dir.path().join("a.mcap"))?;
    fill(&mut log, 2)?;
    let bytes = fs::read(log.finish()?.path()).expect("readable");
    let mut expected = vec![("/text".to_owned(), 0, 0)];
    expected.extend((0..20).map(|step| ("/twist".to_owned(), step, u64::from(step) * SECOND_NS / 10)));
    assert_eq!(messages(&bytes, true), expected);
    let summary = mcap::Summary::read(&bytes).expect("readable").expect("a summary");
    let stats = summary.stats.expect("statistics");
    assert_eq!(
        (stats.attachment_count, stats.metadata_count, stats.message_count),
        (1, 1, 21)
    );
    Ok(())
}

#[test]
fn an_abandoned_log_leaves_nothing() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut log = LogWriter::create(dir.path().join("a.mcap"))?;
    fill(&mut log, 3)?;
    assert_eq!(names(dir.path()), ["a.mcap.part"]);
    drop(log);
    assert!(names(dir.path()).is_empty());
    Ok(())
}

#[test]
fn a_killed_run_keeps_every_full_second() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut log = LogWriter::create(dir.path().join("a.mcap"))?;
    fill(&mut log, 3)?; // the last message is at 2.9 s
    std::mem::forget(log); // neither drop nor buffer, as when killed
    let bytes = fs::read(dir.path().join("a.mcap.part")).expect("readable");
    let kept = messages(&bytes, false);
    assert_eq!(kept.len(), 1 + 20);
    assert_eq!(kept.last().map(|last| last.2), Some(1_900_000_000));
    Ok(())
}

#[test]
fn a_panic_keeps_everything_under_the_part_name() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("a.mcap");
    let result = std::thread::spawn(move || {
        let mut log = LogWriter::create(path).expect("created");
        fill(&mut log, 1).expect("written");
        panic!("on purpose");
    })
    .join();
    assert!(result.is_err());
    assert_eq!(names(dir.path()), ["a.mcap.part"]);
    let bytes = fs::read(dir.path().join("a.mcap.part")).expect("readable");
    assert_eq!(messages(&bytes, true).len(), 11);
}

#[test]
fn an_unwritable_path_is_named() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("missing").join("a.mcap");
    let error = LogWriter::create(&path).expect_err("there is no such directory");
    assert!(matches!(error, LogError::Create { .. }));
    assert!(error.to_string().contains(&path.display().to_string()), "{error}");
}

#[test]
fn a_refused_name_leaves_the_complete_log() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("a.mcap");
    let mut log = LogWriter::create(&path)?;
    fill(&mut log, 1)?;
    fs::create_dir(&path).expect("created");
    let error = log.finish().expect_err("a directory has the name");
    assert!(
        matches!(error, LogError::Rename { .. }) && error.to_string().contains("a.mcap"),
        "{error}"
    );
    assert_eq!(names(dir.path()), ["a.mcap", "a.mcap.part"]);
    Ok(())
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_and_leaves_nothing() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let part = PartFile::create(&dir.path().join("a.mcap"))?;
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("a device");
    let mut log = LogWriter::over(part, full)?;
    let error = fill(&mut log, 1).expect_err("nothing can be written");
    assert!(
        matches!(error, LogError::Io { .. }) && error.to_string().contains("a.mcap"),
        "{error}"
    );
    assert!(fill(&mut log, 1).is_err());
    assert!(log.finish().is_err());
    assert!(names(dir.path()).is_empty());
    Ok(())
}

#[test]
fn a_topic_has_one_type_and_a_channel_one_log() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut log = LogWriter::create(dir.path().join("a.mcap"))?;
    let mut other = LogWriter::create(dir.path().join("b.mcap"))?;
    let channel = log.channel::<Twist>("/cmd_vel")?;
    other.channel::<Twist>("/cmd_vel")?;
    let again = log.channel::<Twist>("/cmd_vel")?;
    log.write(&channel, 0, &Twist::default())?;
    log.write(&again, 1, &Twist::default())?;
    let error = log.channel::<TwistStamped>("/cmd_vel").expect_err("two types");
    assert!(matches!(error, LogError::TopicType { .. }), "{error}");
    let error = other
        .write(&channel, 0, &Twist::default())
        .expect_err("another log");
    assert!(matches!(error, LogError::ForeignChannel { .. }), "{error}");
    Ok(())
}

#[test]
fn a_log_that_another_run_writes_is_refused_and_stays_that_run_s() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("a.mcap");
    let mut first = LogWriter::create(&path)?;
    fill(&mut first, 1)?;
    let refused = || {
        let error = LogWriter::create(&path).expect_err("it is being written");
        assert!(matches!(error, LogError::Busy { .. }), "{error}");
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    };
    refused();
    fill(&mut first, 1)?;
    let finished = first.finish()?;
    // The reporter of the log still holds it.
    refused();
    assert_eq!(
        messages(&fs::read(finished.path()).expect("readable"), true).len(),
        22
    );
    drop(finished);
    drop(LogWriter::create(&path)?);
    assert_eq!(names(dir.path()), ["a.mcap"]);
    Ok(())
}

#[test]
fn of_many_that_begin_at_once_over_a_killed_run_s_file_one_at_a_time_writes() {
    for _ in 0..50 {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("a.mcap");
        fs::write(dir.path().join("a.mcap.part"), "left by a killed run").expect("written");
        let barrier = std::sync::Barrier::new(4);
        let wrote: Vec<bool> = std::thread::scope(|scope| {
            let each = || {
                barrier.wait();
                match LogWriter::create(&path) {
                    Err(LogError::Busy { .. }) => false,
                    log => {
                        let mut log = log.expect("created or refused");
                        fill(&mut log, 1).expect("written");
                        // What it reports is there, whole, while it reports it.
                        let finished = log.finish().expect("finished");
                        let bytes = fs::read(finished.path()).expect("readable");
                        assert_eq!(messages(&bytes, true).len(), 11);
                        true
                    }
                }
            };
            let runs: Vec<_> = (0..4).map(|_| scope.spawn(each)).collect();
            runs.into_iter()
                .map(|run| run.join().expect("no panic"))
                .collect()
        });
        assert!(wrote.contains(&true), "one writer finishes");
        assert_eq!(names(dir.path()), ["a.mcap"]);
    }
}

#[test]
fn what_a_killed_run_left_is_replaced_and_another_name_of_it_is_not_touched() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let (part, other) = (dir.path().join("a.mcap.part"), dir.path().join("evidence"));
    fs::write(&part, "left by a killed run").expect("written");
    fs::hard_link(&part, &other).expect("linked");
    let mut log = LogWriter::create(dir.path().join("a.mcap"))?;
    fill(&mut log, 1)?;
    log.finish()?;
    assert_eq!(names(dir.path()), ["a.mcap", "evidence"]);
    assert_eq!(fs::read(&other).expect("readable"), b"left by a killed run");
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_link_at_the_part_s_name_is_refused_and_not_followed() {
    let dir = tempfile::tempdir().expect("a directory");
    let victim = dir.path().join("victim");
    fs::write(&victim, "precious").expect("written");
    for target in [&victim, &dir.path().join("not there")] {
        std::os::unix::fs::symlink(target, dir.path().join("a.mcap.part")).expect("linked");
        let error = LogWriter::create(dir.path().join("a.mcap")).expect_err("a link");
        assert!(
            matches!(error, LogError::Create { .. }) && error.to_string().contains("a link"),
            "{error}"
        );
        fs::remove_file(dir.path().join("a.mcap.part")).expect("the link is there still");
    }
    assert_eq!(fs::read(&victim).expect("readable"), b"precious");
    assert_eq!(names(dir.path()), ["victim"]);
}

#[cfg(unix)]
#[test]
fn a_log_whose_file_was_taken_away_is_an_error_and_what_stands_there_now_is_left() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let (path, part) = (dir.path().join("a.mcap"), dir.path().join("a.mcap.part"));
    for finish in [true, false] {
        let mut log = LogWriter::create(&path)?;
        fill(&mut log, 1)?;
        fs::remove_file(&part).expect("removed");
        fs::write(&part, "another file").expect("written");
        if finish {
            let error = log.finish().expect_err("it is not this log");
            assert!(matches!(error, LogError::Rename { .. }), "{error}");
        } else {
            drop(log);
        }
        assert_eq!(fs::read(&part).expect("readable"), b"another file");
        assert!(!path.exists());
        fs::remove_file(&part).expect("removed");
    }
    Ok(())
}

#[test]
fn a_stopped_run_s_log_has_every_message_until_then_and_is_not_whole() -> Result<(), LogError> {
    let dir = tempfile::tempdir().expect("a directory");
    let mut log = LogWriter::create(dir.path().join("a.mcap"))?;
    fill(&mut log, 3)?;
    let part = log.leave()?;
    assert_eq!(part, dir.path().join("a.mcap.part"));
    let bytes = fs::read(&part).expect("readable");
    assert!(!bytes.ends_with(mcap::MAGIC));
    assert_eq!(messages(&bytes, false).len(), 1 + 30);
    drop(LogWriter::create(dir.path().join("a.mcap"))?); // and blocks none
    Ok(())
}
