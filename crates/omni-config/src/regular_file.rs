//! Opening of files: only regular ones, up to the size that their kind needs.

use std::fs::{self, File, FileType};
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Largest TOML file \[bytes\]: a scenario with an embedded picture of 4 million pixels has at most 11 million.
pub const MOST_TOML_BYTES: u64 = 16_000_000;
/// Largest PNG file \[bytes\]: far more than 4 million pixels of 16 bits need, compressed or not.
pub const MOST_PNG_BYTES: u64 = 64_000_000;

/// Opens a file for reading, if it is a regular one: a pipe would be waited for, a device has no end.
///
/// # Errors
/// The system's, or what it is instead, in a few words.
///
/// ```
/// let error = omni_config::open_regular(std::env::temp_dir()).unwrap_err();
/// assert_eq!(error.to_string(), "a directory, allowed: a regular file");
/// ```
pub fn open_regular(path: impl AsRef<Path>) -> Result<File> {
    // Before it is opened: to open a pipe waits for a writer.
    regular(fs::metadata(&path)?.file_type())?;
    let file = File::open(&path)?;
    // What is there now, whatever was there before.
    regular(file.metadata()?.file_type())?;
    Ok(file)
}

/// Refuses what is there by this name and is no regular file, or a link to such: a file that takes
/// its place would replace a device, or wait for who reads a pipe. A name that nothing has is fine.
///
/// # Errors
/// Its actual kind, in a few words.
///
/// ```
/// assert!(omni_config::check_replaceable(std::env::temp_dir().join("omnistep-that-is-not-there")).is_ok());
/// let error = omni_config::check_replaceable(std::env::temp_dir()).unwrap_err();
/// assert_eq!(error.to_string(), "a directory, allowed: a regular file");
/// ```
pub fn check_replaceable(path: impl AsRef<Path>) -> Result<()> {
    match fs::metadata(path) {
        Ok(there) => regular(there.file_type()),
        // A link to nothing, too: who writes the file says what else is wrong.
        Err(_) => Ok(()),
    }
}

/// The bytes of a regular file, if they are no more than `most`.
///
/// # Errors
/// As [`open_regular`], and how large it is instead.
///
/// ```
/// let path = std::env::temp_dir().join("omnistep-read-regular-example");
/// std::fs::write(&path, "12345")?;
/// assert_eq!(omni_config::read_regular(&path, 5)?, b"12345");
/// let error = omni_config::read_regular(&path, 4).unwrap_err();
/// assert_eq!(error.to_string(), "5 bytes, allowed: 4 at most");
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn read_regular(path: impl AsRef<Path>, most: u64) -> Result<Vec<u8>> {
    let file = open_regular(path)?;
    let too_large = |length: u64| {
        let message = format!("{length} bytes, allowed: {most} at most");
        Err(Error::new(ErrorKind::InvalidInput, message))
    };
    let length = file.metadata()?.len();
    if length > most {
        return too_large(length);
    }
    // Some regular files say that they are empty and are not, or grow.
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 {
        length if length > most => too_large(length),
        _ => Ok(bytes),
    }
}

fn regular(kind: FileType) -> Result<()> {
    if kind.is_file() {
        return Ok(());
    }
    let found = if kind.is_dir() {
        "a directory"
    } else {
        special(kind)
    };
    let message = format!("{found}, allowed: a regular file");
    Err(Error::new(ErrorKind::InvalidInput, message))
}

#[cfg(unix)]
fn special(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(not(unix))]
fn special(_: FileType) -> &'static str {
    "a device"
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn said(path: &str, most: u64) -> String {
        read_regular(path, most).expect_err("refused").to_string()
    }

    #[test]
    fn what_has_no_end_or_waits_is_not_opened() {
        assert_eq!(said("/dev/zero", 10), "a device, allowed: a regular file");
        assert_eq!(said("/", 10), "a directory, allowed: a regular file");
        let pipe = std::env::temp_dir().join(format!("omnistep-pipe-{}", std::process::id()));
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo is a program of every Unix").success());
        let replaced = check_replaceable(&pipe).expect_err("refused").to_string();
        assert_eq!(replaced, "a pipe, allowed: a regular file");
        // Nothing writes to it: opened, it would be waited for without end.
        let said = said(&pipe.display().to_string(), 10);
        fs::remove_file(&pipe).expect("removable");
        assert_eq!(said, "a pipe, allowed: a regular file");
    }

    #[cfg(target_os = "linux")] // no other system has such a file
    #[test]
    fn a_file_that_is_larger_than_it_says_is_read_no_further_than_allowed() {
        // Regular, of 0 bytes by its metadata, and not empty.
        let path = "/proc/self/status";
        assert_eq!(fs::metadata(path).map(|m| m.len()).ok(), Some(0));
        assert_eq!(said(path, 10), "11 bytes, allowed: 10 at most");
    }
}
