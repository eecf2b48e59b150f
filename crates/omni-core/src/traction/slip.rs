//! Fourth step: the torque of each wheel, and what of it would only spin the wheel.

use super::heading::Turn;
use super::loops::TractionLoops;
use super::model::{BACK_PART, Traction};
use super::sample::TractionSample;
use super::state::TractionState;
use super::target::TractionTarget;
use crate::Real;
use crate::scalar::{follow, max, min};

/// A wheel whose torque goes from one limit to the other within so many slip times oscillates: its gain is reduced.
const SWINGS: f64 = 8.0;
const SOFTER: f64 = 0.7;
const SOFTEST: f64 = 0.1;
/// The time in which it recovers \[s\].
const RECOVERS_S: f64 = 1.0;
/// A measured speed has a direction above this \[m/s\].
const SURE_M_S: f64 = 5e-3;

/// Common demand of the motion on the wheels in a period.
pub(super) struct Asked<'a, R, const N: usize> {
    pub(super) rates_rad_s: &'a [R; N],
    pub(super) rolling_rad_s: &'a [R; N],
    pub(super) target: &'a TractionTarget<R, N>,
    pub(super) turn: Turn<R>,
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// The torque of every wheel into `sample`, and its part of the state.
    pub(super) fn find_torques(
        &self,
        state: &mut TractionState<R, N>,
        asked: &Asked<'_, R, N>,
        sample: &mut TractionSample<R, N>,
    ) {
        let traction = state.loops == TractionLoops::Traction;
        for i in 0..N {
            if !state.wheels[i].usable {
                sample.released(i);
                continue;
            }
            sample.wheels.active[i] = true;
            let rate = asked.rates_rad_s[i];
            let torque = if traction && state.travel[i].driven {
                let torque = self.driven(state, asked, i, sample);
                state.wheels[i].integral_n_m = R::zero();
                torque
            } else {
                // A vehicle whose speed is not trusted follows its command, whatever is tried.
                let along_m_s = match state.loops {
                    TractionLoops::Traction => Some(state.speed_m_s),
                    TractionLoops::Plain if asked.target.trying => Some(state.target_m_s),
                    _ => None,
                };
                let reference = along_m_s.map_or(state.reference_rad_s[i], |along_m_s| {
                    state.travel[i].rate_rad_m * along_m_s + self.turned_by(i) * asked.turn.reference_rad_s
                });
                self.own_loop(state, i, reference - rate, sample)
            };
            let (lower, upper) = (sample.wheels.range.lower_n_m[i], sample.wheels.range.upper_n_m[i]);
            let applied = torque.limited(lower, upper);
            sample.wheels.requested.n_m[i] = torque;
            sample.wheels.applied.n_m[i] = applied;
            sample.wheels.saturated[i] = applied != torque;
            let wheel = &mut state.wheels[i];
            if wheel.check_swing(
                torque,
                applied,
                self.config.period_s,
                R::of(SWINGS) * self.times.slip_s,
            ) {
                state.slip_gain_part = max(R::of(SOFTER) * state.slip_gain_part, R::of(SOFTEST));
            }
            (wheel.applied_n_m, wheel.measured_rad_s) = (applied, rate);
        }
        follow(
            &mut state.slip_gain_part,
            R::one(),
            self.config.part(R::of(RECOVERS_S)),
        );
    }

    /// A wheel's own velocity loop \[N.m\].
    #[inline(always)]
    fn own_loop(
        &self,
        state: &mut TractionState<R, N>,
        i: usize,
        error: R,
        sample: &mut TractionSample<R, N>,
    ) -> R {
        let [gain, integral] = self.times.own(&self.config, state.raw);
        let wheel = &mut state.wheels[i];
        let (p, held) = (gain * error, wheel.integral_n_m);
        let torque = p + held;
        // Held at the motor's limit and not before: an integral that minds what the torque does
        // rectifies noise that reaches a limit.
        let most = wheel.most_n_m;
        wheel.integral_n_m = (held + integral * error * self.config.period_s).limited(-most, most);
        (
            sample.wheels.p_n_m[i],
            sample.wheels.i_n_m[i],
            sample.wheels.d_n_m[i],
        ) = (p, held, R::zero());
        (sample.slip_rad_s[i], sample.contact_n_m[i]) = (R::zero(), R::zero());
        torque
    }

    /// A driven wheel: the common thrust, less what would spin it, and what heading and level ask for \[N.m\].
    #[inline(always)]
    fn driven(
        &self,
        state: &mut TractionState<R, N>,
        asked: &Asked<'_, R, N>,
        i: usize,
        sample: &mut TractionSample<R, N>,
    ) -> R {
        let (config, times, zero) = (&self.config, &self.times, R::zero());
        let (travel, speed, rise_m_s) = (&state.travel[i], state.speed_m_s, state.motion.rise_m_s[i]);
        let most = state.wheels[i].most_n_m;
        let thrust = (state.thrust_n_m * travel.part).limited(-most, most);
        // Torque to the ground: the motor's torque minus the part that accelerates the wheel.
        let wheel = &mut state.wheels[i];
        let change = (asked.rates_rad_s[i] - wheel.measured_rad_s) / config.period_s;
        let taken = wheel.applied_n_m - self.inertia_kg_m2[i] * change;
        follow(&mut wheel.contact_n_m, taken, config.part(times.contact_s));
        let contact = wheel.contact_n_m;
        // Everything along the thrust from here.
        let ahead = if state.thrust_n_m >= zero {
            R::one()
        } else {
            -R::one()
        };
        let gain = travel.slip_gain * state.slip_gain_part;
        let rolls = if speed.abs() > R::of(SURE_M_S) {
            speed.signum()
        } else {
            state.target_sign()
        };
        let rim = (asked.rolling_rad_s[i] - self.turned_by(i) * asked.turn.reference_rad_s) * travel.way_m;
        let slip = rim - self.rolled_m_s(speed, rolls, rise_m_s, travel.cosine_squared);
        let climbs = asked.target.climbing[i];
        let free = if climbs {
            times.free_m_s + asked.target.allowance_m_s
        } else {
            times.free_m_s
        };
        let lack = ahead * (state.target_m_s - speed);
        let back = ahead * (R::of(BACK_PART) * state.target_m_s - speed);
        let sized = travel.along * ahead; // of a torque along the thrust
        let mut own = sized
            * self.slip_torque(
                sized * thrust,
                sized * contact,
                ahead * slip,
                free,
                [back, lack],
                gain.abs(),
            );
        if climbs && asked.target.spin_m_s > zero {
            let spun = asked.target.spin_gain
                * self.times.thrust_gain_n_m_s_rad
                * travel.rate_rad_m.abs()
                * (asked.target.spin_m_s - slip);
            own = travel.along * max(min(spun, state.largest_motor_n_m), travel.along * own);
        }
        own += self.turned_by(i) * asked.turn.thrust_n_m + travel.side_rate_rad_m * asked.turn.side_n_m2_rad
            - travel.lever * self.tilt(state, &asked.turn, i);
        if asked.turn.levels {
            // However much torque is removed from a driving wheel, it is not turned backwards.
            let floor = -gain.abs() * max(ahead * rim, zero);
            own = sized * max(sized * own, floor);
        }
        (
            sample.wheels.p_n_m[i],
            sample.wheels.i_n_m[i],
            sample.wheels.d_n_m[i],
        ) = (thrust, zero, own - thrust);
        (sample.slip_rad_s[i], sample.contact_n_m[i]) = (travel.rate_rad_m.abs() * slip, contact);
        own
    }

    /// The torque of a wheel that slips, everything along the thrust \[N.m\].
    ///
    /// Beyond the free slip, a faster wheel applies only the torque that the ground transmits, and is slowed down only
    /// as far as it is faster than both the vehicle (by `back`) and half of its target, so that a wrong speed can
    /// reduce thrust, but never turns a wheel backwards. A slower wheel is driven only as far as it is slower than both
    /// the vehicle and its target.
    #[inline(always)]
    fn slip_torque(&self, thrust: R, contact: R, slip: R, free: R, [back, lack]: [R; 2], gain: R) -> R {
        let (zero, one) = (R::zero(), R::one());
        let faster = slip - free;
        if faster > zero {
            let a = min(faster / self.times.width_m_s, one);
            let gripped = (one - a) * thrust + a * contact.limited(-thrust.abs(), thrust.abs());
            return max(
                gripped - gain * faster,
                -gain * max(faster - max(back, zero), zero),
            );
        }
        let slower = -slip - free - max(-lack, zero);
        thrust + gain * max(slower, zero)
    }
}

impl<R: Real> super::state::WheelState<R> {
    /// Has its torque come from the one limit to the other within `window_s`? Notes when it is limited.
    fn check_swing(&mut self, torque: R, applied: R, period_s: R, window_s: R) -> bool {
        if self.limited_s != R::zero() {
            self.limited_s += self.limited_s.signum() * period_s;
        }
        if applied == torque {
            return false;
        }
        let sign = (torque - applied).signum();
        let other = sign * self.limited_s < R::zero() && self.limited_s.abs() < window_s;
        self.limited_s = sign * period_s;
        other
    }
}
