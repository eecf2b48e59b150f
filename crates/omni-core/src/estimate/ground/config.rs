//! Noise of the sensors, and resolution of the recorded ground.

use crate::constants::constant_struct;
use crate::error::{each_within, period};
use crate::{ConfigError, Real};

/// Noise of the sensors of a [`GroundOdometry`](crate::estimate::GroundOdometry) and its resolution; checked by
/// [`GroundOdometry::new`](crate::estimate::GroundOdometry::new). Noise is the standard deviation of one reading.
///
/// ```
/// use omni_core::estimate::GroundOdometryConfig;
/// let config = GroundOdometryConfig::new(0.005_f32);
/// assert_eq!((config.period_s, config.cell_m), (0.005, 0.02));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct GroundOdometryConfig<R> {
    /// Time between steps \[s\], 1e-6 to 10.
    pub period_s: R,
    /// Noise of an actuator's velocity \[rad/s\], 1e-6 to 1000; 0.05.
    pub wheel_rad_s: R,
    /// Noise of each gyro \[rad/s\], 1e-6 to 1000; 0.014: at 200 Hz an angular random walk of 1 mrad per
    /// root of s.
    pub gyro_rad_s: R,
    /// Noise of the accelerometer \[m/s^2\], 1e-6 to 1000; 0.05.
    pub accelerometer_m_s2: R,
    /// Noise of the measured roll and pitch, slow drift included \[rad\], 1e-6 to 1; 0.001.
    pub attitude_rad: R,
    /// Noise of a hinge's angle \[rad\], 1e-6 to 1; 0.001.
    pub hinge_rad: R,
    /// Noise of a hinge's rate \[rad/s\], 1e-6 to 1000; 0.05.
    pub hinge_rad_s: R,
    /// Standard deviation of a wheel's slip in regular motion \[m/s\], 1e-6 to 1000; 0.005.
    pub slip_m_s: R,
    /// Side of a cell of the recorded ground \[m\], 0.001 to 10; 0.02. A third of a wheel's radius is suitable. The 512
    /// cells must hold the tracks of all wheels over the length of the vehicle.
    pub cell_m: R,
    /// Least height of a reported edge \[m\], 0.001 to 10; 0.006.
    pub edge_m: R,
}

constant_struct!(GroundOdometryConfig<R> {
    period_s: R,
    wheel_rad_s: R,
    gyro_rad_s: R,
    accelerometer_m_s2: R,
    attitude_rad: R,
    hinge_rad: R,
    hinge_rad_s: R,
    slip_m_s: R,
    cell_m: R,
    edge_m: R,
});

impl<R: Real> GroundOdometryConfig<R> {
    /// Every field but the period at its default.
    #[must_use]
    pub fn new(period_s: R) -> Self {
        Self {
            period_s,
            wheel_rad_s: R::of(0.05),
            gyro_rad_s: R::of(0.014),
            accelerometer_m_s2: R::of(0.05),
            attitude_rad: R::of(1e-3),
            hinge_rad: R::of(1e-3),
            hinge_rad_s: R::of(0.05),
            slip_m_s: R::of(5e-3),
            cell_m: R::of(0.02),
            edge_m: R::of(6e-3),
        }
    }

    pub(super) fn checked(self) -> Result<Self, ConfigError> {
        period(self.period_s)?;
        let rates = [
            ("wheel_rad_s", self.wheel_rad_s),
            ("gyro_rad_s", self.gyro_rad_s),
            ("accelerometer_m_s2", self.accelerometer_m_s2),
            ("hinge_rad_s", self.hinge_rad_s),
            ("slip_m_s", self.slip_m_s),
        ];
        each_within(&rates, &(1e-6..=1000.0), "1e-6 to 1000")?;
        let angles = [("attitude_rad", self.attitude_rad), ("hinge_rad", self.hinge_rad)];
        each_within(&angles, &(1e-6..=1.0), "1e-6 to 1")?;
        let lengths = [("cell_m", self.cell_m), ("edge_m", self.edge_m)];
        each_within(&lengths, &(1e-3..=10.0), "0.001 to 10")?;
        Ok(self)
    }
}
