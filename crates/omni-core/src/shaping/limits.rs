//! Velocity, acceleration and jerk limits of one axis: a rate limiter with look-ahead.
//!
//! Inside, all rates are velocity steps: what the velocity may gain or lose in one control period. A period is then one
//! addition, and no division by the period is left.

use crate::constants::constant_struct;
use crate::error::period;
use crate::sum::Sum;
use crate::{ConfigError, Real};

/// Limits of one axis. The unit of velocity is the user's, \[m/s\] or \[rad/s\]; the other units follow from it.
///
/// Forward is positive velocity, reverse negative. Acceleration is speed growing, deceleration speed shrinking.
/// Infinity means no limit. Checked when a [`RateLimiter`] or a [`crate::shaping::TwistLimiter`] is built from it.
///
/// ```
/// use omni_core::shaping::AxisLimits;
/// let limits = AxisLimits::<f64> { min_velocity: -0.5, ..AxisLimits::symmetric(1.0, 2.0, 4.0, f64::INFINITY) };
/// assert_eq!(limits.max_velocity, 1.0);
/// assert_eq!(limits.reverse_deceleration, 4.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisLimits<R> {
    /// Lowest velocity \[m/s or rad/s\], <= 0.
    pub min_velocity: R,
    /// Highest velocity \[m/s or rad/s\], >= 0.
    pub max_velocity: R,
    /// Growth of the speed while moving forward \[m/s^2 or rad/s^2\], > 0.
    pub acceleration: R,
    /// Loss of speed while moving forward \[m/s^2 or rad/s^2\], > 0.
    pub deceleration: R,
    /// Growth of the speed while moving in reverse \[m/s^2 or rad/s^2\], > 0.
    pub reverse_acceleration: R,
    /// Loss of speed while moving in reverse \[m/s^2 or rad/s^2\], > 0.
    pub reverse_deceleration: R,
    /// Change of the acceleration \[m/s^3 or rad/s^3\], > 0.
    pub jerk: R,
}

impl<R: Real> AxisLimits<R> {
    /// No limit at all: every field infinite, `min_velocity` minus infinity.
    ///
    /// ```
    /// use omni_core::shaping::{AxisLimits, RateLimiter, RateLimiterState};
    /// let limiter = RateLimiter::new(AxisLimits::unlimited(), 1e-3)?;
    /// assert_eq!(limiter.step(&mut RateLimiterState::default(), -100.0), -100.0); // there in one period
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn unlimited() -> Self {
        let none = R::of(f64::INFINITY);
        Self::symmetric(none, none, none, none)
    }

    /// The same limits forward and in reverse; units and ranges as for the fields.
    ///
    /// ```
    /// use omni_core::shaping::AxisLimits;
    /// let limits = AxisLimits::symmetric(1.5, 2.0, 4.0, 50.0);
    /// assert_eq!((limits.min_velocity, limits.max_velocity), (-1.5, 1.5));
    /// assert_eq!((limits.reverse_acceleration, limits.reverse_deceleration), (2.0, 4.0));
    /// ```
    #[must_use]
    pub fn symmetric(velocity: R, acceleration: R, deceleration: R, jerk: R) -> Self {
        Self {
            min_velocity: -velocity,
            max_velocity: velocity,
            acceleration,
            deceleration,
            reverse_acceleration: acceleration,
            reverse_deceleration: deceleration,
            jerk,
        }
    }
}

/// Names of the parameters of an axis in errors, in the order of the fields of [`AxisLimits`].
pub(crate) type AxisNames = [&'static str; 7];

/// [`AxisNames`] with a prefix.
macro_rules! axis_names {
    ($prefix:literal) => {
        [
            concat!($prefix, "min_velocity"),
            concat!($prefix, "max_velocity"),
            concat!($prefix, "acceleration"),
            concat!($prefix, "deceleration"),
            concat!($prefix, "reverse_acceleration"),
            concat!($prefix, "reverse_deceleration"),
            concat!($prefix, "jerk"),
        ]
    };
}
pub(crate) use axis_names;

/// `value` if it is above zero; infinity means no limit.
pub(crate) fn limit<R: Real>(parameter: &'static str, value: R) -> Result<R, ConfigError> {
    if value > R::zero() {
        Ok(value)
    } else {
        Err(ConfigError::new(
            parameter,
            value.as_f64(),
            "> 0 (infinity: no limit)",
        ))
    }
}

/// `value` if it is zero or above; infinity means no limit.
pub(crate) fn speed_limit<R: Real>(parameter: &'static str, value: R) -> Result<R, ConfigError> {
    if value >= R::zero() {
        Ok(value)
    } else {
        Err(ConfigError::new(
            parameter,
            value.as_f64(),
            ">= 0 (infinity: no limit)",
        ))
    }
}

/// Velocity and acceleration of a limited axis; `default` is at rest.
///
/// ```
/// use omni_core::shaping::{AxisLimits, RateLimiter, RateLimiterState};
/// // One limiter serves any number of axes, each with a state of its own.
/// let limiter = RateLimiter::new(AxisLimits::symmetric(2.0, 1.0, 1.0, f64::INFINITY), 0.25)?;
/// let (mut one, mut other) = (RateLimiterState::default(), RateLimiterState::at(1.0));
/// assert_eq!([limiter.step(&mut one, 2.0), limiter.step(&mut other, 2.0)], [0.25, 1.25]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct RateLimiterState<R> {
    pub(crate) velocity: Sum<R>,
    /// The last velocity step that a jerk limit has to continue from.
    pub(crate) step: Sum<R>,
}

impl<R: Real> Default for RateLimiterState<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real> RateLimiterState<R> {
    /// At rest, also for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            velocity: Sum::of(R::ZERO),
            step: Sum::of(R::ZERO),
        }
    }

    /// Moving steadily at `velocity` \[m/s or rad/s\], which may be outside the limits: the limiter then brings it in.
    /// One that is not finite counts as rest.
    ///
    /// ```
    /// use omni_core::shaping::{AxisLimits, RateLimiter, RateLimiterState};
    /// let limiter = RateLimiter::new(AxisLimits::symmetric(1.0, 1.0, 2.0, f64::INFINITY), 0.25)?;
    /// let mut state = RateLimiterState::at(2.0); // twice as fast as allowed
    /// assert_eq!(limiter.step(&mut state, 2.0), 2.0 - 2.0 * 0.25); // brought in with the deceleration
    /// assert_eq!(RateLimiterState::at(f64::NAN).velocity(), 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn at(velocity: R) -> Self {
        let zero = R::zero();
        Self {
            velocity: Sum::of(if velocity.is_finite_real() { velocity } else { zero }),
            step: Sum::of(zero),
        }
    }

    /// The velocity \[m/s or rad/s\] that the last step returned.
    #[must_use]
    pub fn velocity(&self) -> R {
        self.velocity.total
    }

    /// Takes `step` as the last step and adds it; the distance to `target` was `distance`.
    pub(crate) fn advance(&mut self, step: Sum<R>, distance: R, target: R) {
        self.step = step;
        self.velocity = if step == Sum::of(distance) {
            Sum::of(target)
        } else {
            self.velocity.plus(step.rest).plus(step.total)
        };
    }
}

/// Velocity steps of a motion in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Steps<R> {
    /// Speed that a period adds to a motion in this direction.
    up: R,
    /// Speed that a period removes from a motion in the opposite direction.
    down: R,
}

constant_struct!(Steps<R> { up: R, down: R });

impl<R: Real> Steps<R> {
    /// Without jerk limit: the velocity after `velocity`, on the way up to `target`.
    #[inline]
    fn next(&self, velocity: R, target: R) -> R {
        let braked = velocity + self.down;
        let next = if velocity >= R::zero() {
            velocity + self.up
        } else if braked <= R::zero() {
            braked
        } else {
            // At rest after the part -velocity / down of the period; the remaining part accelerates.
            self.up * (R::one() + velocity / self.down)
        };
        // This way round NaN, which is 0 times no limit, counts as there.
        if next < target { next } else { target }
    }
}

/// The largest first step of a ramp whose steps fall by `jerk_step` each and of which those above `base` add up to no
/// more than `distance`; `base` if there is none.
///
/// With `base` = 0 it is the step from which the velocity can still stop exactly at `distance`: m steps s, s - j, ...
/// make `m s - j m (m - 1) / 2`, and m is the largest number with `m (m - 1) / 2 <= distance / j`. It is all of
/// `distance` where m = 1, so it never asks for more than that.
pub(crate) fn ramp_start<R: Real>(distance: R, base: R, jerk_step: R) -> R {
    let half = R::of(0.5);
    let b = base / jerk_step - half;
    let u = (distance + distance) / jerk_step;
    let root = (b * b + u).sqrt();
    // The positive root of m^2 + 2 b m = u, without a difference of large numbers.
    let count = if b > R::zero() { u / (b + root) } else { root - b }.floor();
    if count < R::one() {
        return base;
    }
    let highest = base + count * jerk_step;
    let start = if count > R::one() {
        distance / count + half * (count - R::one()) * jerk_step
    } else if distance > base {
        distance
    } else {
        base // without a jerk limit
    };
    // This way round NaN, from distances that overflow, counts as no bound.
    if start < highest { start } else { highest }
}

/// Rate limiter of one axis; see [`AxisLimits`]. The changing state is in [`RateLimiterState`].
///
/// With a jerk limit it looks ahead: it accelerates no more than it can reverse before the target, and brakes a
/// reversal no harder than it can ease before the velocity changes sign. A target that stays is reached exactly, and
/// overshot by rounding only (an ulp), except if the acceleration of an earlier target leaves no choice. The velocity
/// limits hold in any case. Without a jerk limit, no square root is computed; a period in which the velocity changes
/// sign is shared between deceleration and acceleration.
///
/// ```
/// use omni_core::shaping::{AxisLimits, RateLimiter, RateLimiterState};
/// let limits = AxisLimits { min_velocity: -0.5, ..AxisLimits::symmetric(1.0, 1.0, 4.0, f64::INFINITY) };
/// let limiter = RateLimiter::new(limits, 0.25)?;
/// let mut state = RateLimiterState::at(0.5);
/// assert_eq!(limiter.step(&mut state, 10.0), 0.75); // 1.0 for 0.25 s
/// assert_eq!(limiter.step(&mut state, 10.0), 1.0);
/// assert_eq!(limiter.step(&mut state, 10.0), 1.0); // the highest velocity
/// assert_eq!(limiter.step(&mut state, 0.5), 0.5); // 4.0 would allow all of it and more
///
/// let smooth = RateLimiter::new(AxisLimits { jerk: 4.0, ..AxisLimits::unlimited() }, 0.5)?;
/// let mut state = RateLimiterState::default();
/// let velocities = [0; 5].map(|_| smooth.step(&mut state, 9.0));
/// assert_eq!(velocities, [1.0, 3.0, 6.0, 8.0, 9.0]); // accelerations 2, 4, 6, 4, 2
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct RateLimiter<R> {
    min: R,
    max: R,
    forward: Steps<R>,
    backward: Steps<R>,
    jerk_step: R,
    /// Velocity limits only: every target is reached in one period.
    at_once: bool,
    /// The jerk is limited.
    smooth: bool,
}

constant_struct!(RateLimiter<R> { min: R, max: R, forward: Steps<R>, backward: Steps<R>, jerk_step: R, at_once: bool, smooth: bool });

impl<R: Real> RateLimiter<R> {
    /// A limiter that is stepped every `period_s` \[s\], 1e-6 to 10.
    ///
    /// # Errors
    /// The parameter that is out of range: `period_s`, `min_velocity` above 0, `max_velocity` below 0, any other limit
    /// not above 0, any NaN.
    pub fn new(limits: AxisLimits<R>, period_s: R) -> Result<Self, ConfigError> {
        Self::named(limits, period_s, &axis_names!(""))
    }

    pub(crate) fn named(limits: AxisLimits<R>, period_s: R, names: &AxisNames) -> Result<Self, ConfigError> {
        let dt = period(period_s)?;
        let [min, max, up, down, reverse_up, reverse_down, jerk] = *names;
        let changes = [
            limits.acceleration,
            limits.deceleration,
            limits.reverse_acceleration,
            limits.reverse_deceleration,
            limits.jerk,
        ];
        Ok(Self {
            at_once: changes.iter().all(|limit| !limit.is_finite_real()),
            smooth: limits.jerk.is_finite_real(),
            min: if limits.min_velocity <= R::zero() {
                limits.min_velocity
            } else {
                let value = limits.min_velocity.as_f64();
                return Err(ConfigError::new(min, value, "<= 0 (-infinity: no limit)"));
            },
            max: speed_limit(max, limits.max_velocity)?,
            forward: Steps {
                up: limit(up, limits.acceleration)? * dt,
                down: limit(reverse_down, limits.reverse_deceleration)? * dt,
            },
            backward: Steps {
                up: limit(reverse_up, limits.reverse_acceleration)? * dt,
                down: limit(down, limits.deceleration)? * dt,
            },
            jerk_step: limit(jerk, limits.jerk)? * dt * dt,
        })
    }

    /// One control period towards `target` \[m/s or rad/s\]: the velocity to command next, always finite.
    ///
    /// A target that is not finite holds the velocity. A limit whose share of one period is below the resolution of `R`
    /// at the present velocity (acceleration of 6e-5 at 1.0, 1 kHz and `f32`) leaves the velocity unchanged.
    ///
    /// ```
    /// use omni_core::shaping::{AxisLimits, RateLimiter, RateLimiterState};
    /// let limiter = RateLimiter::new(AxisLimits::symmetric(1.0, 1.0, 4.0, f64::INFINITY), 0.25)?;
    /// let mut state = RateLimiterState::at(0.5);
    /// // Braking with 4.0 it rests after half of the period; the other half accelerates backwards with 1.0.
    /// assert_eq!(limiter.step(&mut state, -1.0), -1.0 * 0.125);
    /// assert_eq!(limiter.step(&mut state, f64::NAN), -0.125); // no target: as before
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline(always)] // a handful of instructions, as long as the rest is not in here
    pub fn step(&self, state: &mut RateLimiterState<R>, target: R) -> R {
        if !self.at_once {
            return self.step_gradually(state, target);
        }
        if target.is_finite_real() {
            *state = RateLimiterState {
                velocity: Sum::of(target.limited(self.min, self.max)),
                step: Sum::of(R::ZERO),
            };
        }
        state.velocity.total
    }

    #[inline]
    fn step_gradually(&self, state: &mut RateLimiterState<R>, target: R) -> R {
        let velocity = state.velocity.total;
        let target = if target.is_finite_real() {
            target.limited(self.min, self.max)
        } else {
            velocity
        };
        if self.smooth {
            // As the last thing here, so that ramps without jerk limits need not save anything for this call.
            return self.step_smoothly_within(state, target);
        }
        if target > velocity {
            *state = RateLimiterState::at(self.forward.next(velocity, target));
        } else if target < velocity {
            *state = RateLimiterState::at(-self.backward.next(-velocity, -target));
        }
        state.velocity.total
    }

    #[inline(never)]
    fn step_smoothly_within(&self, state: &mut RateLimiterState<R>, target: R) -> R {
        let velocity = state.velocity.total;
        self.step_smoothly(state, target);
        // Rounding must not leave the range either: a range from 0 means never backwards.
        let next = state.velocity.total;
        if (next > self.max && velocity <= self.max) || (next < self.min && velocity >= self.min) {
            state.velocity = Sum::of(next.limited(self.min, self.max));
        }
        state.velocity.total
    }

    fn step_smoothly(&self, state: &mut RateLimiterState<R>, target: R) {
        let zero = R::zero();
        let distance = state.velocity.gap(target);
        // Mirrored so that the target is in the positive direction.
        let (sign, steps) = if distance < zero {
            (-R::one(), &self.backward)
        } else {
            (R::one(), &self.forward)
        };
        let (ahead, velocity) = (sign * distance, sign * state.velocity.total);
        let most = if velocity >= zero {
            steps.up
        } else if steps.up < steps.down && ahead > -velocity {
            // The motion turns round at rest: by then the harder braking must have eased to the acceleration limit.
            let start = ramp_start(-velocity, steps.up, self.jerk_step);
            if start < steps.down { start } else { steps.down }
        } else {
            steps.down
        };
        let stop = ramp_start(ahead, zero, self.jerk_step);
        let wanted = sign * if stop < most { stop } else { most };
        let change = state.step.gap(wanted);
        let step = if change > self.jerk_step {
            state.step.plus(self.jerk_step)
        } else if change < -self.jerk_step {
            state.step.plus(-self.jerk_step)
        } else {
            Sum::of(wanted)
        };
        state.advance(step, distance, target);
    }
}

#[cfg(test)]
pub(crate) mod tests;
