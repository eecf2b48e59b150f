//! Many runs on all cores, their rows written part by part.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

use rayon::prelude::*;

use crate::part_writer::PartWriter;
use crate::{Error, Row, Run, Store, row};

/// Result of [`compute`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Computed {
    /// Rows computed and written.
    pub rows: usize,
    /// Rows among them with an error.
    pub errors: usize,
}

/// This many threads, or one per core.
pub(crate) fn threads(jobs: Option<NonZeroUsize>) -> Result<rayon::ThreadPool, Error> {
    let count = jobs.map_or(0, NonZeroUsize::get); // 0: as many as there are cores
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    pool.map_err(|error| Error::Io {
        path: "threads".into(),
        source: std::io::Error::other(error),
    })
}

/// Computes the rows of `runs` on `jobs` threads (all cores by default) and writes them to `store`,
/// until all are done or `stop` is set: then runs under way are given up. A row is written as soon
/// as it is done, so that a program that is killed loses none. Calls `watch` after each row.
///
/// # Errors
/// [`Error::Io`] if a part cannot be written or threads cannot be started; the runs under way are given up.
pub fn compute(
    runs: &[Run],
    store: &Store,
    jobs: Option<NonZeroUsize>,
    stop: &AtomicBool,
    watch: impl FnMut(&Row),
) -> Result<Computed, Error> {
    compute_into(runs, PartWriter::new(store), jobs, stop, watch)
}

/// [`compute`], beginning with that part.
pub(crate) fn compute_into(
    runs: &[Run],
    part: PartWriter<'_>,
    jobs: Option<NonZeroUsize>,
    stop: &AtomicBool,
    mut watch: impl FnMut(&Row),
) -> Result<Computed, Error> {
    let pool = threads(jobs)?;
    // Threads wait where writing cannot keep up: what a program that is killed loses stays small.
    let (sender, receiver) = mpsc::sync_channel(2 * pool.current_num_threads());
    std::thread::scope(|scope| {
        let worker = scope.spawn(move || {
            pool.install(|| {
                let each = |sender: &mut mpsc::SyncSender<Row>, run: &Run| {
                    if let Some(row) = row(run, stop) {
                        // There is no receiver any more where writing has failed.
                        let _ = sender.send(row);
                    }
                };
                runs.par_iter().with_max_len(1).for_each_with(sender, each);
            });
        });
        let written = collect(receiver, part, &mut watch);
        if written.is_err() {
            stop.store(true, Ordering::Relaxed);
        }
        let ended = worker.join();
        debug_assert!(ended.is_ok(), "a row catches what happens in its run");
        written
    })
}

/// Writes rows as they come, until no sender is left. Those that come while others are written wait for
/// one another. The one that still sends after an error is not kept waiting: the receiver ends with this.
fn collect(
    receiver: mpsc::Receiver<Row>,
    mut part: PartWriter<'_>,
    watch: &mut dyn FnMut(&Row),
) -> Result<Computed, Error> {
    let mut computed = Computed::default();
    while let Ok(row) = receiver.recv() {
        let rows: Vec<Row> = std::iter::once(row).chain(receiver.try_iter()).collect();
        computed.rows += rows.len();
        computed.errors += rows.iter().filter(|row| row.error.is_some()).count();
        part.add(rows.clone())?;
        rows.iter().for_each(&mut *watch);
    }
    part.finish()?;
    Ok(computed)
}
