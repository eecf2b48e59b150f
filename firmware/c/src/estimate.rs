//! What the functions of `Estimator` have in common: pose and velocity from wheels, gyro and accelerometer.

use core::mem::MaybeUninit;

use omni_core::estimate::{Estimator, EstimatorInput, EstimatorState, EstimatorStep, PoseCovariance};
use omni_core::geometry::PlanarPose;
use omni_core::policy::Imu;
use omni_core::{BodyTwist, WheelVelocities};

use crate::drive::Deviations;
use crate::memory::{EstimatorMemory, Memory};
use crate::status::{Status, at, finite};

/// Readings of an estimator in a period. All zero: nothing is read.
#[repr(C)]
pub struct PoseInput<const N: usize> {
    /// Actuator velocities [rad/s]; each used only if it was `received`.
    pub measured: WheelVelocities<f32, N>,
    /// Inertial measurement unit of the base; used only if `imu_received`.
    pub imu: Imu<f32>,
    /// The encoder's reading arrived.
    pub received: [bool; N],
    /// The unit's reading arrived.
    pub imu_received: bool,
    /// The vehicle is commanded to stand.
    pub commanded_rest: bool,
}

/// Pose and velocity of the vehicle, by an estimator. Nothing in it is ever NaN.
#[repr(C)]
pub struct PoseOutput {
    /// Pose.
    pub pose: PlanarPose<f32>,
    /// Its standard deviations.
    pub deviations: Deviations,
    /// Velocity.
    pub twist: BodyTwist<f32>,
    /// Common slip of the wheels: their velocity less that.
    pub slip: BodyTwist<f32>,
    /// Zero of the gyro [rad/s].
    pub gyro_bias_rad_s: f32,
    /// Its standard deviation [rad/s].
    pub gyro_bias_deviation_rad_s: f32,
    /// Covariance of the pose: x, y, yaw, in m and rad.
    pub covariance: [[f32; 3]; 3],
    /// Covariance of the forward and lateral velocity [m^2/s^2].
    pub velocity_covariance: [[f32; 2]; 2],
    /// Normalised innovation squared of the readings, summed
    /// over all `readings`.
    pub nis: f32,
    /// Number of these readings.
    pub readings: u32,
    /// The vehicle stands.
    pub standing: bool,
    /// The step was taken; false if the state would be no number; it then stays.
    pub taken: bool,
}

impl PoseOutput {
    #[inline]
    fn of<const N: usize>(state: &EstimatorState<f32, N>, step: Option<&EstimatorStep<f32>>) -> Self {
        let covariance = state.covariance();
        let [x_m, y_m, yaw_rad] = covariance.standard_deviations();
        Self {
            pose: state.pose(),
            deviations: Deviations { x_m, y_m, yaw_rad },
            twist: state.twist(),
            slip: state.slip(),
            gyro_bias_rad_s: state.gyro_bias_rad_s(),
            gyro_bias_deviation_rad_s: state.gyro_bias_deviation_rad_s(),
            covariance: *covariance.matrix(),
            velocity_covariance: state.velocity_covariance(),
            nis: step.map_or(0.0, |step| step.nis),
            readings: step.map_or(0, |step| step.readings as u32),
            standing: step.is_some_and(|step| step.standing),
            taken: step.is_some_and(|step| step.taken),
        }
    }
}

#[inline]
pub fn init<const N: usize, const WORDS: usize>(
    estimator: Option<&Estimator<f32, N>>,
    state: Option<&mut MaybeUninit<EstimatorMemory<N, WORDS>>>,
    output: Option<&mut MaybeUninit<PoseOutput>>,
) -> Result<(), Status> {
    let (estimator, state, output) = (at(estimator)?, at(state)?, at(output)?);
    let start = estimator.start();
    output.write(PoseOutput::of(&start, None));
    EstimatorMemory::start(state, start);
    Ok(())
}

#[inline]
pub fn step<const N: usize, const WORDS: usize>(
    estimator: Option<&Estimator<f32, N>>,
    state: Option<&mut EstimatorMemory<N, WORDS>>,
    input: Option<&PoseInput<N>>,
    output: Option<&mut PoseOutput>,
) -> Result<(), Status> {
    let (estimator, state, input, output) = (at(estimator)?, at(state)?, at(input)?, at(output)?);
    let state = state.open()?;
    let mut wheels = input.measured;
    for (rad_s, &received) in wheels.rad_s.iter_mut().zip(&input.received) {
        if !received {
            *rad_s = f32::NAN;
        }
    }
    let imu = if input.imu_received {
        input.imu
    } else {
        Imu::silent()
    };
    let mut read = EstimatorInput::with_imu(&wheels, &imu, &BodyTwist::ZERO);
    read.commanded_rest = input.commanded_rest;
    let step = estimator.step(state, &read);
    *output = PoseOutput::of(state, Some(&step));
    Ok(())
}

#[inline]
pub fn reset<const N: usize, const WORDS: usize>(
    state: Option<&mut EstimatorMemory<N, WORDS>>,
    pose: Option<&PlanarPose<f32>>,
    deviations: Option<&Deviations>,
) -> Result<(), Status> {
    let (state, pose, off) = (at(state)?, at(pose)?, at(deviations)?);
    let state = state.open()?;
    let variances = [off.x_m, off.y_m, off.yaw_rad].map(|off| if off >= 0.0 { off * off } else { f32::NAN });
    let known = PoseCovariance::diagonal(variances).map_err(|_| Status::NotFinite)?;
    finite(state.reset(pose, &known))
}
