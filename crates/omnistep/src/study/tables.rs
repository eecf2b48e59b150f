//! The map of a study as text.

use omni_config::Override;
use omni_study::{Cell, Kind, MapCell, PairedCell, PairedMetric, Plan};

use crate::output::aligned;

/// One table for each metric and combination of the axes that are not the map's. With less than two
/// axes, metrics are the rows of one table.
pub(super) fn tables(plan: &Plan, map: &[MapCell]) -> String {
    let study = plan.study();
    let metrics = || study.map.metrics.iter().enumerate();
    let key = |axis: usize| study.axis[axis].key.clone();
    let all: Vec<_> = map.iter().collect();
    let (x, y) = match study.map_axes() {
        (Some(x), Some(y)) => (x, y),
        (x, _) => {
            let labels = x.map_or_else(|| vec!["all".into()], |x| texts(&values(map, x)));
            let row = |(i, name): (usize, &String)| {
                let cells = all.iter().map(|cell| shown(plan, cell, i));
                (name.clone(), cells.collect())
            };
            let corner = x.map_or_else(|| study.name.clone(), key);
            return grid(corner, labels, metrics().map(row));
        }
    };
    let rest: Vec<usize> = (0..study.axis.len())
        .filter(|axis| ![x, y].contains(axis))
        .collect();
    let (columns, rows) = (values(map, x), values(map, y));
    let mut text = String::new();
    for (fixed, cells) in grouped(&all, &rest) {
        for (i, name) in metrics() {
            let row = |label: &&Cell| {
                let at = |column: &&Cell| {
                    let found = cells
                        .iter()
                        .find(|cell| cell.axes[x] == **column && cell.axes[y] == **label);
                    found.map_or_else(String::new, |cell| shown(plan, cell, i))
                };
                (label.to_string(), columns.iter().map(at).collect())
            };
            let corner = format!("{} \\ {}", key(y), key(x));
            let fixed = rest
                .iter()
                .zip(&fixed)
                .map(|(axis, value)| format!(", {} = {value}", key(*axis)));
            text += &format!("{name}{}\n", fixed.collect::<String>());
            text += &grid(corner, texts(&columns), rows.iter().map(row));
            text += "\n";
        }
    }
    text
}

/// The values of an axis, each once, in their order.
fn values(map: &[MapCell], axis: usize) -> Vec<&Cell> {
    let mut values = Vec::new();
    for cell in map {
        if !values.contains(&&cell.axes[axis]) {
            values.push(&cell.axes[axis]);
        }
    }
    values
}

fn texts(cells: &[&Cell]) -> Vec<String> {
    cells.iter().map(|cell| cell.to_string()).collect()
}

/// The cells of each combination of some axes' values, in their order.
fn grouped<'a>(map: &[&'a MapCell], axes: &[usize]) -> Vec<(Vec<&'a Cell>, Vec<&'a MapCell>)> {
    let mut groups: Vec<(Vec<&Cell>, Vec<&MapCell>)> = Vec::new();
    for cell in map {
        let values: Vec<&Cell> = axes.iter().map(|axis| &cell.axes[*axis]).collect();
        match groups.iter_mut().find(|(known, _)| *known == values) {
            Some((_, cells)) => cells.push(cell),
            None => groups.push((values, vec![cell])),
        }
    }
    groups
}

/// How each combination differs from the one with the baseline, one row per combination.
pub(super) fn baseline(plan: &Plan, baseline: &Override, cells: &[PairedCell]) -> String {
    let study = plan.study();
    let keys = study.axis.iter().map(|axis| axis.key.clone());
    let header: Vec<String> = keys.chain(study.map.metrics.iter().cloned()).collect();
    let rows = cells.iter().map(|cell| {
        let values = cell.axes.iter().map(ToString::to_string);
        values
            .chain(cell.metrics.iter().map(difference))
            .collect::<Vec<_>>()
    });
    let table = aligned(header, rows, study.axis.len());
    format!(
        "difference from {} = {}, seed by seed\n{table}\n\n",
        baseline.key(),
        Cell::from(baseline.value())
    )
}

/// `+3 -1 of 24` for yes and no: with this value alone, with the other alone.
/// `+0.012 +- 0.004 (24)` for a number: mean, 95 % interval, pairs.
fn difference(metric: &PairedMetric) -> String {
    match (metric.only, metric.mean) {
        (_, None) => "-".into(),
        (Some([here, there]), _) => format!("+{here} -{there} of {}", metric.pairs),
        (None, Some(mean)) => {
            let sign = if mean < 0.0 { "" } else { "+" };
            format!(
                "{sign}{} ({})",
                with_interval(mean, metric.interval),
                metric.pairs
            )
        }
    }
}

/// `22/24 (74-98 %)` for yes and no, the mean with four digits and half its interval for a number, `-` where nothing
/// was measured; failed runs aside, and beside who climbed those that had no time to. Intervals are of 95 %.
fn shown(plan: &Plan, cell: &MapCell, metric: usize) -> String {
    let name = &plan.study().map.metrics[metric];
    let column = plan.columns().metrics.iter().find(|column| column.name == *name);
    let (sum, count) = cell.metrics[metric];
    let text = match (column.map(|column| column.kind), cell.mean(metric)) {
        (Some(Kind::Bool), Some(_)) => {
            let [low, high] = cell.intervals[metric]
                .unwrap_or([0.0, 1.0])
                .map(|end| 100.0 * end);
            format!("{sum}/{count} ({low:.0}-{high:.0} %)")
        }
        (Some(Kind::Bool), None) => format!("{sum}/{count}"),
        (_, Some(mean)) => with_interval(mean, cell.intervals[metric]),
        (_, None) => "-".into(),
    };
    let text = match cell.unfinished {
        some if some > 0 && name == "climbed" => format!("{text}, {some} unfinished"),
        _ => text,
    };
    match cell.errors {
        0 => text,
        errors => format!("{text} ({errors} failed)"),
    }
}

/// A mean with four digits that count, and half of its interval with as many decimals.
fn with_interval(mean: f64, interval: Option<[f64; 2]>) -> String {
    let half = interval.map(|[low, high]| (high - low) / 2.0);
    // A mean near 0 has the digits of its interval: those are what is known.
    let decimals = decimals(half.map_or(mean, |half| mean.abs().max(half)));
    let half = half.map_or_else(String::new, |half| format!(" +- {half:.decimals$}"));
    format!("{mean:.decimals$}{half}")
}

/// How many decimals show four digits that count.
fn decimals(number: f64) -> usize {
    let whole = if number == 0.0 {
        0.0
    } else {
        number.abs().log10().floor()
    };
    (3.0 - whole).clamp(0.0, 9.0) as usize
}

fn grid(corner: String, header: Vec<String>, rows: impl Iterator<Item = (String, Vec<String>)>) -> String {
    let rows = rows.map(|(label, cells)| std::iter::once(label).chain(cells));
    let table = aligned(std::iter::once(corner).chain(header), rows, 1);
    format!("{table}\n")
}
