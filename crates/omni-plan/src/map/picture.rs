//! Grey pictures: PNG as the simulation's height maps, and PGM as map_server's.

use std::io::Cursor;
use std::path::Path;

use image::codecs::pnm::PnmDecoder;
use image::{DynamicImage, ImageDecoder};
use omni_config::{HeightMap, MOST_PNG_BYTES, read_regular};

use super::Map;
use crate::error::{check_key, refused};
use crate::grid::{MOST_CELLS, RESOLUTION_M};
use crate::{Error, Grid};

/// Heights of black and white \[m\], as in a scenario's terrain.
const LEVEL_M: f64 = 10.0;
/// World x of a picture's lower edge \[m\].
const START_M: f64 = 1e4;

/// How a picture's brightness and pixels are heights and places: the keys of a scenario's `height_map`.
///
/// ```
/// let scale = omni_plan::PictureScale::new(0.02, 0.0, 0.4);
/// assert_eq!(scale.start_x_m, 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PictureScale {
    /// Distance between two pixels \[m\], 0.001 to 10.
    pub pixel_m: f64,
    /// Height of black \[m\], -10 to 10.
    pub black_height_m: f64,
    /// Height of white \[m\], -10 to 10.
    pub white_height_m: f64,
    /// World x of the picture's lower edge \[m\], within 10 km.
    pub start_x_m: f64,
}

impl PictureScale {
    /// Of pixels at a distance, with heights of black and white \[m\]; the lower edge is at x = 0.
    #[must_use]
    pub fn new(pixel_m: f64, black_height_m: f64, white_height_m: f64) -> Self {
        Self {
            pixel_m,
            black_height_m,
            white_height_m,
            start_x_m: 0.0,
        }
    }
}

impl Map {
    /// The ground of a grey PNG, 8 or 16 bits, at most 4 million pixels: up in the picture is along x, its left
    /// side is at the greatest y, its middle column at y = 0, as in a scenario's `height_map`. A cell is a pixel.
    ///
    /// # Errors
    /// The error of the file or the scale, in one line.
    ///
    /// ```
    /// use omni_plan::{Map, PictureScale};
    /// let error = Map::from_png("missing.png", &PictureScale::new(0.05, 0.0, 0.4)).unwrap_err();
    /// assert!(error.to_string().starts_with("missing.png: image: "));
    /// ```
    pub fn from_png(path: impl AsRef<Path>, scale: &PictureScale) -> Result<Self, Error> {
        let file = path.as_ref().display().to_string();
        let bytes = read_regular(&path, MOST_PNG_BYTES)
            .map_err(|error| refused(&file, "image", format!("{error}, allowed: a PNG")))?;
        let picture = HeightMap::from_png(&bytes).map_err(|reason| refused(&file, "image", reason))?;
        Self::from_picture(&file, &picture, scale)
    }

    /// The ground of a picture that was read before, as [`from_png`](Self::from_png); messages name it `file`.
    ///
    /// # Errors
    /// The error of the scale, in one line.
    pub fn from_picture(file: &str, picture: &HeightMap, scale: &PictureScale) -> Result<Self, Error> {
        check_key(file, "pixel_m", scale.pixel_m, RESOLUTION_M[0], RESOLUTION_M[1])?;
        check_key(file, "black_height_m", scale.black_height_m, -LEVEL_M, LEVEL_M)?;
        check_key(file, "white_height_m", scale.white_height_m, -LEVEL_M, LEVEL_M)?;
        check_key(file, "start_x_m", scale.start_x_m, -START_M, START_M)?;
        let (columns, rows) = (picture.rows(), picture.columns());
        let origin = [
            scale.start_x_m - scale.pixel_m / 2.0,
            -(rows as f64) * scale.pixel_m / 2.0,
        ];
        let grid = Grid::new(columns, rows, scale.pixel_m, origin)?;
        let mut heights = Vec::with_capacity(grid.cells());
        for row in 0..rows {
            for column in 0..columns {
                let level = picture.level(columns - 1 - column, rows - 1 - row);
                heights.push(scale.black_height_m + (scale.white_height_m - scale.black_height_m) * level);
            }
        }
        Self::from_heights(grid, heights)
    }
}

/// A grey picture of another tool: brightness from 0 (black) to 1, row by row, the upper row first.
pub(super) struct GreyPicture {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) levels: Vec<f64>,
}

/// Reads a grey PGM or PNG; messages name `file` and `key`, and the picture's own path where it is another.
pub(super) fn read_grey(file: &str, key: &str, path: &Path) -> Result<GreyPicture, Error> {
    let wrong = |reason: String| {
        let message = format!("{}: {reason}", path.display());
        refused(file, key, message)
    };
    let bytes = read_regular(path, MOST_PNG_BYTES)
        .map_err(|error| wrong(format!("{error}, allowed: a grey PGM or PNG")))?;
    if bytes.starts_with(b"P") {
        return read_pgm(&bytes).map_err(wrong);
    }
    let picture = HeightMap::from_png(&bytes).map_err(|reason| wrong(format!("no PGM, and {reason}")))?;
    let mut levels = Vec::with_capacity(picture.rows() * picture.columns());
    for row in 0..picture.rows() {
        for column in 0..picture.columns() {
            levels.push(picture.level(row, column));
        }
    }
    Ok(GreyPicture {
        columns: picture.columns(),
        rows: picture.rows(),
        levels,
    })
}

fn read_pgm(bytes: &[u8]) -> Result<GreyPicture, String> {
    let wrong = |error: image::ImageError| format!("no complete PGM: {error}");
    let decoder = PnmDecoder::new(Cursor::new(bytes)).map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    let (columns, rows) = (width as usize, height as usize);
    if columns.saturating_mul(rows) > MOST_CELLS {
        return Err(format!(
            "{columns} x {rows} pixels, allowed: {MOST_CELLS} pixels at most"
        ));
    }
    let levels = match DynamicImage::from_decoder(decoder).map_err(wrong)? {
        DynamicImage::ImageLuma8(grey) => grey.iter().map(|level| f64::from(*level) / 255.0).collect(),
        DynamicImage::ImageLuma16(grey) => grey.iter().map(|level| f64::from(*level) / 65535.0).collect(),
        other => {
            return Err(format!(
                "a picture of {:?}, allowed: grey of 8 or 16 bits",
                other.color()
            ));
        }
    };
    Ok(GreyPicture {
        columns,
        rows,
        levels,
    })
}
