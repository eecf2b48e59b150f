//! The rollers of a wheel, as in a file.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{
    self, BEARING_N_M_S_RAD, CROWN_M, ROLLER_COUNT, ROLLER_MASS_KG, ROLLER_RADIUS_M, ROLLER_ROWS, WIDTH_M,
};

/// Simulation model of wheels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum WheelModel {
    /// Rollers if a ball does not represent a wheel of this vehicle on this ground, otherwise each wheel by its
    /// `contact`.
    #[default]
    Auto,
    /// Every wheel is a ball, valid or not: the fastest model.
    Ball,
    /// Every wheel has its own rollers, or the rollers of the vehicle's `[rollers]`: the reference.
    Rollers,
}

/// The rollers of a wheel: free barrels around its rim.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Rollers {
    /// Rollers a row, 3 to 32.
    #[serde(deserialize_with = "crate::integers::roller_count")]
    #[garde(adapt(ranges), range(min = ROLLER_COUNT.min, max = ROLLER_COUNT.max))]
    pub count: usize,
    /// Rows side by side, 1 or 2; the second one is turned by half a pitch and closes the gaps of the first.
    #[serde(default = "one_row", deserialize_with = "crate::integers::roller_rows")]
    #[garde(adapt(ranges), range(min = ROLLER_ROWS.min, max = ROLLER_ROWS.max))]
    pub rows: usize,
    /// Distance of the rows' planes along the axle \[m\], 0.001 to 10, for two rows; left out: as close as they fit.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = WIDTH_M.min, max = WIDTH_M.max))]
    pub row_gap_m: Option<f64>,
    /// Largest radius of a roller, in its middle \[m\], 0.00001 to 5, less than half the wheel's.
    #[garde(adapt(ranges), range(min = ROLLER_RADIUS_M.min, max = ROLLER_RADIUS_M.max))]
    pub radius_m: f64,
    /// Length of a roller \[m\], 0.001 to 10; left out: as long as fits, but no longer than needed to close the gaps.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = WIDTH_M.min, max = WIDTH_M.max))]
    pub length_m: Option<f64>,
    /// Difference of a roller's radius between its middle and its ends \[m\], from 0, a cylinder, to the value that
    /// follows the wheel's rim; left out: follows the rim.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = CROWN_M.min, max = CROWN_M.max))]
    pub crown_m: Option<f64>,
    /// Mass of a roller \[kg\], 1e-6 to 1000, part of the wheel's; left out: all rollers together
    /// are three tenths of the wheel's mass, or less, so that the hub keeps a fifth of its inertia.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = ROLLER_MASS_KG.min, max = ROLLER_MASS_KG.max))]
    pub roller_mass_kg: Option<f64>,
    /// Viscous damping of a roller's bearing \[N.m.s/rad\], 0 to 1.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = BEARING_N_M_S_RAD.min, max = BEARING_N_M_S_RAD.max))]
    pub friction_n_m_s_rad: f64,
}

fn one_row() -> usize {
    1
}
