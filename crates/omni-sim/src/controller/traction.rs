//! Traction control of omni-core in the loop, with everything that it knows.

use omni_core::{BodyTwist, Imu, Policy, Readings, Real, TractionPolicy, TractionPolicyState};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{ControlSample, Loop, scalar, velocities};
use crate::Error;
use crate::config::Scenario;
use crate::sensing::{SENSED, SENSED_HINGE};

/// Signals of each wheel.
const WHEEL: [&str; 2] = ["traction_slip_rad_s", "traction_contact_n_m"];

/// A [`TractionPolicy`] with room for what it is told.
pub(super) struct Gripping<R, const N: usize> {
    policy: TractionPolicy<R, N>,
    names: Vec<String>,
    hinges: [Vec<R>; 2],
    /// Its signals that are of no wheel.
    common: Vec<R>,
}

/// Names of the signals of traction control of a scenario's vehicle.
pub(super) fn names<R: Real, const N: usize>(
    scenario: &Scenario,
    policy: &TractionPolicy<R, N>,
) -> Vec<String> {
    let vehicle = scenario.vehicle();
    let common = (0..).map_while(|index| policy.signal_name(index).map(str::to_owned));
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
    let sensed = SENSED.iter().map(|name| (*name).to_owned());
    common.chain(of_wheels).chain(sensed).chain(of_hinges).collect()
}

impl<R: Real, const N: usize> Gripping<R, N> {
    pub(super) fn new(scenario: &Scenario, policy: TractionPolicy<R, N>) -> Self {
        Self {
            names: names(scenario, &policy),
            common: vec![R::zero(); (0..).map_while(|index| policy.signal_name(index)).count()],
            policy,
            hinges: [Vec::new(), Vec::new()],
        }
    }

    fn tell(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) {
        let told = self.policy.sample();
        let kinematics = self.policy.traction().kinematics();
        let loops = omni_core::ControlSample {
            command: told.command,
            wheels: told.wheels,
        };
        let measured = &told.wheels.measured;
        sample.take(
            &loops,
            &kinematics.forward(measured),
            &kinematics.residual(measured),
        );
        sample.mark_silent(readings.wheels_rad_s);
        sample.retries = Some(self.policy.supervisor().retries());
        let own = &mut sample.own;
        let of_wheels = [told.slip_rad_s, told.contact_n_m];
        own.clear();
        self.policy.signals(&mut self.common);
        own.extend(self.common.iter().map(|value| value.as_f64()));
        own.extend(of_wheels.iter().flatten().map(|value| value.as_f64()));
        own.extend(readings.imu.rate_rad_s);
        own.extend([readings.imu.roll_rad, readings.imu.pitch_rad]);
        own.extend(readings.hinges_rad.iter().chain(readings.hinges_rad_s));
        own.resize(self.names.len(), f64::NAN); // where no hinge is heard
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> Loop for Gripping<R, N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let wheels = velocities::<R, N>(readings.wheels_rad_s);
        for (to, from) in self
            .hinges
            .iter_mut()
            .zip([readings.hinges_rad, readings.hinges_rad_s])
        {
            to.clear();
            to.extend(from.iter().map(|value| R::of(*value)));
        }
        let mut told = Readings::new(scalar(&readings.command), &wheels.rad_s);
        (told.hinges_rad, told.hinges_rad_s) = (&self.hinges[0], &self.hinges[1]);
        told.new_command = readings.new_command;
        let mut imu = Imu::silent();
        imu.rate_rad_s = readings.imu.rate_rad_s.map(R::of);
        imu.specific_force_m_s2 = readings.imu.specific_force_m_s2.map(R::of);
        (imu.roll_rad, imu.pitch_rad) = (R::of(readings.imu.roll_rad), R::of(readings.imu.pitch_rad));
        told.imu = imu;
        self.policy.step(&told, &mut [R::zero(); N]);
        self.tell(readings, sample);
        Ok(())
    }

    fn signal_names(&self) -> &[String] {
        &self.names
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        let velocities = self.policy.traction().kinematics().inverse(&scalar(twist));
        velocities.rad_s.iter().map(|v| v.as_f64()).collect()
    }

    fn save(&self) -> Option<Vec<u8>> {
        postcard::to_allocvec(self.policy.state()).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let state: Result<TractionPolicyState<R, N>, _> = postcard::from_bytes(state);
        state.is_ok_and(|state| {
            self.policy.restore(state);
            true
        })
    }
}
