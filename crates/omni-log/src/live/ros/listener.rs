//! A thread that looks at what came from other nodes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time between two looks at what came.
const LOOK: Duration = Duration::from_millis(5);
/// What is taken in one look: a flood must not keep the thread from its end.
pub(super) const MOST: usize = 64;

/// Looks again and again until it is dropped.
pub(super) struct Listener {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Listener {
    /// On a thread of that name.
    pub(super) fn start(name: &str, mut look: impl FnMut() + Send + 'static) -> Result<Self, String> {
        let over = Arc::new(AtomicBool::new(false));
        let ends = over.clone();
        let listen = move || {
            while !ends.load(Ordering::Relaxed) {
                look();
                std::thread::sleep(LOOK);
            }
        };
        let thread = std::thread::Builder::new().name(name.into()).spawn(listen);
        Ok(Self {
            over,
            thread: Some(thread.map_err(|error| error.to_string())?),
        })
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
