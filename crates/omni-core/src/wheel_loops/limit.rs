//! What happens to the loops at a limit: torques brought within, integrals kept from winding up.

use super::{ControlState, WheelController, WheelSample};
use crate::coordination::{Saturation, reference_factors, torque_factor};
use crate::{AntiWindup, Real};

/// Periods in a row that a wheel is beyond the same limit before the integrals are told of it.
///
/// One encoder count, or noise, can ask for more than a motor has in a single reading. Told of each such reading, an integral
/// would drop what it says and keep the rest: a bias, and the vehicle runs away or creeps. Noise is beyond the same limit 8
/// times in a row in one period of 2^8.
const OVERLOAD_PERIODS: i8 = 8;

impl<R: Real, const N: usize> WheelController<R, N> {
    /// Brings the requested torques of `out` within the limits by the law of the coordination. What anti-windup adds to the
    /// integrals goes to `correction`, which is zero, and the derivative and reference to remember go to `state`. True where
    /// there is a correction. Integrals are told of limits that have lasted for [`OVERLOAD_PERIODS`] only.
    #[inline(never)]
    pub(super) fn limit(
        &self,
        state: &mut ControlState<R, N>,
        taken_in: &mut [R; N],
        out: &mut WheelSample<R, N>,
        correction: &mut [R; N],
    ) -> bool {
        let mut realised = out.reference.rad_s;
        let mut overloaded = [false; N];
        count_overload(&mut state.overload_periods, &mut overloaded, out);
        // Torque asked for by the terms as they are in the end: what anti-windup compares with.
        let mut asked = out.requested.n_m;
        match self.coordination.saturation {
            Saturation::Clip => {}
            Saturation::ScaleTorques => {
                out.common_factor = torque_factor(&out.requested.n_m, &out.range);
                for torque in &mut out.applied.n_m {
                    *torque *= out.common_factor;
                }
            }
            Saturation::ScaleReference { floor } => {
                // Every term is affine in the reference; what is compared with moves along in a wheel's first step.
                let fresh = self.pid.remembers() && state.started.contains(&false);
                let later = self.pid.term_slopes(true);
                let slope = |i: usize| {
                    if fresh {
                        self.pid.term_slopes(state.started[i])
                    } else {
                        later
                    }
                };
                let mut slopes = realised;
                for i in 0..N {
                    slopes[i] *= slope(i).sum();
                }
                let (factor, lasting) =
                    reference_factors(&out.requested.n_m, &slopes, &out.range, floor, &overloaded);
                out.common_factor = factor;
                let less = R::one() - factor;
                let less_for_long = R::one() - lasting;
                for i in 0..N {
                    let removed = less * realised[i];
                    taken_in[i] -= less_for_long * realised[i];
                    realised[i] -= removed;
                    asked[i] -= less * slopes[i];
                    out.p_n_m[i] -= slope(i).p_n_m * removed;
                    out.i_n_m[i] -= slope(i).i_n_m * removed;
                }
                if self.pid.remembers() {
                    for i in 0..N {
                        let removed = less * out.reference.rad_s[i];
                        out.d_n_m[i] -= slope(i).d_n_m * removed;
                        out.ff_n_m[i] -= slope(i).ff_n_m * removed;
                    }
                }
                out.applied.n_m = asked;
            }
        }
        if self.pid.remembers() {
            (state.derivative_n_m, state.last_reference_rad_s) = (out.d_n_m, realised);
        }
        let mut excess = [R::zero(); N];
        let mut changed = false;
        for i in 0..N {
            let applied = out.range.clip(i, out.applied.n_m[i]);
            out.applied.n_m[i] = applied;
            if overloaded[i] {
                excess[i] = applied - asked[i];
            }
        }
        for e in excess {
            changed |= e != R::zero();
        }
        if changed {
            self.condition(state, taken_in, &excess, &out.active, correction);
        }
        changed
    }

    /// Anti-windup for torques that were changed by `excess`: what to add to the integrals, with the derivative and reference
    /// of `state` brought to what was realised.
    #[inline(never)]
    fn condition(
        &self,
        state: &mut ControlState<R, N>,
        taken_in: &[R; N],
        excess: &[R; N],
        active: &[bool; N],
        correction: &mut [R; N],
    ) {
        // A conditioned controller to the end: what the floor leaves over is conditioned too, wheel by wheel.
        let law = match self.coordination.saturation {
            Saturation::ScaleReference { .. } => AntiWindup::Conditioned,
            _ => self.pid.anti_windup(),
        };
        if law == AntiWindup::Conditional && self.shares_integral() {
            // Shared, the motion as a whole goes on integrating or does not: stopped wheel by wheel and projected, most of
            // what was stopped would come back.
            let mut outwards = R::zero();
            for i in 0..N {
                outwards += excess[i] * taken_in[i];
            }
            if outwards < R::zero() {
                *correction = taken_in.map(|taken_in| -self.pid.integral_gain_dt() * taken_in);
            }
            return;
        }
        for i in 0..N {
            if active[i] {
                let started = state.started[i];
                correction[i] = self.pid.correction(law, taken_in[i], excess[i], started);
                if self.pid.remembers() {
                    let shift = self.pid.shift(law, excess[i], started);
                    state.derivative_n_m[i] += self.pid.derivative_slope(started) * shift;
                    state.last_reference_rad_s[i] += shift;
                }
            }
        }
    }

    /// Integrals held where [`AntiWindup::Clamp`] says so; shared ones by one factor for all, because cut one by one they
    /// would leave the range of the kinematics.
    #[inline]
    pub(super) fn hold_integrals(&self, state: &mut ControlState<R, N>) {
        let AntiWindup::Clamp { limit_n_m } = self.pid.anti_windup() else {
            return;
        };
        if !self.shares_integral() {
            state.integral_n_m = state.integral_n_m.map(|i| self.pid.held(i));
            return;
        }
        let mut fullest = limit_n_m;
        for integral in state.integral_n_m {
            fullest = if integral.abs() > fullest {
                integral.abs()
            } else {
                fullest
            };
        }
        if fullest > limit_n_m {
            state.integral_n_m = state.integral_n_m.map(|i| i * (limit_n_m / fullest));
        }
    }
}

/// Counts for how many periods in a row each wheel has asked for more than its upper limit (positive) or its lower one
/// (negative), and says which have for [`OVERLOAD_PERIODS`].
#[inline]
fn count_overload<R: Real, const N: usize>(
    overload: &mut [i8; N],
    overloaded: &mut [bool; N],
    out: &WheelSample<R, N>,
) {
    for i in 0..N {
        let before = overload[i];
        let now = if !out.saturated[i] {
            0
        } else if out.requested.n_m[i] > R::zero() {
            (before.max(0) + 1).min(OVERLOAD_PERIODS)
        } else {
            (before.min(0) - 1).max(-OVERLOAD_PERIODS)
        };
        overload[i] = now;
        overloaded[i] = now.abs() == OVERLOAD_PERIODS;
    }
}

/// Loops whose torque is not a number, because their state was set to nonsense, give nothing and start afresh.
#[inline(never)]
pub(super) fn start_afresh_where_not_finite<R: Real, const N: usize>(
    state: &mut ControlState<R, N>,
    taken_in: &mut [R; N],
    out: &mut WheelSample<R, N>,
) {
    let zero = R::zero();
    for i in 0..N {
        if !out.requested.n_m[i].is_finite_real() {
            (state.integral_n_m[i], state.derivative_n_m[i], state.started[i]) = (zero, zero, false);
            (out.p_n_m[i], out.i_n_m[i], out.d_n_m[i], out.ff_n_m[i]) = (zero, zero, zero, zero);
            (out.requested.n_m[i], out.applied.n_m[i], taken_in[i]) = (zero, zero, zero);
            (out.reference.rad_s[i], out.active[i]) = (zero, false);
        }
    }
}
