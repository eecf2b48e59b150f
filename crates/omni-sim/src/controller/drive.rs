//! omni-core's whole step in the loop: what firmware runs.

use omni_core::drive::{BodyReadings, DrivePolicy, DriveSample, Fault, TractionDrive, TractionDriveState};
use omni_core::shaping::CommandStatus;
use omni_core::{BodyTwist, Drive, DriveInput, DriveState, Policy, Readings, Real};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::traction::{self, Hinges};
use super::{ControlSample, Loop, inverse, scalar, velocities};
use crate::config::Scenario;
use crate::{Error, state_bytes};

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
pub(super) struct DriveLoop<R, const N: usize> {
    policy: DrivePolicy<R, N>,
    names: Vec<String>,
}

/// What a drive reports beside the wheels' signals, here or at the other end of a link.
pub(super) struct DriveSignals<const N: usize> {
    /// [`omni_core::DriveMode::number`].
    pub(super) mode: u8,
    pub(super) motion_known: bool,
    /// 0 idle, 1 following, 2 limited, 3 timed out, 4 emergency stop; NaN where it is not reported.
    pub(super) status: f64,
    /// x \[m\], y \[m\], yaw \[rad\], and their standard deviations; NaN where these are not reported.
    pub(super) pose: [f64; 3],
    pub(super) deviations: [f64; 3],
    /// [`Fault::number`] of each wheel.
    pub(super) faults: [u8; N],
    pub(super) left_out: [bool; N],
    /// Motors whose windings are shorted.
    pub(super) brake: [bool; N],
}

impl<const N: usize> DriveSignals<N> {
    /// Writes it into a sample, whose wheels are there already; `measured` is as the encoders said it, not as the monitor took it: who
    /// replays a log starts from that.
    pub(super) fn put_into(&self, measured: &[f64], sample: &mut ControlSample) {
        for (wheel, measured) in sample.wheels.iter_mut().zip(measured) {
            wheel.measured_rad_s = *measured;
        }
        sample.brake.clear();
        sample.brake.extend(self.brake);
        let flag = |flag: bool| f64::from(u8::from(flag));
        let own = &mut sample.own;
        own.clear();
        own.extend([f64::from(self.mode), flag(self.motion_known), self.status]);
        own.extend(self.pose);
        own.extend(self.deviations);
        own.extend(self.faults.map(f64::from));
        own.extend(self.left_out.map(flag));
        own.extend(self.brake.map(flag));
    }
}

/// Names of the signals of a drive.
pub(super) fn names(scenario: &Scenario) -> impl Iterator<Item = String> {
    let wheels = &scenario.vehicle().wheel;
    let of_wheel = |signal: &&str| {
        let signal = (*signal).to_owned();
        wheels.iter().map(move |wheel| format!("{signal}_{}", wheel.name))
    };
    let names = NAMES.iter().map(|name| (*name).to_owned());
    names.chain(WHEEL.iter().flat_map(of_wheel))
}

/// Why the twist is what it is, as a number.
fn status(status: CommandStatus) -> f64 {
    match status {
        CommandStatus::Idle => 0.0,
        CommandStatus::Following => 1.0,
        CommandStatus::Limited => 2.0,
        CommandStatus::TimedOut => 3.0,
        CommandStatus::EmergencyStop => 4.0,
        _ => f64::NAN,
    }
}

impl<R: Real, const N: usize> DriveLoop<R, N> {
    pub(super) fn new(scenario: &Scenario, drive: Drive<R, N>) -> Self {
        Self {
            policy: DrivePolicy::new(drive),
            names: names(scenario).collect(),
        }
    }
}

/// Writes what a drive did into a sample.
fn write<R: Real, const N: usize>(
    drive: &DriveSample<R, N>,
    state: &DriveState<R, N>,
    measured: &[f64],
    sample: &mut ControlSample,
) {
    let loops = omni_core::loops::ControlSample {
        command: drive.shaped.twist,
        wheels: drive.wheels,
    };
    sample.take(&loops, &drive.slip.estimated, &drive.slip.residual);
    let deviations = state.covariance.standard_deviations();
    let signals = DriveSignals {
        mode: drive.mode.number(),
        motion_known: drive.motion_known,
        status: status(drive.shaped.status),
        pose: [drive.pose.x_m, drive.pose.y_m, drive.pose.yaw_rad].map(Real::as_f64),
        deviations: deviations.map(Real::as_f64),
        faults: drive.faults.map(|fault| fault.map_or(0, Fault::number)),
        left_out: drive.slip.excluded,
        brake: drive.brake,
    };
    signals.put_into(measured, sample);
}

/// Presses the emergency stop of a drive, or releases it.
fn press<R: Real, const N: usize>(state: &mut DriveState<R, N>, pressed: bool) {
    if pressed {
        state.emergency_stop();
    } else {
        state.release_emergency_stop();
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> Loop for DriveLoop<R, N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let measured = velocities::<R, N>(readings.wheels_rad_s);
        let mut converted = Readings::new(scalar(&readings.command), &measured.rad_s);
        converted.new_command = readings.new_command;
        self.policy.step(&converted, &mut [R::zero(); N]);
        if let Some(drive) = self.policy.sample() {
            write(drive, self.policy.state(), readings.wheels_rad_s, sample);
        }
        Ok(())
    }

    fn signal_names(&self) -> &[String] {
        &self.names
    }

    fn emergency_stop(&mut self, pressed: bool) {
        press(self.policy.state_mut(), pressed);
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(self.policy.drive().kinematics(), twist)
    }

    fn save(&self) -> Option<Vec<u8>> {
        state_bytes::to_bytes(self.policy.state()).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let state = state_bytes::from_bytes(state);
        state.is_ok_and(|state| {
            *self.policy.state_mut() = state;
            true
        })
    }
}

/// A drive whose loops are traction control, with its state.
pub(super) struct TractionLoop<R, const N: usize> {
    drive: TractionDrive<R, N>,
    state: TractionDriveState<R, N>,
    names: Vec<String>,
    hinges: Hinges<R>,
}

impl<R: Real, const N: usize> TractionLoop<R, N> {
    pub(super) fn new(scenario: &Scenario, drive: TractionDrive<R, N>) -> Self {
        Self {
            state: TractionDriveState::new(&drive),
            drive,
            names: names(scenario).chain(traction::names(scenario)).collect(),
            hinges: Hinges::new(),
        }
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> Loop for TractionLoop<R, N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        self.hinges.take(readings);
        let mut input = DriveInput::received(&velocities(readings.wheels_rad_s));
        input.command = readings.new_command.then(|| scalar(&readings.command));
        let mut body = BodyReadings::none();
        (body.hinges_rad, body.hinges_rad_s) = (&self.hinges.rad, &self.hinges.rad_s);
        body.imu = traction::imu(&readings.imu);
        let did = self.drive.step(&mut self.state, &input, &body);
        write(&did.drive, &self.state.drive, readings.wheels_rad_s, sample);
        traction::write(&did.traction, self.state.supervisor(), readings, sample);
        sample.own.resize(self.names.len(), f64::NAN); // where no hinge is read
        Ok(())
    }

    fn signal_names(&self) -> &[String] {
        &self.names
    }

    fn emergency_stop(&mut self, pressed: bool) {
        press(&mut self.state.drive, pressed);
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(self.drive.drive().kinematics(), twist)
    }

    fn save(&self) -> Option<Vec<u8>> {
        state_bytes::to_bytes(&self.state).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let state = state_bytes::from_bytes(state);
        state.is_ok_and(|state| {
            self.state = state;
            true
        })
    }
}
