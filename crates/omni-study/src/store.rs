//! A folder of results: a part is complete or absent.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use omni_config::open_regular;

use crate::checksum::{self, Checksum};
use crate::key::{Lines, VERSION};
use crate::merged_rows::MergedRows;
use crate::parquet_table::{self, Notes, Opened};
use crate::part_names::{GROWING, WHOLE, file_name, grows, io_error, named, unique, unless_gone};
use crate::{Columns, Error, Plan, Row, Run};

/// Who holds it computes the study.
const LOCK: &str = ".lock";
/// What is said of a part whose checksum is broken, and of one without.
const CHANGED: &str = "its SHA-256 checksum is wrong";
const WITHOUT_CHECKSUM: &str = "no checksum: damaged, or written by an earlier build";

/// What is wrong with the bytes of a part of some study, if anything; none for Parquet that is not of this program.
///
/// # Errors
/// [`Error::Io`] if it cannot be read.
///
/// ```no_run
/// assert_eq!(omni_study::damage("out/climb_map/part-0011223344556677.parquet".as_ref())?, None);
/// # Ok::<(), omni_study::Error>(())
/// ```
pub fn damage(path: &Path) -> Result<Option<&'static str>, Error> {
    let mut file = open_regular(path).map_err(io_error(path))?;
    Ok(match checksum::check(&mut file).map_err(io_error(path))? {
        Checksum::Right => None,
        Checksum::Wrong => Some(CHANGED),
        Checksum::Missing => {
            // What is no Parquet at all is for the reader to say.
            let opened = parquet_table::open(file).ok();
            opened
                .filter(|opened| opened.note("omnistep.version").is_some())
                .map(|_| WITHOUT_CHECKSUM)
        }
    })
}

/// Results of a study: a folder of Parquet files `part-*.parquet`, all with the same columns. A part that still grows
/// is `part-*.growing`, each time whole.
///
/// Programs that share a study each have their own `Store` of the same folder.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    columns: Columns,
    shared: Lines,
    study: String,
}

/// Contents of the folder.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Found {
    /// The row of each key, in the order of keys; one without an error if there are several.
    pub rows: Vec<Row>,
    /// Parts that could not be read and why; they are called `*.damaged` now, and their rows are not there.
    pub damaged: Vec<(PathBuf, String)>,
}

impl Found {
    /// The keys of its rows.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.rows.iter().map(|row| row.key.as_str())
    }
}

/// Present rows of a batch.
#[derive(Default)]
struct OfBatch {
    /// All of it.
    rows: MergedRows,
    /// That of the whole part.
    whole: MergedRows,
    /// The parts that are not whole.
    growing: Vec<PathBuf>,
}

impl Store {
    /// The folder, made if missing, for the results of a plan.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(folder: impl Into<PathBuf>, plan: &Plan) -> Result<Self, Error> {
        let folder = folder.into();
        fs::create_dir_all(&folder).map_err(io_error(&folder))?;
        Ok(Self {
            folder,
            columns: plan.columns().clone(),
            shared: plan.shared().clone(),
            study: plan.study().name.clone(),
        })
    }

    /// The folder where another program keeps the results of a study.
    pub(crate) fn shared(
        folder: PathBuf,
        columns: Columns,
        shared: Lines,
        study: String,
    ) -> Result<Self, Error> {
        let store = Self {
            folder,
            columns,
            shared,
            study,
        };
        // Made by the holder of the study.
        if store.folder.join(LOCK).is_file() {
            return Ok(store);
        }
        let reason = "not the folder of a study on this machine; every worker must see the same folder";
        Err(Error::Study {
            folder: store.folder,
            reason: reason.into(),
        })
    }

    /// Keeps other programs from computing the same runs for as long as the result lives. What
    /// programs that were killed left unfinished are parts like others then.
    ///
    /// # Errors
    /// [`Error::Study`] if another program holds the folder, [`Error::Io`].
    pub fn lock(&self) -> Result<File, Error> {
        let path = self.folder.join(LOCK);
        // Whatever has the name is not emptied.
        let mut options = File::options();
        let file = options.write(true).create(true).truncate(false).open(&path);
        let file = file.map_err(io_error(&path))?;
        // Not every file system has locks.
        if let Err(fs::TryLockError::WouldBlock) = file.try_lock() {
            return Err(self.refuse("another program is writing to it: wait until that one ends"));
        }
        for path in self.parts()?.iter().filter(|path| grows(path)) {
            if let Some(Ok(rows)) = self.read_part(path)? {
                // Renamed, not written again: so nothing is lost that a worker which is still there has added by now.
                let whole = self.part(&named(rows.iter().map(|row| row.key.as_str())), WHOLE);
                unless_gone(fs::rename(path, whole)).map_err(io_error(path))?;
            }
        }
        Ok(file)
    }

    /// Writes rows as one more part, under another name until it is whole, and returns its path; none for no rows.
    ///
    /// # Errors
    /// [`Error::Io`]: nothing is left under the part's name then.
    pub fn write(&self, rows: &[Row]) -> Result<Option<PathBuf>, Error> {
        if rows.is_empty() {
            return Ok(None);
        }
        // The same rows are the same part, by any writer and at any time.
        let path = self.part(&named(rows.iter().map(|row| row.key.as_str())), WHOLE);
        self.replace(&path, rows)?;
        Ok(Some(path))
    }

    /// Writes all rows of the part of that name, which is not whole yet.
    pub(crate) fn grow(&self, name: &str, rows: &[Row]) -> Result<(), Error> {
        self.replace(&self.part(name, GROWING), rows)
    }

    /// The part of that name, which has all rows that it will have, is whole.
    pub(crate) fn complete(&self, name: &str) -> Result<(), Error> {
        let growing = self.part(name, GROWING);
        // The present holder of the folder has done it, if it is gone.
        unless_gone(fs::rename(&growing, self.part(name, WHOLE))).map_err(io_error(&growing))
    }

    /// The part of a batch is whole if each of its runs has a row by now, by any worker; else what there is grows on.
    pub(crate) fn complete_batch(&self, name: &str, keys: &BTreeSet<String>) -> Result<(), Error> {
        let there = self.of_batch(name)?;
        if !there.rows.has_all(keys) {
            return Ok(());
        }
        if !there.whole.has_all(keys) {
            self.replace(&self.part(name, WHOLE), &there.rows.list())?;
        }
        // A worker that is still there has nothing that is not in the whole part.
        there.growing.iter().for_each(|path| drop(fs::remove_file(path)));
        Ok(())
    }

    /// The keys of the rows that workers with that batch have written.
    pub(crate) fn keys_of_batch(&self, name: &str) -> Result<BTreeSet<String>, Error> {
        Ok(self.of_batch(name)?.rows.keys())
    }

    /// A batch has a part `NAME` when it is whole, and until then one `NAME-*` for each worker that has it.
    fn of_batch(&self, name: &str) -> Result<OfBatch, Error> {
        let (whole, growing) = (self.part(name, WHOLE), format!("part-{name}-"));
        let is_growing = |path: &Path| grows(path) && file_name(path).starts_with(&growing);
        let mut there = OfBatch::default();
        let of_batch = |path: &Path| path == whole || is_growing(path);
        self.each_part(of_batch, &AtomicBool::new(false), |path, rows| {
            let rows = rows.unwrap_or_default();
            if is_growing(path) {
                there.growing.push(path.to_owned());
            } else {
                there.whole.add(rows.clone());
            }
            there.rows.add(rows);
            Ok(())
        })?;
        Ok(there)
    }

    fn part(&self, name: &str, ending: &str) -> PathBuf {
        self.folder.join(format!("part-{name}{ending}"))
    }

    /// Writes a file under another name until it is whole.
    fn replace(&self, path: &Path, rows: &[Row]) -> Result<(), Error> {
        let growing = path.with_extension(format!("{}.tmp", unique()));
        let written = self
            .write_to(&growing, rows)
            .and_then(|()| fs::rename(&growing, path));
        written.map_err(|source| {
            let _ = fs::remove_file(&growing);
            io_error(path)(source)
        })
    }

    fn write_to(&self, path: &Path, rows: &[Row]) -> io::Result<()> {
        let shared = self
            .shared
            .iter()
            .map(|(key, value)| format!("{key} = {value}\n"));
        let notes: Notes = vec![
            ("omnistep.version", VERSION.into()),
            ("omnistep.study", self.study.clone()),
            ("omnistep.scenario", shared.collect()),
        ];
        let bytes = parquet_table::written(&self.columns, &notes, rows).map_err(io::Error::other)?;
        let mut file = File::create_new(path)?;
        file.write_all(&bytes)?;
        file.sync_all()
    }

    /// Every row that is there. A part that cannot be read, because it is cut short or damaged, is
    /// renamed to `*.damaged`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Study`] if a part is of another version, of another scenario or of other axes: its rows
    /// could not be distinguished from this study's.
    pub fn read(&self) -> Result<Found, Error> {
        self.read_until(&AtomicBool::new(false))
    }

    /// [`Store::read`], until `stop` is set.
    ///
    /// # Errors
    /// As [`Store::read`]; [`Error::Stopped`].
    pub fn read_until(&self, stop: &AtomicBool) -> Result<Found, Error> {
        let (mut union, mut damaged) = (MergedRows::default(), Vec::new());
        self.each_part(
            |_| true,
            stop,
            |path, rows| {
                match rows {
                    Ok(rows) => union.add(rows),
                    Err(reason) => {
                        let aside = path.with_extension("parquet.damaged");
                        unless_gone(fs::rename(path, aside)).map_err(io_error(path))?;
                        damaged.push((path.to_owned(), reason));
                    }
                }
                Ok(())
            },
        )?;
        Ok(Found {
            rows: union.list(),
            damaged,
        })
    }

    /// Takes the rows with an error out of every part, so that their runs are missing again. Returns how many.
    ///
    /// # Errors
    /// As [`Store::read`].
    pub fn forget_errors(&self) -> Result<usize, Error> {
        self.forget_errors_until(&AtomicBool::new(false))
    }

    /// [`Store::forget_errors`], until `stop` is set: some may be there still.
    ///
    /// # Errors
    /// As [`Store::read`]; [`Error::Stopped`].
    pub fn forget_errors_until(&self, stop: &AtomicBool) -> Result<usize, Error> {
        let mut forgotten = 0;
        self.each_part(
            |_| true,
            stop,
            |path, rows| {
                let rows = rows.unwrap_or_default();
                let (failed, kept): (Vec<_>, Vec<_>) = rows.into_iter().partition(|row| row.error.is_some());
                if !failed.is_empty() {
                    // First the part of what is kept: a row is there twice for a moment, but never lost.
                    self.write(&kept)?;
                    unless_gone(fs::remove_file(path)).map_err(io_error(path))?;
                    forgotten += failed.len();
                }
                Ok(())
            },
        )?;
        Ok(forgotten)
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Each of the `wanted` parts: its rows, or why it cannot be read.
    fn each_part(
        &self,
        wanted: impl Fn(&Path) -> bool,
        stop: &AtomicBool,
        mut each: impl FnMut(&Path, Result<Vec<Row>, String>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut seen = BTreeSet::new();
        let mut some_gone = true;
        while some_gone {
            some_gone = false;
            for path in self.parts()?.into_iter().filter(|path| wanted(path)) {
                if stop.load(Ordering::Relaxed) {
                    return Err(Error::Stopped);
                }
                if seen.contains(&path) {
                    continue;
                }
                match self.read_part(&path)? {
                    Some(read) => each(&path, read)?,
                    // It has become whole, or part of another: that one is in the folder now.
                    None => some_gone = true,
                }
                seen.insert(path);
            }
        }
        Ok(())
    }

    fn parts(&self) -> Result<Vec<PathBuf>, Error> {
        let entries = fs::read_dir(&self.folder).map_err(io_error(&self.folder))?;
        let mut parts = Vec::new();
        for entry in entries {
            let path = entry.map_err(io_error(&self.folder))?.path();
            let name = file_name(&path);
            if name.starts_with("part-") && (name.ends_with(WHOLE) || grows(&path)) {
                parts.push(path);
            }
        }
        parts.sort();
        Ok(parts)
    }

    /// The rows of a part, or why it cannot be read; none if it is not there any more.
    fn read_part(&self, path: &Path) -> Result<Option<Result<Vec<Row>, String>>, Error> {
        let mut file = match open_regular(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            file => file.map_err(io_error(path))?,
        };
        // Before anything in it is used.
        let checksum = checksum::check(&mut file).map_err(io_error(path))?;
        if checksum == Checksum::Wrong {
            return Ok(Some(Err(CHANGED.into())));
        }
        let opened = match parquet_table::open(file) {
            Ok(opened) => opened,
            Err(error) => return Ok(Some(Err(error.to_string()))),
        };
        self.check(&opened)?;
        match opened.difference(&self.columns) {
            // Of this version and this study: only that can be distinguished from one that is damaged.
            Ok(None) if checksum == Checksum::Missing => Ok(Some(Err(WITHOUT_CHECKSUM.into()))),
            Ok(None) => Ok(Some(
                opened.rows(&self.columns).map_err(|error| error.to_string()),
            )),
            Ok(Some(column)) => Err(self.refuse(&format!(
                "holds results with other columns ({column} is in only one of the two)"
            ))),
            Err(error) => Ok(Some(Err(error.to_string()))),
        }
    }

    /// Are these rows of the same version and, but for axes and seed, of the same scenario?
    fn check(&self, part: &Opened) -> Result<(), Error> {
        let version = part.note("omnistep.version").unwrap_or("an unknown version");
        if version != VERSION {
            return Err(self.refuse(&format!("holds results of {version}, but this is {VERSION}")));
        }
        let text = part.note("omnistep.scenario").unwrap_or_default();
        let there: BTreeMap<&str, &str> = text.lines().filter_map(|line| line.split_once(" = ")).collect();
        let here: BTreeMap<&str, &str> = self
            .shared
            .iter()
            .map(|(k, v)| (k.as_str(), v.as_str()))
            .collect();
        let keys = there.keys().chain(here.keys());
        let differs = |key: &&&str| there.get(**key) != here.get(**key);
        let Some(key) = keys.filter(differs).min() else {
            return Ok(());
        };
        let show = |lines: &BTreeMap<&str, &str>| {
            lines
                .get(key)
                .map_or("varied or not there".into(), |v| (*v).to_owned())
        };
        let (then, now) = (show(&there), show(&here));
        Err(self.refuse(&format!(
            "holds results with {key} = {then}, but now {key} = {now}"
        )))
    }

    fn refuse(&self, reason: &str) -> Error {
        Error::Study {
            folder: self.folder.clone(),
            reason: format!("{reason}; use another folder"),
        }
    }
}

impl Plan {
    /// The runs that have no row yet.
    #[must_use]
    pub fn missing(&self, found: &Found) -> Vec<Run> {
        let done: BTreeSet<&str> = found.keys().collect();
        let missing = self.runs().iter().filter(|run| !done.contains(run.key.as_str()));
        missing.cloned().collect()
    }
}
