//! Heights from a CSV table.

use std::path::Path;

use omni_config::{MOST_PNG_BYTES, read_regular};

use super::Map;
use super::map_server::upside_down;
use crate::error::refused;
use crate::grid::MOST_CELLS;
use crate::{Error, Grid, Point};

impl Map {
    /// The ground of a table of heights \[m\] without a header: columns along x, the first line at
    /// the greatest y, as in a picture.
    ///
    /// # Errors
    /// The error of the file, in one line.
    ///
    /// ```
    /// let error = omni_plan::Map::from_csv("missing.csv", 0.05, [0.0, 0.0]).unwrap_err();
    /// assert!(error.to_string().starts_with("missing.csv: top level: "));
    /// ```
    pub fn from_csv(path: impl AsRef<Path>, resolution_m: f64, origin_m: Point) -> Result<Self, Error> {
        let file = path.as_ref().display().to_string();
        let bytes = read_regular(&path, MOST_PNG_BYTES)
            .map_err(|error| refused(&file, "top level", format!("{error}, allowed: a CSV of heights")))?;
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .from_reader(&*bytes);
        let mut heights = Vec::new();
        let mut columns = 0;
        let mut rows = 0;
        let mut record = csv::StringRecord::new();
        loop {
            let line = rows + 1;
            let more = reader
                .read_record(&mut record)
                .map_err(|error| refused(&file, &format!("line {line}"), error.to_string()))?;
            if !more {
                break;
            }
            rows += 1;
            columns = record.len();
            if heights.len() + columns > MOST_CELLS {
                let message = format!("more heights, allowed: {MOST_CELLS} at most");
                return Err(refused(&file, &format!("line {line}"), message));
            }
            for (column, text) in record.iter().enumerate() {
                match text.parse::<f64>() {
                    Ok(height) if height.abs() <= super::HEIGHT_M => heights.push(height),
                    _ => {
                        let key = format!("line {line}, column {}", column + 1);
                        let most = super::HEIGHT_M;
                        let message = format!("{text:?}, allowed: heights from -{most} to {most}");
                        return Err(refused(&file, &key, message));
                    }
                }
            }
        }
        let grid = Grid::new(columns, rows, resolution_m, origin_m)
            .map_err(|error| refused(&file, "top level", error.to_string()))?;
        Self::from_heights(grid, upside_down(&heights, columns))
    }
}
