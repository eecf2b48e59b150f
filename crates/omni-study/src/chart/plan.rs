//! The plan of a chart: the scenario of every run, checked.

use omni_config::{Override, Scenario, Vehicle, WheelModel, WheelSpec};
use sha2::{Digest, Sha256};
use toml::Value;

use super::edge::{Edge, size_m};
use super::symmetry::is_mirrored;
use super::{Approach, CHART_SCHEMA_VERSION, Chart, ChartStart};
use crate::Error;
use crate::key::{VERSION, hex, key};

/// Wheels meet the edge after so much way at least \[m\]: they have come to their speed.
const RUN_UP_M: f64 = 0.2;
/// A vehicle has this many times the time that its way takes.
const TIMES: f64 = 1.5;
/// And so much more for each attempt \[s\]: pushing until it is stuck, backing off, the next run-up.
const ATTEMPT_S: f64 = 5.0;
/// How far back runs may start \[m\]: most wheels have turned by the distance between two rollers then.
const BACK_M: f64 = 0.06;
/// And how far their headings may differ \[deg\].
const OFF_DEG: f64 = 1.0;
/// Number of further starts that climb the size for planning. With 7 of them 3 of 208 cells of the built-in vehicles
/// were climbed from 16 to 18 of 20 starts that the chart had not seen.
const CONFIRMING: usize = 27;
/// A run that turns the vehicle by so much has not climbed: a follower that corrects its heading
/// would have to work against the edge.
const MAX_YAW_DEG: f64 = 20.0;
/// Most sides times skews.
const MOST_APPROACHES: usize = 5000;

/// The request for a chart.
///
/// ```
/// use omni_study::{ChartPlan, ChartSetup};
/// let setup = ChartSetup { margin: 1.2, ..ChartSetup::new("chugo7") };
/// assert_eq!(ChartPlan::new(&setup).unwrap_err().to_string(), "chart: margin: 1.2, allowed: 0.1 to 1");
/// ```
#[derive(Clone, Debug)]
pub struct ChartSetup {
    /// A built-in vehicle's name, a file, or the vehicle itself as a table.
    pub vehicle: Value,
    /// Keys of every run that are replaced.
    pub overrides: Vec<Override>,
    /// A control policy; none for the best that the vehicle allows.
    pub policy: Option<String>,
    /// Coulomb friction coefficient between wheels and ground, 0 to 2.
    pub friction: f64,
    /// Speed commanded \[m/s\], 0.01 to 10.
    pub speed_m_s: f64,
    /// Fraction of the limit that a plan may use, 0.1 to 1.
    pub margin: f64,
    /// Number of starts that have to climb every size, 3 to 100.
    pub starts: usize,
    /// The obstacle.
    pub edges: Vec<Edge>,
    /// Directions of travel in the vehicle's axes \[deg\], -180 to 180; none for every 15 degrees.
    pub sides_deg: Vec<f64>,
    /// Directions of travel off the edge's normal \[deg\], -80 to 80.
    pub skews_deg: Vec<f64>,
}

impl ChartSetup {
    /// Steps up and down, every 15 degrees and squarely, at friction 0.7 and 0.3 m/s; three starts,
    /// and a margin of 0.8.
    #[must_use]
    pub fn new(vehicle: impl Into<Value>) -> Self {
        Self {
            vehicle: vehicle.into(),
            overrides: Vec::new(),
            policy: None,
            friction: 0.7,
            speed_m_s: 0.3,
            margin: 0.8,
            starts: 3,
            edges: vec![Edge::Step, Edge::Drop],
            sides_deg: Vec::new(),
            skews_deg: vec![0.0],
        }
    }
}

/// A chart to be made.
#[derive(Clone, Debug)]
pub struct ChartPlan {
    level: Scenario,
    pub(super) empty: Chart,
    approaches: Vec<Approach>,
    /// From the origin to the farthest rim \[m\].
    reach_m: f64,
}

impl ChartPlan {
    /// A chart, and the scenario of its runs.
    ///
    /// # Errors
    /// The error of the vehicle or a number, in one line.
    pub fn new(setup: &ChartSetup) -> Result<Self, Error> {
        check(setup)?;
        let mut keys = vec![
            Override::new("vehicle", setup.vehicle.clone()),
            Override::new("physics.engine", "articulated"),
            Override::new("physics.wheel_model", "rollers"),
            Override::new("terrain.friction", setup.friction),
            Override::new("command.frame", "body"),
            Override::new("stop_when_done", true),
        ];
        keys.extend(
            setup
                .policy
                .iter()
                .map(|policy| Override::new("control.policy", policy.as_str())),
        );
        for each in &setup.overrides {
            let own = ["terrain", "start", "command", "duration_s", "stop_when_done"];
            if own
                .iter()
                .any(|key| each.key() == *key || each.key().starts_with(&format!("{key}.")))
            {
                return Err(refused(
                    each.key(),
                    "replaced, allowed: keys that a chart does not vary itself",
                ));
            }
            keys.push(each.clone());
        }
        let level = Scenario::load("flat", &keys).map_err(|error| error.to_command("chart"))?;
        let vehicle = level.vehicle();
        let mirrored = setup.sides_deg.is_empty() && is_mirrored(vehicle);
        let every_15 = || (-11..=12).map(|side| 15.0 * f64::from(side));
        let sides: Vec<f64> = match (setup.sides_deg.is_empty(), mirrored) {
            (false, _) => setup.sides_deg.clone(),
            (true, false) => every_15().collect(),
            (true, true) => every_15().filter(|side| *side >= 0.0).collect(),
        };
        if sides.len() * setup.skews_deg.len() > MOST_APPROACHES {
            let message = format!(
                "{} times {} skews, allowed: {MOST_APPROACHES} at most",
                sides.len(),
                setup.skews_deg.len()
            );
            return Err(refused("sides_deg", &message));
        }
        let mut approaches = Vec::new();
        for edge in &setup.edges {
            for skew in &setup.skews_deg {
                for side in &sides {
                    approaches.push(Approach {
                        edge: *edge,
                        // Not -0.
                        side_deg: side + 0.0,
                        skew_deg: skew + 0.0,
                    });
                }
            }
        }
        approaches.sort_by(in_order);
        approaches.dedup();
        let empty = Chart {
            schema_version: CHART_SCHEMA_VERSION,
            omnistep: VERSION.into(),
            vehicle: vehicle.name.clone(),
            vehicle_sha256: vehicle_sha256(vehicle),
            scenario_key: key(&level)?,
            policy: level.control.law(),
            engine: level.physics.engine.name().into(),
            wheel_model: wheel_model(&level),
            friction: setup.friction,
            speed_m_s: setup.speed_m_s,
            margin: setup.margin,
            max_yaw_deg: MAX_YAW_DEG,
            mirrored,
            starts: setup.starts,
            start: (0..setup.starts + CONFIRMING).map(start).collect(),
            cell: Vec::new(),
        };
        let rim = |wheel: &WheelSpec| wheel.position_m[0].hypot(wheel.position_m[1]) + wheel.radius_m;
        let reach_m = vehicle.wheel.iter().map(rim).fold(0.0, f64::max);
        let plan = Self {
            level,
            empty,
            approaches,
            reach_m,
        };
        // What is wrong with the runs is said before the first of them.
        for approach in &plan.approaches {
            plan.scenario(approach, size_m(approach.edge.grid_mm()), &plan.empty.start[0])?;
        }
        Ok(plan)
    }

    /// The chart without a cell.
    #[must_use]
    pub fn empty(&self) -> Chart {
        self.empty.clone()
    }

    /// What is asked, in the order of edge, skew and side.
    #[must_use]
    pub fn approaches(&self) -> &[Approach] {
        &self.approaches
    }

    /// The scenario of the runs without an edge.
    #[must_use]
    pub fn level(&self) -> &Scenario {
        &self.level
    }

    /// A run: an edge of a size \[m\], approached from a start.
    ///
    /// # Errors
    /// The error of a key, in one line.
    ///
    /// ```
    /// use omni_study::{ChartPlan, ChartSetup};
    /// let plan = ChartPlan::new(&ChartSetup::new("mecanum4"))?;
    /// let left = plan.approaches().iter().find(|approach| approach.side_deg == 90.0).expect("a side of the chart");
    /// let run = plan.scenario(left, 0.01, &plan.empty().start[0])?;
    /// assert!((run.command.vy_m_s - 0.3).abs() < 1e-12); // to its left, and its left is ahead
    /// assert!((run.start.heading_rad + 1.570_796).abs() < 1e-6);
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    pub fn scenario(&self, approach: &Approach, size_m: f64, start: &ChartStart) -> Result<Scenario, Error> {
        let (edge, speed) = (approach.edge, self.empty.speed_m_s);
        let side_rad = approach.side_deg.to_radians();
        let heading_deg = approach.skew_deg - approach.side_deg + start.heading_deg;
        let heading_rad = (heading_deg - 360.0 * (heading_deg / 360.0).round()).to_radians();
        let start_x_m = self.reach_m + RUN_UP_M;
        let way_m = start_x_m - start.x_m + edge.length_m(size_m) + self.reach_m;
        let across_m_s = speed * approach.skew_deg.to_radians().cos();
        let attempts = 1.0 + f64::from(self.level.max_retries().unwrap_or(0));
        let terrain = edge.terrain(size_m, self.empty.friction, start_x_m, self.level.vehicle());
        let keys = [
            Override::new("terrain", terrain),
            Override::new("start.x_m", start.x_m),
            Override::new("start.heading_rad", heading_rad + 0.0),
            Override::new("command.vx_m_s", speed * side_rad.cos()),
            Override::new("command.vy_m_s", speed * side_rad.sin()),
            Override::new("duration_s", ATTEMPT_S * attempts + TIMES * way_m / across_m_s),
        ];
        Ok(self.level.with("chart", &keys)?)
    }
}

/// Another vehicle, another digest.
pub(super) fn vehicle_sha256(vehicle: &Vehicle) -> String {
    hex(&Sha256::digest(vehicle.to_toml()), 32)
}

/// As a file names it.
fn wheel_model(level: &Scenario) -> String {
    match level.wheel_model() {
        WheelModel::Rollers => "rollers".into(),
        _ => "ball".into(),
    }
}

/// Edge, skew, side.
pub(super) fn in_order(one: &Approach, other: &Approach) -> std::cmp::Ordering {
    let skews = || one.skew_deg.total_cmp(&other.skew_deg);
    let sides = || one.side_deg.total_cmp(&other.side_deg);
    one.edge.cmp(&other.edge).then_with(skews).then_with(sides)
}

/// The first stands at the origin, the others lie evenly between the farthest: multiples of irrational parts.
fn start(index: usize) -> ChartStart {
    let part = |irrational: f64| (index as f64 * irrational).fract();
    let rounded = |number: f64| (1e4 * number).round() / 1e4;
    ChartStart {
        x_m: rounded(-BACK_M * part(0.618_034)) + 0.0,
        heading_deg: rounded(OFF_DEG * (2.0 * (part(0.754_878) + 0.5).fract() - 1.0)) + 0.0,
    }
}

fn check(setup: &ChartSetup) -> Result<(), Error> {
    let ranges = [
        ("friction", vec![setup.friction], 0.0, 2.0),
        ("speed_m_s", vec![setup.speed_m_s], 0.01, 10.0),
        ("margin", vec![setup.margin], 0.1, 1.0),
        ("starts", vec![setup.starts as f64], 3.0, 100.0),
        ("sides_deg", setup.sides_deg.clone(), -180.0, 180.0),
        ("skews_deg", setup.skews_deg.clone(), -80.0, 80.0),
    ];
    for (key, values, least, most) in ranges {
        for value in values {
            if !(least..=most).contains(&value) {
                return Err(refused(key, &format!("{value}, allowed: {least} to {most}")));
            }
        }
    }
    let lists = [
        ("edges", setup.edges.is_empty()),
        ("skews_deg", setup.skews_deg.is_empty()),
    ];
    for (key, is_empty) in lists {
        if is_empty {
            return Err(refused(key, "empty, allowed: one or more"));
        }
    }
    Ok(())
}

fn refused(key: &str, message: &str) -> Error {
    Error::from(omni_config::Error::Key {
        file: "chart".into(),
        key: key.into(),
        message: message.into(),
    })
}
