//! Notices about a plan before it runs.

use omni_config::Scenario;

use crate::Plan;

impl Plan {
    /// How many runs there is something to be said of, as that they are on balls that are not their wheels, and what
    /// of the first; nothing if there are none. All seeds of a combination are alike: `why` is asked once of them.
    ///
    /// ```
    /// use omni_config::{Override, Study};
    /// use omni_study::Plan;
    /// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("duration_s", 0.5)])?;
    /// let said = plan.said_of(|scenario| (scenario.control.policy == "scale_torques").then(|| "by the paper".into()));
    /// assert_eq!(said.as_deref(), Some("24 of 120 runs: by the paper")); // 24 seeds, five policies
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    #[must_use]
    pub fn said_of(&self, why: impl Fn(&Scenario) -> Option<String>) -> Option<String> {
        let (runs, seeds) = (self.runs(), self.study().seeds.list().len().max(1));
        let mut whys = runs.chunks(seeds).filter_map(|same| why(&same.first()?.scenario));
        let first = whys.next()?;
        Some(format!(
            "{} of {} runs: {first}",
            seeds * (1 + whys.count()),
            runs.len()
        ))
    }

    /// What traction control does without in some runs ([`Scenario::traction_notes`]), and that some
    /// have another policy than the others where none is named; nothing with a controller of one's own.
    ///
    /// ```
    /// use omni_config::{Override, Study};
    /// use omni_study::Plan;
    /// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("sensors.no_imu", true)])?;
    /// assert!(plan.policy_notes()[0].starts_with("24 of 120 runs: traction without an inertial measurement unit: "));
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    #[must_use]
    pub fn policy_notes(&self) -> Vec<String> {
        if self.runs().iter().any(|run| run.own_policy().is_some()) {
            return Vec::new();
        }
        let without = self.said_of(|scenario| {
            let notes = scenario.traction_notes();
            (!notes.is_empty()).then(|| notes.join("; "))
        });
        let chosen = |scenario: &Scenario| scenario.auto_policy().map(|auto| auto.policy);
        let first = self.runs().first().and_then(|run| chosen(&run.scenario));
        let differ = self.runs().iter().any(|run| chosen(&run.scenario) != first);
        let other = self.said_of(|scenario| {
            let auto = scenario.auto_policy().filter(|_| differ)?;
            let because = auto.because.as_ref()?;
            Some(format!("policy {}, because {because}", auto.policy))
        });
        without.into_iter().chain(other).collect()
    }
}
