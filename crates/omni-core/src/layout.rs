//! Where the wheels are, which way they roll, how large they are: the geometry everything else follows from.

use crate::error::{ConfigError, finite, positive};
use crate::{Kinematics, Real};

/// One driven wheel with free rollers on its rim.
///
/// ```
/// use omni_core::Wheel;
/// let left = Wheel { position_m: [0.0, 0.23], rolling_direction: [1.0, 0.0], roller_angle_rad: 0.0, radius_m: 0.066, gear: 1.0 };
/// // Rolling forward at 0.66 m/s turns it at 10 rad/s; turning left slows a wheel on the left.
/// assert!((left.rates_per_twist()[0] * 0.66_f64 - 10.0).abs() < 1e-12);
/// assert!(left.rates_per_twist()[2] < 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel<R> {
    /// Place of the contact point in the body frame \[m\]: x (forward is +), y (left is +).
    pub position_m: [R; 2],
    /// The way the vehicle moves when this wheel alone turns positively, in the body frame; any length but zero.
    pub rolling_direction: [R; 2],
    /// Angle \[rad\] from the rolling direction to the axis of the roller on the ground (counter-clockwise is +):
    /// 0 for an omni wheel, +-pi/4 for a mecanum wheel. Never +-pi/2, where the wheel could push nothing.
    pub roller_angle_rad: R,
    /// Rolling radius r \[m\], > 0.
    pub radius_m: R,
    /// Wheel velocity over actuator velocity, k of eq. (1), > 0: 1 for direct drive, 0.05 for a 20:1 reduction.
    pub gear: R,
}

impl<R: Real> Wheel<R> {
    /// Actuator velocity per unit of body twist: `[rad/m, rad/m, 1]` for `[vx, vy, wz]`, this wheel's row of eq. (9).
    ///
    /// A wheel constrains the ground velocity of its contact along the roller's axis `a` only:
    /// `a . (v + wz x p) = k v_i r (a . d)`.
    #[must_use]
    pub fn rates_per_twist(&self) -> [R; 3] {
        let [dx, dy] = self.unit_direction();
        let (sin, cos) = self.roller_angle_rad.sin_cos();
        let (ax, ay) = (cos * dx - sin * dy, sin * dx + cos * dy);
        let [x, y] = self.position_m;
        let reach = self.gear * self.radius_m * cos; // a . d = cos(roller angle)
        [ax / reach, ay / reach, (ay * x - ax * y) / reach]
    }

    /// The rolling direction with length 1.
    #[must_use]
    pub fn unit_direction(&self) -> [R; 2] {
        let [x, y] = self.rolling_direction;
        let length = (x * x + y * y).sqrt();
        [x / length, y / length]
    }

    fn check(&self) -> Result<(), ConfigError> {
        positive("radius_m", self.radius_m)?;
        positive("gear", self.gear)?;
        for p in self.position_m {
            finite("position_m", p)?;
        }
        let [x, y] = self.rolling_direction;
        let length = finite("rolling_direction", (x * x + y * y).sqrt())?;
        if length <= R::zero() {
            return Err(ConfigError::new(
                "rolling_direction",
                0.0,
                "a direction of non-zero length",
            ));
        }
        finite("roller_angle_rad", self.roller_angle_rad)?;
        if self.roller_angle_rad.cos().abs() < R::of(1e-3) {
            let value = self.roller_angle_rad.as_f64();
            return Err(ConfigError::new(
                "roller_angle_rad",
                value,
                "away from +-pi/2, where the wheel pushes nothing",
            ));
        }
        Ok(())
    }
}

/// `N` wheels that together can move the vehicle in every direction; checked when built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelLayout<R, const N: usize> {
    wheels: [Wheel<R>; N],
}

impl<R: Real, const N: usize> WheelLayout<R, N> {
    /// A layout of the wheels given, in their order.
    ///
    /// # Errors
    /// [`ConfigError`] with the wheel's index for a non-finite or non-positive radius or gear, a zero direction or a
    /// roller that cannot push; without an index, parameter `layout`, where the wheels cannot move the vehicle in
    /// three directions (the value is the rank reached).
    pub fn new(wheels: [Wheel<R>; N]) -> Result<Self, ConfigError> {
        for (index, wheel) in wheels.iter().enumerate() {
            wheel.check().map_err(|error| error.at(index))?;
        }
        let layout = Self { wheels };
        Kinematics::new(&layout)?;
        Ok(layout)
    }

    /// The wheels, in order.
    #[must_use]
    pub fn wheels(&self) -> &[Wheel<R>; N] {
        &self.wheels
    }
}

impl<R: Real> WheelLayout<R, 7> {
    /// The seven-wheel vehicle of Chugo et al. (2004), read off the signs of eq. (9); gear 1.
    ///
    /// `r1_m` is the distance of the transverse wheels 2 and 6 ahead of and behind the middle, `r2_m` that of the
    /// side wheels from the centre line, `radius_m` the wheels' radius, all in metres and > 0. Wheels 1, 2, 3 are the
    /// rear row (right, transverse, left), 4 the middle, 5, 6, 7 the front row. The paper gives none of the lengths.
    ///
    /// # Errors
    /// As [`WheelLayout::new`].
    ///
    /// ```
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.35, 0.27, 0.1)?)?;
    /// let forward = kinematics.inverse(&BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 });
    /// for (wheel, expected) in forward.iter().zip([3.0_f64, 0.0, -3.0, 3.0, 3.0, 0.0, -3.0]) {
    ///     assert!((wheel - expected).abs() < 1e-12);
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn chugo7(r1_m: R, r2_m: R, radius_m: R) -> Result<Self, ConfigError> {
        let (zero, one) = (R::zero(), R::one());
        let wheel = |x, y, dx, dy| Wheel {
            position_m: [x, y],
            rolling_direction: [dx, dy],
            roller_angle_rad: zero,
            radius_m,
            gear: one,
        };
        Self::new([
            wheel(-r1_m, -r2_m, one, zero),
            wheel(-r1_m, zero, zero, -one),
            wheel(-r1_m, r2_m, -one, zero),
            wheel(zero, zero, one, zero),
            wheel(r1_m, -r2_m, one, zero),
            wheel(r1_m, zero, zero, one),
            wheel(r1_m, r2_m, -one, zero),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheel(position_m: [f64; 2], rolling_direction: [f64; 2]) -> Wheel<f64> {
        Wheel {
            position_m,
            rolling_direction,
            roller_angle_rad: 0.0,
            radius_m: 0.05,
            gear: 1.0,
        }
    }

    #[test]
    fn wheels_that_cannot_move_three_ways_are_refused_with_the_rank_reached() {
        let row = [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]].map(|p| wheel(p, [1.0, 0.0]));
        let error = WheelLayout::new(row).expect_err("three wheels in one line roll one way");
        assert_eq!((error.parameter, error.value), ("layout", 1.0));

        // Four forward wheels steer like a tank: forward and yaw, never sideways.
        let tank = [[0.2, 0.2], [0.2, -0.2], [-0.2, 0.2], [-0.2, -0.2]].map(|p| wheel(p, [1.0, 0.0]));
        assert_eq!(WheelLayout::new(tank).expect_err("no sideways motion").value, 2.0);
    }

    #[test]
    fn a_bad_wheel_is_named_by_its_index_and_key() {
        let good = WheelLayout::<f64, 7>::chugo7(0.3, 0.23, 0.066).expect("valid");
        let with = |change: fn(&mut Wheel<f64>)| {
            let mut wheels = *good.wheels();
            change(&mut wheels[4]);
            let error = WheelLayout::new(wheels).expect_err("refused");
            (error.index, error.parameter)
        };
        assert_eq!(with(|w| w.radius_m = f64::NAN), (Some(4), "radius_m"));
        assert_eq!(with(|w| w.radius_m = -0.1), (Some(4), "radius_m"));
        assert_eq!(with(|w| w.gear = 0.0), (Some(4), "gear"));
        assert_eq!(
            with(|w| w.rolling_direction = [0.0, 0.0]),
            (Some(4), "rolling_direction")
        );
        assert_eq!(with(|w| w.position_m[1] = f64::INFINITY), (Some(4), "position_m"));
        assert_eq!(
            with(|w| w.roller_angle_rad = core::f64::consts::FRAC_PI_2),
            (Some(4), "roller_angle_rad")
        );
    }

    #[test]
    fn mecanum_rollers_give_the_textbook_map() {
        // Front left wheel of a mecanum base, rollers at 45 degrees: omega = (vx - vy - (lx + ly) wz) / r.
        let front_left = Wheel {
            position_m: [0.2, 0.15],
            rolling_direction: [1.0, 0.0],
            roller_angle_rad: -core::f64::consts::FRAC_PI_4,
            radius_m: 0.05,
            gear: 1.0,
        };
        for (got, expected) in front_left.rates_per_twist().iter().zip([20.0, -20.0, -7.0]) {
            assert!((got - expected).abs() < 1e-12, "{got} {expected}");
        }
    }
}
