//! What happens to the loops at a limit: torques brought within, integrals kept from winding up.

use super::{Law, zero};
use crate::Real;
use crate::loops::coordination::{Saturation, reference_factor, reference_factors, torque_factor};
use crate::loops::pid::{AntiWindup, Excess};
use crate::loops::wheel_loops::{ControlState, WheelSample};

/// Which wheels a limit concerns.
struct AtLimit {
    /// They ask for more than they can have.
    beyond: u32,
    /// They have done so for long enough that integrals know of it.
    overloaded: u32,
    /// Their integral does not count.
    outside_zone: u32,
}

impl<R: Real> Law<'_, R> {
    /// Brings the requested torques of `out` within the limits by the law of the coordination, and the derivative and reference to
    /// remember to `state`. What anti-windup adds to the integrals, none where it adds nothing.
    #[inline(never)]
    pub(super) fn limit<const N: usize>(
        &self,
        beyond: u32,
        outside_zone: u32,
        state: &mut ControlState<R, N>,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
    ) -> Option<[R; N]> {
        let at = AtLimit {
            beyond,
            overloaded: if self.waits {
                state.overload.step(beyond, &out.requested.n_m)
            } else {
                beyond
            },
            outside_zone,
        };
        // Only where terms are bounded: what they were otherwise.
        let mut unbounded_p = self.pid.bounds().any.then(|| self.unbounded(out));
        if self.pid.remembers() {
            state.last_reference_rad_s = out.reference.rad_s;
        }
        match self.coordination.saturation {
            Saturation::Clip => {}
            Saturation::ScaleTorques => scale_torques(out),
            Saturation::ScaleReferences { floor } => {
                self.scale_references(floor, &at, state, integrated_error, out, unbounded_p.as_mut());
            }
        }
        if self.pid.remembers() {
            state.derivative_n_m = out.d_n_m;
        }
        // Torque asked for by the terms as they are in the end: what anti-windup compares with.
        let asked = match self.coordination.saturation {
            Saturation::ScaleReferences { .. } => out.applied.n_m,
            _ => out.requested.n_m,
        };
        clip(out);
        // To look whether anything changed pays only where an excess costs more than a product.
        let changed = !self.pid.remembers() || out.applied.n_m != asked;
        (at.overloaded != 0 && changed)
            .then(|| self.correction(&at, &asked, unbounded_p.as_ref(), state, integrated_error, out))
    }

    /// Scales all references by one factor with which no torque is beyond the limit that its own reference pushes it towards, and every
    /// term with them, which is affine in the reference. Applied are the torques that are then asked for.
    fn scale_references<const N: usize>(
        &self,
        floor: R,
        at: &AtLimit,
        state: &mut ControlState<R, N>,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
        unbounded_p: Option<&mut [R; N]>,
    ) {
        let mut slopes = self.slopes(state, out);
        let about_limits = unbounded_p
            .as_deref()
            .map(|unbounded_p| self.about_limits(state, out, unbounded_p, at.outside_zone, &mut slopes));
        let requested = about_limits.as_ref().unwrap_or(&out.requested.n_m);
        // Only wheels beyond a limit count for the factor.
        let (factor, lasting) = if at.overloaded == at.beyond {
            let factor = reference_factor(requested, &slopes, &out.range, floor);
            (factor, factor)
        } else {
            reference_factors(requested, &slopes, &out.range, floor, at.overloaded)
        };
        out.common_factor = factor;
        let (less, less_for_long) = (R::one() - factor, R::one() - lasting);
        for i in 0..N {
            integrated_error[i] -= less_for_long * out.reference.rad_s[i];
            out.applied.n_m[i] = out.requested.n_m[i] - less * slopes[i];
        }
        zero(integrated_error, at.outside_zone);
        self.reduce_terms(less, state, out);
        if let Some(unbounded_p) = unbounded_p {
            self.bound_reduced(less, out, unbounded_p, at.outside_zone);
        }
    }

    /// How the torque of each wheel changes with the factor of its reference. What is compared with moves along in a first step.
    fn slopes<const N: usize>(&self, state: &ControlState<R, N>, out: &WheelSample<R, N>) -> [R; N] {
        let later = self.pid.term_slopes(true).sum();
        let mut slopes = out.reference.rad_s;
        for slope in &mut slopes {
            *slope *= later;
        }
        if self.pid.remembers() && !state.all_started() {
            for i in 0..N {
                slopes[i] = out.reference.rad_s[i] * self.pid.term_slopes(state.started[i]).sum();
            }
        }
        slopes
    }

    /// The terms with references that are reduced by the part `less`, and that reference to remember.
    fn reduce_terms<const N: usize>(
        &self,
        less: R,
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
        if !self.pid.remembers() {
            return;
        }
        for i in 0..N {
            let slope = self.pid.term_slopes(state.started[i]);
            let removed = less * out.reference.rad_s[i];
            out.d_n_m[i] -= slope.d_n_m * removed;
            out.ff_n_m[i] -= slope.ff_n_m * removed;
            state.last_reference_rad_s[i] = out.reference.rad_s[i] - removed;
        }
    }

    /// What anti-windup adds to the integrals of overloaded wheels, because torques `asked` for were not applied. The derivative and
    /// reference of `state` are brought to what was realised.
    fn correction<const N: usize>(
        &self,
        at: &AtLimit,
        asked: &[R; N],
        unbounded_p: Option<&[R; N]>,
        state: &mut ControlState<R, N>,
        integrated_error: &[R; N],
        out: &WheelSample<R, N>,
    ) -> [R; N] {
        // A conditioned controller to the end: what the floor leaves over is conditioned too, wheel by wheel.
        let law = match self.coordination.saturation {
            Saturation::ScaleReferences { .. } => AntiWindup::Conditioned,
            _ => self.pid.anti_windup(),
        };
        let plain_gain = self.pid.plain_gain(law);
        let gain = plain_gain.unwrap_or(R::one());
        let mut excess = [R::zero(); N];
        for i in 0..N {
            excess[i] = (out.applied.n_m[i] - asked[i]) * gain;
        }
        if at.overloaded != at.beyond {
            zero(&mut excess, !at.overloaded);
        }
        if plain_gain.is_some() {
            return excess;
        }
        let mut correction = self.condition(law, state, integrated_error, out, unbounded_p, &excess);
        zero(&mut correction, at.outside_zone);
        correction
    }

    /// Anti-windup for torques that were changed by `excess`: what to add to the integrals.
    #[inline(never)]
    fn condition<const N: usize>(
        &self,
        law: AntiWindup<R>,
        state: &mut ControlState<R, N>,
        integrated_error: &[R; N],
        out: &WheelSample<R, N>,
        unbounded_p: Option<&[R; N]>,
        excess: &[R; N],
    ) -> [R; N] {
        let mut correction = [R::zero(); N];
        if law == AntiWindup::Conditional && self.shares_integral() {
            // Shared, the motion as a whole goes on integrating or does not: stopped wheel by wheel and projected, most of
            // what was stopped would come back.
            let mut outwards = R::zero();
            for i in 0..N {
                outwards += excess[i] * integrated_error[i];
            }
            if outwards < R::zero() {
                correction =
                    integrated_error.map(|integrated_error| -self.pid.integral_gain_dt() * integrated_error);
            }
            return correction;
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
        correction
    }

    /// Integrals held where [`AntiWindup::Clamp`] says so; shared ones by one factor for all, because cut one by one they
    /// would leave the range of the kinematics.
    #[inline]
    pub(super) fn hold_integrals<const N: usize>(&self, state: &mut ControlState<R, N>) {
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

/// Cuts each torque to its own range.
fn clip<R: Real, const N: usize>(out: &mut WheelSample<R, N>) {
    for i in 0..N {
        out.applied.n_m[i] = out.range.clip(i, out.applied.n_m[i]);
    }
}
