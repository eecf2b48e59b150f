//! The cells of a chart on all cores, the chart shown after each.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

use rayon::prelude::*;

use super::plan::in_order;
use super::scan::cell;
use super::{Chart, ChartPlan};
use crate::Error;
use crate::run::threads;

/// Adds to `done` the cells that the plan has and it lacks, on `jobs` threads (all cores by default), until
/// all are there or `stop` is set: then cells under way are given up. Calls `watch` with the chart after each
/// cell, for it to be kept. The chart is the same for any number of threads, and however often it was stopped.
///
/// # Errors
/// If `done` is a chart of other runs, where a scenario cannot be made, what `watch` returns,
/// and [`Error::Io`] if threads cannot be started.
pub fn chart(
    plan: &ChartPlan,
    done: &Chart,
    jobs: Option<NonZeroUsize>,
    stop: &AtomicBool,
    mut watch: impl FnMut(&Chart) -> Result<(), Error>,
) -> Result<Chart, Error> {
    done.check_continues(plan)?;
    let mut chart = done.clone();
    let missing: Vec<_> = plan.missing(done).collect();
    let pool = threads(jobs)?;
    let (sender, receiver) = mpsc::channel();
    // An error sets the flag too: it ends what is under way.
    let failed = std::thread::scope(|scope| {
        scope.spawn(move || {
            pool.install(|| {
                missing
                    .into_par_iter()
                    .with_max_len(1)
                    .for_each_with(sender, |sender, approach| {
                        if !stop.load(Ordering::Relaxed) {
                            // There is no receiver any more after an error.
                            let _ = sender.send(cell(plan, approach, stop));
                        }
                    });
            });
        });
        let mut failed = None;
        while let Ok(found) = receiver.recv() {
            let kept = found.and_then(|found| {
                let Some(cell) = found else { return Ok(()) };
                chart.cell.push(cell);
                chart
                    .cell
                    .sort_by(|one, other| in_order(&one.approach(), &other.approach()));
                watch(&chart)
            });
            if let (Err(error), None) = (kept, &failed) {
                failed = Some(error);
                stop.store(true, Ordering::Relaxed);
            }
        }
        failed
    });
    match failed {
        Some(error) => Err(error),
        None => Ok(chart),
    }
}
