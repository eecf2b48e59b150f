//! Maps for users of Nav2: an isotropic costmap, a layer for each of sixteen headings, and a mask of speeds.

use std::fs;
use std::path::{Path, PathBuf};

use image::codecs::pnm::{PnmEncoder, PnmSubtype, SampleEncoding};
use image::{ExtendedColorType, ImageEncoder};
use serde::Serialize;

use crate::angles::{HEADINGS, heading_rad};
use crate::edge_line::NONE;
use crate::error::{check_argument, refused};
use crate::occupancy::distances;
use crate::{Error, Planner};

/// Cost of a cell that nothing may enter \[%\].
const LETHAL: u8 = 100;
/// Cost of an edge as high as is allowed \[%\].
const HIGHEST_EDGE: f64 = 98.0;

/// A ROS map_server map: its YAML and its picture.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct MapFiles {
    /// The name of both files, without their endings.
    pub name: String,
    /// The YAML, which names the picture.
    pub yaml: String,
    /// The picture, a PGM.
    pub pgm: Vec<u8>,
}

/// The keys of a map_server's file. With these thresholds and `scale` a cost of 0 to 100 % is read as it is.
#[derive(Serialize)]
struct Keys {
    image: String,
    mode: &'static str,
    resolution: f64,
    origin: [f64; 3],
    negate: i32,
    occupied_thresh: f64,
    free_thresh: f64,
}

impl MapFiles {
    /// Writes both files into a folder, which is made if it is not there.
    ///
    /// # Errors
    /// If one cannot be written.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<[PathBuf; 2], Error> {
        let folder = folder.as_ref();
        let path = |ending: &str| folder.join(format!("{}.{ending}", self.name));
        let paths = [path("yaml"), path("pgm")];
        let wrong = |path: &Path, source: std::io::Error| {
            Error::from(omni_config::Error::Io {
                path: path.into(),
                source,
            })
        };
        fs::create_dir_all(folder).map_err(|error| wrong(folder, error))?;
        fs::write(&paths[0], &self.yaml).map_err(|error| wrong(&paths[0], error))?;
        fs::write(&paths[1], &self.pgm).map_err(|error| wrong(&paths[1], error))?;
        Ok(paths)
    }
}

impl Planner {
    /// Costs that do not depend on the direction: an edge costs its height over the best side's, up to 98 %; lethal
    /// are walls, closed cells and edges that no side climbs. A planner that uses it does not know from which side.
    ///
    /// # Errors
    /// If the name is no file name, or the files cannot be made.
    ///
    /// ```
    /// use omni_plan::{Chart, Footprint, Grid, Map, Options, Planner};
    /// let grid = Grid::new(40, 40, 0.05, [0.0, 0.0])?;
    /// let map = Map::from_heights(grid, vec![0.0; 1600])?;
    /// let text = "schema_version = 1\nvehicle = 'a'\nfriction = 0.7\nspeed_m_s = 0.3\nmargin = 0.8\n\
    ///     cell = [{ edge = 'step', side_deg = 0.0, skew_deg = 0.0, climbs_m = 0.04, limit_m = 0.05 }]";
    /// let chart = Chart::from_toml("a.toml", text)?;
    /// let planner = Planner::new(&map, &chart, &Footprint::rectangle(0.3, 0.2)?, Options::default())?;
    /// let files = planner.costmap("hall")?;
    /// assert!(files.yaml.contains("hall.pgm") && files.pgm.starts_with(b"P5"));
    /// # Ok::<(), omni_plan::Error>(())
    /// ```
    pub fn costmap(&self, name: &str) -> Result<MapFiles, Error> {
        let heights = self.edge_heights();
        let costs = (0..self.ground.grid.cells()).map(|cell| {
            let (height_m, _) = heights[cell];
            let allowed_m = self.chart.at(self.ground.friction[cell]).and_then(|table| {
                let (_, limit) = table.best(true)?;
                Some(table.allowed_m(limit, self.options.margin))
            });
            self.cost(cell, height_m, allowed_m.unwrap_or(0.0))
        });
        self.files(name, costs.collect())
    }

    /// Costs for a vehicle of one heading, 0 to 15 times 22.5 degrees counter-clockwise from the world's x: an edge is
    /// lethal unless the side that leads uphill climbs it; between two sides of the chart the smaller limit counts.
    ///
    /// # Errors
    /// As [`costmap`](Self::costmap), and where there is no such heading.
    pub fn heading_costmap(&self, heading: usize, name: &str) -> Result<MapFiles, Error> {
        check_argument("heading", heading as f64, 0.0, (HEADINGS - 1) as f64)?;
        let heights = self.edge_heights();
        let costs = (0..self.ground.grid.cells()).map(|cell| {
            let (height_m, line) = heights[cell];
            let table = self.chart.at(self.ground.friction[cell]);
            let allowed_m = match (table, self.lines.lines.get(line as usize)) {
                (Some(table), Some(line)) => {
                    let uphill_rad = line.normal[1].atan2(line.normal[0]);
                    table.between_m(uphill_rad - heading_rad(heading), true, self.options.margin)
                }
                _ => 0.0,
            };
            self.cost(cell, height_m, allowed_m)
        });
        self.files(name, costs.collect())
    }

    /// A mask for Nav2's speed filter, of type 1 with multiplier 1 and base 0: the chart's speed near edges
    /// that some side climbs, in per cent of the highest speed on even ground; 0, no limit, elsewhere.
    ///
    /// # Errors
    /// As [`costmap`](Self::costmap).
    pub fn speed_mask(&self, name: &str) -> Result<MapFiles, Error> {
        let heights = self.edge_heights();
        let grid = self.ground.grid;
        let climbable = |cell: usize| {
            let (height_m, _) = heights[cell];
            let table = self.chart.at(self.ground.friction[cell]);
            let best =
                table.and_then(|table| Some(table.allowed_m(table.best(true)?.1, self.options.margin)));
            height_m > 0.0 && best.is_some_and(|best| height_m <= best + 1e-6)
        };
        // Without an edge every cell is far from one; the border does not count.
        let any = (0..grid.cells()).any(climbable);
        let away = distances(&grid, climbable);
        let border = |cell: usize| {
            let (column, row) = (cell % grid.columns, cell / grid.columns);
            let least = (column + 1).min(grid.columns - column);
            least.min((row + 1).min(grid.rows - row)) as f64
        };
        let near = (self.options.run_up_m + self.footprint.radius_m()) / grid.resolution_m;
        let highest_m_s = self.options.speeds.highest_m_s();
        let percents = (0..grid.cells()).map(|cell| {
            let is_near = any && away[cell] <= near && (away[cell] < border(cell) || climbable(cell));
            let table = self.chart.at(self.ground.friction[cell]).filter(|_| is_near);
            table.map_or(0, |table| {
                let part = 100.0 * table.speed_m_s / highest_m_s;
                if part >= 100.0 {
                    0
                } else {
                    part.floor().max(1.0) as u8
                }
            })
        });
        self.files(name, percents.collect())
    }

    /// Writes the costmap (`NAME.yaml`), the costmaps of the headings (`NAME-heading-00.yaml` to `15`) and the mask of
    /// speeds (`NAME-speed.yaml`), each with its picture, into a folder; returns the YAML files.
    ///
    /// # Errors
    /// If the name is no file name, or a file cannot be written.
    pub fn write_costmaps(&self, folder: impl AsRef<Path>, name: &str) -> Result<Vec<PathBuf>, Error> {
        let mut files = vec![self.costmap(name)?, self.speed_mask(&format!("{name}-speed"))?];
        for heading in 0..HEADINGS {
            files.push(self.heading_costmap(heading, &format!("{name}-heading-{heading:02}"))?);
        }
        let mut written = Vec::with_capacity(files.len());
        for each in files {
            let [yaml, _] = each.write(&folder)?;
            written.push(yaml);
        }
        Ok(written)
    }

    /// The highest edge at each cell's borders \[m\], and its line.
    fn edge_heights(&self) -> Vec<(f64, u32)> {
        let grid = self.ground.grid;
        let mut heights = vec![(0.0, NONE); grid.cells()];
        let merged = self.ground.merged(self.options.merge_m);
        let of_lines = [&self.lines.of_x, &self.lines.of_y];
        for ((rises, of_line), next) in merged.iter().zip(of_lines).zip([1, grid.columns]) {
            for cell in 0..grid.cells() {
                let rise_m = rises[cell].abs();
                if rise_m == 0.0 {
                    continue;
                }
                for beside in [cell, cell + next] {
                    if rise_m > heights[beside].0 {
                        heights[beside] = (rise_m, of_line[cell]);
                    }
                }
            }
        }
        heights
    }

    fn cost(&self, cell: usize, height_m: f64, allowed_m: f64) -> u8 {
        if self.ground.closed[cell] || height_m > allowed_m + 1e-6 {
            LETHAL
        } else if height_m == 0.0 {
            0
        } else {
            (HIGHEST_EDGE * height_m / allowed_m.max(height_m)).ceil() as u8
        }
    }

    /// A map of costs from 0 to 100 %, row by row, the first at the least y.
    fn files(&self, name: &str, percents: Vec<u8>) -> Result<MapFiles, Error> {
        if name.is_empty() || name.len() > 100 || name.contains(['/', '\\', '\0', '\n']) {
            return Err(Error::Argument {
                name: "name",
                value: format!("{name:?}"),
                allowed: "1 to 100 characters of a file name".into(),
            });
        }
        let grid = self.ground.grid;
        let mut pixels = Vec::with_capacity(percents.len());
        for row in percents.chunks(grid.columns).rev() {
            for percent in row {
                pixels.push(255 - (2.55 * f64::from(*percent)).round() as u8);
            }
        }
        let mut pgm = Vec::new();
        PnmEncoder::new(&mut pgm)
            .with_subtype(PnmSubtype::Graymap(SampleEncoding::Binary))
            .write_image(
                &pixels,
                grid.columns as u32,
                grid.rows as u32,
                ExtendedColorType::L8,
            )
            .map_err(|error| refused(name, "image", error.to_string()))?;
        let keys = Keys {
            image: format!("{name}.pgm"),
            mode: "scale",
            resolution: grid.resolution_m,
            origin: [grid.origin_m[0], grid.origin_m[1], 0.0],
            negate: 0,
            occupied_thresh: 1.0,
            free_thresh: 0.0,
        };
        let yaml =
            serde_saphyr::to_string(&keys).map_err(|error| refused(name, "top level", error.to_string()))?;
        Ok(MapFiles {
            name: name.into(),
            yaml,
            pgm,
        })
    }
}
