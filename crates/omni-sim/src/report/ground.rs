//! Report of odometry in three dimensions, and its columns.

use omni_core::estimate::{EdgeEvent, EdgeKind};
use serde::{Deserialize, Serialize};

use super::numbers::{number, value};

/// Columns of odometry in three dimensions; then for each signal of [`GROUND_WHEEL`] one per wheel.
pub(super) const GROUND: [&str; 4] = ["odom_z_m", "odom_std_z_m", "odom_roll_rad", "odom_pitch_rad"];
pub(super) const GROUND_WHEEL: [&str; 8] = [
    "ground_z_m",
    "ground_edge",
    "ground_edge_height_m",
    "ground_edge_std_m",
    "ground_edge_x_m",
    "ground_edge_y_m",
    "ground_edge_normal_rad",
    "ground_edge_std_rad",
];
/// By their numbers in columns, 1 first; 0 is none.
const EDGES: [EdgeKind; 3] = [EdgeKind::Met, EdgeKind::Climbed, EdgeKind::Left];

/// Report of odometry in three dimensions ([`crate::config::OdometryKind::Ground`]) besides the pose in the plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroundReport {
    /// Height of the base's origin in the world \[m\]: at the start the true one.
    pub z_m: f64,
    /// Standard deviation of the height \[m\].
    pub std_z_m: f64,
    /// Angle of the base's y axis above the horizon \[rad\]: left side up.
    pub roll_rad: f64,
    /// Angle of the base's x axis above the horizon \[rad\]: nose up.
    pub pitch_rad: f64,
    /// One entry per wheel.
    pub wheels: Vec<GroundWheel>,
}

/// The ground below a wheel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroundWheel {
    /// Height of its contact in the world \[m\]; NaN where it is not known.
    pub z_m: f64,
    /// The edge that it met, climbed or left in this period.
    pub edge: Option<EdgeEvent<f64>>,
}

impl GroundReport {
    /// Edges that wheels met, climbed or left in this period.
    pub fn edges(&self) -> impl Iterator<Item = &EdgeEvent<f64>> {
        self.wheels.iter().filter_map(|wheel| wheel.edge.as_ref())
    }

    /// Height of the highest edge that a wheel has climbed in this period \[m\]; 0 if none has.
    #[must_use]
    pub fn climbed_m(&self) -> f64 {
        let climbed = self.edges().filter(|edge| edge.kind == EdgeKind::Climbed);
        climbed.map(|edge| edge.height_m).fold(0.0, f64::max)
    }

    pub(super) fn values(&self) -> Vec<f64> {
        let mut values = vec![self.z_m, self.std_z_m, self.roll_rad, self.pitch_rad];
        let of_wheels: Vec<_> = self.wheels.iter().map(GroundWheel::values).collect();
        for k in 0..GROUND_WHEEL.len() {
            values.extend(of_wheels.iter().map(|of_wheel| of_wheel[k]));
        }
        values
    }

    pub(super) fn from_values(values: &[f64], wheels: usize) -> Option<Self> {
        let (&[z_m, std_z_m, roll_rad, pitch_rad], of_wheels) = values.split_first_chunk()?;
        let wheel = |wheel: usize| {
            let mut of_wheel = [f64::NAN; GROUND_WHEEL.len()];
            for (k, value) in of_wheel.iter_mut().enumerate() {
                *value = *of_wheels.get(k * wheels + wheel)?;
            }
            GroundWheel::from_values(of_wheel, wheel)
        };
        z_m.is_finite().then_some(())?;
        Some(Self {
            z_m,
            std_z_m,
            roll_rad,
            pitch_rad,
            wheels: (0..wheels).map(wheel).collect::<Option<_>>()?,
        })
    }
}

impl GroundWheel {
    fn values(&self) -> [f64; GROUND_WHEEL.len()] {
        let Some(edge) = &self.edge else {
            let mut values = [f64::NAN; GROUND_WHEEL.len()];
            (values[0], values[1]) = (self.z_m, 0.0);
            return values;
        };
        let [x, y] = edge.place_m;
        let [normal, std_normal] = edge.angle.unwrap_or([f64::NAN; 2]);
        let kind = 1.0 + number(&EDGES, &edge.kind);
        let deviation_m = edge.height_deviation_m;
        [
            self.z_m,
            kind,
            edge.height_m,
            deviation_m,
            x,
            y,
            normal,
            std_normal,
        ]
    }

    fn from_values(values: [f64; GROUND_WHEEL.len()], wheel: usize) -> Option<Self> {
        let [z_m, kind, height_m, height_deviation_m, x, y, normal, std_normal] = values;
        let event = |kind| EdgeEvent {
            kind,
            wheel,
            height_m,
            height_deviation_m,
            place_m: [x, y],
            angle: normal.is_finite().then_some([normal, std_normal]),
        };
        let edge = match kind {
            0.0 => None,
            kind => Some(event(value(&EDGES, kind - 1.0)?)),
        };
        Some(Self { z_m, edge })
    }
}
