//! What others ask of a run as a whole: a pause, and another start.

use std::sync::atomic::{AtomicBool, Ordering};

/// Requests to the run's thread.
#[derive(Default)]
pub(super) struct Controls {
    paused: AtomicBool,
    again: AtomicBool,
}

impl Controls {
    #[cfg(feature = "ros2")]
    pub(super) fn pause(&self, paused: bool) {
        self.paused.store(paused, Ordering::SeqCst);
    }

    pub(super) fn is_paused(&self) -> bool {
        self.paused.load(Ordering::SeqCst)
    }

    pub(super) fn start_again(&self) {
        self.again.store(true, Ordering::SeqCst);
    }

    /// Is another start asked for?
    pub(super) fn starts_again(&self) -> bool {
        self.again.load(Ordering::SeqCst)
    }

    /// The same, and it is done now.
    pub(super) fn take_start_again(&self) -> bool {
        self.again.swap(false, Ordering::SeqCst)
    }
}
