//! The wheel geometry: positions, rolling directions and radii.

use core::f64::consts::FRAC_PI_2;

use super::forward_map::Gram;
use crate::error::{finite, positive, within};
use crate::motor::Gearbox;
use crate::{ConfigError, Real};

/// One driven wheel with free rollers on its rim.
///
/// ```
/// use omni_core::geometry::Wheel;
/// let left = Wheel::omni([0.0_f64, 0.23], [1.0, 0.0], 0.066);
/// // Rolling forward at 0.66 m/s turns it at 10 rad/s; turning left slows a wheel on the left.
/// assert!((left.rates_per_twist()[0] * 0.66 - 10.0).abs() < 1e-12);
/// assert!(left.rates_per_twist()[2] < 0.0);
/// // Behind a 20:1 reduction, with the motor mounted the other way round:
/// let geared = left.geared(0.05).with_reversed_motor();
/// assert!((geared.rates_per_twist()[0] * 0.66 + 200.0).abs() < 1e-10);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wheel<R> {
    /// Place of the contact point in the body frame \[m\]: x (forward is +), y (left is +), within +-1000 m.
    pub position_m: [R; 2],
    /// The way the vehicle moves when this wheel alone turns positively, in the body frame; any length but zero.
    pub rolling_direction: [R; 2],
    /// Angle \[rad\] from the rolling direction to the axis of the roller on the ground (counter-clockwise is +):
    /// 0 for an omni wheel, +-pi/4 for a mecanum wheel. Never +-pi/2: a roller whose axis is parallel to the axle rolls
    /// freely in the rolling direction, so that the wheel transmits no force.
    pub roller_angle_rad: R,
    /// Rolling radius r \[m\], 0.0001 to 100: the radius that turns velocity into path, not the largest one.
    pub radius_m: R,
    /// Wheel velocity over actuator velocity, k of eq. (1), 1e-6 to 1000: 1 for direct drive, 0.05
    /// for a 20:1 reduction.
    pub gear: R,
    /// The actuator turns the wheel backwards when it turns positively: the sign of the mounting.
    pub reversed: bool,
}

impl<R: Real> Wheel<R> {
    /// An omni wheel (rollers along the rim) at `position_m` \[m\], rolling along `rolling_direction` (any length but
    /// zero), its radius `radius_m` \[m\]; direct drive. The fields' ranges apply; they are checked when a
    /// [`WheelLayout`] is built.
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// // 0.2 m ahead, rolling to the left: forward motion slides along its rollers.
    /// let front = Wheel::omni([0.2_f64, 0.0], [0.0, 3.0], 0.1);
    /// let [vx, vy, wz] = front.rates_per_twist();
    /// assert!(vx == 0.0 && (vy - 1.0 / 0.1).abs() < 1e-12 && (wz - 0.2 / 0.1).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn omni(position_m: [R; 2], rolling_direction: [R; 2], radius_m: R) -> Self {
        Self {
            position_m,
            rolling_direction,
            roller_angle_rad: R::zero(),
            radius_m,
            gear: R::one(),
            reversed: false,
        }
    }

    /// A mecanum wheel at `position_m` rolling forward (+x), the axis of the roller on the ground at
    /// `roller_angle_rad` from forward (counter-clockwise is +; usually +-pi/4); direct drive.
    ///
    /// Checked when put into a [`WheelLayout`].
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// let front_left = Wheel::mecanum([0.2, 0.15], -core::f64::consts::FRAC_PI_4, 0.05);
    /// let [vx, vy, wz] = front_left.rates_per_twist(); // (vx - vy - (0.2 + 0.15) wz) / 0.05
    /// assert!((vx - 20.0).abs() < 1e-12 && (vy + 20.0).abs() < 1e-12 && (wz + 7.0).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn mecanum(position_m: [R; 2], roller_angle_rad: R, radius_m: R) -> Self {
        Self {
            roller_angle_rad,
            ..Self::omni(position_m, [R::one(), R::zero()], radius_m)
        }
    }

    /// The same mecanum wheel as it rolls with `count` rollers around its rim. A roller is at the roller angle only
    /// while it is the lowest; until the next one carries, it turns by pi / count to both sides. Therefore the tangent
    /// of the angle is larger in the mean, and the wheel moves less to the side per turn: by 2 % with nine rollers.
    /// For odometry; fewer than 3 change nothing.
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// let wheel = Wheel::mecanum([0.2, 0.15], -core::f64::consts::FRAC_PI_4, 0.05);
    /// let [ahead, left, _] = wheel.rates_per_twist();
    /// let [ahead_on_rollers, left_on_rollers, _] = wheel.with_rollers(9).rates_per_twist();
    /// assert!((ahead_on_rollers - ahead).abs() < 1e-12);
    /// assert!((left_on_rollers / left - 1.0206).abs() < 1e-4);
    /// ```
    #[must_use]
    pub fn with_rollers(self, count: u32) -> Self {
        if count < 3 {
            return self;
        }
        let half = R::pi() / R::of(f64::from(count));
        let (sin, cos) = self.roller_angle_rad.sine_cosine();
        let (chord, _) = half.sine_cosine();
        // Tangent of the difference of both angles, which is small: three terms of the arc tangent.
        let tan = sin * cos * (half - chord) / (cos * cos * chord + sin * sin * half);
        let square = tan * tan;
        let difference = tan * (R::one() - square * (R::of(1.0 / 3.0) - square * R::of(0.2)));
        Self {
            roller_angle_rad: self.roller_angle_rad + difference,
            ..self
        }
    }

    /// The same wheel behind a gear: wheel velocity over actuator velocity is `gear`, 1e-6 to 1000, checked when put
    /// into a [`WheelLayout`]. Replaces a gear it had.
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// let direct = Wheel::omni([0.0_f64, 0.2], [1.0, 0.0], 0.05);
    /// // Behind 20:1 the motor turns twenty times for one turn of the wheel: 20 rad/s a rad/s of it.
    /// let ratio = direct.geared(0.05).rates_per_twist()[0] / direct.rates_per_twist()[0];
    /// assert!((ratio - 20.0).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn geared(self, gear: R) -> Self {
        Self { gear, ..self }
    }

    /// The same wheel behind a gearbox, whose ratio counts motor turns per wheel turn: 20 there is a gear of 0.05 here.
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// use omni_core::motor::Gearbox;
    /// let wheel = Wheel::omni([0.0_f64, 0.2], [1.0, 0.0], 0.05).behind(&Gearbox::new(20.0, 0.8)?);
    /// assert_eq!(wheel.gear, 0.05);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn behind(self, gearbox: &Gearbox<R>) -> Self {
        self.geared(R::one() / gearbox.motor_velocity(R::one()))
    }

    /// The same wheel with its motor mounted the other way round: the actuator's velocity and torque change sign.
    #[must_use]
    pub fn with_reversed_motor(self) -> Self {
        Self {
            reversed: !self.reversed,
            ..self
        }
    }

    /// Wheel velocity per actuator velocity: the gear, negative for a motor mounted the other way round.
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// let wheel = Wheel::omni([0.0, 0.2], [1.0, 0.0], 0.05).geared(0.05).with_reversed_motor();
    /// assert_eq!(wheel.wheel_per_actuator(), -0.05);
    /// assert!((40.0_f64 * wheel.wheel_per_actuator() + 2.0).abs() < 1e-15); // 40 rad/s of the motor, -2 of the wheel
    /// ```
    #[must_use]
    pub fn wheel_per_actuator(&self) -> R {
        if self.reversed { -self.gear } else { self.gear }
    }

    /// Actuator velocity per unit of body twist: `[rad/m, rad/m, 1]` for `[vx, vy, wz]`, this wheel's row of eq. (9).
    ///
    /// A wheel constrains the ground velocity of its contact along the roller's axis `a` only:
    /// `a . (v + wz x p) = k v_i r (a . d)`.
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// // A roller whose axis points 60 degrees to the left of forward, no lever.
    /// let wheel = Wheel::mecanum([0.0, 0.0], 60.0_f64.to_radians(), 0.1);
    /// let [vx, vy, wz] = wheel.rates_per_twist();
    /// assert!((vx - 10.0).abs() < 1e-12); // 1 / r, whatever the rollers
    /// assert!((vy - 10.0 * 3.0_f64.sqrt()).abs() < 1e-12 && wz == 0.0); // tan(60) / r
    /// ```
    #[must_use]
    pub fn rates_per_twist(&self) -> [R; 3] {
        let [dx, dy] = self.unit_direction();
        let (sin, cos) = self.roller_angle_rad.sine_cosine();
        let (ax, ay) = (cos * dx - sin * dy, sin * dx + cos * dy);
        let [x, y] = self.position_m;
        let reach = self.wheel_per_actuator() * self.radius_m * cos; // a . d = cos(roller angle)
        [ax / reach, ay / reach, (ay * x - ax * y) / reach]
    }

    /// The rolling direction with length 1; NaN for a direction of length zero, which no [`WheelLayout`] accepts.
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// let wheel = Wheel::omni([0.0_f64, 0.0], [3.0, -4.0], 0.1);
    /// let [x, y] = wheel.unit_direction();
    /// assert!((x - 0.6).abs() < 1e-15 && (y + 0.8).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn unit_direction(&self) -> [R; 2] {
        let [x, y] = self.rolling_direction;
        let length = (x * x + y * y).sqrt();
        [x / length, y / length]
    }

    fn check(&self) -> Result<(), ConfigError> {
        within("radius_m", self.radius_m, 1e-4..=100.0, "0.0001 to 100")?;
        within("gear", self.gear, 1e-6..=1e3, "0.000001 to 1000")?;
        for p in self.position_m {
            within("position_m", p, -1e3..=1e3, "-1000 to 1000")?;
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
        let value = within(
            "roller_angle_rad",
            self.roller_angle_rad,
            -FRAC_PI_2..=FRAC_PI_2,
            "-pi/2 to pi/2, ends excluded",
        )?;
        if value.cos().abs() < R::of(1e-3) {
            let allowed = "away from +-pi/2: a roller whose axis is along the axle transmits no force";
            return Err(ConfigError::new("roller_angle_rad", value.as_f64(), allowed));
        }
        Ok(())
    }
}

/// `N` wheels that together can move the vehicle in every direction; checked when built. Their order is the order of
/// every array over wheels.
///
/// ```
/// use omni_core::{Kinematics, WheelLayout};
/// let layout = WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?;
/// let rows = *Kinematics::new(&layout)?.inverse_matrix();
/// assert_eq!(rows[1], layout.wheels()[1].rates_per_twist()); // wheel 2 has index 1, here and everywhere
/// assert!((rows[1][2] - 0.30 / 0.066).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelLayout<R, const N: usize> {
    wheels: [Wheel<R>; N],
}

impl<R: Real, const N: usize> WheelLayout<R, N> {
    /// A layout of the wheels given, in their order.
    ///
    /// # Errors
    /// [`ConfigError`] with the wheel's index for a radius, gear, place, direction or roller out of
    /// range; without an index, parameter `layout` (the value is the rank reached) where the wheels
    /// cannot move the vehicle in three directions, and parameter `condition_number` (the value)
    /// above [`CONDITION_LIMIT`](crate::geometry::CONDITION_LIMIT).
    ///
    /// ```
    /// use omni_core::geometry::Wheel;
    /// use omni_core::WheelLayout;
    /// let tank = [[0.2, 0.2], [0.2, -0.2], [-0.2, 0.2]].map(|p| Wheel::omni(p, [1.0, 0.0], 0.05));
    /// let error = WheelLayout::<f64, 3>::new(tank).unwrap_err();
    /// assert_eq!((error.parameter, error.value), ("layout", 2.0)); // forward and yaw, never sideways
    /// ```
    pub fn new(wheels: [Wheel<R>; N]) -> Result<Self, ConfigError> {
        for (index, wheel) in wheels.iter().enumerate() {
            wheel.check().map_err(|error| error.at(index))?;
        }
        Gram::checked(&wheels.map(|wheel| wheel.rates_per_twist()), &[R::one(); N])?;
        Ok(Self { wheels })
    }

    /// `N` equal omni wheels on a circle of `circle_radius_m` > 0 \[m\], wheel `i` at the angle
    /// `offset_rad + 2 pi i / N` counter-clockwise from forward, each rolling counter-clockwise: all turn
    /// positively when the vehicle turns left. `wheel_radius_m` is the wheels' radius; direct drive.
    ///
    /// # Errors
    /// As [`WheelLayout::new`]; parameter `layout` for fewer than three wheels.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::omni(0.5, 0.0, 0.1)?)?;
    /// let twist = BodyTwist { vx_m_s: 1.0, vy_m_s: 1.0, wz_rad_s: 1.0 };
    /// for (wheel, expected) in kinematics.inverse(&twist).rad_s.iter().zip([15.0, -5.0, -5.0, 15.0]) {
    ///     assert!((wheel - expected).abs() < 1e-12);
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn omni(circle_radius_m: R, offset_rad: R, wheel_radius_m: R) -> Result<Self, ConfigError> {
        positive("circle_radius_m", circle_radius_m)?;
        finite("offset_rad", offset_rad)?;
        let mut wheels = [Wheel::omni([R::zero(); 2], [R::one(), R::zero()], wheel_radius_m); N];
        let (mut index, count) = (R::zero(), R::of(N as f64));
        for wheel in &mut wheels {
            let (sin, cos) = (offset_rad + R::two_pi() * index / count).sine_cosine();
            wheel.position_m = [circle_radius_m * cos, circle_radius_m * sin];
            wheel.rolling_direction = [-sin, cos];
            index += R::one();
        }
        Self::new(wheels)
    }

    /// The same layout with every wheel behind a gear: wheel velocity over actuator velocity is `gear`.
    ///
    /// # Errors
    /// Parameter `gear` out of its range.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let layout = WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?.geared(1.0 / 30.0)?;
    /// let turn = BodyTwist { wz_rad_s: 1.0, ..BodyTwist::ZERO };
    /// assert!((Kinematics::new(&layout)?.inverse(&turn).rad_s[0] - 0.2 / 0.05 * 30.0).abs() < 1e-9);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn geared(self, gear: R) -> Result<Self, ConfigError> {
        Self::new(self.wheels.map(|wheel| wheel.geared(gear)))
    }

    /// The wheels, in order.
    #[must_use]
    pub fn wheels(&self) -> &[Wheel<R>; N] {
        &self.wheels
    }
}

impl<R: Real> WheelLayout<R, 4> {
    /// Four mecanum wheels at the corners of a rectangle, in the order front left, front right, rear left, rear right;
    /// direct drive. All turn positively when the vehicle drives forward.
    ///
    /// `wheelbase_m` and `track_m` > 0 \[m\] are the distances of the contact points along x and y, `radius_m` the
    /// wheels' radius. The axes of the rollers on the ground form a diamond (those on top, seen from above, an X):
    /// front left `w = (vx - vy - (wheelbase + track) / 2 wz) / r`.
    ///
    /// # Errors
    /// As [`WheelLayout::new`].
    ///
    /// ```
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::mecanum4(1.2_f64, 0.8, 0.5)?)?;
    /// let twist = BodyTwist { vx_m_s: 10.0, vy_m_s: 5.0, wz_rad_s: 3.0 };
    /// for (wheel, expected) in kinematics.inverse(&twist).rad_s.iter().zip([4.0, 36.0, 24.0, 16.0]) {
    ///     assert!((wheel - expected).abs() < 1e-12);
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn mecanum4(wheelbase_m: R, track_m: R, radius_m: R) -> Result<Self, ConfigError> {
        let (x, y) = (
            positive("wheelbase_m", wheelbase_m)? * R::of(0.5),
            positive("track_m", track_m)? * R::of(0.5),
        );
        let angle = R::frac_pi_4();
        Self::new([
            Wheel::mecanum([x, y], -angle, radius_m),
            Wheel::mecanum([x, -y], angle, radius_m),
            Wheel::mecanum([-x, y], angle, radius_m),
            Wheel::mecanum([-x, -y], -angle, radius_m),
        ])
    }
}

impl<R: Real> WheelLayout<R, 7> {
    /// The seven-wheel vehicle of Chugo et al. (2004), read off the signs of eq. (9); gear 1.
    ///
    /// `r1_m` is the distance of the transverse wheels 2 and 6 in front of and behind the middle, `r2_m` the distance
    /// of the side wheels from the centre line, `radius_m` the wheels' radius, all in metres and > 0. Wheels 1, 2, 3
    /// are the rear row (right, transverse, left), 4 the middle, 5, 6, 7 the front row. The paper states none of the
    /// lengths.
    ///
    /// # Errors
    /// As [`WheelLayout::new`].
    ///
    /// ```
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.35, 0.27, 0.1)?)?;
    /// let forward = kinematics.inverse(&BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 });
    /// for (wheel, expected) in forward.rad_s.iter().zip([3.0_f64, 0.0, -3.0, 3.0, 3.0, 0.0, -3.0]) {
    ///     assert!((wheel - expected).abs() < 1e-12);
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn chugo7(r1_m: R, r2_m: R, radius_m: R) -> Result<Self, ConfigError> {
        let (r1_m, r2_m) = (positive("r1_m", r1_m)?, positive("r2_m", r2_m)?);
        let (zero, one) = (R::zero(), R::one());
        let wheel = |x, y, dx, dy| Wheel::omni([x, y], [dx, dy], radius_m);
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
    use crate::geometry::Kinematics;

    fn wheel(position_m: [f64; 2], rolling_direction: [f64; 2]) -> Wheel<f64> {
        Wheel::omni(position_m, rolling_direction, 0.05)
    }

    #[test]
    fn wheels_that_cannot_move_three_ways_are_refused_with_the_rank_reached() {
        let row = [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]].map(|p| wheel(p, [1.0, 0.0]));
        let error = WheelLayout::new(row).expect_err("three wheels in one line roll one way");
        assert_eq!((error.parameter, error.value), ("layout", 1.0));

        // Four forward wheels steer like a tank: forward and yaw, never lateral.
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
    fn an_ill_conditioned_layout_is_refused_with_its_condition_number() {
        // Three wheels that differ from parallel by a milliradian: lateral motion hardly turns any of them.
        let nearly = [(0.3, -1e-3), (-0.3, 0.0), (0.3, 1e-3)].map(|(y, a)| wheel([0.0, y], [1.0, a]));
        let error = WheelLayout::new(nearly).expect_err("sideways motion is a thousandth of a wheel's");
        assert_eq!(error.parameter, "condition_number");
        assert!(error.value > 1000.0 && error.value < 2500.0, "{}", error.value);
        // Five wheels along x, two along y, orthogonal columns: sqrt(5 / 2), whatever the lengths.
        let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.3, 0.23, 0.066).expect("valid"));
        assert!((kinematics.expect("valid").condition_number() - 2.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_reversed_motor_is_a_reversed_rolling_direction() {
        for angle in [0.0, 0.7] {
            let one = Wheel {
                roller_angle_rad: angle,
                ..wheel([0.2, 0.1], [1.0, 0.5])
            };
            let other = Wheel {
                rolling_direction: [-1.0, -0.5],
                ..one
            };
            assert_eq!(
                one.with_reversed_motor().rates_per_twist(),
                other.rates_per_twist()
            );
        }
    }
}
