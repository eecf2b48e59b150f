//! The loops of all wheels: PID and coordination, at a torque limit and at rest.

mod overload;
mod rest;
mod sample;
#[cfg(test)]
mod tests;

use crate::constants::constant_struct;
use crate::geometry::WheelVelocities;
use crate::loops::coordination::{Coordination, Integral};
use crate::loops::law::Law;
use crate::loops::pid::Pid;
use crate::motor::{TorqueLimits, TorqueRanges};
use crate::scalar::{all_plausible, is_plausible};
use crate::{ConfigError, Real};
pub use overload::Overload;
pub(crate) use rest::RestState;
use rest::is_rest;
pub use rest::{Rest, RestRule};
pub use sample::{ControlState, WheelControlConfig, WheelSample};

/// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
///
/// ```
/// use omni_core::loops::WheelController;
/// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// let gains = PidGains { kp_n_m_s_rad: 0.1_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let wheels = WheelController::new(WheelControlConfig {
///     pid: PidConfig::new(gains, 1e-3),
///     limits: [TorqueLimit::constant(1.0)?; 2],
///     coordination: Coordination::scale_torques(),
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
    rest: RestRule<R>,
}

constant_struct!(WheelController<R, const N> {
    pid: Pid<R>,
    limits: TorqueLimits<R, N>,
    coordination: Coordination<R>,
    rest: RestRule<R>,
});

/// The input of one step of the loops.
pub(crate) struct LoopInputs<'a, R, const N: usize> {
    pub(crate) reference: &'a WheelVelocities<R, N>,
    pub(crate) measured: &'a WheelVelocities<R, N>,
    /// Wheels to be released whatever they measure; none if none is known.
    pub(crate) dropped: Option<&'a [bool; N]>,
    /// Ranges that hold besides the actuators' own limits.
    pub(crate) within: Option<&'a TorqueRanges<R, N>>,
    /// Rest may be held.
    pub(crate) holds: bool,
}

impl<R: Real, const N: usize> WheelController<R, N> {
    /// Loops as configured.
    ///
    /// # Errors
    /// As [`Pid::new`]; `floor` outside 0 to 1; parameter `integral` for [`Integral::Shared`], which needs the layout
    /// of a [`crate::loops::Controller`].
    pub fn new(config: WheelControlConfig<R, N>) -> Result<Self, ConfigError> {
        if config.coordination.integral == Integral::Shared {
            let allowed = "per wheel (0): wheels without a vehicle cannot share an integral";
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
            rest: RestRule::usual(config.pid.period_s),
        })
    }

    /// The same loops, whose torque ends as `rest` says instead of [`Rest::default`].
    ///
    /// # Errors
    /// Parameters `rest.bleed_s`, `rest.hold_s`, `rest.hold_torque_squared_n2m2s` outside their ranges.
    ///
    /// ```
    /// use omni_core::loops::{Rest, WheelController};
    /// # let config = omni_core::examples::loops::<2>(0.3, 0.0, 2.0)?;
    /// let wheels = WheelController::new(config)?;
    /// assert!(wheels.with_rest(Rest::hold(30.0, 5.0)).is_ok());
    /// let for_ever = wheels.with_rest(Rest::hold(f64::INFINITY, 5.0)).unwrap_err();
    /// assert_eq!((for_ever.parameter, for_ever.allowed), ("rest.hold_s", "0 to 3600"));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn with_rest(self, rest: Rest<R>) -> Result<Self, ConfigError> {
        Ok(Self {
            rest: RestRule::new(rest, self.rest.period_s())?,
            ..self
        })
    }

    /// Whether the windings of the motors are to be shorted when the torque has ended. [`Rest::short_windings`].
    ///
    /// ```
    /// use omni_core::loops::{Rest, WheelController};
    /// # let config = omni_core::examples::loops::<2>(0.3, 0.0, 2.0)?;
    /// let mut rest = Rest::default();
    /// rest.short_windings = true;
    /// let wheels = WheelController::new(config)?;
    /// let shorted = wheels.with_rest(rest)?;
    /// assert_eq!([wheels, shorted].map(|wheels| u8::from(wheels.shorts_at_rest())), [0, 1]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn shorts_at_rest(&self) -> bool {
        self.rest.shorts()
    }

    pub(crate) fn rest(&self) -> RestRule<R> {
        self.rest
    }

    pub(crate) fn shares_integral(&self) -> bool {
        self.coordination.integral == Integral::Shared
    }

    /// One step: torques \[N.m\] that bring the velocities `measured` to `reference` \[rad/s\]. To be called once every
    /// control period. O(N).
    ///
    /// A reference that is not finite, or beyond 1e6 rad/s, stands for rest of all wheels; a measurement that is not
    /// releases its wheel.
    ///
    /// ```
    /// use omni_core::loops::WheelController;
    /// use omni_core::ControlState;
    /// # let config = omni_core::examples::loops(0.5, 0.0, 2.0)?;
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

    /// [`WheelController::step`] into a sample that is there already: nothing is copied, for the
    /// smallest of processors.
    ///
    /// ```
    /// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// use omni_core::loops::{WheelController, WheelSample};
    /// let gains = PidGains { kp_n_m_s_rad: 0.5_f32, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// let wheels = WheelController::new(WheelControlConfig {
    ///     pid: PidConfig::new(gains, 1e-3),
    ///     limits: [TorqueLimit::constant(1.0)?; 3],
    ///     coordination: Coordination::scale_references(),
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
    /// use omni_core::motor::TorqueRanges;
    /// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit};
    /// use omni_core::loops::WheelController;
    /// use omni_core::WheelControlConfig;
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

    /// A step of loops without a vehicle: nothing is shared, and the references are not checked yet.
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
            holds: true,
        };
        self.run(state, &inputs, None::<fn(&[R; N]) -> [R; N]>, sample);
    }

    /// A step whose integrals take in what `share` makes of the errors, as in the law of the loops.
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
        (out.ended, out.shorted) = (false, false);
        self.limits.ranges(&out.measured.rad_s, &mut out.range);
        let some_released = inputs.dropped.is_some() || !all_plausible(&out.measured.rad_s);
        if some_released {
            release_wheels(inputs.dropped, state, out);
        }
        if let Some(within) = inputs.within {
            out.range.restrict(within);
        }
        if self.rest.shrinks(&state.rest) && is_rest(inputs.reference) {
            let rest = self.rest.where_held(inputs.holds);
            if rest.is_over(&state.rest) {
                stand(state, rest.shorts(), out);
                return;
            }
            rest.narrow(&state.rest, &mut out.range);
        }

        let law = Law {
            pid: &self.pid,
            coordination: &self.coordination,
        };
        law.step(state, share, some_released, true, out);
        if is_rest(inputs.reference) {
            let rest = self.rest.where_held(inputs.holds);
            rest.step(&mut state.rest, &mut state.integral_n_m, &out.applied.n_m);
        } else {
            self.rest.drive(&mut state.rest);
        }
    }
}

/// No torque, whatever is measured, and loops that start afresh when a reference is not 0 again.
#[inline(never)]
fn stand<R: Real, const N: usize>(state: &mut ControlState<R, N>, short: bool, out: &mut WheelSample<R, N>) {
    let zero = R::zero();
    // Number by number: whole structures are copied by a function that is larger than all of this.
    for i in 0..N {
        (state.integral_n_m[i], state.derivative_n_m[i], state.started[i]) = (zero, zero, false);
        (state.last_reference_rad_s[i], state.last_measured_rad_s[i]) = (zero, zero);
    }
    state.overload = Overload::new();
    out.end(short);
}

/// Releases wheels that are dropped or measure nonsense: all their numbers are zero, so that they
/// are excluded from any common factor.
#[inline(never)]
fn release_wheels<R: Real, const N: usize>(
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
