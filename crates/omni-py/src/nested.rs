//! Runs within runs: what a run calls in Python may start another one, up to a depth that every stack has room for.

use std::cell::Cell;

use pyo3::exceptions::PyRecursionError;
use pyo3::prelude::*;

/// Most runs within each other. A stack of 8 MB has room for some 260, and Python itself counts none of them.
const MOST: usize = 16;

thread_local! {
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}

/// Calls Python out of a run.
///
/// # Errors
/// `RecursionError` where as many runs as are allowed have called each other already; whatever `call` returns.
pub(crate) fn nested<R, E: From<PyErr>>(call: impl FnOnce() -> Result<R, E>) -> Result<R, E> {
    /// One call less, even if it ends in an error.
    struct Left;
    impl Drop for Left {
        fn drop(&mut self) {
            DEPTH.set(DEPTH.get() - 1);
        }
    }
    if DEPTH.get() >= MOST {
        let message = format!("runs that start runs, {MOST} within each other, allowed: {MOST}");
        return Err(PyRecursionError::new_err(message).into());
    }
    DEPTH.set(DEPTH.get() + 1);
    let _left = Left;
    call()
}
