//! Velocity, acceleration and jerk limits of a twist: axis by axis, or along the motion.

use crate::constants::{constant_enum, constant_struct};
use crate::error::period;
use crate::geometry::BodyTwist;
use crate::shaping::limits::{axis_names, limit, ramp_start, speed_limit};
use crate::shaping::{AxisLimits, RateLimiter, RateLimiterState};
use crate::sum::Sum;
use crate::{ConfigError, Real};

/// Limits of a motion that are the same in every direction. The unit of velocity is the user's, \[m/s\] or \[rad/s\].
///
/// Infinity means no limit. Checked by [`TwistLimiter::new`].
///
/// ```
/// use omni_core::shaping::MotionLimits;
/// let limits = MotionLimits { velocity: 1.5, ..MotionLimits::<f32>::unlimited() };
/// assert_eq!((limits.velocity, limits.jerk), (1.5, f32::INFINITY));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct MotionLimits<R> {
    /// Highest speed \[m/s or rad/s\], >= 0.
    pub velocity: R,
    /// Change of velocity while the speed grows \[m/s^2 or rad/s^2\], > 0.
    pub acceleration: R,
    /// Change of velocity while the speed shrinks \[m/s^2 or rad/s^2\], > 0.
    pub deceleration: R,
    /// Change of the acceleration \[m/s^3 or rad/s^3\], > 0.
    pub jerk: R,
}

constant_struct!(MotionLimits<R> { velocity: R, acceleration: R, deceleration: R, jerk: R });

impl<R: Real> MotionLimits<R> {
    /// No limit at all.
    ///
    /// ```
    /// use omni_core::shaping::{MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
    /// use omni_core::BodyTwist;
    /// let (linear, yaw) = (MotionLimits::unlimited(), MotionLimits::unlimited());
    /// let limiter = TwistLimiter::new(TwistLimits::AlongMotion { linear, yaw }, 1e-3)?;
    /// let fast = BodyTwist { vx_m_s: 30.0, vy_m_s: -20.0, wz_rad_s: 10.0 };
    /// assert_eq!(limiter.step(&mut TwistLimiterState::default(), &fast).to_array(), [30.0, -20.0, 10.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn unlimited() -> Self {
        let none = R::of(f64::INFINITY);
        Self {
            velocity: none,
            acceleration: none,
            deceleration: none,
            jerk: none,
        }
    }
}

/// Limits of a twist. Checked by [`TwistLimiter::new`].
///
/// ```
/// use omni_core::shaping::{AxisLimits, MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
/// use omni_core::BodyTwist;
/// let [vx, vy, wz] = [AxisLimits::symmetric(2.0, 1.0, 1.0, f64::INFINITY); 3];
/// let linear = MotionLimits { acceleration: 1.0, ..MotionLimits::unlimited() };
/// let target = BodyTwist { vx_m_s: 1.0, vy_m_s: 0.5, wz_rad_s: 0.0 };
/// let direction = |limits| {
///     let limiter = TwistLimiter::new(limits, 0.01).expect("valid");
///     let twist = limiter.step(&mut TwistLimiterState::default(), &target);
///     twist.vy_m_s / twist.vx_m_s
/// };
/// assert_eq!(direction(TwistLimits::PerAxis { vx, vy, wz }), 1.0); // both axes as quick as they may: a detour
/// let along = direction(TwistLimits::AlongMotion { linear, yaw: MotionLimits::unlimited() });
/// assert!((along - 0.5).abs() < 1e-12); // the target's direction from the first step on
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum TwistLimits<R> {
    /// Each axis separately: each is as fast as its limits allow, and the path bends while one of them lags.
    PerAxis {
        /// Forward velocity \[m/s\].
        vx: AxisLimits<R>,
        /// Sideways velocity \[m/s\].
        vy: AxisLimits<R>,
        /// Yaw rate \[rad/s\].
        wz: AxisLimits<R>,
    },
    /// One factor for the whole twist, so that a limit slows the motion down and leaves the curvature of
    /// the path alone. Changes of the twist run along the straight line from the present twist to the
    /// target. A speed limit of 0 in one group passes only twists without a component in that group.
    AlongMotion {
        /// The velocity (vx, vy) as a vector, whatever its direction \[m/s\].
        linear: MotionLimits<R>,
        /// Yaw rate \[rad/s\].
        yaw: MotionLimits<R>,
    },
}

/// The state of a [`TwistLimiter`] between steps; `default` is at rest.
///
/// ```
/// use omni_core::shaping::{MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
/// use omni_core::BodyTwist;
/// let linear = MotionLimits { acceleration: 2.0, ..MotionLimits::unlimited() };
/// let limiter = TwistLimiter::new(TwistLimits::AlongMotion { linear, yaw: MotionLimits::unlimited() }, 0.125)?;
/// let mut state = TwistLimiterState::default();
/// let target = BodyTwist { vx_m_s: 1.0, ..BodyTwist::ZERO };
/// let velocities = [0; 2].map(|_| limiter.step(&mut state, &target).vx_m_s);
/// assert_eq!(velocities, [0.25, 0.5]); // each step goes on where the last one ended
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct TwistLimiterState<R> {
    axes: [RateLimiterState<R>; 3],
}

impl<R: Real> Default for TwistLimiterState<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real> TwistLimiterState<R> {
    /// At rest, also for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            axes: [RateLimiterState::new(); 3],
        }
    }

    /// Moving steadily with `twist`, which may be outside the limits: the limiter then brings it
    /// in. Components that are not finite count as zero.
    ///
    /// ```
    /// use omni_core::shaping::TwistLimiterState;
    /// use omni_core::BodyTwist;
    /// let halfway = TwistLimiterState::at(&BodyTwist { vx_m_s: 0.5, vy_m_s: f64::NAN, wz_rad_s: -1.0 });
    /// assert_eq!(halfway.twist().to_array(), [0.5, 0.0, -1.0]);
    /// ```
    #[must_use]
    pub fn at(twist: &BodyTwist<R>) -> Self {
        Self {
            axes: twist.to_array().map(RateLimiterState::at),
        }
    }

    /// The last step, which began at `before`, takes no more of the linear and of the yaw speed than `braked` does.
    pub(crate) fn brake_no_harder(&mut self, before: &BodyTwist<R>, braked: &BodyTwist<R>) {
        let now = self.twist();
        let speed = |twist: &BodyTwist<R>| linear_part(twist.to_array()).norm();
        let harder = [
            is_harder(speed(before), speed(braked), speed(&now)),
            is_harder(before.wz_rad_s.abs(), braked.wz_rad_s.abs(), now.wz_rad_s.abs()),
        ];
        let (from, to) = (before.to_array(), braked.to_array());
        for (i, axis) in self.axes.iter_mut().enumerate() {
            if harder[i / 2] {
                axis.velocity = Sum::of(to[i]);
                axis.step = Sum::of(to[i] - from[i]);
            }
        }
    }

    /// The twist that the last step returned.
    ///
    /// ```
    /// use omni_core::shaping::{MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
    /// use omni_core::BodyTwist;
    /// let linear = MotionLimits { velocity: 0.5, ..MotionLimits::unlimited() };
    /// let limiter = TwistLimiter::new(TwistLimits::AlongMotion { linear, yaw: MotionLimits::unlimited() }, 1e-3)?;
    /// let mut state = TwistLimiterState::default();
    /// limiter.step(&mut state, &BodyTwist { vx_m_s: -2.0, ..BodyTwist::ZERO });
    /// assert_eq!(state.twist().vx_m_s, -0.5);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn twist(&self) -> BodyTwist<R> {
        BodyTwist::from_array(self.axes.map(|axis| axis.velocity.total))
    }
}

/// Rate limiter of a twist; see [`TwistLimits`]. The changing state is in [`TwistLimiterState`].
///
/// [`TwistLimits::PerAxis`] is three [`RateLimiter`]s. [`TwistLimits::AlongMotion`] first scales the target so that it
/// obeys both speed limits. The change D of the twist that is left is then done in part: one factor for vx, vy and wz,
/// the largest that both groups, linear and yaw, allow. A group decelerates while its part of D has a component against
/// its velocity. A jerk limit looks ahead along D as [`RateLimiter`] does, and also limits the change of the
/// acceleration by one factor. A target that stays is reached exactly; from rest, along a straight line and without
/// overshoot. Only where a changed target finds an acceleration that points elsewhere and would carry a group out of
/// its limits does that group first reduce its acceleration, separately.
///
/// ```
/// use omni_core::shaping::{MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
/// use omni_core::BodyTwist;
/// let linear = MotionLimits { velocity: 1.0, acceleration: 0.5, ..MotionLimits::unlimited() };
/// let limiter = TwistLimiter::new(TwistLimits::AlongMotion { linear, yaw: MotionLimits::unlimited() }, 0.5)?;
/// let mut state = TwistLimiterState::default();
/// // Too fast by a factor of 2 on a circle of 0.5 m: everything is halved, and reached in four steps of 0.25 m/s.
/// let target = BodyTwist { vx_m_s: 2.0_f64, vy_m_s: 0.0, wz_rad_s: 4.0 };
/// let twists = [0; 4].map(|_| limiter.step(&mut state, &target));
/// assert_eq!(twists[0], BodyTwist { vx_m_s: 0.25, vy_m_s: 0.0, wz_rad_s: 0.5 });
/// assert_eq!(twists[3], BodyTwist { vx_m_s: 1.0, vy_m_s: 0.0, wz_rad_s: 2.0 });
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct TwistLimiter<R> {
    law: Law<R>,
}

constant_struct!(TwistLimiter<R> { law: Law<R> });

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
/// Limits of a twist, in velocity steps per period.
#[repr(C, u8)]
pub enum Law<R> {
    /// [`TwistLimits::PerAxis`].
    PerAxis {
        /// vx, vy, wz.
        axes: [RateLimiter<R>; 3],
    },
    /// [`TwistLimits::AlongMotion`].
    AlongMotion {
        /// vx and vy.
        linear: Group<R>,
        /// wz.
        yaw: Group<R>,
    },
}

constant_enum!(Law<R> { PerAxis { axes }, AlongMotion { linear, yaw } });

impl<R: Real> TwistLimiter<R> {
    /// A limiter that is stepped every `period_s` \[s\], 1e-6 to 10.
    ///
    /// # Errors
    /// The parameter that is out of range, as `period_s`, `vx.jerk` or `yaw.velocity`; ranges as in [`AxisLimits`] and
    /// [`MotionLimits`].
    pub fn new(limits: TwistLimits<R>, period_s: R) -> Result<Self, ConfigError> {
        let law = match limits {
            TwistLimits::PerAxis { vx, vy, wz } => Law::PerAxis {
                axes: [
                    RateLimiter::named(vx, period_s, &axis_names!("vx."))?,
                    RateLimiter::named(vy, period_s, &axis_names!("vy."))?,
                    RateLimiter::named(wz, period_s, &axis_names!("wz."))?,
                ],
            },
            TwistLimits::AlongMotion { linear, yaw } => Law::AlongMotion {
                linear: Group::new(
                    linear,
                    period_s,
                    [
                        "linear.velocity",
                        "linear.acceleration",
                        "linear.deceleration",
                        "linear.jerk",
                    ],
                )?,
                yaw: Group::new(
                    yaw,
                    period_s,
                    ["yaw.velocity", "yaw.acceleration", "yaw.deceleration", "yaw.jerk"],
                )?,
            },
        };
        Ok(Self { law })
    }

    /// One control period towards `target`: the twist to command next, always finite.
    ///
    /// A target with a component that is not finite holds the twist; per axis, it holds only that component. Along the
    /// motion components are first cut to +-1e9, so that their squares stay finite in `f32`.
    ///
    /// ```
    /// use omni_core::shaping::{MotionLimits, TwistLimiter, TwistLimiterState, TwistLimits};
    /// use omni_core::BodyTwist;
    /// let linear = MotionLimits { velocity: 1.0, ..MotionLimits::unlimited() };
    /// let limiter = TwistLimiter::new(TwistLimits::AlongMotion { linear, yaw: MotionLimits::unlimited() }, 1e-3)?;
    /// let mut state = TwistLimiterState::default();
    /// // sqrt(3^2 + 4^2) = 5 m/s: a fifth of everything, the yaw rate too.
    /// let twist = limiter.step(&mut state, &BodyTwist { vx_m_s: 3.0_f64, vy_m_s: 4.0, wz_rad_s: 1.0 });
    /// assert!((twist.vx_m_s - 0.6).abs() < 1e-12 && (twist.wz_rad_s - 0.2).abs() < 1e-12);
    /// let held = limiter.step(&mut state, &BodyTwist { vy_m_s: f64::NAN, ..BodyTwist::ZERO });
    /// assert_eq!(held.vx_m_s, twist.vx_m_s);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step(&self, state: &mut TwistLimiterState<R>, target: &BodyTwist<R>) -> BodyTwist<R> {
        match &self.law {
            Law::PerAxis { axes: limiters } => {
                // Not a loop, so that the compiler knows constant limits of each axis.
                let [vx, vy, wz] = limiters;
                let [x, y, z] = &mut state.axes;
                vx.step(x, target.vx_m_s);
                vy.step(y, target.vy_m_s);
                wz.step(z, target.wz_rad_s);
            }
            Law::AlongMotion { linear, yaw } => step_along(linear, yaw, &mut state.axes, target.to_array()),
        }
        state.twist()
    }
}

/// A vector of the velocity space of one group; the yaw rate leaves `y` at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Vector<R> {
    pub(crate) x: R,
    pub(crate) y: R,
}

impl<R: Real> Vector<R> {
    fn dot(self, other: Self) -> R {
        self.x * other.x + self.y * other.y
    }

    pub(crate) fn norm(self) -> R {
        self.dot(self).sqrt()
    }

    pub(crate) fn scaled(self, factor: R) -> Self {
        Self {
            x: factor * self.x,
            y: factor * self.y,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
        }
    }
}

/// Is less left than of a brake? One that takes as much but for rounding is none, so that its jerk goes on.
fn is_harder<R: Real>(before: R, braked: R, now: R) -> bool {
    braked - now > R::of(1e-3) * (before - braked)
}

fn linear_part<R: Real>([x, y, _]: [R; 3]) -> Vector<R> {
    Vector { x, y }
}

fn yaw_part<R: Real>([_, _, x]: [R; 3]) -> Vector<R> {
    Vector { x, y: R::zero() }
}

fn smaller<R: Real>(a: R, b: R) -> R {
    if b < a { b } else { a }
}

/// `part / whole`, no more than 1; 1 if the whole is nothing.
fn share<R: Real>(part: R, whole: R) -> R {
    if part < whole { part / whole } else { R::one() }
}

/// Limits of one group in velocity steps per period.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Group<R> {
    speed: R,
    up: R,
    down: R,
    jerk_step: R,
}

constant_struct!(Group<R> { speed: R, up: R, down: R, jerk_step: R });

impl<R: Real> Group<R> {
    fn new(limits: MotionLimits<R>, period_s: R, names: [&'static str; 4]) -> Result<Self, ConfigError> {
        let dt = period(period_s)?;
        let [velocity, acceleration, deceleration, jerk] = names;
        Ok(Self {
            speed: speed_limit(velocity, limits.velocity)?,
            up: limit(acceleration, limits.acceleration)? * dt,
            down: limit(deceleration, limits.deceleration)? * dt,
            jerk_step: limit(jerk, limits.jerk)? * dt * dt,
        })
    }

    fn is_smooth(&self) -> bool {
        self.jerk_step.is_finite_real()
    }

    /// How much of the change `distance` from `velocity` this period may do, 0 to 1. `smooth`: some group limits jerk,
    /// so that a step may have to be spread over several.
    fn progress(&self, velocity: Vector<R>, distance: Vector<R>, smooth: bool) -> R {
        let length = distance.norm();
        // Along the line to the target the speed shrinks for another `shrinking`, then grows.
        let shrinking = -velocity.dot(distance) / length;
        let most = if shrinking <= R::zero() || length <= R::zero() {
            self.up
        } else if smooth {
            if self.up < self.down && shrinking < length {
                smaller(self.down, ramp_start(shrinking, self.up, self.jerk_step))
            } else {
                self.down
            }
        } else if self.down <= shrinking {
            self.down
        } else {
            shrinking + self.up * (R::one() - shrinking / self.down)
        };
        let most = if self.is_smooth() {
            smaller(most, ramp_start(length, R::zero(), self.jerk_step))
        } else {
            most
        };
        share(most, length)
    }

    /// Does the step `wanted` leave a way to stay within the limits?
    ///
    /// It does where shortening all later steps as much as jerk allows stops the velocity within the speed limit, and
    /// brings a step that is above the acceleration limit below it before the speed grows. Shortening keeps that so.
    fn is_safe(&self, velocity: Vector<R>, wanted: Vector<R>) -> bool {
        let length = wanted.norm();
        if length <= R::zero() {
            return true;
        }
        let slack = R::of(64.0) * R::default_epsilon();
        let next = velocity.plus(wanted);
        let direction = wanted.scaled(R::one() / length);
        let stop = next.plus(direction.scaled(self.still_to_come(length, R::zero())));
        let allowed = self.speed * self.speed;
        let rounding = slack * (length + velocity.x.abs() + velocity.y.abs());
        // Outside the speed limit, where it may have started, no faster than it is.
        (stop.dot(stop) <= allowed + slack * allowed || stop.dot(stop) <= velocity.dot(velocity))
            && (length <= self.up + slack * self.up
                || self.still_to_come(length, self.up) <= rounding - next.dot(direction))
    }

    /// What the steps above `base` after a step of length `step` add up to, if each is shorter by as much as jerk
    /// allows.
    fn still_to_come(&self, step: R, base: R) -> R {
        let count = ((step - base) / self.jerk_step).ceil();
        if count > R::one() {
            (count - R::one()) * (step - R::of(0.5) * count * self.jerk_step)
        } else {
            R::zero()
        }
    }
}

#[inline(never)]
fn step_along<R: Real>(
    linear: &Group<R>,
    yaw: &Group<R>,
    axes: &mut [RateLimiterState<R>; 3],
    target: [R; 3],
) {
    let huge = R::of(1e9);
    for axis in axes.iter_mut() {
        axis.velocity.total = axis.velocity.total.limited(-huge, huge);
    }
    let velocity = axes.map(|axis| axis.velocity.total);
    let target = if target.iter().all(|t| t.is_finite_real()) {
        let target = target.map(|t| t.limited(-huge, huge));
        let factor = smaller(
            share(linear.speed, linear_part(target).norm()),
            share(yaw.speed, yaw_part(target).norm()),
        );
        target.map(|t| factor * t)
    } else {
        velocity
    };
    let mut distance = target;
    for (d, axis) in distance.iter_mut().zip(&*axes) {
        *d = axis.velocity.gap(*d);
    }
    let smooth = linear.is_smooth() || yaw.is_smooth();
    let factor = smaller(
        linear.progress(linear_part(velocity), linear_part(distance), smooth),
        yaw.progress(yaw_part(velocity), yaw_part(distance), smooth),
    );
    let mut steps = distance.map(|d| Sum::of(factor * d));
    if smooth {
        let last = axes.map(|axis| axis.step);
        let mut change = steps.map(|step| step.total);
        for (c, l) in change.iter_mut().zip(&last) {
            *c = l.gap(*c);
        }
        let factor = smaller(
            share(linear.jerk_step, linear_part(change).norm()),
            share(yaw.jerk_step, yaw_part(change).norm()),
        );
        if factor < R::one() {
            for ((step, l), c) in steps.iter_mut().zip(&last).zip(change) {
                *step = l.plus(factor * c);
            }
        }
        let wanted = steps.map(|step| step.total);
        let last_step = last.map(|l| l.total);
        let [mut planar, mut turn] = [R::zero(); 2];
        if !linear.is_safe(linear_part(velocity), linear_part(wanted)) {
            planar = share(linear.jerk_step, linear_part(last_step).norm());
        }
        if !yaw.is_safe(yaw_part(velocity), yaw_part(wanted)) {
            turn = share(yaw.jerk_step, yaw_part(last_step).norm());
        }
        for ((step, l), part) in steps.iter_mut().zip(&last).zip([planar, planar, turn]) {
            if part > R::zero() {
                *step = l.plus(-part * l.total);
            }
        }
    }
    for (((axis, step), d), t) in axes.iter_mut().zip(steps).zip(distance).zip(target) {
        axis.advance(step, d, t);
    }
}

#[cfg(test)]
mod tests;
