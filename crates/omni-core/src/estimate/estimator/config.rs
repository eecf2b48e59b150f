//! Noise of the sensors, and the assumed slip.

use crate::constants::constant_struct;
use crate::error::{each_within, period, within};
use crate::{ConfigError, Real};

/// Assumptions of an [`Estimator`](crate::estimate::Estimator) about its sensors and its ground; checked by
/// [`Estimator::new`](crate::estimate::Estimator::new). Every standard deviation applies to one reading.
///
/// ```
/// use omni_core::estimate::{Estimator, EstimatorConfig};
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
/// let mut config = EstimatorConfig::new(1e-3);
/// config.gyro_rad_s = -0.01;
/// let error = Estimator::new(config, &kinematics).unwrap_err();
/// assert_eq!(error.to_string(), "gyro_rad_s = -0.01, allowed: 1e-6 to 1000");
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct EstimatorConfig<R> {
    /// Time between steps \[s\], 1e-6 to 10.
    pub period_s: R,
    /// Noise of a wheel's velocity \[rad/s\], 1e-6 to 1000; 0.1. For what a counter counts in a period, a count over
    /// `sqrt(6 * period_s * 0.05 s)`: errors of neighbours cancel.
    pub wheel_rad_s: R,
    /// Noise of the gyro \[rad/s\], 1e-6 to 1000; 0.01.
    pub gyro_rad_s: R,
    /// Noise of the accelerometer \[m/s^2\], 1e-6 to 1000; 0.05.
    pub accelerometer_m_s2: R,
    /// Random walk of the velocity without an accelerometer reading \[m/s per root of s\], 1e-6 to 1000; 0.3: by 1
    /// m/s^2 for a tenth of a second, repeatedly.
    pub wander_m_s_per_sqrt_s: R,
    /// Deviation of the gyro's bias at the start \[rad/s\], 1e-6 to 1000; 0.02.
    pub bias_rad_s: R,
    /// Random walk of the bias \[rad/s per root of s\], 1e-9 to 1000; 1e-4.
    pub bias_walk_rad_s_per_sqrt_s: R,
    /// Deviation of the accelerometer's bias at the start, or of what a lean adds that is not measured \[m/s^2\], 1e-6
    /// to 1000; 0.05.
    pub accelerometer_bias_m_s2: R,
    /// Random walk of it \[m/s^2 per root of s\], 1e-9 to 1000; 0.01: an attitude that levels the readings and
    /// wanders by 1 mrad per root of s.
    pub accelerometer_bias_walk_m_s2_per_sqrt_s: R,
    /// Slip of the whole vehicle that goes unnoticed while its wheels agree \[m/s\], 1e-6 to 1000; 0.001.
    pub slip_m_s: R,
    /// Time in which a slip comes and goes \[s\], 1e-3 to 100; 0.2. At least the period.
    pub slip_s: R,
    /// Averages over 50 ms up to which a vehicle whose command is rest stands: of the wheels beyond their
    /// noise \[rad/s\], 0 to 1000; 0.05.
    pub still_wheel_rad_s: R,
    /// Root mean square of the gyro about its own average, beyond its noise \[rad/s\], 0 to 1000;
    /// 0.05. The average itself has to be within four deviations of the estimated bias: initially four times
    /// `bias_rad_s`.
    pub still_gyro_rad_s: R,
    /// Of each acceleration, beyond four deviations of its bias \[m/s^2\], 0 to 1000; 0.1.
    pub still_m_s2: R,
}

constant_struct!(EstimatorConfig<R> {
    period_s: R,
    wheel_rad_s: R,
    gyro_rad_s: R,
    accelerometer_m_s2: R,
    wander_m_s_per_sqrt_s: R,
    bias_rad_s: R,
    bias_walk_rad_s_per_sqrt_s: R,
    accelerometer_bias_m_s2: R,
    accelerometer_bias_walk_m_s2_per_sqrt_s: R,
    slip_m_s: R,
    slip_s: R,
    still_wheel_rad_s: R,
    still_gyro_rad_s: R,
    still_m_s2: R,
});

impl<R: Real> EstimatorConfig<R> {
    /// Every field but the period as its documentation says.
    #[must_use]
    pub fn new(period_s: R) -> Self {
        Self {
            period_s,
            wheel_rad_s: R::of(0.1),
            gyro_rad_s: R::of(0.01),
            accelerometer_m_s2: R::of(0.05),
            wander_m_s_per_sqrt_s: R::of(0.3),
            bias_rad_s: R::of(0.02),
            bias_walk_rad_s_per_sqrt_s: R::of(1e-4),
            accelerometer_bias_m_s2: R::of(0.05),
            accelerometer_bias_walk_m_s2_per_sqrt_s: R::of(0.01),
            slip_m_s: R::of(1e-3),
            slip_s: R::of(0.2),
            still_wheel_rad_s: R::of(0.05),
            still_gyro_rad_s: R::of(0.05),
            still_m_s2: R::of(0.1),
        }
    }

    pub(super) fn checked(self) -> Result<Self, ConfigError> {
        period(self.period_s)?;
        let deviations = [
            ("wheel_rad_s", self.wheel_rad_s),
            ("gyro_rad_s", self.gyro_rad_s),
            ("accelerometer_m_s2", self.accelerometer_m_s2),
            ("wander_m_s_per_sqrt_s", self.wander_m_s_per_sqrt_s),
            ("bias_rad_s", self.bias_rad_s),
            ("accelerometer_bias_m_s2", self.accelerometer_bias_m_s2),
            ("slip_m_s", self.slip_m_s),
        ];
        each_within(&deviations, &(1e-6..=1000.0), "1e-6 to 1000")?;
        let walks = [
            ("bias_walk_rad_s_per_sqrt_s", self.bias_walk_rad_s_per_sqrt_s),
            (
                "accelerometer_bias_walk_m_s2_per_sqrt_s",
                self.accelerometer_bias_walk_m_s2_per_sqrt_s,
            ),
        ];
        each_within(&walks, &(1e-9..=1000.0), "1e-9 to 1000")?;
        let least = if self.period_s > R::of(1e-3) {
            self.period_s
        } else {
            R::of(1e-3)
        };
        within(
            "slip_s",
            self.slip_s,
            least.as_f64()..=100.0,
            "0.001 to 100, and at least period_s",
        )?;
        let still = [
            ("still_wheel_rad_s", self.still_wheel_rad_s),
            ("still_gyro_rad_s", self.still_gyro_rad_s),
            ("still_m_s2", self.still_m_s2),
        ];
        each_within(&still, &(0.0..=1000.0), "0 to 1000")?;
        Ok(self)
    }
}
