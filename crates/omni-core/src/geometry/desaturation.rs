//! Scaling of a twist to the wheels' speed limits; the direction of motion is kept.

#[cfg(test)]
mod tests;

use crate::constants::{constant_enum, constant_struct};
use crate::error::within;
use crate::geometry::{BodyTwist, Kinematics, PathFactors, WheelVelocities};
use crate::{ConfigError, Real};

/// The part of a twist that is kept if a wheel would exceed its highest speed.
///
/// ```
/// use omni_core::geometry::{Desaturation, SpeedLimits};
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6_f64, 0.4, 0.1)?)?;
/// // 5 rad/s of every wheel for translation, 20 for yaw, 10 allowed: yaw is too much even alone.
/// let twist = BodyTwist { vx_m_s: 0.5, vy_m_s: 0.0, wz_rad_s: 4.0 };
/// for (desaturation, translation, yaw) in [
///     (Desaturation::Uniform, 10.0 / 25.0, 10.0 / 25.0),
///     (Desaturation::KeepsYaw, 0.0, 10.0 / 20.0),
///     (Desaturation::KeepsTranslation, 1.0, (10.0 - 5.0) / 20.0),
/// ] {
///     let limited = SpeedLimits::new([10.0; 4], desaturation)?.desaturate(&kinematics, &twist);
///     assert!((limited.translation_factor - translation).abs() < 1e-12 && (limited.yaw_factor - yaw).abs() < 1e-12);
/// }
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum Desaturation {
    /// The direction: the whole twist is scaled by one factor, so that the path stays the same.
    Uniform,
    /// The yaw rate, as far as it is possible alone; the remaining capacity is used for translation, in its direction.
    KeepsYaw,
    /// Translation, as far as it is possible alone; the remaining capacity is used for yaw.
    KeepsTranslation,
}

constant_enum!(Desaturation {
    Uniform,
    KeepsYaw,
    KeepsTranslation
});

/// Speed limits of the actuators, and the part of a twist that is kept within them: desaturation, or normalisation, of
/// wheel speeds.
///
/// ```
/// use omni_core::geometry::{Desaturation, SpeedLimits};
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6_f64, 0.4, 0.1)?)?;
/// // Forward at 1 m/s, 10 rad/s of every wheel, and left at 2 rad/s, another 10 rad/s of the right wheels.
/// let twist = BodyTwist { vx_m_s: 1.0, vy_m_s: 0.0, wz_rad_s: 2.0 };
/// let limited = |what| SpeedLimits::new([16.0; 4], what).expect("valid").desaturate(&kinematics, &twist);
/// assert!((limited(Desaturation::Uniform).twist.vx_m_s - 0.8).abs() < 1e-12); // 16 of 20 rad/s
/// let yaw = limited(Desaturation::KeepsYaw);
/// assert!((yaw.twist.wz_rad_s - 2.0).abs() < 1e-12 && (yaw.twist.vx_m_s - 0.6).abs() < 1e-12);
/// let translation = limited(Desaturation::KeepsTranslation);
/// assert!((translation.twist.vx_m_s - 1.0).abs() < 1e-12 && (translation.twist.wz_rad_s - 1.2).abs() < 1e-12);
/// assert_eq!(translation.limiting, Some(1)); // the front right wheel was the first at its limit
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct SpeedLimits<R, const N: usize> {
    limit_rad_s: [R; N],
    desaturation: Desaturation,
}

constant_struct!(SpeedLimits<R, const N> { limit_rad_s: [R; N], desaturation: Desaturation });

/// A twist that every wheel can follow.
///
/// ```
/// use omni_core::geometry::{Desaturation, SpeedLimits};
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6_f64, 0.4, 0.1)?)?;
/// let weak_fourth = SpeedLimits::new([20.0, 20.0, 20.0, 5.0], Desaturation::Uniform)?;
/// let ahead = BodyTwist { vx_m_s: 1.0, ..BodyTwist::ZERO };
/// let limited = weak_fourth.desaturate(&kinematics, &ahead);
/// assert_eq!(limited.limiting, Some(3));
/// assert!((limited.translation_factor - 5.0 / 10.0).abs() < 1e-12); // 5 rad/s of 10
/// for velocity in limited.velocities.rad_s {
///     assert!((velocity - 5.0).abs() < 1e-12); // all of them, to go on straight
/// }
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Desaturated<R, const N: usize> {
    /// The twist as reduced.
    pub twist: BodyTwist<R>,
    /// The wheel velocities \[rad/s\] that belong to it, within the limits.
    pub velocities: WheelVelocities<R, N>,
    /// Factor on the translation, 0 to 1.
    pub translation_factor: R,
    /// Factor on the yaw rate, 0 to 1.
    pub yaw_factor: R,
    /// Index of the wheel that set the smallest factor; none if nothing was reduced.
    pub limiting: Option<usize>,
}

impl<R: Real, const N: usize> Desaturated<R, N> {
    /// Nothing reduced.
    pub(crate) fn whole(twist: BodyTwist<R>, velocities: WheelVelocities<R, N>) -> Self {
        Self {
            twist,
            velocities,
            translation_factor: R::one(),
            yaw_factor: R::one(),
            limiting: None,
        }
    }
}

impl<R: Real, const N: usize> SpeedLimits<R, N> {
    /// Placeholder if there are none.
    pub(crate) fn none() -> Self {
        Self {
            limit_rad_s: [R::one() / R::zero(); N],
            desaturation: Desaturation::Uniform,
        }
    }

    /// Limits `limit_rad_s` \[rad/s\] of the actuators' speeds, each above 0 and up to 1e6.
    ///
    /// # Errors
    /// Parameter `limit_rad_s` with the wheel's index.
    pub fn new(limit_rad_s: [R; N], desaturation: Desaturation) -> Result<Self, ConfigError> {
        for (index, &limit) in limit_rad_s.iter().enumerate() {
            within("limit_rad_s", limit, f64::MIN_POSITIVE..=1e6, "above 0, to 1e6")
                .map_err(|e| e.at(index))?;
            if limit <= R::zero() {
                return Err(ConfigError::new("limit_rad_s", limit.as_f64(), "above 0, to 1e6").at(index));
            }
        }
        Ok(Self {
            limit_rad_s,
            desaturation,
        })
    }

    /// The twist nearest to `twist` in the chosen sense that every wheel can follow. Closed form, O(N).
    ///
    /// ```
    /// use omni_core::geometry::{Desaturation, SpeedLimits};
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6_f64, 0.4, 0.1)?)?;
    /// // Ahead and to the left, front right and rear left turn with (0.8 + 0.6) / 0.1 = 14 rad/s; 7 is what they can.
    /// let limits = SpeedLimits::new([7.0; 4], Desaturation::Uniform)?;
    /// let twist = BodyTwist { vx_m_s: 0.8, vy_m_s: 0.6, wz_rad_s: 0.0 };
    /// let limited = limits.desaturate(&kinematics, &twist).twist;
    /// assert!((limited.vx_m_s - 0.4).abs() < 1e-12 && (limited.vy_m_s - 0.3).abs() < 1e-12); // the same direction
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn desaturate(&self, kinematics: &Kinematics<R, N>, twist: &BodyTwist<R>) -> Desaturated<R, N> {
        self.desaturate_at(
            kinematics,
            twist,
            [R::zero(); 2],
            &PathFactors::default(),
            &[false; N],
        )
    }

    /// [`SpeedLimits::desaturate`] of the twist of a point of the body, which moves as commanded as far as it can, for
    /// wheels on paths of their own; wheels marked in `dropped` do not drive and are excluded.
    pub(crate) fn desaturate_at(
        &self,
        kinematics: &Kinematics<R, N>,
        twist: &BodyTwist<R>,
        point_m: [R; 2],
        path: &PathFactors<R, N>,
        dropped: &[bool; N],
    ) -> Desaturated<R, N> {
        let [vx, vy, wz] = twist.to_array();
        let zero = R::zero();
        let of_origin = |twist| BodyTwist::from_point(BodyTwist::from_array(twist), point_m);
        let translation = kinematics.inverse(&of_origin([vx, vy, zero]));
        let yaw = kinematics.inverse(&of_origin([zero, zero, wz]));
        let whole = WheelVelocities {
            rad_s: combined(&translation.rad_s, R::one(), &yaw.rad_s, R::one()),
        };
        if !whole.is_finite() {
            // No wheel turns that fast, and no direction is left in it.
            return Desaturated {
                translation_factor: zero,
                yaw_factor: zero,
                ..Desaturated::whole(BodyTwist::ZERO, WheelVelocities::zero())
            };
        }
        let on_path = Self {
            limit_rad_s: path
                .of_body(&WheelVelocities {
                    rad_s: self.limit_rad_s,
                })
                .rad_s,
            ..*self
        };
        let (factor, limiting) = on_path.room(&[zero; N], &whole.rad_s, dropped);
        if limiting.is_none() {
            return Desaturated::whole(of_origin([vx, vy, wz]), whole);
        }
        let (translation_factor, yaw_factor, limiting) = match self.desaturation {
            Desaturation::Uniform => (factor, factor, limiting),
            Desaturation::KeepsYaw => {
                let (yaw, translation, limiting) = on_path.one_first(&yaw.rad_s, &translation.rad_s, dropped);
                (translation, yaw, limiting)
            }
            Desaturation::KeepsTranslation => on_path.one_first(&translation.rad_s, &yaw.rad_s, dropped),
        };
        let velocities = WheelVelocities {
            rad_s: combined(&translation.rad_s, translation_factor, &yaw.rad_s, yaw_factor),
        };
        let twist = of_origin([vx * translation_factor, vy * translation_factor, wz * yaw_factor]);
        Desaturated {
            twist,
            velocities,
            translation_factor,
            yaw_factor,
            limiting,
        }
    }

    /// Wheel velocities scaled by one factor into the limits: the factor, 0 to 1, and the wheel that set it.
    ///
    /// ```
    /// use omni_core::geometry::{Desaturation, SpeedLimits};
    /// use omni_core::WheelVelocities;
    /// let limits = SpeedLimits::new([5.5_f64; 4], Desaturation::Uniform)?;
    /// let (scaled, factor, limiting) = limits.scale(&WheelVelocities { rad_s: [5.0, 6.0, 4.0, -7.0] });
    /// assert!((scaled.rad_s[3] + 5.5).abs() < 1e-12 && (factor - 5.5 / 7.0).abs() < 1e-12);
    /// assert_eq!(limiting, Some(3));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn scale(&self, velocities: &WheelVelocities<R, N>) -> (WheelVelocities<R, N>, R, Option<usize>) {
        let (factor, limiting) = self.room(&[R::zero(); N], &velocities.rad_s, &[false; N]);
        (
            WheelVelocities {
                rad_s: velocities.rad_s.map(|v| v * factor),
            },
            factor,
            limiting,
        )
    }

    /// Factors of `first` and `second` and the limiting wheel: `first` alone is brought within the limits, then as much
    /// of `second` as there is room for.
    fn one_first(&self, first: &[R; N], second: &[R; N], dropped: &[bool; N]) -> (R, R, Option<usize>) {
        let (kept, by_first) = self.room(&[R::zero(); N], first, dropped);
        if by_first.is_some() {
            // A wheel is at its limit already. What the second part would do for it is of no use: another wheel pays.
            return (kept, R::zero(), by_first);
        }
        let (room, by_second) = self.room(first, second, dropped);
        (kept, room, by_second)
    }

    /// The largest factor, 0 to 1, of `part` that keeps `base + factor * part` within the limits, for a `base` within
    /// them; and the wheel that sets it.
    fn room(&self, base: &[R; N], part: &[R; N], dropped: &[bool; N]) -> (R, Option<usize>) {
        let (mut factor, mut limiting) = (R::one(), None);
        for (index, ((&b, &p), &limit)) in base.iter().zip(part).zip(&self.limit_rad_s).enumerate() {
            let left = if p > R::zero() { limit - b } else { limit + b };
            // Without a division for the wheels that have room.
            if !dropped[index] && p.abs() > left && left < factor * p.abs() {
                factor = left / p.abs();
                limiting = Some(index);
            }
        }
        (factor, limiting)
    }
}

fn combined<R: Real, const N: usize>(a: &[R; N], a_factor: R, b: &[R; N], b_factor: R) -> [R; N] {
    let mut sum = *a;
    for (s, b) in sum.iter_mut().zip(b) {
        *s = *s * a_factor + *b * b_factor;
    }
    sum
}
