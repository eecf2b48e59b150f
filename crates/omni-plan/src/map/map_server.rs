//! Maps of ROS's map_server: a YAML file that names a picture of free, occupied and unknown cells.

use std::path::{Path, PathBuf};

use omni_config::{MOST_TOML_BYTES, read_regular};
use serde::Deserialize;

use super::picture::{GreyPicture, read_grey};
use super::{Cell, HEIGHT_M, Map};
use crate::error::{check_key, refused};
use crate::grid::{ORIGIN_M, RESOLUTION_M};
use crate::{Error, Grid};

/// A picture of heights beside a map_server's: grey, of 8 or 16 bits, of the same size.
///
/// ```
/// let elevation = omni_plan::Elevation::new("elevation.pgm", 0.0, 0.5);
/// assert_eq!(elevation.white_height_m, 0.5);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Elevation {
    /// The picture, a PGM or PNG.
    pub path: PathBuf,
    /// Height of black \[m\], within 10 km.
    pub black_height_m: f64,
    /// Height of white \[m\], within 10 km.
    pub white_height_m: f64,
}

impl Elevation {
    /// A picture, and the heights of its black and white \[m\].
    #[must_use]
    pub fn new(path: impl Into<PathBuf>, black_height_m: f64, white_height_m: f64) -> Self {
        Self {
            path: path.into(),
            black_height_m,
            white_height_m,
        }
    }
}

/// The file's keys, as map_server reads them. Others are left alone: tools add some.
#[derive(Deserialize)]
struct MapFile {
    image: String,
    resolution: f64,
    origin: Vec<f64>,
    #[serde(default)]
    negate: i64,
    occupied_thresh: f64,
    free_thresh: f64,
    #[serde(default = "trinary")]
    mode: String,
}

fn trinary() -> String {
    "trinary".into()
}

impl Map {
    /// A ROS map_server map, `NAME.yaml`, on even ground or with the heights of a second picture. Its modes `trinary`
    /// and `scale` are read, without rotation; pictures are PGM or PNG, grey.
    ///
    /// # Errors
    /// The error of a file, in one line.
    ///
    /// ```
    /// let error = omni_plan::Map::from_map_server("missing.yaml", None).unwrap_err();
    /// assert!(error.to_string().starts_with("missing.yaml: top level: "));
    /// ```
    pub fn from_map_server(path: impl AsRef<Path>, elevation: Option<&Elevation>) -> Result<Self, Error> {
        let path = path.as_ref();
        let file = path.display().to_string();
        let bytes = read_regular(path, MOST_TOML_BYTES)
            .map_err(|error| refused(&file, "top level", format!("{error}, allowed: map_server's YAML")))?;
        let keys: MapFile = serde_saphyr::from_slice(&bytes).map_err(|error| {
            let message = error.to_string();
            let line = message.lines().find(|line| !line.trim().is_empty());
            refused(
                &file,
                "top level",
                format!("{}, allowed: map_server's YAML", line.unwrap_or_default().trim()),
            )
        })?;
        check(&file, &keys)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let picture = read_grey(&file, "image", &folder.join(&keys.image))?;
        let heights = match elevation {
            Some(elevation) => heights_m(&file, elevation, &picture)?,
            None => vec![0.0; picture.levels.len()],
        };
        let (columns, rows) = (picture.columns, picture.rows);
        let grid = Grid::new(columns, rows, keys.resolution, [keys.origin[0], keys.origin[1]])?;
        let mut map = Self::from_heights(grid, upside_down(&heights, columns))?;
        // Between both thresholds are costs, or cells that were never seen.
        let scale = keys.mode == "scale";
        let cells: Vec<Cell> = picture
            .levels
            .iter()
            .map(|level| {
                let occupied = if keys.negate == 0 { 1.0 - level } else { *level };
                if occupied >= keys.occupied_thresh {
                    Cell::Occupied
                } else if occupied <= keys.free_thresh || scale {
                    Cell::Free
                } else {
                    Cell::Unknown
                }
            })
            .collect();
        map.cells = upside_down(&cells, columns);
        Ok(map)
    }
}

fn check(file: &str, keys: &MapFile) -> Result<(), Error> {
    check_key(
        file,
        "resolution",
        keys.resolution,
        RESOLUTION_M[0],
        RESOLUTION_M[1],
    )?;
    if !(2..=3).contains(&keys.origin.len()) {
        let message = format!("{} numbers, allowed: x, y and yaw", keys.origin.len());
        return Err(refused(file, "origin", message));
    }
    check_key(file, "origin[0]", keys.origin[0], -ORIGIN_M, ORIGIN_M)?;
    check_key(file, "origin[1]", keys.origin[1], -ORIGIN_M, ORIGIN_M)?;
    if let Some(yaw) = keys.origin.get(2)
        && *yaw != 0.0
    {
        let message = format!("{yaw}, allowed: 0, a map that is not rotated");
        return Err(refused(file, "origin[2]", message));
    }
    check_key(file, "occupied_thresh", keys.occupied_thresh, 0.0, 1.0)?;
    check_key(file, "free_thresh", keys.free_thresh, 0.0, keys.occupied_thresh)?;
    check_key(file, "negate", keys.negate as f64, 0.0, 1.0)?;
    if !["trinary", "scale"].contains(&&*keys.mode) {
        let message = format!("{:?}, allowed: trinary, scale", keys.mode);
        return Err(refused(file, "mode", message));
    }
    Ok(())
}

fn heights_m(file: &str, elevation: &Elevation, picture: &GreyPicture) -> Result<Vec<f64>, Error> {
    check_key(
        file,
        "black_height_m",
        elevation.black_height_m,
        -HEIGHT_M,
        HEIGHT_M,
    )?;
    check_key(
        file,
        "white_height_m",
        elevation.white_height_m,
        -HEIGHT_M,
        HEIGHT_M,
    )?;
    let grey = read_grey(file, "elevation", &elevation.path)?;
    if (grey.columns, grey.rows) != (picture.columns, picture.rows) {
        let message = format!(
            "{}: {} x {} pixels, allowed: {} x {}, as the map's picture",
            elevation.path.display(),
            grey.columns,
            grey.rows,
            picture.columns,
            picture.rows
        );
        return Err(refused(file, "elevation", message));
    }
    let range = elevation.white_height_m - elevation.black_height_m;
    let height = |level: &f64| elevation.black_height_m + range * level;
    Ok(grey.levels.iter().map(height).collect())
}

/// A picture's upper row is the one of the greatest y.
pub(super) fn upside_down<T: Copy>(values: &[T], columns: usize) -> Vec<T> {
    values.chunks(columns.max(1)).rev().flatten().copied().collect()
}
