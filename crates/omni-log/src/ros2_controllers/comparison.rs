//! Comparison of a vehicle with a controller's assumptions, and the errors about differences.

use omni_config::{Error, Vehicle};

/// How far a wheel may be from where a controller has it, as a part of what is compared: what is
/// left of files of three or four digits.
pub(super) const PART: f64 = 1e-3;

pub(super) fn refused(vehicle: &Vehicle, wheel: usize, key: &str, value: &str, allowed: &str) -> Error {
    Error::Key {
        file: format!("vehicle {}", vehicle.name),
        key: format!("wheel[{wheel}].{key}"),
        message: format!("{value}, allowed: {allowed}"),
    }
}

/// A wheel's radius, which each of the controllers has once for all.
pub(super) fn common_radius_m(vehicle: &Vehicle) -> Result<f64, Error> {
    let radius_m = vehicle.wheel[0].radius_m;
    let other = |wheel: &omni_config::WheelSpec| (wheel.radius_m - radius_m).abs() > PART * radius_m;
    match vehicle.wheel.iter().position(other) {
        None => Ok(radius_m),
        Some(i) => {
            let found = vehicle.wheel[i].radius_m.to_string();
            let allowed =
                format!("{radius_m}, that of wheel[0]: the controllers use one radius for all wheels");
            Err(refused(vehicle, i, "radius_m", &found, &allowed))
        }
    }
}

/// A direction with length 1.
pub(super) fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    [x / length, y / length]
}

pub(super) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// A vector as files have it, to six digits.
pub(super) fn shown(vector: [f64; 2]) -> String {
    let [x, y] = vector.map(|part| (part * 1e6).round() / 1e6 + 0.0);
    format!("[{x}, {y}]")
}
