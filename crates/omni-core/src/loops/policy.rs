//! The wheel loops behind the interface of every controller.

use crate::Real;
use crate::geometry::WheelVelocities;
use crate::loops::{ControlSample, ControlState, Controller};
use crate::policy::{Policy, Readings};
use crate::shaping::{TwistLimiter, TwistLimiterState};

/// omni-core's loops as a [`Policy`]: a vehicle's limits, then [`Controller::step`].
///
/// ```
/// use omni_core::loops::ControllerPolicy;
/// use omni_core::{BodyTwist, Controller, Policy, Readings, WheelLayout};
/// # let limiter = omni_core::examples::limiter(0.4)?;
/// # let config = omni_core::examples::loops(0.25, 0.0, 2.0)?;
/// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config)?;
/// let mut policy = ControllerPolicy::new(limiter, controller); // 0.4 m/s at most
/// let (ahead, mut torques_n_m) = (BodyTwist { vx_m_s: 9.0, ..BodyTwist::ZERO }, [0.0; 4]);
/// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut torques_n_m);
/// assert!(torques_n_m.iter().all(|torque| (torque - 0.25 * 0.4 / 0.1).abs() < 1e-12));
/// assert_eq!(policy.sample().command.vx_m_s, 0.4);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerPolicy<R, const N: usize> {
    limiter: TwistLimiter<R>,
    controller: Controller<R, N>,
    state: (TwistLimiterState<R>, ControlState<R, N>),
    sample: ControlSample<R, N>,
}

impl<R: Real, const N: usize> ControllerPolicy<R, N> {
    /// Freshly started.
    #[must_use]
    pub fn new(limiter: TwistLimiter<R>, controller: Controller<R, N>) -> Self {
        Self {
            limiter,
            controller,
            state: (TwistLimiterState::default(), ControlState::default()),
            sample: ControlSample::zero(),
        }
    }

    /// The loops.
    #[must_use]
    pub fn controller(&self) -> &Controller<R, N> {
        &self.controller
    }

    /// The result of the last step.
    #[must_use]
    pub fn sample(&self) -> &ControlSample<R, N> {
        &self.sample
    }

    /// Its state.
    #[must_use]
    pub fn state(&self) -> &(TwistLimiterState<R>, ControlState<R, N>) {
        &self.state
    }

    /// Continues from the state of another controller of the same kind.
    pub fn restore(&mut self, state: (TwistLimiterState<R>, ControlState<R, N>)) {
        self.state = state;
    }
}

impl<R: Real, const N: usize> Policy<R> for ControllerPolicy<R, N> {
    fn reset(&mut self) {
        *self = Self::new(self.limiter, self.controller);
    }

    fn step(&mut self, readings: &Readings<'_, R>, torques_n_m: &mut [R]) {
        let (limited, state) = &mut self.state;
        let command = self.limiter.step(limited, &readings.command);
        let measured = WheelVelocities::received(readings.wheels_rad_s);
        self.controller
            .step_into(state, &command, &measured, &mut self.sample);
        for (torque, applied) in torques_n_m.iter_mut().zip(self.sample.wheels.applied.n_m) {
            *torque = applied;
        }
    }
}
