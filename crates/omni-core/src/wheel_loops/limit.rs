//! What happens to the loops at a limit: torques brought within, integrals kept from winding up.

use super::{ControlState, WheelController, WheelSample};
use crate::coordination::{Saturation, reference_factor, reference_factors, torque_factor};
use crate::pid::Excess;
use crate::{AntiWindup, Real};

/// Which wheels a limit concerns, wheel i is bit i.
#[derive(Clone, Copy)]
pub(super) struct AtLimit {
    /// They ask for more than they can have.
    pub(super) beyond: u32,
    /// Their integral does not count.
    pub(super) outside_zone: u32,
}

impl<R: Real, const N: usize> WheelController<R, N> {
    /// Brings the requested torques of `out` within the limits by the law of the coordination. What anti-windup adds to the
    /// integrals goes to `correction`, which is zero, and the derivative and reference to remember go to `state`. True where
    /// there is a correction. `BOUNDED`: some terms of the loops have bounds. Integrals know of limits that last only ([`Overload`](super::Overload)).
    #[inline(never)]
    pub(super) fn limit<const BOUNDED: bool>(
        &self,
        state: &mut ControlState<R, N>,
        AtLimit { beyond, outside_zone }: AtLimit,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
        correction: &mut [R; N],
    ) -> bool {
        let overloaded = state.overload.step(beyond, &out.requested.n_m);
        // Torque asked for by the terms as they are in the end: what anti-windup compares with.
        let mut asked = out.requested.n_m;
        // Only where terms are bounded: what they were otherwise.
        let mut unbounded_p = BOUNDED.then(|| self.unbounded(out));
        match self.coordination.saturation {
            Saturation::Clip => {}
            Saturation::ScaleTorques => {
                out.common_factor = torque_factor(&out.requested.n_m, &out.range);
                for torque in &mut out.applied.n_m {
                    *torque *= out.common_factor;
                }
            }
            Saturation::ScaleReferences { floor } => {
                // Every term is affine in the reference; what is compared with moves along in a wheel's first step.
                let fresh = self.pid.remembers() && !state.all_started();
                let later = self.pid.term_slopes(true);
                let mut slopes = out.reference.rad_s;
                for i in 0..N {
                    slopes[i] *= later.sum();
                }
                if fresh {
                    for i in 0..N {
                        slopes[i] = out.reference.rad_s[i] * self.pid.term_slopes(state.started[i]).sum();
                    }
                }
                let about_limits;
                let requested = if let Some(unbounded_p) = &unbounded_p {
                    about_limits = self.about_limits(state, out, unbounded_p, outside_zone, &mut slopes);
                    &about_limits
                } else {
                    &out.requested.n_m
                };
                // Only wheels beyond a limit count for the factor.
                let (factor, lasting) = if overloaded == beyond {
                    let factor = reference_factor(requested, &slopes, &out.range, floor);
                    (factor, factor)
                } else {
                    reference_factors(requested, &slopes, &out.range, floor, overloaded)
                };
                out.common_factor = factor;
                let (less, less_for_long) = (R::one() - factor, R::one() - lasting);
                for i in 0..N {
                    let removed = less * out.reference.rad_s[i];
                    integrated_error[i] -= less_for_long * out.reference.rad_s[i];
                    asked[i] -= less * slopes[i];
                    // Neither of them differs in a first step.
                    out.p_n_m[i] -= later.p_n_m * removed;
                    out.i_n_m[i] -= later.i_n_m * removed;
                }
                if fresh {
                    for i in 0..N {
                        let slope = self.pid.term_slopes(state.started[i]);
                        let removed = less * out.reference.rad_s[i];
                        out.d_n_m[i] -= slope.d_n_m * removed;
                        out.ff_n_m[i] -= slope.ff_n_m * removed;
                        state.last_reference_rad_s[i] = out.reference.rad_s[i] - removed;
                    }
                } else if self.pid.remembers() {
                    for i in 0..N {
                        let removed = less * out.reference.rad_s[i];
                        out.d_n_m[i] -= later.d_n_m * removed;
                        state.last_reference_rad_s[i] = out.reference.rad_s[i] - removed;
                    }
                    if self.pid.feeds_forward() {
                        for i in 0..N {
                            out.ff_n_m[i] -= later.ff_n_m * (less * out.reference.rad_s[i]);
                        }
                    }
                }
                if let Some(unbounded_p) = &mut unbounded_p {
                    self.bound_reduced(less, out, unbounded_p, outside_zone, &mut asked);
                }
                out.applied.n_m = asked;
            }
        }
        if self.pid.remembers() {
            state.derivative_n_m = out.d_n_m;
            if !matches!(self.coordination.saturation, Saturation::ScaleReferences { .. }) {
                state.last_reference_rad_s = out.reference.rad_s;
            }
        }
        // To look whether anything changed pays only where an excess costs more than a product.
        let mut changed = !self.pid.remembers();
        for i in 0..N {
            let applied = out.range.clip(i, out.applied.n_m[i]);
            out.applied.n_m[i] = applied;
            changed |= applied != asked[i];
        }
        if overloaded == 0 || !changed {
            return false;
        }
        // A conditioned controller to the end: what the floor leaves over is conditioned too, wheel by wheel.
        let law = match self.coordination.saturation {
            Saturation::ScaleReferences { .. } => AntiWindup::Conditioned,
            _ => self.pid.anti_windup(),
        };
        let plain_gain = self.pid.plain_gain(law);
        let gain = plain_gain.unwrap_or(R::one());
        for i in 0..N {
            correction[i] = (out.applied.n_m[i] - asked[i]) * gain;
        }
        if overloaded != beyond {
            zero_not_overloaded(correction, overloaded);
        }
        if plain_gain.is_none() {
            self.condition(
                law,
                state,
                integrated_error,
                out,
                unbounded_p.as_ref(),
                correction,
            );
        }
        true
    }

    /// Anti-windup for torques that were changed by `correction`: put in its place what to add to the integrals, with the
    /// derivative and reference of `state` brought to what was realised.
    #[inline(never)]
    fn condition(
        &self,
        law: AntiWindup<R>,
        state: &mut ControlState<R, N>,
        integrated_error: &[R; N],
        out: &WheelSample<R, N>,
        unbounded_p: Option<&[R; N]>,
        correction: &mut [R; N],
    ) {
        let excess = *correction;
        *correction = [R::zero(); N];
        if law == AntiWindup::Conditional && self.shares_integral() {
            // Shared, the motion as a whole goes on integrating or does not: stopped wheel by wheel and projected, most of
            // what was stopped would come back.
            let mut outwards = R::zero();
            for i in 0..N {
                outwards += excess[i] * integrated_error[i];
            }
            if outwards < R::zero() {
                *correction =
                    integrated_error.map(|integrated_error| -self.pid.integral_gain_dt() * integrated_error);
            }
            return;
        }
        for i in 0..N {
            if out.active[i] {
                let started = state.started[i];
                let excess = Excess {
                    excess_n_m: excess[i],
                    p_n_m: out.p_n_m[i],
                    unbounded_p_n_m: unbounded_p.map_or(out.p_n_m[i], |p_n_m| p_n_m[i]),
                };
                let (correct, shift) = self.pid.correction(law, integrated_error[i], &excess, started);
                correction[i] = correct;
                if self.pid.remembers() {
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

/// Zero where a wheel is not overloaded.
fn zero_not_overloaded<R: Real, const N: usize>(values: &mut [R; N], overloaded: u32) {
    for (i, value) in values.iter_mut().enumerate() {
        if overloaded & (1 << i) == 0 {
            *value = R::zero();
        }
    }
}

/// Loops whose torque is not a number, because their state was set to nonsense, give nothing and start afresh.
#[inline(never)]
pub(super) fn start_afresh_where_not_finite<R: Real, const N: usize>(
    state: &mut ControlState<R, N>,
    integrated_error: &mut [R; N],
    out: &mut WheelSample<R, N>,
) {
    let zero = R::zero();
    for i in 0..N {
        if !out.requested.n_m[i].is_finite_real() {
            (state.integral_n_m[i], state.derivative_n_m[i], state.started[i]) = (zero, zero, false);
            (out.p_n_m[i], out.i_n_m[i], out.d_n_m[i], out.ff_n_m[i]) = (zero, zero, zero, zero);
            (out.requested.n_m[i], out.applied.n_m[i], integrated_error[i]) = (zero, zero, zero);
            (out.reference.rad_s[i], out.active[i]) = (zero, false);
        }
    }
}
