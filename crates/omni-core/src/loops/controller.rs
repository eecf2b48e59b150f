//! One control step: from command to torques, with every intermediate signal in the sample it returns.

#[cfg(test)]
mod coarse_readings;
#[cfg(test)]
mod tests;

use crate::constants::constant_struct;
use crate::geometry::{BodyTwist, ForwardMap, Kinematics, PathFactors, WheelLayout, WheelVelocities};
use crate::loops::wheel_loops::LoopInputs;
use crate::loops::{ControlState, Rest, RestRule, WheelControlConfig, WheelController, WheelSample};
use crate::scalar::all_plausible;
use crate::{ConfigError, Real};

/// A vehicle's controller: kinematics and wheel loops. Immutable; the changing state is in [`ControlState`].
///
/// The bare loop. [`Drive`](crate::drive::Drive) puts shaping, faults, slip and odometry around it.
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
///         coordination: Coordination::scale_references(),
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Controller<R, const N: usize> {
    kinematics: Kinematics<R, N>,
    wheels: WheelController<R, N>,
}

constant_struct!(Controller<R, const N> { kinematics: Kinematics<R, N>, wheels: WheelController<R, N> });

/// Every signal of one step of a [`Controller`].
///
/// ```
/// use omni_core::{BodyTwist, ControlState, Controller, WheelLayout};
/// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
/// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config)?;
/// // A command that is not a number stands for rest: gain 0.3 brakes wheels that turn with 1 rad/s.
/// let broken = BodyTwist { vx_m_s: f64::NAN, ..BodyTwist::ZERO };
/// let sample = controller.step(&mut ControlState::default(), &broken, &[1.0; 4].into());
/// assert_eq!(sample.command, BodyTwist::ZERO);
/// assert_eq!(sample.wheels.applied.n_m, [-0.3; 4]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
// Not `non_exhaustive`: as `WheelSample`.
#[repr(C)]
pub struct ControlSample<R, const N: usize> {
    /// The command; rest if the one given was not finite, or beyond 1e6.
    pub command: BodyTwist<R>,
    /// The wheels' signals.
    pub wheels: WheelSample<R, N>,
}

impl<R: Real, const N: usize> ControlSample<R, N> {
    /// At rest, to be written to by [`Controller::step_into`]: all zero but the common factor, which is 1.
    #[must_use]
    pub const fn zero() -> Self {
        Self {
            command: BodyTwist::ZERO,
            wheels: WheelSample::zero(),
        }
    }
}

impl<R: Real, const N: usize> Controller<R, N> {
    /// A controller of the vehicle that `layout` describes, with the least-squares forward map.
    ///
    /// # Errors
    /// As [`Kinematics::new`] and [`WheelController::new`], but with any [`crate::loops::Integral`].
    pub fn new(layout: &WheelLayout<R, N>, config: WheelControlConfig<R, N>) -> Result<Self, ConfigError> {
        Self::with_forward(layout, config, ForwardMap::LeastSquares)
    }

    /// A controller with the forward map named.
    ///
    /// # Errors
    /// As [`Controller::new`], and as [`Kinematics::with_forward`].
    ///
    /// ```
    /// use omni_core::geometry::ForwardMap;
    /// use omni_core::{Controller, WheelLayout};
    /// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
    /// let layout = WheelLayout::chugo7(0.2, 0.1, 0.1)?;
    /// let controller = Controller::with_forward(&layout, config, ForwardMap::PaperAverage)?;
    /// // Wheel 2 alone, 0.2 m behind the middle: one of six votes on the yaw rate, 12 * 0.1 / 0.2 rad/s.
    /// let spin = [0.0, 12.0, 0.0, 0.0, 0.0, 0.0, 0.0].into();
    /// assert!((controller.kinematics().forward(&spin).wz_rad_s - 6.0 / 6.0).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
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

    /// The same controller with another rule for rest than [`Rest::default`].
    ///
    /// # Errors
    /// As [`WheelController::with_rest`].
    ///
    /// ```
    /// use omni_core::loops::Rest;
    /// use omni_core::{BodyTwist, ControlState, Controller, WheelLayout, WheelVelocities};
    /// # let config = omni_core::examples::loops(0.3, 2.0, 2.0)?;
    /// let layout = WheelLayout::mecanum4(0.6, 0.4, 0.1)?;
    /// let mut rest = Rest::default();
    /// rest.bleed_s = 0.1;
    /// let controller = Controller::new(&layout, config)?.with_rest(rest)?;
    /// let (mut state, blocked) = (ControlState::default(), WheelVelocities::zero());
    /// for _ in 0..300 {
    ///     controller.step(&mut state, &BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO }, &blocked);
    /// }
    /// assert!(state.integral_n_m[0] > 1.0); // pushing against what blocks it
    /// for _ in 0..100 {
    ///     controller.step(&mut state, &BodyTwist::ZERO, &blocked);
    /// }
    /// assert_eq!(controller.step(&mut state, &BodyTwist::ZERO, &blocked).wheels.applied.n_m, [0.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn with_rest(self, rest: Rest<R>) -> Result<Self, ConfigError> {
        Ok(Self {
            wheels: self.wheels.with_rest(rest)?,
            ..self
        })
    }

    /// The maps between twist and wheel velocities.
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics<R, N> {
        &self.kinematics
    }

    /// [`WheelController::shorts_at_rest`] of its loops.
    #[must_use]
    pub fn shorts_at_rest(&self) -> bool {
        self.wheels.shorts_at_rest()
    }

    /// One step: torques that move the vehicle with `command`, given the actuator velocities `measured` \[rad/s\]. To
    /// be called once every control period.
    ///
    /// A command that is not finite, or beyond 1e6, stands for rest; a measurement that is not releases its wheel.
    /// [`Kinematics::forward`] and [`Kinematics::residual`] evaluate the measured velocities.
    ///
    /// ```
    /// use omni_core::{BodyTwist, ControlState, Controller, WheelLayout};
    /// # let config = omni_core::examples::loops(0.3, 0.0, 2.0)?;
    /// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config)?;
    /// // 0.1 m/s of wheels of 0.1 m are 1 rad/s; kp is 0.3 N.m per rad/s. Wheel 2 is there, wheel 3 does not answer.
    /// let ahead = BodyTwist { vx_m_s: 0.1, ..BodyTwist::ZERO };
    /// let sample = controller.step(&mut ControlState::default(), &ahead, &[0.0, 1.0, f64::NAN, 0.0].into());
    /// for (torque, expected) in sample.wheels.applied.n_m.iter().zip([0.3, 0.0, 0.0, 0.3]) {
    ///     assert!((torque - expected).abs() < 1e-12);
    /// }
    /// assert_eq!(sample.wheels.active, [true, true, false, true]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
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
    ///
    /// ```
    /// use omni_core::loops::ControlSample;
    /// use omni_core::{BodyTwist, ControlState, Controller, WheelLayout};
    /// # let config = omni_core::examples::loops(0.25, 0.0, 2.0)?;
    /// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config)?;
    /// let (mut state, mut sample) = (ControlState::default(), ControlSample::zero());
    /// for measured in [4.0, 6.0] {
    ///     controller.step_into(&mut state, &BodyTwist::ZERO, &[measured; 4].into(), &mut sample);
    /// }
    /// assert_eq!(sample.wheels.applied.n_m, [-0.25 * 6.0; 4]); // of the last step
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step_into(
        &self,
        state: &mut ControlState<R, N>,
        command: &BodyTwist<R>,
        measured: &WheelVelocities<R, N>,
        sample: &mut ControlSample<R, N>,
    ) {
        let usable = all_plausible(&command.to_array());
        sample.command = if usable { *command } else { BodyTwist::ZERO };
        let reference = self.kinematics.inverse(&sample.command);
        let inputs = LoopInputs {
            reference: &reference,
            measured,
            dropped: None,
            within: None,
            holds: true,
        };
        let share = |errors: &[R; N]| self.kinematics.project(&(*errors).into()).rad_s;
        self.wheels.run(
            state,
            &inputs,
            self.wheels.shares_integral().then_some(share),
            &mut sample.wheels,
        );
    }

    pub(crate) fn rest(&self) -> RestRule<R> {
        self.wheels.rest()
    }

    /// The loops, an integral shared by the wheels that `observed` trusts, each on its own path.
    pub(crate) fn run(
        &self,
        state: &mut ControlState<R, N>,
        inputs: &LoopInputs<'_, R, N>,
        observed: &Kinematics<R, N>,
        path: &PathFactors<R, N>,
        sample: &mut WheelSample<R, N>,
    ) {
        let share = |errors: &[R; N]| observed.project_along(&(*errors).into(), path).rad_s;
        self.wheels.run(
            state,
            inputs,
            self.wheels.shares_integral().then_some(share),
            sample,
        );
    }
}
