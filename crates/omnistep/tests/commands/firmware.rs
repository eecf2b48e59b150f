//! `omnistep run --controller qemu` where something is missing or not what it should be: one line, and no waiting.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use assert_cmd::Command;

/// Runs `omnistep run flat --controller qemu` in a folder that is the only place for programs, and
/// returns its exit code and the one line on standard error.
fn refused(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let output = Command::cargo_bin("omnistep")
        .unwrap()
        .current_dir(folder)
        .env("PATH", folder)
        .args(["run", "flat", "--controller", "qemu", "--quiet"])
        .args(args)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.stdout.is_empty(), "{args:?}");
    assert_eq!(said.lines().count(), 1, "{args:?}: {said}");
    (output.status.code(), said)
}

/// A folder with an image and an emulator that does as `script` says.
fn with_emulator(script: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("loop"), "an image").unwrap();
    let emulator = folder.path().join("qemu-system-arm");
    fs::write(&emulator, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&emulator, fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

#[test]
fn firmware_refuses_traction_control_without_a_drive() {
    let folder = tempfile::tempdir().unwrap();
    let (code, line) = refused(folder.path(), &["--policy", "traction"]);
    assert_eq!(code, Some(2));
    assert_eq!(
        line,
        "error: scenario flat: control.policy: \"traction\", allowed without [drive] for a controller at the other end of a link: \
         independent, scale_torques, scale_references, shared_integral\n"
    );
}

#[test]
fn a_missing_image_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let (code, line) = refused(folder.path(), &[]);
    assert_eq!(code, Some(2));
    assert_eq!(
        line,
        "error: firmware/target/thumbv7em-none-eabihf/release/loop: no such firmware image: build the \
         one in firmware/, or set another with --firmware FILE\n"
    );
}

#[test]
fn a_missing_emulator_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("loop"), "an image").unwrap();
    let (code, line) = refused(folder.path(), &["--firmware", "loop"]);
    assert_eq!(code, Some(2));
    assert_eq!(
        line,
        "error: loop: qemu-system-arm is not installed: install Debian's package of that name, or use --controller host\n"
    );
}

#[test]
fn an_image_that_ends_is_reported_with_the_emulators_words() {
    let folder = with_emulator("echo 'qemu: fatal: Lockup' >&2; echo more >&2; exit 3");
    let (code, line) = refused(folder.path(), &["--firmware", "loop"]);
    assert_eq!(code, Some(2));
    assert_eq!(
        line,
        "error: loop: the firmware has ended (qemu-system-arm: exit status: 3, qemu: fatal: Lockup)\n"
    );
}

#[test]
fn a_precision_that_firmware_lacks_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (code, line) = refused(folder.path(), &["--set", "control.precision=f64"]);
    assert_eq!(code, Some(2));
    assert_eq!(
        line,
        "error: control.precision = f64, allowed: f32 with --controller qemu\n"
    );
}

#[test]
fn an_endless_complaint_of_the_emulator_is_one_line() {
    let folder = with_emulator(
        "i=0; while [ $i -lt 100000 ]; do printf xxxxxxxxxxxxxxxxxxxx; i=$((i+1)); done >&2; exit 3",
    );
    let (code, line) = refused(folder.path(), &["--firmware", "loop"]);
    assert_eq!(code, Some(2));
    let start = "error: loop: the firmware has ended (qemu-system-arm: exit status: 3, xxxx";
    assert!(
        line.starts_with(start) && line.chars().count() <= 300,
        "{line:.400}"
    );
}
