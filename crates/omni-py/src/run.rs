//! Whole runs, outside the interpreter's lock.

use std::path::PathBuf;

use omni_log::{LogRun, RunLog};
use omni_sim::{Run, Simulation};
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::error::{Stop, looked};
use crate::policy::{PolicyArg, controller, load_with};
use crate::scenario::{ScenarioArg, warn_of};
use crate::trace::Trace;

/// Control periods between two looks at Ctrl-C: some milliseconds.
const PERIODS_PER_LOOK: u32 = 64;

/// Run a scenario from start to end: :func:`omnistep.run` without a progress bar.
///
/// Args:
///     scenario: a built-in name, a path or a :class:`Scenario`.
///     policy: as in :func:`omnistep.run`.
///     overrides: as in :func:`omnistep.run`.
///     seed: as in :func:`omnistep.run`.
///     mcap: as in :func:`omnistep.run`.
///     on_progress: called with the completed part, 0 to 1, every few milliseconds; an exception in it ends the run.
#[pyfunction]
#[pyo3(signature = (scenario = ScenarioArg::default(), *, policy = None, overrides = None, seed = None, mcap = None,
    on_progress = None))]
pub(crate) fn run(
    py: Python<'_>,
    scenario: ScenarioArg,
    policy: Option<PolicyArg>,
    overrides: Option<&Bound<'_, PyMapping>>,
    seed: Option<&Bound<'_, PyAny>>,
    mcap: Option<PathBuf>,
    on_progress: Option<Py<PyAny>>,
) -> PyResult<Trace> {
    let (scenario, own) = load_with(scenario, policy, overrides, seed)?;
    if own.is_none() {
        // Called by `omnistep.run` and `omnistep.compare`.
        warn_of(py, &scenario, 2)?;
    }
    let (controller, raised) = controller(py, &scenario, own.as_ref(), true)?;
    let policy = controller.policy().to_owned();
    let trace: Result<omni_sim::Trace, Stop> = py.detach(|| {
        let look = look_every(PERIODS_PER_LOOK, on_progress.as_ref());
        match mcap {
            Some(path) => {
                let log = RunLog::create(path, &scenario, &controller)?;
                Run::new(&scenario).controller(controller).watch(look).log(log)
            }
            None => Run::new(&scenario).controller(controller).watch(look).trace(),
        }
    });
    match (trace, raised.take()) {
        (Err(_), Some(raised)) => Err(raised),
        (trace, _) => Ok(Trace::new(scenario, policy, trace?)),
    }
}

/// Looks at Ctrl-C, and calls back with the part done, once in so many control periods.
pub(crate) fn look_every(
    periods: u32,
    on_progress: Option<&Py<PyAny>>,
) -> impl FnMut(&Simulation, f64) -> Result<(), Stop> {
    let mut done: u32 = 0;
    move |_, part| {
        done = (done + 1) % periods;
        if done == 0 {
            Python::attach(|py| looked(py, on_progress, part)).map_err(Stop::Interrupted)?;
        }
        Ok(())
    }
}
