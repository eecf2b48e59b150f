//! Signals of the system: Ctrl-C, termination, a file beyond its size limit.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Has a signal asked for an end, and the number of the last one.
static ASKED: AtomicBool = AtomicBool::new(false);
static BY: AtomicUsize = AtomicUsize::new(0);

/// From now on the first Ctrl-C, or SIGTERM, sets the flag that is returned: an orderly end is
/// asked for. The second one ends at once.
pub(super) fn stop_flag() -> &'static AtomicBool {
    static ONCE: OnceLock<()> = OnceLock::new();
    ASKED.store(false, Ordering::SeqCst);
    ONCE.get_or_init(|| {
        for (signal, number) in [(SIGINT, 2), (SIGTERM, 15)] {
            // In this order, so that the first one does not end at once. Without a handler it
            // would, and what is written is kept all the same.
            let _ = flag::register_conditional_shutdown(signal, 128 + signal, &ASKED);
            let _ = flag::register_usize(signal, &BY, number);
            let _ = flag::register(signal, &ASKED);
        }
    });
    &ASKED
}

/// The exit code of what a signal has ended: 130 for Ctrl-C, 143 for SIGTERM.
pub(super) fn exit_code() -> u8 {
    if BY.load(Ordering::SeqCst) == 15 { 143 } else { 130 }
}

/// A file that becomes larger than it may is an error of that write, and not the silent end of the program.
pub(super) fn survive_full_quota() {
    #[cfg(unix)]
    {
        // A process that handles it survives it; the flag is not read.
        static FULL: AtomicBool = AtomicBool::new(false);
        let _ = flag::register(signal_hook::consts::SIGXFSZ, &FULL);
    }
}
