//! Notices about a plan before it runs.

use omni_config::Scenario;

use crate::Plan;

impl Plan {
    /// How many runs there is something to be said of, as that they are on balls that are not their wheels, and what of the first;
    /// nothing where there are none. All seeds of a combination are alike: `why` is asked once of them.
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

    /// What traction control does without in some runs ([`Scenario::traction_notes`]); nothing with a controller of one's own.
    ///
    /// ```
    /// use omni_config::{Override, Study};
    /// use omni_study::Plan;
    /// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("sensors.no_imu", true)])?;
    /// let said = plan.traction_notes().expect("there is something");
    /// assert!(said.starts_with("24 of 120 runs: traction without an inertial measurement unit: "));
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    #[must_use]
    pub fn traction_notes(&self) -> Option<String> {
        if self.runs().iter().any(|run| run.own_policy().is_some()) {
            return None;
        }
        self.said_of(|scenario| {
            let notes = scenario.traction_notes();
            (!notes.is_empty()).then(|| notes.join("; "))
        })
    }
}
