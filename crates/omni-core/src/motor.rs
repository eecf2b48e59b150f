//! What torque an actuator can give at a velocity.

use crate::error::{ConfigError, not_negative, positive};
use crate::{Real, TorqueRanges};

/// Torque-speed line of a DC motor, in four quadrants: speed costs torque only while the motor drives.
///
/// Driving (torque and velocity of one sign): `max(0, stall - slope |v|)`. Braking: `stall`. As printed, eq. (13) turns
/// negative above 114.5 rpm and would push a fast wheel backwards; here a limit is never negative.
///
/// ```
/// use omni_core::TorqueLimit;
/// let limit = TorqueLimit::chugo(); // eq. (13): -1.713 v + 196.13, in mN.m and rpm
/// let rpm = core::f64::consts::PI / 30.0;
/// let (brake, drive) = limit.range(100.0 * rpm);
/// assert!((drive - 24.83e-3_f64).abs() < 1e-9);
/// assert!((brake + 196.13e-3_f64).abs() < 1e-9);
/// assert_eq!(limit.range(200.0 * rpm).1, 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueLimit<R> {
    stall_n_m: R,
    slope_n_m_s_rad: R,
}

impl<R: Real> TorqueLimit<R> {
    /// The same limit `torque_n_m` > 0 \[N.m\] at every velocity.
    ///
    /// # Errors
    /// Parameter `torque_n_m` where it is not finite or not positive.
    pub fn constant(torque_n_m: R) -> Result<Self, ConfigError> {
        Ok(Self {
            stall_n_m: positive("torque_n_m", torque_n_m)?,
            slope_n_m_s_rad: R::zero(),
        })
    }

    /// A line from `stall_torque_n_m` > 0 \[N.m\] at rest down by `slope_n_m_s_rad` >= 0 \[N.m per rad/s\].
    ///
    /// # Errors
    /// The parameter that is out of range.
    pub fn line(stall_torque_n_m: R, slope_n_m_s_rad: R) -> Result<Self, ConfigError> {
        Ok(Self {
            stall_n_m: positive("stall_torque_n_m", stall_torque_n_m)?,
            slope_n_m_s_rad: not_negative("slope_n_m_s_rad", slope_n_m_s_rad)?,
        })
    }

    /// Eq. (13): 196.13 mN.m at rest, 1.713 mN.m less for every rpm. Serves the simulation of section 3.3 of the paper;
    /// its peak power of 0.59 W cannot lift a vehicle over a step.
    #[must_use]
    pub fn chugo() -> Self {
        let milli = 1e-3;
        let rpm = core::f64::consts::PI / 30.0;
        Self {
            stall_n_m: R::of(196.13 * milli),
            slope_n_m_s_rad: R::of(1.713 * milli / rpm),
        }
    }

    /// Lowest (<= 0) and highest (>= 0) torque \[N.m\] at the actuator velocity \[rad/s\].
    #[must_use]
    pub fn range(&self, velocity_rad_s: R) -> (R, R) {
        let driving = self.stall_n_m - self.slope_n_m_s_rad * velocity_rad_s.abs();
        let driving = if driving > R::zero() { driving } else { R::zero() };
        if velocity_rad_s > R::zero() {
            (-self.stall_n_m, driving)
        } else if velocity_rad_s < R::zero() {
            (-driving, self.stall_n_m)
        } else {
            (-self.stall_n_m, self.stall_n_m)
        }
    }
}

/// The limits of `N` actuators, their numbers side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TorqueLimits<R, const N: usize> {
    stall: [R; N],
    slope: [R; N],
}

impl<R: Real, const N: usize> TorqueLimits<R, N> {
    pub(crate) fn new(limits: &[TorqueLimit<R>; N]) -> Self {
        Self {
            stall: limits.map(|l| l.stall_n_m),
            slope: limits.map(|l| l.slope_n_m_s_rad),
        }
    }

    /// As [`TorqueLimit::range`], for every actuator at its velocity \[rad/s\].
    #[inline]
    pub(crate) fn ranges(&self, velocities: &[R; N]) -> TorqueRanges<R, N> {
        let zero = R::zero();
        let mut ranges = TorqueRanges {
            lower_n_m: [zero; N],
            upper_n_m: [zero; N],
        };
        for i in 0..N {
            let (v, stall) = (velocities[i], self.stall[i]);
            let driving = stall - self.slope[i] * v.abs();
            let driving = if driving > zero { driving } else { zero };
            ranges.upper_n_m[i] = if v > zero { driving } else { stall };
            ranges.lower_n_m[i] = if v < zero { -driving } else { -stall };
        }
        ranges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RPM: f64 = core::f64::consts::PI / 30.0;

    #[test]
    fn torque_limit_is_never_negative_at_any_speed() {
        let limit = TorqueLimit::<f64>::chugo();
        for rpm in -400..=400_i32 {
            let (lower, upper) = limit.range(f64::from(rpm) * RPM);
            assert!(lower <= 0.0 && upper >= 0.0, "{rpm} rpm: {lower} {upper}");
            let printed = 1e-3 * (196.13 - 1.713 * f64::from(rpm.abs())).max(0.0);
            let driving = if rpm < 0 { -lower } else { upper };
            assert!((driving - printed).abs() < 1e-15, "{rpm} rpm");
        }
    }

    #[test]
    fn limits_of_opposite_velocities_mirror_each_other() {
        let limit = TorqueLimit::line(2.0, 0.1).expect("valid");
        for v in [0.5, 3.0, 30.0] {
            let ((a, b), (c, d)) = (limit.range(v), limit.range(-v));
            assert_eq!((a, b), (-d, -c));
        }
    }

    #[test]
    fn load_torque_meets_equation_13_where_the_paper_s_wheels_settle() {
        // Speeds of notes.md: damper coefficient [N.m.s/rad] -> rpm at which the motor just holds the load.
        for (damper, rpm) in [(0.004, 91.999), (0.008, 76.891), (0.003, 96.751)] {
            let (_, drive) = TorqueLimit::<f64>::chugo().range(rpm * RPM);
            assert!((drive - damper * rpm * RPM).abs() < 1e-6, "{damper}: {drive}"); // rpm are given to 0.001
        }
    }
}
