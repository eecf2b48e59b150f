//! A step of one loop: the law of all wheels, for one.

use super::Pid;
use super::sample::{LastStep, PidSample, PidState, PidTerms};
use crate::Real;
use crate::loops::coordination::Coordination;
use crate::loops::law::Law;
use crate::loops::wheel_loops::{ControlState, WheelSample};
use crate::scalar::is_plausible;

impl<R: Real> Pid<R> {
    /// One step: the output \[N.m\] that brings `measured_rad_s` to `reference_rad_s`, within the limits of the
    /// configuration. To be called once every period.
    ///
    /// A reference or measurement that is not finite, or beyond 1e6 rad/s, changes nothing in the state and yields the
    /// integral term alone; a state that is not finite starts afresh.
    ///
    /// ```
    /// use omni_core::loops::{Pid, PidState};
    /// use omni_core::{PidConfig, PidGains};
    /// let gains = PidGains { kp_n_m_s_rad: 2.0, ki_n_m_rad: 4.0, kd_n_m_s2_rad: 0.0 };
    /// let (pid, mut state) = (Pid::new(PidConfig::new(gains, 0.25))?, PidState::default());
    /// assert_eq!(pid.step(&mut state, -1.0, 0.0).output_n_m, -(2.0 + 4.0 * 0.25));
    /// assert_eq!(pid.step(&mut state, -1.0, f64::NAN).output_n_m, -1.0); // what the integral holds
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut PidState<R>, reference_rad_s: R, measured_rad_s: R) -> PidSample<R> {
        let terms = if is_plausible(reference_rad_s) && is_plausible(measured_rad_s) {
            let (mut loops, mut out) = self.one(state, reference_rad_s, measured_rad_s);
            let coordination = Coordination::independent();
            let share = None::<fn(&[R; 1]) -> [R; 1]>;
            let (some_released, waits) = (false, false);
            self.law(&coordination)
                .step(&mut loops, share, some_released, waits, &mut out);
            if out.active[0] && terms(&out).sum().is_finite_real() {
                if self.uses_last {
                    state.derivative_n_m = loops.derivative_n_m[0];
                    state.last = Some(LastStep {
                        reference_rad_s: loops.last_reference_rad_s[0],
                        measured_rad_s,
                    });
                }
                state.integral_n_m = loops.integral_n_m[0];
                terms(&out)
            } else {
                // Reached only by a state that was set from outside: restart.
                *state = PidState::default();
                PidTerms::integral_alone(state.integral_n_m)
            }
        } else {
            if !state.integral_n_m.is_finite_real() {
                *state = PidState::default();
            }
            PidTerms::integral_alone(state.integral_n_m)
        };
        let requested = terms.sum();
        PidSample {
            terms,
            output_n_m: self.output.clip(requested),
            saturated: self.output.exceeded_by(requested),
        }
    }

    /// Bumpless transfer: sets the integral so that the next step with this reference and
    /// measurement yields `output_n_m`.
    ///
    /// Call it while something else drives the actuator (manual control, another loop), or once on
    /// a loop with new gains with the output of the old one. Without an integral gain, or with an
    /// error beyond the integral zone, there is nothing to set, and the output may jump.
    ///
    /// ```
    /// use omni_core::loops::{Pid, PidState};
    /// use omni_core::{PidConfig, PidGains};
    /// let gains = |kp| PidGains { kp_n_m_s_rad: kp, ki_n_m_rad: 1.0_f64, kd_n_m_s2_rad: 0.0 };
    /// let (before, after) = (Pid::new(PidConfig::new(gains(2.0), 0.1))?, Pid::new(PidConfig::new(gains(0.5), 0.1))?);
    /// let mut state = PidState::default();
    /// let output = before.step(&mut state, 3.0, 1.0).output_n_m;
    /// after.track(&mut state, output, 3.0, 1.0);
    /// assert!((after.step(&mut state, 3.0, 1.0).output_n_m - output).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn track(&self, state: &mut PidState<R>, output_n_m: R, reference_rad_s: R, measured_rad_s: R) {
        if !(is_plausible(reference_rad_s) && is_plausible(measured_rad_s) && is_plausible(output_n_m)) {
            return;
        }
        state.last = Some(LastStep {
            reference_rad_s,
            measured_rad_s,
        });
        state.derivative_n_m = R::zero();
        let error = reference_rad_s - measured_rad_s;
        if self.bounds().is_outside_zone(error) {
            state.integral_n_m = R::zero();
        } else if self.integral_gain_dt() > R::zero() {
            let (loops, mut out) = self.one(state, reference_rad_s, measured_rad_s);
            self.law(&Coordination::independent())
                .write_terms(&loops, &[error], &mut out);
            out.p_n_m = out.p_n_m.map(|p_n_m| self.bounds().proportional(p_n_m));
            state.integral_n_m = self.held(state.integral_n_m + output_n_m - terms(&out).sum());
        }
    }

    fn law<'a>(&'a self, coordination: &'a Coordination<R>) -> Law<'a, R> {
        Law {
            pid: self,
            coordination,
        }
    }

    /// This loop as all loops of a vehicle with one wheel.
    fn one(&self, state: &PidState<R>, reference: R, measured: R) -> (ControlState<R, 1>, WheelSample<R, 1>) {
        let mut loops = ControlState::new();
        loops.integral_n_m = [state.integral_n_m];
        loops.derivative_n_m = [state.derivative_n_m];
        if let Some(last) = state.last {
            loops.last_reference_rad_s = [last.reference_rad_s];
            loops.last_measured_rad_s = [last.measured_rad_s];
            loops.started = [true];
        }
        let mut out = WheelSample::zero();
        (out.reference.rad_s, out.measured.rad_s, out.active) = ([reference], [measured], [true]);
        out.range.set(0, &self.output);
        (loops, out)
    }
}

fn terms<R: Real>(out: &WheelSample<R, 1>) -> PidTerms<R> {
    PidTerms {
        p_n_m: out.p_n_m[0],
        i_n_m: out.i_n_m[0],
        d_n_m: out.d_n_m[0],
        ff_n_m: out.ff_n_m[0],
    }
}
