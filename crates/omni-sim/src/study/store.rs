//! A folder of results: parts that are whole or not there.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::key::{Lines, VERSION, hex};
use super::table::{self, Notes, Opened};
use super::{Columns, Plan, Row};
use crate::Error;

/// Who holds it computes the study.
const LOCK: &str = ".lock";
/// How the name of a part ends, for any reader; and while it grows.
const WHOLE: &str = ".parquet";
const GROWING: &str = ".growing";

/// Where the results of a study are: a folder of Parquet files `part-*.parquet`, all with the same columns. A part that still
/// grows is `part-*.growing`, each time whole.
///
/// Programs that share a study each have their own `Store` of the same folder.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    columns: Columns,
    shared: Lines,
    study: String,
}

/// What is in the folder.
#[derive(Clone, Debug, Default)]
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
    pub(super) fn shared(
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
        // Made by whoever holds the study.
        if store.folder.join(LOCK).is_file() {
            return Ok(store);
        }
        let reason = "not the folder of a study on this machine; every worker must see the same folder";
        Err(Error::Study {
            folder: store.folder,
            reason: reason.into(),
        })
    }

    /// Keeps other programs from computing the same runs for as long as the result lives. What programs that were killed left
    /// unfinished are parts like others then.
    ///
    /// # Errors
    /// [`Error::Study`] where another program holds the folder, [`Error::Io`].
    pub fn lock(&self) -> Result<File, Error> {
        let path = self.folder.join(LOCK);
        let file = File::create(&path).map_err(io_error(&path))?;
        // Not every file system has locks.
        if let Err(fs::TryLockError::WouldBlock) = file.try_lock() {
            return Err(self.refuse("it is being written by another program: wait for that one"));
        }
        for path in self.parts()? {
            if path.to_string_lossy().ends_with(GROWING)
                && let Ok(rows) = self.read_part(&path)?
            {
                self.write(&rows)?;
                // A worker that is still there may have done so itself.
                let _ = fs::remove_file(&path);
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
        // The same rows are the same part, whoever writes them and whenever.
        let path = self.part(&named(rows.iter().map(|row| row.key.as_str())), WHOLE);
        self.replace(&path, rows)?;
        Ok(Some(path))
    }

    /// Writes all rows of the part of that name, which is not whole yet.
    pub(super) fn grow(&self, name: &str, rows: &[Row]) -> Result<(), Error> {
        self.replace(&self.part(name, GROWING), rows)
    }

    /// The part of that name is whole with these rows.
    pub(super) fn seal(&self, name: &str, rows: &[Row]) -> Result<(), Error> {
        // Not renamed: what grows may be of a second worker with the same batch, which has fewer rows.
        self.replace(&self.part(name, WHOLE), rows)?;
        let _ = fs::remove_file(self.part(name, GROWING));
        Ok(())
    }

    /// The rows of the part of that name, whole or not.
    pub(super) fn read_as(&self, name: &str) -> Result<Vec<Row>, Error> {
        let mut rows = Vec::new();
        for path in [self.part(name, WHOLE), self.part(name, GROWING)] {
            if path.is_file() {
                rows = self.read_part(&path)?.unwrap_or(rows);
            }
        }
        Ok(rows)
    }

    fn part(&self, name: &str, ending: &str) -> PathBuf {
        self.folder.join(format!("part-{name}{ending}"))
    }

    /// Writes a file under another name until it is whole.
    fn replace(&self, path: &Path, rows: &[Row]) -> Result<(), Error> {
        let growing = path.with_extension(format!("{}.tmp", std::process::id()));
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
        let mut file = File::create(path)?;
        table::write(&mut file, &self.columns, &notes, rows).map_err(io::Error::other)?;
        file.sync_all()
    }

    /// Every row that is there. A part that cannot be read, because it is cut short or damaged, is renamed to `*.damaged`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Study`] where a part is of another version, of another scenario or of other axes: its rows
    /// would not be told apart from this study's.
    pub fn read(&self) -> Result<Found, Error> {
        let (mut rows, mut damaged) = (BTreeMap::<String, Row>::new(), Vec::new());
        for path in self.parts()? {
            match self.read_part(&path)? {
                Ok(part) => {
                    for row in part {
                        let better = rows.get(&row.key).is_none_or(|known| known.error.is_some());
                        if better {
                            rows.insert(row.key.clone(), row);
                        }
                    }
                }
                Err(reason) => {
                    let aside = path.with_extension("parquet.damaged");
                    fs::rename(&path, &aside).map_err(io_error(&path))?;
                    damaged.push((path, reason));
                }
            }
        }
        Ok(Found {
            rows: rows.into_values().collect(),
            damaged,
        })
    }

    /// Takes the rows with an error out of every part, so that their runs are missing again. Returns how many.
    ///
    /// # Errors
    /// As [`Store::read`].
    pub fn forget_errors(&self) -> Result<usize, Error> {
        let mut forgotten = 0;
        for path in self.parts()? {
            let Ok(rows) = self.read_part(&path)? else {
                continue;
            };
            let (failed, kept): (Vec<_>, Vec<_>) = rows.into_iter().partition(|row| row.error.is_some());
            if !failed.is_empty() {
                // First the part of what is kept: a row is there twice for a moment, but never lost.
                self.write(&kept)?;
                fs::remove_file(&path).map_err(io_error(&path))?;
                forgotten += failed.len();
            }
        }
        Ok(forgotten)
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn parts(&self) -> Result<Vec<PathBuf>, Error> {
        let entries = fs::read_dir(&self.folder).map_err(io_error(&self.folder))?;
        let mut parts = Vec::new();
        for entry in entries {
            let path = entry.map_err(io_error(&self.folder))?.path();
            let name = path
                .file_name()
                .and_then(|name| name.to_str())
                .unwrap_or_default();
            if name.starts_with("part-") && [WHOLE, GROWING].iter().any(|ending| name.ends_with(ending)) {
                parts.push(path);
            }
        }
        parts.sort();
        Ok(parts)
    }

    /// The rows of a part, or why it cannot be read.
    fn read_part(&self, path: &Path) -> Result<Result<Vec<Row>, String>, Error> {
        let file = match File::open(path) {
            // It has become whole meanwhile.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let whole = path.with_extension(&WHOLE[1..]);
                File::open(&whole).map_err(io_error(path))?
            }
            file => file.map_err(io_error(path))?,
        };
        let opened = match table::open(file) {
            Ok(opened) => opened,
            Err(error) => return Ok(Err(error.to_string())),
        };
        self.check(&opened)?;
        match opened.difference(&self.columns) {
            Ok(None) => Ok(opened.rows(&self.columns).map_err(|error| error.to_string())),
            Ok(Some(column)) => Err(self.refuse(&format!(
                "holds results with other columns ({column} is not in both)"
            ))),
            Err(error) => Ok(Err(error.to_string())),
        }
    }

    /// Are these rows of the same version and, but for axes and seed, of the same scenario?
    fn check(&self, part: &Opened) -> Result<(), Error> {
        let version = part.note("omnistep.version").unwrap_or("an unknown version");
        if version != VERSION {
            return Err(self.refuse(&format!("holds results of {version}, this is {VERSION}")));
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
        Err(self.refuse(&format!("holds results with {key} = {then}, here it is {now}")))
    }

    fn refuse(&self, reason: &str) -> Error {
        Error::Study {
            folder: self.folder.clone(),
            reason: format!("{reason}; name another folder"),
        }
    }
}

/// A part's name: 16 hexadecimal digits that say which runs it is of.
pub(super) fn named<'a>(keys: impl Iterator<Item = &'a str>) -> String {
    let mut digest = Sha256::new();
    keys.for_each(|key| digest.update(key));
    hex(&digest.finalize(), 8)
}

fn io_error(path: &Path) -> impl Fn(io::Error) -> Error {
    let path = path.to_owned();
    move |source| Error::Io {
        path: path.clone(),
        source,
    }
}
