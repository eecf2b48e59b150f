//! Where run-time wheel counts become the const generics of omni-core, and the only place.

use pyo3::prelude::*;

use crate::error::refused;

/// Fewest and most wheels, in words.
pub(crate) const ALLOWED: &str = "3 to 8 wheels";

/// Calls `$f::<N>` for a wheel count.
macro_rules! for_wheel_count {
    ($count:expr, $f:ident($($arg:expr),*)) => {
        match $count {
            3 => $f::<3>($($arg),*),
            4 => $f::<4>($($arg),*),
            5 => $f::<5>($($arg),*),
            6 => $f::<6>($($arg),*),
            7 => $f::<7>($($arg),*),
            8 => $f::<8>($($arg),*),
            n => Err($crate::counts::unusable(n)),
        }
    };
}
pub(crate) use for_wheel_count;

/// The error for a wheel count outside the range.
pub(crate) fn unusable(count: usize) -> PyErr {
    refused("wheels", &format!("wheels = {count}, allowed: {ALLOWED}"))
}
