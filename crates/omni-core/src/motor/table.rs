//! Torque over speed from measured points.

use super::torque_range::{TorqueRange, four_quadrants, known};
use crate::error::{not_negative, positive};
use crate::{ConfigError, Real};

/// Driving torque as a piecewise-linear function of speed, in four quadrants: for a brushless drive with field
/// weakening or a measured motor, which a straight line does not fit.
///
/// Below the first point its torque holds, beyond the last one the last torque: end with 0 N.m at the no-load speed.
///
/// ```
/// use omni_core::motor::TorqueTable;
/// let table = TorqueTable::new([(0.0, 2.0), (10.0, 2.0), (20.0, 0.0)], 2.5)?;
/// assert_eq!(table.range(15.0_f64).upper_n_m, 1.0);
/// assert_eq!(table.range(15.0).lower_n_m, -2.5); // braking
/// assert_eq!(table.range(-99.0).lower_n_m, 0.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TorqueTable<R, const M: usize> {
    points: [(R, R); M],
    braking_n_m: R,
}

impl<R: Real, const M: usize> TorqueTable<R, M> {
    /// From `points`, each a speed \[rad/s\] and the driving torque \[N.m\] at it, and the braking
    /// torque > 0 \[N.m\], which also bounds the driving torque.
    ///
    /// # Errors
    /// With the point's index: parameter `point.speed_rad_s` if a speed is not above the previous one (the first:
    /// negative), `point.driving_torque_n_m` if a torque is negative. `points` if there are none, `braking_torque_n_m`.
    pub fn new(points: [(R, R); M], braking_torque_n_m: R) -> Result<Self, ConfigError> {
        if M == 0 {
            return Err(ConfigError::new("points", 0.0, "1 or more"));
        }
        let mut last = None;
        for (index, &(speed, torque)) in points.iter().enumerate() {
            let at = |error: ConfigError| error.at(index);
            not_negative("point.speed_rad_s", speed).map_err(at)?;
            if last.is_some_and(|last| speed <= last) {
                let allowed = "above the speed of the point before";
                return Err(at(ConfigError::new("point.speed_rad_s", speed.as_f64(), allowed)));
            }
            not_negative("point.driving_torque_n_m", torque).map_err(at)?;
            last = Some(speed);
        }
        Ok(Self {
            points,
            braking_n_m: positive("braking_torque_n_m", braking_torque_n_m)?,
        })
    }

    /// Lowest and highest torque \[N.m\] at the actuator velocity \[rad/s\]. At rest both are the braking torque;
    /// nothing if the velocity is NaN. O(M).
    ///
    /// ```
    /// use omni_core::motor::TorqueTable;
    /// let table = TorqueTable::new([(0.0, 2.0), (10.0, 1.0), (30.0, 0.0)], 2.5)?;
    /// // Halfway between points, at the last one, beyond it.
    /// assert_eq!([5.0, 20.0, 30.0, 99.0].map(|v| table.range(v).upper_n_m), [1.5, 0.5, 0.0, 0.0]);
    /// assert_eq!(table.range(0.0).upper_n_m, 2.5);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn range(&self, velocity_rad_s: R) -> TorqueRange<R> {
        let speed = velocity_rad_s.abs();
        let mut driving = R::zero();
        let mut before: Option<(R, R)> = None;
        for &(s, torque) in &self.points {
            match before {
                _ if speed >= s => driving = torque,
                None => driving = torque,
                Some((s0, t0)) if speed > s0 => driving = t0 + (torque - t0) * ((speed - s0) / (s - s0)),
                Some(_) => {}
            }
            before = Some((s, torque));
        }
        known(
            velocity_rad_s,
            four_quadrants(driving, self.braking_n_m, velocity_rad_s),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor::TorqueLimit;
    use proptest::prelude::*;

    #[test]
    fn points_are_checked_by_name() {
        let named = |points: [(f64, f64); 2], braking| {
            TorqueTable::new(points, braking).expect_err("refused").parameter
        };
        assert_eq!(named([(-1.0, 1.0), (1.0, 1.0)], 1.0), "point.speed_rad_s");
        assert_eq!(named([(1.0, 1.0), (1.0, 0.5)], 1.0), "point.speed_rad_s");
        assert_eq!(named([(0.0, 1.0), (1.0, -0.5)], 1.0), "point.driving_torque_n_m");
        assert_eq!(
            named([(0.0, f64::NAN), (1.0, 0.5)], 1.0),
            "point.driving_torque_n_m"
        );
        assert_eq!(named([(0.0, 1.0), (1.0, 0.5)], 0.0), "braking_torque_n_m");
        assert_eq!(
            TorqueTable::<f64, 0>::new([], 1.0)
                .expect_err("no points")
                .parameter,
            "points"
        );
    }

    #[test]
    fn points_before_between_and_beyond() {
        let table = TorqueTable::new([(5.0_f64, 2.0), (10.0, 1.0), (20.0, 0.25)], 3.0).expect("valid");
        for (speed, torque) in [
            (0.0, 3.0),
            (1.0, 2.0),
            (5.0, 2.0),
            (7.5, 1.5),
            (10.0, 1.0),
            (12.0, 0.85),
            (20.0, 0.25),
            (1e9, 0.25),
        ] {
            // At rest there is no direction to drive in: the larger, braking torque holds.
            assert!((table.range(speed).upper_n_m - torque).abs() < 1e-12, "{speed}");
        }
        assert_eq!(table.range(f64::NAN), TorqueRange::none());
    }

    proptest! {
        #[test]
        fn a_table_of_a_line_is_the_line(v in -40.0..40.0_f64, stall in 0.1..5.0_f64, slope in 0.01..0.5_f64) {
            let line = TorqueLimit::line(stall, slope).expect("valid").range(v);
            let no_load = stall / slope;
            let table = TorqueTable::new([(0.0, stall), (0.3 * no_load, 0.7 * stall), (no_load, 0.0)], stall).expect("valid").range(v);
            prop_assert!((line.lower_n_m - table.lower_n_m).abs() < 1e-13 && (line.upper_n_m - table.upper_n_m).abs() < 1e-13);
        }
    }
}
