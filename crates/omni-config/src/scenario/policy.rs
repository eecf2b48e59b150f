//! What `control.policy = "auto"` is in a scenario.

use super::Scenario;
use crate::control::AUTO;
use crate::{Error, for_wheel_count, wheel_count_refused};

/// The policy that `control.policy = "auto"` is in a scenario.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct AutoPolicy {
    /// Its name.
    pub policy: &'static str,
    /// Why it is not traction control, in a clause; none where it is.
    pub because: Option<String>,
    /// What traction control does without, a line each, as of [`Scenario::traction_notes`].
    pub without: Vec<String>,
}

impl Scenario {
    /// What was chosen where the file names no policy: traction control with the sensors that there are, and loops of the wheels
    /// where traction control would be refused, as with motors that follow their command too late, or where a part of such loops
    /// is given. None where a policy is named.
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

    /// The same scenario for where only loops of single wheels will do: a policy that was not named is one of them.
    ///
    /// # Errors
    /// As [`Scenario::without_traction`] where traction control is named.
    ///
    /// ```
    /// use omni_config::Scenario;
    /// assert_eq!(Scenario::load("flat", &[])?.with_loops("here")?.control.policy, "scale_references");
    /// assert!(Scenario::load("flat", &[])?.with_policy("traction")?.with_loops("here").is_err());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn with_loops(&self, place: &str) -> Result<Self, Error> {
        let mut other = self.clone();
        if self.has_traction() && self.auto_policy.is_some() {
            other.choose(AutoPolicy::loops(format!(
                "traction control is not allowed {place}"
            )));
        }
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
    pub(super) fn choose_loops_if_refused(&mut self) {
        fn build<const N: usize>(scenario: &Scenario) -> Result<(), Error> {
            scenario.traction_parts::<f32, N>().map(drop)
        }
        // Who gave `max_retries` wants traction control, and is told what is wrong.
        if self.auto_policy.is_none() || self.control.max_retries.is_some() {
            return;
        }
        let count = self.vehicle.wheel.len();
        let refuse = |count| Err(self.vehicle.refuse(&wheel_count_refused(count)));
        if let Err(error) = for_wheel_count!(count, build[](self), refuse) {
            self.choose(AutoPolicy::loops(format!("traction control is refused: {error}")));
        }
    }

    fn choose(&mut self, mut auto: AutoPolicy) {
        self.control.policy = auto.policy.into();
        auto.without = self.missed_by_traction();
        self.auto_policy = Some(auto);
    }
}

impl AutoPolicy {
    fn traction() -> Self {
        Self {
            policy: crate::control::TRACTION,
            because: None,
            without: Vec::new(),
        }
    }

    /// Of the loops, those that keep the ratios of the wheels' speeds.
    fn loops(because: String) -> Self {
        Self {
            policy: "scale_references",
            because: Some(because),
            without: Vec::new(),
        }
    }
}
