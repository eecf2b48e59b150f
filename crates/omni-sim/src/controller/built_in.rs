//! The controllers of omni-core in the loop, in the precision that the scenario names.

use omni_core::drive::{BodyReadings, DrivePolicy, DriveSample, TractionDrive, TractionDriveState};
use omni_core::loops::ControllerPolicy;
use omni_core::policy::Imu;
use omni_core::shaping::TwistLimiterState;
use omni_core::traction::{SupervisorState, TractionPolicy, TractionPolicyState, TractionSample};
use omni_core::{BodyTwist, ControlState, DriveInput, DriveState, Kinematics, Policy, Readings, Real};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::control_law::{ControlLaw, inverse, scalar, velocities};
use crate::config::{self, Scenario};
use crate::control_sample::ControlSample;
use crate::report::{DriveReport, DriveWheel, TractionReport, TractionWheel};
use crate::{Error, ReportColumns, state_bytes};

/// Controllers that share the state of the command's limits, and those that share the state of a drive.
const LIMITED: &str = "limited";
const DRIVEN: &str = "driven";

/// A controller of omni-core with its state.
trait CoreController<R, const N: usize>: Send + Sync {
    /// What it shares with others, and which of those it is.
    const KIND: [&'static str; 2];
    /// What another of the same first kind goes on from: the limited command, or all that is around
    /// the loops, and a hold at rest.
    type Shared: Serialize + DeserializeOwned + Copy;
    type State: Serialize + DeserializeOwned;
    fn shared(&self) -> Self::Shared;
    /// A start from what another one shares, while the vehicle moves with `twist`.
    fn start_from(&mut self, shared: Self::Shared, twist: &BodyTwist<R>);
    /// One control step, and what it did.
    fn step(&mut self, readings: &Readings<'_, R>, sample: &mut ControlSample);
    fn kinematics(&self) -> &Kinematics<R, N>;
    fn state(&self) -> &Self::State;
    fn restore(&mut self, state: Self::State);
    fn emergency_stop(&mut self, _pressed: bool) {}
}

/// Of which controller a saved state is.
#[derive(PartialEq, Serialize, serde::Deserialize)]
struct Kind {
    shares: String,
    law: String,
    scalar_bytes: u8,
    wheels: u8,
}

impl Kind {
    fn of<L: CoreController<R, N>, R, const N: usize>() -> Self {
        Self {
            shares: L::KIND[0].into(),
            law: L::KIND[1].into(),
            scalar_bytes: size_of::<R>() as u8,
            wheels: N as u8,
        }
    }

    /// One starts from what the other shares.
    fn shares_with(&self, other: &Self) -> bool {
        (&self.shares, self.scalar_bytes, self.wheels) == (&other.shares, other.scalar_bytes, other.wheels)
    }
}

/// Such a controller behind the interface of the simulation.
struct BuiltIn<L, R, const N: usize> {
    law: L,
    columns: ReportColumns,
    /// Angles and rates of the hinges, in the controller's scalar.
    hinges: [Vec<R>; 2],
}

/// The controller of a scenario.
pub(super) fn built_in<R: Real + Serialize + DeserializeOwned, const N: usize>(
    scenario: &Scenario,
) -> Result<Box<dyn ControlLaw>, config::Error> {
    let columns = ReportColumns::built_in(
        scenario.vehicle(),
        scenario.drive.is_some(),
        scenario.has_traction(),
    );
    Ok(if let Some(drive) = scenario.traction_drive::<R, N>()? {
        let state = TractionDriveState::new(&drive);
        let emergency = false;
        boxed(
            SupervisedDrive {
                drive,
                state,
                emergency,
            },
            columns,
        )
    } else if let Some(drive) = scenario.drive::<R, N>()? {
        boxed(DrivePolicy::new(drive), columns)
    } else if let Some(policy) = scenario.traction::<R, N>()? {
        boxed(policy, columns)
    } else {
        let (limiter, controller) = (scenario.limiter()?, scenario.controller::<R, N>()?);
        boxed(ControllerPolicy::new(limiter, controller), columns)
    })
}

fn boxed<L: CoreController<R, N> + 'static, R: Real, const N: usize>(
    law: L,
    columns: ReportColumns,
) -> Box<dyn ControlLaw> {
    Box::new(BuiltIn {
        law,
        columns,
        hinges: [Vec::new(), Vec::new()],
    })
}

impl<L: CoreController<R, N>, R: Real, const N: usize> ControlLaw for BuiltIn<L, R, N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let wheels = velocities::<R, N>(readings.wheels_rad_s);
        let [hinges_rad, hinges_rad_s] = &mut self.hinges;
        for (to, from) in [
            (&mut *hinges_rad, readings.hinges_rad),
            (&mut *hinges_rad_s, readings.hinges_rad_s),
        ] {
            to.clear();
            to.extend(from.iter().map(|value| R::of(*value)));
        }
        let mut converted = Readings::new(scalar(&readings.command), &wheels.rad_s);
        (converted.hinges_rad, converted.hinges_rad_s) = (hinges_rad, hinges_rad_s);
        converted.new_command = readings.new_command;
        (converted.imu, converted.climbed_m) = (imu(&readings.imu), R::of(readings.climbed_m));
        self.law.step(&converted, sample);
        Ok(())
    }

    fn columns(&self) -> ReportColumns {
        self.columns.clone()
    }

    fn emergency_stop(&mut self, pressed: bool) {
        self.law.emergency_stop(pressed);
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(self.law.kinematics(), twist)
    }

    fn save(&self) -> Option<Vec<u8>> {
        state_bytes::to_bytes(&(Kind::of::<L, R, N>(), self.law.state())).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let read: Result<(Kind, L::State), _> = state_bytes::from_bytes(state);
        let Some((_, state)) = read.ok().filter(|(kind, _)| *kind == Kind::of::<L, R, N>()) else {
            return false;
        };
        self.law.restore(state);
        true
    }

    fn hand_over(&self) -> Option<Vec<u8>> {
        state_bytes::to_bytes(&(Kind::of::<L, R, N>(), self.law.shared())).ok()
    }

    fn take_over(&mut self, handed: &[u8], twist: &BodyTwist<f64>) -> bool {
        let read: Result<(Kind, L::Shared), _> = state_bytes::from_bytes(handed);
        let Some((_, shared)) = read
            .ok()
            .filter(|(kind, _)| kind.shares_with(&Kind::of::<L, R, N>()))
        else {
            return false;
        };
        self.law.start_from(shared, &scalar(twist));
        true
    }
}

/// A unit's readings in the controller's scalar.
fn imu<R: Real>(read: &Imu<f64>) -> Imu<R> {
    let mut imu = Imu::silent();
    imu.rate_rad_s = read.rate_rad_s.map(R::of);
    imu.specific_force_m_s2 = read.specific_force_m_s2.map(R::of);
    (imu.roll_rad, imu.pitch_rad) = (R::of(read.roll_rad), R::of(read.pitch_rad));
    imu
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> CoreController<R, N> for ControllerPolicy<R, N> {
    const KIND: [&'static str; 2] = [LIMITED, "loops"];
    type Shared = (TwistLimiterState<R>, ControlState<R, N>);
    type State = (TwistLimiterState<R>, ControlState<R, N>);

    fn shared(&self) -> Self::Shared {
        let (limited, loops) = self.state();
        (*limited, loops.afresh())
    }

    fn start_from(&mut self, shared: Self::Shared, _twist: &BodyTwist<R>) {
        self.restore(shared);
    }

    fn step(&mut self, readings: &Readings<'_, R>, sample: &mut ControlSample) {
        Policy::step(self, readings, &mut [R::zero(); N]);
        let (did, kinematics) = (self.sample(), self.controller().kinematics());
        let measured = &did.wheels.measured;
        sample.take(did, &kinematics.forward(measured), &kinematics.residual(measured));
    }

    fn kinematics(&self) -> &Kinematics<R, N> {
        self.controller().kinematics()
    }

    fn state(&self) -> &Self::State {
        self.state()
    }

    fn restore(&mut self, state: Self::State) {
        self.restore(state);
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> CoreController<R, N> for TractionPolicy<R, N> {
    const KIND: [&'static str; 2] = [LIMITED, "traction"];
    type Shared = (TwistLimiterState<R>, ControlState<R, N>);
    type State = TractionPolicyState<R, N>;

    fn shared(&self) -> Self::Shared {
        self.state().loops()
    }

    fn start_from(&mut self, shared: Self::Shared, twist: &BodyTwist<R>) {
        self.restore(TractionPolicyState::after(&shared, twist));
    }

    fn step(&mut self, readings: &Readings<'_, R>, sample: &mut ControlSample) {
        Policy::step(self, readings, &mut [R::zero(); N]);
        let (did, kinematics) = (self.sample(), self.traction().kinematics());
        let loops = omni_core::loops::ControlSample {
            command: did.command,
            wheels: did.wheels,
        };
        let measured = &did.wheels.measured;
        sample.take(
            &loops,
            &kinematics.forward(measured),
            &kinematics.residual(measured),
        );
        sample.report.traction = Some(traction_report(did, self.supervisor()));
    }

    fn kinematics(&self) -> &Kinematics<R, N> {
        self.traction().kinematics()
    }

    fn state(&self) -> &Self::State {
        self.state()
    }

    fn restore(&mut self, state: Self::State) {
        self.restore(state);
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> CoreController<R, N> for DrivePolicy<R, N> {
    const KIND: [&'static str; 2] = [DRIVEN, "loops"];
    type Shared = DriveState<R, N>;
    type State = DriveState<R, N>;

    fn shared(&self) -> Self::Shared {
        let mut state = *self.state();
        state.control = state.control.afresh();
        state
    }

    fn start_from(&mut self, shared: Self::Shared, _twist: &BodyTwist<R>) {
        *self.state_mut() = shared;
    }

    fn step(&mut self, readings: &Readings<'_, R>, sample: &mut ControlSample) {
        Policy::step(self, readings, &mut [R::zero(); N]);
        if let Some(did) = self.sample() {
            write_drive(did, self.state(), sample);
        }
    }

    fn kinematics(&self) -> &Kinematics<R, N> {
        self.drive().kinematics()
    }

    fn state(&self) -> &Self::State {
        self.state()
    }

    fn restore(&mut self, state: Self::State) {
        *self.state_mut() = state;
    }

    fn emergency_stop(&mut self, pressed: bool) {
        self.set_emergency(pressed);
    }
}

/// A drive whose loops are traction control, with its state.
struct SupervisedDrive<R, const N: usize> {
    drive: TractionDrive<R, N>,
    state: TractionDriveState<R, N>,
    /// The emergency stop is pressed.
    emergency: bool,
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> CoreController<R, N> for SupervisedDrive<R, N> {
    const KIND: [&'static str; 2] = [DRIVEN, "traction"];
    type Shared = DriveState<R, N>;
    type State = TractionDriveState<R, N>;

    fn shared(&self) -> Self::Shared {
        self.state.drive()
    }

    fn start_from(&mut self, shared: Self::Shared, twist: &BodyTwist<R>) {
        self.state = TractionDriveState::after(&shared, twist);
    }

    fn step(&mut self, readings: &Readings<'_, R>, sample: &mut ControlSample) {
        let mut input = DriveInput::received(&omni_core::WheelVelocities {
            rad_s: std::array::from_fn(|i| readings.wheels_rad_s[i]),
        });
        input.command = readings.new_command.then_some(readings.command);
        input.emergency = self.emergency;
        let mut body = BodyReadings::none();
        (body.hinges_rad, body.hinges_rad_s) = (readings.hinges_rad, readings.hinges_rad_s);
        (body.imu, body.climbed_m) = (readings.imu, readings.climbed_m);
        let did = self.drive.step(&mut self.state, &input, &body);
        write_drive(&did.drive, &self.state.drive, sample);
        sample.report.traction = Some(traction_report(&did.traction, self.state.supervisor()));
    }

    fn kinematics(&self) -> &Kinematics<R, N> {
        self.drive.drive().kinematics()
    }

    fn state(&self) -> &Self::State {
        &self.state
    }

    fn restore(&mut self, state: Self::State) {
        self.state = state;
    }

    fn emergency_stop(&mut self, pressed: bool) {
        self.emergency = pressed;
    }
}

/// Writes what a drive did into a sample.
fn write_drive<R: Real, const N: usize>(
    did: &DriveSample<R, N>,
    state: &DriveState<R, N>,
    sample: &mut ControlSample,
) {
    let loops = omni_core::loops::ControlSample {
        command: did.shaped.twist,
        wheels: did.wheels,
    };
    sample.take(&loops, &did.slip.estimated, &did.slip.residual);
    sample.brake.clear();
    sample.brake.extend(did.brake);
    sample.report.drive = Some(DriveReport {
        mode: did.mode,
        motion_known: did.motion_known,
        command: Some(did.shaped.status),
        pose: omni_core::geometry::PlanarPose {
            x_m: did.pose.x_m.as_f64(),
            y_m: did.pose.y_m.as_f64(),
            yaw_rad: did.pose.yaw_rad.as_f64(),
        },
        deviations: Some(state.covariance.standard_deviations().map(Real::as_f64)),
        wheels: (0..N)
            .map(|i| DriveWheel {
                fault: did.faults[i],
                excluded: did.slip.excluded[i],
                brake: did.brake[i],
            })
            .collect(),
    });
}

fn traction_report<R: Real, const N: usize>(
    did: &TractionSample<R, N>,
    supervisor: &SupervisorState<R>,
) -> TractionReport {
    TractionReport {
        factor: did.factor.as_f64(),
        speed_m_s: did.speed_m_s.as_f64(),
        target_m_s: did.target_m_s.as_f64(),
        thrust_n_m: did.thrust_n_m.as_f64(),
        speed_wheel: did.speed_wheel.map(|wheel| wheel as u32),
        row: supervisor.row(),
        mode: supervisor.mode(),
        row_retries: supervisor.row_retries(),
        retries: supervisor.retries(),
        edge_m: supervisor.edge_m().as_f64(),
        heading_rad: did.heading_rad.as_f64(),
        gyro_zero_rad_s: did.gyro_zero_rad_s.as_f64(),
        loops: did.loops,
        drift_m_s: did.drift_m_s.as_f64(),
        wheels: (0..N)
            .map(|i| TractionWheel {
                slip_rad_s: did.slip_rad_s[i].as_f64(),
                contact_n_m: did.contact_n_m[i].as_f64(),
            })
            .collect(),
    }
}
