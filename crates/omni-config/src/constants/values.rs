//! What constants are written of: the parts of a scenario's controller in `f32`.

use omni_core::constants::Constant;
use omni_core::estimate::{Encoder, EncoderConfig, LONGEST_WINDOW};
use omni_core::shaping::TwistLimiter;

use crate::{Error, PlannedPath, Scenario, for_wheel_count, wheel_count_refused};

/// Bits of an encoder's counter. One that has more is right too: its lower half counts as one of 16.
const COUNTER_BITS: u32 = 16;

/// What a scenario's controller is made of, in `f32`.
pub(super) struct Values {
    pub(super) traction: Option<TractionValues>,
    /// The firmware's whole step, if the scenario has a `[drive]`.
    pub(super) drive: Option<Box<dyn Constant>>,
    pub(super) controller: Box<dyn Constant>,
    /// Torque limits of each wheel's motor.
    pub(super) motors: Box<dyn Constant>,
    pub(super) limiter: TwistLimiter<f32>,
    /// From an encoder's counter to a velocity.
    pub(super) encoder: Option<Encoder<f32, LONGEST_WINDOW>>,
    pub(super) path: Option<PlannedPath>,
    /// Of pose and velocity; none if the period is too long for one.
    pub(super) estimator: Option<Box<dyn Constant>>,
}

/// Traction control, if it is the scenario's policy.
pub(super) struct TractionValues {
    pub(super) supervisor: Box<dyn Constant>,
    pub(super) traction: Box<dyn Constant>,
}

impl Scenario {
    /// What its controller is made of.
    pub(super) fn values(&self) -> Result<Values, Error> {
        fn controller<const N: usize>(scenario: &Scenario) -> Result<Box<dyn Constant>, Error> {
            Ok(Box::new(scenario.controller::<f32, N>()?))
        }
        fn drive<const N: usize>(scenario: &Scenario) -> Result<Option<Box<dyn Constant>>, Error> {
            if let Some(drive) = scenario.traction_drive::<f32, N>()? {
                return Ok(Some(Box::new(drive)));
            }
            let drive = scenario.drive::<f32, N>()?;
            Ok(drive.map(|drive| Box::new(drive) as Box<dyn Constant>))
        }
        fn traction<const N: usize>(scenario: &Scenario) -> Result<Option<TractionValues>, Error> {
            let parts = scenario.traction_parts::<f32, N>()?;
            Ok(parts.map(|(supervisor, traction)| TractionValues {
                supervisor: Box::new(supervisor),
                traction: Box::new(traction),
            }))
        }
        fn motors<const N: usize>(scenario: &Scenario) -> Result<Box<dyn Constant>, Error> {
            Ok(Box::new(scenario.wheel_control::<f32, N>()?.limits))
        }
        fn estimator<const N: usize>(scenario: &Scenario) -> Option<Box<dyn Constant>> {
            let estimator = scenario.estimator::<f32, N>().ok()?;
            Some(Box::new(estimator))
        }
        let count = self.vehicle().wheel.len();
        let refused = |count| {
            Err(Error::Key {
                file: format!("vehicle {}", self.vehicle().name),
                key: "wheel".into(),
                message: wheel_count_refused(count).to_string(),
            })
        };
        Ok(Values {
            traction: for_wheel_count!(count, traction[](self), |_| Ok(None))?,
            drive: for_wheel_count!(count, drive[](self), |_| Ok(None))?,
            controller: for_wheel_count!(count, controller[](self), refused)?,
            motors: for_wheel_count!(count, motors[](self), refused)?,
            limiter: self.limiter()?,
            encoder: self.encoder_values()?,
            path: self.planned_path()?,
            estimator: for_wheel_count!(count, estimator[](self), |_| None),
        })
    }

    /// The drive of a scenario under traction control that has no `[drive]`: limits of the command,
    /// how torque ends, and nothing else around the law, which is what is simulated.
    pub(super) fn bare_traction_values(&self) -> Result<Option<Box<dyn Constant>>, Error> {
        fn bare<const N: usize>(scenario: &Scenario) -> Result<Option<Box<dyn Constant>>, Error> {
            let drive = scenario.bare_traction_drive::<f32, N>()?;
            Ok(drive.map(|drive| Box::new(drive) as Box<dyn Constant>))
        }
        for_wheel_count!(self.vehicle().wheel.len(), bare[](self), |_| Ok(None))
    }

    fn encoder_values(&self) -> Result<Option<Encoder<f32, LONGEST_WINDOW>>, Error> {
        let counts = self.sensors.encoder_counts;
        if counts == 0.0 {
            return Ok(None);
        }
        let config = EncoderConfig {
            counts_per_turn: counts as f32,
            bits: COUNTER_BITS,
            velocity: self.velocity_method(),
            period_s: self.period_s() as f32,
        };
        Encoder::new(config).map(Some).map_err(|error| Error::Key {
            file: format!("scenario {}", self.name),
            key: "sensors.encoder_counts".into(),
            message: error.to_string(),
        })
    }
}
