//! The results of runs as a table: a column for each run, a row for each metric.

use omni_sim::{LimitedBy, Metric, Outcome};

use crate::output::aligned;

/// Largest width of a table in characters, unless one run alone needs more.
const WIDTH: usize = 80;

/// Contents of a table for one run.
pub(super) struct Run<'a> {
    /// What heads its column.
    pub(super) name: String,
    /// What else distinguishes it from other runs: title and word, the same titles for every run.
    pub(super) labels: Vec<(&'static str, String)>,
    /// What it amounts to; none of a log without an end or without a simulation.
    pub(super) outcome: Option<&'a Outcome>,
    /// What stands instead of a verdict where there is no outcome.
    pub(super) otherwise: &'static str,
    /// What of its drive has stopped it for good.
    pub(super) stopped: Option<String>,
    /// Simulated time over time on the clock.
    pub(super) realtime: Option<f64>,
}

impl<'a> Run<'a> {
    pub(super) fn new(name: impl Into<String>, outcome: &'a Outcome) -> Self {
        Self {
            name: name.into(),
            labels: Vec::new(),
            outcome: Some(outcome),
            otherwise: "",
            stopped: None,
            realtime: None,
        }
    }

    fn verdict(&self) -> String {
        let said = self
            .outcome
            .map_or(self.otherwise, |outcome| outcome.verdict.name());
        said.to_owned()
    }

    fn limited(&self) -> Option<&'static str> {
        self.outcome?.limited_by.map(LimitedBy::name)
    }

    fn metric(&self, metric: &Metric) -> String {
        let shown = self.outcome.and_then(|outcome| metric.shown(outcome));
        shown.unwrap_or_else(|| "-".into())
    }
}

/// Title and meaning of the row that no outcome has.
const REALTIME: (&str, &str) = (
    "real-time factor",
    "Simulated time over computing time on this machine.",
);

/// The row of runs that stalled or were cut off.
const LIMITED: (&str, &str) = (
    "limited by",
    "What kept the vehicle from its way: the motors' torque, the friction of the ground, or the time.",
);

/// The row of runs that their drive stopped.
const STOPPED: (&str, &str) = (
    "stopped by",
    "What of the drive stopped the vehicle, and it was not released until the run's end.",
);

/// The metrics that a table of these runs has.
fn needed(runs: &[Run<'_>]) -> Vec<Metric> {
    let of_some = |metric: &Metric| {
        let mut outcomes = runs.iter().filter_map(|run| run.outcome);
        outcomes.any(|outcome| metric.is_of(outcome))
    };
    Metric::ALL.into_iter().filter(of_some).collect()
}

/// The table, its lines ended, with `corner` over the rows' titles. Runs that do not fit beside one
/// another follow below; so many belong `together`.
pub(super) fn results(corner: &str, runs: &[Run<'_>], together: usize) -> String {
    let rows = rows(runs);
    let wide =
        |texts: &mut dyn Iterator<Item = &str>| texts.map(|text| text.chars().count()).max().unwrap_or(0);
    // Each column has a space on both sides and a bar behind it; one bar stands before all.
    let titles = 4 + wide(&mut rows.iter().map(|row| row.0.as_str()).chain([corner]));
    let width = |k: &usize| {
        let cells = rows.iter().map(|row| row.1[*k].as_str());
        3 + wide(&mut cells.chain([runs[*k].name.as_str()]))
    };
    let all: Vec<_> = (0..runs.len()).collect();
    let (mut blocks, mut left) = (Vec::<Vec<usize>>::new(), 0);
    for group in all.chunks(together.max(1)) {
        let needed: usize = group.iter().map(width).sum();
        match blocks.last_mut() {
            Some(block) if needed <= left => {
                block.extend(group);
                left -= needed;
            }
            _ => {
                blocks.push(group.to_vec());
                left = WIDTH.saturating_sub(titles + needed);
            }
        }
    }
    let mut text = String::new();
    for block in blocks {
        if !text.is_empty() {
            text.push('\n');
        }
        let header = std::iter::once(corner.to_owned()).chain(block.iter().map(|k| runs[*k].name.clone()));
        let lines = rows.iter().map(|(title, cells)| {
            std::iter::once(title.clone()).chain(block.iter().map(|k| cells[*k].clone()))
        });
        text += &format!("{}\n", aligned(header, lines, 1));
    }
    text
}

/// Title and cells of every row.
fn rows(runs: &[Run<'_>]) -> Vec<(String, Vec<String>)> {
    let mut rows = Vec::new();
    for (k, (title, _)) in runs.first().map_or(&[][..], |run| &run.labels).iter().enumerate() {
        let words = runs.iter().map(|run| run.labels[k].1.clone()).collect();
        rows.push(((*title).to_owned(), words));
    }
    rows.push(("verdict".into(), runs.iter().map(Run::verdict).collect()));
    if runs.iter().any(|run| run.limited().is_some()) {
        let limited = |run: &Run<'_>| run.limited().unwrap_or("-").to_owned();
        rows.push((LIMITED.0.into(), runs.iter().map(limited).collect()));
    }
    if runs.iter().any(|run| run.stopped.is_some()) {
        let stopped = |run: &Run<'_>| run.stopped.clone().unwrap_or_else(|| "-".into());
        rows.push((STOPPED.0.into(), runs.iter().map(stopped).collect()));
    }
    for metric in needed(runs) {
        rows.push((
            metric.heading(),
            runs.iter().map(|run| run.metric(&metric)).collect(),
        ));
    }
    if runs.iter().any(|run| run.realtime.is_some()) {
        let factor = |run: &Run<'_>| {
            run.realtime
                .map_or_else(|| "-".into(), |factor| format!("{factor:.1}"))
        };
        rows.push((REALTIME.0.into(), runs.iter().map(factor).collect()));
    }
    rows
}

/// What each metric of the table says: a line each, with its name in JSON, logs and Python.
pub(super) fn explained(runs: &[Run<'_>]) -> String {
    let mut text = String::from("\nWhat the metrics mean, and their names in JSON, logs and Python:\n");
    let mut line =
        |title: &str, key: &str, meaning: &str| text += &format!("- {title} (`{key}`): {meaning}\n");
    line("verdict", "verdict", "How the run ended.");
    let mut verdicts: Vec<_> = runs.iter().filter_map(|run| Some(run.outcome?.verdict)).collect();
    verdicts.dedup();
    let mut shown = Vec::new();
    for verdict in verdicts {
        if !shown.contains(&verdict) {
            shown.push(verdict);
            text += &format!("  {}: {}\n", verdict.name(), verdict.meaning());
        }
    }
    if runs.iter().any(|run| run.limited().is_some()) {
        text += &format!("- {} (`limited_by`): {}\n", LIMITED.0, LIMITED.1);
    }
    if runs.iter().any(|run| run.stopped.is_some()) {
        text += &format!("- {}: {}\n", STOPPED.0, STOPPED.1);
    }
    let mut line =
        |title: &str, key: &str, meaning: &str| text += &format!("- {title} (`{key}`): {meaning}\n");
    for metric in needed(runs) {
        line(&metric.heading(), metric.key, metric.meaning);
    }
    if runs.iter().any(|run| run.realtime.is_some()) {
        line(REALTIME.0, "realtime_factor", REALTIME.1);
    }
    text + "With an obstacle, averages cover the crossing; without one, the whole run. docs/metrics.md defines each metric.\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_that_do_not_fit_beside_one_another_follow_below_and_no_line_is_too_long() {
        let scenario = omni_config::Scenario::load("flat", &[]).expect("built in");
        let outcome = Outcome::unfinished(&scenario);
        let names = (0..14).map(|k| format!("step-scale_references-seed{k}.mcap"));
        let runs: Vec<_> = names.map(|name| Run::new(name, &outcome)).collect();
        let text = results("log", &runs, 1);
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(
            runs.iter().all(|run| text.contains(&format!("| {} |", run.name))),
            "{text}"
        );
        // Nothing was measured: no row but the verdict.
        assert!(!text.contains("slip"), "{text}");
    }
}
