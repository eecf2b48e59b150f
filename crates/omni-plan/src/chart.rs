//! The climb chart that a plan decides by, read from the file of `omnistep chart`.

use std::path::Path;

use omni_config::{MOST_TOML_BYTES, read_regular};
use serde::Deserialize;

use crate::Error;
use crate::error::{check_key, refused};

/// Version of the format of a chart's file.
const SCHEMA_VERSION: i64 = 1;
/// Most cells of a chart, as its program makes them.
const MOST_CELLS: usize = 100_000;
/// Frictions may differ by so much: a map keeps fewer digits.
const SAME_FRICTION: f64 = 1e-4;
/// Sides of a chart may differ by so much \[deg\].
const SAME_DEG: f64 = 1e-6;

/// Climbing limit of a side for one kind of edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limit {
    /// The greatest height \[m\].
    pub(crate) limit_m: f64,
    /// The height to plan with at the chart's own margin \[m\].
    pub(crate) climbs_m: f64,
}

/// Climbing limits of a vehicle with one side in front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Side {
    /// Direction of travel in the vehicle's axes \[deg\], over -180 to 180.
    pub(crate) side_deg: f64,
    pub(crate) step: Option<Limit>,
    pub(crate) drop: Option<Limit>,
    pub(crate) bar: Option<Limit>,
}

/// A chart at one friction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    pub(crate) friction: f64,
    pub(crate) speed_m_s: f64,
    pub(crate) margin: f64,
    /// In the order of the angles.
    pub(crate) sides: Vec<Side>,
    /// The least rise on a metre that it climbs from any side \[m\]; none if it has no slopes.
    slope: Option<f64>,
}

/// A vehicle's climb chart, at one friction or more. Only cells without skew count: a plan meets edges squarely.
///
/// ```
/// let text = r#"
/// schema_version = 1
/// vehicle = "cart"
/// friction = 0.7
/// speed_m_s = 0.3
/// margin = 0.8
/// mirrored = true
/// [[cell]]
/// edge = "step"
/// side_deg = 0.0
/// skew_deg = 0.0
/// climbs_m = 0.04
/// limit_m = 0.05
/// "#;
/// let chart = omni_plan::Chart::from_toml("cart.toml", text)?;
/// assert_eq!(chart.step_m(0.0, 0.7, 0.8), 0.04);
/// assert_eq!(chart.step_m(90.0, 0.7, 0.8), 0.0); // not on the chart
/// assert_eq!(chart.step_m(0.0, 0.3, 0.8), 0.0); // more slippery than the chart's ground
/// # Ok::<(), omni_plan::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    vehicle: String,
    /// In the order of friction.
    tables: Vec<Table>,
}

/// A chart's file. It has more keys, which say how it was made.
#[derive(Deserialize)]
struct ChartFile {
    vehicle: String,
    friction: f64,
    speed_m_s: f64,
    margin: f64,
    #[serde(default)]
    mirrored: bool,
    #[serde(default)]
    cell: Vec<CellOfFile>,
}

#[derive(Deserialize)]
struct CellOfFile {
    edge: String,
    side_deg: f64,
    skew_deg: f64,
    climbs_m: f64,
    limit_m: f64,
}

impl Chart {
    /// The chart of a file.
    ///
    /// # Errors
    /// Its first error, in one line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let file = path.as_ref().display().to_string();
        let bytes = read_regular(&path, MOST_TOML_BYTES)
            .map_err(|error| refused(&file, "top level", format!("{error}, allowed: a climb chart")))?;
        let text = String::from_utf8(bytes)
            .map_err(|_| refused(&file, "top level", "no text in UTF-8, allowed: a climb chart"))?;
        Self::from_toml(&file, &text)
    }

    /// The chart of a file's text; messages name it `file`.
    ///
    /// # Errors
    /// Its first error, in one line.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, Error> {
        let wrong = |error: toml::de::Error| {
            let line = error
                .span()
                .map_or(0, |span| text[..span.start.min(text.len())].lines().count());
            let message = error.message().lines().next().unwrap_or_default().to_owned();
            refused(file, &format!("line {line}"), message)
        };
        let keys: toml::Table = toml::from_str(text).map_err(wrong)?;
        let version = keys.get("schema_version");
        if version.and_then(toml::Value::as_integer) != Some(SCHEMA_VERSION) {
            let found = version.map_or_else(|| "missing".into(), ToString::to_string);
            return Err(refused(
                file,
                "schema_version",
                format!("{found}, allowed: {SCHEMA_VERSION}"),
            ));
        }
        let chart: ChartFile = toml::from_str(text).map_err(wrong)?;
        check_key(file, "friction", chart.friction, 0.0, 2.0)?;
        check_key(file, "speed_m_s", chart.speed_m_s, 0.01, 10.0)?;
        check_key(file, "margin", chart.margin, 0.1, 1.0)?;
        check_key(file, "cell", chart.cell.len() as f64, 1.0, MOST_CELLS as f64)?;
        Ok(Self {
            vehicle: chart.vehicle.clone(),
            tables: vec![Table::new(file, &chart)?],
        })
    }

    /// This chart combined with the same vehicle's chart for another friction.
    ///
    /// # Errors
    /// If it is of another vehicle, or there is one of this friction.
    pub fn with(mut self, other: Self) -> Result<Self, Error> {
        if other.vehicle != self.vehicle {
            return Err(Error::Argument {
                name: "chart",
                value: format!("of {}", other.vehicle),
                allowed: format!("of {}", self.vehicle),
            });
        }
        self.tables.extend(other.tables);
        self.tables
            .sort_by(|one, other| one.friction.total_cmp(&other.friction));
        for pair in self.tables.windows(2) {
            if (pair[1].friction - pair[0].friction).abs() < SAME_FRICTION {
                return Err(Error::Argument {
                    name: "chart",
                    value: format!("two of friction {}", pair[0].friction),
                    allowed: "one for each friction".into(),
                });
            }
        }
        Ok(self)
    }

    /// The vehicle's name.
    #[must_use]
    pub fn vehicle(&self) -> &str {
        &self.vehicle
    }

    /// The height of a step up that a side of the chart may meet \[m\], on ground of a friction,
    /// with a margin. 0 if the chart does not have that side, or no friction as low.
    #[must_use]
    pub fn step_m(&self, side_deg: f64, friction: f64, margin: f64) -> f64 {
        self.allowed_m(side_deg, friction, margin, |side| side.step)
    }

    /// The height of a step down, as [`step_m`](Self::step_m).
    #[must_use]
    pub fn drop_m(&self, side_deg: f64, friction: f64, margin: f64) -> f64 {
        self.allowed_m(side_deg, friction, margin, |side| side.drop)
    }

    fn allowed_m(
        &self,
        side_deg: f64,
        friction: f64,
        margin: f64,
        kind: impl Fn(&Side) -> Option<Limit>,
    ) -> f64 {
        let Some(table) = self.at(friction) else {
            return 0.0;
        };
        let wanted = over_minus_180(side_deg);
        let side = table
            .sides
            .iter()
            .find(|side| (side.side_deg - wanted).abs() < SAME_DEG);
        side.and_then(kind)
            .map_or(0.0, |limit| table.allowed_m(limit, margin))
    }

    /// The least friction that it is for.
    pub(crate) fn least_friction(&self) -> Option<f64> {
        self.tables.first().map(|table| table.friction)
    }

    /// The chart of the highest friction that does not exceed the ground's.
    pub(crate) fn at(&self, friction: f64) -> Option<&Table> {
        self.tables
            .iter()
            .rev()
            .find(|table| table.friction <= friction + SAME_FRICTION)
    }

    /// The steepest slope that it allows from every side, at a friction and with a margin; none if it has no slopes.
    pub(crate) fn slope(&self, friction: f64, margin: f64) -> Option<f64> {
        self.at(friction)?.slope.map(|rise| rise * margin)
    }
}

impl Table {
    fn new(file: &str, chart: &ChartFile) -> Result<Self, Error> {
        let mut sides: Vec<Side> = Vec::new();
        let mut slope: Option<f64> = None;
        for (number, cell) in chart.cell.iter().enumerate() {
            let key = |name: &str| format!("cell[{number}].{name}");
            check_key(file, &key("side_deg"), cell.side_deg, -180.0, 180.0)?;
            check_key(file, &key("skew_deg"), cell.skew_deg, -180.0, 180.0)?;
            check_key(file, &key("limit_m"), cell.limit_m, 0.0, 100.0)?;
            check_key(file, &key("climbs_m"), cell.climbs_m, 0.0, 100.0)?;
            if cell.skew_deg != 0.0 {
                continue;
            }
            let limit = Limit {
                limit_m: cell.limit_m,
                climbs_m: cell.climbs_m.min(cell.limit_m),
            };
            if cell.edge == "slope" {
                slope = Some(slope.unwrap_or(f64::INFINITY).min(cell.limit_m));
                continue;
            }
            let side_deg = over_minus_180(cell.side_deg);
            let both = chart.mirrored && side_deg != 0.0 && side_deg != 180.0;
            for side_deg in if both {
                vec![side_deg, -side_deg]
            } else {
                vec![side_deg]
            } {
                let at = sides
                    .iter()
                    .position(|side| (side.side_deg - side_deg).abs() < SAME_DEG);
                let at = at.unwrap_or_else(|| {
                    sides.push(Side {
                        side_deg,
                        step: None,
                        drop: None,
                        bar: None,
                    });
                    sides.len() - 1
                });
                match &*cell.edge {
                    "step" => sides[at].step = Some(limit),
                    "drop" => sides[at].drop = Some(limit),
                    "bar" => sides[at].bar = Some(limit),
                    "gap" => {}
                    other => {
                        let message = format!("{other:?}, allowed: step, drop, bar, slope, gap");
                        return Err(refused(file, &key("edge"), message));
                    }
                }
            }
        }
        sides.sort_by(|one, other| one.side_deg.total_cmp(&other.side_deg));
        Ok(Self {
            friction: chart.friction,
            speed_m_s: chart.speed_m_s,
            margin: chart.margin,
            sides,
            slope,
        })
    }

    /// Size for planning: the margin times the limit, and no more than the chart's starts confirmed.
    pub(crate) fn allowed_m(&self, limit: Limit, margin: f64) -> f64 {
        let confirmed = limit.climbs_m * margin / self.margin;
        confirmed.min(limit.limit_m * margin)
    }

    /// The best side up or down, and its limit.
    pub(crate) fn best(&self, up: bool) -> Option<(&Side, Limit)> {
        let kind = |side: &Side| if up { side.step } else { side.drop };
        let mut best: Option<(&Side, Limit)> = None;
        for side in &self.sides {
            if let Some(limit) = kind(side) {
                let better = best.is_none_or(|(_, other)| limit.limit_m > other.limit_m);
                if better {
                    best = Some((side, limit));
                }
            }
        }
        best
    }

    /// The smaller of the two sides around an angle, up or down: what may be planned with \[m\].
    pub(crate) fn between_m(&self, side_rad: f64, up: bool, margin: f64) -> f64 {
        let side_deg = over_minus_180(side_rad.to_degrees());
        let value = |side: &Side| {
            let limit = if up { side.step } else { side.drop };
            limit.map_or(0.0, |limit| self.allowed_m(limit, margin))
        };
        let after = self
            .sides
            .iter()
            .position(|side| side.side_deg >= side_deg - SAME_DEG);
        let after = after.unwrap_or(0);
        let Some(next) = self.sides.get(after) else {
            return 0.0;
        };
        if (next.side_deg - side_deg).abs() < SAME_DEG {
            return value(next);
        }
        let before = (after + self.sides.len() - 1) % self.sides.len();
        value(next).min(value(&self.sides[before]))
    }
}

/// The same angle, over -180 and up to 180 \[deg\].
pub(crate) fn over_minus_180(angle_deg: f64) -> f64 {
    let angle = angle_deg.rem_euclid(360.0);
    if angle > 180.0 { angle - 360.0 } else { angle }
}

/// The side that leads, in words.
pub(crate) fn side_name(side_deg: f64) -> String {
    match side_deg {
        0.0 => "the front".into(),
        90.0 => "the left".into(),
        -90.0 => "the right".into(),
        180.0 => "the rear".into(),
        other => format!("side {other} deg"),
    }
}
