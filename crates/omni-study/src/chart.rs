//! The climb chart: the greatest edge that a vehicle climbs, by the side that leads and by skew.

mod bounds;
mod compute;
mod edge;
mod file;
mod plan;
mod scan;
mod symmetry;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use bounds::clearance_m;
pub use compute::chart;
pub use edge::Edge;
pub use plan::{ChartPlan, ChartSetup};

/// Version of the format of a chart's file.
pub const CHART_SCHEMA_VERSION: u32 = 1;

/// A chart, as its file holds it: all that went in, and a cell for each approach.
///
/// ```
/// use omni_study::{Chart, ChartPlan, ChartSetup, Edge, chart};
/// let setup = ChartSetup { sides_deg: vec![0.0], edges: vec![Edge::Step], ..ChartSetup::new("omni3") };
/// let plan = ChartPlan::new(&setup)?;
/// let omni3 = chart(&plan, &plan.empty(), None, &false.into(), |_| Ok(()))?;
/// let ahead = &omni3.cell[0];
/// assert!(ahead.climbs_m > 0.002 && ahead.climbs_m <= 0.8 * ahead.limit_m); // one wheel leads, with its rollers across
/// assert_eq!(Chart::from_toml("omni3.toml", &omni3.to_toml()?)?, omni3);
/// # Ok::<(), omni_study::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Chart {
    /// Version of the format, 1.
    pub schema_version: u32,
    /// Version of the program.
    pub omnistep: String,
    /// The vehicle's name.
    pub vehicle: String,
    /// SHA-256 of the vehicle, its gains resolved: another vehicle, another digest.
    pub vehicle_sha256: String,
    /// [`key`](crate::key) of the scenario on level ground: every key that was set is in it.
    pub scenario_key: String,
    /// The control law.
    pub policy: String,
    /// The physics engine.
    pub engine: String,
    /// The wheel model.
    pub wheel_model: String,
    /// Coulomb friction coefficient between wheels and ground.
    pub friction: f64,
    /// Speed commanded \[m/s\].
    pub speed_m_s: f64,
    /// `climbs_m` of a cell is this part of its `limit_m`, or less.
    pub margin: f64,
    /// A run that turns the vehicle by this angle has not climbed \[deg\].
    pub max_yaw_deg: f64,
    /// Cells of negative sides equal the cells of positive sides: the vehicle is symmetric.
    pub mirrored: bool,
    /// Number of entries of `start` that have to climb each height.
    pub starts: usize,
    /// Starts of the runs; all of them have to climb `climbs_m`.
    pub start: Vec<ChartStart>,
    /// The approaches, in the order of edge, skew and side.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cell: Vec<ChartCell>,
}

/// Start of a run, relative to the chart's approach.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ChartStart {
    /// World x \[m\]: at which phase of their rotation wheels meet the edge.
    pub x_m: f64,
    /// Heading relative to the approach \[deg\].
    pub heading_deg: f64,
}

/// How an edge is approached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Approach {
    /// The obstacle.
    pub edge: Edge,
    /// Direction of travel in the vehicle's axes \[deg\], counter-clockwise: 0 is forward, 90 is left.
    pub side_deg: f64,
    /// Direction of travel off the edge's normal \[deg\], counter-clockwise.
    pub skew_deg: f64,
}

impl ChartStart {
    /// At a world x \[m\], with a heading relative to the approach \[deg\].
    #[must_use]
    pub fn new(x_m: f64, heading_deg: f64) -> Self {
        Self { x_m, heading_deg }
    }
}

impl Approach {
    /// An edge, from a side and with a skew \[deg\].
    #[must_use]
    pub fn new(edge: Edge, side_deg: f64, skew_deg: f64) -> Self {
        Self {
            edge,
            side_deg,
            skew_deg,
        }
    }
}

/// Climbing limits of a vehicle on one approach.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ChartCell {
    /// The obstacle.
    pub edge: Edge,
    /// Direction of travel in the vehicle's axes \[deg\].
    pub side_deg: f64,
    /// Direction of travel off the edge's normal \[deg\].
    pub skew_deg: f64,
    /// The size for planning \[m\]: the margin is included, and every start climbed it.
    pub climbs_m: f64,
    /// The greatest size up to which every size was climbed from the first starts \[m\].
    pub limit_m: f64,
    /// The least size that some start did not climb \[m\]; none if every size was climbed that is tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fails_m: Option<f64>,
    /// Why not: the verdict of that run, `turned`, or the bound beyond which nothing is tried:
    /// `clearance`, `climb_limits` or `largest`.
    pub because: String,
    /// The greatest step that the bodies clear ([`clearance_m`]) \[m\]; none if the vehicle's shape bounds none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearance_m: Option<f64>,
    /// The greatest step that the balance of forces does not exclude at this speed \[m\]; none if that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub climb_limits_m: Option<f64>,
}

impl ChartCell {
    /// How its edge is approached.
    #[must_use]
    pub fn approach(&self) -> Approach {
        Approach::new(self.edge, self.side_deg, self.skew_deg)
    }
}
