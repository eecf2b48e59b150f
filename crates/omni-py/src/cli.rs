//! The command line, for the console script.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Run the command line ``argv`` (the program's name first); return the exit code.
#[pyfunction]
pub(crate) fn cli(py: Python<'_>, argv: Vec<OsString>) -> u8 {
    py.detach(|| omnistep::main(argv))
}
