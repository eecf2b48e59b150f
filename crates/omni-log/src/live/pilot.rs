//! Commands from the program that started the run.

use std::sync::{Arc, Mutex, PoisonError};

/// Drives a live run from where it was started, as keys of a terminal do. It is one of those that
/// command: the last one is followed, and a command ends 0.5 s on the clock after it was given.
///
/// ```
/// let pilot = omni_log::Pilot::new();
/// let mut live = omni_log::Live::new(0);
/// live.pilot = Some(pilot.clone());
/// pilot.ask([0.3, 0.0, 0.0]); // ahead; taken at the next control period
/// ```
#[derive(Clone, Debug, Default)]
pub struct Pilot {
    asked: Arc<Mutex<Option<[f64; 3]>>>,
}

impl Pilot {
    /// Nothing is asked yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks for a twist: vx forwards, vy to the left \[m/s\], wz to the left \[rad/s\]. One that
    /// the scenario may not ask for is rejected, and the run's `warn` says why.
    pub fn ask(&self, twist: [f64; 3]) {
        *self.asked.lock().unwrap_or_else(PoisonError::into_inner) = Some(twist);
    }

    /// Requests since the last call.
    pub(super) fn take(&self) -> Option<[f64; 3]> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
