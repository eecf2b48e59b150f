//! The loops of all wheels: N PIDs and what they do together when one of them saturates.

#[cfg(test)]
mod tests;

use crate::coordination::{Coordination, Integral, Saturation, TorqueRange, reference_factor, torque_factor};
use crate::error::ConfigError;
use crate::pid::is_plausible;
use crate::{
    AntiWindup, Pid, PidConfig, PidState, PidTerms, Real, TorqueLimit, WheelTorques, WheelVelocities,
};

/// Everything that the loops of `N` wheels need to know; validated by [`WheelController::new`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelControlConfig<R, const N: usize> {
    /// The loop, the same for every wheel. Its `output` limits are ignored: the actuators' count.
    pub pid: PidConfig<R>,
    /// Torque limit of each actuator.
    pub limits: [TorqueLimit<R>; N],
    /// What the wheels do together.
    pub coordination: Coordination<R>,
}

/// What the loops remember between steps; `default` is a fresh start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlState<R, const N: usize> {
    /// One PID state a wheel.
    pub pid: [PidState<R>; N],
}

impl<R: Real, const N: usize> Default for ControlState<R, N> {
    fn default() -> Self {
        Self {
            pid: [PidState::default(); N],
        }
    }
}

/// Every signal of one control step, per wheel in the layout's order. Velocities \[rad/s\] and torques \[N.m\] are the
/// actuators'. Nothing in it is ever NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSample<R, const N: usize> {
    /// Reference r as commanded, before any reduction.
    pub reference: WheelVelocities<R, N>,
    /// Measurement y; 0 for a wheel that is not `active`.
    pub measured: WheelVelocities<R, N>,
    /// The wheel was controlled. One without a usable measurement is let go: no torque, its loop starts afresh.
    pub active: [bool; N],
    /// Proportional term, formed with the reference as reduced by `common_factor` under [`Saturation::ScaleReference`].
    pub p_n_m: [R; N],
    /// Integral term, likewise.
    pub i_n_m: [R; N],
    /// Derivative term, likewise.
    pub d_n_m: [R; N],
    /// Feed-forward, likewise.
    pub ff_n_m: [R; N],
    /// Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
    pub requested: WheelTorques<R, N>,
    /// Torque to apply, always within the limits.
    pub applied: WheelTorques<R, N>,
    /// Limits at the present velocities.
    pub range: [TorqueRange<R>; N],
    /// The requested torque is outside the limits.
    pub saturated: [bool; N],
    /// What all torques ([`Saturation::ScaleTorques`]) or all references ([`Saturation::ScaleReference`]) were
    /// multiplied by, 0 to 1; 1 under [`Saturation::Clip`].
    pub common_factor: R,
}

/// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
///
/// ```
/// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig, WheelController};
/// let gains = PidGains { kp_n_m_s_rad: 0.1_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let wheels = WheelController::new(WheelControlConfig {
///     pid: PidConfig::new(gains, 1e-3),
///     limits: [TorqueLimit::constant(1.0)?; 2],
///     coordination: Coordination::paper(),
/// })?;
/// let sample = wheels.step(&mut ControlState::default(), &[20.0, -10.0].into(), &[0.0, 0.0].into());
/// assert_eq!(sample.requested.n_m, [2.0, -1.0]);
/// assert_eq!(sample.applied.n_m, [1.0, -0.5]); // both halved: the ratio is kept
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelController<R, const N: usize> {
    pid: Pid<R>,
    limits: [TorqueLimit<R>; N],
    coordination: Coordination<R>,
}

/// What one step of the loops starts from.
pub(crate) struct LoopInputs<'a, R, const N: usize> {
    pub(crate) reference: &'a WheelVelocities<R, N>,
    pub(crate) measured: &'a WheelVelocities<R, N>,
    /// Wheels to be let go whatever they measure.
    pub(crate) dropped: &'a [bool; N],
    /// Torque caps \[N.m\], >= 0, below the actuators' own limits; infinite for none.
    pub(crate) caps: Option<&'a [R; N]>,
}

impl<R: Real, const N: usize> WheelController<R, N> {
    /// Loops as configured.
    ///
    /// # Errors
    /// The gain, period or floor that is out of range; parameter `integral` for [`Integral::Shared`], which needs the
    /// layout that a [`crate::Controller`] has.
    pub fn new(config: WheelControlConfig<R, N>) -> Result<Self, ConfigError> {
        if config.coordination.integral == Integral::Shared {
            let allowed = "per wheel (0): wheels without a vehicle share no motion";
            return Err(ConfigError::new("integral", 1.0, allowed));
        }
        Self::with_layout(config)
    }

    pub(crate) fn with_layout(config: WheelControlConfig<R, N>) -> Result<Self, ConfigError> {
        config.coordination.check()?;
        Ok(Self {
            pid: Pid::new(config.pid)?,
            limits: config.limits,
            coordination: config.coordination,
        })
    }

    pub(crate) fn shares_integral(&self) -> bool {
        self.coordination.integral == Integral::Shared
    }

    /// One step: torques that bring the velocities `measured` to `reference`.
    ///
    /// A reference that is not finite, or beyond 1e6 rad/s, stands for rest of all wheels; a measurement that is not lets
    /// its wheel go.
    #[inline]
    pub fn step(
        &self,
        state: &mut ControlState<R, N>,
        reference: &WheelVelocities<R, N>,
        measured: &WheelVelocities<R, N>,
    ) -> WheelSample<R, N> {
        let usable = reference.rad_s.iter().all(|&r| is_plausible(r));
        let rest = WheelVelocities::zero();
        let reference = if usable { reference } else { &rest };
        self.run(
            state,
            &LoopInputs {
                reference,
                measured,
                dropped: &[false; N],
                caps: None,
            },
            |errors| *errors,
        )
    }

    /// A step whose integrals take in what `share` makes of the errors: linear, and the identity on the references.
    #[inline]
    pub(crate) fn run(
        &self,
        state: &mut ControlState<R, N>,
        inputs: &LoopInputs<'_, R, N>,
        share: impl Fn(&[R; N]) -> [R; N],
    ) -> WheelSample<R, N> {
        let zero = [R::zero(); N];
        let mut sample = WheelSample {
            reference: *inputs.reference,
            measured: *inputs.measured,
            active: [true; N],
            p_n_m: zero,
            i_n_m: zero,
            d_n_m: zero,
            ff_n_m: zero,
            requested: WheelTorques { n_m: zero },
            applied: WheelTorques { n_m: zero },
            range: [TorqueRange::none(); N],
            saturated: [false; N],
            common_factor: R::one(),
        };
        let mut error = zero;
        for i in 0..N {
            if inputs.dropped[i] || !is_plausible(sample.measured.rad_s[i]) {
                // All zero, so that the wheel has no say in any common factor.
                sample.active[i] = false;
                sample.reference.rad_s[i] = R::zero();
                sample.measured.rad_s[i] = R::zero();
                state.pid[i] = PidState::default();
                continue;
            }
            let y = sample.measured.rad_s[i];
            (sample.range[i].lower_n_m, sample.range[i].upper_n_m) = self.limits[i].range(y);
            if let Some(caps) = inputs.caps {
                sample.range[i] = sample.range[i].capped(caps[i]);
            }
            error[i] = sample.reference.rad_s[i] - y;
        }
        let mut taken_in = share(&error);
        for (taken_in, active) in taken_in.iter_mut().zip(&sample.active) {
            if !active {
                *taken_in = R::zero();
            }
        }
        let mut excess = zero;
        for i in 0..N {
            let terms = self.pid.terms(
                &state.pid[i],
                sample.reference.rad_s[i],
                sample.measured.rad_s[i],
                taken_in[i],
            );
            sample.write(i, &terms);
            let requested = terms.sum();
            sample.requested.n_m[i] = requested;
            sample.applied.n_m[i] = requested;
            sample.saturated[i] = sample.range[i].exceeded_by(requested);
        }
        match self.coordination.saturation {
            Saturation::Clip => {}
            Saturation::ScaleTorques => {
                sample.common_factor = torque_factor(&sample.requested.n_m, &sample.range);
                for i in 0..N {
                    sample.applied.n_m[i] *= sample.common_factor;
                    excess[i] = sample.applied.n_m[i] - sample.requested.n_m[i];
                }
            }
            Saturation::ScaleReference { floor } => {
                self.scale_references(state, &mut sample, &mut taken_in, floor);
            }
        }
        let law = match self.coordination.saturation {
            // The law is a conditioned controller: what the floor leaves over is conditioned too, wheel by wheel.
            Saturation::ScaleReference { .. } => AntiWindup::Conditioned,
            _ => self.pid.anti_windup(),
        };
        let mut correction = zero;
        let mut corrected = false;
        for i in 0..N {
            let torque = sample.range[i].clip(sample.applied.n_m[i]);
            let excess = excess[i] + (torque - sample.applied.n_m[i]);
            sample.applied.n_m[i] = torque;
            let pid = &mut state.pid[i];
            correction[i] = self.pid.correction(law, pid, taken_in[i], excess);
            corrected |= correction[i] != R::zero();
            let shift = self.pid.shift(law, pid, excess);
            if sample.active[i] {
                let reference = sample.realised_reference(i, &self.coordination);
                self.pid
                    .commit(pid, &sample.terms(i), reference, sample.measured.rad_s[i], shift);
            }
        }
        if corrected && self.shares_integral() {
            correction = share(&correction);
        }
        let mut scale = R::one();
        for i in 0..N {
            if sample.active[i] {
                let integral = &mut state.pid[i].integral_n_m;
                *integral += self.pid.integral_gain_dt() * taken_in[i] + correction[i];
                let held = self.pid.held(*integral);
                if held != *integral {
                    scale = scale.limited(R::zero(), held / *integral);
                    if !self.shares_integral() {
                        *integral = held;
                    }
                }
            }
        }
        if self.shares_integral() && scale < R::one() {
            // Cut one by one they would leave the range of the kinematics: one factor for all.
            for pid in &mut state.pid {
                pid.integral_n_m *= scale;
            }
        }
        sample
    }

    /// Reduces all references by the factor of [`Saturation::ScaleReference`]. Every term is affine in it: what a smaller
    /// reference takes away is its slope times the part taken away.
    #[inline]
    fn scale_references(
        &self,
        state: &ControlState<R, N>,
        sample: &mut WheelSample<R, N>,
        taken_in: &mut [R; N],
        floor: R,
    ) {
        if !sample.saturated.contains(&true) {
            return;
        }
        let (mut offsets, mut slopes) = (sample.requested.n_m, [R::zero(); N]);
        for i in 0..N {
            slopes[i] = self.pid.slopes(&state.pid[i]).sum() * sample.reference.rad_s[i];
            offsets[i] -= slopes[i];
        }
        let factor = reference_factor(&offsets, &slopes, &sample.range, floor);
        sample.common_factor = factor;
        let less = R::one() - factor;
        for i in 0..N {
            let slope = self.pid.slopes(&state.pid[i]);
            let removed = less * sample.reference.rad_s[i];
            let terms = sample.terms(i);
            sample.write(
                i,
                &PidTerms {
                    p_n_m: terms.p_n_m - slope.p_n_m * removed,
                    i_n_m: terms.i_n_m - slope.i_n_m * removed,
                    d_n_m: terms.d_n_m - slope.d_n_m * removed,
                    ff_n_m: terms.ff_n_m - slope.ff_n_m * removed,
                },
            );
            sample.applied.n_m[i] -= less * slopes[i];
            taken_in[i] -= removed;
        }
    }
}

impl<R: Real, const N: usize> WheelSample<R, N> {
    fn terms(&self, i: usize) -> PidTerms<R> {
        PidTerms {
            p_n_m: self.p_n_m[i],
            i_n_m: self.i_n_m[i],
            d_n_m: self.d_n_m[i],
            ff_n_m: self.ff_n_m[i],
        }
    }

    fn write(&mut self, i: usize, terms: &PidTerms<R>) {
        self.p_n_m[i] = terms.p_n_m;
        self.i_n_m[i] = terms.i_n_m;
        self.d_n_m[i] = terms.d_n_m;
        self.ff_n_m[i] = terms.ff_n_m;
    }

    /// The reference the loop worked with.
    fn realised_reference(&self, i: usize, coordination: &Coordination<R>) -> R {
        match coordination.saturation {
            Saturation::ScaleReference { .. } => self.common_factor * self.reference.rad_s[i],
            _ => self.reference.rad_s[i],
        }
    }
}
