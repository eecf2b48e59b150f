//! Heights from a picture.

use std::path::Path;
use std::sync::Arc;

use png::{BitDepth, ColorType};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use toml::{Table, Value};

use crate::Error;
use crate::data_url::{bytes_of, data_url};
use crate::load::Source;
use crate::regular_file::{MOST_PNG_BYTES, read_regular};

/// How a picture inside a text begins.
const DATA_URL: &str = "data:image/png;base64,";
/// Built-in pictures by name.
const PICTURES: [(&str, &[u8]); 1] = [("hills", include_bytes!("../assets/pictures/hills.png"))];
/// Most pixels of a picture: some 100 MB of heights in the simulation.
const MOST_PIXELS: usize = 4_000_000;

/// A grey picture, held whole: a scenario with it can be written into a log and read back.
///
/// ```
/// let error = omni_config::HeightMap::from_png(b"not a picture").unwrap_err();
/// assert!(error.starts_with("no PNG"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    png: Arc<[u8]>,
    levels: Arc<[u16]>,
    rows: usize,
    columns: usize,
}

impl HeightMap {
    /// The picture in a PNG file's bytes: grey, 8 or 16 bits, 2 x 2 to 4 million pixels.
    ///
    /// # Errors
    /// Its error.
    pub fn from_png(bytes: &[u8]) -> Result<Self, String> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .map_err(|error| format!("no PNG: {error}"))?;
        let (color, depth) = reader.output_color_type();
        let (columns, rows) = (reader.info().width as usize, reader.info().height as usize);
        if rows < 2 || columns < 2 || rows.saturating_mul(columns) > MOST_PIXELS {
            return Err(format!(
                "{columns} x {rows} pixels, allowed: 2 x 2 to {MOST_PIXELS} pixels"
            ));
        }
        if color != ColorType::Grayscale || !matches!(depth, BitDepth::Eight | BitDepth::Sixteen) {
            return Err(format!(
                "a PNG of {color:?}, {} bits, allowed: grey without transparency, 8 or 16 bits",
                depth as u8
            ));
        }
        let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
        reader
            .next_frame(&mut pixels)
            .map_err(|error| format!("not a complete PNG: {error}"))?;
        let levels = match depth {
            BitDepth::Sixteen => pixels
                .chunks_exact(2)
                .map(|b| u16::from_be_bytes([b[0], b[1]]))
                .collect(),
            // 255 becomes 65535.
            _ => pixels.iter().map(|b| u16::from(*b) * 257).collect(),
        };
        Ok(Self {
            png: bytes.into(),
            levels,
            rows,
            columns,
        })
    }

    /// Rows, along x.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Columns, along y.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Brightness, 0 black to 1 white; row 0 is the picture's upper edge, column 0 its left one.
    ///
    /// # Panics
    /// If there is no such pixel.
    #[must_use]
    pub fn level(&self, row: usize, column: usize) -> f64 {
        f64::from(self.levels[row * self.columns + column]) / 65535.0
    }

    /// Largest difference of brightness between two pixels that many apart, along x and along y.
    pub(crate) fn steepest(&self, over: usize) -> [f64; 2] {
        let mut most = [0.0_f64; 2];
        for i in 0..self.rows {
            for j in 0..self.columns {
                let here = self.level(i, j);
                if i + over < self.rows {
                    most[0] = most[0].max((self.level(i + over, j) - here).abs());
                }
                if j + over < self.columns {
                    most[1] = most[1].max((self.level(i, j + over) - here).abs());
                }
            }
        }
        most
    }

    /// Is this text of a scenario the path of a picture, neither the picture itself nor the name of a built-in one?
    pub(crate) fn is_path(image: &str) -> bool {
        !image.starts_with(DATA_URL) && !PICTURES.iter().any(|(name, _)| *name == image)
    }

    /// Puts the picture itself where the terrain of a scenario names one, in this folder.
    pub(crate) fn embed(source: &Source, folder: Option<&Path>, scenario: &mut Table) -> Result<(), Error> {
        let terrain = scenario.get_mut("terrain").and_then(Value::as_table_mut);
        let Some(Value::String(image)) = terrain.and_then(|terrain| terrain.get_mut("image")) else {
            return Ok(());
        };
        if !image.starts_with(DATA_URL) {
            source.check_reference("terrain.image", image, "the picture")?;
            let path = folder.unwrap_or(Path::new("")).join(&*image);
            let built_in = PICTURES.iter().find(|(name, _)| *name == image.as_str());
            let bytes = match built_in {
                Some((_, bytes)) => bytes.to_vec(),
                None => read_regular(&path, MOST_PNG_BYTES).map_err(|error| {
                    let names = PICTURES.map(|(name, _)| name).join(", ");
                    let message = format!(
                        "{}: {error}, allowed: {names}, or the path of a PNG",
                        path.display()
                    );
                    source.refuse("terrain.image", message)
                })?,
            };
            Self::from_png(&bytes)
                .map_err(|reason| source.refuse("terrain.image", format!("{}: {reason}", path.display())))?;
            *image = data_url(DATA_URL, &bytes);
        }
        Ok(())
    }
}

impl Serialize for HeightMap {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&data_url(DATA_URL, &self.png))
    }
}

impl<'de> Deserialize<'de> for HeightMap {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let bytes = bytes_of(DATA_URL, deserializer)?;
        Self::from_png(&bytes).map_err(de::Error::custom)
    }
}
