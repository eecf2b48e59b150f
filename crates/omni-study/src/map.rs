//! Statistics of rows over seeds.

use std::collections::BTreeMap;

use omni_sim::Verdict;

use crate::plan::refuse;
use crate::statistics::{mean_interval, wilson};
use crate::{Cell, Error, Kind, Plan, Row};

/// Summary of the runs of one combination of the axes' values.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MapCell {
    /// The value of each axis, in the study's order.
    pub axes: Vec<Cell>,
    /// Runs with a row.
    pub runs: usize,
    /// Runs among them that failed.
    pub errors: usize,
    /// Runs among them on balls that are not their wheels
    /// ([`Outcome::wheel_model_valid`](omni_sim::Outcome::wheel_model_valid)).
    pub beyond_balls: usize,
    /// Runs among the others that were cut off on their way, [`Verdict::Unfinished`]: longer ones might have climbed.
    pub unfinished: usize,
    /// Sum and count of each of the map's metrics over the runs that did not fail and in which it was measured; yes
    /// counts 1.
    pub metrics: Vec<(f64, usize)>,
    /// 95 % interval of each of them: of yes and no Wilson's score ([`wilson`]), of a number's mean
    /// Student's t ([`mean_interval`]); none of one number.
    pub intervals: Vec<Option<[f64; 2]>>,
}

impl MapCell {
    /// The mean of the map's metric of that index; none if nothing was measured.
    #[must_use]
    pub fn mean(&self, metric: usize) -> Option<f64> {
        let (sum, count) = *self.metrics.get(metric)?;
        (count > 0).then(|| sum / count as f64)
    }
}

/// One cell a combination, in the plan's order.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::{Plan, cells, rows};
/// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("duration_s", 0.1)])?;
/// let cells = cells(&plan, &rows(&plan.runs()[..2], &false.into()));
/// assert_eq!((cells[0].runs, cells[0].errors), (2, 0)); // two of its seeds are there
/// # Ok::<(), omni_study::Error>(())
/// ```
#[must_use]
pub fn cells(plan: &Plan, rows: &[Row]) -> Vec<MapCell> {
    // A plan rejects unknown metrics.
    cells_of(plan, rows, &plan.study().map.metrics).unwrap_or_default()
}

/// [`cells`] of other metrics than the map's.
///
/// # Errors
/// A metric that is none, or that is text.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::{Plan, cells_of, rows};
/// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("duration_s", 0.1)])?;
/// let rows = rows(&plan.runs()[..2], &false.into());
/// let cells = cells_of(&plan, &rows, &["climbed".into(), "energy_residual".into()])?;
/// assert_eq!(cells[0].metrics[0], (0.0, 2)); // none of two climbed: at most two of three would, 95 times of a hundred
/// assert!(cells[0].intervals[0].is_some_and(|[low, high]| low == 0.0 && (high - 0.658).abs() < 1e-3));
/// assert!(cells_of(&plan, &rows, &["verdict".into()]).is_err());
/// # Ok::<(), omni_study::Error>(())
/// ```
pub fn cells_of(plan: &Plan, rows: &[Row], metrics: &[String]) -> Result<Vec<MapCell>, Error> {
    let by_key: BTreeMap<&str, &Row> = rows.iter().map(|row| (row.key.as_str(), row)).collect();
    let shown = metrics.iter().map(|name| column_of(plan, name));
    let shown = shown.collect::<Result<Vec<_>, _>>()?;
    let valid = plan
        .columns()
        .metrics
        .iter()
        .position(|column| column.name == "wheel_model_valid");
    let metrics = &plan.columns().metrics;
    let verdict = metrics.iter().position(|column| column.name == "verdict");
    let mut cells: Vec<MapCell> = Vec::new();
    let seeds = plan.study().seeds.list().len();
    for runs in plan.runs().chunks(seeds.max(1)) {
        let mut cell = MapCell {
            axes: runs.first().map_or_else(Vec::new, |run| run.axes.to_vec()),
            runs: 0,
            errors: 0,
            beyond_balls: 0,
            unfinished: 0,
            metrics: Vec::new(),
            intervals: Vec::new(),
        };
        let mut measured = vec![Vec::new(); shown.len()];
        for row in runs.iter().filter_map(|run| by_key.get(run.key.as_str())) {
            cell.runs += 1;
            let valid = valid.and_then(|i| row.metrics.get(i));
            cell.beyond_balls += usize::from(valid == Some(&Cell::Bool(false)));
            if row.error.is_some() {
                cell.errors += 1;
                continue;
            }
            let unfinished =
                |cell: &Cell| matches!(cell, Cell::Text(name) if name == Verdict::Unfinished.name());
            cell.unfinished += usize::from(verdict.and_then(|i| row.metrics.get(i)).is_some_and(unfinished));
            for (measured, metric) in measured.iter_mut().zip(&shown) {
                measured.extend(row.metrics.get(*metric).and_then(Cell::number));
            }
        }
        for (measured, metric) in measured.iter().zip(&shown) {
            // From 0: the sum of none would be -0.
            let sum = measured.iter().fold(0.0, |sum, number| sum + number);
            cell.metrics.push((sum, measured.len()));
            cell.intervals
                .push(if plan.columns().metrics[*metric].kind == Kind::Bool {
                    wilson(sum as usize, measured.len())
                } else {
                    mean_interval(measured).and_then(|(_, interval)| interval)
                });
        }
        cells.push(cell);
    }
    Ok(cells)
}

/// Which column a metric is; it must be a number, or yes and no.
pub(crate) fn column_of(plan: &Plan, metric: &str) -> Result<usize, Error> {
    let columns = &plan.columns().metrics;
    let found = columns
        .iter()
        .position(|column| column.name == metric && column.kind != Kind::Text);
    found.ok_or_else(|| {
        let known: Vec<_> = columns
            .iter()
            .filter(|column| column.kind != Kind::Text)
            .map(|column| column.name.as_str())
            .collect();
        let meant = omni_config::did_you_mean(metric, known.iter().copied());
        refuse(
            plan.study(),
            "metrics",
            format!("{metric:?}{meant}, allowed: {}", known.join(", ")),
        )
    })
}
