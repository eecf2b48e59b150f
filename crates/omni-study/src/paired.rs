//! Two values of an axis compared, run by run with the same seed.

use std::collections::BTreeMap;

use omni_config::Override;

use crate::map::column_of;
use crate::plan::refuse;
use crate::statistics::mean_interval;
use crate::{Cell, Error, Kind, Plan, Row, Run};

/// One combination of the axes' values, compared.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PairedCell {
    /// The value of each axis, in the study's order.
    pub axes: Vec<Cell>,
    /// Comparison of each metric.
    pub metrics: Vec<PairedMetric>,
}

/// Differences of a metric: with the combination's value less with the one that it is compared with.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PairedMetric {
    /// Seeds at which both have it.
    pub pairs: usize,
    /// Mean of the differences; yes counts 1. None without a pair.
    pub mean: Option<f64>,
    /// Its 95 % interval by Student's t ([`mean_interval`]); none of one pair.
    pub interval: Option<[f64; 2]>,
    /// Of yes and no: at how many seeds it was yes with this value alone, and with the other alone.
    pub only: Option<[usize; 2]>,
}

/// Compares every combination with the one that differs from it in the key of `baseline` alone,
/// seed by seed: what both have of a start, chance in it too, is not in the differences.
/// Combinations that have that value are not in the list, nor are those that have no such fellow.
///
/// # Errors
/// A key that is not an axis, a value that is not on it, an unknown metric.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::{Plan, paired, rows};
/// let plan = Plan::new(&Study::load("ensemble")?, &[Override::new("duration_s", 0.1)])?;
/// let rows = rows(plan.runs(), &false.into());
/// let baseline = Override::parse("control.policy=independent")?;
/// let cells = paired(&plan, &rows, &baseline, &["climbed".into()])?;
/// assert_eq!(cells.len(), 4); // the other policies
/// assert_eq!((cells[0].metrics[0].pairs, cells[0].metrics[0].only), (24, Some([0, 0]))); // a tenth of a second is for none
/// # Ok::<(), omni_study::Error>(())
/// ```
pub fn paired(
    plan: &Plan,
    rows: &[Row],
    baseline: &Override,
    metrics: &[String],
) -> Result<Vec<PairedCell>, Error> {
    let columns = metrics.iter().map(|name| column_of(plan, name));
    let columns = columns.collect::<Result<Vec<_>, _>>()?;
    let keys: Vec<_> = plan.study().axis.iter().map(|axis| axis.key.as_str()).collect();
    let axis = keys
        .iter()
        .position(|key| *key == baseline.key())
        .ok_or_else(|| {
            let meant = omni_config::did_you_mean(baseline.key(), keys.iter().copied());
            refuse(
                plan.study(),
                "baseline",
                format!("{:?}{meant}, allowed: {}", baseline.key(), keys.join(", ")),
            )
        })?;
    let wanted = Cell::from(baseline.value());
    let is_it = |cell: &Cell| match (cell.number(), wanted.number()) {
        (Some(one), Some(other)) => one == other,
        _ => *cell == wanted,
    };
    let seeds = plan.study().seeds.list().len().max(1);
    let every: Vec<&[Run]> = plan.runs().chunks(seeds).collect();
    let has_it = |runs: &[Run]| runs.first().is_some_and(|run| is_it(&run.axes[axis]));
    if !every.iter().any(|runs| has_it(runs)) {
        let mut values: Vec<String> = Vec::new();
        for value in every
            .iter()
            .filter_map(|runs| Some(runs.first()?.axes[axis].to_string()))
        {
            if !values.contains(&value) {
                values.push(value);
            }
        }
        let message = format!("{} = {wanted}, allowed: {}", baseline.key(), values.join(", "));
        return Err(refuse(plan.study(), "baseline", message));
    }
    let by_key: BTreeMap<&str, &Row> = rows.iter().map(|row| (row.key.as_str(), row)).collect();
    let measured = |run: &Run, column: usize| {
        let row = by_key.get(run.key.as_str()).filter(|row| row.error.is_none())?;
        row.metrics.get(column)?.number()
    };
    // Combinations by all their values but the axis'.
    let others = |runs: &[Run]| -> Option<String> {
        let rest = runs.first()?.axes.iter().enumerate().filter(|(i, _)| *i != axis);
        Some(rest.map(|(_, value)| format!("{value:?},")).collect())
    };
    let fellows: BTreeMap<_, _> = every
        .iter()
        .filter(|runs| has_it(runs))
        .map(|runs| (others(runs), *runs))
        .collect();
    let mut cells = Vec::new();
    for runs in every.iter().filter(|runs| !has_it(runs)) {
        let Some(fellow) = fellows.get(&others(runs)) else {
            continue;
        };
        let metric = |column: &usize| {
            // All combinations have the same seeds in the same order.
            let both = runs
                .iter()
                .zip(*fellow)
                .filter_map(|(run, other)| Some((measured(run, *column)?, measured(other, *column)?)));
            let differences: Vec<f64> = both.map(|(this, other)| this - other).collect();
            let (mean, interval) = mean_interval(&differences).unzip();
            let alone = |sign: f64| differences.iter().filter(|d| **d * sign > 0.0).count();
            PairedMetric {
                pairs: differences.len(),
                mean,
                interval: interval.flatten(),
                only: (plan.columns().metrics[*column].kind == Kind::Bool).then(|| [alone(1.0), alone(-1.0)]),
            }
        };
        cells.push(PairedCell {
            axes: runs.first().map_or_else(Vec::new, |run| run.axes.to_vec()),
            metrics: columns.iter().map(metric).collect(),
        });
    }
    Ok(cells)
}
