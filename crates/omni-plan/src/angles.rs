//! Angles, and the sixteen headings that are searched.

use std::f64::consts::PI;

/// Headings of the lattice, evenly around.
pub(crate) const HEADINGS: usize = 16;
/// The difference between two of them \[rad\].
pub(crate) const HEADING_STEP_RAD: f64 = 2.0 * PI / HEADINGS as f64;

/// Angle of a heading \[rad\].
pub(crate) fn heading_rad(heading: usize) -> f64 {
    remainder(2.0 * PI * heading as f64 / HEADINGS as f64)
}

/// The heading that is nearest to an angle \[rad\].
pub(crate) fn nearest_heading(angle_rad: f64) -> usize {
    let part = (angle_rad / (2.0 * PI) * HEADINGS as f64).round();
    part.rem_euclid(HEADINGS as f64) as usize % HEADINGS
}

/// The same angle, over -pi to pi \[rad\].
pub(crate) fn remainder(angle_rad: f64) -> f64 {
    let turns = (angle_rad / (2.0 * PI)).round();
    angle_rad - 2.0 * PI * turns
}
