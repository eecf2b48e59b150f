//! The simulation's interface of all controllers.

use omni_core::{BodyTwist, Kinematics, Readings, Real, WheelVelocities};

use crate::control_sample::ControlSample;
use crate::link_counters::LinkCounters;
use crate::{Error, ReportColumns};

/// A controller with its state.
pub(super) trait ControlLaw: Send + Sync {
    /// One control step. Overwrites `sample` but for what was asked for, the measured velocities
    /// and the path, whatever is returned; its report is empty before.
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error>;
    /// Its report.
    fn columns(&self) -> ReportColumns {
        ReportColumns::default()
    }
    /// Presses the emergency stop, or releases it; without one nothing happens.
    fn emergency_stop(&mut self, _pressed: bool) {}
    /// Actuator velocities \[rad/s\] that move the vehicle with `twist`.
    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64>;
    /// The state, for a snapshot; none at the other end of a link.
    fn save(&self) -> Option<Vec<u8>> {
        None
    }
    /// Continues from a state of [`ControlLaw::save`]; returns whether it is valid.
    fn restore(&mut self, _state: &[u8]) -> bool {
        false
    }
    /// What a controller of another kind can go on from.
    fn hand_over(&self) -> Option<Vec<u8>> {
        None
    }
    /// Starts from the result of [`ControlLaw::hand_over`], while the vehicle moves with `twist`; returns whether it
    /// can.
    fn take_over(&mut self, _handed: &[u8], _twist: &BodyTwist<f64>) -> bool {
        false
    }
    /// Missing messages so far; none without a link.
    fn link_counters(&self) -> Option<LinkCounters> {
        None
    }
}

/// A twist in the controller's scalar.
pub(super) fn scalar<R: Real>(twist: &BodyTwist<f64>) -> BodyTwist<R> {
    BodyTwist::from_array(twist.to_array().map(R::of))
}

/// Measured velocities in the controller's scalar.
pub(super) fn velocities<R: Real, const N: usize>(measured: &[f64]) -> WheelVelocities<R, N> {
    let mut velocities = WheelVelocities::zero();
    for (v, m) in velocities.rad_s.iter_mut().zip(measured) {
        *v = R::of(*m);
    }
    velocities
}

/// Actuator velocities that move a vehicle with `twist`.
pub(super) fn inverse<R: Real, const N: usize>(
    kinematics: &Kinematics<R, N>,
    twist: &BodyTwist<f64>,
) -> Vec<f64> {
    let velocities = kinematics.inverse(&scalar(twist));
    velocities.rad_s.iter().map(|v| v.as_f64()).collect()
}
