//! The law of loops, once for one loop and for all wheels: eq. (10), what happens at a torque limit, anti-windup.

mod bounds;
mod limit;

use super::coordination::{Coordination, Integral};
use super::pid::Pid;
use super::wheel_loops::{ControlState, Overload, WheelSample};
use crate::Real;

/// Loops with one set of constants. Passed by value, because the compiler then sees which constants the references
/// point to: an image with constant loops has no code for what they do not use. In masks wheel i is bit i.
#[derive(Clone, Copy)]
pub(super) struct Law<'a, R> {
    pub(super) pid: &'a Pid<R>,
    pub(super) coordination: &'a Coordination<R>,
}

/// Which wheels a limit concerns.
#[derive(Clone, Copy)]
struct AtLimit {
    /// They ask for more than they can have.
    beyond: u32,
    /// They have done so for long enough that integrals know of it.
    overloaded: u32,
}

impl<R: Real> Law<'_, R> {
    /// One step, eq. (10): with e' = share(e), the torques are u = p(e) + i(I, e') + d + ff,
    /// brought within their limits, and I' = I + ki T e' + what anti-windup adds.
    ///
    /// It starts from the references, measurements and ranges in `out`; values of wheels that are not active are 0. The
    /// integrals take in what `share` makes of the errors, each wheel its own if there is none. `share` is linear, and
    /// the identity on the references. `some_released`: not all wheels are active. `waits`: integrals know of limits
    /// that last only ([`Overload`]), otherwise of every limit.
    ///
    /// The usual case, with every wheel active and none at its limit, consists of straight loops over the wheels that
    /// write the result in place; separate functions handle all other cases.
    #[inline]
    pub(super) fn step<const N: usize>(
        self,
        state: &mut ControlState<R, N>,
        share: Option<impl Fn(&[R; N]) -> [R; N]>,
        some_released: bool,
        waits: bool,
        out: &mut WheelSample<R, N>,
    ) {
        let mut integrated_error = [R::zero(); N];
        for i in 0..N {
            integrated_error[i] = out.reference.rad_s[i] - out.measured.rad_s[i];
        }
        if let Some(share) = &share {
            integrated_error = share(&integrated_error);
            if some_released {
                zero_inactive(&mut integrated_error, &out.active);
            }
        }
        self.write_terms(state, &integrated_error, out);
        let mut outside_zone = 0;
        if self.pid.bounds().any {
            outside_zone = self.bound(state, &mut integrated_error, out);
        }
        let beyond = self.request(out);
        let ki_dt = self.pid.integral_gain_dt();
        if beyond != 0 {
            if !all_finite(&out.requested.n_m) {
                start_afresh_where_not_finite(state, &mut integrated_error, out);
            }
            let overloaded = if waits {
                state.overload.step(beyond, &out.requested.n_m)
            } else {
                beyond
            };
            let at = AtLimit { beyond, overloaded };
            let mut correction = [R::zero(); N];
            let corrected = self.limit(
                at,
                outside_zone,
                state,
                &mut integrated_error,
                out,
                &mut correction,
            );
            if corrected {
                if let Some(share) = &share {
                    correction = share(&correction);
                    zero_inactive(&mut correction, &out.active);
                }
                for i in 0..N {
                    state.integral_n_m[i] += ki_dt * integrated_error[i] + correction[i];
                }
            } else {
                for i in 0..N {
                    state.integral_n_m[i] += ki_dt * integrated_error[i];
                }
            }
        } else {
            state.overload = Overload::new();
            for i in 0..N {
                state.integral_n_m[i] += ki_dt * integrated_error[i];
            }
            self.store_last(state, out);
        }
        if self.pid.uses_last() {
            (state.last_measured_rad_s, state.started) = (out.measured.rad_s, out.active);
        }
        self.hold_integrals(state);
    }

    /// The derivative and the reference that the next step compares with.
    #[inline]
    fn store_last<const N: usize>(self, state: &mut ControlState<R, N>, out: &WheelSample<R, N>) {
        if self.pid.uses_last() {
            (state.derivative_n_m, state.last_reference_rad_s) = (out.d_n_m, out.reference.rad_s);
        }
    }

    pub(super) fn shares_integral(self) -> bool {
        self.coordination.integral == Integral::Shared
    }

    /// Writes the terms of every wheel for its reference and measurement.
    #[inline]
    pub(super) fn write_terms<const N: usize>(
        self,
        state: &ControlState<R, N>,
        integrated_error: &[R; N],
        out: &mut WheelSample<R, N>,
    ) {
        for i in 0..N {
            out.p_n_m[i] = self
                .pid
                .proportional(out.reference.rad_s[i], out.measured.rad_s[i]);
            out.i_n_m[i] = self.pid.integral(state.integral_n_m[i], integrated_error[i]);
            // In here, and not as whole arrays: those are cleared by a function that costs more
            // than all of these stores.
            (out.d_n_m[i], out.ff_n_m[i]) = (R::zero(), R::zero());
        }
        if !self.pid.uses_last() {
            return;
        }
        let (mut last_reference, mut last_measured) = (state.last_reference_rad_s, state.last_measured_rad_s);
        if !state.all_started() {
            for i in 0..N {
                if !state.started[i] {
                    (last_reference[i], last_measured[i]) = (out.reference.rad_s[i], out.measured.rad_s[i]);
                }
            }
        }
        for i in 0..N {
            let (r, y) = (out.reference.rad_s[i], out.measured.rad_s[i]);
            let change = self
                .pid
                .weighted_change(r, last_reference[i], y, last_measured[i]);
            out.d_n_m[i] = self.pid.derivative(state.derivative_n_m[i], change);
        }
        if self.pid.feeds_forward() {
            for i in 0..N {
                out.ff_n_m[i] = self.pid.feed_forward(out.reference.rad_s[i], last_reference[i]);
            }
        }
    }

    /// Writes the torques that the terms ask for. Those wheels that ask for more than they can have.
    #[inline]
    fn request<const N: usize>(self, out: &mut WheelSample<R, N>) -> u32 {
        const { assert!(N <= 32, "at most 32 wheels") };
        let mut beyond = 0_u32;
        let (mut requested, mut saturated) = ([R::zero(); N], [false; N]);
        for i in 0..N {
            requested[i] = out.p_n_m[i] + out.i_n_m[i];
        }
        if self.pid.uses_last() {
            for i in 0..N {
                requested[i] += out.d_n_m[i] + out.ff_n_m[i];
            }
        }
        for i in 0..N {
            // NaN, which only a state set from outside brings, is not inside.
            let inside = requested[i] <= out.range.upper_n_m[i] && requested[i] >= out.range.lower_n_m[i];
            saturated[i] = !inside;
        }
        for i in 0..N {
            beyond |= u32::from(saturated[i]) << i;
        }
        (out.requested.n_m, out.applied.n_m, out.saturated) = (requested, requested, saturated);
        beyond
    }
}

/// Zero for wheels of a mask.
#[inline]
fn zero<R: Real, const N: usize>(values: &mut [R; N], wheels: u32) {
    if wheels != 0 {
        for (i, value) in values.iter_mut().enumerate() {
            if wheels & (1 << i) != 0 {
                *value = R::zero();
            }
        }
    }
}

/// Zero where a wheel is not active.
fn zero_inactive<R: Real, const N: usize>(values: &mut [R; N], active: &[bool; N]) {
    for (value, &active) in values.iter_mut().zip(active) {
        if !active {
            *value = R::zero();
        }
    }
}

/// One look at a sum, which is not finite where one of its parts is not.
#[inline]
fn all_finite<R: Real, const N: usize>(values: &[R; N]) -> bool {
    let mut sum = R::zero();
    for &value in values {
        sum += value;
    }
    sum.is_finite_real()
}

/// Loops whose torque is not a number, because their state was set to invalid values, apply no torque and restart.
#[inline(never)]
fn start_afresh_where_not_finite<R: Real, const N: usize>(
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
            (out.reference.rad_s[i], out.active[i], out.saturated[i]) = (zero, false, false);
        }
    }
}
