//! Resolution of `control.policy = "auto"` in a scenario.

use omni_core::Real;

use super::Scenario;
use crate::control::{AUTO, AutoPolicy, LOOPS};
use crate::{Error, Precision, for_wheel_count, wheel_count_refused};

impl Scenario {
    /// The choice if the file names no policy: traction control with the available sensors, or loops of the wheels if
    /// traction control would be rejected, for example with motors that follow their command too late, or if a part of
    /// such loops is set. None if a policy is named.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let with = |key: &str, value: f64| Scenario::load("flat", &[Override::new(key, value)]);
    /// let (quick, late) = (with("actuators.torque_lag_s", 0.02)?, with("actuators.torque_lag_s", 0.2)?);
    /// assert_eq!((&*quick.control.policy, &*late.control.policy), ("traction", "scale_references"));
    /// assert!(late.auto_policy().and_then(|auto| auto.because.as_ref()).is_some_and(|because| because.contains("lag")));
    /// assert!(Scenario::load("step", &[])?.auto_policy().is_none()); // its file names one
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn auto_policy(&self) -> Option<&AutoPolicy> {
        self.auto_policy.as_ref()
    }

    /// The scenario that firmware is made of. A policy that was not named is one of the wheels'
    /// loops there, which need encoders only: nothing shows which other sensors the firmware reads.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let policy = |key: &str, value: toml::Value| -> Result<String, omni_config::Error> {
    ///     Ok(Scenario::load("flat", &[Override::new(key, value)])?.for_firmware().control.policy)
    /// };
    /// assert_eq!(policy("seed", 1.into())?, "scale_references");
    /// assert_eq!(policy("control.policy", "traction".into())?, "traction");
    /// assert_eq!(policy("control.max_retries", 3.into())?, "traction"); // only traction control tries again
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn for_firmware(&self) -> Self {
        let mut other = self.clone();
        if other.auto_policy.take().is_some() && other.has_traction() && !other.control.requires_traction() {
            other.control.policy = LOOPS.into();
        }
        other
    }

    /// The same scenario for uses that require loops of single wheels: a policy that was not named is one of them.
    ///
    /// # Errors
    /// As [`Scenario::without_traction`] if traction control is named.
    ///
    /// ```
    /// use omni_config::Scenario;
    /// assert_eq!(Scenario::load("flat", &[])?.with_loops("here")?.control.policy, "scale_references");
    /// assert!(Scenario::load("flat", &[])?.with_policy("traction")?.with_loops("here").is_err());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn with_loops(&self, place: &str) -> Result<Self, Error> {
        let other = self.for_firmware();
        other.without_traction(place)?;
        Ok(other)
    }

    /// Before anything is checked: what the keys allow.
    pub(super) fn choose_policy(&mut self) {
        if self.control.policy == AUTO {
            self.choose(match self.control.part_of_loops() {
                Some(key) => AutoPolicy::loops(format!("control.{key} is given")),
                None => AutoPolicy::traction(),
            });
        }
    }

    /// After the gains are known: whether traction control can be built.
    pub(super) fn choose_loops_if_refused(&mut self) -> Result<(), Error> {
        fn build<R: Real, const N: usize>(scenario: &Scenario) -> Result<(), Error> {
            scenario.traction_parts::<R, N>().map(drop)
        }
        if self.auto_policy.is_none() {
            return Ok(());
        }
        let count = self.vehicle.wheel.len();
        let refuse = |count| Err(self.vehicle.refuse(&wheel_count_refused(count)));
        // In what the controller computes in, as a value at a limit is rounded.
        let built = match self.control.precision {
            Precision::F32 => for_wheel_count!(count, build[f32](self), refuse),
            Precision::F64 => for_wheel_count!(count, build[f64](self), refuse),
        };
        match built {
            // The user who set it requires traction control.
            Err(error) if self.control.requires_traction() => Err(error),
            Err(error) => {
                self.choose(AutoPolicy::loops(format!(
                    "traction control is rejected: {error}"
                )));
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }

    fn choose(&mut self, mut auto: AutoPolicy) {
        self.control.policy = auto.policy.into();
        auto.without = self.missed_by_traction();
        self.auto_policy = Some(auto);
    }
}
