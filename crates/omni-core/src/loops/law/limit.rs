//! Treatment of the loops at a limit: torques are brought within it, and integrals do not wind up.

use super::{AtLimit, Law, zero};
use crate::Real;
use crate::loops::coordination::{Saturation, reference_factor, reference_factors, torque_factor};
use crate::loops::pid::{AntiWindup, Excess};
use crate::loops::wheel_loops::{ControlState, WheelSample};
use crate::motor::TorqueRanges;

impl<R: Real> Law<'_, R> {
    /// Brings the requested torques of `out` within the limits by the law of the coordination, and
    /// the derivative and reference of this period to `state`. `correction`, which is 0, becomes what
    /// anti-windup adds to the integrals; true if it adds something.
    #[inline(never)]
    pub(super) fn limit<const N: usize>(
        self,
        at: AtLimit,
        outside_zone: u32,
        state: &mut ControlState<R, N>,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
        correction: &mut [R; N],
    ) -> bool {
        // Torque that the final terms request, with which anti-windup compares.
        let mut asked = out.requested.n_m;
        if let Saturation::ScaleReferences { floor } = self.coordination.saturation {
            if self.pid.bounds().any {
                self.scale_references_bounded(floor, at, outside_zone, state, integrated_error, out);
            } else {
                self.scale_references(floor, at, state, integrated_error, out);
            }
            asked = out.applied.n_m;
        } else {
            self.store_last(state, out);
            if self.coordination.saturation == Saturation::ScaleTorques {
                scale_torques(out);
            }
        }
        // To look whether anything changed pays only if an excess costs more than a product.
        let mut changed = !self.pid.uses_last();
        for i in 0..N {
            let applied = out.range.clip(i, out.applied.n_m[i]);
            out.applied.n_m[i] = applied;
            changed |= applied != asked[i];
        }
        let corrects = at.overloaded != 0 && changed;
        if corrects {
            self.correct(at, &asked, state, integrated_error, out, correction);
            zero(correction, outside_zone);
        }
        corrects
    }

    /// Scales all references by one factor with which no torque is beyond the limit that its own
    /// reference pushes it towards, and every term with them, which is affine in the reference.
    /// Applied are the torques that are then asked for.
    #[inline(always)]
    fn scale_references<const N: usize>(
        self,
        floor: R,
        at: AtLimit,
        state: &mut ControlState<R, N>,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
    ) {
        let all_started = state.all_started();
        let slopes = self.slopes(all_started, state, out);
        let factors = common_factors(&out.requested.n_m, &slopes, &out.range, floor, at);
        self.reduce_references(factors, &slopes, all_started, state, integrated_error, out);
    }

    /// [`Law::scale_references`] where terms have bounds, so that they are affine in pieces only.
    #[inline(never)]
    fn scale_references_bounded<const N: usize>(
        self,
        floor: R,
        at: AtLimit,
        outside_zone: u32,
        state: &mut ControlState<R, N>,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
    ) {
        let all_started = state.all_started();
        let (torques, slopes) = self.linearised_at_limits(state, out, outside_zone);
        let factors = common_factors(&torques, &slopes, &out.range, floor, at);
        self.reduce_references(factors, &slopes, all_started, state, integrated_error, out);
        zero(integrated_error, outside_zone);
        self.bound_reduced(out, outside_zone);
    }

    /// Reduces references to the common factor for this step, integrated errors to that which
    /// lasts, and the terms with them.
    #[inline(always)]
    fn reduce_references<const N: usize>(
        self,
        (factor, lasting): (R, R),
        slopes: &[R; N],
        all_started: bool,
        state: &mut ControlState<R, N>,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
    ) {
        out.common_factor = factor;
        let (less, less_for_long) = (R::one() - factor, R::one() - lasting);
        for i in 0..N {
            integrated_error[i] -= less_for_long * out.reference.rad_s[i];
            out.applied.n_m[i] = out.requested.n_m[i] - less * slopes[i];
        }
        self.reduce_terms(less, all_started, state, out);
    }

    /// How the torque of each wheel changes with the factor of its reference. What is compared with
    /// moves along in a first step.
    #[inline(always)]
    fn slopes<const N: usize>(
        self,
        all_started: bool,
        state: &ControlState<R, N>,
        out: &WheelSample<R, N>,
    ) -> [R; N] {
        let later = self.pid.term_slopes(true).sum();
        let mut slopes = out.reference.rad_s;
        for slope in &mut slopes {
            *slope *= later;
        }
        if self.pid.uses_last() && !all_started {
            for i in 0..N {
                slopes[i] = out.reference.rad_s[i] * self.pid.term_slopes(state.started[i]).sum();
            }
        }
        slopes
    }

    /// The terms with references that are reduced by the part `less`, and what the next period needs of them.
    #[inline(always)]
    fn reduce_terms<const N: usize>(
        self,
        less: R,
        all_started: bool,
        state: &mut ControlState<R, N>,
        out: &mut WheelSample<R, N>,
    ) {
        let later = self.pid.term_slopes(true);
        for i in 0..N {
            let removed = less * out.reference.rad_s[i];
            // Neither of them differs in a first step.
            out.p_n_m[i] -= later.p_n_m * removed;
            out.i_n_m[i] -= later.i_n_m * removed;
        }
        if !self.pid.uses_last() {
            return;
        }
        // The usual case apart, because its slopes are the same for all wheels.
        if all_started {
            for i in 0..N {
                let removed = less * out.reference.rad_s[i];
                out.d_n_m[i] -= later.d_n_m * removed;
                state.derivative_n_m[i] = out.d_n_m[i];
                state.last_reference_rad_s[i] = out.reference.rad_s[i] - removed;
            }
            if self.pid.feeds_forward() {
                for i in 0..N {
                    out.ff_n_m[i] -= later.ff_n_m * (less * out.reference.rad_s[i]);
                }
            }
            return;
        }
        for i in 0..N {
            let slope = self.pid.term_slopes(state.started[i]);
            let removed = less * out.reference.rad_s[i];
            out.d_n_m[i] -= slope.d_n_m * removed;
            out.ff_n_m[i] -= slope.ff_n_m * removed;
            state.derivative_n_m[i] = out.d_n_m[i];
            state.last_reference_rad_s[i] = out.reference.rad_s[i] - removed;
        }
    }

    /// Writes to `correction`, which is zero, what anti-windup adds to the integrals because
    /// torques `asked` for were not applied; nothing of wheels that are beyond a limit and not
    /// overloaded yet. The derivative and reference of `state` are brought to what was realised.
    #[inline(always)]
    fn correct<const N: usize>(
        self,
        at: AtLimit,
        asked: &[R; N],
        state: &mut ControlState<R, N>,
        integrated_error: &[R; N],
        out: &WheelSample<R, N>,
        correction: &mut [R; N],
    ) {
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
        zero(correction, at.beyond & !at.overloaded);
        if plain_gain.is_none() {
            self.condition(law, state, integrated_error, out, correction);
        }
    }

    /// Anti-windup for torques that were changed by `correction`: put in its place what to add to the integrals.
    #[inline(never)]
    fn condition<const N: usize>(
        self,
        law: AntiWindup<R>,
        state: &mut ControlState<R, N>,
        integrated_error: &[R; N],
        out: &WheelSample<R, N>,
        correction: &mut [R; N],
    ) {
        let excess = *correction;
        *correction = [R::zero(); N];
        if law == AntiWindup::Conditional && self.shares_integral() {
            // Shared, the motion as a whole goes on integrating or does not: stopped wheel by wheel
            // and projected, most of what was stopped would come back.
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
        let factor = match self.coordination.saturation {
            Saturation::ScaleReferences { .. } => out.common_factor,
            _ => R::one(),
        };
        for i in 0..N {
            if out.active[i] {
                let started = state.started[i];
                let excess = Excess {
                    excess_n_m: excess[i],
                    p_n_m: out.p_n_m[i],
                    unbounded_p_n_m: self.unbounded(i, factor, out),
                };
                let (correct, shift) = self.pid.correction(law, integrated_error[i], &excess, started);
                correction[i] = correct;
                if self.pid.uses_last() {
                    state.derivative_n_m[i] += self.pid.derivative_slope(started) * shift;
                    state.last_reference_rad_s[i] += shift;
                }
            }
        }
    }

    /// Integrals held where [`AntiWindup::Clamp`] says so; shared ones by one factor for all,
    /// because cut one by one they would leave the range of the kinematics.
    #[inline]
    pub(super) fn hold_integrals<const N: usize>(self, state: &mut ControlState<R, N>) {
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

/// Scales all torques by one factor, eqs. (11) and (12).
fn scale_torques<R: Real, const N: usize>(out: &mut WheelSample<R, N>) {
    out.common_factor = torque_factor(&out.requested.n_m, &out.range);
    for torque in &mut out.applied.n_m {
        *torque *= out.common_factor;
    }
}

/// The factor of all references for this step, and that for long: only wheels beyond a limit count
/// for the first, and only overloaded ones for the second.
#[inline(always)]
fn common_factors<R: Real, const N: usize>(
    requested: &[R; N],
    slopes: &[R; N],
    range: &TorqueRanges<R, N>,
    floor: R,
    at: AtLimit,
) -> (R, R) {
    if at.overloaded == at.beyond {
        let factor = reference_factor(requested, slopes, range, floor);
        (factor, factor)
    } else {
        reference_factors(requested, slopes, range, floor, at.overloaded)
    }
}
