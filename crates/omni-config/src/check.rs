//! Range checks for garde, which says where a value is; these say what it was and what is allowed.
//! (garde's own `range` lets NaN through.)

use garde::Error;

fn refuse(value: impl std::fmt::Display, allowed: &str) -> garde::Result {
    Err(Error::new(format!("{value}, allowed: {allowed}")))
}

/// Finite and above zero.
pub(crate) fn positive(value: &f64, _: &()) -> garde::Result {
    if value.is_finite() && *value > 0.0 {
        Ok(())
    } else {
        refuse(value, "finite and > 0")
    }
}

/// Finite and not below zero.
pub(crate) fn not_negative(value: &f64, _: &()) -> garde::Result {
    if value.is_finite() && *value >= 0.0 {
        Ok(())
    } else {
        refuse(value, "finite and >= 0")
    }
}

/// Neither infinite nor NaN.
pub(crate) fn finite(value: &f64, _: &()) -> garde::Result {
    if value.is_finite() {
        Ok(())
    } else {
        refuse(value, "finite")
    }
}

/// Between two bounds, both included.
pub(crate) fn between(lower: f64, upper: f64) -> impl FnOnce(&f64, &()) -> garde::Result {
    move |value, _| {
        if *value >= lower && *value <= upper {
            Ok(())
        } else {
            refuse(value, &format!("{lower} to {upper}"))
        }
    }
}

/// Every component finite.
pub(crate) fn finite_all<const N: usize>(values: &[f64; N], _: &()) -> garde::Result {
    if values.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        refuse(format!("{values:?}"), "finite components")
    }
}

/// Every component finite and above zero.
pub(crate) fn positive_all<const N: usize>(values: &[f64; N], _: &()) -> garde::Result {
    if values.iter().all(|v| v.is_finite() && *v > 0.0) {
        Ok(())
    } else {
        refuse(format!("{values:?}"), "finite components > 0")
    }
}

/// A direction: finite and not the zero vector.
pub(crate) fn direction<const N: usize>(values: &[f64; N], context: &()) -> garde::Result {
    finite_all(values, context)?;
    if values.iter().any(|v| *v != 0.0) {
        Ok(())
    } else {
        refuse(format!("{values:?}"), "a direction of non-zero length")
    }
}

/// A name that can stand in a column and a file name: letters, digits, `_` and `-`, 1 to 40 of them.
pub(crate) fn is_name(value: &str, _: &()) -> garde::Result {
    let fits = (1..=40).contains(&value.len());
    if fits
        && value
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    {
        Ok(())
    } else {
        refuse(format!("{value:?}"), "1 to 40 letters, digits, '_' or '-'")
    }
}

/// The version of the file format.
pub(crate) fn is_schema_version(value: &u32, _: &()) -> garde::Result {
    if *value == crate::SCHEMA_VERSION {
        Ok(())
    } else {
        refuse(value, &format!("{}", crate::SCHEMA_VERSION))
    }
}
