//! The control loop that both simulation and replay step: heading hold and controller.

use std::ops::Range;

use omni_core::BodyTwist;
use omni_core::shaping::{HeadingHold, HeadingHoldState};
use serde::{Deserialize, Serialize};

use crate::config::{Fault, Scenario};
use crate::controller::{AnyController, ControlSample};
use crate::sensed::Sensed;
use crate::{Error, state_bytes};

/// A scenario's controller with its heading hold.
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_sim::{ControlLoop, Sensed, config::Scenario, controller::{AnyController, ControlSample}};
/// let scenario = Scenario::load("flat", &[])?.with_policy("independent")?;
/// let mut control = ControlLoop::new(&scenario, AnyController::new(&scenario)?);
/// let ahead = BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 };
/// let mut sample = ControlSample::default();
/// for _ in 0..1000 {
///     control.step(&ahead, &Sensed::at_rest(scenario.vehicle()), &mut sample)?; // blocked wheels
/// }
/// assert_eq!(sample.wheels[0].applied_n_m, 2.0); // all that its motor has
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct ControlLoop {
    hold: Option<Hold>,
    controller: AnyController,
    /// From when to when no command arrives, and the emergency stop is pressed \[s\].
    lost: Vec<Range<f64>>,
    stopped: Vec<Range<f64>>,
    period_s: f64,
    memory: Memory,
}

/// What is remembered beside the hold and the controller.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Memory {
    periods: u64,
    /// The last command that arrived, and the torques of the last period \[N.m\].
    command: BodyTwist<f64>,
    torques_n_m: Vec<f64>,
}

/// The saved state of a control loop: the hold, what is remembered, the controller.
pub(crate) type LoopState = (Option<HeadingHoldState<f64>>, Memory, Vec<u8>);

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
        let spans = |kind: fn(&Fault) -> bool| {
            let faults = scenario.fault.iter().filter(|fault| kind(fault));
            faults.map(Fault::span_s).collect()
        };
        Self {
            hold,
            controller,
            lost: spans(|fault| matches!(fault, Fault::CommandLost(_))),
            stopped: spans(|fault| matches!(fault, Fault::EmergencyStop(_))),
            period_s: scenario.period_s(),
            memory: Memory {
                periods: 0,
                command: BodyTwist::ZERO,
                torques_n_m: vec![0.0; scenario.vehicle().wheel.len()],
            },
        }
    }

    /// One control period, from what is asked for and what the sensors say. `sample` is
    /// overwritten, whatever is returned. While the scenario loses commands (`command_lost`) the
    /// last one that arrived is still the one asked for.
    ///
    /// # Errors
    /// As [`AnyController::step`].
    pub fn step(
        &mut self,
        asked: &BodyTwist<f64>,
        sensed: &Sensed,
        sample: &mut ControlSample,
    ) -> Result<(), Error> {
        let memory = &mut self.memory;
        let time_s = memory.periods as f64 * self.period_s;
        memory.periods += 1;
        let now = |spans: &[Range<f64>]| spans.iter().any(|span| span.contains(&time_s));
        let arrived = !now(&self.lost);
        if !self.stopped.is_empty() {
            self.controller.emergency_stop(now(&self.stopped));
        }
        if arrived {
            memory.command = *asked;
        }
        let asked = memory.command;
        let command = match &mut self.hold {
            Some(hold) => hold.law.step(&mut hold.state, &asked, sensed.gyro_rad_s),
            None => asked,
        };
        let mut readings = sensed.readings(command);
        (readings.new_command, readings.torques_n_m) = (arrived, &memory.torques_n_m);
        let controlled = self.controller.step_readings(&readings, sample);
        sample.asked = asked;
        memory.torques_n_m.clear();
        memory
            .torques_n_m
            .extend(sample.wheels.iter().map(|wheel| wheel.applied_n_m));
        controlled
    }

    /// The torques commanded of the actuators in this period \[N.m\], where something was added to the controller's.
    pub(crate) fn gave(&mut self, torques_n_m: &[f64]) {
        self.memory.torques_n_m.clear();
        self.memory.torques_n_m.extend_from_slice(torques_n_m);
    }

    /// A period in which another controller commanded the actuators' torques \[N.m\].
    pub(crate) fn passed_by(&mut self, torques_n_m: &[f64]) {
        self.memory.periods += 1;
        self.gave(torques_n_m);
    }

    /// The controller.
    #[must_use]
    pub fn controller(&self) -> &AnyController {
        &self.controller
    }

    /// Another controller from now on, which goes on from the state of the present one; the vehicle moves with `twist`.
    pub(crate) fn replace(
        &mut self,
        mut controller: AnyController,
        twist: &BodyTwist<f64>,
    ) -> Result<(), Error> {
        state_bytes::check_built_in()?;
        if !controller.take_over(&self.controller, twist) {
            return Err(Error::Snapshot {
                reason: "another controller cannot take over the state of this one".into(),
            });
        }
        self.controller = controller;
        Ok(())
    }

    /// Its whole state; none if the controller is at the other end of a link.
    pub(crate) fn save(&self) -> Option<LoopState> {
        let hold = self.hold.as_ref().map(|hold| hold.state);
        Some((hold, self.memory.clone(), self.controller.save()?))
    }

    /// Continues from the result of [`ControlLoop::save`]; returns whether it fits.
    pub(crate) fn restore(&mut self, (hold, memory, controller): LoopState) -> bool {
        self.memory = memory;
        match (&mut self.hold, hold) {
            (Some(own), Some(state)) => own.state = state,
            (None, None) => {}
            _ => return false,
        }
        self.controller.restore(&controller)
    }
}
