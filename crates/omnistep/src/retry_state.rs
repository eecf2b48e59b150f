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
    /// Highest edge that a wheel has climbed, and the highest that the vehicle climbs \[m\].
    edge_m: f64,
    climbs_m: Option<f64>,
}

impl RetryState {
    /// For a run of a scenario.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        Self {
            most: scenario.max_retries().unwrap_or_default(),
            mode: SupervisorMode::Drive,
            row_retries: 0,
            edge_m: 0.0,
            climbs_m: scenario.control.climbs_m,
        }
    }

    /// Looks at what the last period showed.
    pub(crate) fn look(&mut self, report: &Report) {
        if let Some(traction) = &report.traction {
            (self.mode, self.row_retries) = (traction.mode, traction.row_retries.into());
            self.edge_m = traction.edge_m;
        }
    }

    /// Says so where a run ended short of the other side because no retry was left, or while there were some.
    pub(crate) fn note(&self, outcome: &Outcome) -> Option<String> {
        if self.mode == SupervisorMode::GaveUp {
            let after = match outcome.retries.unwrap_or_default() {
                0 => "without a retry".to_owned(),
                retries => format!("after retry {retries}"),
            };
            let beyond = self.climbs_m.filter(|climbs_m| self.edge_m > *climbs_m);
            let edge = beyond.map_or_else(String::new, |climbs_m| {
                format!(": edge {:.0} mm, chart {:.0}", 1e3 * self.edge_m, 1e3 * climbs_m)
            });
            return Some(format!("gave up {after}{edge}, and rests without torque"));
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
