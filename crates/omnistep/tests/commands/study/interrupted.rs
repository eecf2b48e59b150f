//! Ctrl-C, and a folder that is taken.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::*;

fn start(folder: &Path) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_omnistep"));
    command
        .current_dir(folder)
        .args(["study", "small.toml", "--quiet", "--jobs", "2"]);
    command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn kill(child: &Child, signal: &str) {
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
}

/// The keys that the parts hold.
fn done(folder: &Path, plan: &Plan) -> BTreeSet<String> {
    let found = Store::new(folder.join("out/small"), plan)
        .unwrap()
        .read()
        .unwrap();
    assert!(found.damaged.is_empty());
    found.keys().map(str::to_owned).collect()
}

#[test]
fn ctrl_c_loses_nothing_and_the_same_command_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    // 240 runs of some 25 ms, two at a time: long enough to be interrupted in the middle.
    let text = SMALL
        .replace("duration_s = 0.01", "duration_s = 0.2")
        .replace("seeds = 4", "seeds = 40");
    let plan = plan_of(&text);
    fs::write(folder.path().join("small.toml"), &text).unwrap();
    let mut child = start(folder.path());
    let begun = Instant::now();
    while !folder.path().join("out/small/.lock").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "it does not start");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(1000));
    let asked = Instant::now();
    kill(&child, "-INT");
    let status = child.wait().unwrap();
    // Runs under way are given up within a control period: this is for a loaded machine.
    assert!(asked.elapsed() < Duration::from_secs(5), "{:?}", asked.elapsed());
    assert_eq!(status.code(), Some(130));
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    let before = done(folder.path(), &plan);
    assert!((1..240).contains(&before.len()), "{} of 240 runs", before.len());
    let expected = format!(
        "stopped: {} of 240 runs are done and kept in out/small; run the same command again to continue\n",
        before.len()
    );
    assert_eq!(said, expected);
    let old = parts(&folder.path().join("out/small"));
    let bytes: Vec<_> = old.iter().map(|path| fs::read(path).unwrap()).collect();

    let output = start(folder.path()).wait_with_output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains(&format!("240 runs, {} of them done before; ", before.len())),
        "{said}"
    );
    assert_eq!(done(folder.path(), &plan).len(), 240);
    let same: Vec<_> = old.iter().map(|path| fs::read(path).unwrap()).collect();
    assert!(same == bytes, "what was done is not touched");
    let new: usize = parts(&folder.path().join("out/small")).len() - old.len();
    assert!(new >= 1);
}

#[test]
fn a_study_that_is_killed_loses_no_row_that_was_done() {
    let folder = tempfile::tempdir().unwrap();
    let text = SMALL
        .replace("duration_s = 0.01", "duration_s = 0.2")
        .replace("seeds = 4", "seeds = 40");
    let plan = plan_of(&text);
    fs::write(folder.path().join("small.toml"), &text).unwrap();
    let mut child = start(folder.path());
    let begun = Instant::now();
    let mut seen = BTreeSet::new();
    while seen.len() < 10 {
        assert!(begun.elapsed() < Duration::from_secs(60), "it does not start");
        seen = done(folder.path(), &plan);
    }
    kill(&child, "-KILL");
    child.wait().unwrap();
    let kept = done(folder.path(), &plan);
    assert!(
        kept.is_superset(&seen) && kept.len() < 240,
        "{} of {}",
        kept.len(),
        seen.len()
    );
    let output = start(folder.path()).wait_with_output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains(&format!("240 runs, {} of them done before; ", kept.len())),
        "{said}"
    );
    assert_eq!(done(folder.path(), &plan).len(), 240);
    let names = fs::read_dir(folder.path().join("out/small")).unwrap();
    let whole = names
        .map(|entry| entry.unwrap().path())
        .all(|path| path.extension().is_none_or(|ending| ending != "growing"));
    assert!(whole, "what it left is a part like others");
}

#[test]
fn two_studies_do_not_share_a_folder_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan_of(SMALL);
    let store = Store::new(folder.path().join("out/small"), &plan).unwrap();
    let lock = store.lock().unwrap();
    fs::write(folder.path().join("small.toml"), SMALL).unwrap();
    let output = start(folder.path()).wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("out/small: another program is writing to it: wait until that one ends"),
        "{said}"
    );
    drop(lock);
    assert!(start(folder.path()).wait_with_output().unwrap().status.success());
}
