//! The state of a run's traction control at the end of the run.

use omni_config::Scenario;
use omni_core::SupervisorMode;
use omni_sim::{Outcome, Simulation, Verdict};

/// Its signals that are looked at: what it is at, tries of the present row.
const SIGNALS: [&str; 2] = ["traction_mode", "traction_tries"];

/// Watches a run for [`RetryState::note`].
pub(crate) struct RetryState {
    /// Columns of [`SIGNALS`]; none where there is no traction control.
    columns: Option<[usize; 2]>,
    /// Tries that a row has.
    most: u32,
    last: [f64; 2],
}

impl RetryState {
    /// For a run of a scenario by a controller with these signals of its own.
    pub(crate) fn new(scenario: &Scenario, signals: &[String]) -> Self {
        let [mode, tries] = SIGNALS.map(|wanted| signals.iter().position(|name| name == wanted));
        Self {
            columns: mode.zip(tries).map(|(mode, tries)| [mode, tries]),
            most: scenario.max_retries().unwrap_or_default(),
            last: [0.0; 2],
        }
    }

    /// Looks at what the last period showed.
    pub(crate) fn look(&mut self, simulation: &Simulation) {
        let own = &simulation.sample().own;
        for (last, column) in self.last.iter_mut().zip(self.columns.into_iter().flatten()) {
            *last = own.get(column).copied().unwrap_or_default();
        }
    }

    /// Says so where a run ended short of the other side because no try was left, or while there were some.
    pub(crate) fn note(&self, outcome: &Outcome) -> Option<String> {
        let [mode, tries] = self.last;
        if mode == f64::from(SupervisorMode::GaveUp.number()) {
            let after = match outcome.retries.unwrap_or_default() {
                0 => "without a retry".to_owned(),
                retries => format!("after retry {retries}"),
            };
            return Some(format!("gave up {after}, and rests without torque"));
        }
        let retries = outcome.retries.filter(|retries| *retries > 0)?;
        let drives = mode == f64::from(SupervisorMode::Drive.number());
        let tries_left = !drives || tries < f64::from(self.most);
        let short = matches!(outcome.verdict, Verdict::Unfinished | Verdict::Stalled);
        (short && tries_left)
            .then(|| format!("still retrying at the end (retry {retries}); use a longer duration_s"))
    }
}
