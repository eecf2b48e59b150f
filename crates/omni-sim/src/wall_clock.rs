//! The limit of a run's wall-clock time.

use std::time::Instant;

/// WebAssembly of its own, as in a browser, has no clock: to ask for the time there would end the program.
const HAS_CLOCK: bool = !cfg!(all(target_family = "wasm", target_os = "unknown"));

/// A time that runs out, but never where there is no clock.
pub(crate) struct WallClock {
    start: Option<Instant>,
    limit_s: f64,
}

impl WallClock {
    /// Starts now, with so long to go \[s\].
    pub(crate) fn start(limit_s: f64) -> Self {
        Self {
            start: HAS_CLOCK.then(Instant::now),
            limit_s,
        }
    }

    pub(crate) fn has_expired(&self) -> bool {
        self.start
            .is_some_and(|start| start.elapsed().as_secs_f64() > self.limit_s)
    }
}
