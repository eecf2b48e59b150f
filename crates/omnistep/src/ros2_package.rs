//! `omnistep export --format ros2-msgs`: a folder, and never in place of what it did not write.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use omni_config::read_regular;
use omni_log::ros2_messages;

use crate::Error;
use crate::output::write_file;

/// The folder if none is named.
const FOLDER: &str = "omnistep_msgs";
/// Where its messages are.
const MESSAGES: &str = "msg";
/// The file that says which package a folder is, and the line in it.
const MANIFEST: (&str, &str) = ("package.xml", "<name>omnistep_msgs</name>");
/// Longest such file that is read \[bytes\].
const LONGEST: u64 = 64 << 10;

/// Writes the package into a folder that is new, empty or an earlier export.
pub(super) fn write(folder: Option<&Path>) -> Result<(), Error> {
    let folder = folder.unwrap_or(Path::new(FOLDER));
    let files = ros2_messages();
    check(folder, &files)?;
    let messages = folder.join(MESSAGES);
    fs::create_dir_all(&messages).map_err(|source| failed(&messages, source))?;
    for (path, text) in &files {
        write_file(&folder.join(path), text, &[])?;
    }
    Ok(())
}

/// Is there nothing in the folder but an earlier export?
fn check(folder: &Path, files: &[(String, String)]) -> Result<(), Error> {
    let entries = entries(folder).map_err(|source| failed(folder, source))?;
    let written = |path: &PathBuf| files.iter().any(|(file, _)| folder.join(file) == *path);
    let foreign = entries.iter().find(|path| !written(path));
    let manifest = folder.join(MANIFEST.0);
    let earlier = || {
        let bytes = read_regular(&manifest, LONGEST).unwrap_or_default();
        String::from_utf8_lossy(&bytes).contains(MANIFEST.1)
    };
    match foreign {
        None if entries.is_empty() || earlier() => Ok(()),
        other => {
            let path = other.unwrap_or(&manifest);
            let kept = "not of this export, allowed: a folder that is new, empty or an earlier export";
            Err(failed(path, io::Error::other(kept)))
        }
    }
}

/// What is in the folder and in its folder of messages; nothing if there is no folder. Links are not followed.
fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    let within = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(all),
        within => within?,
    };
    for entry in within {
        let entry = entry?;
        if entry.file_name() == MESSAGES && entry.file_type()?.is_dir() {
            for message in fs::read_dir(entry.path())? {
                all.push(message?.path());
            }
        } else {
            all.push(entry.path());
        }
    }
    Ok(all)
}

fn failed(path: &Path, source: io::Error) -> Error {
    Error::Io {
        path: path.into(),
        source,
    }
}
