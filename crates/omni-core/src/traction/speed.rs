//! Second step: one speed of the whole vehicle along its direction of travel.

use super::model::{BRAKING_PART, Traction};
use super::state::TractionState;
use crate::Real;
use crate::scalar::{follow, max, min};

/// The vehicle's speed by the wheels.
pub(super) struct MeasuredSpeed<R> {
    /// The speed \[m/s\], along the target.
    speed_m_s: R,
    /// The wheel that it hangs on.
    pub(super) wheel: usize,
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// Steps the speed by the rolling speeds of the driven wheels, and returns the wheel that determines it; none if
    /// none is usable, or if slip cannot be distinguished from noise.
    ///
    /// No driving wheel is slower than the ground beneath it, so that the slowest wheel determines the speed, and all
    /// wheels that agree with it are averaged: what is no slip has the mean of all wheels. Each wheel is filtered
    /// before any is chosen, or the least of many noisy numbers would be noise. One wheel alone can indicate
    /// standstill; backward motion requires two. If all wheels brake, the fastest wheel determines the speed.
    pub(super) fn measure_speed(
        &self,
        state: &mut TractionState<R, N>,
        rolling_rad_s: &[R; N],
        yaw_rad_s: R,
    ) -> Option<usize> {
        let part = self.config.part(self.times.speed_s);
        for i in 0..N {
            let (travel, wheel) = (&state.travel[i], &mut state.wheels[i]);
            // Both as they are read, and then one filter: a yaw rate that came later would be slip
            // of all wheels in every turn.
            let now = (rolling_rad_s[i] - self.turned_by(i) * yaw_rad_s) * travel.way_m;
            follow(&mut wheel.speed_m_s, now, part);
        }
        if !state.can_discern() {
            // Noise that masks slip also masks the slowest wheel: then all wheels are used.
            let [dx, dy] = state.direction;
            let [ahead, left, _] = self.kinematics.forward_matrix();
            let along: [R; N] = core::array::from_fn(|i| ahead[i] * dx + left[i] * dy);
            let speed = self.by_wheels(state, rolling_rad_s, &along);
            follow(&mut state.speed_m_s, speed, part);
            return None;
        }
        let sign = state.target_sign();
        let measured = self
            .slowest_pushing(state, sign)
            .or_else(|| self.fastest_braking(state, sign))?;
        let speed = sign * state.speed_m_s;
        // It falls at once, because an impact is over in a moment, and rises no faster than the vehicle can.
        let most = self.config.acceleration_m_s2 * self.config.period_s;
        state.speed_m_s = sign * (speed + min(measured.speed_m_s - speed, most));
        Some(measured.wheel)
    }

    fn slowest_pushing(&self, state: &TractionState<R, N>, sign: R) -> Option<MeasuredSpeed<R>> {
        let (mut first, mut second) = (None::<(R, usize)>, None::<R>);
        for i in 0..N {
            if !self.pushes(state, i, sign) {
                continue;
            }
            let speed = sign * state.wheels[i].speed_m_s;
            match first {
                Some((slowest, _)) if speed >= slowest => {
                    second = Some(second.map_or(speed, |second| min(second, speed)));
                }
                _ => {
                    second = first.map(|(slowest, _)| slowest);
                    first = Some((speed, i));
                }
            }
        }
        let (mut slowest, wheel) = first?;
        if let Some(second) = second
            && slowest < R::zero()
        {
            slowest = min(second, R::zero());
        }
        Some(self.agreed(state, sign, slowest, wheel))
    }

    fn fastest_braking(&self, state: &TractionState<R, N>, sign: R) -> Option<MeasuredSpeed<R>> {
        let mut fastest = None::<(R, usize)>;
        for i in 0..N {
            if !(state.travel[i].driven && state.wheels[i].usable) {
                continue;
            }
            // Of a wheel that rises or falls the part over the ground: its way is the longer one.
            let (speed, rise) = (sign * state.wheels[i].speed_m_s, state.motion.rise_m_s[i]);
            let level = max(speed * speed - rise * rise, R::zero()).sqrt();
            let speed = if speed > R::zero() { level } else { speed };
            if fastest.is_none_or(|(fastest, _)| speed > fastest) {
                fastest = Some((speed, i));
            }
        }
        let (speed_m_s, wheel) = fastest?;
        Some(MeasuredSpeed { speed_m_s, wheel })
    }

    /// The mean of the wheels that are no faster than the slowest by what is no slip; by twice that
    /// a wheel is excluded.
    #[inline(always)]
    fn agreed(&self, state: &TractionState<R, N>, sign: R, slowest: R, wheel: usize) -> MeasuredSpeed<R> {
        let (zero, one) = (R::zero(), R::one());
        let (mut weights, mut sum) = (zero, zero);
        for i in 0..N {
            let beyond = sign * state.wheels[i].speed_m_s - slowest;
            let weight = (R::of(2.0) - beyond * self.times.per_free_s_m).limited(zero, one);
            if beyond >= zero && self.pushes(state, i, sign) {
                weights += weight;
                sum += weight * beyond;
            }
        }
        let more = if weights > zero { sum / weights } else { zero };
        MeasuredSpeed {
            speed_m_s: slowest + more,
            wheel,
        }
    }

    /// A driven wheel that is usable and does not brake.
    #[inline(always)]
    pub(super) fn pushes(&self, state: &TractionState<R, N>, i: usize, sign: R) -> bool {
        let (travel, wheel) = (&state.travel[i], &state.wheels[i]);
        let braking = -R::of(BRAKING_PART) * wheel.most_n_m;
        travel.driven && wheel.usable && sign * travel.along * wheel.applied_n_m >= braking
    }
}
