//! Room before the first obstacle, for a vehicle of any length.

use omni_config::Vehicle;

/// Minimum distance from the foremost wheel to an obstacle \[m\].
const RUN_UP_M: f64 = 0.3;

/// Start of an obstacle for this vehicle \[m\]: at the usual position, or farther forward in whole tenths.
pub(crate) fn obstacle_at_m(vehicle: &Vehicle, usual_m: f64) -> f64 {
    let least = ahead_m(vehicle) + RUN_UP_M;
    usual_m.max((10.0 * least - 1e-6).ceil() / 10.0)
}

/// Forward extent of the foremost wheel from the origin \[m\].
fn ahead_m(vehicle: &Vehicle) -> f64 {
    let ends = vehicle
        .wheel
        .iter()
        .map(|wheel| wheel.position_m[0] + wheel.radius_m);
    ends.fold(0.0, f64::max)
}

/// Backward extent of the rearmost wheel from the origin \[m\].
pub(crate) fn behind_m(vehicle: &Vehicle) -> f64 {
    let ends = vehicle
        .wheel
        .iter()
        .map(|wheel| wheel.radius_m - wheel.position_m[0]);
    ends.fold(0.0, f64::max)
}
