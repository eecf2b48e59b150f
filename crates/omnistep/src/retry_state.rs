//! The state of a run's traction control at the end of the run.

use omni_config::Scenario;
use omni_core::traction::SupervisorMode;
use omni_sim::{Outcome, Report, Verdict};

/// Watches a run for [`RetryState::note`].
pub(crate) struct RetryState {
    /// Retries that a row has.
    most: u32,
    /// What traction control is at, and retries of the present row.
    mode: SupervisorMode,
    row_retries: u32,
}

impl RetryState {
    /// For a run of a scenario.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self {
            most: scenario.max_retries().unwrap_or_default(),
            mode: SupervisorMode::Drive,
            row_retries: 0,
        }
    }

    /// Looks at what the last period showed.
    pub(crate) fn look(&mut self, report: &Report) {
        if let Some(traction) = &report.traction {
            (self.mode, self.row_retries) = (traction.mode, traction.row_retries.into());
        }
    }

    /// Says so where a run ended short of the other side because no retry was left, or while there were some.
    pub(crate) fn note(&self, outcome: &Outcome) -> Option<String> {
        if self.mode == SupervisorMode::GaveUp {
            let after = match outcome.retries.unwrap_or_default() {
                0 => "without a retry".to_owned(),
                retries => format!("after retry {retries}"),
            };
            return Some(format!("gave up {after}, and rests without torque"));
        }
        let retries = outcome.retries.filter(|retries| *retries > 0)?;
        let retries_left = self.mode != SupervisorMode::Drive || self.row_retries < self.most;
        let short = matches!(
            outcome.verdict,
            Verdict::Unfinished | Verdict::SlidAlong | Verdict::Stalled
        );
        (short && retries_left)
            .then(|| format!("still retrying at the end (retry {retries}); use a longer duration_s"))
    }
}
