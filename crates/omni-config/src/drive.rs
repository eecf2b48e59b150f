//! The firmware's whole step around the loops: shaping, time-out, faults, slip, odometry.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{
    self, ACCELERATION_M_S2, ACCELERATION_RAD_S2, PERIODS, PERIODS_FROM_0, PERIODS_FROM_2, PLACE_M,
    RESIDUAL_GAIN, STALL_TORQUE_N_M, THRESHOLD_RAD_S, TIME_S, WHEEL_NOISE,
};

/// omni-core's `Drive` in the loop, which firmware runs instead of the bare loops. A table without keys selects every
/// default.
///
/// ```
/// use omni_config::{Override, Scenario};
/// let scenario = Scenario::load("flat", &[Override::parse("drive.command_timeout_s=0.2")?])?;
/// let config = scenario.drive_config::<f32, 7>()?.expect("it has a [drive]");
/// assert_eq!((config.shaping.timeout_s, config.unobservable_periods), (Some(0.2), 10));
/// assert!(Scenario::load("flat", &[])?.drive_config::<f32, 7>()?.is_none());
/// // Counts of periods that are left out are times: 20 ms without a reading.
/// let keys = ["drive={}", "control.period_s=0.002"].map(Override::parse);
/// let slow = Scenario::load("flat", &keys.into_iter().collect::<Result<Vec<_>, _>>()?)?;
/// assert_eq!(slow.drive_config::<f32, 7>()?.and_then(|config| config.faults).map(|faults| faults.silent_periods), Some(10));
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Drive {
    /// How old a command may become before the vehicle rests \[s\], 0 to 3600; 0.5 by default.
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub command_timeout_s: f64,
    /// Deceleration in an emergency stop and in a safe stop, and the most without a command
    /// \[m/s^2\], 0.001 to 1e4; 2 by default.
    #[garde(adapt(ranges), range(min = ACCELERATION_M_S2.min, max = ACCELERATION_M_S2.max))]
    pub stop_m_s2: f64,
    /// The same for the yaw rate \[rad/s^2\], 0.001 to 1e5; 8 by default.
    #[garde(adapt(ranges), range(min = ACCELERATION_RAD_S2.min, max = ACCELERATION_RAD_S2.max))]
    pub stop_rad_s2: f64,
    /// When the vehicle moves again after an emergency stop, a safe stop or a time-out, and after
    /// the start: `at_once` with the next command, `neutral` with the next one after a command of
    /// rest, 0 in every component. `at_once` by default.
    #[garde(skip)]
    pub restart: DriveRestart,
    /// Control periods with too few usable wheels for the motion before the vehicle is stopped, 0
    /// to 65534; 10 by default.
    #[serde(deserialize_with = "crate::integers::periods_from_0")]
    #[garde(adapt(ranges), range(min = PERIODS_FROM_0.min, max = PERIODS_FROM_0.max))]
    pub unobservable_periods: u32,
    /// The point of the body that moves as commanded, from the origin \[m\], -100 to 100; the origin by default.
    #[garde(adapt(ranges), inner(range(min = PLACE_M.min, max = PLACE_M.max)))]
    pub command_point_m: [f64; 2],
    /// Takes the rotation within a period into account; false by default.
    #[garde(skip)]
    pub discretize: bool,
    /// Largest velocity of every actuator \[rad/s\], 1e-9 to 1e6: faster commands are slowed down
    /// as a whole. None by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max))]
    pub speed_limit_rad_s: Option<f64>,
    /// When a wheel counts as slipping; left out: slip is not detected.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub slip: Option<DriveSlip>,
    /// When an encoder counts as faulty; left out: as a table without keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub faults: Option<DriveFaults>,
    /// Noise of the wheels for the covariance of the pose; left out: there is no covariance.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub noise: Option<DriveNoise>,
}

impl Default for Drive {
    fn default() -> Self {
        Self {
            command_timeout_s: 0.5,
            stop_m_s2: 2.0,
            stop_rad_s2: 8.0,
            restart: DriveRestart::AtOnce,
            unobservable_periods: 10,
            command_point_m: [0.0; 2],
            discretize: false,
            speed_limit_rad_s: None,
            slip: None,
            faults: None,
            noise: None,
        }
    }
}

/// Condition for motion after an automatic stop: [`omni_core::shaping::Restart`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DriveRestart {
    /// With the next command.
    #[default]
    AtOnce,
    /// With the next command after one of rest: a stick that is still pushed moves nothing.
    Neutral,
}

/// When a wheel counts as slipping: [`omni_core::drive::SlipConfig`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct DriveSlip {
    /// Slip of the actuator above which a wheel is suspected \[rad/s\], 1e-9 to 1e6; 2 by default.
    #[garde(adapt(ranges), range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max))]
    pub enter_rad_s: f64,
    /// Slip below which it is no longer suspected \[rad/s\], 1e-9 to `enter_rad_s`; 1 by default.
    #[garde(adapt(ranges), range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max))]
    pub leave_rad_s: f64,
    /// Periods in a row that it must be suspected before it is excluded, 1 to 65535. Left out: the periods of 10 ms.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::periods"
    )]
    #[garde(adapt(ranges), range(min = PERIODS.min, max = PERIODS.max))]
    pub enter_periods: Option<u32>,
    /// Periods in a row below `leave_rad_s` before it is included again, 1 to 65535. Left out: the periods of 50 ms.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::periods"
    )]
    #[garde(adapt(ranges), range(min = PERIODS.min, max = PERIODS.max))]
    pub leave_periods: Option<u32>,
}

impl Default for DriveSlip {
    fn default() -> Self {
        Self {
            enter_rad_s: 2.0,
            leave_rad_s: 1.0,
            enter_periods: None,
            leave_periods: None,
        }
    }
}

/// When an encoder's reading counts as faulty: [`omni_core::drive::FaultConfig`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct DriveFaults {
    /// Largest plausible change of a reading in a period \[rad/s\], 1e-9 to 1e6. Left out: twice the
    /// motor's no-load speed and three encoder counts; not checked if a motor has no no-load speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max))]
    pub jump_rad_s: Option<f64>,
    /// Jumps that make a wheel faulty, 1 to 65535. Left out: the periods of 5 ms.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::periods"
    )]
    #[garde(adapt(ranges), range(min = PERIODS.min, max = PERIODS.max))]
    pub jump_periods: Option<u32>,
    /// A constant reading is stuck if the velocity expected from the other wheels changes by more than
    /// this \[rad/s\], 1e-9 to 1e6. Left out: 1, or the reading of two encoder counts if
    /// that is more. Where 20 periods or fewer make a reading stuck: of as many counts as the other wheels can show
    /// together, 3.5 with four mecanum wheels and 4.1 of `chugo7`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max))]
    pub stuck_rad_s: Option<f64>,
    /// A constant reading away from its reference is stuck if the commanded torque is at least this
    /// \[N.m\], 1e-6 to 1e6: after ten times `stuck_periods`; with three wheels after `stuck_periods`
    /// if another wheel turns. A reading of 0 is stuck only once the other wheels, if they can, show that the wheel has
    /// turned by `stuck_rad_s` in that time. Left out: half the stall torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = STALL_TORQUE_N_M.min, max = STALL_TORQUE_N_M.max))]
    pub stuck_torque_n_m: Option<f64>,
    /// Periods of evidence in a row that make a reading stuck, 2 to 65535. Left out: the periods of 0.1 s or, if
    /// longer, of the time after which an encoder is known to stand: 0.1 s or the time of three counts at 0.25 rad/s,
    /// and three over the bandwidth of an observer.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::periods_from_2"
    )]
    #[garde(adapt(ranges), range(min = PERIODS_FROM_2.min, max = PERIODS_FROM_2.max))]
    pub stuck_periods: Option<u32>,
    /// Periods without a reading after which a wheel is faulty, 1 to 65535. Left out: the periods of 20 ms.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::periods"
    )]
    #[garde(adapt(ranges), range(min = PERIODS.min, max = PERIODS.max))]
    pub silent_periods: Option<u32>,
    /// Good readings in a row after which a faulty wheel is used again, 1 to 65535. Left out: the periods of 0.2 s.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::periods"
    )]
    #[garde(adapt(ranges), range(min = PERIODS.min, max = PERIODS.max))]
    pub recovery_periods: Option<u32>,
}

/// Noise of the wheels: [`omni_core::estimate::OdometryNoise`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct DriveNoise {
    /// Standard deviation of a wheel's angle after it turned by a radian, 0 to 100; 0.02 by default.
    #[garde(adapt(ranges), range(min = WHEEL_NOISE.min, max = WHEEL_NOISE.max))]
    pub wheel_rad_per_sqrt_rad: f64,
    /// Variance per squared residual of a step, 0 to 1e6; 1 by default.
    #[garde(adapt(ranges), range(min = RESIDUAL_GAIN.min, max = RESIDUAL_GAIN.max))]
    pub residual_gain: f64,
}

impl Default for DriveNoise {
    fn default() -> Self {
        Self {
            wheel_rad_per_sqrt_rad: 0.02,
            residual_gain: 1.0,
        }
    }
}

impl Drive {
    /// A key and its error that involves several keys.
    pub(crate) fn refusal(&self) -> Option<(&'static str, String)> {
        let slip = self.slip?;
        (slip.leave_rad_s > slip.enter_rad_s).then(|| {
            let message = format!(
                "{}, allowed: up to enter_rad_s, {}",
                slip.leave_rad_s, slip.enter_rad_s
            );
            ("slip.leave_rad_s", message)
        })
    }
}
