//! The velocities that a scenario's encoder counts make, and the resolution of a reading.

use std::fmt;

use omni_core::estimate::{LONGEST_WINDOW, VelocityConfig, VelocityEstimator, VelocityMethod};

use crate::encoder_velocity::EncoderVelocity;
use crate::{Error, Scenario};

/// Part of the top speed beyond which one count per period is too much.
const MOST_SHARE: f64 = 0.05;

impl EncoderVelocity {
    fn method<R: omni_core::Real>(self) -> VelocityMethod<R> {
        match self {
            Self::Window { periods } => VelocityMethod::Window { periods },
            Self::Edges {} => VelocityMethod::Edges,
            Self::Observer { bandwidth_rad_s } => VelocityMethod::Observer {
                bandwidth_rad_s: R::of(bandwidth_rad_s),
            },
        }
    }
}

/// Effect of one encoder count on a reading, relative to the actuators' intended speed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct EncoderReading {
    /// Counts per turn.
    pub counts: f64,
    /// Velocity that one count in a control period is \[rad/s\].
    pub count_rad_s: f64,
    /// What a reading is off by at most at a steady velocity \[rad/s\]: a count in a period or,
    /// with `sensors.encoder_velocity`, what is left of it; 0 if edges are stamped.
    pub step_rad_s: f64,
    /// The fastest that an actuator is meant to turn \[rad/s\]: a limit of the commanded twist, or
    /// its motor's speed without load.
    pub top_rad_s: f64,
}

impl EncoderReading {
    /// [`EncoderReading::step_rad_s`] as a part of the top speed.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.step_rad_s / self.top_rad_s
    }
}

impl fmt::Display for EncoderReading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            counts,
            count_rad_s,
            step_rad_s,
            top_rad_s,
        } = self;
        let percent = 100.0 * count_rad_s / top_rad_s;
        write!(
            f,
            "{counts} counts a turn: one count in a control period reads as {count_rad_s:.2} rad/s, {percent:.1} % of the top speed of {top_rad_s:.1} rad/s"
        )?;
        if step_rad_s < count_rad_s {
            let left = 100.0 * self.share();
            write!(
                f,
                "; sensors.encoder_velocity reduces this to {step_rad_s:.2} rad/s, {left:.1} %"
            )?;
        }
        Ok(())
    }
}

impl Scenario {
    /// The method that computes velocities from the counts of the scenario's encoders, over one control period if
    /// `sensors.encoder_velocity` is left out; none if there are no counts.
    ///
    /// # Errors
    /// [`Error::Key`] if the method is not compatible with the control period; a loaded scenario has been checked.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// use omni_core::estimate::VelocityState;
    /// let keys = ["sensors.encoder_counts=360", r#"sensors.encoder_velocity={ kind = "window", periods = 4 }"#];
    /// let keys = keys.iter().map(|key| Override::parse(key)).collect::<Result<Vec<_>, _>>()?;
    /// let estimator = Scenario::load("flat", &keys)?.velocity_estimator::<f64>()?.expect("asked for");
    /// let read = estimator.step(&mut VelocityState::default(), 1, None);
    /// assert!((read - 250.0_f64.to_radians()).abs() < 1e-9); // a degree in 4 ms
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn velocity_estimator<R: omni_core::Real>(
        &self,
    ) -> Result<Option<VelocityEstimator<R, LONGEST_WINDOW>>, Error> {
        let counts = self.sensors.encoder_counts;
        if counts == 0.0 {
            return Ok(None);
        }
        let config = VelocityConfig {
            method: self.velocity_method(),
            count_rad: R::of(std::f64::consts::TAU / counts),
            period_s: R::of(self.period_s()),
        };
        VelocityEstimator::new(config)
            .map(Some)
            .map_err(|error| Error::Key {
                file: format!("scenario {}", self.name),
                key: format!("sensors.encoder_velocity.{}", error.parameter),
                message: format!(
                    "{}, allowed: {} ({} s)",
                    error.value,
                    error.allowed,
                    self.period_s()
                ),
            })
    }

    /// How velocities are made of counts.
    pub(crate) fn velocity_method<R: omni_core::Real>(&self) -> VelocityMethod<R> {
        let method = self.sensors.encoder_velocity.map(|velocity| velocity.method());
        method.unwrap_or_default()
    }

    /// Readings that the state of such an estimator has to hold the counts of.
    pub(crate) fn velocity_window(&self) -> usize {
        match self.velocity_method::<f64>() {
            VelocityMethod::Window { periods } => usize::from(periods),
            _ => 1,
        }
    }

    /// What is wrong with `sensors.encoder_velocity` that no single key shows: the key and why.
    pub(crate) fn encoder_velocity_refusal(&self) -> Option<(String, String)> {
        if self.sensors.encoder_velocity.is_some() && self.sensors.encoder_counts == 0.0 {
            let message = "set without encoder counts, allowed: only with sensors.encoder_counts above 0";
            return Some(("sensors.encoder_velocity".into(), message.into()));
        }
        match self.velocity_estimator::<f64>() {
            Err(Error::Key { key, message, .. }) => Some((key, message)),
            _ => None,
        }
    }

    /// What a reading is off by at most at a steady velocity for the counts of its encoders
    /// \[rad/s\]; none without counts.
    pub(crate) fn encoder_step_rad_s(&self) -> Option<f64> {
        let counts = self.sensors.encoder_counts;
        let count_rad = std::f64::consts::TAU / counts;
        (counts > 0.0).then(|| match self.sensors.encoder_velocity {
            None => count_rad / self.period_s(),
            Some(EncoderVelocity::Window { periods }) => count_rad / (f64::from(periods) * self.period_s()),
            Some(EncoderVelocity::Edges {}) => 0.0,
            Some(EncoderVelocity::Observer { bandwidth_rad_s }) => {
                bandwidth_rad_s * count_rad / std::f64::consts::E
            }
        })
    }

    /// What one count makes of a reading against the top speed; none without counts, and if nothing limits the speed.
    ///
    /// # Errors
    /// As [`crate::Vehicle::condition_number`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let keys = [Override::parse("vehicle=omni3")?, Override::parse("sensors.encoder_counts=360")?];
    /// let reading = Scenario::load("flat", &keys)?.encoder_reading()?.expect("it has counts and limits");
    /// assert!((reading.count_rad_s - 17.453).abs() < 1e-3); // a degree in a millisecond
    /// assert!((reading.top_rad_s - 16.0).abs() < 1e-9); // sideways at 0.8 m/s, wheels of 50 mm
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn encoder_reading(&self) -> Result<Option<EncoderReading>, Error> {
        let (Some(step_rad_s), Some(top_rad_s)) = (self.encoder_step_rad_s(), self.vehicle().top_rad_s()?)
        else {
            return Ok(None);
        };
        let counts = self.sensors.encoder_counts;
        Ok(Some(EncoderReading {
            counts,
            count_rad_s: std::f64::consts::TAU / counts / self.period_s(),
            step_rad_s,
            top_rad_s,
        }))
    }

    /// Doubt about the scenario's encoders: an error of a reading above a twentieth of the top speed.
    ///
    /// # Errors
    /// As [`Scenario::encoder_reading`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let warning = |extra: &str| {
    ///     let keys = ["vehicle=omni3", "sensors.encoder_counts=360", extra];
    ///     let keys = keys.iter().map(|key| Override::parse(key)).collect::<Result<Vec<_>, _>>()?;
    ///     Scenario::load("flat", &keys)?.encoder_warning()
    /// };
    /// let said = warning("duration_s=1")?.expect("coarse");
    /// assert!(said.starts_with("sensors.encoder_counts = 360: a reading is off by up to 109.1 % of the top speed of 16.0 rad/s"));
    /// assert_eq!(warning(r#"sensors.encoder_velocity={ kind = "edges" }"#)?, None);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn encoder_warning(&self) -> Result<Option<String>, Error> {
        let reading = self.encoder_reading()?;
        let coarse = reading.filter(|reading| reading.share() > MOST_SHARE);
        Ok(coarse.map(|reading| {
            let mend = match self.sensors.encoder_velocity {
                None => "use more counts or sensors.encoder_velocity",
                Some(EncoderVelocity::Window { .. }) => "use more counts or a longer window",
                Some(_) => "use more counts or a lower bandwidth",
            };
            let (percent, top_rad_s) = (100.0 * reading.share(), reading.top_rad_s);
            format!(
                "sensors.encoder_counts = {}: a reading is off by up to {percent:.1} % of the top speed of {top_rad_s:.1} rad/s; {mend}",
                reading.counts
            )
        }))
    }
}
