//! Integral zones and limits of proportional terms, of all wheels.

use super::{Law, zero};
use crate::Real;
use crate::loops::wheel_loops::{ControlState, WheelSample};

impl<R: Real> Law<'_, R> {
    /// Brings the terms of `out` within their bounds: proportional terms within their limit, and
    /// integrals with an error beyond the zone to 0. Those wheels. Where the integral is shared it
    /// is all of them or none: with some of its parts it would leave the range of the kinematics.
    #[inline(never)]
    pub(super) fn bound<const N: usize>(
        self,
        state: &mut ControlState<R, N>,
        integrated_error: &mut [R; N],
        out: &mut WheelSample<R, N>,
    ) -> u32 {
        let mut outside = 0;
        for i in 0..N {
            out.p_n_m[i] = self.pid.bounds().proportional(out.p_n_m[i]);
            outside |= u32::from(self.pid.bounds().is_outside_zone(integrated_error[i])) << i;
        }
        if outside != 0 && self.shares_integral() {
            outside = u32::MAX;
        }
        zero(&mut state.integral_n_m, outside);
        zero(integrated_error, outside);
        zero(&mut out.i_n_m, outside);
        outside
    }

    /// Proportional term of wheel i without its limit, for its reference times `factor`; 0 of a released wheel.
    #[inline]
    pub(super) fn unbounded<const N: usize>(self, i: usize, factor: R, out: &WheelSample<R, N>) -> R {
        if out.active[i] {
            self.pid
                .proportional(factor * out.reference.rad_s[i], out.measured.rad_s[i])
        } else {
            R::zero()
        }
    }

    /// Torques and slopes of the wheels as they are about their limits: a proportional term that is at its own
    /// limit does not fall with the reference at first, and one that is not may come to its limit on the way.
    pub(super) fn linearised_at_limits<const N: usize>(
        self,
        state: &ControlState<R, N>,
        out: &WheelSample<R, N>,
        outside_zone: u32,
    ) -> ([R; N], [R; N]) {
        let (mut requested, mut slopes) = (out.requested.n_m, [R::zero(); N]);
        for i in 0..N {
            let reference = out.reference.rad_s[i];
            let slope = self.pid.term_slopes(!self.pid.uses_last() || state.started[i]);
            let mut others = slope.d_n_m + slope.ff_n_m;
            if outside_zone & (1 << i) == 0 {
                others += slope.i_n_m;
            }
            slopes[i] = (slope.p_n_m + others) * reference;
            let limit = if slopes[i] > R::zero() {
                out.range.upper_n_m[i]
            } else {
                out.range.lower_n_m[i]
            };
            if (requested[i] - limit) * slopes[i] <= R::zero() {
                continue; // not beyond, or not by its reference
            }
            let unbounded_p = self.unbounded(i, R::one(), out);
            let free = requested[i] + (unbounded_p - out.p_n_m[i]);
            let own = slope.p_n_m * reference;
            let p_n_m = unbounded_p - own * ((free - limit) / slopes[i]);
            let bounded = self.pid.bounds().proportional(p_n_m);
            if bounded == p_n_m {
                requested[i] = free;
            } else {
                requested[i] += bounded - out.p_n_m[i];
                slopes[i] = others * reference;
            }
        }
        (requested, slopes)
    }

    /// Terms and torques once references were reduced by the common factor: proportional terms come off their limit.
    pub(super) fn bound_reduced<const N: usize>(self, out: &mut WheelSample<R, N>, outside_zone: u32) {
        zero(&mut out.i_n_m, outside_zone);
        for i in 0..N {
            let unbounded_p = self.unbounded(i, out.common_factor, out);
            out.p_n_m[i] = self.pid.bounds().proportional(unbounded_p);
            out.applied.n_m[i] = out.p_n_m[i] + out.i_n_m[i] + out.d_n_m[i] + out.ff_n_m[i];
        }
    }
}
