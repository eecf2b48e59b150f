//! One control step of a vehicle: command to torques, with every intermediate signal in the sample it returns.

#[cfg(test)]
mod tests;

use crate::error::ConfigError;
use crate::pid::is_plausible;
use crate::wheel_loops::LoopInputs;
use crate::{
    BodyTwist, ControlState, ForwardMap, Kinematics, PathFactors, Real, WheelControlConfig, WheelController,
    WheelLayout, WheelSample, WheelVelocities,
};

/// A vehicle's controller: kinematics and wheel loops. Immutable; what changes is in [`ControlState`].
///
/// The bare loop. [`crate::Drive`] puts shaping, faults, slip and odometry around it.
///
/// ```
/// use omni_core::{BodyTwist, Controller, ControlState, Coordination, PidConfig, PidGains, TorqueLimit};
/// use omni_core::{WheelControlConfig, WheelLayout, WheelVelocities};
/// let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
/// let controller = Controller::new(
///     &WheelLayout::chugo7(0.30, 0.23, 0.066)?,
///     WheelControlConfig {
///         pid: PidConfig::new(gains, 1e-3),
///         limits: [TorqueLimit::constant(2.0)?; 7],
///         coordination: Coordination::synchronised(),
///     },
/// )?;
/// let mut state = ControlState::default();
/// let command = BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 };
/// let sample = controller.step(&mut state, &command, &WheelVelocities::zero());
/// assert!((sample.wheels.reference.rad_s[0] - 0.3 / 0.066).abs() < 1e-12);
/// assert_eq!(sample.wheels.applied.n_m[2], -sample.wheels.applied.n_m[0]); // the left wheels turn the other way
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
    /// The command; rest where the one given was not finite, or beyond 1e6.
    pub command: BodyTwist<R>,
    /// The wheels' signals.
    pub wheels: WheelSample<R, N>,
}

impl<R: Real, const N: usize> ControlSample<R, N> {
    /// All zero, to be written to by [`Controller::step_into`].
    #[must_use]
    pub fn zero() -> Self {
        Self {
            command: BodyTwist::zero(),
            wheels: WheelSample::zero(),
        }
    }
}

impl<R: Real, const N: usize> Controller<R, N> {
    /// A controller of the vehicle that `layout` describes, with the least-squares forward map.
    ///
    /// # Errors
    /// As [`Kinematics::new`] and [`WheelController::new`], but with any [`crate::Integral`].
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

    /// One step: torques that move the vehicle with `command`, given the actuator velocities `measured`.
    ///
    /// A command that is not finite stands for rest; a measurement that is not lets its wheel go. What the measured
    /// velocities say of the vehicle's motion is [`Kinematics::forward`] and [`Kinematics::residual`].
    #[inline]
    pub fn step(
        &self,
        state: &mut ControlState<R, N>,
        command: &BodyTwist<R>,
        measured: &WheelVelocities<R, N>,
    ) -> ControlSample<R, N> {
        let mut sample = ControlSample::zero();
        self.step_into(state, command, measured, &mut sample);
        sample
    }

    /// [`Controller::step`] into a sample that is there already: nothing is copied, for the smallest of processors.
    #[inline]
    pub fn step_into(
        &self,
        state: &mut ControlState<R, N>,
        command: &BodyTwist<R>,
        measured: &WheelVelocities<R, N>,
        sample: &mut ControlSample<R, N>,
    ) {
        let usable = command.to_array().iter().all(|&c| is_plausible(c));
        sample.command = if usable { *command } else { BodyTwist::zero() };
        let reference = self.kinematics.inverse(&sample.command);
        let inputs = LoopInputs {
            reference: &reference,
            measured,
            dropped: None,
            within: None,
        };
        let share = |errors: &[R; N]| self.kinematics.project(&(*errors).into()).rad_s;
        self.wheels.run(
            state,
            &inputs,
            self.wheels.shares_integral().then_some(share),
            &mut sample.wheels,
        );
    }

    /// The loops, an integral shared by the wheels that `observed` trusts, each on its own path.
    pub(crate) fn run(
        &self,
        state: &mut ControlState<R, N>,
        inputs: &LoopInputs<'_, R, N>,
        observed: &Kinematics<R, N>,
        path: &PathFactors<R, N>,
    ) -> WheelSample<R, N> {
        let mut sample = WheelSample::zero();
        let share = |errors: &[R; N]| observed.project_along(&(*errors).into(), path).rad_s;
        self.wheels.run(
            state,
            inputs,
            self.wheels.shares_integral().then_some(share),
            &mut sample,
        );
        sample
    }
}
