//! What the functions of `TractionDrive` have in common: a drive around traction control.

use core::mem::MaybeUninit;

use omni_core::drive::{BodyReadings, TractionDrive, TractionDriveSample, TractionDriveState};
use omni_core::linkage::MAX_HINGES;
use omni_core::policy::Imu;
use omni_core::traction::{SupervisorMode, SupervisorState, TractionLoops, TractionSample};

use crate::drive::{Input, Output};
use crate::memory::{Memory, TractionMemory};
use crate::status::{Status, at};

/// What the vehicle's bodies are read to do. All zero: nothing is read, and traction control does
/// with the wheels' encoders.
#[repr(C)]
pub struct Bodies {
    /// Angle of each hinge [rad], in the order of the vehicle file; NaN if it was not read.
    /// Used only if `hinges_received`.
    pub hinges_rad: [f32; MAX_HINGES],
    /// Their rates [rad/s].
    pub hinges_rad_s: [f32; MAX_HINGES],
    /// Inertial measurement unit of the base; used only if `imu_received`.
    pub imu: Imu<f32>,
    /// Height of the edge that a wheel has climbed in this period [m]; 0 if none has, or if nothing measures it.
    pub climbed_m: f32,
    /// The hinges' readings arrived.
    pub hinges_received: bool,
    /// The unit's reading arrived.
    pub imu_received: bool,
}

impl Bodies {
    /// The same for the library.
    #[inline]
    fn read(&self) -> BodyReadings<'_, f32> {
        let mut read = BodyReadings::none();
        if self.hinges_received {
            // More than the vehicle has: the law looks at its own.
            (read.hinges_rad, read.hinges_rad_s) = (&self.hinges_rad, &self.hinges_rad_s);
        }
        if self.imu_received {
            read.imu = self.imu;
        }
        read.climbed_m = self.climbed_m;
        read
    }
}

/// What a step with traction control reports. Nothing in it is ever NaN.
#[repr(C)]
pub struct TractionOutput<const N: usize> {
    /// What a drive reports, torques to apply among it.
    pub drive: Output<N>,
    /// Measured speed over the commanded, -1 to 1; 1 where none is commanded.
    pub factor: f32,
    /// Measured speed along the direction of travel [m/s].
    pub speed_m_s: f32,
    /// The target that it follows [m/s].
    pub target_m_s: f32,
    /// Common thrust [N.m].
    pub thrust_n_m: f32,
    /// Yaw rate [rad/s].
    pub yaw_rad_s: f32,
    /// Speed across the direction of travel, to the left [m/s].
    pub drift_m_s: f32,
    /// Heading error [rad], counter-clockwise positive.
    pub heading_rad: f32,
    /// The gyro's zero [rad/s].
    pub gyro_zero_rad_s: f32,
    /// Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
    pub slip_rad_s: [f32; N],
    /// What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
    pub contact_n_m: [f32; N],
    /// Retries so far.
    pub retries: u32,
    /// Index of the wheel that the measured speed hangs on, the slowest that pushes, or the fastest
    /// where all brake; -1 where there is none.
    pub speed_wheel: i8,
    /// The control mode of the wheels.
    pub loops: TractionLoops,
    /// What the choice of the target speed is at.
    pub supervisor: SupervisorMode,
}

impl<const N: usize> TractionOutput<N> {
    #[inline]
    fn of(drive: Output<N>, law: &TractionSample<f32, N>, supervisor: &SupervisorState<f32>) -> Self {
        Self {
            drive,
            factor: law.factor,
            speed_m_s: law.speed_m_s,
            target_m_s: law.target_m_s,
            thrust_n_m: law.thrust_n_m,
            yaw_rad_s: law.yaw_rad_s,
            drift_m_s: law.drift_m_s,
            heading_rad: law.heading_rad,
            gyro_zero_rad_s: law.gyro_zero_rad_s,
            slip_rad_s: law.slip_rad_s,
            contact_n_m: law.contact_n_m,
            retries: supervisor.retries(),
            speed_wheel: law.speed_wheel.map_or(-1, |wheel| wheel as i8),
            loops: law.loops,
            supervisor: supervisor.mode(),
        }
    }
}

#[inline]
pub fn init<const N: usize, const WORDS: usize>(
    drive: Option<&TractionDrive<f32, N>>,
    state: Option<&mut MaybeUninit<TractionMemory<N, WORDS>>>,
    output: Option<&mut MaybeUninit<TractionOutput<N>>>,
) -> Result<(), Status> {
    let (drive, state, output) = (at(drive)?, at(state)?, at(output)?);
    TractionMemory::start(state, TractionDriveState::new(drive));
    let supervisor = SupervisorState::new();
    output.write(TractionOutput::of(
        Output::zero(),
        &TractionSample::zero(),
        &supervisor,
    ));
    Ok(())
}

#[inline]
pub fn step<const N: usize, const WORDS: usize>(
    drive: Option<&TractionDrive<f32, N>>,
    state: Option<&mut TractionMemory<N, WORDS>>,
    input: Option<&Input<N>>,
    bodies: Option<&Bodies>,
    output: Option<&mut TractionOutput<N>>,
) -> Result<(), Status> {
    let (drive, state, input) = (at(drive)?, at(state)?, at(input)?);
    let (bodies, output) = (at(bodies)?, at(output)?);
    let state = state.open()?;
    let TractionDriveSample { drive, traction, .. } = drive.step(state, &input.arrived(), &bodies.read());
    *output = TractionOutput::of(Output::of(&drive), &traction, state.supervisor());
    Ok(())
}
