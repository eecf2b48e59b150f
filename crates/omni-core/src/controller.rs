//! One control step: command to torques, with every intermediate signal in the sample it returns.

use crate::coordination::{Coordination, Integral, Saturation, TorqueRange, reference_factor, torque_factor};
use crate::error::ConfigError;
use crate::{BodyTwist, ForwardMap, Kinematics, Pid, PidGains, PidState, Real, TorqueLimit, WheelLayout};

/// Everything that the loops of `N` wheels need to know; validated by [`WheelController::new`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelControlConfig<R, const N: usize> {
    /// Gains, the same for every wheel.
    pub gains: PidGains<R>,
    /// Control period \[s\], > 0. The step must be called exactly this often.
    pub period_s: R,
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
/// actuators'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSample<R, const N: usize> {
    /// Reference r as commanded, before any reduction.
    pub reference_rad_s: [R; N],
    /// Measurement y.
    pub measured_rad_s: [R; N],
    /// Proportional term, formed with the reference as reduced by `common_factor` under [`Saturation::ScaleReference`].
    pub p_n_m: [R; N],
    /// Integral term, likewise.
    pub i_n_m: [R; N],
    /// Derivative term, likewise.
    pub d_n_m: [R; N],
    /// Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
    pub requested_n_m: [R; N],
    /// Torque to apply, always within the limits.
    pub applied_n_m: [R; N],
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
/// use omni_core::{ControlState, Coordination, PidGains, TorqueLimit, WheelControlConfig, WheelController};
/// let wheels = WheelController::new(WheelControlConfig {
///     gains: PidGains { kp_n_m_s_rad: 0.1_f64, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 },
///     period_s: 1e-3,
///     limits: [TorqueLimit::constant(1.0)?; 2],
///     coordination: Coordination::paper(),
/// })?;
/// let sample = wheels.step(&mut ControlState::default(), &[20.0, -10.0], &[0.0, 0.0]);
/// assert_eq!(sample.requested_n_m, [2.0, -1.0]);
/// assert_eq!(sample.applied_n_m, [1.0, -0.5]); // both halved: the ratio is kept
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelController<R, const N: usize> {
    pid: Pid<R>,
    limits: [TorqueLimit<R>; N],
    coordination: Coordination<R>,
}

impl<R: Real, const N: usize> WheelController<R, N> {
    /// Loops as configured.
    ///
    /// # Errors
    /// The gain, period or floor that is out of range; parameter `integral` for [`Integral::Shared`], which needs the
    /// layout that a [`Controller`] has.
    pub fn new(config: WheelControlConfig<R, N>) -> Result<Self, ConfigError> {
        if config.coordination.integral == Integral::Shared {
            return Err(ConfigError::new(
                "integral",
                1.0,
                "per wheel (0): wheels without a vehicle share no motion",
            ));
        }
        Self::with_layout(config)
    }

    fn with_layout(config: WheelControlConfig<R, N>) -> Result<Self, ConfigError> {
        config.coordination.check()?;
        let WheelControlConfig {
            gains,
            period_s,
            limits,
            coordination,
        } = config;
        Ok(Self {
            pid: Pid::new(gains, period_s)?,
            limits,
            coordination,
        })
    }

    /// One step: torques that bring `measured_rad_s` to `reference_rad_s`.
    pub fn step(
        &self,
        state: &mut ControlState<R, N>,
        reference_rad_s: &[R; N],
        measured_rad_s: &[R; N],
    ) -> WheelSample<R, N> {
        self.step_integrating(state, reference_rad_s, measured_rad_s, |errors| *errors)
    }

    /// A step whose integrals take in what `integrated` makes of the errors. `integrated` must be linear.
    fn step_integrating(
        &self,
        state: &mut ControlState<R, N>,
        reference: &[R; N],
        measured: &[R; N],
        integrated: impl Fn(&[R; N]) -> [R; N],
    ) -> WheelSample<R, N> {
        let mut range = [TorqueRange {
            lower_n_m: R::zero(),
            upper_n_m: R::zero(),
        }; N];
        for ((range, limit), &velocity) in range.iter_mut().zip(&self.limits).zip(measured) {
            (range.lower_n_m, range.upper_n_m) = limit.range(velocity);
        }
        let zero = [R::zero(); N];
        let mut sample = WheelSample {
            reference_rad_s: *reference,
            measured_rad_s: *measured,
            p_n_m: zero,
            i_n_m: zero,
            d_n_m: zero,
            requested_n_m: zero,
            applied_n_m: zero,
            range,
            saturated: [false; N],
            common_factor: R::one(),
        };

        let mut error = self.form_terms(state, &mut sample, R::one(), &integrated);
        for i in 0..N {
            sample.requested_n_m[i] = sample.p_n_m[i] + sample.i_n_m[i] + sample.d_n_m[i];
            sample.saturated[i] = range[i].exceeded_by(sample.requested_n_m[i]);
        }
        sample.applied_n_m = sample.requested_n_m;
        match self.coordination.saturation {
            Saturation::Clip => {}
            Saturation::ScaleTorques => {
                sample.common_factor = torque_factor(&sample.requested_n_m, &range);
                for torque in &mut sample.applied_n_m {
                    *torque *= sample.common_factor;
                }
            }
            Saturation::ScaleReference { floor } => {
                let slopes = self.slopes(state, reference, &integrated);
                let mut offsets = sample.requested_n_m;
                for (offset, slope) in offsets.iter_mut().zip(&slopes) {
                    *offset -= *slope;
                }
                let factor = reference_factor(&offsets, &slopes, &range, floor);
                sample.common_factor = factor;
                if factor < R::one() {
                    error = self.form_terms(state, &mut sample, factor, &integrated);
                    for i in 0..N {
                        sample.applied_n_m[i] = sample.p_n_m[i] + sample.i_n_m[i] + sample.d_n_m[i];
                    }
                }
            }
        }
        for i in 0..N {
            sample.applied_n_m[i] = range[i].clip(sample.applied_n_m[i]);
            state.pid[i] = PidState {
                integral_n_m: sample.i_n_m[i],
                last_error_rad_s: Some(error[i]),
            };
        }
        sample
    }

    /// Writes the P, I and D terms for the reference times `factor` into the sample; returns the errors.
    fn form_terms(
        &self,
        state: &ControlState<R, N>,
        sample: &mut WheelSample<R, N>,
        factor: R,
        integrated: &impl Fn(&[R; N]) -> [R; N],
    ) -> [R; N] {
        let mut error = [R::zero(); N];
        for ((e, &r), &y) in error
            .iter_mut()
            .zip(&sample.reference_rad_s)
            .zip(&sample.measured_rad_s)
        {
            *e = factor * r - y;
        }
        let taken_in = integrated(&error);
        for i in 0..N {
            let terms = self.pid.terms(&state.pid[i], error[i], taken_in[i]);
            (sample.p_n_m[i], sample.i_n_m[i], sample.d_n_m[i]) = (terms.p_n_m, terms.i_n_m, terms.d_n_m);
        }
        error
    }

    /// Torque that each wheel's whole reference adds.
    fn slopes(
        &self,
        state: &ControlState<R, N>,
        reference: &[R; N],
        integrated: &impl Fn(&[R; N]) -> [R; N],
    ) -> [R; N] {
        let taken_in = integrated(reference);
        let mut slopes = [R::zero(); N];
        for i in 0..N {
            let (direct, integral) = self.pid.slopes(&state.pid[i]);
            slopes[i] = direct * reference[i] + integral * taken_in[i];
        }
        slopes
    }
}

/// A vehicle's controller: kinematics and wheel loops. Immutable; what changes is in [`ControlState`].
///
/// ```
/// use omni_core::{BodyTwist, Controller, ControlState, Coordination, PidGains, TorqueLimit, WheelControlConfig, WheelLayout};
/// let controller = Controller::new(
///     &WheelLayout::chugo7(0.30, 0.23, 0.066)?,
///     WheelControlConfig {
///         gains: PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 },
///         period_s: 1e-3,
///         limits: [TorqueLimit::constant(2.0)?; 7],
///         coordination: Coordination::synchronised(),
///     },
/// )?;
/// let mut state = ControlState::default();
/// let command = BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 };
/// let sample = controller.step(&mut state, &command, &[0.0; 7]);
/// assert!((sample.wheels.reference_rad_s[0] - 0.3 / 0.066).abs() < 1e-12);
/// assert_eq!(sample.wheels.applied_n_m[2], -sample.wheels.applied_n_m[0]); // the left wheels turn the other way
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<R, const N: usize> {
    kinematics: Kinematics<R, N>,
    wheels: WheelController<R, N>,
}

/// Every signal of one step of a [`Controller`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlSample<R, const N: usize> {
    /// The command.
    pub command: BodyTwist<R>,
    /// The twist that the measured velocities amount to.
    pub estimated: BodyTwist<R>,
    /// The part of the measured velocities that no motion of the vehicle explains \[rad/s\].
    pub residual_rad_s: [R; N],
    /// The wheels' signals.
    pub wheels: WheelSample<R, N>,
}

impl<R: Real, const N: usize> Controller<R, N> {
    /// A controller of the vehicle that `layout` describes, with the least-squares forward map.
    ///
    /// # Errors
    /// As [`Kinematics::new`] and [`WheelController::new`], but with any [`Integral`].
    pub fn new(layout: &WheelLayout<R, N>, config: WheelControlConfig<R, N>) -> Result<Self, ConfigError> {
        Self::with_forward(layout, config, ForwardMap::LeastSquares)
    }

    /// A controller with the forward map named.
    ///
    /// # Errors
    /// As [`Controller::new`], and as [`Kinematics::with_forward`].
    pub fn with_forward(
        layout: &WheelLayout<R, N>,
        config: WheelControlConfig<R, N>,
        map: ForwardMap,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            kinematics: Kinematics::with_forward(layout, map)?,
            wheels: WheelController::with_layout(config)?,
        })
    }

    /// The maps between twist and wheel velocities.
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics<R, N> {
        &self.kinematics
    }

    /// One step: torques that move the vehicle with `command`, given the actuator velocities `measured_rad_s`.
    pub fn step(
        &self,
        state: &mut ControlState<R, N>,
        command: &BodyTwist<R>,
        measured_rad_s: &[R; N],
    ) -> ControlSample<R, N> {
        let reference = self.kinematics.inverse(command);
        let wheels = match self.wheels.coordination.integral {
            Integral::PerWheel => self.wheels.step(state, &reference, measured_rad_s),
            Integral::Shared => self
                .wheels
                .step_integrating(state, &reference, measured_rad_s, |errors| {
                    self.kinematics.project(errors)
                }),
        };
        ControlSample {
            command: *command,
            estimated: self.kinematics.forward(measured_rad_s),
            residual_rad_s: self.kinematics.residual(measured_rad_s),
            wheels,
        }
    }
}

#[cfg(test)]
mod tests;
