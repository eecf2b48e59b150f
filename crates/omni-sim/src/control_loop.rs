//! The control loop: the heading hold, and the controller behind it. A simulation and a replay step the same one.

use omni_core::{BodyTwist, HeadingHold, HeadingHoldState};

use crate::Error;
use crate::config::Scenario;
use crate::controller::{AnyController, ControlSample};

/// A scenario's controller with its heading hold.
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_sim::{ControlLoop, config::Scenario, controller::{AnyController, ControlSample}};
/// let scenario = Scenario::load("step", &[])?;
/// let mut control = ControlLoop::new(&scenario, AnyController::new(&scenario)?);
/// let ahead = BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 };
/// let mut sample = ControlSample::default();
/// for _ in 0..1000 {
///     control.step(&ahead, &[0.0; 7], 0.0, &mut sample)?; // blocked wheels
/// }
/// assert_eq!(sample.wheels[0].applied_n_m, 2.0); // all that its motor has
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct ControlLoop {
    hold: Option<Hold>,
    controller: AnyController,
}

/// The loop that holds the heading.
struct Hold {
    law: HeadingHold<f64>,
    state: HeadingHoldState<f64>,
}

impl ControlLoop {
    /// The heading hold of a scenario, freshly started, before a controller that was made for it.
    #[must_use]
    pub fn new(scenario: &Scenario, controller: AnyController) -> Self {
        // Both were checked when the scenario was loaded.
        let law = |hold: crate::config::HeadingHold| HeadingHold::new(hold.config(scenario.period_s())).ok();
        let hold = scenario.heading_hold.and_then(law).map(|law| Hold {
            law,
            state: HeadingHoldState::default(),
        });
        Self { hold, controller }
    }

    /// One control period, from what is asked for and what the sensors say: an actuator velocity \[rad/s\] a wheel, the gyro's rate
    /// \[rad/s\]. `sample` is overwritten, whatever is returned.
    ///
    /// # Errors
    /// As [`AnyController::step`].
    pub fn step(
        &mut self,
        asked: &BodyTwist<f64>,
        measured_rad_s: &[f64],
        gyro_rad_s: f64,
        sample: &mut ControlSample,
    ) -> Result<(), Error> {
        let command = match &mut self.hold {
            Some(hold) => hold.law.step(&mut hold.state, asked, gyro_rad_s),
            None => *asked,
        };
        let controlled = self.controller.step(&command, measured_rad_s, sample);
        (sample.asked, sample.gyro_rad_s) = (*asked, gyro_rad_s);
        controlled
    }

    /// The controller.
    #[must_use]
    pub fn controller(&self) -> &AnyController {
        &self.controller
    }

    /// Another controller from now on, in the state of the present one.
    pub(crate) fn replace(&mut self, mut controller: AnyController) -> Result<(), Error> {
        let state = self.controller.save();
        if !state.is_some_and(|state| controller.restore(&state)) {
            return Err(Error::Snapshot {
                reason: "another controller cannot take over the present one's state".into(),
            });
        }
        self.controller = controller;
        Ok(())
    }

    /// State of the heading hold and of the controller; none where the controller is at the other end of a link.
    pub(crate) fn save(&self) -> Option<(Option<HeadingHoldState<f64>>, Vec<u8>)> {
        Some((self.hold.as_ref().map(|hold| hold.state), self.controller.save()?))
    }

    /// Goes on from what [`ControlLoop::save`] gave; says whether it fits.
    pub(crate) fn restore(&mut self, hold: Option<HeadingHoldState<f64>>, controller: &[u8]) -> bool {
        match (&mut self.hold, hold) {
            (Some(own), Some(state)) => own.state = state,
            (None, None) => {}
            _ => return false,
        }
        self.controller.restore(controller)
    }
}
