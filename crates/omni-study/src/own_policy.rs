//! Runs whose controller is not the scenario's.

use std::fmt;
use std::sync::Arc;

use omni_config::Scenario;
use omni_sim::controller::AnyController;

/// Makes a controller for a scenario, freshly started.
type Make = dyn Fn(&Scenario) -> Result<AnyController, omni_sim::Error> + Send + Sync;

/// A controller of somebody's own for the runs of a plan. Two with the same identity are taken for the same: rows of one stand for those of
/// the other.
///
/// ```
/// use omni_core::{Policy, Readings};
/// use omni_sim::{config::{Override, Scenario, Seeds}, controller::AnyController};
/// use omni_study::{Cell, OwnPolicy, Plan, row};
/// struct Push(f64);
/// impl Policy<f64> for Push {
///     fn reset(&mut self) {}
///     fn step(&mut self, _: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
///         torques_n_m.fill(self.0);
///     }
/// }
/// let push = |torque_n_m: f64| {
///     let make = move |scenario: &Scenario| AnyController::own(scenario, Box::new(Push(torque_n_m)));
///     OwnPolicy::new("push", format!("{torque_n_m} N.m"), make)
/// };
/// let plan = |policy| {
///     let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
///     Plan::of_scenarios_until("one", vec![(Vec::new(), scenario)], Seeds::Count(1), Some(policy), &false.into())
/// };
/// let (weak, strong) = (plan(push(0.1))?, plan(push(0.2))?);
/// assert_ne!(weak.runs()[0].key, strong.runs()[0].key);
/// let row = row(&weak.runs()[0], &false.into()).expect("not stopped");
/// assert_eq!((row.error, &row.axes[0]), (None, &Cell::Text("push".into())));
/// # Ok::<(), omni_study::Error>(())
/// ```
#[derive(Clone)]
pub struct OwnPolicy {
    name: String,
    identity: String,
    make: Arc<Make>,
}

impl OwnPolicy {
    /// `name` is what rows call it, `identity` what tells it from every other: another law or other numbers, another identity.
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

    /// What tells it from every other.
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
