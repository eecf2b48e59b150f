//! Angles over one turn.

use std::f64::consts::PI;

/// The same angle, over -pi to pi \[rad\].
pub(crate) fn remainder(angle_rad: f64) -> f64 {
    let turns = (angle_rad / (2.0 * PI)).round();
    angle_rad - 2.0 * PI * turns
}
