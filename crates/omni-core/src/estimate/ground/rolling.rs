//! Speed of a wheel on even ground at which the vehicle would move as it does: without climbing, leaning and hinges.

use crate::Real;
use crate::geometry::BodyTwist;
use crate::linkage::{WheelPlace, cross, dot, turned};
use crate::scalar::is_plausible;

/// Below this speed the slope of the path is not determined by the velocity \[m/s\].
const SLOW_M_S: f64 = 0.02;

/// A wheel as it is built.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub(super) struct RollingWheel<R> {
    pub(super) position_m: [R; 2],
    pub(super) radius_m: R,
    pub(super) wheel_per_actuator: R,
    /// Rolling direction, and the tangent of the roller's angle to it.
    pub(super) direction: [R; 2],
    pub(super) roller: R,
}

/// A wheel's level motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct LevelRolling<R> {
    /// Velocity of its actuator on even ground \[rad/s\].
    pub(super) actuator_rad_s: R,
    /// Speed of its centre over the ground \[m/s\].
    pub(super) ground_m_s: R,
    /// Level speed of its rim beyond that of its centre, absolute \[m/s\].
    pub(super) excess_m_s: R,
}

impl<R: Real> RollingWheel<R> {
    /// The wheel at this place, whose centre rises, while the vehicle moves by `twist`.
    ///
    /// A wheel that rolls up a slope rolls along its path: the level part of its speed is
    /// `sqrt(speed^2 - rise^2)`. The reading of its encoder is corrected by the rotation of the carrier, and by what
    /// lean and hinges change: position, direction and velocity of its centre.
    pub(super) fn level(
        &self,
        place: &WheelPlace<R>,
        actuator_rad_s: R,
        rise_m_s: R,
        twist: &BodyTwist<R>,
    ) -> LevelRolling<R> {
        let ([dx, dy], tan) = (self.direction, self.roller);
        let rolling = turned(&place.axes, &[dx, dy, R::zero()]);
        let [_, _, up] = &place.axes;
        let carried_rad_s = dot(&place.rate_rad_s, &cross(up, &rolling));
        let rim_m_s = self.radius_m * (self.wheel_per_actuator * actuator_rad_s + carried_rad_s);
        let length = (rolling[0] * rolling[0] + rolling[1] * rolling[1]).sqrt();
        let (ex, ey) = (rolling[0] / length, rolling[1] / length);
        let BodyTwist {
            vx_m_s: vx,
            vy_m_s: vy,
            wz_rad_s: wz,
        } = *twist;
        let ([cx, cy, _], [ux, uy, _]) = (place.centre_m, place.velocity_m_s);
        let (wx, wy) = (vx + ux - wz * cy, vy + uy + wz * cx);
        let (along, across) = (wx * ex + wy * ey, wy * ex - wx * ey);
        let ground2 = wx * wx + wy * wy;
        // Its share of the rise: all of it straight ahead, none if it moves along its axle.
        let share = if ground2 > R::of(SLOW_M_S * SLOW_M_S) {
            let cosine2 = along * along / ground2;
            cosine2 * (R::of(2.0) - cosine2)
        } else {
            R::one()
        };
        let free = rim_m_s - tan * across;
        let level2 = free * free - share * rise_m_s * rise_m_s;
        let level = if level2 <= R::zero() {
            R::zero()
        } else if free < R::zero() {
            -level2.sqrt()
        } else {
            level2.sqrt()
        };
        // The same wheel on even ground.
        let [px, py] = self.position_m;
        let (ox, oy) = (vx - wz * py, vy + wz * px);
        let (even, even_across) = (ox * dx + oy * dy, oy * dx - ox * dy);
        let even_rim = level - along + even + tan * even_across;
        let actuator_even_rad_s = even_rim / (self.radius_m * self.wheel_per_actuator);
        LevelRolling {
            // A wheel whose place is not known counts as one on even ground.
            actuator_rad_s: if is_plausible(actuator_even_rad_s) {
                actuator_even_rad_s
            } else {
                actuator_rad_s
            },
            ground_m_s: ground2.sqrt(),
            excess_m_s: free.abs() - along.abs(),
        }
    }
}
