//! Velocities and poses in the plane, and the only conversions between frames.
//!
//! REP-103: x forward, y left, rotation counter-clockwise positive.

use crate::Real;

/// Velocity of the vehicle in its own frame: what the inverse kinematics takes. Not a world velocity.
///
/// ```
/// use omni_core::BodyTwist;
/// let forward = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// assert_eq!(forward.vy_m_s, 0.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyTwist<R> {
    /// Forward velocity \[m/s\] (forward is +).
    pub vx_m_s: R,
    /// Sideways velocity \[m/s\] (left is +).
    pub vy_m_s: R,
    /// Yaw rate \[rad/s\] (counter-clockwise seen from above is +).
    pub wz_rad_s: R,
}

impl BodyTwist<f64> {
    /// At rest, in `f64`; [`BodyTwist::zero`] for any scalar.
    pub const ZERO: Self = Self {
        vx_m_s: 0.0,
        vy_m_s: 0.0,
        wz_rad_s: 0.0,
    };
}

impl<R: Real> BodyTwist<R> {
    /// At rest.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            vx_m_s: R::zero(),
            vy_m_s: R::zero(),
            wz_rad_s: R::zero(),
        }
    }

    /// `[vx, vy, wz]` in \[m/s, m/s, rad/s\]: the vector X' of eq. (6).
    #[must_use]
    pub fn to_array(self) -> [R; 3] {
        [self.vx_m_s, self.vy_m_s, self.wz_rad_s]
    }

    /// The inverse of [`BodyTwist::to_array`].
    #[must_use]
    pub fn from_array([vx_m_s, vy_m_s, wz_rad_s]: [R; 3]) -> Self {
        Self {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        }
    }

    /// The same motion seen from the world, for a vehicle at `pose`.
    #[must_use]
    pub fn to_world(self, pose: &PlanarPose<R>) -> WorldTwist<R> {
        let (sin, cos) = pose.yaw_rad.sin_cos();
        WorldTwist {
            vx_m_s: cos * self.vx_m_s - sin * self.vy_m_s,
            vy_m_s: sin * self.vx_m_s + cos * self.vy_m_s,
            wz_rad_s: self.wz_rad_s,
        }
    }
}

/// Velocity of the vehicle's origin along the world's axes.
///
/// ```
/// use omni_core::{PlanarPose, WorldTwist};
/// let facing_left = PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: core::f64::consts::FRAC_PI_2 };
/// let body = WorldTwist { vx_m_s: 1.0, vy_m_s: 0.0, wz_rad_s: 0.0 }.to_body(&facing_left);
/// assert!((body.vy_m_s + 1.0).abs() < 1e-15); // world x is to the right of a vehicle that faces left
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldTwist<R> {
    /// Velocity along world x \[m/s\].
    pub vx_m_s: R,
    /// Velocity along world y \[m/s\].
    pub vy_m_s: R,
    /// Yaw rate \[rad/s\] (counter-clockwise is +), the same in both frames.
    pub wz_rad_s: R,
}

impl<R: Real> WorldTwist<R> {
    /// The same motion in the frame of a vehicle at `pose`.
    #[must_use]
    pub fn to_body(self, pose: &PlanarPose<R>) -> BodyTwist<R> {
        let (sin, cos) = pose.yaw_rad.sin_cos();
        BodyTwist {
            vx_m_s: cos * self.vx_m_s + sin * self.vy_m_s,
            vy_m_s: cos * self.vy_m_s - sin * self.vx_m_s,
            wz_rad_s: self.wz_rad_s,
        }
    }
}

/// Position and heading of the vehicle's origin in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPose<R> {
    /// World x \[m\].
    pub x_m: R,
    /// World y \[m\].
    pub y_m: R,
    /// Heading \[rad\], 0 along world x (counter-clockwise is +).
    pub yaw_rad: R,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn to_body_undoes_to_world_at_any_heading() {
        for k in -20..20 {
            let pose = PlanarPose {
                x_m: 3.0,
                y_m: -1.0,
                yaw_rad: 0.37 * f64::from(k),
            };
            let twist = BodyTwist {
                vx_m_s: 0.3,
                vy_m_s: -0.2,
                wz_rad_s: 0.5,
            };
            let back = twist.to_world(&pose).to_body(&pose);
            // Two rotations of numbers below 1: a few units in the last place.
            assert!((back.vx_m_s - twist.vx_m_s).abs() < 1e-15);
            assert!((back.vy_m_s - twist.vy_m_s).abs() < 1e-15);
        }
    }
}
