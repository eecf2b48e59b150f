//! Figures as messages have them, with the digits that count.

/// A figure with three digits that count.
pub(crate) fn digits(figure: f64) -> String {
    let order = if figure == 0.0 {
        0.0
    } else {
        figure.abs().log10().floor()
    };
    let decimals = (2.0 - order).clamp(0.0, 12.0) as usize;
    let text = format!("{figure:.decimals$}");
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => &text,
    };
    match text {
        "-0" => "0".to_owned(),
        text => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::digits;

    #[test]
    fn three_digits_count_of_negative_figures_too_and_nothing_is_minus_zero() {
        let said = [0.123_456, -0.123_456, 1234.6, -0.0, -1.4e-17, 0.002_001].map(digits);
        assert_eq!(said, ["0.123", "-0.123", "1235", "0", "0", "0.002"]);
    }
}
