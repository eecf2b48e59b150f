//! The firmware's whole step, made of a scenario's keys.

use omni_core::drive::{FaultConfig, LEAST_REDUNDANCY, SlipConfig, TractionDrive};
use omni_core::estimate::OdometryNoise;
use omni_core::geometry::{Desaturation, SpeedLimits};
use omni_core::shaping::{self, EmergencyDeceleration};
use omni_core::{ConfigError, DriveConfig, Kinematics, Real};

use crate::drive::{Drive, DriveFaults, DriveRestart};
use crate::encoder_velocity::EncoderVelocity;
use crate::{Error, Scenario, Vehicle, for_wheel_count};

/// A reading toggles between two counts at an edge, and another wheel's may do so at the same time: with
/// 1.2 counts a standing wheel of chugo7 was called stuck in each of four drives, with 1.5 counts in none.
pub(crate) const LEAST_COUNTS: f64 = 2.0;
/// Within more periods than these, readings that toggle return, which ends the evidence of the others.
const FEW_PERIODS: u32 = 20;
/// Part of a count by which a wheel can turn faster or slower without another reading.
const OWN_COUNTS: f64 = 0.5;

/// A count that was checked to be no more than 65535.
fn whole(count: u32) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

impl DriveFaults {
    fn config<R: Real>(&self, period_s: R) -> FaultConfig<R> {
        let mut config = FaultConfig::usual(period_s);
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
        for (periods, given) in [
            (&mut config.jump_periods, self.jump_periods),
            (&mut config.silent_periods, self.silent_periods),
            (&mut config.recovery_periods, self.recovery_periods),
        ] {
            *periods = given.map_or(*periods, whole);
        }
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
        config.shaping.restart = match self.restart {
            DriveRestart::AtOnce => shaping::Restart::AtOnce,
            DriveRestart::Neutral => shaping::Restart::Neutral,
        };
        config.unobservable_periods = whole(self.unobservable_periods);
        config.command_point_m = self.command_point_m.map(R::of);
        config.discretize = self.discretize;
        if let Some(limit) = self.speed_limit_rad_s {
            config.speed_limits = Some(SpeedLimits::new([R::of(limit); N], Desaturation::Uniform)?);
        }
        config.slip = self.slip.map(|slip| {
            let usual = SlipConfig::usual(config.control.pid.period_s);
            SlipConfig {
                enter_rad_s: R::of(slip.enter_rad_s),
                leave_rad_s: R::of(slip.leave_rad_s),
                enter_periods: slip.enter_periods.map_or(usual.enter_periods, whole),
                leave_periods: slip.leave_periods.map_or(usual.leave_periods, whole),
            }
        });
        config.noise = self.noise.map(|noise| OdometryNoise {
            wheel_rad_per_sqrt_rad: R::of(noise.wheel_rad_per_sqrt_rad),
            residual_gain: R::of(noise.residual_gain),
        });
        Ok(())
    }
}

impl Scenario {
    /// The configuration of an [`omni_core::Drive`] of the scenario's vehicle, in the scalar `R`; none if the scenario
    /// has no `[drive]`.
    ///
    /// # Errors
    /// As [`Scenario::controller`].
    pub fn drive_config<R: Real, const N: usize>(&self) -> Result<Option<DriveConfig<R, N>>, Error> {
        let Some(drive) = &self.drive else {
            return Ok(None);
        };
        let mut config = self.loops_config()?;
        config.faults = self
            .drive_faults()
            .map(|faults| faults.config(config.control.pid.period_s));
        drive
            .put_into(&mut config)
            .map_err(|error| self.refuse_drive(&error))?;
        Ok(Some(config))
    }

    /// `[drive.faults]` with everything in place of what is left out; none without `[drive]`.
    pub(crate) fn drive_faults(&self) -> Option<DriveFaults> {
        let mut faults = self.drive?.faults.unwrap_or_default();
        let count_rad_s = self.encoder_step_rad_s().unwrap_or(0.0);
        let usual = FaultConfig::usual(self.period_s());
        let half_n_m = 0.5 * self.vehicle().motor.peak_torque_n_m();
        faults.stuck_torque_n_m.get_or_insert(half_n_m);
        let held = (self.held_s() / self.period_s()).ceil().min(65534.0) as u32;
        let periods = *faults
            .stuck_periods
            .get_or_insert(u32::from(usual.stuck_periods).max(held));
        faults
            .stuck_rad_s
            .get_or_insert(usual.stuck_rad_s.max(self.least_counts(periods) * count_rad_s));
        // From one way to the other at full speed in a period, and what single counts add to a reading.
        if let Some(no_load_rad_s) = self.vehicle().no_load_rad_s() {
            let jump_rad_s = 2.0 * no_load_rad_s + 3.0 * count_rad_s;
            faults.jump_rad_s.get_or_insert(jump_rad_s);
        }
        Some(faults)
    }

    /// Encoder counts by which the motion that the other wheels imply of a wheel can change at constant speed, and stay
    /// so for as many periods as make a reading stuck. Over few periods the readings of all of them may toggle at once:
    /// by four mecanum wheels that is one count of each of the other three.
    pub(crate) fn least_counts(&self, stuck_periods: u32) -> f64 {
        if stuck_periods > FEW_PERIODS {
            return LEAST_COUNTS;
        }
        let vehicle = self.vehicle();
        let others = for_wheel_count!(vehicle.wheel.len(), counts_of_others[](vehicle), |_| 0.0);
        LEAST_COUNTS.max(others + OWN_COUNTS)
    }

    /// How long readings may show a motion that is over, or not yet of one that has begun \[s\]:
    /// until a counter is known to stand, and what is left of an observer's transient, e^-3 of it.
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

    /// The firmware's whole step, in the scalar `R`; none if the scenario has no `[drive]`. Under traction control what
    /// is around the loops: the whole is [`Scenario::traction_drive`].
    ///
    /// # Errors
    /// As [`Scenario::controller`]; [`Error::Key`] if the drive's keys are inconsistent.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// use omni_core::{DriveInput, DriveMode, DriveState, WheelVelocities};
    /// let scenario = Scenario::load("flat", &[Override::parse("drive.unobservable_periods=0")?])?;
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

    /// The firmware's whole step with traction control, in the scalar `R`; none if the scenario has no `[drive]` or its
    /// policy is one of the wheels' loops.
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

    /// The drive of a scenario under traction control without a `[drive]`: limits of the command,
    /// how torque ends, the law.
    pub(crate) fn bare_traction_drive<R: Real, const N: usize>(
        &self,
    ) -> Result<Option<TractionDrive<R, N>>, Error> {
        let Some((supervisor, traction)) = self.traction_parts()?.filter(|_| self.drive.is_none()) else {
            return Ok(None);
        };
        let drive = omni_core::Drive::new(self.loops_config()?).map_err(|error| self.refuse_drive(&error))?;
        let built = TractionDrive::new(drive, supervisor, traction);
        built.map(Some).map_err(|error| self.refuse_drive(&error))
    }

    /// Layout, loops, how torque ends, and the vehicle's own limits.
    fn loops_config<R: Real, const N: usize>(&self) -> Result<DriveConfig<R, N>, Error> {
        let layout = self
            .vehicle()
            .layout()
            .map_err(|error| self.vehicle().refuse(&error))?;
        let mut config = DriveConfig::new(layout, self.wheel_control()?);
        config.rest = self.control.rest.rule();
        if let Some(limits) = self.vehicle().limits {
            config.shaping.limits = limits.of_twist();
        }
        Ok(config)
    }

    fn refuse_drive(&self, error: &ConfigError) -> Error {
        Error::Key {
            file: format!("scenario {}", self.name),
            key: format!("drive.{}", error.parameter),
            message: error.to_string(),
        }
    }
}

/// Kinematics of a loaded vehicle: none for another number of wheels.
fn kinematics<const N: usize>(vehicle: &Vehicle) -> Option<Kinematics<f64, N>> {
    let layout = vehicle.layout().ok()?;
    Kinematics::new(&layout).ok()
}

/// Largest sum of the parts that the other wheels have in what they imply of a wheel.
fn counts_of_others<const N: usize>(vehicle: &Vehicle) -> f64 {
    let Some(kinematics) = kinematics::<N>(vehicle) else {
        return 0.0;
    };
    let parts = |wheel: usize| {
        let excluded = std::array::from_fn(|i| i == wheel);
        let rest = kinematics.excluding(&excluded)?;
        let inverse = kinematics.inverse_matrix().get(wheel)?;
        let part = |other: usize| {
            let rows = rest.forward_matrix().iter();
            let sum: f64 = rows.zip(inverse).map(|(row, a)| row[other] * a).sum();
            sum.abs()
        };
        Some((0..N).filter(|other| *other != wheel).map(part).sum::<f64>())
    };
    (0..N).filter_map(parts).fold(0.0, f64::max)
}

fn unchecked<const N: usize>(vehicle: &Vehicle) -> Vec<usize> {
    let Some(kinematics) = kinematics::<N>(vehicle) else {
        return Vec::new();
    };
    let redundancy = kinematics.redundancy();
    (0..N).filter(|i| redundancy[*i] < LEAST_REDUNDANCY).collect()
}

#[cfg(test)]
mod tests;
