//! Traction control of omni-core in the loop, with everything that it knows.

use omni_core::policy::Imu;
use omni_core::traction::{SupervisorState, TractionPolicy, TractionPolicyState, TractionSample};
use omni_core::{BodyTwist, Policy, Readings, Real};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{ControlSample, Loop, inverse, scalar, velocities};
use crate::config::Scenario;
use crate::sensing::{SENSED, SENSED_HINGE};
use crate::{Error, state_bytes};

/// Signals of each wheel.
const WHEEL: [&str; 2] = ["traction_slip_rad_s", "traction_contact_n_m"];

/// A [`TractionPolicy`] with room for its inputs.
pub(super) struct TractionLoop<R, const N: usize> {
    policy: TractionPolicy<R, N>,
    names: Vec<String>,
    hinges: Hinges<R>,
}

/// What hinges are read to do, in the controller's scalar.
pub(super) struct Hinges<R> {
    pub(super) rad: Vec<R>,
    pub(super) rad_s: Vec<R>,
}

impl<R: Real> Hinges<R> {
    pub(super) fn new() -> Self {
        Self {
            rad: Vec::new(),
            rad_s: Vec::new(),
        }
    }

    pub(super) fn take(&mut self, readings: &Readings<'_, f64>) {
        for (to, from) in [
            (&mut self.rad, readings.hinges_rad),
            (&mut self.rad_s, readings.hinges_rad_s),
        ] {
            to.clear();
            to.extend(from.iter().map(|value| R::of(*value)));
        }
    }
}

/// A unit's readings in the controller's scalar.
pub(super) fn imu<R: Real>(read: &Imu<f64>) -> Imu<R> {
    let mut imu = Imu::silent();
    imu.rate_rad_s = read.rate_rad_s.map(R::of);
    imu.specific_force_m_s2 = read.specific_force_m_s2.map(R::of);
    (imu.roll_rad, imu.pitch_rad) = (R::of(read.roll_rad), R::of(read.pitch_rad));
    imu
}

/// Names of the signals of traction control of a scenario's vehicle.
pub(super) fn names(scenario: &Scenario) -> impl Iterator<Item = String> {
    let vehicle = scenario.vehicle();
    let common = TractionSample::<f64, 1>::SIGNALS.iter();
    let of_wheels = WHEEL.iter().flat_map(|signal| {
        vehicle
            .wheel
            .iter()
            .map(move |wheel| format!("{signal}_{}", wheel.name))
    });
    let of_hinges = SENSED_HINGE.iter().flat_map(|signal| {
        vehicle
            .hinge
            .iter()
            .map(move |hinge| format!("{signal}_{}", hinge.name))
    });
    let whole = |name: &&str| (*name).to_owned();
    common
        .map(whole)
        .chain(of_wheels)
        .chain(SENSED.iter().map(whole))
        .chain(of_hinges)
}

/// Writes the signals of traction control, and its inputs, behind those that are in a sample already.
pub(super) fn write<R: Real, const N: usize>(
    sampled: &TractionSample<R, N>,
    supervisor: &SupervisorState<R>,
    readings: &Readings<'_, f64>,
    sample: &mut ControlSample,
) {
    sample.retries = Some(supervisor.retries());
    let own = &mut sample.own;
    own.extend(sampled.signals(supervisor).iter().map(|value| value.as_f64()));
    let of_wheels = [sampled.slip_rad_s, sampled.contact_n_m];
    own.extend(of_wheels.iter().flatten().map(|value| value.as_f64()));
    own.extend(readings.imu.rate_rad_s);
    own.extend([readings.imu.roll_rad, readings.imu.pitch_rad]);
    own.extend(readings.hinges_rad.iter().chain(readings.hinges_rad_s));
}

impl<R: Real, const N: usize> TractionLoop<R, N> {
    pub(super) fn new(scenario: &Scenario, policy: TractionPolicy<R, N>) -> Self {
        Self {
            names: names(scenario).collect(),
            policy,
            hinges: Hinges::new(),
        }
    }

    fn write(&self, readings: &Readings<'_, f64>, sample: &mut ControlSample) {
        let sampled = self.policy.sample();
        let kinematics = self.policy.traction().kinematics();
        let loops = omni_core::loops::ControlSample {
            command: sampled.command,
            wheels: sampled.wheels,
        };
        let measured = &sampled.wheels.measured;
        sample.take(
            &loops,
            &kinematics.forward(measured),
            &kinematics.residual(measured),
        );
        sample.mark_silent(readings.wheels_rad_s);
        sample.own.clear();
        write(sampled, self.policy.supervisor(), readings, sample);
        sample.own.resize(self.names.len(), f64::NAN); // where no hinge is read
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> Loop for TractionLoop<R, N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let wheels = velocities::<R, N>(readings.wheels_rad_s);
        self.hinges.take(readings);
        let mut converted = Readings::new(scalar(&readings.command), &wheels.rad_s);
        (converted.hinges_rad, converted.hinges_rad_s) = (&self.hinges.rad, &self.hinges.rad_s);
        converted.new_command = readings.new_command;
        converted.imu = imu(&readings.imu);
        self.policy.step(&converted, &mut [R::zero(); N]);
        self.write(readings, sample);
        Ok(())
    }

    fn signal_names(&self) -> &[String] {
        &self.names
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(self.policy.traction().kinematics(), twist)
    }

    fn save(&self) -> Option<Vec<u8>> {
        state_bytes::to_bytes(self.policy.state()).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let state: Result<TractionPolicyState<R, N>, _> = state_bytes::from_bytes(state);
        state.is_ok_and(|state| {
            self.policy.restore(state);
            true
        })
    }
}
