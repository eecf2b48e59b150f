//! A command from a table of times and twists.

use std::path::Path;
use std::sync::Arc;

use omni_core::BodyTwist;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use toml::{Table, Value};

use crate::Error;
use crate::data_url::{bytes_of, data_url};
use crate::load::Source;
use crate::ranges::{Bounded, TIME_S, VELOCITY_M_S, VELOCITY_RAD_S};
use crate::regular_file::{MOST_TOML_BYTES, read_regular};

/// How a table inside a text begins.
const DATA_URL: &str = "data:text/csv;base64,";
/// The columns, by name.
const COLUMNS: [&str; 4] = ["time_s", "vx_m_s", "vy_m_s", "wz_rad_s"];
/// Most rows.
const MOST_ROWS: usize = 100_000;
/// Largest file \[bytes\]: inside a scenario it is a third longer, which must still be read.
const MOST_BYTES: u64 = MOST_TOML_BYTES / 2;

/// Twists by time, held whole: a scenario with it can be written into a log and read back.
///
/// ```
/// use omni_config::CommandFile;
/// let table = CommandFile::from_csv(b"time_s,vx_m_s,vy_m_s,wz_rad_s\n0.5,0.3,0,0\n2,0,0.1,0.2\n")?;
/// assert_eq!(table.at(0.4).to_array(), [0.0; 3]); // at rest before the first row
/// assert_eq!(table.at(1.9).to_array(), [0.3, 0.0, 0.0]); // held until the next one
/// assert_eq!(table.at(9.0).to_array(), [0.0, 0.1, 0.2]);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CommandFile {
    csv: Arc<[u8]>,
    rows: Arc<[[f64; 4]]>,
}

impl CommandFile {
    /// The table in the bytes of a CSV file: a first line `time_s,vx_m_s,vy_m_s,wz_rad_s`, then 1
    /// to 100000 rows whose times \[s\] ascend. What a row says holds until the next one's time.
    ///
    /// # Errors
    /// Its first error, with the line.
    ///
    /// ```
    /// use omni_config::CommandFile;
    /// let error = CommandFile::from_csv(b"time_s,vx_m_s,vy_m_s,wz_rad_s\n0,0.3,0,fast\n").unwrap_err();
    /// assert_eq!(error, "line 2: wz_rad_s: \"fast\", allowed: -1000 to 1000");
    /// ```
    pub fn from_csv(bytes: &[u8]) -> Result<Self, String> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(bytes);
        let header = reader.headers().map_err(|error| said(&error))?;
        if !header.iter().eq(COLUMNS) {
            let found: Vec<_> = header.iter().take(8).collect();
            return Err(format!(
                "columns {:?}, allowed: {}",
                found.join(","),
                COLUMNS.join(",")
            ));
        }
        let mut rows: Vec<[f64; 4]> = Vec::new();
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(|error| said(&error))? {
            let line = record.position().map_or(0, csv::Position::line);
            let mut row = [0.0; 4];
            let ranges = [TIME_S, VELOCITY_M_S, VELOCITY_M_S, VELOCITY_RAD_S];
            for (((value, field), name), range) in row.iter_mut().zip(&record).zip(COLUMNS).zip(ranges) {
                let read = field.parse::<f64>().ok().filter(|read| !read.outside(range));
                *value = read.ok_or_else(|| {
                    format!(
                        "line {line}: {name}: {field:?}, allowed: {} to {}",
                        range.min.shown(),
                        range.max.shown()
                    )
                })?;
            }
            if let Some(before) = rows.last().filter(|before| row[0] <= before[0]) {
                return Err(format!(
                    "line {line}: time_s: {}, allowed: more than {}, the time in the line before",
                    row[0], before[0]
                ));
            }
            if rows.len() == MOST_ROWS {
                return Err(format!("line {line}: one row more than the {MOST_ROWS} allowed"));
            }
            rows.push(row);
        }
        if rows.is_empty() {
            return Err(format!("no rows, allowed: 1 to {MOST_ROWS}"));
        }
        Ok(Self {
            csv: bytes.into(),
            rows: rows.into(),
        })
    }

    /// The twist at a time \[s\].
    #[must_use]
    pub fn at(&self, time_s: f64) -> BodyTwist<f64> {
        let next = self.rows.partition_point(|row| row[0] <= time_s);
        let row = next.checked_sub(1).and_then(|k| self.rows.get(k));
        row.map_or(BodyTwist::ZERO, |[_, vx, vy, wz]| {
            BodyTwist::from_array([*vx, *vy, *wz])
        })
    }

    /// The rows: time \[s\], forward, left \[m/s\], counter-clockwise \[rad/s\].
    #[must_use]
    pub fn rows(&self) -> &[[f64; 4]] {
        &self.rows
    }

    /// Is this text of a scenario the path of a table, not the table itself?
    pub(crate) fn is_path(file: &str) -> bool {
        !file.starts_with(DATA_URL)
    }

    /// Puts the table itself where the command of a scenario names one, in this folder.
    pub(crate) fn embed(source: &Source, folder: Option<&Path>, scenario: &mut Table) -> Result<(), Error> {
        let command = scenario.get_mut("command").and_then(Value::as_table_mut);
        let Some(Value::String(file)) = command.and_then(|command| command.get_mut("file")) else {
            return Ok(());
        };
        if Self::is_path(file) {
            source.check_reference("command.file", file, "the table")?;
            let path = folder.unwrap_or(Path::new("")).join(&*file);
            let refuse =
                |reason: String| source.refuse("command.file", format!("{}: {reason}", path.display()));
            let bytes = read_regular(&path, MOST_BYTES)
                .map_err(|error| refuse(format!("{error}, allowed: the path of a CSV file")))?;
            Self::from_csv(&bytes).map_err(refuse)?;
            *file = data_url(DATA_URL, &bytes);
        }
        Ok(())
    }
}

/// The reader's message, in one line.
fn said(error: &csv::Error) -> String {
    let line = error.position().map_or(1, csv::Position::line);
    match error.kind() {
        csv::ErrorKind::Utf8 { .. } => format!("line {line}: not text in UTF-8"),
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => {
            format!("line {line}: {len} fields, allowed: {expected_len}")
        }
        _ => format!("line {line}: not valid CSV: {error}"),
    }
}

impl Serialize for CommandFile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&data_url(DATA_URL, &self.csv))
    }
}

impl<'de> Deserialize<'de> for CommandFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let bytes = bytes_of(DATA_URL, deserializer)?;
        Self::from_csv(&bytes).map_err(de::Error::custom)
    }
}
