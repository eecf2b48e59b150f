//! The firmware's whole step around the loops: shaping, time-out, faults, slip, odometry.

use garde::Validate;
use omni_core::drive::{FaultConfig, LEAST_REDUNDANCY, SlipConfig, TractionDrive};
use omni_core::estimate::OdometryNoise;
use omni_core::geometry::{Desaturation, SpeedLimits};
use omni_core::shaping::EmergencyDeceleration;
use omni_core::{ConfigError, DriveConfig, Kinematics, Real};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{
    ACCELERATION_M_S2, ACCELERATION_RAD_S2, PERIODS, PERIODS_FROM_0, PERIODS_FROM_2, PLACE_M, RESIDUAL_GAIN,
    STALL_TORQUE_N_M, THRESHOLD_RAD_S, TIME_S, WHEEL_NOISE, within,
};
use crate::{EncoderVelocity, Error, Scenario, Vehicle, for_wheel_count};

/// omni-core's `Drive` in the loop: what firmware runs instead of the bare loops. A table without keys has every default.
///
/// ```
/// use omni_config::{Override, Scenario};
/// let scenario = Scenario::load("flat", &[Override::parse("drive.command_timeout_s=0.2")?])?;
/// let config = scenario.drive_config::<f32, 7>()?.expect("it has a [drive]");
/// assert_eq!((config.shaping.timeout_s, config.blind_periods), (Some(0.2), 10));
/// assert!(Scenario::load("flat", &[])?.drive_config::<f32, 7>()?.is_none());
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Drive {
    /// How old a command may become before the vehicle rests \[s\], 0 to 3600; 0.5 by default.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub command_timeout_s: f64,
    /// Deceleration in an emergency stop and in a safe stop \[m/s^2\], 0.001 to 1e4; 2 by default.
    #[garde(custom(within(ACCELERATION_M_S2)))]
    #[cfg_attr(feature = "schema", schemars(range(min = ACCELERATION_M_S2.min, max = ACCELERATION_M_S2.max)))]
    pub stop_m_s2: f64,
    /// The same for the yaw rate \[rad/s^2\], 0.001 to 1e5; 8 by default.
    #[garde(custom(within(ACCELERATION_RAD_S2)))]
    #[cfg_attr(feature = "schema", schemars(range(min = ACCELERATION_RAD_S2.min, max = ACCELERATION_RAD_S2.max)))]
    pub stop_rad_s2: f64,
    /// Control periods with too few usable wheels for the motion before the vehicle is stopped, 0 to 65534; 10 by default.
    #[serde(deserialize_with = "crate::integers::periods_from_0")]
    #[garde(custom(within(PERIODS_FROM_0)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PERIODS_FROM_0.min, max = PERIODS_FROM_0.max)))]
    pub blind_periods: u32,
    /// The point of the body that moves as commanded, from the origin \[m\], -100 to 100; the origin by default.
    #[garde(custom(within(PLACE_M)))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = PLACE_M.min, max = PLACE_M.max))))]
    pub command_point_m: [f64; 2],
    /// Takes the rotation within a period into account; false by default.
    #[garde(skip)]
    pub discretize: bool,
    /// Largest velocity of every actuator \[rad/s\], 1e-9 to 1e6: faster commands are slowed down as a whole. None by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(THRESHOLD_RAD_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max)))]
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
            blind_periods: 10,
            command_point_m: [0.0; 2],
            discretize: false,
            speed_limit_rad_s: None,
            slip: None,
            faults: None,
            noise: None,
        }
    }
}

/// When a wheel counts as slipping: [`SlipConfig`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct DriveSlip {
    /// Slip of the actuator above which a wheel is suspected \[rad/s\], 1e-9 to 1e6; 2 by default.
    #[garde(custom(within(THRESHOLD_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max)))]
    pub enter_rad_s: f64,
    /// Slip below which it is no longer suspected \[rad/s\], 1e-9 to `enter_rad_s`; 1 by default.
    #[garde(custom(within(THRESHOLD_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max)))]
    pub leave_rad_s: f64,
    /// Periods in a row that it must be suspected before it is excluded, 1 to 65535; 10 by default.
    #[serde(deserialize_with = "crate::integers::periods")]
    #[garde(custom(within(PERIODS)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PERIODS.min, max = PERIODS.max)))]
    pub enter_periods: u32,
    /// Periods in a row below `leave_rad_s` before it is included again, 1 to 65535; 50 by default.
    #[serde(deserialize_with = "crate::integers::periods")]
    #[garde(custom(within(PERIODS)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PERIODS.min, max = PERIODS.max)))]
    pub leave_periods: u32,
}

impl Default for DriveSlip {
    fn default() -> Self {
        Self {
            enter_rad_s: 2.0,
            leave_rad_s: 1.0,
            enter_periods: 10,
            leave_periods: 50,
        }
    }
}

/// When an encoder's reading counts as faulty: [`FaultConfig`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct DriveFaults {
    /// Largest plausible change of a reading in a period \[rad/s\], 1e-9 to 1e6. Left out: twice the motor's no-load speed and three encoder
    /// counts; not checked where a motor has no no-load speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(THRESHOLD_RAD_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max)))]
    pub jump_rad_s: Option<f64>,
    /// Jumps that make a wheel faulty, 1 to 65535; 5 by default.
    #[serde(deserialize_with = "crate::integers::periods")]
    #[garde(custom(within(PERIODS)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PERIODS.min, max = PERIODS.max)))]
    pub jump_periods: u32,
    /// A constant reading is stuck if the velocity expected from the other wheels changes by more than this \[rad/s\], 1e-9 to 1e6. Left out:
    /// 1, or what two encoder counts read as where that is more.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(THRESHOLD_RAD_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = THRESHOLD_RAD_S.min, max = THRESHOLD_RAD_S.max)))]
    pub stuck_rad_s: Option<f64>,
    /// A constant reading away from its reference is stuck if the commanded torque is at least this \[N.m\], 1e-6 to 1e6: after ten times
    /// `stuck_periods`; with three wheels after `stuck_periods` if another wheel turns. A reading of 0 is so only once the other wheels, if they
    /// can, show that the wheel has turned by `stuck_rad_s` in that time. Left out: half the stall torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(STALL_TORQUE_N_M))))]
    #[cfg_attr(feature = "schema", schemars(range(min = STALL_TORQUE_N_M.min, max = STALL_TORQUE_N_M.max)))]
    pub stuck_torque_n_m: Option<f64>,
    /// Periods of evidence in a row that make a reading stuck, 2 to 65535. Left out: 100 or, where these are more, as many as it takes until
    /// an encoder is known to stand: 0.1 s or the time of three counts at 0.25 rad/s, and three over the bandwidth of an observer.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::periods_from_2"
    )]
    #[garde(inner(custom(within(PERIODS_FROM_2))))]
    #[cfg_attr(feature = "schema", schemars(range(min = PERIODS_FROM_2.min, max = PERIODS_FROM_2.max)))]
    pub stuck_periods: Option<u32>,
    /// Periods without a reading after which a wheel is faulty, 1 to 65535; 20 by default.
    #[serde(deserialize_with = "crate::integers::periods")]
    #[garde(custom(within(PERIODS)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PERIODS.min, max = PERIODS.max)))]
    pub silent_periods: u32,
    /// Good readings in a row after which a faulty wheel is used again, 1 to 65535; 200 by default.
    #[serde(deserialize_with = "crate::integers::periods")]
    #[garde(custom(within(PERIODS)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PERIODS.min, max = PERIODS.max)))]
    pub recovery_periods: u32,
}

impl Default for DriveFaults {
    fn default() -> Self {
        Self {
            jump_rad_s: None,
            jump_periods: 5,
            stuck_rad_s: None,
            stuck_torque_n_m: None,
            stuck_periods: None,
            silent_periods: 20,
            recovery_periods: 200,
        }
    }
}

/// Noise of the wheels: [`OdometryNoise`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct DriveNoise {
    /// Standard deviation of a wheel's angle after it turned by a radian, 0 to 100; 0.02 by default.
    #[garde(custom(within(WHEEL_NOISE)))]
    #[cfg_attr(feature = "schema", schemars(range(min = WHEEL_NOISE.min, max = WHEEL_NOISE.max)))]
    pub wheel_rad_per_sqrt_rad: f64,
    /// Variance per squared residual of a step, 0 to 1e6; 1 by default.
    #[garde(custom(within(RESIDUAL_GAIN)))]
    #[cfg_attr(feature = "schema", schemars(range(min = RESIDUAL_GAIN.min, max = RESIDUAL_GAIN.max)))]
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

/// Velocity and periods of `[drive.faults]` that make a constant reading stuck, where encoders are fine enough.
const STUCK_RAD_S: f64 = 1.0;
const STUCK_PERIODS: u32 = 100;

/// A reading toggles between two counts at an edge, and another wheel's may do so at the same time: with 1.2 counts a standing wheel of chugo7
/// was called stuck in each of four drives, with 1.5 counts in none.
pub(crate) const LEAST_COUNTS: f64 = 2.0;

/// A count that was checked to be no more than 65535.
fn whole(count: u32) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

impl DriveFaults {
    fn config<R: Real>(&self) -> FaultConfig<R> {
        let mut config = FaultConfig::unchecked();
        if let Some(jump) = self.jump_rad_s {
            config.jump_rad_s = R::of(jump);
        }
        if let Some(velocity) = self.stuck_rad_s {
            config.stuck_rad_s = R::of(velocity);
        }
        if let Some(torque) = self.stuck_torque_n_m {
            config.stuck_torque_n_m = R::of(torque);
        }
        if let Some(periods) = self.stuck_periods {
            config.stuck_periods = whole(periods);
        }
        config.jump_periods = whole(self.jump_periods);
        config.silent_periods = whole(self.silent_periods);
        config.recovery_periods = whole(self.recovery_periods);
        config
    }
}

impl Drive {
    /// Puts everything but the loops, the detection of faults and the vehicle's own limits into a configuration.
    fn put_into<R: Real, const N: usize>(&self, config: &mut DriveConfig<R, N>) -> Result<(), ConfigError> {
        config.shaping.timeout_s = Some(R::of(self.command_timeout_s));
        config.shaping.emergency_deceleration = Some(EmergencyDeceleration {
            linear_m_s2: R::of(self.stop_m_s2),
            yaw_rad_s2: R::of(self.stop_rad_s2),
        });
        config.blind_periods = whole(self.blind_periods);
        config.command_point_m = self.command_point_m.map(R::of);
        config.discretize = self.discretize;
        if let Some(limit) = self.speed_limit_rad_s {
            config.speed_limits = Some(SpeedLimits::new([R::of(limit); N], Desaturation::Uniform)?);
        }
        config.slip = self.slip.map(|slip| SlipConfig {
            enter_rad_s: R::of(slip.enter_rad_s),
            leave_rad_s: R::of(slip.leave_rad_s),
            enter_periods: whole(slip.enter_periods),
            leave_periods: whole(slip.leave_periods),
        });
        config.noise = self.noise.map(|noise| OdometryNoise {
            wheel_rad_per_sqrt_rad: R::of(noise.wheel_rad_per_sqrt_rad),
            residual_gain: R::of(noise.residual_gain),
        });
        Ok(())
    }

    /// A key and what is wrong with it that no single key shows.
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

impl Scenario {
    /// What a [`omni_core::Drive`] of the scenario's vehicle is made of, in the scalar `R`; none where the scenario has no `[drive]`.
    ///
    /// # Errors
    /// As [`Scenario::controller`].
    pub fn drive_config<R: Real, const N: usize>(&self) -> Result<Option<DriveConfig<R, N>>, Error> {
        let Some(drive) = &self.drive else {
            return Ok(None);
        };
        let refuse = |error: &ConfigError| self.vehicle().refuse(error);
        let layout = self.vehicle().layout().map_err(|error| refuse(&error))?;
        let mut config = DriveConfig::new(layout, self.wheel_control()?);
        config.rest = self.control.rest.rule();
        if let Some(limits) = self.vehicle().limits {
            config.shaping.limits = limits.of_twist();
        }
        config.faults = self.drive_faults().map(|faults| faults.config());
        drive
            .put_into(&mut config)
            .map_err(|error| self.refuse_drive(&error))?;
        Ok(Some(config))
    }

    /// `[drive.faults]` with everything in place of what is left out; none without `[drive]`.
    pub(crate) fn drive_faults(&self) -> Option<DriveFaults> {
        let mut faults = self.drive?.faults.unwrap_or_default();
        let count_rad_s = self.encoder_step_rad_s().unwrap_or(0.0);
        let half_n_m = 0.5 * self.vehicle().motor.peak_torque_n_m();
        faults.stuck_torque_n_m.get_or_insert(half_n_m);
        faults
            .stuck_rad_s
            .get_or_insert(STUCK_RAD_S.max(LEAST_COUNTS * count_rad_s));
        let held = (self.held_s() / self.period_s()).ceil().min(65534.0) as u32;
        faults.stuck_periods.get_or_insert(STUCK_PERIODS.max(held));
        // From one way to the other at full speed in a period, and what single counts add to a reading.
        if let Some(no_load_rad_s) = self.vehicle().no_load_rad_s() {
            let jump_rad_s = 2.0 * no_load_rad_s + 3.0 * count_rad_s;
            faults.jump_rad_s.get_or_insert(jump_rad_s);
        }
        Some(faults)
    }

    /// How long readings may show a motion that is over, or not yet of one that has begun \[s\]: until a counter is known to stand, and what
    /// is left of an observer's transient, e^-3 of it.
    fn held_s(&self) -> f64 {
        // A loaded scenario's is one.
        let Ok(Some(estimator)) = self.velocity_estimator::<f64>() else {
            return 0.0;
        };
        match self.sensors.encoder_velocity {
            Some(EncoderVelocity::Observer { bandwidth_rad_s }) => {
                estimator.standing_s().max(3.0 / bandwidth_rad_s)
            }
            _ => estimator.standing_s(),
        }
    }

    /// Places of the wheels whose motion the other wheels do not show.
    pub(crate) fn unchecked_wheels(&self) -> Vec<usize> {
        let vehicle = self.vehicle();
        for_wheel_count!(vehicle.wheel.len(), unchecked[](vehicle), |_| Vec::new())
    }

    /// The firmware's whole step, in the scalar `R`; none where the scenario has no `[drive]`. Under traction control what is around the
    /// loops: the whole is [`Scenario::traction_drive`].
    ///
    /// # Errors
    /// As [`Scenario::controller`]; [`Error::Key`] where the drive's keys do not fit together.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// use omni_core::{DriveInput, DriveMode, DriveState, WheelVelocities};
    /// let scenario = Scenario::load("flat", &[Override::parse("drive.blind_periods=0")?])?;
    /// let drive = scenario.drive::<f64, 7>()?.expect("it has a [drive]");
    /// let mut silent = DriveInput::measured(&WheelVelocities::zero());
    /// silent.readings_rad_s = [None; 7];
    /// assert_eq!(drive.step(&mut DriveState::new(&drive), &silent).mode, DriveMode::SafeStop);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn drive<R: Real, const N: usize>(&self) -> Result<Option<omni_core::Drive<R, N>>, Error> {
        let Some(config) = self.drive_config()? else {
            return Ok(None);
        };
        let built = omni_core::Drive::new(config);
        built.map(Some).map_err(|error| self.refuse_drive(&error))
    }

    /// The firmware's whole step with traction control, in the scalar `R`; none where the scenario has no `[drive]` or its policy is one of the
    /// wheels' loops.
    ///
    /// # Errors
    /// As [`Scenario::drive`] and [`Scenario::traction`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// use omni_core::drive::{BodyReadings, TractionDriveState};
    /// use omni_core::{BodyTwist, DriveInput, WheelVelocities};
    /// let keys = [Override::new("drive.command_timeout_s", 0.5), Override::new("control.policy", "traction")];
    /// let drive = Scenario::load("step", &keys)?.traction_drive::<f64, 7>()?.expect("it has both");
    /// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// let input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
    /// let sample = drive.step(&mut TractionDriveState::new(&drive), &input, &BodyReadings::none());
    /// assert!(sample.drive.wheels.applied.n_m[3] > 0.0); // wheel 4 points ahead
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn traction_drive<R: Real, const N: usize>(&self) -> Result<Option<TractionDrive<R, N>>, Error> {
        let (Some(drive), Some((supervisor, traction))) = (self.drive()?, self.traction_parts()?) else {
            return Ok(None);
        };
        let built = TractionDrive::new(drive, supervisor, traction);
        built.map(Some).map_err(|error| self.refuse_drive(&error))
    }

    fn refuse_drive(&self, error: &ConfigError) -> Error {
        Error::Key {
            file: format!("scenario {}", self.name),
            key: format!("drive.{}", error.parameter),
            message: error.to_string(),
        }
    }
}

fn unchecked<const N: usize>(vehicle: &Vehicle) -> Vec<usize> {
    let kinematics = vehicle
        .layout()
        .and_then(|layout| Kinematics::<f64, N>::new(&layout));
    // A loaded vehicle's layout is one.
    kinematics.map_or_else(
        |_| Vec::new(),
        |kinematics| {
            let redundancy = kinematics.redundancy();
            (0..N).filter(|i| redundancy[*i] < LEAST_REDUNDANCY).collect()
        },
    )
}
