//! Runs that a signal or a quota ends, and folders whose names are no text.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::{Command as Program, Output, Stdio};
use std::time::{Duration, Instant};

use omni_log::{LogMessage, read_log};

/// Starts a program, sends a signal when what is waited for is there, and waits for its end. What
/// it says on standard error is in the file `said` of the folder meanwhile.
fn signalled(folder: &Path, args: &[&str], signal: &str, ready: impl Fn() -> bool) -> Output {
    let said = folder.join("said");
    let mut run = Program::new(env!("CARGO_BIN_EXE_omnistep"))
        .current_dir(folder)
        .args(args)
        .stdout(Stdio::piped())
        .stderr(fs::File::create(&said).unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !ready() {
        assert!(run.try_wait().unwrap().is_none(), "it goes on: {args:?}");
        assert!(begun.elapsed() < Duration::from_secs(120), "{args:?}");
        std::thread::sleep(Duration::from_millis(3));
    }
    let killed = Program::new("kill")
        .args([signal, &run.id().to_string()])
        .status();
    assert!(killed.unwrap().success());
    let output = run.wait_with_output().unwrap();
    Output {
        stderr: fs::read(said).unwrap(),
        ..output
    }
}

#[test]
fn ctrl_c_and_sigterm_end_a_run_and_name_its_log_until_then() {
    let folder = tempfile::tempdir().unwrap();
    for (args, policy, signal, code) in [
        (&["run", "--quiet"][..], "traction", "-INT", 130),
        (&["run", "--json"], "traction", "-TERM", 143),
        (&["compare"], "independent", "-INT", 130),
    ] {
        let part = format!("out/step-{policy}.mcap.part");
        let log = folder.path().join(&part);
        let args = [args, &["step", "--set", "duration_s=3600"]].concat();
        let grown = || fs::metadata(&log).map_or(0, |file| file.len()) >= 1_000_000;
        let output = signalled(folder.path(), &args, signal, grown);
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        assert!(output.stdout.is_empty(), "{output:?}");
        let mut times = Vec::new();
        let file = read_log(folder.path().join(&part), |time_ns, message| {
            if let LogMessage::VehicleState(_) = message {
                times.push(time_ns);
            }
            Ok(())
        })
        .unwrap();
        assert!(!file.complete && file.outcome.is_none());
        let every: Vec<u64> = (1..=times.len() as u64).map(|k| k * 1_000_000).collect();
        assert_eq!(times, every, "every period until then");
        // As the program has it: 2005 periods / 1e3 are rounded down, 2005e6 ns * 1e-9 up.
        let end_s = times.len() as f64 * 1e6 * 1e-9;
        assert_eq!(
            String::from_utf8(output.stderr).unwrap(),
            format!("stopped: the run ended at {end_s:.2} s of 3600 s; its log until then is {part}\n")
        );
        fs::remove_file(folder.path().join(part)).unwrap();
    }
}

#[test]
#[cfg(feature = "live")]
fn ctrl_c_ends_a_live_run_with_one_line_also_while_it_waits() {
    let folder = tempfile::tempdir().unwrap();
    let said = || fs::read_to_string(folder.path().join("said")).unwrap_or_default();
    for more in [
        &["--real-time-factor", "10"][..],
        &["--wait"],
        &["--real-time-factor", "0.001"],
    ] {
        let args = [
            &["run", "flat", "--live", "--port", "0", "--set", "duration_s=3600"],
            more,
        ]
        .concat();
        let begun = Instant::now();
        let output = signalled(folder.path(), &args, "-INT", || said().contains("serving ws://"));
        assert_eq!(output.status.code(), Some(130), "{more:?}: {output:?}");
        assert!(begun.elapsed() < Duration::from_secs(60));
        let said = said();
        let last = said.lines().last().unwrap_or_default();
        assert!(
            last.starts_with("stopped: the run ended at ") && last.ends_with(" s of 3600 s"),
            "{said}"
        );
        // Where it is, and how it ended; the signal may come before or after the line on what is waited for.
        let lines = said
            .lines()
            .filter(|line| *line != "waiting for the first subscriber");
        assert_eq!(lines.count(), 2, "{said}");
    }
}

#[test]
#[cfg(feature = "live")]
fn a_live_run_is_warned_of_as_any_other() {
    let folder = tempfile::tempdir().unwrap();
    let set = [
        "--quiet",
        "--set",
        "duration_s=0.5",
        "--set",
        "sensors.encoder_counts=64",
    ];
    let warned = |more: &[&str]| {
        let output = super::omnistep(
            folder.path(),
            &[&["run", "step", "--policy", "scale_references"], more, &set].concat(),
        );
        let said = String::from_utf8(output.stderr).unwrap();
        let lines = said.lines().filter(|line| line.starts_with("warning: "));
        lines.map(String::from).collect::<Vec<_>>()
    };
    let live = warned(&["--live", "--port", "0", "--real-time-factor", "inf"]);
    assert_eq!(live, warned(&[]));
    assert_eq!(live.len(), 2, "{live:?}");
}

#[test]
fn ctrl_c_in_compare_keeps_the_table_of_finished_policies() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("out/step-scale_references.mcap.part");
    let args = ["compare", "step", "--quiet", "--set", "duration_s=4"];
    let output = signalled(folder.path(), &args, "-INT", || part.exists());
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let shown = String::from_utf8(output.stdout).unwrap();
    for done in ["independent", "scale_torques"] {
        assert!(shown.contains(&format!(" {done} |")), "{shown}");
        assert!(shown.contains(&format!("out/step-{done}.mcap\n")), "{shown}");
    }
    assert!(!shown.contains("scale_references"), "{shown}");
    let said = fs::read_to_string(folder.path().join("said")).unwrap();
    assert!(
        said.starts_with("stopped: the run ended at ")
            && said.ends_with("out/step-scale_references.mcap.part\n"),
        "{said}"
    );
}

/// Runs a line of `bash` in a folder.
fn bash(folder: &Path, line: &str) -> (Option<i32>, String) {
    let line = line.replace("omnistep", env!("CARGO_BIN_EXE_omnistep"));
    let output = Program::new("bash")
        .current_dir(folder)
        .args(["-c", &line])
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_quota_is_one_line_and_leaves_no_half_log() {
    let folder = tempfile::tempdir().unwrap();
    // The system refuses the write that would make a file larger than 400 KiB, and sends SIGXFSZ,
    // which ends a process that does not handle it.
    let (code, said) = bash(folder.path(), "ulimit -f 400; exec omnistep run step --quiet");
    assert_eq!(code, Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(
        said.contains("out/step-traction.mcap: ") && said.contains("too large"),
        "{said}"
    );
    assert_eq!(
        fs::read_dir(folder.path().join("out")).unwrap().count(),
        0,
        "no half log"
    );

    let line = "ulimit -f 1; exec omnistep study ensemble --quiet --jobs 1 --seeds 1 --set duration_s=0.05";
    let (code, said) = bash(folder.path(), line);
    assert_eq!(code, Some(2), "{said}");
    // Besides the warning that 0.05 s are too short.
    let said: String = said
        .lines()
        .filter(|line| !line.starts_with("warning: "))
        .collect();
    assert_eq!(said.matches("error: ").count(), 1, "{said}");
    assert!(
        said.contains("out/ensemble/part-") && said.contains("too large"),
        "{said}"
    );
    let left = fs::read_dir(folder.path().join("out/ensemble")).unwrap();
    let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, [".lock"], "no half part");
}

#[test]
#[cfg(target_os = "linux")]
fn a_folder_without_utf_8_name_is_written_to_but_not_in_json() {
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        Program::new(env!("CARGO_BIN_EXE_omnistep"))
            .current_dir(folder.path())
            .args(["run", "flat", "--quiet", "--set", "duration_s=0.1", "--out"])
            .arg(OsStr::from_bytes(b"b\xff"))
            .args(more)
            .output()
            .unwrap()
    };
    let refused = run(&["--json"]);
    assert_eq!((refused.status.code(), refused.stdout.len()), (Some(2), 0));
    assert_eq!(
        String::from_utf8(refused.stderr).unwrap(),
        "error: --out = \"b\\xFF\", allowed: with --json, a folder whose name is UTF-8\n"
    );
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        0,
        "before anything is written"
    );

    let done = run(&[]);
    assert!(done.status.success(), "{done:?}");
    assert!(done.stdout.ends_with(b"\nb\xff/flat-traction.mcap\n"), "{done:?}");
    let log = folder.path().join(OsStr::from_bytes(b"b\xff/flat-traction.mcap"));
    assert!(read_log(log, |_, _| Ok(())).unwrap().complete);
}
