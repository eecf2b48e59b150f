//! The errors of climb limits, in one line.

use omni_config::shortened;

/// An error of climb limits. Its message is one line.
///
/// ```
/// use omni_bound::{Error, Linkage};
/// let omni3 = omni_config::Vehicle::load("omni3")?;
/// let error = Linkage::new(&omni3).unwrap_err();
/// assert!(matches!(error, Error::Vehicle { .. }) && error.to_string().lines().count() == 1);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file, a key or a name is not usable.
    #[error(transparent)]
    Config(#[from] omni_config::Error),
    /// A vehicle that this method does not describe.
    #[error(
        "vehicle {}: {}; climb limits need two frames joined by one transverse hinge, with three rows of wheels; for other vehicles: omnistep check VEHICLE --step HEIGHT",
        shortened(vehicle),
        shortened(reason)
    )]
    Vehicle {
        /// Its name.
        vehicle: String,
        /// The part of it that is not described.
        reason: String,
    },
    /// An argument is out of range.
    #[error("{name} = {value}, allowed: {allowed}")]
    Argument {
        /// Name of the argument.
        name: &'static str,
        /// The value found.
        value: f64,
        /// The range allowed.
        allowed: String,
    },
    /// The linear program was not solved.
    #[error("the linear program of row {row} was not solved: {}", shortened(reason))]
    Solver {
        /// The row that climbs, from 0 at the front.
        row: usize,
        /// The library's message.
        reason: String,
    },
}

impl Error {
    /// Whether the request is at fault (exit code 2) or the computation failed (exit code 1).
    ///
    /// ```
    /// let error = omni_bound::Step::new(-1.0, 0.7).unwrap_err();
    /// assert!(error.is_bad_input());
    /// ```
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Solver { .. })
    }
}
