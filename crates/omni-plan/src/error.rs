//! The errors of maps, charts and options, each in one line.

use omni_config::shortened;

/// A file, a key or an argument that is not usable. Its message is one line.
///
/// ```
/// let error = omni_plan::Footprint::rectangle(0.0, 0.5).unwrap_err();
/// assert_eq!(error.to_string(), "length_m = 0, allowed: 0.01 to 20");
/// ```
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or a key of it.
    #[error(transparent)]
    File(#[from] omni_config::Error),
    /// An argument is out of range.
    #[error("{name} = {}, allowed: {allowed}", shortened(value))]
    Argument {
        /// Name of the argument.
        name: &'static str,
        /// The value found.
        value: String,
        /// The range allowed.
        allowed: String,
    },
}

impl std::fmt::Debug for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(self, f)
    }
}

/// The error of a key of a file: the value found and the range allowed.
pub(crate) fn refused(file: &str, key: &str, message: impl Into<String>) -> Error {
    Error::File(omni_config::Error::Key {
        file: file.into(),
        key: key.into(),
        message: message.into(),
    })
}

/// Refuses an argument that is not within its range; so is one that is not a number.
pub(crate) fn check_argument(name: &'static str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::Argument {
        name,
        value: value.to_string(),
        allowed: format!("{least} to {most}"),
    })
}

/// Refuses a file's value that is not within its range.
pub(crate) fn check_key(file: &str, key: &str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(refused(file, key, format!("{value}, allowed: {least} to {most}")))
}
