//! What the functions of `Drive` have in common: what goes in, what comes out, and what a null pointer does.

use core::mem::MaybeUninit;

use omni_core::drive::{DriveSample, Fault, TractionDriveState};
use omni_core::geometry::{PathFactors, PlanarPose, WheelTorques};
use omni_core::motor::TorqueRanges;
use omni_core::shaping::CommandStatus;
use omni_core::{BodyTwist, Drive, DriveInput, DriveMode, DriveState, WheelVelocities};

use crate::memory::{DriveMemory, Memory};
use crate::status::{Status, at, finite};

/// What arrived since the period before. All zero: nothing did, every wheel is on flat ground,
/// motors have their own limits.
#[repr(C)]
pub struct Input<const N: usize> {
    /// The command; used only if `commanded`.
    pub command: BodyTwist<f32>,
    /// Actuator velocities [rad/s]; each used only if it was `received`.
    pub measured: WheelVelocities<f32, N>,
    /// Torques [N.m] that the motors shall keep within besides their own limits: a hot motor, a low
    /// battery. Each used only if `limited`. 0 is always within.
    pub torque_ranges: TorqueRanges<f32, N>,
    /// Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
    pub path_factor: [f32; N],
    /// A command arrived. If none does for the time-out, the vehicle is brought to rest.
    pub commanded: bool,
    /// The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is
    /// commanded, and stays there as long as this is true. The caller has to latch a momentary button.
    pub emergency: bool,
    /// The encoder's reading arrived.
    pub received: [bool; N],
    /// The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
    pub lifted: [bool; N],
    /// `torque_ranges` holds for this motor.
    pub limited: [bool; N],
}

impl<const N: usize> Input<N> {
    /// The same for the library.
    #[inline]
    pub fn arrived(&self) -> DriveInput<f32, N> {
        let mut arrived = DriveInput::measured(&self.measured);
        for (reading, &received) in arrived.readings_rad_s.iter_mut().zip(&self.received) {
            if !received {
                *reading = None;
            }
        }
        arrived.command = self.commanded.then_some(self.command);
        arrived.emergency = self.emergency;
        arrived.lifted = self.lifted;
        arrived.path = PathFactors::or_flat(self.path_factor);
        let (ranges, given) = (&mut arrived.torque_ranges, &self.torque_ranges);
        let lower = ranges.lower_n_m.iter_mut().zip(given.lower_n_m);
        let upper = ranges.upper_n_m.iter_mut().zip(given.upper_n_m);
        for (((lower, least), (upper, most)), limited) in lower.zip(upper).zip(self.limited) {
            if limited {
                (*lower, *upper) = (least, most);
            }
        }
        arrived
    }
}

/// The fault of a wheel.
#[derive(Clone, Copy)]
#[repr(u8)]
pub enum WheelFault {
    /// Nothing.
    None = 0,
    /// Its reading is NaN, infinite, or beyond 1e6 rad/s.
    NotANumber = 1,
    /// Its reading jumps further in one period than a wheel can.
    Jump = 2,
    /// Its reading never changes although the vehicle moves, or although the motor pulls: an
    /// encoder that is dead, or a wheel that is blocked.
    Stuck = 3,
    /// No reading has arrived for too long.
    Silent = 4,
    /// It has been declared lost.
    Lost = 5,
}

impl WheelFault {
    #[inline]
    fn of(fault: Option<Fault>) -> Self {
        match fault.map_or(0, Fault::number) {
            0 => Self::None,
            1 => Self::NotANumber,
            2 => Self::Jump,
            3 => Self::Stuck,
            4 => Self::Silent,
            _ => Self::Lost,
        }
    }
}

/// What a step reports. Nothing in it is ever NaN.
#[repr(C)]
pub struct Output<const N: usize> {
    /// Torques to apply [N.m], always within the motors' limits.
    pub torques: WheelTorques<f32, N>,
    /// Torques that the loops requested [N.m].
    pub requested: WheelTorques<f32, N>,
    /// References of the loops [rad/s].
    pub references: WheelVelocities<f32, N>,
    /// Velocities that the loops used [rad/s]; 0 for a wheel that is not `active`.
    pub measured: WheelVelocities<f32, N>,
    /// Command within all limits, of the origin.
    pub twist: BodyTwist<f32>,
    /// Twist of the vehicle, by its wheels; 0 unless `motion_known`.
    pub estimated: BodyTwist<f32>,
    /// Pose of the vehicle, by its wheels.
    pub pose: PlanarPose<f32>,
    /// How far the vehicle can be relied on.
    pub mode: DriveMode,
    /// Why the twist is what it is.
    pub status: CommandStatus,
    /// A command arrived and was rejected: it is no number, or beyond 1e6.
    pub rejected: bool,
    /// Enough wheels determine the motion; otherwise the pose does not change.
    pub motion_known: bool,
    /// The fault of each wheel.
    pub faults: [WheelFault; N],
    /// The wheel was controlled. One that is not has no torque, and its bridge is opened or
    /// shorted: it has a fault, or all torque has ended at rest.
    pub active: [bool; N],
    /// The requested torque is outside the limits.
    pub saturated: [bool; N],
    /// The wheel is excluded from the motion: faulty, lifted or slipping.
    pub excluded: [bool; N],
    /// The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a
    /// fault, so that no torque can be asked of it, or all torque has ended. At rest otherwise: all
    /// torque has ended, and the scenario asks for it (`control.rest.short_windings`).
    pub brake: [bool; N],
}

impl<const N: usize> Output<N> {
    /// Before the first step.
    pub fn zero() -> Self {
        Self {
            torques: WheelTorques::zero(),
            requested: WheelTorques::zero(),
            references: WheelVelocities::zero(),
            measured: WheelVelocities::zero(),
            twist: BodyTwist::ZERO,
            estimated: BodyTwist::ZERO,
            pose: PlanarPose::origin(),
            mode: DriveMode::Normal,
            status: CommandStatus::Idle,
            rejected: false,
            motion_known: false,
            faults: [WheelFault::None; N],
            active: [false; N],
            saturated: [false; N],
            excluded: [false; N],
            brake: [false; N],
        }
    }

    /// Of a step.
    #[inline]
    pub fn of(sample: &DriveSample<f32, N>) -> Self {
        let wheels = &sample.wheels;
        Self {
            torques: wheels.applied,
            requested: wheels.requested,
            references: wheels.reference,
            measured: wheels.measured,
            twist: sample.desaturated.twist,
            estimated: sample.slip.estimated,
            pose: sample.pose,
            mode: sample.mode,
            status: sample.shaped.status,
            rejected: sample.shaped.rejected,
            motion_known: sample.motion_known,
            faults: sample.faults.map(WheelFault::of),
            active: wheels.active,
            saturated: wheels.saturated,
            excluded: sample.slip.excluded,
            brake: sample.brake,
        }
    }
}

/// Standard deviations of the pose. All 0 if the drive has no noise.
#[repr(C)]
pub struct Deviations {
    /// Of x [m].
    pub x_m: f32,
    /// Of y [m].
    pub y_m: f32,
    /// Of the heading [rad].
    pub yaw_rad: f32,
}

/// A state with what is around the loops.
pub trait Drives<const N: usize> {
    /// That of the drive.
    fn drive(&self) -> &DriveState<f32, N>;

    /// The same, to be changed.
    fn drive_mut(&mut self) -> &mut DriveState<f32, N>;
}

impl<const N: usize> Drives<N> for DriveState<f32, N> {
    #[inline]
    fn drive(&self) -> &DriveState<f32, N> {
        self
    }

    #[inline]
    fn drive_mut(&mut self) -> &mut DriveState<f32, N> {
        self
    }
}

impl<const N: usize> Drives<N> for TractionDriveState<f32, N> {
    #[inline]
    fn drive(&self) -> &DriveState<f32, N> {
        &self.drive
    }

    #[inline]
    fn drive_mut(&mut self) -> &mut DriveState<f32, N> {
        &mut self.drive
    }
}

#[inline]
pub fn init<const N: usize, const WORDS: usize>(
    drive: Option<&Drive<f32, N>>,
    state: Option<&mut MaybeUninit<DriveMemory<N, WORDS>>>,
    output: Option<&mut MaybeUninit<Output<N>>>,
) -> Result<(), Status> {
    let (drive, state, output) = (at(drive)?, at(state)?, at(output)?);
    DriveMemory::start(state, DriveState::new(drive));
    output.write(Output::zero());
    Ok(())
}

#[inline]
pub fn step<const N: usize, const WORDS: usize>(
    drive: Option<&Drive<f32, N>>,
    state: Option<&mut DriveMemory<N, WORDS>>,
    input: Option<&Input<N>>,
    output: Option<&mut Output<N>>,
) -> Result<(), Status> {
    let (drive, state, input, output) = (at(drive)?, at(state)?, at(input)?, at(output)?);
    let state = state.open()?;
    let mut sample = DriveSample::zero();
    drive.step_into(state, &input.arrived(), &mut sample);
    *output = Output::of(&sample);
    Ok(())
}

/// Does something to what is around the loops.
#[inline]
pub fn change<const N: usize, M: Memory<Kept: Drives<N>>>(
    state: Option<&mut M>,
    change: impl FnOnce(&mut DriveState<f32, N>),
) -> Result<(), Status> {
    change(at(state)?.open()?.drive_mut());
    Ok(())
}

#[inline]
pub fn reset_pose<const N: usize, M: Memory<Kept: Drives<N>>>(
    state: Option<&mut M>,
    [x_m, y_m, yaw_rad]: [f32; 3],
) -> Result<(), Status> {
    let pose = PlanarPose { x_m, y_m, yaw_rad };
    finite(at(state)?.open()?.drive_mut().odometry.reset(&pose))
}

#[inline]
pub fn deviations<const N: usize, M: Memory<Kept: Drives<N>>>(
    state: Option<&M>,
    deviations: Option<&mut Deviations>,
) -> Result<(), Status> {
    let (state, deviations) = (at(state)?, at(deviations)?);
    let [x_m, y_m, yaw_rad] = state.look()?.drive().covariance.standard_deviations();
    *deviations = Deviations { x_m, y_m, yaw_rad };
    Ok(())
}
