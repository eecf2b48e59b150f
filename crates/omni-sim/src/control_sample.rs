//! Result of one control step.

use omni_core::{BodyTwist, Real, WheelVelocities};
use serde::{Deserialize, Serialize};

use crate::WheelSignals;
use crate::report::Report;
use crate::wheel_signals::Did;

/// Result of one control step: [`omni_core::loops::ControlSample`] in `f64`, for any number of wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ControlSample {
    /// The request, before the heading hold and the limits. With what the sensors said it is all that the controller
    /// gets: replay starts from these.
    pub asked: BodyTwist<f64>,
    /// The command, within the vehicle's limits.
    pub command: BodyTwist<f64>,
    /// The twist that the measured velocities amount to.
    pub estimated: BodyTwist<f64>,
    /// Factor on all torques or all references, 0 to 1.
    pub common_factor: f64,
    /// One entry per wheel, in the vehicle's order.
    pub wheels: Vec<WheelSignals>,
    /// Motors whose windings are shorted, one per wheel; empty for none. A shorted motor brakes with the slope of its
    /// torque over speed.
    pub brake: Vec<bool>,
    /// Signals that only this controller has.
    pub report: Report,
}

impl ControlSample {
    /// Of a period that no controller had a part in: of its signals only the actuators' torques \[N.m\]
    /// are known, one per wheel, and all others are NaN. A zero would be mistaken for a measurement.
    ///
    /// ```
    /// use omni_sim::controller::ControlSample;
    /// let sample = ControlSample::without_controller(&[0.5, -0.5]);
    /// assert_eq!((sample.wheels.len(), sample.wheels[1].applied_n_m), (2, -0.5));
    /// assert!(sample.wheels[1].measured_rad_s.is_nan() && sample.common_factor.is_nan());
    /// ```
    #[must_use]
    pub fn without_controller(torques_n_m: &[f64]) -> Self {
        const UNKNOWN: f64 = f64::NAN;
        let signals = |applied_n_m: &f64| WheelSignals {
            applied_n_m: *applied_n_m,
            ..WheelSignals::UNKNOWN
        };
        Self {
            asked: BodyTwist::from_array([UNKNOWN; 3]),
            command: BodyTwist::from_array([UNKNOWN; 3]),
            estimated: BodyTwist::from_array([UNKNOWN; 3]),
            common_factor: UNKNOWN,
            wheels: torques_n_m.iter().map(signals).collect(),
            brake: Vec::new(),
            report: Report::default(),
        }
    }

    /// Its command; none in a period without the controller.
    pub(crate) fn commanded(&self) -> Option<BodyTwist<f64>> {
        let is_known = self.command.to_array().iter().all(|part| part.is_finite());
        is_known.then_some(self.command)
    }

    /// Times that traction control backed off for another try since the start; none of a controller
    /// that does not try again.
    #[must_use]
    pub fn retries(&self) -> Option<u32> {
        self.report.traction.as_ref().map(|traction| traction.retries)
    }

    /// Takes what a controller of omni-core says: everything but what was asked for and the report.
    pub(crate) fn take<R: Real, const N: usize>(
        &mut self,
        s: &omni_core::loops::ControlSample<R, N>,
        estimated: &BodyTwist<R>,
        residual: &WheelVelocities<R, N>,
    ) {
        let double = |t: &BodyTwist<R>| BodyTwist::from_array(t.to_array().map(Real::as_f64));
        self.command = double(&s.command);
        self.estimated = double(estimated);
        self.common_factor = s.wheels.common_factor.as_f64();
        self.brake.clear();
        if s.wheels.shorted {
            self.brake.extend([true; N]);
        }
        self.wheels.clear();
        let wheels = &s.wheels;
        let did = Did { wheels, residual };
        self.wheels.extend((0..N).map(|i| WheelSignals::of(&did, i)));
    }
}

impl Default for ControlSample {
    fn default() -> Self {
        Self {
            asked: BodyTwist::ZERO,
            command: BodyTwist::ZERO,
            estimated: BodyTwist::ZERO,
            common_factor: 1.0,
            wheels: Vec::new(),
            brake: Vec::new(),
            report: Report::default(),
        }
    }
}
