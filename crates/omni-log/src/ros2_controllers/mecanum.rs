//! Four mecanum wheels, as `mecanum_drive_controller` has them.
//!
//! In the frame of the wheels' middle, whose x axis is the way that they roll, they turn at `(vx -+ vy -+ L wz) / r`:
//! front left and rear right with `-vy`, the left ones with `-L wz`, where L is half of wheelbase and track together.
//! `base_frame_offset` is where the base is in that frame, and how far it is turned there.

use std::f64::consts::FRAC_PI_4;

use omni_config::{Error, Vehicle};

use super::comparison::{PART, common_radius_m, distance, refused, shown, unit};

/// A corner, seen from the wheels' middle.
pub(super) struct Corner {
    pub name: &'static str,
    front: bool,
    left: bool,
    /// Axis of the roller on the ground, counter-clockwise from the rolling direction.
    roller_angle_rad: f64,
}

const fn corner(name: &'static str, front: bool, left: bool) -> Corner {
    let roller_angle_rad = if front == left { -FRAC_PI_4 } else { FRAC_PI_4 };
    Corner {
        name,
        front,
        left,
        roller_angle_rad,
    }
}

/// The corners in the controller's order.
pub(super) const CORNERS: [Corner; 4] = [
    corner("front_left", true, true),
    corner("front_right", true, false),
    corner("rear_right", false, false),
    corner("rear_left", false, true),
];

pub(super) struct Mecanum {
    /// Indices of the wheels in the order of the corners.
    pub wheels: [usize; 4],
    pub wheels_radius_m: f64,
    /// Half of wheelbase and track together.
    pub reach_m: f64,
    /// The base in the frame of the wheels' middle: x, y and yaw.
    pub base_in_centre: [f64; 3],
}

impl Mecanum {
    pub(super) fn of(vehicle: &Vehicle) -> Result<Self, Error> {
        let forward = unit(vehicle.wheel[0].rolling_direction);
        let [dx, dy] = forward;
        let seen = |[x, y]: [f64; 2]| [dx * x + dy * y, dx * y - dy * x];
        let places = vehicle.wheel.iter().map(|wheel| seen(wheel.position_m));
        let places: Vec<_> = places.collect();
        let middle = [0, 1].map(|axis| places.iter().map(|place| place[axis]).sum::<f64>() / 4.0);
        let places: Vec<_> = places
            .iter()
            .map(|[x, y]| [x - middle[0], y - middle[1]])
            .collect();
        let reach = |[x, y]: [f64; 2]| x.abs() + y.abs();
        let reach_m = places.iter().copied().map(reach).sum::<f64>() / 4.0;
        let mut wheels = [usize::MAX; 4];
        for (i, place) in places.iter().enumerate() {
            let wheel = &vehicle.wheel[i];
            let is_there = |c: &Corner| c.front == (place[0] > 0.0) && c.left == (place[1] > 0.0);
            let at = CORNERS.iter().position(is_there).unwrap_or_default();
            let fits = (reach(*place) - reach_m).abs() <= PART * reach_m && wheels[at] == usize::MAX;
            if !fits {
                let allowed = "a corner of a rectangle along the rolling direction, one wheel at each corner (mecanum_drive_controller)";
                let found = shown(wheel.position_m);
                return Err(refused(vehicle, i, "position_m", &found, allowed));
            }
            wheels[at] = i;
            if distance(unit(wheel.rolling_direction), forward) > PART {
                let allowed = format!(
                    "{}, that of wheel[0]: mecanum_drive_controller needs the same positive direction for all wheels",
                    shown(forward)
                );
                let found = shown(wheel.rolling_direction);
                return Err(refused(vehicle, i, "rolling_direction", &found, &allowed));
            }
            let corner = &CORNERS[at];
            if (wheel.roller_angle_rad - corner.roller_angle_rad).abs() > PART {
                let (found, angle) = (wheel.roller_angle_rad, corner.roller_angle_rad);
                let allowed = format!(
                    "{angle}, 45 degrees, as {} of mecanum_drive_controller",
                    corner.name
                );
                return Err(refused(
                    vehicle,
                    i,
                    "roller_angle_rad",
                    &found.to_string(),
                    &allowed,
                ));
            }
        }
        Ok(Self {
            wheels,
            wheels_radius_m: common_radius_m(vehicle)?,
            reach_m,
            base_in_centre: [-middle[0], -middle[1], -libm::atan2(dy, dx)],
        })
    }
}
