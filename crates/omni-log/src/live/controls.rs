//! What others ask of a run as a whole: a pause, another start, and their time.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use omni_config::Scenario;

/// Requests to the run's thread.
#[derive(Default)]
pub(super) struct Controls {
    paused: AtomicBool,
    again: AtomicBool,
    /// The scenario of the next start, where it is not the run's own.
    placed: Mutex<Option<Scenario>>,
    /// Time of a clock that the run follows \[ns\]; 0 until a message came.
    clock_ns: AtomicU64,
}

impl Controls {
    #[cfg(feature = "ros2")]
    pub(super) fn pause(&self, paused: bool) {
        self.paused.store(paused, Ordering::SeqCst);
    }

    pub(super) fn is_paused(&self) -> bool {
        self.paused.load(Ordering::SeqCst)
    }

    /// From the start of the run's scenario.
    pub(super) fn start_again(&self) {
        *self.placed() = None;
        self.again.store(true, Ordering::SeqCst);
    }

    /// From the start of that one.
    #[cfg(feature = "ros2")]
    pub(super) fn start_again_as(&self, placed: Scenario) {
        *self.placed() = Some(placed);
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

    /// The scenario of that start, where it is not the run's own.
    pub(super) fn take_placed(&self) -> Option<Scenario> {
        self.placed().take()
    }

    /// It is that time by the clock that the run follows \[ns\].
    #[cfg(feature = "ros2")]
    pub(super) fn set_clock_ns(&self, time_ns: u64) {
        self.clock_ns.store(time_ns, Ordering::SeqCst);
    }

    pub(super) fn clock_ns(&self) -> u64 {
        self.clock_ns.load(Ordering::SeqCst)
    }

    /// No thread panics while writing; if one did, what is there is still whole.
    fn placed(&self) -> MutexGuard<'_, Option<Scenario>> {
        self.placed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
