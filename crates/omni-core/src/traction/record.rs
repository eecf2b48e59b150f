//! Whom the wheels' signals of a period are told: a sample, or only the torques.

use super::{TractionSample, TractionState};
use crate::{Readings, Real, TorqueRanges, WheelTorques};

/// Takes the signals of a period. What an implementation does not take is not computed: it is inlined.
pub(super) trait Record<R, const N: usize> {
    /// Before the wheels: what motors have, the rates that the command asks for, those that are measured.
    fn period(&mut self, range: &TorqueRanges<R, N>, reference: &[R; N], measured: &[R; N]);
    /// Of a driven wheel the common thrust and what becomes of it \[N.m\], its slip \[rad/s\], what the ground takes \[N.m\].
    fn driven(&mut self, wheel: usize, thrust_n_m: R, torque_n_m: R, slip_rad_s: R, contact_n_m: R);
    /// Of a wheel across the way what its loop is made of \[N.m\].
    fn across(&mut self, wheel: usize, p_n_m: R, i_n_m: R);
    /// Of every wheel the torque that was asked for, and that which its motor has of it \[N.m\].
    fn torque(&mut self, wheel: usize, requested_n_m: R, applied_n_m: R, saturated: bool);
    /// After the wheels: what is the same of all, the measured speed over the commanded, the wheel that is believed.
    fn common(
        &mut self,
        readings: &Readings<'_, R>,
        state: &TractionState<R, N>,
        factor: impl FnOnce() -> R,
        believed: Option<usize>,
    );
    /// Of wheels that are not heard nothing; wheel i is bit i.
    fn let_go(&mut self, heard: u32);
}

impl<R: Real, const N: usize> Record<R, N> for TractionSample<R, N> {
    #[inline(always)]
    fn period(&mut self, range: &TorqueRanges<R, N>, reference: &[R; N], measured: &[R; N]) {
        let (wheels, zero) = (&mut self.wheels, R::zero());
        wheels.range = *range;
        wheels.reference.rad_s = *reference;
        wheels.measured.rad_s = *measured;
        wheels.active = [true; N];
        (wheels.i_n_m, wheels.ff_n_m) = ([zero; N], [zero; N]);
        wheels.common_factor = R::one();
    }

    #[inline(always)]
    fn driven(&mut self, wheel: usize, thrust_n_m: R, torque_n_m: R, slip_rad_s: R, contact_n_m: R) {
        let wheels = &mut self.wheels;
        (self.slip_rad_s[wheel], self.contact_n_m[wheel]) = (slip_rad_s, contact_n_m);
        (wheels.p_n_m[wheel], wheels.d_n_m[wheel]) = (thrust_n_m, torque_n_m - thrust_n_m);
    }

    #[inline(always)]
    fn across(&mut self, wheel: usize, p_n_m: R, i_n_m: R) {
        let (wheels, zero) = (&mut self.wheels, R::zero());
        (self.slip_rad_s[wheel], self.contact_n_m[wheel]) = (zero, zero);
        (wheels.p_n_m[wheel], wheels.i_n_m[wheel], wheels.d_n_m[wheel]) = (p_n_m, i_n_m, zero);
    }

    #[inline(always)]
    fn torque(&mut self, wheel: usize, requested_n_m: R, applied_n_m: R, saturated: bool) {
        let wheels = &mut self.wheels;
        (wheels.requested.n_m[wheel], wheels.applied.n_m[wheel]) = (requested_n_m, applied_n_m);
        wheels.saturated[wheel] = saturated;
    }

    #[inline(always)]
    fn common(
        &mut self,
        readings: &Readings<'_, R>,
        state: &TractionState<R, N>,
        factor: impl FnOnce() -> R,
        believed: Option<usize>,
    ) {
        self.factor = factor();
        self.command = readings.command;
        self.speed_m_s = state.speed_m_s;
        self.target_m_s = state.target_m_s;
        self.thrust_n_m = state.thrust_n_m;
        self.believed = believed;
        self.heading_rad = state.heading_rad;
        self.gyro_zero_rad_s = state.gyro_zero_rad_s;
    }

    #[cold]
    #[inline(never)]
    fn let_go(&mut self, heard: u32) {
        let (zero, wheels) = (R::zero(), &mut self.wheels);
        for i in 0..N {
            if heard & 1 << i != 0 {
                continue;
            }
            (wheels.active[i], wheels.saturated[i]) = (false, false);
            (wheels.p_n_m[i], wheels.i_n_m[i], wheels.d_n_m[i]) = (zero, zero, zero);
            (wheels.requested.n_m[i], wheels.applied.n_m[i]) = (zero, zero);
            (self.slip_rad_s[i], self.contact_n_m[i]) = (zero, zero);
        }
    }
}

impl<R: Real, const N: usize> Record<R, N> for WheelTorques<R, N> {
    #[inline(always)]
    fn period(&mut self, _: &TorqueRanges<R, N>, _: &[R; N], _: &[R; N]) {}

    #[inline(always)]
    fn driven(&mut self, _: usize, _: R, _: R, _: R, _: R) {}

    #[inline(always)]
    fn across(&mut self, _: usize, _: R, _: R) {}

    #[inline(always)]
    fn torque(&mut self, wheel: usize, _: R, applied_n_m: R, _: bool) {
        self.n_m[wheel] = applied_n_m;
    }

    #[inline(always)]
    fn common(
        &mut self,
        _: &Readings<'_, R>,
        _: &TractionState<R, N>,
        _: impl FnOnce() -> R,
        _: Option<usize>,
    ) {
    }

    #[cold]
    #[inline(never)]
    fn let_go(&mut self, heard: u32) {
        for (i, torque) in self.n_m.iter_mut().enumerate() {
            if heard & 1 << i == 0 {
                *torque = R::zero();
            }
        }
    }
}
