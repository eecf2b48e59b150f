//! Runs side by side: none destroys another's log, none reports a log that is not its own.

use std::fs;
use std::path::Path;
use std::process::{Child, Command as Program, Stdio};
use std::time::{Duration, Instant};

use omni_log::read_log;

use super::{omnistep, refused, stdout};

fn start(folder: &Path, args: &[&str]) -> Child {
    Program::new(env!("CARGO_BIN_EXE_omnistep"))
        .current_dir(folder)
        .args(args)
        .arg("--quiet")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits until a file is there and has something in it.
fn until_there(path: &Path) {
    let begun = Instant::now();
    while fs::metadata(path).map_or(0, |file| file.len()) == 0 {
        assert!(
            begun.elapsed() < Duration::from_secs(120),
            "{path:?} does not come"
        );
        std::thread::sleep(Duration::from_millis(3));
    }
}

fn seed_and_friction(log: &Path) -> (u64, f64) {
    let file = read_log(log, |_, _| Ok(())).unwrap();
    assert!(file.complete);
    (file.scenario.seed, file.scenario.terrain.friction())
}

#[test]
fn runs_of_four_seeds_side_by_side_leave_four_whole_logs() {
    let folder = tempfile::tempdir().unwrap();
    // The file's own seed, 0, has the plain name.
    let named = |seed: u64| match seed {
        0 => "out/flat-traction.mcap".to_owned(),
        seed => format!("out/flat-traction-seed{seed}.mcap"),
    };
    let runs: Vec<_> = (0..4)
        .map(|seed: u64| {
            let seed = seed.to_string();
            start(
                folder.path(),
                &["run", "flat", "--seed", &seed, "--set", "duration_s=0.5"],
            )
        })
        .collect();
    for (seed, run) in runs.into_iter().enumerate() {
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success(), "{output:?}");
        assert!(
            stdout(&output).ends_with(&format!("\n{}\n", named(seed as u64))),
            "{output:?}"
        );
    }
    for seed in 0..4 {
        assert_eq!(seed_and_friction(&folder.path().join(named(seed))).0, seed);
    }
    assert_eq!(fs::read_dir(folder.path().join("out")).unwrap().count(), 4);
    // A seed given as a key, and of every policy of a comparison.
    let args = [
        "compare",
        "flat",
        "--quiet",
        "--set",
        "seed=7",
        "--set",
        "duration_s=0.05",
    ];
    let said = stdout(&omnistep(folder.path(), &args));
    assert!(said.ends_with("out/flat-traction-seed7.mcap\n"), "{said}");
}

#[test]
fn a_log_being_written_is_refused_and_a_killed_run_blocks_none() {
    let folder = tempfile::tempdir().unwrap();
    let long = ["run", "flat", "--set", "duration_s=3600"];
    let mut first = start(folder.path(), &long);
    until_there(&folder.path().join("out/flat-traction.mcap.part"));
    let short = ["run", "flat", "--quiet", "--set", "duration_s=0.1"];
    assert_eq!(
        refused(folder.path(), &short),
        "error: out/flat-traction.mcap: is being written by another run: wait for that one, or name another file or folder\n"
    );
    assert!(first.try_wait().unwrap().is_none(), "the first one goes on");
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(omnistep(folder.path(), &short).status.success());
    let log = folder.path().join("out/flat-traction.mcap");
    assert!(read_log(log, |_, _| Ok(())).unwrap().complete);
    assert_eq!(fs::read_dir(folder.path().join("out")).unwrap().count(), 1);
}

#[test]
fn of_runs_of_one_name_each_either_has_its_log_or_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..5 {
        let run = |friction: &f64| {
            let friction = format!("terrain.friction={friction}");
            start(
                folder.path(),
                &["run", "flat", "--set", "duration_s=0.1", "--set", &friction],
            )
        };
        let frictions = [0.5, 0.6, 0.7, 0.8];
        let runs: Vec<_> = frictions.iter().map(run).collect();
        let mut wrote = Vec::new();
        for (friction, run) in frictions.into_iter().zip(runs) {
            let output = run.wait_with_output().unwrap();
            match output.status.code() {
                Some(0) => wrote.push(friction),
                Some(2) => assert!(
                    String::from_utf8_lossy(&output.stderr).contains("is being written by another run"),
                    "{output:?}"
                ),
                _ => panic!("{output:?}"),
            }
        }
        let log = folder.path().join("out/flat-traction.mcap");
        let (_, friction) = seed_and_friction(&log);
        assert!(
            wrote.contains(&friction),
            "{friction} is there, {wrote:?} said so"
        );
        fs::remove_file(log).unwrap();
        assert_eq!(fs::read_dir(folder.path().join("out")).unwrap().count(), 0);
    }
}

#[test]
fn a_comparison_keeps_its_finished_logs_until_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mut comparison = start(folder.path(), &["compare", "flat", "--set", "duration_s=20"]);
    let first = folder.path().join("out/flat-independent.mcap");
    until_there(&first);
    let args = [
        "run",
        "flat",
        "--policy",
        "independent",
        "--set",
        "duration_s=0.1",
    ];
    let said = refused(folder.path(), &args);
    assert!(
        said.contains("out/flat-independent.mcap: is being written"),
        "{said}"
    );
    assert!(comparison.try_wait().unwrap().is_none(), "it goes on");
    comparison.kill().unwrap();
    comparison.wait().unwrap();
    assert!(omnistep(folder.path(), &args).status.success());
}
