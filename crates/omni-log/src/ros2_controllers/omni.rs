//! Omni wheels evenly spaced on a circle, as `omni_wheel_drive_controller` has them.
//!
//! Of n wheels the one with index i, counter-clockwise, is at the angle `theta = wheel_offset + 2 pi i / n`
//! from forward and turns at `(sin(theta) vx - cos(theta) vy - robot_radius wz) / wheel_radius`: its
//! rolling direction is clockwise about the origin.

use std::f64::consts::TAU;

use omni_config::{Error, Vehicle};

use super::comparison::{PART, common_radius_m, distance, refused, shown, unit};

pub(super) struct Omni {
    /// Indices of the wheels, counter-clockwise.
    pub order: Vec<usize>,
    /// Angle of the first of them from forward.
    pub offset_rad: f64,
    pub robot_radius_m: f64,
    pub wheel_radius_m: f64,
}

impl Omni {
    pub(super) fn of(vehicle: &Vehicle) -> Result<Self, Error> {
        let count = vehicle.wheel.len() as f64;
        let step_rad = TAU / count;
        let angle = |[x, y]: [f64; 2]| {
            let angle = libm::atan2(y, x).rem_euclid(TAU);
            // A hair to the right of forward is forward.
            if angle > TAU - PART * step_rad {
                angle - TAU
            } else {
                angle
            }
        };
        let wheels = vehicle.wheel.iter().enumerate();
        let mut turned: Vec<_> = wheels.map(|(i, w)| (angle(w.position_m), i)).collect();
        turned.sort_by(|a, b| a.0.total_cmp(&b.0));
        let offsets = turned
            .iter()
            .enumerate()
            .map(|(k, (angle, _))| angle - k as f64 * step_rad);
        let offset_rad = offsets.sum::<f64>() / count;
        let reaches = vehicle
            .wheel
            .iter()
            .map(|w| w.position_m[0].hypot(w.position_m[1]));
        let robot_radius_m = reaches.sum::<f64>() / count;
        let drive = Self {
            order: turned.into_iter().map(|(_, i)| i).collect(),
            offset_rad: if offset_rad.abs() < 1e-15 { 0.0 } else { offset_rad }, // rounding alone
            robot_radius_m,
            wheel_radius_m: common_radius_m(vehicle)?,
        };
        drive.check(vehicle, step_rad).map(|()| drive)
    }

    /// Is each wheel where the controller has it, and does it roll the way that the controller has it roll?
    fn check(&self, vehicle: &Vehicle, step_rad: f64) -> Result<(), Error> {
        for i in 0..vehicle.wheel.len() {
            let k = self.order.iter().position(|&wheel| wheel == i).unwrap_or(i);
            let theta = self.offset_rad + k as f64 * step_rad;
            let [sin, cos] = [libm::sin(theta), libm::cos(theta)];
            let wheel = &vehicle.wheel[i];
            let place = [cos, sin].map(|part| self.robot_radius_m * part);
            if distance(wheel.position_m, place) > PART * self.robot_radius_m {
                let allowed = format!(
                    "{} omni wheels every {} degrees on a circle about the origin (omni_wheel_drive_controller), or four mecanum wheels",
                    vehicle.wheel.len(),
                    (step_rad.to_degrees() * 1e3).round() / 1e3
                );
                return Err(refused(
                    vehicle,
                    i,
                    "position_m",
                    &shown(wheel.position_m),
                    &allowed,
                ));
            }
            let clockwise = [sin, -cos];
            if distance(unit(wheel.rolling_direction), clockwise) > PART {
                let allowed = format!(
                    "{}, clockwise about the origin, the direction that omni_wheel_drive_controller uses; docs/ros2-control.md \
                     shows how to reverse a wheel",
                    shown(clockwise)
                );
                let found = shown(wheel.rolling_direction);
                return Err(refused(vehicle, i, "rolling_direction", &found, &allowed));
            }
        }
        Ok(())
    }
}
