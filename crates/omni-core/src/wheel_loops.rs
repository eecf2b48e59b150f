//! The loops of all wheels: N PIDs and what they do together when one of them saturates.

#[cfg(test)]
mod tests;

use crate::constants::constant_struct;
use crate::coordination::{
    Coordination, Integral, Saturation, TorqueRanges, reference_factor, torque_factor,
};
use crate::error::ConfigError;
use crate::motor::TorqueLimits;
use crate::pid::is_plausible;
use crate::{AntiWindup, Pid, PidConfig, Real, TorqueLimit, WheelTorques, WheelVelocities};

/// Everything that the loops of `N` wheels need to know; checked by [`WheelController::new`] or
/// [`crate::Controller::new`].
///
/// ```
/// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig, WheelController};
/// let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let wheels = WheelController::new(WheelControlConfig {
///     pid: PidConfig::new(gains, 1e-3),
///     limits: [TorqueLimit::constant(1.0)?, TorqueLimit::constant(0.5)?], // one loop, two motors
///     coordination: Coordination::independent(),
/// })?;
/// let sample = wheels.step(&mut ControlState::default(), &[8.0, -8.0].into(), &[0.0; 2].into());
/// assert_eq!(sample.applied.n_m, [1.0, -0.5]); // 0.25 * 8 is too much for either
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelControlConfig<R, const N: usize> {
    /// The loop, the same for every wheel. Its `output` limits are ignored: the actuators' count.
    pub pid: PidConfig<R>,
    /// Torque limit of each actuator.
    pub limits: [TorqueLimit<R>; N],
    /// What the wheels do together.
    pub coordination: Coordination<R>,
}

/// What the loops remember between steps; `default` is a fresh start.
///
/// ```
/// use omni_core::{ControlState, WheelController};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.0, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 2], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 0.25), limits, coordination };
/// let wheels = WheelController::new(config)?;
/// let mut state = ControlState::default();
/// for _ in 0..2 {
///     wheels.step(&mut state, &[1.0, 0.5].into(), &[0.0; 2].into());
/// }
/// assert_eq!(state.integral_n_m, [2.0 * 0.25 * 2.0, 2.0 * 0.25 * 1.0]); // ki dt times the sum of the errors
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
#[repr(C)]
pub struct ControlState<R, const N: usize> {
    /// Integral term of each wheel \[N.m\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub integral_n_m: [R; N],
    /// Derivative term of each wheel \[N.m\], after its filter.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub derivative_n_m: [R; N],
    /// Reference of the step before, as realised \[rad/s\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub last_reference_rad_s: [R; N],
    /// Measurement of the step before \[rad/s\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub last_measured_rad_s: [R; N],
    /// There was a step before.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub started: [bool; N],
}

impl<R: Real, const N: usize> Default for ControlState<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real, const N: usize> ControlState<R, N> {
    /// A fresh start, for a `static` too.
    ///
    /// ```
    /// use omni_core::ControlState;
    /// static STATE: ControlState<f32, 7> = ControlState::new();
    /// assert_eq!((STATE, STATE.integral_n_m), (ControlState::default(), [0.0; 7]));
    /// ```
    #[must_use]
    pub const fn new() -> Self {
        let zero = [R::ZERO; N];
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
///
/// ```
/// use omni_core::{ControlState, WheelController};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.5, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 2], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 0.125), limits, coordination };
/// let wheels = WheelController::new(config)?;
/// let sample = wheels.step(&mut ControlState::default(), &[2.0, 8.0].into(), &[0.0, 0.0].into());
/// assert_eq!((sample.p_n_m[0], sample.i_n_m[0]), (0.5 * 2.0, 2.0 * 0.125 * 2.0));
/// assert_eq!(sample.requested.n_m, [1.5, 6.0]);
/// assert_eq!((sample.applied.n_m, sample.saturated), ([1.5, 2.0], [false, true])); // limits of 2 N.m
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
#[repr(C)]
pub struct WheelSample<R, const N: usize> {
    /// Reference r as commanded, before any reduction.
    pub reference: WheelVelocities<R, N>,
    /// Measurement y; 0 for a wheel that is not `active`.
    pub measured: WheelVelocities<R, N>,
    /// The wheel was controlled. One without a usable measurement is let go: no torque, its loop starts afresh.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub active: [bool; N],
    /// Proportional term, formed with the reference as reduced by `common_factor` under [`Saturation::ScaleReference`].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub p_n_m: [R; N],
    /// Integral term, likewise.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub i_n_m: [R; N],
    /// Derivative term, likewise.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub d_n_m: [R; N],
    /// Feed-forward, likewise.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub ff_n_m: [R; N],
    /// Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
    pub requested: WheelTorques<R, N>,
    /// Torque to apply, always within the limits.
    pub applied: WheelTorques<R, N>,
    /// Limits at the present velocities.
    pub range: TorqueRanges<R, N>,
    /// The requested torque is outside the limits.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct WheelController<R, const N: usize> {
    pid: Pid<R>,
    // The limits' numbers side by side: loops over wheels then run several at a time where the processor can.
    limits: TorqueLimits<R, N>,
    coordination: Coordination<R>,
}

constant_struct!(WheelController<R, const N> { pid: Pid<R>, limits: TorqueLimits<R, N>, coordination: Coordination<R> });

/// What one step of the loops starts from.
pub(crate) struct LoopInputs<'a, R, const N: usize> {
    pub(crate) reference: &'a WheelVelocities<R, N>,
    pub(crate) measured: &'a WheelVelocities<R, N>,
    /// Wheels to be let go whatever they measure; none where nobody knows of any.
    pub(crate) dropped: Option<&'a [bool; N]>,
    /// Ranges that hold besides the actuators' own limits.
    pub(crate) within: Option<&'a TorqueRanges<R, N>>,
}

impl<R: Real, const N: usize> WheelSample<R, N> {
    /// At rest, to be written to by [`WheelController::step_into`]: all zero but the common factor, which is 1.
    ///
    /// ```
    /// use omni_core::WheelSample;
    /// let sample = WheelSample::<f32, 3>::zero();
    /// assert_eq!((sample.applied.n_m, sample.active, sample.common_factor), ([0.0; 3], [false; 3], 1.0));
    /// ```
    #[must_use]
    pub const fn zero() -> Self {
        let zero = [R::ZERO; N];
        Self {
            reference: WheelVelocities { rad_s: zero },
            measured: WheelVelocities { rad_s: zero },
            active: [false; N],
            p_n_m: zero,
            i_n_m: zero,
            d_n_m: zero,
            ff_n_m: zero,
            requested: WheelTorques { n_m: zero },
            applied: WheelTorques { n_m: zero },
            range: TorqueRanges {
                lower_n_m: zero,
                upper_n_m: zero,
            },
            saturated: [false; N],
            common_factor: R::ONE,
        }
    }
}

impl<R: Real, const N: usize> WheelController<R, N> {
    /// Loops as configured.
    ///
    /// # Errors
    /// Those of [`Pid::new`]; `floor` outside 0 to 1; parameter `integral` for [`Integral::Shared`], which needs the
    /// layout that a [`crate::Controller`] has.
    ///
    /// ```
    /// use omni_core::{Integral, WheelController};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 2], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let coordination = Coordination { integral: Integral::Shared, ..Coordination::independent() };
    /// let error = WheelController::new(WheelControlConfig { coordination, ..config }).unwrap_err();
    /// assert_eq!((error.parameter, error.value), ("integral", 1.0)); // no vehicle, no motion to share
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
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

    /// One step: torques \[N.m\] that bring the velocities `measured` to `reference` \[rad/s\]. To be called once every
    /// control period. O(N).
    ///
    /// A reference that is not finite, or beyond 1e6 rad/s, stands for rest of all wheels; a measurement that is not
    /// lets its wheel go.
    ///
    /// ```
    /// use omni_core::{ControlState, WheelController};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.5, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 2], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let wheels = WheelController::new(config)?;
    /// let mut state = ControlState::default();
    /// assert_eq!(wheels.step(&mut state, &[3.0, 0.0].into(), &[0.0, 1.0].into()).applied.n_m, [1.5, -0.5]);
    /// // A broken encoder costs its own wheel only, a broken reference stops all.
    /// assert_eq!(wheels.step(&mut state, &[3.0, 0.0].into(), &[f64::NAN, 1.0].into()).applied.n_m, [0.0, -0.5]);
    /// assert_eq!(wheels.step(&mut state, &[f64::NAN, 3.0].into(), &[1.0, 1.0].into()).applied.n_m, [-0.5, -0.5]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step(
        &self,
        state: &mut ControlState<R, N>,
        reference: &WheelVelocities<R, N>,
        measured: &WheelVelocities<R, N>,
    ) -> WheelSample<R, N> {
        let mut sample = WheelSample::zero();
        self.step_into(state, reference, measured, &mut sample);
        sample
    }

    /// [`WheelController::step`] into a sample that is there already: nothing is copied, for the smallest of processors.
    ///
    /// ```
    /// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// use omni_core::{WheelController, WheelSample};
    /// let gains = PidGains { kp_n_m_s_rad: 0.5_f32, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// let wheels = WheelController::new(WheelControlConfig {
    ///     pid: PidConfig::new(gains, 1e-3),
    ///     limits: [TorqueLimit::constant(1.0)?; 3],
    ///     coordination: Coordination::synchronised(),
    /// })?;
    /// let (mut state, mut sample) = (ControlState::default(), WheelSample::zero());
    /// wheels.step_into(&mut state, &[1.0; 3].into(), &[0.0; 3].into(), &mut sample);
    /// assert_eq!(sample.applied.n_m, [0.5; 3]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step_into(
        &self,
        state: &mut ControlState<R, N>,
        reference: &WheelVelocities<R, N>,
        measured: &WheelVelocities<R, N>,
        sample: &mut WheelSample<R, N>,
    ) {
        self.step_with(state, reference, measured, None, sample);
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
        let mut sample = WheelSample::zero();
        self.step_with(state, reference, measured, Some(ranges), &mut sample);
        sample
    }

    /// A step of loops without a vehicle: nothing is shared, and nobody has looked at the references yet.
    #[inline]
    fn step_with(
        &self,
        state: &mut ControlState<R, N>,
        reference: &WheelVelocities<R, N>,
        measured: &WheelVelocities<R, N>,
        within: Option<&TorqueRanges<R, N>>,
        sample: &mut WheelSample<R, N>,
    ) {
        let rest = WheelVelocities::zero();
        let reference = if all_plausible(&reference.rad_s) {
            reference
        } else {
            &rest
        };
        let inputs = LoopInputs {
            reference,
            measured,
            dropped: None,
            within,
        };
        self.run(state, &inputs, None::<fn(&[R; N]) -> [R; N]>, sample);
    }

    /// A step whose integrals take in what `share` makes of the errors, each wheel its own where there is none. `share` is
    /// linear, and the identity on the references.
    ///
    /// The usual case, every wheel there and none at its limit, is straight loops over the wheels that write where the
    /// result is wanted; whatever else happens is in functions of its own.
    #[inline]
    pub(crate) fn run(
        &self,
        state: &mut ControlState<R, N>,
        inputs: &LoopInputs<'_, R, N>,
        share: Option<impl Fn(&[R; N]) -> [R; N]>,
        out: &mut WheelSample<R, N>,
    ) {
        out.reference = *inputs.reference;
        out.measured = *inputs.measured;
        out.active = [true; N];
        out.common_factor = R::one();
        self.limits.ranges(&out.measured.rad_s, &mut out.range);
        if inputs.dropped.is_some() || !all_plausible(&out.measured.rad_s) {
            let_go(inputs.dropped, state, out);
        }
        if let Some(within) = inputs.within {
            out.range.restrict(within);
        }

        let mut taken_in = [R::zero(); N];
        for i in 0..N {
            taken_in[i] = out.reference.rad_s[i] - out.measured.rad_s[i];
        }
        if let Some(share) = &share {
            taken_in = share(&taken_in);
            keep(&mut taken_in, &out.active);
        }
        self.write_terms(state, &taken_in, out);
        let mut any = false;
        let (mut requested, mut saturated) = ([R::zero(); N], [false; N]);
        for i in 0..N {
            requested[i] = out.p_n_m[i] + out.i_n_m[i];
        }
        if self.pid.remembers() {
            for i in 0..N {
                requested[i] += out.d_n_m[i] + out.ff_n_m[i];
            }
        }
        for i in 0..N {
            // NaN, which only a state set from outside brings, is not inside.
            let inside = requested[i] <= out.range.upper_n_m[i] && requested[i] >= out.range.lower_n_m[i];
            saturated[i] = !inside;
        }
        for s in saturated {
            any |= s;
        }
        (out.requested.n_m, out.applied.n_m, out.saturated) = (requested, requested, saturated);

        let ki_dt = self.pid.integral_gain_dt();
        if any {
            let mut sum = R::zero();
            for torque in out.requested.n_m {
                sum += torque;
            }
            if !sum.is_finite_real() {
                start_afresh_where_not_finite(state, &mut taken_in, out);
            }
            let mut correction = [R::zero(); N];
            let corrected = self.limit(state, &mut taken_in, out, &mut correction);
            if let Some(share) = &share
                && corrected
            {
                correction = share(&correction);
                keep(&mut correction, &out.active);
            }
            for i in 0..N {
                state.integral_n_m[i] += ki_dt * taken_in[i] + correction[i];
            }
        } else {
            for i in 0..N {
                state.integral_n_m[i] += ki_dt * taken_in[i];
            }
            if self.pid.remembers() {
                (state.derivative_n_m, state.last_reference_rad_s) = (out.d_n_m, out.reference.rad_s);
            }
        }
        if self.pid.remembers() {
            (state.last_measured_rad_s, state.started) = (out.measured.rad_s, out.active);
        }
        self.hold_integrals(state);
    }

    /// Brings the requested torques of `out` within the limits by the law of the coordination. What anti-windup adds to the
    /// integrals goes to `correction`, which is zero, and the derivative and reference to remember go to `state`. True where
    /// there is a correction.
    #[inline(never)]
    fn limit(
        &self,
        state: &mut ControlState<R, N>,
        taken_in: &mut [R; N],
        out: &mut WheelSample<R, N>,
        correction: &mut [R; N],
    ) -> bool {
        let mut realised = out.reference.rad_s;
        // Torque asked for by the terms as they are in the end: what anti-windup compares with.
        let mut asked = out.requested.n_m;
        match self.coordination.saturation {
            Saturation::Clip => {}
            Saturation::ScaleTorques => {
                out.common_factor = torque_factor(&out.requested.n_m, &out.range);
                for torque in &mut out.applied.n_m {
                    *torque *= out.common_factor;
                }
            }
            Saturation::ScaleReference { floor } => {
                // Every term is affine in the reference; what is compared with moves along in a wheel's first step.
                let fresh = self.pid.remembers() && state.started.contains(&false);
                let later = self.pid.term_slopes(true);
                let slope = |i: usize| {
                    if fresh {
                        self.pid.term_slopes(state.started[i])
                    } else {
                        later
                    }
                };
                let mut slopes = realised;
                for i in 0..N {
                    slopes[i] *= slope(i).sum();
                }
                out.common_factor = reference_factor(&out.requested.n_m, &slopes, &out.range, floor);
                let less = R::one() - out.common_factor;
                for i in 0..N {
                    let removed = less * realised[i];
                    taken_in[i] -= removed;
                    realised[i] -= removed;
                    asked[i] -= less * slopes[i];
                    out.p_n_m[i] -= slope(i).p_n_m * removed;
                    out.i_n_m[i] -= slope(i).i_n_m * removed;
                }
                if self.pid.remembers() {
                    for i in 0..N {
                        let removed = less * out.reference.rad_s[i];
                        out.d_n_m[i] -= slope(i).d_n_m * removed;
                        out.ff_n_m[i] -= slope(i).ff_n_m * removed;
                    }
                }
                out.applied.n_m = asked;
            }
        }
        if self.pid.remembers() {
            (state.derivative_n_m, state.last_reference_rad_s) = (out.d_n_m, realised);
        }
        let mut excess = [R::zero(); N];
        let mut changed = false;
        for i in 0..N {
            let applied = out.range.clip(i, out.applied.n_m[i]);
            out.applied.n_m[i] = applied;
            excess[i] = applied - asked[i];
        }
        for e in excess {
            changed |= e != R::zero();
        }
        if changed {
            self.condition(state, taken_in, &excess, &out.active, correction);
        }
        changed
    }

    /// Anti-windup for torques that were changed by `excess`: what to add to the integrals, with the derivative and reference
    /// of `state` brought to what was realised.
    #[inline(never)]
    fn condition(
        &self,
        state: &mut ControlState<R, N>,
        taken_in: &[R; N],
        excess: &[R; N],
        active: &[bool; N],
        correction: &mut [R; N],
    ) {
        // A conditioned controller to the end: what the floor leaves over is conditioned too, wheel by wheel.
        let law = match self.coordination.saturation {
            Saturation::ScaleReference { .. } => AntiWindup::Conditioned,
            _ => self.pid.anti_windup(),
        };
        if law == AntiWindup::Conditional && self.shares_integral() {
            // Shared, the motion as a whole goes on integrating or does not: stopped wheel by wheel and projected, most of
            // what was stopped would come back.
            let mut outwards = R::zero();
            for i in 0..N {
                outwards += excess[i] * taken_in[i];
            }
            if outwards < R::zero() {
                *correction = taken_in.map(|taken_in| -self.pid.integral_gain_dt() * taken_in);
            }
            return;
        }
        for i in 0..N {
            if active[i] {
                let started = state.started[i];
                correction[i] = self.pid.correction(law, taken_in[i], excess[i], started);
                if self.pid.remembers() {
                    let shift = self.pid.shift(law, excess[i], started);
                    state.derivative_n_m[i] += self.pid.derivative_slope(started) * shift;
                    state.last_reference_rad_s[i] += shift;
                }
            }
        }
    }

    /// Writes the terms of every wheel for its reference and measurement.
    #[inline]
    fn write_terms(&self, state: &ControlState<R, N>, taken_in: &[R; N], out: &mut WheelSample<R, N>) {
        for i in 0..N {
            out.p_n_m[i] = self
                .pid
                .proportional(out.reference.rad_s[i], out.measured.rad_s[i]);
            out.i_n_m[i] = self.pid.integral(state.integral_n_m[i], taken_in[i]);
        }
        (out.d_n_m, out.ff_n_m) = ([R::zero(); N], [R::zero(); N]);
        if !self.pid.remembers() {
            return;
        }
        let (mut last_reference, mut last_measured) = (state.last_reference_rad_s, state.last_measured_rad_s);
        for i in 0..N {
            if !state.started[i] {
                (last_reference[i], last_measured[i]) = (out.reference.rad_s[i], out.measured.rad_s[i]);
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

    /// Integrals held where [`AntiWindup::Clamp`] says so; shared ones by one factor for all, because cut one by one they
    /// would leave the range of the kinematics.
    #[inline]
    fn hold_integrals(&self, state: &mut ControlState<R, N>) {
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

/// Loops whose torque is not a number, because their state was set to nonsense, give nothing and start afresh.
#[inline(never)]
fn start_afresh_where_not_finite<R: Real, const N: usize>(
    state: &mut ControlState<R, N>,
    taken_in: &mut [R; N],
    out: &mut WheelSample<R, N>,
) {
    let zero = R::zero();
    for i in 0..N {
        if !out.requested.n_m[i].is_finite_real() {
            (state.integral_n_m[i], state.derivative_n_m[i], state.started[i]) = (zero, zero, false);
            (out.p_n_m[i], out.i_n_m[i], out.d_n_m[i], out.ff_n_m[i]) = (zero, zero, zero, zero);
            (out.requested.n_m[i], out.applied.n_m[i], taken_in[i]) = (zero, zero, zero);
            (out.reference.rad_s[i], out.active[i]) = (zero, false);
        }
    }
}

/// Lets wheels go that are dropped or measure nonsense: all their numbers are zero, so that they have no say in any common
/// factor.
#[inline(never)]
fn let_go<R: Real, const N: usize>(
    dropped: Option<&[bool; N]>,
    state: &mut ControlState<R, N>,
    out: &mut WheelSample<R, N>,
) {
    let zero = R::zero();
    for i in 0..N {
        if dropped.is_some_and(|dropped| dropped[i]) || !is_plausible(out.measured.rad_s[i]) {
            out.active[i] = false;
            (out.reference.rad_s[i], out.measured.rad_s[i]) = (zero, zero);
            (out.range.lower_n_m[i], out.range.upper_n_m[i]) = (zero, zero);
            (state.integral_n_m[i], state.derivative_n_m[i], state.started[i]) = (zero, zero, false);
        }
    }
}
