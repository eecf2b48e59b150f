//! Runs with a user's own controller.

use std::fmt;
use std::sync::Arc;

use omni_config::Scenario;
use omni_sim::controller::AnyController;

/// Makes a controller for a scenario, freshly started.
type Make = dyn Fn(&Scenario) -> Result<AnyController, omni_sim::Error> + Send + Sync;

/// The user's own controller for the runs of a plan. Two with the same identity are taken for the
/// same: rows of one stand for those of the other.
///
/// ```
/// use omni_sim::{config::{Override, Scenario, Seeds}, controller::AnyController};
/// use omni_study::{Cell, OwnPolicy, Plan, row};
/// // It stands for a law of one's own: `AnyController::own`.
/// let own = |identity: &str| OwnPolicy::new("mine", identity, |scenario: &Scenario| AnyController::new(scenario));
/// let plan = |own| {
///     let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
///     Plan::of_scenarios_until("one", vec![(Vec::new(), scenario)], Seeds::Count(1), Some(own), &false.into())
/// };
/// let (one, other) = (plan(own("gain 0.1"))?, plan(own("gain 0.2"))?);
/// assert_ne!(one.runs()[0].key, other.runs()[0].key);
/// let row = row(&one.runs()[0], &false.into()).expect("not stopped");
/// assert_eq!((row.error, &row.axes[0]), (None, &Cell::Text("mine".into())));
/// # Ok::<(), omni_study::Error>(())
/// ```
#[derive(Clone)]
pub struct OwnPolicy {
    name: String,
    identity: String,
    make: Arc<Make>,
}

impl OwnPolicy {
    /// `name` is what rows call it, `identity` what distinguishes it from every other: another law
    /// or other numbers, another identity.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        identity: impl Into<String>,
        make: impl Fn(&Scenario) -> Result<AnyController, omni_sim::Error> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            identity: identity.into(),
            make: Arc::new(make),
        }
    }

    /// What rows call it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What distinguishes it from every other.
    #[must_use]
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// A controller for a scenario, freshly started.
    ///
    /// # Errors
    /// Whatever its maker says.
    pub fn controller(&self, scenario: &Scenario) -> Result<AnyController, omni_sim::Error> {
        (self.make)(scenario)
    }
}

impl PartialEq for OwnPolicy {
    fn eq(&self, other: &Self) -> bool {
        (&self.name, &self.identity) == (&other.name, &other.identity)
    }
}

impl fmt::Debug for OwnPolicy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OwnPolicy({:?}, {:?})", self.name, self.identity)
    }
}
