//! Effect of anti-windup on an excess of one loop.

use super::Pid;
use super::anti_windup::{AntiWindup, back_calculation_gain, reciprocal};
use crate::Real;

/// Excess of a loop's output over its request, and its request including the proportional term.
pub(crate) struct Excess<R> {
    /// Applied less requested output \[N.m\].
    pub(crate) excess_n_m: R,
    /// The proportional term \[N.m\].
    pub(crate) p_n_m: R,
    /// What it were without its limit \[N.m\].
    pub(crate) unbounded_p_n_m: R,
}

impl<R: Real> Pid<R> {
    /// Fraction of an excess that the integral removes, if nothing else is needed: the law is
    /// [`AntiWindup::Conditioned`], no term uses the last step or has a bound, and the integral need not stop instead.
    #[inline]
    pub(crate) fn plain_gain(&self, law: AntiWindup<R>) -> Option<R> {
        let gain = self.first_conditioned_gain;
        let plain = !self.uses_last && !self.bounds.any;
        (law == AntiWindup::Conditioned && plain && gain > R::zero()).then_some(gain)
    }

    /// What anti-windup adds to the integral \[N.m\] for an excess, and how far the realised
    /// reference is from the one asked for \[rad/s\]: 0 but for [`AntiWindup::Conditioned`].
    pub(crate) fn correction(
        &self,
        law: AntiWindup<R>,
        integrated_error: R,
        excess: &Excess<R>,
        started: bool,
    ) -> (R, R) {
        let zero = R::zero();
        let beyond = excess.excess_n_m;
        let conditional = || {
            if beyond * integrated_error < zero {
                -self.ki_dt * integrated_error
            } else {
                zero
            }
        };
        match law {
            AntiWindup::None | AntiWindup::Clamp { .. } => (zero, zero),
            AntiWindup::Conditional => (conditional(), zero),
            AntiWindup::BackCalculation { .. } => {
                let over = excess.unbounded_p_n_m - excess.p_n_m;
                let correction = self.tracking * beyond;
                // What the proportional term does not show of an error, the integral does not see
                // either. Otherwise it would settle that much beyond the limit of the output.
                let unseen = if over * beyond < zero {
                    self.ki_dt * over / self.kp
                } else {
                    zero
                };
                (correction - unseen, zero)
            }
            AntiWindup::Conditioned => {
                let (shift, gain, whole) = self.realised(excess, started);
                if gain > zero {
                    (whole * gain, shift)
                } else {
                    (conditional(), shift)
                }
            }
        }
    }

    /// Shift of the reference \[rad/s\] with which the output would have been the applied one, the
    /// integral's part of the change of the output that goes with it, and that change \[N.m\].
    fn realised(&self, excess: &Excess<R>, started: bool) -> (R, R, R) {
        let (inverse_slope, gain) = if started {
            (self.inverse_slope, self.conditioned_gain)
        } else {
            (self.inverse_first_slope, self.first_conditioned_gain)
        };
        if !self.bounds.any {
            return (excess.excess_n_m * inverse_slope, gain, excess.excess_n_m);
        }
        if excess.excess_n_m == R::zero() {
            return (R::zero(), gain, R::zero());
        }
        // As if the term had no limit there.
        let free = excess.excess_n_m + (excess.p_n_m - excess.unbounded_p_n_m);
        let shift = free * inverse_slope;
        let p_n_m = excess.unbounded_p_n_m + self.kp_reference * shift;
        let bounded = self.bounds.proportional(p_n_m);
        if bounded == p_n_m {
            return (shift, gain, free);
        }
        // At its limit there: the other terms have to make the change.
        let slopes = self.term_slopes(started);
        let rest = slopes.i_n_m + (slopes.d_n_m + slopes.ff_n_m);
        let change = excess.excess_n_m + (excess.p_n_m - bounded);
        let per_rest = reciprocal(rest);
        let gain = back_calculation_gain(self.ki_dt, per_rest, self.derivative_slope(started));
        (change * per_rest, gain, change)
    }
}
