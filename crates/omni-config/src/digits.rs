//! Figures as messages have them, with the digits that count.

/// A figure with three digits that count.
pub(crate) fn digits(figure: f64) -> String {
    let order = if figure > 0.0 { figure.log10().floor() } else { 0.0 };
    let decimals = (2.0 - order).clamp(0.0, 12.0) as usize;
    let text = format!("{figure:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
