//! The maps between wheel velocities and the twist, for code that does not know how many wheels there are.

use omni_core::{ConfigError, Kinematics};

use crate::{MOST_WHEELS, Vehicle, for_wheel_count, wheel_count_refused};

/// The twist by wheel velocities, and back. A vehicle with fewer than [`MOST_WHEELS`] wheels has zeros for the others.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct WheelMaps {
    /// Least-squares map from wheel velocities \[rad/s\] to vx, vy \[m/s\] and wz \[rad/s\], one row per axis; a wheel
    /// that is excluded has a column of zeros.
    pub forward: [[f64; MOST_WHEELS]; 3],
    /// Map back, one row per wheel.
    pub inverse: [[f64; 3]; MOST_WHEELS],
}

impl WheelMaps {
    /// The twist of these velocities, or the displacement of these angles.
    #[must_use]
    pub fn twist(&self, wheels: &[f64; MOST_WHEELS]) -> [f64; 3] {
        self.forward
            .each_ref()
            .map(|row| row.iter().zip(wheels).map(|(by, wheel)| by * wheel).sum())
    }

    /// The part of each wheel's velocity, or angle, that no motion of the vehicle explains.
    #[must_use]
    pub fn residuals(&self, wheels: &[f64; MOST_WHEELS]) -> [f64; MOST_WHEELS] {
        let twist = self.twist(wheels);
        std::array::from_fn(|wheel| {
            let explained = self.inverse[wheel].iter().zip(&twist);
            wheels[wheel] - explained.map(|(by, axis)| by * axis).sum::<f64>()
        })
    }
}

fn maps<const N: usize>(
    vehicle: &Vehicle,
    excluded: &[bool; MOST_WHEELS],
) -> Result<Option<WheelMaps>, ConfigError> {
    let kinematics = Kinematics::<f64, N>::new(&vehicle.layout()?)?;
    let Some(kinematics) = kinematics.excluding(&std::array::from_fn(|i| excluded[i])) else {
        return Ok(None);
    };
    let (mut forward, mut inverse) = ([[0.0; MOST_WHEELS]; 3], [[0.0; 3]; MOST_WHEELS]);
    for (to, from) in forward.iter_mut().zip(kinematics.forward_matrix()) {
        to[..N].copy_from_slice(from);
    }
    inverse[..N].copy_from_slice(kinematics.inverse_matrix());
    Ok(Some(WheelMaps { forward, inverse }))
}

impl Vehicle {
    /// The maps of the wheels that are not excluded; none if they are too few to determine the motion.
    ///
    /// # Errors
    /// [`ConfigError`] if the wheels are no layout; those of a loaded vehicle are one.
    ///
    /// ```
    /// let mecanum4 = omni_config::Vehicle::load("mecanum4")?;
    /// let mut excluded = [false; omni_config::MOST_WHEELS];
    /// let maps = mecanum4.wheel_maps(&excluded)?.expect("four wheels");
    /// // Alike they drive it ahead, by their radius, and none of it is slip.
    /// let alike = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    /// let [vx, vy, wz] = maps.twist(&alike);
    /// assert!((vx - mecanum4.wheel[0].radius_m).abs() + vy.abs() + wz.abs() < 1e-12);
    /// assert!(maps.residuals(&alike).iter().all(|part| part.abs() < 1e-12));
    /// // Of two wheels three unknowns are not known.
    /// (excluded[0], excluded[1]) = (true, true);
    /// assert!(mecanum4.wheel_maps(&excluded)?.is_none());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn wheel_maps(&self, excluded: &[bool; MOST_WHEELS]) -> Result<Option<WheelMaps>, ConfigError> {
        let count = self.wheel.len();
        for_wheel_count!(count, maps[](self, excluded), |count| Err(wheel_count_refused(count)))
    }
}
