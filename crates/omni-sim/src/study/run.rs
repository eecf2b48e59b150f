//! Many runs on all cores, their rows written part by part.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::{Row, Run, Store, row};
use crate::Error;

/// A part is written when this has passed since the last one, or with this many rows: what a killed process loses.
const PART_EVERY: Duration = Duration::from_secs(5);
const PART_ROWS: usize = 1000;
/// How long to wait for a row before looking at the clock.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// What [`compute`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Computed {
    /// Rows computed and written.
    pub rows: usize,
    /// Rows among them with an error.
    pub errors: usize,
}

/// Computes the rows of `runs` on `jobs` threads (all cores by default) and writes them to `store`, until all are done or
/// `stop` is set: then runs under way are given up, and rows that are done are written. Calls `watch` after each row.
///
/// # Errors
/// [`Error::Io`] where a part cannot be written or threads cannot be started; the runs under way are given up.
pub fn compute(
    runs: &[Run],
    store: &Store,
    jobs: Option<NonZeroUsize>,
    stop: &AtomicBool,
    mut watch: impl FnMut(&Row),
) -> Result<Computed, Error> {
    let threads = jobs.map_or(0, NonZeroUsize::get); // 0: as many as there are cores
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| Error::Io {
        path: "threads".into(),
        source: std::io::Error::other(error),
    })?;
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        let worker = scope.spawn(move || {
            pool.install(|| {
                let each = |sender: &mut mpsc::Sender<Row>, run: &Run| {
                    if let Some(row) = row(run, stop) {
                        // Nobody receives any more where writing has failed.
                        let _ = sender.send(row);
                    }
                };
                runs.par_iter().with_max_len(1).for_each_with(sender, each);
            });
        });
        let written = collect(&receiver, store, &mut watch);
        if written.is_err() {
            stop.store(true, Ordering::Relaxed);
        }
        let ended = worker.join();
        debug_assert!(ended.is_ok(), "a row catches what happens in its run");
        written
    })
}

/// Writes rows as they come, until nobody sends any.
fn collect(
    receiver: &mpsc::Receiver<Row>,
    store: &Store,
    watch: &mut dyn FnMut(&Row),
) -> Result<Computed, Error> {
    let mut computed = Computed::default();
    let (mut waiting, mut last) = (Vec::new(), Instant::now());
    loop {
        let received = receiver.recv_timeout(LOOK_EVERY);
        let ended = matches!(received, Err(RecvTimeoutError::Disconnected));
        if let Ok(row) = received {
            watch(&row);
            computed.rows += 1;
            computed.errors += usize::from(row.error.is_some());
            waiting.push(row);
        }
        if ended || waiting.len() >= PART_ROWS || last.elapsed() >= PART_EVERY {
            store.write(&waiting)?;
            waiting.clear();
            last = Instant::now();
        }
        if ended {
            return Ok(computed);
        }
    }
}
