//! The map of a study as text.

use omni_study::{Cell, Kind, MapCell, Plan};

use crate::output::{aligned, marked};

/// One table for each figure and combination of the axes that are not the map's. With less than two axes, figures are the
/// rows of one table.
pub(super) fn tables(plan: &Plan, map: &[MapCell]) -> String {
    let study = plan.study();
    let figures = || study.map.figures.iter().enumerate();
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
            return grid(corner, labels, figures().map(row));
        }
    };
    let rest: Vec<usize> = (0..study.axis.len())
        .filter(|axis| ![x, y].contains(axis))
        .collect();
    let (columns, rows) = (values(map, x), values(map, y));
    let mut text = String::new();
    for (fixed, cells) in grouped(&all, &rest) {
        for (i, name) in figures() {
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

/// `22/24` for yes and no, the mean with four digits for a number, `-` where nothing was measured; failed runs aside, and beside who climbed those that
/// had no time to.
fn shown(plan: &Plan, cell: &MapCell, figure: usize) -> String {
    let name = &plan.study().map.figures[figure];
    let column = plan.columns().figures.iter().find(|column| column.name == *name);
    let (sum, count) = cell.figures[figure];
    let text = match (column.map(|column| column.kind), cell.mean(figure)) {
        (Some(Kind::Bool), _) => format!("{sum}/{count}"),
        (_, Some(mean)) => digits(mean),
        (_, None) => "-".into(),
    };
    let text = match cell.unfinished {
        some if some > 0 && name == "climbed" => format!("{text}, {some} unfinished"),
        _ => text,
    };
    let text = match cell.errors {
        0 => text,
        errors => format!("{text} ({errors} failed)"),
    };
    marked(text, cell.beyond_balls == 0)
}

/// A number with four digits that count.
fn digits(number: f64) -> String {
    let whole = if number == 0.0 {
        0.0
    } else {
        number.abs().log10().floor()
    };
    let decimals = (3.0 - whole).clamp(0.0, 9.0) as usize;
    format!("{number:.decimals$}")
}

fn grid(corner: String, header: Vec<String>, rows: impl Iterator<Item = (String, Vec<String>)>) -> String {
    let rows = rows.map(|(label, cells)| std::iter::once(label).chain(cells));
    let table = aligned(std::iter::once(corner).chain(header), rows, 1);
    format!("{table}\n")
}
