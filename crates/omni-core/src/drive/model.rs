//! A whole drive: its parts, checked once.

use super::config::DriveConfig;
use super::faults::{FaultConfig, FaultMonitor};
use super::slip::{SlipConfig, SlipDetector};
use crate::constants::constant_struct;
use crate::error::within;
use crate::estimate::{CovarianceGrowth, Odometry, OdometryNoise};
use crate::geometry::{Kinematics, SpeedLimits};
use crate::loops::Controller;
use crate::shaping::CommandShaper;
use crate::{ConfigError, Real};

/// A vehicle's whole controller: readings and commands in, torques out. Immutable; the changing state is in
/// [`DriveState`](crate::DriveState).
///
/// In order: readings are judged, faulty wheels are released, and the motion is estimated from the remaining wheels;
/// the command is checked, limited, moved to the origin and scaled to the wheels' speed limits; the loops run; the pose
/// is integrated.
///
/// ```
/// use omni_core::{BodyTwist, Coordination, Drive, DriveConfig, DriveInput, DriveMode, DriveState, PidConfig, PidGains};
/// use omni_core::{TorqueLimit, WheelControlConfig, WheelLayout, WheelVelocities};
/// let gains = PidGains { kp_n_m_s_rad: 0.3_f64, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.0 };
/// let control = WheelControlConfig {
///     pid: PidConfig::new(gains, 1e-3),
///     limits: [TorqueLimit::constant(2.0)?; 7],
///     coordination: Coordination::scale_references(),
/// };
/// let drive = Drive::new(DriveConfig::new(WheelLayout::chugo7(0.30, 0.23, 0.066)?, control))?;
/// let mut state = DriveState::new(&drive);
/// let forward = BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 };
/// let mut input = DriveInput::measured(&WheelVelocities::zero()).with_command(forward);
/// input.readings_rad_s[4] = None; // no reading of wheel 5
/// let sample = drive.step(&mut state, &input);
/// assert_eq!((sample.mode, sample.wheels.applied.n_m[4]), (DriveMode::Degraded, 0.0));
/// assert!((sample.wheels.applied.n_m[0] - (0.3 + 0.002) * 0.3 / 0.066).abs() < 1e-12); // the others drive on
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
// No `Option`: C initialises one of these, and lays out none.
#[repr(C)]
pub struct Drive<R, const N: usize> {
    pub(super) controller: Controller<R, N>,
    pub(super) shaper: CommandShaper<R>,
    pub(super) slip: SlipDetector<R>,
    pub(super) faults: FaultMonitor<R>,
    pub(super) odometry: Odometry<R, N>,
    /// Without effect unless `limits_speed`.
    pub(super) speed_limits: SpeedLimits<R, N>,
    /// Without effect unless `grows_covariance`.
    pub(super) growth: CovarianceGrowth<R>,
    pub(super) command_point_m: [R; 2],
    pub(super) period_s: R,
    pub(super) unobservable_periods: u16,
    pub(super) limits_speed: bool,
    pub(super) grows_covariance: bool,
    pub(super) discretize: bool,
}

constant_struct!(Drive<R, const N> {
    controller: Controller<R, N>,
    shaper: CommandShaper<R>,
    slip: SlipDetector<R>,
    faults: FaultMonitor<R>,
    odometry: Odometry<R, N>,
    speed_limits: SpeedLimits<R, N>,
    growth: CovarianceGrowth<R>,
    command_point_m: [R; 2],
    period_s: R,
    unobservable_periods: u16,
    limits_speed: bool,
    grows_covariance: bool,
    discretize: bool,
});

impl<R: Real, const N: usize> Drive<R, N> {
    /// A drive as configured.
    ///
    /// # Errors
    /// As the parts, with the parameter out of range: [`Controller::with_forward`], [`CommandShaper::new`],
    /// [`SlipDetector::new`], [`FaultMonitor::new`], [`CovarianceGrowth::new`]; `command_point_m` outside +-1000 m;
    /// those of [`Controller::with_rest`].
    pub fn new(config: DriveConfig<R, N>) -> Result<Self, ConfigError> {
        let period_s = config.control.pid.period_s;
        for p in config.command_point_m {
            within("command_point_m", p, -1e3..=1e3, "-1000 to 1000")?;
        }
        Ok(Self {
            controller: Controller::with_forward(&config.layout, config.control, config.forward)?
                .with_rest(config.rest)?,
            shaper: CommandShaper::new(config.shaping, period_s)?,
            slip: SlipDetector::new(config.slip.unwrap_or_else(SlipConfig::never))?,
            faults: FaultMonitor::new(config.faults.unwrap_or_else(FaultConfig::unchecked))?,
            odometry: Odometry::new(period_s)?,
            speed_limits: config.speed_limits.unwrap_or_else(SpeedLimits::none),
            growth: CovarianceGrowth::new(config.noise.unwrap_or_else(OdometryNoise::none))?,
            command_point_m: config.command_point_m,
            period_s,
            unobservable_periods: config.unobservable_periods,
            limits_speed: config.speed_limits.is_some(),
            grows_covariance: config.noise.is_some(),
            discretize: config.discretize,
        })
    }

    /// The maps between twist and wheel velocities with every wheel trusted.
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics<R, N> {
        self.controller.kinematics()
    }

    /// [`WheelController::shorts_at_rest`](crate::loops::WheelController::shorts_at_rest) of its loops.
    #[must_use]
    pub fn shorts_at_rest(&self) -> bool {
        self.controller.shorts_at_rest()
    }
}
