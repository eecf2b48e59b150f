//! Where a vehicle may start: behind the obstacle, and beside every block.

use super::Scenario;
use crate::{Error, Source};

impl Scenario {
    /// An obstacle starts ahead of every wheel, and no block is under one, wherever the perturbation puts the vehicle.
    pub(super) fn check_start(&self, source: &Source) -> Result<(), Error> {
        self.check_start_beside_blocks(source)?;
        let Some(obstacle) = self.terrain.obstacle() else {
            return Ok(());
        };
        // How far forward a wheel's rim may lie under any of the headings.
        let (heading, spread) = (self.start.heading_rad, self.perturbation.yaw_rad);
        let foremost = |wheel: &crate::WheelSpec| {
            let [x, y] = wheel.position_m;
            let bearing = libm::atan2(y, x) + heading;
            // The least angle between the wheel's bearing and the forward direction.
            let off = (bearing - core::f64::consts::TAU * (bearing / core::f64::consts::TAU).round()).abs();
            libm::hypot(x, y) * libm::cos((off - spread).max(0.0)) + wheel.radius_m
        };
        let reach = self.vehicle.wheel.iter().map(foremost).fold(0.0, f64::max);
        let least = reach + self.start.x_m + self.perturbation.start_m;
        if obstacle.from_m <= least {
            let message = format!(
                "{}, allowed: more than {least:.3}, the farthest that a wheel may reach at the start",
                obstacle.from_m
            );
            return Err(source.refuse("terrain.start_x_m", message));
        }
        Ok(())
    }

    fn check_start_beside_blocks(&self, source: &Source) -> Result<(), Error> {
        let (sin, cos) = libm::sincos(self.start.heading_rad);
        for wheel in &self.vehicle.wheel {
            let [x, y] = wheel.position_m;
            let at = [
                self.start.x_m + cos * x - sin * y,
                self.start.y_m + sin * x + cos * y,
            ];
            let moved = self.perturbation.start_m + self.perturbation.yaw_rad * libm::hypot(x, y);
            let reach = wheel.radius_m + moved;
            let mut blocks = self.block.iter().enumerate();
            if let Some((i, block)) = blocks.find(|(_, block)| block.distance_m(at) <= reach) {
                let message = format!(
                    "x_m {:?}, y_m {:?}, allowed: more than {reach:.3} m from the start of wheel {:?} at {:.3}, {:.3}",
                    block.x_m, block.y_m, wheel.name, at[0], at[1]
                );
                return Err(source.refuse(format!("block[{i}]"), message));
            }
        }
        Ok(())
    }
}
