//! Standard output and standard error: every line is written here.

use std::io::Write;
use std::path::{Path, PathBuf};

use comfy_table::{CellAlignment, Row, Table, presets};
use omni_config::{Error as ConfigError, check_replaceable, shortened_line};

use crate::{Error, robots};

/// A line on standard error, cut to a readable length: every one goes through here.
pub(crate) fn say(line: &str) {
    // A closed output is no reason to fail.
    let _ = writeln!(std::io::stderr(), "{}", shortened_line(line));
}

/// Says what went wrong, in one line; the exit code.
pub(crate) fn say_error(error: &Error) -> u8 {
    let hint = asked_for(error).and_then(robots::hint);
    let hint = hint.map_or_else(String::new, |hint| format!("; first: {hint}"));
    say(&format!("error: {error}{hint}"));
    if error.is_bad_input() { 2 } else { 1 }
}

/// The name of a file or a vehicle that is not there.
fn asked_for(error: &Error) -> Option<&str> {
    match error {
        Error::Simulation(omni_sim::Error::Config(ConfigError::UnknownName { name, .. })) => Some(name),
        Error::Simulation(omni_sim::Error::Config(ConfigError::Missing { path, .. })) => path.to_str(),
        // Of a scenario whose vehicle it is: the name is quoted first.
        Error::Simulation(omni_sim::Error::Config(ConfigError::Key { key, message, .. }))
            if key == "vehicle" =>
        {
            message.split('"').nth(1)
        }
        _ => None,
    }
}

/// Does the same with each file, also behind one that is bad: what is wrong with it is said as it
/// comes. The exit code of the worst.
pub(crate) fn each<T>(files: &[T], mut look: impl FnMut(&T) -> Result<(), Error>) -> u8 {
    let code = |file| look(file).map_or_else(|error| say_error(&error), |()| 0);
    files.iter().map(code).max().unwrap_or(0)
}

/// What is doubtful but no error, in one line on standard error.
pub(crate) fn warn(text: &str) {
    say(&format!("warning: {text}"));
}

/// A table with `left` columns of words, the others numbers, flush right.
pub(crate) fn aligned<H: Into<Row>, R: Into<Row>>(
    headings: H,
    rows: impl IntoIterator<Item = R>,
    left: usize,
) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(headings);
    table.add_rows(rows);
    for column in table.column_iter_mut().skip(left) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Writes to standard output; a reader that has gone away is no error of ours.
pub(crate) fn print(out: &mut dyn Write, text: &str) -> Result<(), Error> {
    print_bytes(out, text.as_bytes())
}

/// A file's name as the system has it, even if it is no UTF-8, on a line of its own.
pub(crate) fn print_path(out: &mut dyn Write, path: &Path) -> Result<(), Error> {
    print_bytes(out, &[path.as_os_str().as_encoded_bytes(), b"\n"].concat())
}

/// Writes a file, complete or not at all, and not in place of one of the `inputs` that it is made
/// of; into a pipe or a terminal as it is.
pub(crate) fn write_file(path: &Path, text: &str, inputs: &[PathBuf]) -> Result<(), Error> {
    let failed = |source| Error::Io {
        path: path.into(),
        source,
    };
    let place = std::fs::canonicalize(path).ok();
    if place.is_some()
        && inputs
            .iter()
            .any(|input| place == std::fs::canonicalize(input).ok())
    {
        let kept = "this command reads this file, allowed: another name";
        return Err(failed(std::io::Error::other(kept)));
    }
    if place
        .as_ref()
        .is_some_and(|place| !place.is_file() && !place.is_dir())
    {
        return std::fs::write(path, text).map_err(failed);
    }
    check_replaceable(path).map_err(failed)?;
    let mut aside = path.as_os_str().to_owned();
    aside.push(format!(".{}.part", std::process::id()));
    let mut file = std::fs::File::create_new(&aside).map_err(failed)?;
    let written = file
        .write_all(text.as_bytes())
        .and_then(|()| file.sync_all())
        // A link is replaced, not followed.
        .and_then(|()| std::fs::rename(&aside, path));
    written.map_err(|source| {
        // The error that led here matters more.
        let _ = std::fs::remove_file(&aside);
        failed(source)
    })
}

pub(crate) fn print_bytes(out: &mut dyn Write, bytes: &[u8]) -> Result<(), Error> {
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::Io {
            path: "standard output".into(),
            source,
        }),
        _ => Ok(()),
    }
}
