//! Objects that several threads use: their calls wait for each other.

use std::thread::{self, ThreadId};
use std::time::Duration;

use parking_lot::{Mutex, MutexGuard};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Time between two looks at Ctrl-C while another thread has it.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What one thread at a time uses.
pub(crate) struct InTurn<T> {
    /// A thread that waits for it does not have the interpreter's lock, which a user's policy asks
    /// for: none waits for both.
    inner: Mutex<T>,
    /// Who has it: a policy that asks for its own simulation would wait for itself.
    user: Mutex<Option<ThreadId>>,
    /// What is said then.
    own: &'static str,
}

impl<T: Send> InTurn<T> {
    /// `own` is said where a thread that uses it asks for it again.
    pub(crate) fn new(inner: T, own: &'static str) -> Self {
        let (inner, user) = (Mutex::new(inner), Mutex::new(None));
        Self { inner, user, own }
    }

    /// Does something with it as soon as no other thread has it, outside the interpreter's lock;
    /// Ctrl-C ends the waiting.
    pub(crate) fn with<R: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut T) -> R + Send) -> PyResult<R> {
        let here = thread::current().id();
        if *self.user.lock() == Some(here) {
            return Err(PyRuntimeError::new_err(self.own));
        }
        let mut work = Some(work);
        loop {
            let done = py.detach(|| {
                let mut inner = self.inner.try_lock_for(LOOK_EVERY)?;
                *self.user.lock() = Some(here);
                let done = work.take().map(|work| work(&mut inner));
                *self.user.lock() = None;
                // To the thread that has waited longest: a thread in a loop would take it again and again.
                MutexGuard::unlock_fair(inner);
                done
            });
            if let Some(done) = done {
                return Ok(done);
            }
            py.check_signals()?;
        }
    }
}
