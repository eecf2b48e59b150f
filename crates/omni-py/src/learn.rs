//! Environments for reinforcement learning as arrays: what `omnistep.gym` wraps for Gymnasium.

use numpy::{PyArray1, PyReadonlyArrayDyn};
use omni_sim::Error;
use omni_sim::learn::{self, Autoreset, Episode, Task, Turn};
use pyo3::exceptions::{PyIndexError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};

use crate::arrays::array;
use crate::error::exception;
use crate::scenario::{ScenarioArg, load};

/// Environments of one task, stepped together, which :mod:`omnistep.gym` wraps for Gymnasium.
///
/// Args:
///     task: ``"step_climb"`` or ``"drive"``.
///     scenario, policy, overrides: as in :class:`Simulation`. ranges: new ranges of the random values of episodes, by
///     name. frame_skip: number of control periods for which an action is held, 1 to 1000. num_envs: number of
///     environments, 1 to 65536. threads: number of threads; 0 for one per core.
///
/// Raises:
///     ConfigError: a name, key or value is wrong.
#[pyclass(module = "omnistep._omnistep")]
pub(crate) struct Episodes {
    batch: learn::Episodes,
    engine: &'static str,
}

/// Reads one of a few words.
fn one_of<T>(name: &'static str, found: &str, known: Option<T>, allowed: &'static str) -> PyResult<T> {
    known.ok_or_else(|| {
        let value = format!("{found:?}");
        exception(Error::Argument { name, value, allowed })
    })
}

/// Works outside the interpreter's lock and looks at Ctrl-C meanwhile.
fn with_progress(
    py: Python<'_>,
    work: impl FnOnce(&mut dyn FnMut() -> bool) -> Result<Option<Vec<Turn>>, omni_sim::Error> + Send,
) -> PyResult<Vec<Turn>> {
    let mut interrupted = None;
    let turns = py.detach(|| {
        work(&mut || {
            interrupted = Python::attach(|py| py.check_signals()).err();
            interrupted.is_none()
        })
    });
    match (turns.map_err(exception)?, interrupted) {
        (Some(turns), _) => Ok(turns),
        (None, Some(interrupted)) => Err(interrupted),
        (None, None) => Err(PyRuntimeError::new_err("stopped without a cause")),
    }
}

#[pymethods]
impl Episodes {
    #[new]
    #[pyo3(signature = (task, *, scenario, policy, overrides, ranges, frame_skip, num_envs = 1, threads = 0))]
    #[expect(clippy::too_many_arguments, reason = "by keyword only")]
    fn new(
        py: Python<'_>,
        task: &str,
        scenario: ScenarioArg,
        policy: Option<&str>,
        overrides: Option<&Bound<'_, PyMapping>>,
        ranges: Vec<(String, [f64; 2])>,
        frame_skip: u32,
        num_envs: usize,
        threads: usize,
    ) -> PyResult<Self> {
        let task = one_of("task", task, Task::named(task), "\"step_climb\" or \"drive\"")?;
        let scenario = load(scenario, policy, overrides, None)?;
        let ranges: Vec<_> = ranges
            .iter()
            .map(|(name, range)| (name.as_str(), *range))
            .collect();
        let batch =
            py.detach(|| learn::Episodes::new(task, &scenario, &ranges, frame_skip, num_envs, threads));
        Ok(Self {
            batch: batch.map_err(exception)?,
            engine: scenario.physics.engine.name(),
        })
    }

    /// Start the next episode of those in `mask`.
    ///
    /// Args:
    ///     seeds: one for each environment; None continues its sequence of random numbers.
    ///     fixed: values that are not drawn.
    ///     mask: one flag for each environment.
    ///
    /// Returns:
    ///     Observations, (num_envs, observations), and figures by name: an array of each, and one mask ``_name`` of its
    ///     valid values. A figure without any valid value is left out.
    ///
    /// Raises:
    ///     ConfigError: a name or value is wrong; the present episodes then continue.
    fn reset<'py>(
        &mut self,
        py: Python<'py>,
        seeds: Vec<Option<u64>>,
        fixed: Vec<(String, f64)>,
        mask: Vec<bool>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyDict>)> {
        let fixed: Vec<_> = fixed
            .iter()
            .map(|(name, value)| (name.as_str(), *value))
            .collect();
        let turns = with_progress(py, |look| self.batch.reset(&seeds, &fixed, &mask, look))?;
        let begun = turns.iter().zip(&mask);
        let info = self.info(py, begun.map(|(turn, begun)| begun.then_some(&turn.info)))?;
        Ok((
            observations(py, turns.iter().map(|turn| &turn.observation))?,
            info,
        ))
    }

    /// Step all environments, without the interpreter's lock.
    ///
    /// Args:
    ///     actions: num_envs x actions numbers, clipped to -1 to 1.
    ///     autoreset: ``"Disabled"``, ``"NextStep"`` or ``"SameStep"``.
    ///
    /// Returns:
    ///     Observations, rewards, terminated, truncated, figures; and where episodes ended and began in one step, the
    ///     last observation of each (None for the others) and their figures.
    ///
    /// Raises:
    ///     ConfigError: the actions are wrong, or an episode is over; the state is unchanged.
    #[expect(clippy::type_complexity, reason = "Gymnasium's own")]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        actions: PyReadonlyArrayDyn<'py, f32>,
        autoreset: &str,
    ) -> PyResult<(
        Bound<'py, PyAny>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<bool>>,
        Bound<'py, PyArray1<bool>>,
        Bound<'py, PyDict>,
        Option<(Vec<Option<Bound<'py, PyArray1<f32>>>>, Bound<'py, PyDict>)>,
    )> {
        let mode = match autoreset {
            "Disabled" => Some(Autoreset::Disabled),
            "NextStep" => Some(Autoreset::NextStep),
            "SameStep" => Some(Autoreset::SameStep),
            _ => None,
        };
        let mode = one_of(
            "autoreset",
            autoreset,
            mode,
            "\"Disabled\", \"NextStep\" or \"SameStep\"",
        )?;
        // A copy: nothing can write to it while the lock is released.
        let actions: Vec<f32> = actions.as_array().iter().copied().collect();
        let turns = with_progress(py, |look| self.batch.step(&actions, mode, look))?;
        let last = if turns.iter().any(|turn| turn.last.is_some()) {
            let ended = |turn: &Turn| turn.last.as_ref().map(|(seen, _)| PyArray1::from_slice(py, seen));
            let info = turns.iter().map(|turn| turn.last.as_ref().map(|(_, info)| info));
            Some((turns.iter().map(ended).collect(), self.info(py, info)?))
        } else {
            None
        };
        Ok((
            observations(py, turns.iter().map(|turn| &turn.observation))?,
            PyArray1::from_iter(py, turns.iter().map(|turn| turn.reward)),
            PyArray1::from_iter(py, turns.iter().map(|turn| turn.terminated)),
            PyArray1::from_iter(py, turns.iter().map(|turn| turn.truncated)),
            self.info(py, turns.iter().map(|turn| Some(&turn.info)))?,
            last,
        ))
    }

    /// Size of an action.
    #[getter]
    fn actions(&self) -> usize {
        self.batch.episodes()[0].actions()
    }

    /// Size of an observation.
    #[getter]
    fn observations(&self) -> usize {
        self.batch.episodes()[0].seen().observation.len()
    }

    /// Duration for which an action is held [s].
    #[getter]
    fn action_s(&self) -> f64 {
        self.batch.episodes()[0].action_s()
    }

    /// The physics engine.
    #[getter]
    fn engine(&self) -> &'static str {
        self.engine
    }

    /// Values that differ between episodes, and their ranges.
    #[getter]
    fn ranges(&self) -> Vec<(&'static str, (f64, f64))> {
        let draws = self.batch.episodes()[0].draws();
        draws.iter().map(|draw| (draw.name, draw.range.into())).collect()
    }

    /// Centres of one environment's wheels in the world [m], (N, 3), and their radii [m], (N,).
    ///
    /// Raises:
    ///     IndexError: there is no such environment.
    fn wheels_m<'py>(
        &self,
        py: Python<'py>,
        index: usize,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray1<f64>>)> {
        let episode = self.episode(index)?;
        let wheels = &episode.simulation().observation().wheels;
        let centres = wheels.iter().flat_map(|wheel| wheel.centre_m).collect();
        let radii = episode
            .present()
            .vehicle()
            .wheel
            .iter()
            .map(|wheel| wheel.radius_m);
        let centres = array::<f64>(py, vec![wheels.len(), 3], centres)?;
        Ok((
            centres.into_any(),
            PyArray1::from_iter(py, radii.collect::<Vec<_>>()),
        ))
    }

    /// Height of one environment's ground [m] at places x [m], y = 0.
    ///
    /// Raises:
    ///     IndexError: there is no such environment.
    fn ground_m<'py>(
        &self,
        py: Python<'py>,
        index: usize,
        x_m: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let places: Vec<_> = x_m.into_iter().map(|x_m| [x_m, 0.0]).collect();
        let heights = omni_sim::ground_heights_m(self.episode(index)?.present(), &places);
        Ok(PyArray1::from_vec(py, heights))
    }
}

impl Episodes {
    fn episode(&self, index: usize) -> PyResult<&Episode> {
        let episodes = self.batch.episodes();
        let absent = || PyIndexError::new_err(format!("{index}, allowed: 0 to {}", episodes.len() - 1));
        episodes.get(index).ok_or_else(absent)
    }

    /// Figures as Gymnasium's vector environments give them: an array of each, and one that says
    /// which of its values count.
    fn info<'py, 'a>(
        &self,
        py: Python<'py>,
        rows: impl Iterator<Item = Option<&'a Vec<f64>>> + Clone,
    ) -> PyResult<Bound<'py, PyDict>> {
        let info = PyDict::new(py);
        for (k, name) in self.batch.episodes()[0].info_names().iter().enumerate() {
            // What is not known (yet) is left out: a NaN is not equal to itself, which Gymnasium's
            // checker does not like.
            let known = rows
                .clone()
                .map(|row| row.map(|row| row[k]).filter(|value| !value.is_nan()));
            let counts: Vec<_> = known.clone().map(|value| value.is_some()).collect();
            if !counts.contains(&true) {
                continue;
            }
            let values = known.map(Option::unwrap_or_default);
            if name.starts_with("is_") {
                info.set_item(name, PyArray1::from_iter(py, values.map(|value| value == 1.0)))?;
            } else {
                info.set_item(name, PyArray1::from_iter(py, values))?;
            }
            info.set_item(format!("_{name}"), PyArray1::from_vec(py, counts))?;
        }
        Ok(info)
    }
}

/// (environments, numbers).
fn observations<'py, 'a>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = &'a Vec<f32>>,
) -> PyResult<Bound<'py, PyAny>> {
    let count = rows.len();
    let values: Vec<f32> = rows.flatten().copied().collect();
    Ok(array(py, vec![count, values.len() / count], values)?.into_any())
}
