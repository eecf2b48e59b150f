//! Numbers as they are written.

/// A number to twelve digits: without the rounding of sums.
pub(super) fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    if rounded == 0.0 {
        "0".into()
    } else {
        rounded.to_string()
    }
}

pub(super) fn numbers(values: &[f64]) -> String {
    let texts: Vec<_> = values.iter().map(|value| number(*value)).collect();
    texts.join(" ")
}
