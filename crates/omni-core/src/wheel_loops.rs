//! The loops of all wheels: N PIDs and what they do together when one of them saturates.

#[cfg(test)]
mod tests;

use crate::coordination::{
    Coordination, Integral, Saturation, TorqueRanges, reference_factor, torque_factor,
};
use crate::error::ConfigError;
use crate::motor::TorqueLimits;
use crate::pid::is_plausible;
use crate::{AntiWindup, Pid, PidConfig, Real, TorqueLimit, WheelTorques, WheelVelocities};

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
    /// Integral term of each wheel \[N.m\].
    pub integral_n_m: [R; N],
    /// Derivative term of each wheel \[N.m\], after its filter.
    pub derivative_n_m: [R; N],
    /// Reference of the step before, as realised \[rad/s\].
    pub last_reference_rad_s: [R; N],
    /// Measurement of the step before \[rad/s\].
    pub last_measured_rad_s: [R; N],
    /// There was a step before.
    pub started: [bool; N],
}

impl<R: Real, const N: usize> Default for ControlState<R, N> {
    fn default() -> Self {
        let zero = [R::zero(); N];
        Self {
            integral_n_m: zero,
            derivative_n_m: zero,
            last_reference_rad_s: zero,
            last_measured_rad_s: zero,
            started: [false; N],
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
    pub range: TorqueRanges<R, N>,
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
    // The limits' numbers side by side: loops over wheels then run several at a time where the processor can.
    limits: TorqueLimits<R, N>,
    coordination: Coordination<R>,
}

/// What one step of the loops starts from.
pub(crate) struct LoopInputs<'a, R, const N: usize> {
    pub(crate) reference: &'a WheelVelocities<R, N>,
    pub(crate) measured: &'a WheelVelocities<R, N>,
    /// Wheels to be let go whatever they measure; none where nobody knows of any.
    pub(crate) dropped: Option<&'a [bool; N]>,
    /// Ranges that hold besides the actuators' own limits.
    pub(crate) within: Option<&'a TorqueRanges<R, N>>,
}

/// The parts of each wheel's torque \[N.m\].
struct Terms<R, const N: usize> {
    p: [R; N],
    i: [R; N],
    d: [R; N],
    ff: [R; N],
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
            limits: TorqueLimits::new(&config.limits),
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
        let rest = WheelVelocities::zero();
        let reference = if all_plausible(&reference.rad_s) {
            reference
        } else {
            &rest
        };
        self.run(
            state,
            &LoopInputs {
                reference,
                measured,
                dropped: None,
                within: None,
            },
            |errors| *errors,
        )
    }

    /// [`WheelController::step`] with ranges that hold besides the actuators' own limits: a torque table, a hot motor.
    ///
    /// Ends that are NaN, or on the wrong side of 0, stand for 0.
    ///
    /// ```
    /// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, TorqueRanges};
    /// use omni_core::{WheelControlConfig, WheelController};
    /// let gains = PidGains { kp_n_m_s_rad: 0.1_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// let wheels = WheelController::new(WheelControlConfig {
    ///     pid: PidConfig::new(gains, 1e-3),
    ///     limits: [TorqueLimit::constant(1.0)?; 2],
    ///     coordination: Coordination::independent(),
    /// })?;
    /// let hot = TorqueRanges { lower_n_m: [-0.5, -2.0], upper_n_m: [0.5, 2.0] };
    /// let sample = wheels.step_within(&mut ControlState::default(), &[20.0; 2].into(), &[0.0; 2].into(), &hot);
    /// assert_eq!(sample.applied.n_m, [0.5, 1.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step_within(
        &self,
        state: &mut ControlState<R, N>,
        reference: &WheelVelocities<R, N>,
        measured: &WheelVelocities<R, N>,
        ranges: &TorqueRanges<R, N>,
    ) -> WheelSample<R, N> {
        let rest = WheelVelocities::zero();
        let reference = if all_plausible(&reference.rad_s) {
            reference
        } else {
            &rest
        };
        self.run(
            state,
            &LoopInputs {
                reference,
                measured,
                dropped: None,
                within: Some(ranges),
            },
            |errors| *errors,
        )
    }

    /// A step whose integrals take in what `share` makes of the errors: linear, and the identity on the references.
    ///
    /// The usual case, every wheel there and none at its limit, is straight loops over the wheels; whatever else happens
    /// is in functions of its own.
    #[inline]
    pub(crate) fn run(
        &self,
        state: &mut ControlState<R, N>,
        inputs: &LoopInputs<'_, R, N>,
        share: impl Fn(&[R; N]) -> [R; N],
    ) -> WheelSample<R, N> {
        let (mut reference, mut measured) = (inputs.reference.rad_s, inputs.measured.rad_s);
        let mut active = [true; N];
        let mut range = self.limits.ranges(&measured);
        if inputs.dropped.is_some() || !all_plausible(&measured) {
            let_go(
                inputs.dropped,
                state,
                &mut reference,
                &mut measured,
                &mut active,
                &mut range,
            );
        }
        if let Some(within) = inputs.within {
            range.restrict(within);
        }

        let mut error = [R::zero(); N];
        for i in 0..N {
            error[i] = reference[i] - measured[i];
        }
        let mut taken_in = share(&error);
        if self.shares_integral() && active.contains(&false) {
            keep(&mut taken_in, &active);
        }
        let started = state.started;
        let mut terms = self.terms(state, &reference, &measured, &taken_in);
        let (mut requested, mut saturated, mut any) = ([R::zero(); N], [false; N], false);
        for i in 0..N {
            requested[i] = terms.p[i] + terms.i[i] + terms.d[i] + terms.ff[i];
            saturated[i] = requested[i] > range.upper_n_m[i] || requested[i] < range.lower_n_m[i];
        }
        for s in saturated {
            any |= s;
        }

        let mut common_factor = R::one();
        let mut applied = requested;
        let mut realised = reference;
        let (mut correction, mut derivative) = (None, None);
        if any {
            let mut excess = [R::zero(); N];
            match self.coordination.saturation {
                Saturation::Clip => {}
                Saturation::ScaleTorques => {
                    common_factor = torque_factor(&requested, &range);
                    for i in 0..N {
                        applied[i] = common_factor * requested[i];
                    }
                }
                Saturation::ScaleReference { floor } => {
                    let slopes = self.reference_slopes(&reference, &started);
                    common_factor = reference_factor(&requested, &slopes, &range, floor);
                    let less = R::one() - common_factor;
                    for i in 0..N {
                        let removed = less * reference[i];
                        taken_in[i] -= removed;
                        realised[i] -= removed;
                        applied[i] -= less * slopes[i];
                        // Every term is affine in the reference.
                        let slope = self.pid.term_slopes(started[i]);
                        terms.p[i] -= slope.p_n_m * removed;
                        terms.i[i] -= slope.i_n_m * removed;
                        terms.d[i] -= slope.d_n_m * removed;
                        terms.ff[i] -= slope.ff_n_m * removed;
                    }
                }
            }
            // Torque asked for by the terms as they are: what anti-windup compares with.
            let asked = if self.scales_reference() {
                applied
            } else {
                requested
            };
            let mut changed = false;
            for i in 0..N {
                applied[i] = range.clip(i, applied[i]);
                excess[i] = applied[i] - asked[i];
            }
            for e in excess {
                changed |= e != R::zero();
            }
            if changed {
                let mut d = terms.d;
                correction =
                    Some(self.condition(&taken_in, &excess, &started, &active, &mut d, &mut realised));
                derivative = Some(d);
            }
        }

        // Remember.
        let ki_dt = self.pid.integral_gain_dt();
        for i in 0..N {
            state.integral_n_m[i] += ki_dt * taken_in[i];
        }
        if let Some(correction) = &mut correction {
            if self.shares_integral() {
                *correction = share(correction);
                keep(correction, &active);
            }
            for i in 0..N {
                state.integral_n_m[i] += correction[i];
            }
        }
        self.hold_integrals(state);
        if self.pid.remembers() {
            state.derivative_n_m = derivative.unwrap_or(terms.d);
            state.last_reference_rad_s = realised;
            state.last_measured_rad_s = measured;
            state.started = active;
        }
        WheelSample {
            reference: WheelVelocities { rad_s: reference },
            measured: WheelVelocities { rad_s: measured },
            active,
            p_n_m: terms.p,
            i_n_m: terms.i,
            d_n_m: terms.d,
            ff_n_m: terms.ff,
            requested: WheelTorques { n_m: requested },
            applied: WheelTorques { n_m: applied },
            range,
            saturated,
            common_factor,
        }
    }

    fn scales_reference(&self) -> bool {
        matches!(self.coordination.saturation, Saturation::ScaleReference { .. })
    }

    /// The terms of every wheel for a reference; changes nothing.
    #[inline]
    fn terms(
        &self,
        state: &ControlState<R, N>,
        reference: &[R; N],
        measured: &[R; N],
        taken_in: &[R; N],
    ) -> Terms<R, N> {
        let zero = [R::zero(); N];
        let mut terms = Terms {
            p: zero,
            i: zero,
            d: zero,
            ff: zero,
        };
        for i in 0..N {
            terms.p[i] = self.pid.proportional(reference[i], measured[i]);
            terms.i[i] = self.pid.integral(state.integral_n_m[i], taken_in[i]);
        }
        if self.pid.remembers() {
            let (mut last_reference, mut last_measured) =
                (state.last_reference_rad_s, state.last_measured_rad_s);
            for i in 0..N {
                if !state.started[i] {
                    (last_reference[i], last_measured[i]) = (reference[i], measured[i]);
                }
            }
            for i in 0..N {
                let change =
                    self.pid
                        .weighted_change(reference[i], last_reference[i], measured[i], last_measured[i]);
                terms.d[i] = self.pid.derivative(state.derivative_n_m[i], change);
            }
            if self.pid.feeds_forward() {
                for i in 0..N {
                    terms.ff[i] = self.pid.feed_forward(reference[i], last_reference[i]);
                }
            }
        }
        terms
    }

    /// Torque that each wheel's whole reference adds \[N.m\].
    fn reference_slopes(&self, reference: &[R; N], started: &[bool; N]) -> [R; N] {
        let mut slopes = *reference;
        for (slope, &started) in slopes.iter_mut().zip(started) {
            *slope *= self.pid.slope(started);
        }
        slopes
    }

    /// Anti-windup for torques that were changed by `excess`: what to add to the integrals, with derivative and reference
    /// brought to what was realised.
    #[inline(never)]
    fn condition(
        &self,
        taken_in: &[R; N],
        excess: &[R; N],
        started: &[bool; N],
        active: &[bool; N],
        derivative: &mut [R; N],
        realised: &mut [R; N],
    ) -> [R; N] {
        // The law is a conditioned controller: what its floor leaves over is conditioned too, wheel by wheel.
        let law = if self.scales_reference() {
            AntiWindup::Conditioned
        } else {
            self.pid.anti_windup()
        };
        let mut correction = [R::zero(); N];
        for i in 0..N {
            if active[i] {
                correction[i] = self.pid.correction(law, taken_in[i], excess[i], started[i]);
                let shift = self.pid.shift(law, excess[i], started[i]);
                derivative[i] += self.pid.derivative_slope(started[i]) * shift;
                realised[i] += shift;
            }
        }
        correction
    }

    /// Integrals held where [`AntiWindup::Clamp`] says so; shared ones by one factor for all, because cut one by one they
    /// would leave the range of the kinematics.
    #[inline]
    fn hold_integrals(&self, state: &mut ControlState<R, N>) {
        let AntiWindup::Clamp { limit_n_m } = self.pid.anti_windup() else {
            return;
        };
        if !self.shares_integral() {
            state.integral_n_m = state.integral_n_m.map(|i| i.limited(-limit_n_m, limit_n_m));
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

/// Every number is something a sensor or a command can mean.
#[inline]
fn all_plausible<R: Real, const N: usize>(values: &[R; N]) -> bool {
    let mut all = true;
    for &value in values {
        all &= is_plausible(value);
    }
    all
}

/// Zero where a wheel is not active.
fn keep<R: Real, const N: usize>(values: &mut [R; N], active: &[bool; N]) {
    for (value, &active) in values.iter_mut().zip(active) {
        if !active {
            *value = R::zero();
        }
    }
}

/// Lets wheels go that are dropped or measure nonsense: all their numbers are zero, so that they have no say in any common
/// factor.
#[inline(never)]
fn let_go<R: Real, const N: usize>(
    dropped: Option<&[bool; N]>,
    state: &mut ControlState<R, N>,
    reference: &mut [R; N],
    measured: &mut [R; N],
    active: &mut [bool; N],
    range: &mut TorqueRanges<R, N>,
) {
    let zero = R::zero();
    for i in 0..N {
        if dropped.is_some_and(|dropped| dropped[i]) || !is_plausible(measured[i]) {
            active[i] = false;
            (reference[i], measured[i]) = (zero, zero);
            (range.lower_n_m[i], range.upper_n_m[i]) = (zero, zero);
            (state.integral_n_m[i], state.derivative_n_m[i], state.started[i]) = (zero, zero, false);
        }
    }
}
