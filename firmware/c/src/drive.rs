//! What the functions of `Drive` have in common: what goes in, what comes out, and what a null pointer does.

use core::mem::MaybeUninit;
use core::ptr;

use omni_core::drive::{DriveSample, Fault};
use omni_core::geometry::{PlanarPose, WheelTorques};
use omni_core::shaping::CommandStatus;
use omni_core::{BodyTwist, Drive, DriveInput, DriveMode, DriveState, WheelVelocities};

/// What arrived since the period before.
#[repr(C)]
pub struct Input<const N: usize> {
    /// The command; looked at only where `commanded`.
    pub command: BodyTwist<f32>,
    /// Actuator velocities [rad/s]; each looked at only where it was `received`.
    pub measured: WheelVelocities<f32, N>,
    /// A command arrived. Where none does for the time-out, the vehicle is brought to rest.
    pub commanded: bool,
    /// The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is commanded, and stays there for as
    /// long as this is said. A button that springs back has to be latched before.
    pub emergency: bool,
    /// The encoder's reading arrived.
    pub received: [bool; N],
    /// The wheel is in the air: it is controlled, but says nothing of the vehicle's motion.
    pub lifted: [bool; N],
}

/// What a step reports. Nothing in it is ever NaN.
#[repr(C)]
pub struct Output<const N: usize> {
    /// Torques to apply [N.m], always within the motors' limits.
    pub torques: WheelTorques<f32, N>,
    /// Torques that the loops asked for [N.m].
    pub requested: WheelTorques<f32, N>,
    /// References of the loops [rad/s].
    pub references: WheelVelocities<f32, N>,
    /// Velocities that the loops went by [rad/s]; 0 for a wheel that is not `active`.
    pub measured: WheelVelocities<f32, N>,
    /// What the vehicle is to do: the command within all limits, of the origin.
    pub twist: BodyTwist<f32>,
    /// What the vehicle does, by its wheels; 0 unless `motion_known`.
    pub estimated: BodyTwist<f32>,
    /// Where the vehicle is, by its wheels.
    pub pose: PlanarPose<f32>,
    /// How far the vehicle can be relied on.
    pub mode: DriveMode,
    /// Why the twist is what it is.
    pub status: CommandStatus,
    /// A command arrived and was refused: it is no number, or beyond 1e6.
    pub rejected: bool,
    /// Enough wheels determine the motion; else the pose stands still.
    pub motion_known: bool,
    /// What is wrong with each wheel: an `omni_fault`, or 0 for nothing.
    pub faults: [u8; N],
    /// The wheel was controlled. One that is not has no torque, and its bridge is opened or shorted: it has a fault, or all torque has ended
    /// at rest.
    pub active: [bool; N],
    /// The requested torque is outside the limits.
    pub saturated: [bool; N],
    /// The wheel is left out of the motion: faulty, lifted or slipping.
    pub excluded: [bool; N],
    /// The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a fault, so that no torque can be asked of
    /// it, or all torque has ended. At rest otherwise: all torque has ended, and the scenario asks for it (`control.rest.short_windings`).
    pub brake: [bool; N],
}

/// How far the pose may be off: standard deviations. All 0 where the drive was given no noise.
#[repr(C)]
pub struct Deviations {
    /// Of x [m].
    pub x_m: f32,
    /// Of y [m].
    pub y_m: f32,
    /// Of the heading [rad].
    pub yaw_rad: f32,
}

/// What a drive remembers. Nothing in it is for anybody else.
#[repr(C)]
pub struct State<const N: usize, const WORDS: usize> {
    ready: u32,
    memory: [u32; WORDS], // as many as build.rs counts
}

/// Marks a state that was made ready. Without it memory of the caller's would be taken for a drive's.
const READY: u32 = 0x6f6d_6e69;

impl<const N: usize, const WORDS: usize> State<N, WORDS> {
    const FITS: () = assert!(
        size_of::<DriveState<f32, N>>() <= size_of::<[u32; WORDS]>()
            && align_of::<DriveState<f32, N>>() <= align_of::<u32>()
            && size_of::<DriveState<f32, N>>() + 32 > size_of::<[u32; WORDS]>()
    );

    /// Starts afresh.
    #[inline]
    fn start(place: &mut MaybeUninit<Self>, start: DriveState<f32, N>) {
        let () = Self::FITS;
        let state = place.write(Self {
            ready: READY,
            memory: [0; WORDS],
        });
        // SAFETY: the memory is as large and as aligned as `FITS` says; what was there needs no drop.
        unsafe {
            ptr::from_mut(&mut state.memory)
                .cast::<DriveState<f32, N>>()
                .write(start)
        };
    }

    /// What is remembered; nothing where it was never made ready.
    #[inline]
    fn open(&mut self) -> Option<&mut DriveState<f32, N>> {
        let () = Self::FITS;
        if self.ready != READY {
            return None;
        }
        // SAFETY: the mark says that `start` wrote one there, and only this function gives it away.
        Some(unsafe { &mut *ptr::from_mut(&mut self.memory).cast::<DriveState<f32, N>>() })
    }
}

#[inline]
pub fn init<const N: usize, const WORDS: usize>(
    drive: Option<&Drive<f32, N>>,
    state: Option<&mut MaybeUninit<State<N, WORDS>>>,
    output: Option<&mut MaybeUninit<Output<N>>>,
) -> bool {
    let (Some(drive), Some(state), Some(output)) = (drive, state, output) else {
        return false;
    };
    State::start(state, DriveState::new(drive));
    output.write(Output {
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
        faults: [0; N],
        active: [false; N],
        saturated: [false; N],
        excluded: [false; N],
        brake: [false; N],
    });
    true
}

#[inline]
pub fn step<const N: usize, const WORDS: usize>(
    drive: Option<&Drive<f32, N>>,
    state: Option<&mut State<N, WORDS>>,
    input: Option<&Input<N>>,
    output: Option<&mut Output<N>>,
) -> bool {
    let (Some(drive), Some(state)) = (drive, state.and_then(State::open)) else {
        return false;
    };
    let (Some(input), Some(output)) = (input, output) else {
        return false;
    };
    let mut arrived = DriveInput::measured(&input.measured);
    for (reading, &received) in arrived.readings_rad_s.iter_mut().zip(&input.received) {
        if !received {
            *reading = None;
        }
    }
    arrived.command = input.commanded.then_some(input.command);
    arrived.emergency = input.emergency;
    arrived.lifted = input.lifted;
    write_output(drive.step(state, &arrived), output);
    true
}

#[inline]
fn write_output<const N: usize>(sample: DriveSample<f32, N>, output: &mut Output<N>) {
    let wheels = &sample.wheels;
    *output = Output {
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
        faults: sample.faults.map(|fault| fault.map_or(0, Fault::number)),
        active: wheels.active,
        saturated: wheels.saturated,
        excluded: sample.slip.excluded,
        brake: sample.brake,
    };
}

/// Does something to what is remembered.
#[inline]
pub fn change<const N: usize, const WORDS: usize>(
    state: Option<&mut State<N, WORDS>>,
    change: impl FnOnce(&mut DriveState<f32, N>),
) -> bool {
    state.and_then(State::open).map(change).is_some()
}

#[inline]
pub fn reset_pose<const N: usize, const WORDS: usize>(
    state: Option<&mut State<N, WORDS>>,
    [x_m, y_m, yaw_rad]: [f32; 3],
) -> bool {
    let Some(state) = state.and_then(State::open) else {
        return false;
    };
    state.odometry.reset(&PlanarPose { x_m, y_m, yaw_rad })
}

#[inline]
pub fn deviations<const N: usize, const WORDS: usize>(
    state: Option<&mut State<N, WORDS>>,
    deviations: Option<&mut Deviations>,
) -> bool {
    let (Some(state), Some(deviations)) = (state.and_then(State::open), deviations) else {
        return false;
    };
    let [x_m, y_m, yaw_rad] = state.covariance.standard_deviations();
    *deviations = Deviations { x_m, y_m, yaw_rad };
    true
}
