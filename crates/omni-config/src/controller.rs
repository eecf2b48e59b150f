//! A controller of omni-core, built from a file.

use omni_core::shaping::{AxisLimits, TwistLimiter, TwistLimits};
use omni_core::{
    ConfigError, Controller, Coordination, Kinematics, PidConfig, Real, WheelControlConfig, WheelLayout,
};

use crate::control::known_policies;
use crate::{Error, Scenario, Vehicle};

/// Calls the generic function `$f` with the wheel count as its last parameter: the one place where
/// a count that is known at run time becomes the const generic of omni-core. Vehicles have 3 to 8
/// wheels; `$otherwise` is the result for any other count.
///
/// ```
/// fn twice<const N: usize>(plus: usize) -> Option<usize> {
///     Some(2 * N + plus)
/// }
/// let of = |count: usize| omni_config::for_wheel_count!(count, twice[](1), |_| None);
/// assert_eq!((of(3), of(8), of(9)), (Some(7), Some(17), None));
/// ```
#[macro_export]
macro_rules! for_wheel_count {
    ($count:expr, $f:ident [$($r:ty),*] ($($arg:expr),*), $otherwise:expr) => {
        match $count {
            3 => $f::<$($r,)* 3>($($arg),*),
            4 => $f::<$($r,)* 4>($($arg),*),
            5 => $f::<$($r,)* 5>($($arg),*),
            6 => $f::<$($r,)* 6>($($arg),*),
            7 => $f::<$($r,)* 7>($($arg),*),
            8 => $f::<$($r,)* 8>($($arg),*),
            count => ($otherwise)(count),
        }
    };
}

/// Most wheels of a vehicle: the last count of [`for_wheel_count`].
pub const MOST_WHEELS: usize = 8;

/// The error for a vehicle with too few or too many wheels.
#[must_use]
pub fn wheel_count_refused(count: usize) -> ConfigError {
    ConfigError::new("wheel count", count as f64, "3 to 8")
}

impl Scenario {
    /// The controller of the scenario's vehicle, in the scalar `R`, whatever precision the scenario names.
    ///
    /// # Errors
    /// [`Error::Key`] if the vehicle and the control cannot be combined, or if `N` is not the number of wheels.
    ///
    /// ```
    /// use omni_config::Scenario;
    /// use omni_core::{BodyTwist, ControlState, WheelVelocities};
    /// let controller = Scenario::load("step", &[])?.controller::<f32, 7>()?;
    /// let ahead = BodyTwist { vx_m_s: 0.066_f32, vy_m_s: 0.0, wz_rad_s: 0.0 };
    /// let sample = controller.step(&mut ControlState::default(), &ahead, &WheelVelocities::zero());
    /// assert_eq!(sample.wheels.reference.rad_s[3], 1.0); // wheel 4, of 66 mm, points forward
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn controller<R: Real, const N: usize>(&self) -> Result<Controller<R, N>, Error> {
        let config = self.wheel_control()?;
        let rest = self.control.rest.rule();
        let build = || Controller::new(&self.vehicle().layout()?, config)?.with_rest(rest);
        build().map_err(|error| self.vehicle().refuse(&error))
    }

    /// The configuration of a controller of the scenario's vehicle, for example for an [`omni_core::DriveConfig`].
    ///
    /// # Errors
    /// As [`Scenario::controller`].
    ///
    /// ```
    /// let config = omni_config::Scenario::load("step", &[])?.wheel_control::<f32, 7>()?;
    /// assert_eq!((config.pid.period_s, config.pid.gains.kp_n_m_s_rad), (1e-3, 0.3));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn wheel_control<R: Real, const N: usize>(&self) -> Result<WheelControlConfig<R, N>, Error> {
        let vehicle = self.vehicle();
        let limit = vehicle
            .motor
            .limit()
            .map_err(|error| self.vehicle().refuse(&error))?;
        let gains = vehicle.gains_at(self.period_s())?;
        let mut pid = PidConfig::new(gains.pid(), R::of(self.period_s()));
        let kp_over_ki_s = gains.kp_n_m_s_rad / gains.ki_n_m_rad;
        pid.anti_windup = self
            .control
            .anti_windup(kp_over_ki_s, vehicle.motor.peak_torque_n_m());
        pid.integral_zone_rad_s = R::of(self.control.integral_zone_rad_s.unwrap_or(f64::INFINITY));
        pid.proportional_limit_n_m = R::of(self.control.proportional_limit_n_m.unwrap_or(f64::INFINITY));
        Ok(WheelControlConfig {
            pid,
            limits: [limit; N],
            coordination: self.coordination()?,
        })
    }

    /// The limiter of commands before the controller: the vehicle's limits, in the scalar `R`.
    ///
    /// # Errors
    /// [`Error::Key`] if they cannot be used with the control period; a loaded scenario has been checked.
    ///
    /// ```
    /// use omni_config::Scenario;
    /// use omni_core::shaping::TwistLimiterState;
    /// use omni_core::BodyTwist;
    /// let limiter = Scenario::load("step", &[])?.limiter::<f64>()?;
    /// let fast = BodyTwist { vx_m_s: 9.0, ..BodyTwist::ZERO };
    /// assert_eq!(limiter.step(&mut TwistLimiterState::default(), &fast).vx_m_s, 1.0); // a brisk walk is enough
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn limiter<R: Real>(&self) -> Result<TwistLimiter<R>, Error> {
        let vehicle = self.vehicle();
        let unlimited = TwistLimits::PerAxis {
            vx: AxisLimits::unlimited(),
            vy: AxisLimits::unlimited(),
            wz: AxisLimits::unlimited(),
        };
        let limits = vehicle.limits.map_or(unlimited, |limits| limits.of_twist());
        TwistLimiter::new(limits, R::of(self.period_s())).map_err(|error| Error::Key {
            file: format!("vehicle {}", vehicle.name),
            key: format!("limits.{}", error.parameter),
            message: error.to_string(),
        })
    }

    /// The control period \[s\].
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.control.period_us as f64 * 1e-6
    }

    /// Effect of one encoder count on a reading, if the resulting torque exceeds the motor's: at such a resolution the
    /// torques jump from limit to limit.
    ///
    /// # Errors
    /// As [`Scenario::wheel_control`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let scenario = |counts| Scenario::load("flat", &[Override::parse(counts)?])?.with_policy("independent");
    /// let coarse = scenario("sensors.encoder_counts=64")?.coarse_encoder()?.expect("it is");
    /// assert_eq!(coarse, "sensors.encoder_counts = 64: one count in a control period reads as 98.2 \
    ///     rad/s, for which the gains ask 29.6 N.m, but the motor has 2; use more counts or a lower kp_n_m_s_rad");
    /// assert_eq!(scenario("sensors.encoder_counts=4096")?.coarse_encoder()?, None);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn coarse_encoder(&self) -> Result<Option<String>, Error> {
        let counts = self.sensors.encoder_counts;
        if counts == 0.0 || self.has_traction() {
            return Ok(None); // traction control filters counts
        }
        let config = self.wheel_control::<f64, 1>()?;
        let whole = config
            .pid
            .encoder_step(counts)
            .map_err(|error| self.vehicle().refuse(&error))?;
        // Remaining fraction of a whole count for a method of velocity estimation.
        let left = match self.sensors.encoder_velocity {
            None => 1.0,
            Some(_) => self.encoder_step_rad_s().unwrap_or(0.0) / whole.velocity_rad_s,
        };
        let (velocity_rad_s, torque_n_m) = (left * whole.velocity_rad_s, left * whole.torque_n_m);
        let stall = self.vehicle().motor.peak_torque_n_m();
        Ok((torque_n_m > stall).then(|| {
            format!(
                "sensors.encoder_counts = {counts}: one count in a control period reads as {:.1} rad/s, for which the gains \
                 ask {:.1} N.m, but the motor has {stall}; use more counts or a lower kp_n_m_s_rad",
                velocity_rad_s, torque_n_m
            )
        }))
    }

    /// Coordination of the wheels.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for a policy that is no preset; a loaded scenario has been checked.
    pub fn coordination<R: Real>(&self) -> Result<Coordination<R>, Error> {
        self.control.coordination().ok_or_else(|| Error::UnknownName {
            kind: "policy",
            name: self.control.policy.clone(),
            known: known_policies(),
        })
    }
}

/// Whether these wheels can move a vehicle in three directions.
pub(crate) fn check_layout(vehicle: &Vehicle) -> Result<(), ConfigError> {
    for_wheel_count!(vehicle.wheel.len(), check_sized[](vehicle), |count| Err(
        wheel_count_refused(count)
    ))
}

fn check_sized<const N: usize>(vehicle: &Vehicle) -> Result<(), ConfigError> {
    let layout: WheelLayout<f64, N> = vehicle.layout()?;
    Kinematics::new(&layout).map(|_| ())
}
