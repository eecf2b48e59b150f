//! Velocities and poses in the plane, and the only conversions between frames.
//!
//! REP-103: x forward, y left, rotation counter-clockwise positive.

use crate::Real;
use crate::trig::cardinal_sine;

/// Velocity of the vehicle in its own frame: the input of the inverse kinematics. Not a world velocity.
///
/// ```
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let forward = BodyTwist { vx_m_s: 0.3_f64, ..BodyTwist::ZERO };
/// assert_eq!(forward.vy_m_s, 0.0);
/// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.066)?)?;
/// let velocities = kinematics.inverse(&forward);
/// assert!((velocities.rad_s[0] - 0.3 / 0.066).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
///
/// A world velocity in its place does not compile:
///
/// ```compile_fail,E0308
/// use omni_core::geometry::WorldTwist;
/// use omni_core::{Kinematics, WheelLayout};
/// let north = WorldTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 };
/// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.066)?)?;
/// let velocities = kinematics.inverse(&north); // north.to_body(&pose) it must be
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct BodyTwist<R> {
    /// Forward velocity \[m/s\] (forward is +).
    pub vx_m_s: R,
    /// Sideways velocity \[m/s\] (left is +).
    pub vy_m_s: R,
    /// Yaw rate \[rad/s\] (counter-clockwise seen from above is +).
    pub wz_rad_s: R,
}

impl<R: Real> BodyTwist<R> {
    /// At rest: 0 m/s, 0 m/s, 0 rad/s.
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// let ahead: BodyTwist<f32> = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// assert_eq!(ahead.wz_rad_s, 0.0);
    /// ```
    pub const ZERO: Self = Self {
        vx_m_s: R::ZERO,
        vy_m_s: R::ZERO,
        wz_rad_s: R::ZERO,
    };

    /// `[vx, vy, wz]` in \[m/s, m/s, rad/s\]: the vector X' of eq. (6).
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// let left = BodyTwist { vy_m_s: 0.2, ..BodyTwist::ZERO };
    /// assert_eq!(left.to_array(), [0.0, 0.2, 0.0]);
    /// ```
    #[must_use]
    pub fn to_array(self) -> [R; 3] {
        [self.vx_m_s, self.vy_m_s, self.wz_rad_s]
    }

    /// The inverse of [`BodyTwist::to_array`]: `[vx, vy, wz]` in \[m/s, m/s, rad/s\].
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// let turn_right = BodyTwist::from_array([0.0, 0.0, -0.5]);
    /// assert_eq!(turn_right.wz_rad_s, -0.5);
    /// ```
    #[must_use]
    pub fn from_array([vx_m_s, vy_m_s, wz_rad_s]: [R; 3]) -> Self {
        Self {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        }
    }

    /// The displacement that the twist, held for `dt_s` \[s\], amounts to.
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// let moved = BodyTwist { vx_m_s: 0.3, vy_m_s: -0.5, wz_rad_s: 2.0 }.over(0.5);
    /// assert_eq!(moved.to_array(), [0.15, -0.25, 1.0]);
    /// ```
    #[must_use]
    pub fn over(self, dt_s: R) -> BodyDisplacement<R> {
        BodyDisplacement {
            dx_m: self.vx_m_s * dt_s,
            dy_m: self.vy_m_s * dt_s,
            dyaw_rad: self.wz_rad_s * dt_s,
        }
    }

    /// The constant twist that, held for `dt_s` > 0 \[s\], ends at the pose (vx dt, vy dt, wz dt) seen from the start.
    ///
    /// A vehicle that turns while it moves drifts off the line that it was commanded to follow;
    /// commands held for a period are straightened by this ("discretised"). It is the logarithm map
    /// of the plane's rigid motions, the inverse of
    /// [`PlanarPose::moved_by`]: with t = wz dt, rotate (vx, vy) by -t/2 and multiply by (t/2) / sin(t/2).
    ///
    /// Range: |t| < 2 pi. The factor is 1.05 at 60 degrees, 1.57 at half a turn, and grows without
    /// bound towards a whole turn, which ends where it began whatever the velocity. There it is
    /// held at its value where sin(t/2) / (t/2) is the root of the precision (1.5e-8 for `f64`,
    /// 3.5e-4 for `f32`), and t at 2 pi, so that the result stays finite.
    ///
    /// ```
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::BodyTwist;
    /// let command = BodyTwist { vx_m_s: 1.0_f64, vy_m_s: 0.0, wz_rad_s: 0.5 };
    /// let skewed = PlanarPose::origin().moved_by(&command.over(1.0));
    /// assert!((skewed.y_m - 0.245).abs() < 1e-3);
    /// let straight = PlanarPose::origin().moved_by(&command.discretize(1.0).over(1.0));
    /// assert!((straight.x_m - 1.0).abs() < 1e-15 && straight.y_m.abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn discretize(self, dt_s: R) -> Self {
        let half_turn = (self.wz_rad_s * dt_s * R::of(0.5)).limited(-R::pi(), R::pi());
        let shortening = cardinal_sine(half_turn);
        let least = R::default_epsilon().sqrt();
        let factor = R::one() / if shortening > least { shortening } else { least };
        let (sin, cos) = half_turn.sine_cosine();
        Self {
            vx_m_s: (cos * self.vx_m_s + sin * self.vy_m_s) * factor,
            vy_m_s: (cos * self.vy_m_s - sin * self.vx_m_s) * factor,
            wz_rad_s: self.wz_rad_s,
        }
    }

    /// The velocity, along the body's axes, of the point of the body at `[x_m, y_m]` \[m\] from its
    /// origin: `v + wz x p`.
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// let turning = BodyTwist { vx_m_s: 0.1, vy_m_s: 0.0, wz_rad_s: 2.0 };
    /// let bumper = turning.at_point([0.5, 0.0]); // half a metre ahead: swings to the left
    /// assert_eq!(bumper.to_array(), [0.1, 1.0, 2.0]);
    /// ```
    #[must_use]
    pub fn at_point(self, [x_m, y_m]: [R; 2]) -> Self {
        Self {
            vx_m_s: self.vx_m_s - self.wz_rad_s * y_m,
            vy_m_s: self.vy_m_s + self.wz_rad_s * x_m,
            wz_rad_s: self.wz_rad_s,
        }
    }

    /// The twist of the origin for which the point of the body at `[x_m, y_m]` \[m\] has the twist `of_point` (along
    /// the body's axes): a command for a tool, a towed load or any other centre of rotation. Undoes
    /// [`BodyTwist::at_point`].
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// // Turn about a point half a metre ahead, which is to stand still.
    /// let turn = BodyTwist { wz_rad_s: 2.0, ..BodyTwist::ZERO };
    /// assert_eq!(BodyTwist::from_point(turn, [0.5, 0.0]).to_array(), [0.0, -1.0, 2.0]);
    /// ```
    #[must_use]
    pub fn from_point(of_point: Self, [x_m, y_m]: [R; 2]) -> Self {
        of_point.at_point([-x_m, -y_m])
    }

    /// The same motion seen from the world, for a vehicle at `pose`: (vx, vy) turned by the yaw. The position has no
    /// effect. Undoes [`WorldTwist::to_body`]. In `f32` the yaw should stay within 8192 rad ([`Real::sine_cosine`]).
    ///
    /// ```
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::BodyTwist;
    /// let facing_left = PlanarPose { yaw_rad: core::f64::consts::FRAC_PI_2, ..PlanarPose::origin() };
    /// let world = BodyTwist { vx_m_s: 0.3, vy_m_s: 0.1, wz_rad_s: 0.5 }.to_world(&facing_left);
    /// assert!((world.vy_m_s - 0.3).abs() < 1e-15); // its forward is the world's y,
    /// assert!((world.vx_m_s + 0.1).abs() < 1e-15); // its left the way against the world's x
    /// assert_eq!(world.wz_rad_s, 0.5);
    /// ```
    #[must_use]
    pub fn to_world(self, pose: &PlanarPose<R>) -> WorldTwist<R> {
        let (sin, cos) = pose.yaw_rad.sine_cosine();
        WorldTwist {
            vx_m_s: cos * self.vx_m_s - sin * self.vy_m_s,
            vy_m_s: sin * self.vx_m_s + cos * self.vy_m_s,
            wz_rad_s: self.wz_rad_s,
        }
    }
}

/// A body twist held for some time: forward and lateral displacement along the axes that turn with the vehicle, and the
/// turn.
///
/// Not the chord from start to end: a vehicle that turns by dyaw covers sin(dyaw/2) / (dyaw/2) of
/// (dx, dy) as the crow flies. Made by [`BodyTwist::over`], or
/// [`crate::geometry::Kinematics::displacement`]; [`PlanarPose::moved_by`] applies it.
///
/// ```
/// use omni_core::geometry::WheelAngles;
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.1)?)?;
/// let turned = WheelAngles { rad: [3.0_f64, 0.0, -3.0, 3.0, 3.0, 0.0, -3.0] };
/// let moved = kinematics.displacement(&turned);
/// assert!((moved.dx_m - 0.3).abs() < 1e-15);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BodyDisplacement<R> {
    /// Forward \[m\].
    pub dx_m: R,
    /// To the left \[m\].
    pub dy_m: R,
    /// Turn \[rad\] (counter-clockwise is +), whole turns included.
    pub dyaw_rad: R,
}

impl<R: Real> BodyDisplacement<R> {
    /// No motion: 0 m, 0 m, 0 rad.
    #[must_use]
    pub fn zero() -> Self {
        Self::from_array([R::zero(); 3])
    }

    /// `[dx, dy, dyaw]` in \[m, m, rad\].
    ///
    /// ```
    /// use omni_core::geometry::BodyDisplacement;
    /// let moved = BodyDisplacement { dx_m: 0.5, dy_m: -0.1, dyaw_rad: 6.5 };
    /// assert_eq!(moved.to_array(), [0.5, -0.1, 6.5]); // more than a turn stays more than a turn
    /// ```
    #[must_use]
    pub fn to_array(self) -> [R; 3] {
        [self.dx_m, self.dy_m, self.dyaw_rad]
    }

    /// The inverse of [`BodyDisplacement::to_array`]: `[dx, dy, dyaw]` in \[m, m, rad\].
    ///
    /// ```
    /// use omni_core::geometry::BodyDisplacement;
    /// use omni_core::BodyTwist;
    /// let twist = BodyTwist { vx_m_s: 0.5, vy_m_s: -0.25, wz_rad_s: 1.0 };
    /// assert_eq!(twist.over(2.0), BodyDisplacement::from_array([1.0, -0.5, 2.0]));
    /// ```
    #[must_use]
    pub fn from_array([dx_m, dy_m, dyaw_rad]: [R; 3]) -> Self {
        Self { dx_m, dy_m, dyaw_rad }
    }

    /// Change of x and y in the world \[m\] of a vehicle that starts at the heading `yaw_rad`.
    pub(crate) fn in_world(self, yaw_rad: R) -> [R; 2] {
        let half_turn = self.dyaw_rad * R::of(0.5);
        let chord = cardinal_sine(half_turn);
        let (sin, cos) = (yaw_rad + half_turn).sine_cosine();
        [
            (cos * self.dx_m - sin * self.dy_m) * chord,
            (sin * self.dx_m + cos * self.dy_m) * chord,
        ]
    }
}

/// Velocity of the vehicle's origin along the world's axes.
///
/// ```
/// use omni_core::geometry::{PlanarPose, WorldTwist};
/// let facing_left = PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: core::f64::consts::FRAC_PI_2 };
/// let body = WorldTwist { vx_m_s: 1.0, vy_m_s: 0.0, wz_rad_s: 0.0 }.to_body(&facing_left);
/// assert!((body.vy_m_s + 1.0).abs() < 1e-15); // world x is to the right of a vehicle that faces left
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct WorldTwist<R> {
    /// Velocity along world x \[m/s\].
    pub vx_m_s: R,
    /// Velocity along world y \[m/s\].
    pub vy_m_s: R,
    /// Yaw rate \[rad/s\] (counter-clockwise is +), the same in both frames.
    pub wz_rad_s: R,
}

impl<R: Real> WorldTwist<R> {
    /// The same motion in the frame of a vehicle at `pose`: (vx, vy) turned back by the yaw. The position has no
    /// effect. Undoes [`BodyTwist::to_world`]. In `f32` the yaw should stay within 8192 rad ([`Real::sine_cosine`]).
    ///
    /// ```
    /// use omni_core::geometry::{PlanarPose, WorldTwist};
    /// // Facing 30 degrees to the left of world x: world y is half ahead of it, the rest to its left.
    /// let pose = PlanarPose { yaw_rad: core::f64::consts::FRAC_PI_6, ..PlanarPose::origin() };
    /// let body = WorldTwist { vx_m_s: 0.0, vy_m_s: 1.0, wz_rad_s: 0.0 }.to_body(&pose);
    /// assert!((body.vx_m_s - 0.5).abs() < 1e-15 && (body.vy_m_s - 0.75_f64.sqrt()).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn to_body(self, pose: &PlanarPose<R>) -> BodyTwist<R> {
        let (sin, cos) = pose.yaw_rad.sine_cosine();
        BodyTwist {
            vx_m_s: cos * self.vx_m_s + sin * self.vy_m_s,
            vy_m_s: cos * self.vy_m_s - sin * self.vx_m_s,
            wz_rad_s: self.wz_rad_s,
        }
    }
}

/// Position and heading of the vehicle's origin in the world.
///
/// ```
/// use omni_core::geometry::{BodyDisplacement, PlanarPose};
/// // A quarter of a circle of radius 5 m to the left.
/// let quarter = core::f64::consts::FRAC_PI_2;
/// let arc = BodyDisplacement { dx_m: 5.0 * quarter, dy_m: 0.0, dyaw_rad: quarter };
/// let end = PlanarPose::origin().moved_by(&arc);
/// assert!((end.x_m - 5.0).abs() < 1e-14 && (end.y_m - 5.0).abs() < 1e-14);
/// assert_eq!(end.yaw_rad, quarter);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct PlanarPose<R> {
    /// World x \[m\].
    pub x_m: R,
    /// World y \[m\].
    pub y_m: R,
    /// Heading \[rad\], 0 along world x (counter-clockwise is +).
    pub yaw_rad: R,
}

impl<R: Real> PlanarPose<R> {
    /// At the world's origin, facing along its x: 0 m, 0 m, 0 rad.
    ///
    /// ```
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::BodyTwist;
    /// let twist = BodyTwist { vx_m_s: 0.3, vy_m_s: -0.1, wz_rad_s: 0.5 };
    /// let world = twist.to_world(&PlanarPose::origin()); // here both frames are the same
    /// assert_eq!((world.vx_m_s, world.vy_m_s), (0.3, -0.1));
    /// ```
    #[must_use]
    pub fn origin() -> Self {
        Self {
            x_m: R::zero(),
            y_m: R::zero(),
            yaw_rad: R::zero(),
        }
    }

    /// The pose after `displacement`, exact for a twist that stayed constant: the vehicle moves along an arc.
    ///
    /// The exponential map of the plane's rigid motions, its translation written as sin(dyaw/2) /
    /// (dyaw/2) R(yaw + dyaw/2) (dx, dy). The heading is added up as it is, not wrapped; in `f32`
    /// it should stay within 8192 rad ([`Real::sine_cosine`]). Over many steps use
    /// [`Odometry`](crate::estimate::Odometry), which does not lose what a sum rounds away.
    ///
    /// ```
    /// use omni_core::geometry::{BodyDisplacement, PlanarPose};
    /// // Half a circle of radius 1 m to the left: 2 m to the left of where it began, facing back.
    /// let half_turn = core::f64::consts::PI;
    /// let end = PlanarPose::origin().moved_by(&BodyDisplacement { dx_m: half_turn, dy_m: 0.0, dyaw_rad: half_turn });
    /// assert!(end.x_m.abs() < 1e-15 && (end.y_m - 2.0).abs() < 1e-15);
    /// assert_eq!(end.yaw_rad, half_turn);
    /// ```
    #[must_use]
    pub fn moved_by(self, displacement: &BodyDisplacement<R>) -> Self {
        let [dx, dy] = displacement.in_world(self.yaw_rad);
        Self {
            x_m: self.x_m + dx,
            y_m: self.y_m + dy,
            yaw_rad: self.yaw_rad + displacement.dyaw_rad,
        }
    }
}

#[cfg(test)]
mod tests;
