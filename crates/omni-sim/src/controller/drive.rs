//! omni-core's whole step in the loop: what firmware runs.

use omni_core::{BodyTwist, Drive, DriveMode, DrivePolicy, DriveSample, Fault, Policy, Readings, Real};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{ControlSample, Loop, scalar, velocities};
use crate::Error;
use crate::config::Scenario;

/// Signals of a drive beside those of every controller; then for each signal of [`WHEEL`] one a wheel.
const NAMES: [&str; 9] = [
    "drive_mode",
    "drive_motion_known",
    "drive_command_status",
    "drive_pose_x_m",
    "drive_pose_y_m",
    "drive_pose_yaw_rad",
    "drive_std_x_m",
    "drive_std_y_m",
    "drive_std_yaw_rad",
];
const WHEEL: [&str; 3] = ["drive_fault", "drive_left_out", "drive_brake"];

/// A drive with its state.
pub(super) struct Driven<R, const N: usize> {
    policy: DrivePolicy<R, N>,
    names: Vec<String>,
}

/// A mode as a number: how far from normal.
fn mode(mode: DriveMode) -> f64 {
    match mode {
        DriveMode::Normal => 0.0,
        DriveMode::Degraded => 1.0,
        DriveMode::SafeStop => 2.0,
        DriveMode::EmergencyStop => 3.0,
        _ => f64::NAN,
    }
}

/// A fault as a number, 0 for none.
fn fault(fault: Option<Fault>) -> f64 {
    match fault {
        None => 0.0,
        Some(Fault::NotANumber) => 1.0,
        Some(Fault::Jump) => 2.0,
        Some(Fault::Stuck) => 3.0,
        Some(Fault::Silent) => 4.0,
        Some(Fault::Lost) => 5.0,
        Some(_) => f64::NAN,
    }
}

/// Why the twist is what it is, as a number: 0 idle, 1 following, 2 limited, 3 timed out, 4 emergency stop.
fn status(status: omni_core::CommandStatus) -> f64 {
    use omni_core::CommandStatus as Status;
    match status {
        Status::Idle => 0.0,
        Status::Following => 1.0,
        Status::Limited => 2.0,
        Status::TimedOut => 3.0,
        Status::EmergencyStop => 4.0,
        _ => f64::NAN,
    }
}

impl<R: Real, const N: usize> Driven<R, N> {
    pub(super) fn new(scenario: &Scenario, drive: Drive<R, N>) -> Self {
        let wheels = &scenario.vehicle().wheel;
        let of_wheel = |signal: &&str| {
            let signal = (*signal).to_owned();
            wheels.iter().map(move |wheel| format!("{signal}_{}", wheel.name))
        };
        let names = NAMES.iter().map(|name| (*name).to_owned());
        Self {
            policy: DrivePolicy::new(drive),
            names: names.chain(WHEEL.iter().flat_map(of_wheel)).collect(),
        }
    }

    fn tell(&self, drive: &DriveSample<R, N>, measured: &[f64], sample: &mut ControlSample) {
        let loops = omni_core::ControlSample {
            command: drive.desaturated.twist,
            wheels: drive.wheels,
        };
        let estimated = if drive.motion_known {
            drive.slip.estimated
        } else {
            BodyTwist::zero()
        };
        sample.take(&loops, &estimated, &drive.slip.residual);
        // As the encoders said it, not as the monitor took it: who replays a log starts from that.
        for (wheel, measured) in sample.wheels.iter_mut().zip(measured) {
            wheel.measured_rad_s = *measured;
        }
        let flag = |flag: bool| f64::from(u8::from(flag));
        let own = &mut sample.own;
        own.clear();
        own.extend([
            mode(drive.mode),
            flag(drive.motion_known),
            status(drive.shaped.status),
        ]);
        own.extend([
            drive.pose.x_m.as_f64(),
            drive.pose.y_m.as_f64(),
            drive.pose.yaw_rad.as_f64(),
        ]);
        let deviations = self.policy.state().covariance.standard_deviations();
        own.extend(deviations.map(|deviation| deviation.as_f64()));
        own.extend(drive.faults.map(fault));
        own.extend(drive.slip.excluded.map(flag));
        own.extend(drive.brake.map(flag));
        sample.brake.clear();
        sample.brake.extend(drive.brake);
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> Loop for Driven<R, N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let measured = velocities::<R, N>(readings.wheels_rad_s);
        let mut told = Readings::new(scalar(&readings.command), &measured.rad_s);
        told.new_command = readings.new_command;
        self.policy.step(&told, &mut [R::zero(); N]);
        if let Some(drive) = self.policy.sample() {
            self.tell(drive, readings.wheels_rad_s, sample);
        }
        Ok(())
    }

    fn signal_names(&self) -> &[String] {
        &self.names
    }

    fn emergency_stop(&mut self, pressed: bool) {
        let state = self.policy.state_mut();
        if pressed {
            state.emergency_stop();
        } else {
            state.release_emergency_stop();
        }
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        let velocities = self.policy.drive().kinematics().inverse(&scalar(twist));
        velocities.rad_s.iter().map(|v| v.as_f64()).collect()
    }

    fn save(&self) -> Option<Vec<u8>> {
        postcard::to_allocvec(self.policy.state()).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let state = postcard::from_bytes(state);
        state.is_ok_and(|state| {
            *self.policy.state_mut() = state;
            true
        })
    }
}
