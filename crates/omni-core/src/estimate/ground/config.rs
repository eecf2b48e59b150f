//! Noise of what the ground odometry reads, and resolution of the recorded ground.

use crate::constants::constant_struct;
use crate::error::each_within;
use crate::{ConfigError, Real};

/// Noise of attitude and hinges of a [`GroundOdometry`](crate::estimate::GroundOdometry), and its resolution; checked
/// by [`GroundOdometry::new`](crate::estimate::GroundOdometry::new). Noise is the standard deviation of one reading.
///
/// ```
/// use omni_core::estimate::GroundOdometryConfig;
/// let config = GroundOdometryConfig::<f32>::new();
/// assert_eq!((config.cell_m, config.edge_m), (0.02, 0.006));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct GroundOdometryConfig<R> {
    /// Error of roll and pitch that lasts for two seconds \[rad\], 1e-6 to 1; 0.0009. It is an error of the height, and
    /// of the level acceleration.
    pub attitude_rad: R,
    /// Noise of a hinge's angle \[rad\], 1e-6 to 1; 0.001.
    pub hinge_rad: R,
    /// Rate of rise of a wheel's centre below which its path counts as level \[m/s\], 0 to 10; 0.015. Noise of the
    /// rates would shorten every path.
    pub level_m_s: R,
    /// Time in which the accelerometer approaches the wheels \[s\], 0.01 to 1000; 0.4. A lasting difference is an error
    /// of the lean or a bias.
    pub lean_s: R,
    /// Side of a cell of the recorded ground \[m\], 0.001 to 10; 0.02. A third of a wheel's radius is suitable. The 512
    /// cells must hold the tracks of all wheels over the length of the vehicle.
    pub cell_m: R,
    /// Least height of a reported edge \[m\], 0.001 to 10; 0.006.
    pub edge_m: R,
    /// Mass of the vehicle with its load \[kg\], 0 to 1e9; 0 is unknown. With it torques show a vehicle that an edge
    /// holds while all its wheels turn. Half of the true mass takes steep ramps for edges.
    pub mass_kg: R,
}

constant_struct!(GroundOdometryConfig<R> {
    attitude_rad: R,
    hinge_rad: R,
    level_m_s: R,
    lean_s: R,
    cell_m: R,
    edge_m: R,
    mass_kg: R,
});

impl<R: Real> Default for GroundOdometryConfig<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real> GroundOdometryConfig<R> {
    /// Every field at its default.
    #[must_use]
    pub fn new() -> Self {
        Self {
            attitude_rad: R::of(0.9e-3),
            hinge_rad: R::of(1e-3),
            level_m_s: R::of(0.015),
            lean_s: R::of(0.4),
            cell_m: R::of(0.02),
            edge_m: R::of(6e-3),
            mass_kg: R::zero(),
        }
    }

    pub(super) fn checked(self) -> Result<Self, ConfigError> {
        let angles = [("attitude_rad", self.attitude_rad), ("hinge_rad", self.hinge_rad)];
        each_within(&angles, &(1e-6..=1.0), "1e-6 to 1")?;
        each_within(&[("level_m_s", self.level_m_s)], &(0.0..=10.0), "0 to 10")?;
        each_within(&[("lean_s", self.lean_s)], &(0.01..=1000.0), "0.01 to 1000")?;
        let lengths = [("cell_m", self.cell_m), ("edge_m", self.edge_m)];
        each_within(&lengths, &(1e-3..=10.0), "0.001 to 10")?;
        each_within(&[("mass_kg", self.mass_kg)], &(0.0..=1e9), "0 to 1e9")?;
        Ok(self)
    }
}
