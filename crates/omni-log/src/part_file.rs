//! The unfinished file of a log: locked, and created anew, so that no link is followed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use omni_config::check_replaceable;

use crate::LogError;

/// Times that another program may be faster between two looks at the same name; each of them has it then.
const TRIES: usize = 100;

/// A log that has its name. As long as this exists, no run receives that name, so that reports of the log refer to this
/// log.
#[derive(Debug)]
pub struct FinishedLog {
    path: PathBuf,
    /// Holds the lock.
    _file: File,
}

impl FinishedLog {
    /// The log's name.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Destination of a log: a file that receives its name when complete, or memory.
pub trait Place {
    /// Receiver of the bytes.
    type Sink: Write;

    /// Name of the log in messages.
    fn path(&self) -> &Path;

    /// The operating system's message, with the log's name.
    fn io_error(&self, source: io::Error) -> LogError {
        let path = self.path().to_path_buf();
        LogError::Io { path, source }
    }
}

/// The unfinished file, removed on drop unless it is to be kept.
///
/// Every change of what the name `*.part` stands for is made by the program that holds the lock of
/// the file it stood for.
#[derive(Debug)]
pub struct PartFile {
    part: PathBuf,
    path: PathBuf,
    /// Holds the lock.
    file: File,
    keep: bool,
}

impl PartFile {
    /// Makes `<path>.part`, in place of one that a killed run has left.
    pub(crate) fn create(path: &Path) -> Result<Self, LogError> {
        let mut part = path.as_os_str().to_owned();
        part.push(".part");
        let (part, path) = (PathBuf::from(part), path.to_owned());
        // Found now, not when the finished log is to take its name; a device would be replaced then.
        if let Err(source) = check_replaceable(&path) {
            return Err(LogError::Create { path, source });
        }
        let failed = |source| LogError::Create {
            path: part.clone(),
            source,
        };
        if is_held(&path) {
            return Err(LogError::Busy { path });
        }
        for _ in 0..TRIES {
            match OpenOptions::new().write(true).create_new(true).open(&part) {
                Ok(file) => {
                    // Not every file system has locks. Who is faster holds it already, as one that
                    // a killed run has left.
                    let locked = !matches!(file.try_lock(), Err(TryLockError::WouldBlock));
                    if locked && is_at(&file, &part).map_err(failed)? {
                        return Ok(Self {
                            part,
                            path,
                            file,
                            keep: false,
                        });
                    }
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => match remove_left(&part) {
                    Ok(()) => {}
                    Err(Left::Busy) => return Err(LogError::Busy { path }),
                    Err(Left::Failed(source)) => return Err(failed(source)),
                },
                Err(error) => return Err(failed(error)),
            }
        }
        Err(LogError::Busy { path })
    }

    /// The file, to write to.
    pub(crate) fn writer(&self) -> Result<File, LogError> {
        self.file.try_clone().map_err(|source| self.io_error(source))
    }

    /// Lets the file stay as it is, and returns its name.
    pub(crate) fn leave(mut self) -> PathBuf {
        self.keep = true;
        std::mem::take(&mut self.part)
    }

    /// Gives the complete file, which its `writer` hands back, its final name, once it is on the disk.
    pub(crate) fn complete(mut self, writer: File) -> Result<FinishedLog, LogError> {
        writer.sync_all().map_err(|source| self.io_error(source))?;
        self.keep = true;
        let (part, path) = (std::mem::take(&mut self.part), std::mem::take(&mut self.path));
        let renamed = match is_at(&writer, &part) {
            Ok(true) => fs::rename(&part, &path),
            Ok(false) => Err(io::Error::other(
                "it was removed or replaced while the log was written",
            )),
            Err(error) => Err(error),
        };
        match renamed {
            Ok(()) => Ok(FinishedLog { path, _file: writer }),
            Err(source) => Err(LogError::Rename { path, part, source }),
        }
    }
}

impl Place for PartFile {
    type Sink = File;

    /// The log's final name.
    fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        if !self.keep && !std::thread::panicking() && is_at(&self.file, &self.part).unwrap_or(false) {
            let _ = fs::remove_file(&self.part); // the error that led here matters more
        }
    }
}

/// Why a file that has the name already stays there.
enum Left {
    /// Another program writes it.
    Busy,
    /// It is not what a killed run leaves, or the system does not let it go.
    Failed(io::Error),
}

/// Removes what a killed run has left.
fn remove_left(part: &Path) -> Result<(), Left> {
    let unless_gone = |done: io::Result<()>| match done {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Left::Failed(error)),
        _ => Ok(()),
    };
    match fs::symlink_metadata(part) {
        Ok(found) if found.is_file() => {}
        Ok(_) => {
            let reason = "a link or a folder has this name; remove it, or name another file";
            return Err(Left::Failed(io::Error::new(ErrorKind::AlreadyExists, reason)));
        }
        Err(error) => return unless_gone(Err(error)),
    }
    // Nothing is written to it: for writing, because some file systems lock no other.
    let file = match OpenOptions::new().write(true).open(part) {
        Ok(file) => file,
        Err(error) => return unless_gone(Err(error)),
    };
    match file.try_lock() {
        Ok(()) if is_at(&file, part).map_err(Left::Failed)? => unless_gone(fs::remove_file(part)),
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(Left::Busy),
        Err(TryLockError::Error(error)) => {
            let reason = format!(
                "it exists, and it is unknown whether a program writes it ({error}): remove it if none does"
            );
            Err(Left::Failed(io::Error::new(ErrorKind::AlreadyExists, reason)))
        }
    }
}

/// Is there a finished log whose program still holds it?
fn is_held(path: &Path) -> bool {
    let regular = fs::symlink_metadata(path).is_ok_and(|found| found.is_file());
    let held = |file: File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    regular && File::open(path).is_ok_and(held)
}

/// Does the name still stand for this file?
#[cfg(unix)]
fn is_at(file: &File, name: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let here = file.metadata()?;
    match fs::symlink_metadata(name) {
        Ok(there) => Ok((here.dev(), here.ino()) == (there.dev(), there.ino())),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Does the name still stand for this file? An open file keeps its name here.
#[cfg(not(unix))]
fn is_at(_: &File, name: &Path) -> io::Result<bool> {
    name.try_exists()
}
