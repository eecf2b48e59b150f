//! Values of few kinds as numbers in columns.

/// The number of a value in a column; NaN if it has none.
pub(super) fn number<T: PartialEq>(all: &[T], value: &T) -> f64 {
    all.iter()
        .position(|each| each == value)
        .map_or(f64::NAN, |at| at as f64)
}

/// The value of a number in a column.
pub(super) fn value<T: Copy>(all: &[T], number: f64) -> Option<T> {
    let whole = number as usize;
    all.get(whole).copied().filter(|_| whole as f64 == number)
}

/// A whole number in a column, up to `most`.
pub(super) fn whole(number: f64, most: u32) -> Option<u32> {
    let fits = number.fract() == 0.0 && (0.0..=f64::from(most)).contains(&number);
    fits.then_some(number as u32)
}
