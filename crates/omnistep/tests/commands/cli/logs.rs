//! Logs: crashes, full disks, flipped bits, replays.

use std::fs;
use std::path::Path;
use std::process::{Command as Program, Output, Stdio};
use std::time::{Duration, Instant};

use omni_config::Scenario;
use omni_log::Error;
use omni_log::ros2::{RosMessage, Sensors, VehicleState, WheelState};
use omni_log::{LogFile, LogMessage, LogWriter, read_log, topic};

use super::{omnistep, refused, rows, stdout};

/// A run of the step of so many seconds, in the folder, by the command line.
pub(crate) fn logged(folder: &Path, duration_s: f64) -> std::path::PathBuf {
    let duration = format!("duration_s={duration_s}");
    let output = omnistep(folder, &["run", "step", "--quiet", "--set", &duration]);
    assert!(output.status.success(), "{output:?}");
    folder.join("out/step-traction.mcap")
}

/// The same messages in a log of another name, its vehicle states and its scenario changed on the way.
pub(crate) fn copied(
    from: &Path,
    to: &Path,
    mut change: impl FnMut(u64, &mut Sensors),
    scenario: impl Fn(String) -> String,
) {
    fn send<M: RosMessage>(
        writer: &mut LogWriter,
        topic: &str,
        time_ns: u64,
        message: &M,
    ) -> Result<(), Error> {
        let channel = writer.channel::<M>(topic)?;
        Ok(writer.write(&channel, time_ns, message)?)
    }
    let mut writer = LogWriter::create(to).unwrap();
    let file = read_log(from, |time_ns, message| match message {
        LogMessage::VehicleState(state) => send(&mut writer, topic::VEHICLE_STATE, time_ns, &state),
        LogMessage::Sensors(mut sensed) => {
            change(time_ns, &mut sensed);
            send(&mut writer, topic::SENSORS, time_ns, &sensed)
        }
        LogMessage::Odom(odom) => send(&mut writer, topic::ODOM, time_ns, &*odom),
        _ => Ok(()),
    })
    .unwrap();
    let text = scenario(toml::to_string(&file.scenario).unwrap());
    writer
        .attachment("scenario.toml", "application/toml", text.as_bytes())
        .unwrap();
    writer.metadata("run", file.run).unwrap();
    writer.finish().unwrap();
}

#[test]
fn a_replay_is_bit_identical_for_every_policy_and_precision() {
    let folder = tempfile::tempdir().unwrap();
    for policy in [
        "independent",
        "scale_torques",
        "scale_references",
        "shared_integral",
    ] {
        for more in [
            "control.precision=f32",
            "heading_hold={gain_per_s = 2.0, limit_rad_s = 0.5}",
        ] {
            let args = [
                "run",
                "half_step",
                "--quiet",
                "--policy",
                policy,
                "--set",
                "duration_s=2.5",
                "--set",
                more,
            ];
            let output = omnistep(folder.path(), &args);
            assert!(output.status.success(), "{output:?}");
            let log = format!("out/half_step-{policy}.mcap");
            let said = stdout(&omnistep(folder.path(), &["replay", &log]));
            assert_eq!(
                said,
                format!("{log}: policy {policy}: 2500 control periods, bit-identical\n"),
                "{more}"
            );
        }
    }
}

#[test]
fn a_replay_names_the_first_sample_and_wheel_that_differ() {
    let folder = tempfile::tempdir().unwrap();
    // Loops of single wheels: a gain is in the first of their signals.
    let args = [
        "run",
        "step",
        "--quiet",
        "--policy",
        "scale_references",
        "--set",
        "duration_s=0.5",
    ];
    assert!(omnistep(folder.path(), &args).status.success());
    let log = folder.path().join("out/step-scale_references.mcap");
    let replay = |name: &str| stdout(&omnistep(folder.path(), &["replay", name]));

    // The least bit of one reading of one wheel: the log's own signals follow from another one.
    copied(
        &log,
        &folder.path().join("measured.mcap"),
        |time_ns, sensed| {
            if time_ns == 300_000_000 {
                sensed.wheels_rad_s[4] = sensed.wheels_rad_s[4].next_up();
            }
        },
        |text| text,
    );
    let said = replay("measured.mcap");
    assert!(
        said.contains("first at t = 0.3 s (period 299): wheel 5, measured_rad_s: logged "),
        "{said}"
    );

    // A gain of 0.3 N.m.s/rad made 0.301: wheel 1 is the first of all, as soon as there is an error to multiply.
    copied(
        &log,
        &folder.path().join("gain.mcap"),
        |_, _| (),
        |text| {
            assert!(text.contains("kp_n_m_s_rad = 0.3\n"), "{text}");
            text.replace("kp_n_m_s_rad = 0.3\n", "kp_n_m_s_rad = 0.301\n")
        },
    );
    let said = replay("gain.mcap");
    assert!(said.contains("499 of 500 control periods differ"), "{said}");
    assert!(
        said.contains("first at t = 0.002 s (period 1): wheel 1, p_n_m: "),
        "{said}"
    );
    // And back again by a key.
    let back = ["replay", "gain.mcap", "--set", "vehicle.gains.kp_n_m_s_rad=0.3"];
    let said = stdout(&omnistep(folder.path(), &back));
    assert!(said.contains("500 control periods, bit-identical"), "{said}");
}

#[test]
fn another_policy_is_shown_wheel_by_wheel() {
    let folder = tempfile::tempdir().unwrap();
    logged(folder.path(), 2.0);
    let args = ["replay", "out/step-traction.mcap", "--policy", "independent"];
    let said = stdout(&omnistep(folder.path(), &args));
    assert!(said.contains("policy independent: "), "{said}");
    assert_eq!(
        said.lines().filter(|line| line.starts_with("| ")).count(),
        1 + 7,
        "{said}"
    );
}

#[test]
fn a_log_without_every_period_is_not_replayed() {
    let folder = tempfile::tempdir().unwrap();
    for (rate, first_missing) in [("100", "0.002"), ("0.1", "0.002"), ("0", "0.001")] {
        let rates = format!("log={{vehicle_state_hz = {rate}, markers_hz = 0}}");
        let args = [
            "run",
            "flat",
            "--quiet",
            "--set",
            "duration_s=0.5",
            "--set",
            &rates,
        ];
        assert!(omnistep(folder.path(), &args).status.success());
        let said = refused(folder.path(), &["replay", "out/flat-traction.mcap"]);
        assert!(
            said.contains(&format!("no /vehicle_state at t = {first_missing} s")),
            "{said}"
        );
        assert!(said.contains("run it without log.vehicle_state_hz"), "{said}");
    }
    let rates = ["--set", "log={vehicle_state_hz = 100, markers_hz = 0}"];
    let args = [&["run", "flat", "--quiet", "--set", "duration_s=0.5"][..], &rates].concat();
    assert!(omnistep(folder.path(), &args).status.success());
    let shown = rows(&omnistep(
        folder.path(),
        &["info", "--json", "out/flat-traction.mcap"],
    ));
    let counts = &shown[0]["messages"];
    assert_eq!(
        (counts["/vehicle_state"].as_u64(), counts.get("/markers")),
        (Some(51), None)
    );
}

/// A log of states, each of as many wheels as `wheels` says, whose scenario comes before or behind them.
fn of_wheels(path: &Path, scenario_first: bool, wheels: impl IntoIterator<Item = usize>) {
    let scenario = Scenario::load("flat", &[]).unwrap().to_toml().unwrap();
    let mut writer = LogWriter::create(path).unwrap();
    let attach = |writer: &mut LogWriter| {
        writer
            .attachment("scenario.toml", "application/toml", scenario.as_bytes())
            .unwrap();
    };
    if scenario_first {
        attach(&mut writer);
    }
    let channel = writer.channel::<VehicleState>(topic::VEHICLE_STATE).unwrap();
    for (k, count) in (1..).zip(wheels) {
        let mut state = VehicleState::default();
        state.wheels = vec![WheelState::default(); count];
        writer.write(&channel, 1_000_000 * k, &state).unwrap();
    }
    if !scenario_first {
        attach(&mut writer);
    }
    writer.finish().unwrap();
}

#[test]
fn a_state_with_another_number_of_wheels_is_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let damaged = |found: usize, expected: usize| {
        format!(
            "error: x.mcap: damaged: /vehicle_state: a message with {found} wheels, expected {expected}\n"
        )
    };
    for scenario_first in [true, false] {
        of_wheels(&path, scenario_first, [7; 3]);
        assert!(omnistep(folder.path(), &["info", "x.mcap"]).status.success());
        for (wheels, found) in [([0; 3], 0), ([8; 3], 8), ([7, 7, 6], 6)] {
            of_wheels(&path, scenario_first, wheels);
            let output = omnistep(folder.path(), &["info", "x.mcap"]);
            assert_eq!(output.status.code(), Some(1), "{output:?}");
            assert_eq!(String::from_utf8(output.stderr).unwrap(), damaged(found, 7));
        }
    }
    // Nothing of it is handed on: columns of NaN would be 7 times as large as the states.
    of_wheels(&path, true, [0; 10_000]);
    let mut handed = 0;
    let read = read_log(&path, |_, _| {
        handed += 1;
        Ok(())
    });
    assert!(read.is_err() && handed == 0, "{handed}");
    assert!(omni_log::LoggedRun::read(&path).is_err());
}

/// The emptiest log there is: nothing falls, nothing is asked for, so that chunk after chunk says
/// the same and takes a twentieth of its size.
#[test]
fn the_emptiest_log_of_our_own_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let floating = [
        "vehicle=omni3",
        "physics.gravity_m_s2=0",
        "command.vx_m_s=0",
        "control.policy=independent",
        "duration_s=60",
    ];
    let set = floating.iter().flat_map(|key| ["--set", key]);
    let args: Vec<_> = ["run", "flat", "--quiet"].into_iter().chain(set).collect();
    let output = omnistep(folder.path(), &args);
    assert!(output.status.success(), "{output:?}");
    let log = folder.path().join("out/flat-independent.mcap");
    let (file, times) = states(&log);
    assert!(file.complete && times.len() == 60_000);
    // 55 MB of messages.
    assert!(fs::metadata(&log).unwrap().len() < 4_000_000);
}

/// Places of the records of a log outside its chunks.
fn records(bytes: &[u8]) -> Vec<usize> {
    let (mut at, mut places) = (8, Vec::new());
    while at + 9 < bytes.len() {
        places.push(at);
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    places
}

#[test]
fn a_chunk_hidden_by_a_flipped_bit_is_missed_when_unfinished() {
    let folder = tempfile::tempdir().unwrap();
    let log = logged(folder.path(), 1.5);
    let good = fs::read(&log).unwrap();
    let places = records(&good);
    let chunks: Vec<_> = places.iter().copied().filter(|at| good[*at] == 0x06).collect();
    assert!(chunks.len() >= 3, "several chunks");
    // Cut behind the last chunk but one: no summary, and no checksum over all.
    let cut = &good[..chunks[chunks.len() - 1]];
    fs::write(folder.path().join("x.mcap.part"), cut).unwrap();
    assert!(omnistep(folder.path(), &["info", "x.mcap.part"]).status.success());
    // The last one may be lost, as it may in a crash.
    for at in &chunks[..chunks.len() - 2] {
        for bit in [0x01, 0x04, 0x80] {
            let mut bad = cut.to_vec();
            bad[*at] ^= bit;
            fs::write(folder.path().join("x.mcap.part"), bad).unwrap();
            let output = omnistep(folder.path(), &["info", "x.mcap.part"]);
            assert_eq!(
                output.status.code(),
                Some(1),
                "byte {at}, bit {bit:#x}: {output:?}"
            );
        }
    }
}

#[test]
fn statistics_miss_what_a_log_without_checksums_lost() {
    let folder = tempfile::tempdir().unwrap();
    let mut good = fs::read(logged(folder.path(), 1.5)).unwrap();
    let places = records(&good);
    // Without the checksums of the data and of the summary, as the format allows: 0. Chunks keep theirs.
    for at in &places {
        match good[*at] {
            0x0f => good[at + 9..at + 13].fill(0),
            0x02 => good[at + 25..at + 29].fill(0),
            _ => {}
        }
    }
    let info = |bytes: &[u8]| {
        fs::write(folder.path().join("x.mcap"), bytes).unwrap();
        omnistep(folder.path(), &["info", "x.mcap"])
    };
    assert!(info(&good).status.success());
    let without = |taken: &dyn Fn(usize) -> bool| {
        let mut left = good[..8].to_vec();
        let ends = places.iter().skip(1).copied().chain([good.len()]);
        for (at, end) in places.iter().copied().zip(ends).filter(|(at, _)| !taken(*at)) {
            left.extend_from_slice(&good[at..end]);
        }
        info(&left)
    };
    let chunks: Vec<_> = places.iter().copied().filter(|at| good[*at] == 0x06).collect();
    let mut cuts: Vec<(String, Output)> = Vec::new();
    for k in 0..chunks.len() {
        cuts.push((format!("chunk {k}"), without(&|at| at == chunks[k])));
        cuts.push((
            format!("chunks from {k}"),
            without(&|at| chunks[k..].contains(&at)),
        ));
    }
    // Its metrics, and the statistics themselves.
    let tables: Vec<_> = places.iter().copied().filter(|at| good[*at] == 0x0c).collect();
    assert_eq!(tables.len(), 2);
    cuts.push(("outcome".into(), without(&|at| at == tables[1])));
    cuts.push(("statistics".into(), without(&|at| good[at] == 0x0b)));
    for (what, output) in &cuts {
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{what}: {output:?}");
        assert!(said.starts_with("error: x.mcap: damaged: "), "{what}: {said}");
    }
    let said = |k: usize| String::from_utf8_lossy(&cuts[k].1.stderr).into_owned();
    assert!(
        said(2 * chunks.len() - 1).contains(" messages, but its statistics count "),
        "{}",
        said(2 * chunks.len() - 1)
    );
    assert!(
        said(cuts.len() - 2).contains("1 metadata records, but its statistics count 2"),
        "{}",
        said(cuts.len() - 2)
    );
    assert!(
        said(cuts.len() - 1).contains("no statistics"),
        "{}",
        said(cuts.len() - 1)
    );
}

#[test]
fn a_flipped_bit_anywhere_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let log = logged(folder.path(), 0.3);
    let good = fs::read(&log).unwrap();
    let info = |bytes: &[u8]| {
        fs::write(folder.path().join("x.mcap"), bytes).unwrap();
        omnistep(folder.path(), &["info", "x.mcap"])
    };
    assert!(info(&good).status.success());
    // A chunk in the middle, the summary near the end, and some hundred places in between: records of every kind.
    // And the length of the first record, which then reaches beyond the end, and every byte of the footer and the end.
    let places = [good.len() / 2, good.len() - 200].into_iter().chain(9..17);
    let places = places.chain(good.len() - 37..good.len());
    for at in places.chain((0..good.len()).step_by(good.len() / 97)) {
        let mut bad = good.clone();
        bad[at] ^= 1 << (at % 8);
        let output = info(&bad);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            matches!(output.status.code(), Some(1 | 2)),
            "byte {at} of {}: {said}",
            good.len()
        );
        assert!(
            said.starts_with("error: x.mcap: ") && said.lines().count() == 1,
            "{said}"
        );
    }
}

/// A log read to its end: its facts and the times of its vehicle states \[ns\].
fn states(path: &Path) -> (LogFile, Vec<u64>) {
    let mut times = Vec::new();
    let file = read_log(path, |time_ns, message| {
        if let LogMessage::VehicleState(_) = message {
            times.push(time_ns);
        }
        Ok(())
    });
    (file.unwrap(), times)
}

#[test]
fn a_killed_run_leaves_all_but_its_last_second() {
    let folder = tempfile::tempdir().unwrap();
    // Bytes of 6 s; parts of it are more or less busy.
    let whole_log = fs::metadata(logged(folder.path(), 6.0)).unwrap().len();
    let part = folder.path().join("out/step-traction.mcap.part");
    // Whatever the moment: three runs, killed after their file has grown to some size.
    for bytes in [1_000_000, 1_300_000, 2_400_000] {
        let mut run = Program::new(env!("CARGO_BIN_EXE_omnistep"))
            .current_dir(folder.path())
            .args(["run", "step", "--quiet", "--set", "duration_s=3600"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        let seen_bytes = loop {
            let length = fs::metadata(&part).map_or(0, |file| file.len());
            if length >= bytes {
                break length;
            }
            assert!(start.elapsed() < Duration::from_secs(120), "the log grows");
            std::thread::sleep(Duration::from_millis(3));
        };
        run.kill().unwrap(); // SIGKILL
        run.wait().unwrap();
        let (file, times) = states(&part);
        assert!(!file.complete && file.outcome.is_none());
        let whole: Vec<u64> = (1..=times.len() as u64).map(|k| k * 1_000_000).collect();
        assert_eq!(times, whole, "every period until the end");
        // The whole run's log had this many periods when its file was as long as it was seen to be,
        // less the second that may be lost.
        let written = seen_bytes as f64;
        let periods = written / whole_log as f64 * 6000.0;
        assert!(
            times.len() as f64 >= 0.8 * periods - 1000.0,
            "{} periods of {periods}",
            times.len()
        );
        assert_eq!(file.scenario, {
            let longer = omni_config::Override::new("duration_s", 3600.0);
            Scenario::load("step", &[longer]).unwrap()
        });
        fs::remove_file(&part).unwrap();
    }
}

#[test]
fn what_is_no_log_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("x.mcap"), "hello").unwrap();
    assert_eq!(
        refused(folder.path(), &["info", "x.mcap"]),
        "error: x.mcap: not an MCAP file, or an empty one\n"
    );
    assert!(refused(folder.path(), &["replay", "y.mcap"]).starts_with("error: y.mcap: "));
}
