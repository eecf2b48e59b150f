//! Options of a plan: margins, speeds, and the quantity that it minimises.

use serde::{Deserialize, Serialize};

use crate::Error;
use crate::error::check_argument;

/// Most entries of a table of speeds.
const MOST_SPEEDS: usize = 72;

/// Quantity that a route minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Cost {
    /// Time \[s\]: distance over speed by side, turns, crossings at the chart's speed.
    #[default]
    Time,
    /// Energy for each kilogram \[J/kg\]: rolling resistance and lift; the energy of a descent is not recovered.
    Energy,
    /// Risk: 1 for an edge as high as the chart and the margin allow, its square below, and 0.01 to 0.11 per metre by
    /// the distance to obstacles.
    Risk,
}

/// Speed of a vehicle on even ground.
///
/// ```
/// let speeds = omni_plan::Speeds::new(0.4, 0.7);
/// assert_eq!(speeds.by_side_m_s, [[0.0, 0.4]]);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Speeds {
    /// Direction of travel in the vehicle's axes \[deg\] and speed \[m/s\], in the order of the
    /// angles; linear between them. One entry holds for all directions.
    pub by_side_m_s: Vec<[f64; 2]>,
    /// Yaw rate of turns in place \[rad/s\], 0.01 to 100.
    pub yaw_rad_s: f64,
}

impl Default for Speeds {
    fn default() -> Self {
        Self::new(0.4, 0.7)
    }
}

impl Speeds {
    /// The same speed in all directions \[m/s\], and a yaw rate \[rad/s\].
    #[must_use]
    pub fn new(speed_m_s: f64, yaw_rad_s: f64) -> Self {
        Self {
            by_side_m_s: vec![[0.0, speed_m_s]],
            yaw_rad_s,
        }
    }

    /// Speed in a direction of the vehicle's axes \[rad\], in m/s.
    #[must_use]
    pub fn speed_m_s(&self, side_rad: f64) -> f64 {
        let side = side_rad.to_degrees();
        let (Some(first), Some(last)) = (self.by_side_m_s.first(), self.by_side_m_s.last()) else {
            return 0.0;
        };
        // Around the circle, from the first entry on.
        let side = first[0] + (side - first[0]).rem_euclid(360.0);
        let mut before = first;
        for after in &self.by_side_m_s {
            if after[0] > side {
                return between(before, [after[0], after[1]], side);
            }
            before = after;
        }
        between(last, [first[0] + 360.0, first[1]], side)
    }

    /// The highest of them \[m/s\].
    pub(crate) fn highest_m_s(&self) -> f64 {
        self.by_side_m_s.iter().map(|entry| entry[1]).fold(0.0, f64::max)
    }
}

fn between(before: &[f64; 2], after: [f64; 2], at: f64) -> f64 {
    let width = after[0] - before[0];
    if width <= 0.0 {
        return before[1];
    }
    before[1] + (after[1] - before[1]) * (at - before[0]) / width
}

/// Options of a plan. Every key has a default.
///
/// ```
/// use omni_plan::{Cost, Options};
/// let options = Options { cost: Cost::Risk, margin: 0.7, ..Options::default() };
/// assert!(options.check().is_ok());
/// assert!(Options { margin: f64::NAN, ..Options::default() }.check().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// The quantity that the route minimises.
    pub cost: Cost,
    /// Part of the chart's limit that an edge may have, 0.1 to 1.
    pub margin: f64,
    /// Speeds on even ground.
    pub speeds: Speeds,
    /// Distance that is kept from edges and walls \[m\], 0 to 1. At least 0.71 of the lattice's
    /// spacing is kept on even ground.
    pub clearance_m: f64,
    /// Distance of travel before the vehicle meets an edge \[m\], 0 to 10.
    pub run_up_m: f64,
    /// Nearer to obstacles than this \[m\] a route costs more, 0 to 5.
    pub prefer_clearance_m: f64,
    /// And beside an obstacle by this part more, 0 to 10.
    pub clearance_weight: f64,
    /// Height differences below this are not edges \[m\], 0 to 0.1: more than the noise of the map, less than an edge
    /// that affects the vehicle. The heights of edges that are drawn over some cells are as exact.
    pub ignore_m: f64,
    /// Edges of one sign that are nearer to each other along the way are one \[m\], 0 to 1.
    pub merge_m: f64,
    /// Higher edges are walls, without a report of the missing height \[m\], 0.001 to 10.
    pub wall_m: f64,
    /// An edge is met squarely if its normal differs by no more from the direction of travel \[deg\], 0.1 to 20.
    pub square_deg: f64,
    /// Distance between two crossings that are tried along an edge \[m\], 0.01 to 10.
    pub portal_spacing_m: f64,
    /// Steepest slope, as rise over level length, 0.01 to 2. A chart with slopes may allow less.
    pub slope: f64,
    /// Distance between the positions that are searched \[m\], 0.001 to 10; at least a cell of the map.
    pub lattice_m: f64,
    /// Whether unknown cells may be driven on.
    pub unknown_is_free: bool,
    /// Coefficient of rolling resistance, for the energy, 0 to 1.
    pub rolling_resistance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            cost: Cost::Time,
            margin: 0.8,
            speeds: Speeds::default(),
            clearance_m: 0.05,
            run_up_m: 0.2,
            prefer_clearance_m: 0.3,
            clearance_weight: 0.5,
            ignore_m: 0.003,
            merge_m: 0.12,
            wall_m: 0.2,
            square_deg: 3.0,
            portal_spacing_m: 0.1,
            slope: 0.2,
            lattice_m: 0.05,
            unknown_is_free: false,
            rolling_resistance: 0.03,
        }
    }
}

impl Options {
    /// Whether every number is within its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), Error> {
        let ranges = [
            ("margin", self.margin, 0.1, 1.0),
            ("clearance_m", self.clearance_m, 0.0, 1.0),
            ("run_up_m", self.run_up_m, 0.0, 10.0),
            ("prefer_clearance_m", self.prefer_clearance_m, 0.0, 5.0),
            ("clearance_weight", self.clearance_weight, 0.0, 10.0),
            ("ignore_m", self.ignore_m, 0.0, 0.1),
            ("merge_m", self.merge_m, 0.0, 1.0),
            ("wall_m", self.wall_m, 0.001, 10.0),
            ("square_deg", self.square_deg, 0.1, 20.0),
            ("portal_spacing_m", self.portal_spacing_m, 0.01, 10.0),
            ("slope", self.slope, 0.01, 2.0),
            ("lattice_m", self.lattice_m, 1e-3, 10.0),
            ("rolling_resistance", self.rolling_resistance, 0.0, 1.0),
            ("speeds.yaw_rad_s", self.speeds.yaw_rad_s, 0.01, 100.0),
            (
                "speeds.by_side_m_s",
                self.speeds.by_side_m_s.len() as f64,
                1.0,
                MOST_SPEEDS as f64,
            ),
        ];
        for (name, value, least, most) in ranges {
            check_argument(name, value, least, most)?;
        }
        let mut before = -180.0;
        for [side_deg, speed_m_s] in &self.speeds.by_side_m_s {
            check_argument("speeds.by_side_m_s angle", *side_deg, before, 180.0)?;
            check_argument("speeds.by_side_m_s speed", *speed_m_s, 0.01, 100.0)?;
            before = *side_deg;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_linear_between_the_sides_and_go_around() {
        let mut speeds = Speeds::new(0.4, 0.7);
        assert_eq!(speeds.speed_m_s(2.0), 0.4);
        speeds.by_side_m_s = vec![[0.0, 0.4], [90.0, 0.2], [180.0, 0.4]];
        assert!((speeds.speed_m_s(45_f64.to_radians()) - 0.3).abs() < 1e-12);
        assert!((speeds.speed_m_s(180_f64.to_radians()) - 0.4).abs() < 1e-12);
        assert!((speeds.speed_m_s(-90_f64.to_radians()) - 0.4).abs() < 1e-12);
    }
}
