//! Long work outside the interpreter's lock, while Python looks at Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use omnistep::Error;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::error::exception;

/// Time between two looks at Ctrl-C, and two calls of the callback.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Works on a thread of its own, outside the interpreter's lock, while this one looks at Ctrl-C,
/// which sets the flag that the work gets.
pub(crate) fn interruptible<T: Send, E: Into<Error> + Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> Result<T, E> + Send,
) -> PyResult<T> {
    with_progress(py, None, |stop, _rows| work(stop))
}

/// [`interruptible`], which also calls `watch` with how many rows there are and how many of them
/// failed: the work says it of each.
pub(crate) fn with_progress<T: Send, E: Into<Error> + Send>(
    py: Python<'_>,
    watch: Option<Py<PyAny>>,
    work: impl FnOnce(&AtomicBool, Sender<bool>) -> Result<T, E> + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let look = |rows: usize, errors: usize| {
        Python::attach(|py| {
            py.check_signals()?;
            watch
                .as_ref()
                .map_or(Ok(()), |watch| watch.call1(py, (rows, errors)).map(|_| ()))
        })
    };
    py.detach(|| {
        let (sender, receiver) = mpsc::channel();
        std::thread::scope(|scope| {
            let worker = scope.spawn(|| work(&stop, sender));
            let (mut rows, mut errors, mut last) = (0, 0, Instant::now());
            let mut ended = Ok(());
            loop {
                match receiver.recv_timeout(LOOK_EVERY.saturating_sub(last.elapsed())) {
                    Ok(error) => {
                        rows += 1;
                        errors += usize::from(error);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
                if last.elapsed() >= LOOK_EVERY && ended.is_ok() {
                    ended = look(rows, errors);
                    last = Instant::now();
                    stop.fetch_or(ended.is_err(), Ordering::Relaxed);
                } else if ended.is_err() {
                    last = Instant::now();
                }
            }
            let computed = worker
                .join()
                .map_err(|_| PyRuntimeError::new_err("a thread of the study panicked"))?;
            ended?;
            let computed = computed.map_err(exception)?;
            look(rows, errors)?;
            Ok(computed)
        })
    })
}
