//! The rollers of a wheel, with what never changes while it turns.

use crate::config::RollerWheel;
use crate::world::barrel::BarrelShape;

/// The rollers of a wheel.
pub(super) struct Rollers {
    pub(super) shape: BarrelShape,
    /// Sine and cosine of the angle about the axle, and place along it \[m\], of each, the wheel not turned.
    pub(super) places: Vec<[f64; 3]>,
    pub(super) pitch_radius_m: f64,
    /// How far the wheel reaches from the centre of its axle \[m\].
    pub(super) reach_m: f64,
    /// Of each, about its own axis \[kg.m^2\].
    pub(super) inertia_kg_m2: f64,
    /// Damping of each bearing \[N.m.s/rad\].
    pub(super) friction_n_m_s_rad: f64,
    /// The index of the first among all of the vehicle's.
    pub(super) first: usize,
    /// How far a roller reaches from its middle \[m\].
    pub(super) longest_m: f64,
}

impl Rollers {
    pub(super) fn new(built: &RollerWheel, first: usize) -> Self {
        let [inertia_kg_m2, _] = built.roller_inertia_kg_m2();
        Self {
            shape: BarrelShape(built.barrel),
            places: built
                .places()
                .map(|(angle, along)| [libm::sin(angle), libm::cos(angle), along])
                .collect(),
            pitch_radius_m: built.pitch_radius_m,
            reach_m: length(
                built.radius_m,
                0.5 * built.row_gap_m + built.barrel.half_length_m(),
            ),
            inertia_kg_m2,
            friction_n_m_s_rad: built.friction_n_m_s_rad,
            first,
            longest_m: BarrelShape(built.barrel).reach_m(),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.places.len()
    }

    /// Sine and cosine of the angle of a roller, the wheel turned by an angle of that sine and cosine.
    pub(super) fn angle(&self, roller: usize, (sin, cos): (f64, f64)) -> (f64, f64) {
        let [own_sin, own_cos, _] = self.places[roller];
        (own_sin * cos + own_cos * sin, own_cos * cos - own_sin * sin)
    }
}

/// Length of the way to both sides of a right angle, the same on every machine.
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}
