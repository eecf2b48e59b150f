//! The set-up that examples of this documentation share. Not part of the interface: it may change at any time.

use crate::ConfigError;
use crate::drive::{Drive, DriveConfig, Expectation, FaultConfig, TractionDrive};
use crate::estimate::{EstimatorConfig, GroundOdometry, GroundOdometryConfig};
use crate::geometry::{Kinematics, WheelLayout, WheelVelocities};
use crate::linkage::{CarriedWheel, Linkage};
use crate::loops::{Coordination, PidConfig, PidGains, WheelControlConfig};
use crate::motor::{DcMotorConfig, ThermalConfig, TorqueLimit};
use crate::path::{PathLimits, PlanarInertia, TrajectoryPlanner};
use crate::shaping::{AxisLimits, MotionLimits, TwistLimiter, TwistLimits};
use crate::traction::{Supervisor, SupervisorConfig, Traction, TractionConfig, TractionWheel};

/// Where the wheels of [`layout`] stand: x, y \[m\].
const PLACES_M: [[f64; 2]; 4] = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]];

/// A mecanum vehicle of 0.6 m by 0.4 m with wheels of 0.1 m.
pub fn layout() -> Result<WheelLayout<f64, 4>, ConfigError> {
    WheelLayout::mecanum4(0.6, 0.4, 0.1)
}

/// Independent loops of 1 ms with torques of at most `limit_n_m`.
pub fn loops<const N: usize>(
    kp_n_m_s_rad: f64,
    ki_n_m_rad: f64,
    limit_n_m: f64,
) -> Result<WheelControlConfig<f64, N>, ConfigError> {
    Ok(WheelControlConfig {
        pid: PidConfig::new(PidGains::pi(kp_n_m_s_rad, ki_n_m_rad), 1e-3),
        limits: [TorqueLimit::constant(limit_n_m)?; N],
        coordination: Coordination::independent(),
    })
}

/// Traction control `traction` of the vehicle of [`layout`], with motors of 2 N.m.
pub fn traction() -> Result<Traction<f64, 4>, ConfigError> {
    traction_with(TractionConfig::traction(0.3, 2.0, 1e-3))
}

/// The same with another configuration.
pub fn traction_with(config: TractionConfig<f64>) -> Result<Traction<f64, 4>, ConfigError> {
    let limit = TorqueLimit::constant(2.0)?;
    let wheels = PLACES_M.map(|place_m| TractionWheel {
        limit,
        inertia_kg_m2: 0.002,
        carrier: [1.0, 0.0],
        place_m,
    });
    let carried = PLACES_M.map(|[x, y]| CarriedWheel {
        body: 0,
        centre_m: [x, y, 0.1],
    });
    Traction::new(
        Kinematics::new(&layout()?)?,
        Linkage::new(&[], &carried)?,
        wheels,
        config,
    )
}

/// The supervisor of [`traction`].
pub fn supervisor() -> Result<Supervisor<f64, 4>, ConfigError> {
    Supervisor::new(&PLACES_M, SupervisorConfig::traction(1e-3))
}

/// A drive of the same vehicle and motors.
pub fn drive() -> Result<Drive<f64, 4>, ConfigError> {
    Drive::new(DriveConfig::new(layout()?, loops(0.3, 2.0, 2.0)?))
}

/// A drive with traction control.
pub fn traction_drive() -> Result<TractionDrive<f64, 4>, ConfigError> {
    TractionDrive::new(drive()?, supervisor()?, traction()?)
}

/// A limiter of 1 ms that limits nothing but what is faster than `velocity` along an axis \[m/s, rad/s\].
pub fn limiter(velocity: f64) -> Result<TwistLimiter<f64>, ConfigError> {
    let axis = AxisLimits::symmetric(velocity, f64::INFINITY, f64::INFINITY, f64::INFINITY);
    let [vx, vy, wz] = [axis; 3];
    TwistLimiter::new(TwistLimits::PerAxis { vx, vy, wz }, 1e-3)
}

/// A motor of 12 V, 2 ohm, 0.05 N.m/A and 0.1 A without load.
pub fn motor() -> DcMotorConfig<f64> {
    DcMotorConfig {
        torque_constant_n_m_a: 0.05,
        resistance_ohm: 2.0,
        no_load_current_a: 0.1,
        supply_v: 12.0,
        current_limit_a: None,
    }
}

/// A motor of 1 N.m continuous and 2 N.m peak, 10 s, derated from 0.8 on, in periods of 10 ms.
pub fn thermal() -> ThermalConfig<f64> {
    ThermalConfig {
        continuous_torque_n_m: 1.0,
        peak_torque_n_m: 2.0,
        time_constant_s: 10.0,
        derating_start: 0.8,
        period_s: 0.01,
    }
}

/// Faults: jumps of 2 rad/s for 5 periods, 100 periods stuck, 20 silent, 200 until a wheel has recovered.
pub fn faults() -> FaultConfig<f64> {
    let mut config = FaultConfig::unchecked();
    (config.jump_rad_s, config.jump_periods) = (2.0, 5);
    (config.stuck_rad_s, config.stuck_torque_n_m, config.stuck_periods) = (1.0, 1e9, 100);
    (config.silent_periods, config.recovery_periods) = (20, 200);
    config
}

/// Nothing is known of what wheels should read.
pub fn nothing_expected<const N: usize>() -> Expectation<'static, f64, N> {
    Expectation {
        by_others: &const { WheelVelocities::zero() },
        checked: &[false; N],
        reference: &const { WheelVelocities::zero() },
        torque_n_m: &[0.0; N],
    }
}

/// Limits of a mecanum vehicle of 20 kg: 0.5 m/s, 1 m/s^2.
pub fn path_limits() -> Result<PathLimits<f64, 4>, ConfigError> {
    let motion = MotionLimits {
        velocity: 0.5,
        acceleration: 1.0,
        deceleration: 1.0,
        jerk: 10.0,
    };
    let body = PlanarInertia {
        mass_kg: 20.0,
        yaw_kg_m2: 1.0,
        centre_m: [0.0; 2],
    };
    let torques = [TorqueLimit::constant(3.0)?; 4];
    Ok(PathLimits::new(motion, motion, body, [25.0; 4], torques))
}

/// Trajectories of this vehicle on the wheels of [`layout`].
pub fn planner() -> Result<TrajectoryPlanner<f64, 4>, ConfigError> {
    TrajectoryPlanner::new(&Kinematics::new(&layout()?)?, path_limits()?)
}

/// Ground odometry of the vehicle of [`layout`], each 5 ms.
pub fn ground_odometry() -> Result<GroundOdometry<f64, 4>, ConfigError> {
    let wheel = |[x, y]: [f64; 2]| CarriedWheel {
        body: 0,
        centre_m: [x, y, 0.1],
    };
    let linkage = Linkage::new(&[], &PLACES_M.map(wheel))?;
    GroundOdometry::new(
        GroundOdometryConfig::new(),
        EstimatorConfig::new(5e-3),
        &layout()?,
        linkage,
    )
}
