//! Rows summed up over seeds.

use std::collections::BTreeMap;

use omni_sim::Verdict;

use crate::{Cell, Plan, Row};

/// What the runs of one combination of the axes' values amount to.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MapCell {
    /// The value of each axis, in the study's order.
    pub axes: Vec<Cell>,
    /// Runs with a row.
    pub runs: usize,
    /// Runs among them that failed.
    pub errors: usize,
    /// Runs among them on balls that are not their wheels ([`Outcome::wheel_model_valid`](omni_sim::Outcome::wheel_model_valid)).
    pub beyond_balls: usize,
    /// Runs among the others that were cut off on their way, [`Verdict::Unfinished`]: longer ones might have climbed.
    pub unfinished: usize,
    /// Sum and count of each of the map's figures over the runs that did not fail and where it was measured; yes counts 1.
    pub figures: Vec<(f64, usize)>,
}

impl MapCell {
    /// The mean of the map's figure of that index; none where nothing was measured.
    #[must_use]
    pub fn mean(&self, figure: usize) -> Option<f64> {
        let (sum, count) = *self.figures.get(figure)?;
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
    let by_key: BTreeMap<&str, &Row> = rows.iter().map(|row| (row.key.as_str(), row)).collect();
    let shown: Vec<Option<usize>> = plan
        .study()
        .map
        .figures
        .iter()
        .map(|name| {
            plan.columns()
                .figures
                .iter()
                .position(|column| column.name == *name)
        })
        .collect();
    let valid = plan
        .columns()
        .figures
        .iter()
        .position(|column| column.name == "wheel_model_valid");
    let figures = &plan.columns().figures;
    let verdict = figures.iter().position(|column| column.name == "verdict");
    let mut cells: Vec<MapCell> = Vec::new();
    let seeds = plan.study().seeds.list().len();
    for runs in plan.runs().chunks(seeds.max(1)) {
        let mut cell = MapCell {
            axes: runs.first().map_or_else(Vec::new, |run| run.axes.to_vec()),
            runs: 0,
            errors: 0,
            beyond_balls: 0,
            unfinished: 0,
            figures: vec![(0.0, 0); shown.len()],
        };
        for row in runs.iter().filter_map(|run| by_key.get(run.key.as_str())) {
            cell.runs += 1;
            let valid = valid.and_then(|i| row.figures.get(i));
            cell.beyond_balls += usize::from(valid == Some(&Cell::Bool(false)));
            if row.error.is_some() {
                cell.errors += 1;
                continue;
            }
            let unfinished =
                |cell: &Cell| matches!(cell, Cell::Text(name) if name == Verdict::Unfinished.name());
            cell.unfinished += usize::from(verdict.and_then(|i| row.figures.get(i)).is_some_and(unfinished));
            for (sum, figure) in cell.figures.iter_mut().zip(&shown) {
                if let Some(number) = figure.and_then(|i| row.figures.get(i)).and_then(Cell::number) {
                    *sum = (sum.0 + number, sum.1 + 1);
                }
            }
        }
        cells.push(cell);
    }
    cells
}
