//! Many environments at once, a thread a core.

use rayon::prelude::*;

use super::{Episode, Task, Turn};
use crate::Error;
use crate::config::Scenario;

/// Start of the next episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Autoreset {
    /// The caller, by [`Episodes::reset`].
    Disabled,
    /// The step after the one that ended the episode, whose action is left out.
    NextStep,
    /// The step that ended the episode.
    SameStep,
}

/// Environments of one task, stepped together.
///
/// ```
/// use omni_sim::{config::Scenario, learn::{Autoreset, Episodes, Task}};
/// let mut episodes = Episodes::new(Task::Drive, &Scenario::load("flat", &[])?, &[], 20, 3, 2)?;
/// episodes.reset(&[Some(0), Some(1), Some(0)], &[], &[true; 3], || true)?;
/// let turns = episodes.step(&[0.1; 3 * 7], Autoreset::NextStep, || true)?.expect("not stopped");
/// assert_eq!(turns[0], turns[2]); // the same seed and action
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct Episodes {
    episodes: Vec<Episode>,
    /// None if one thread is enough: then this one.
    pool: Option<Pool>,
    /// Environments that are stepped between two looks at whether to go on.
    at_once: usize,
}

/// Threads, and the process that they are in: a process that was forked has none.
struct Pool {
    threads: rayon::ThreadPool,
    process: u32,
}

/// Control periods between two looks at whether to go on: a tenth of a second on one core.
const PERIODS_PER_LOOK: usize = 3000;

/// Threads of its own: the global ones would be lost in a forked process, and wait for ever.
fn pool(threads: usize) -> Result<Pool, Error> {
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let threads = built.map_err(|error| Error::Argument {
        name: "threads",
        value: format!("{threads} ({error})"),
        allowed: "a number of threads that the system can start",
    })?;
    Ok(Pool {
        threads,
        process: std::process::id(),
    })
}

impl Episodes {
    /// `count` environments as [`Episode::new`] makes them, stepped by `threads` threads; 0 for one per core.
    ///
    /// # Errors
    /// As [`Episode::new`]; [`Error::Argument`] for a count of 0, or if the system gives no threads.
    pub fn new(
        task: Task,
        scenario: &Scenario,
        ranges: &[(&str, [f64; 2])],
        frame_skip: u32,
        count: usize,
        threads: usize,
    ) -> Result<Self, Error> {
        if !(1..=65_536).contains(&count) {
            return Err(Error::Argument {
                name: "num_envs",
                value: count.to_string(),
                allowed: "1 to 65536",
            });
        }
        let episodes = (0..count)
            .map(|_| Episode::new(task, scenario, ranges, frame_skip))
            .collect::<Result<_, _>>()?;
        let pool = (count > 1 && threads != 1)
            .then(|| pool(threads.min(count)))
            .transpose()?;
        let threads = pool.as_ref().map_or(1, |pool| pool.threads.current_num_threads());
        Ok(Self {
            episodes,
            pool,
            at_once: (PERIODS_PER_LOOK / frame_skip as usize).max(threads),
        })
    }

    /// Starts the next episode of those in `mask`, each with its seed ([`Episode::reset`]); returns
    /// what all see. `look` is asked every tenth of a second whether to go on; where it says no,
    /// nothing is returned and every episode is over.
    ///
    /// # Errors
    /// As [`Episode::reset`]; [`Error::Argument`] if there is not one seed and one flag an environment.
    pub fn reset(
        &mut self,
        seeds: &[Option<u64>],
        fixed: &[(&str, f64)],
        mask: &[bool],
        look: impl FnMut() -> bool,
    ) -> Result<Option<Vec<Turn>>, Error> {
        for (name, found) in [("seed", seeds.len()), ("reset_mask", mask.len())] {
            if found != self.episodes.len() {
                return Err(Error::Argument {
                    name,
                    value: format!("{found} values"),
                    allowed: "one for each environment",
                });
            }
        }
        self.each(look, |k, episode| {
            if mask[k] {
                episode.reset(seeds[k], fixed)?;
            }
            Ok(episode.seen())
        })
    }

    /// Steps all environments; `actions` are one after the other, `look` as in [`Episodes::reset`].
    ///
    /// # Errors
    /// As [`Episode::step`]; nothing happens then.
    pub fn step(
        &mut self,
        actions: &[f32],
        autoreset: Autoreset,
        look: impl FnMut() -> bool,
    ) -> Result<Option<Vec<Turn>>, Error> {
        let width = self.episodes[0].actions();
        if actions.len() != width * self.episodes.len() {
            return Err(Error::Argument {
                name: "actions",
                value: format!("{} numbers", actions.len()),
                allowed: "one number for each dimension of the action space, for every environment",
            });
        }
        let resets = |episode: &Episode| episode.over && autoreset == Autoreset::NextStep;
        for (episode, action) in self.episodes.iter().zip(actions.chunks(width)) {
            if !resets(episode) {
                episode.check(action)?;
            }
        }
        self.each(look, |k, episode| {
            if resets(episode) {
                episode.reset(None, &[])?;
                return Ok(episode.seen());
            }
            let turn = episode.step(&actions[k * width..(k + 1) * width])?;
            if !(episode.over && autoreset == Autoreset::SameStep) {
                return Ok(turn);
            }
            episode.reset(None, &[])?;
            let next = episode.seen();
            Ok(Turn {
                observation: next.observation,
                info: next.info,
                last: Some((turn.observation, turn.info)),
                ..turn
            })
        })
    }

    fn each(
        &mut self,
        mut look: impl FnMut() -> bool,
        work: impl Fn(usize, &mut Episode) -> Result<Turn, Error> + Sync,
    ) -> Result<Option<Vec<Turn>>, Error> {
        if let Some(made) = &self.pool
            && made.process != std::process::id()
        {
            // The threads of a process that was forked cannot be ended either.
            std::mem::forget(self.pool.replace(pool(made.threads.current_num_threads())?));
        }
        let mut turns = Vec::with_capacity(self.episodes.len());
        for (part, episodes) in self.episodes.chunks_mut(self.at_once).enumerate() {
            if part > 0 && !look() {
                self.episodes.iter_mut().for_each(|episode| episode.over = true);
                return Ok(None);
            }
            let first = part * self.at_once;
            let done: Result<Vec<Turn>, Error> = match &self.pool {
                None => {
                    let each = episodes.iter_mut().enumerate();
                    each.map(|(k, episode)| work(first + k, episode)).collect()
                }
                Some(pool) => {
                    let each = episodes.par_iter_mut().enumerate().with_max_len(1);
                    let each = each.map(|(k, episode)| work(first + k, episode));
                    pool.threads.install(|| each.collect())
                }
            };
            turns.extend(done?);
        }
        Ok(Some(turns))
    }

    /// The environments.
    #[must_use]
    pub fn episodes(&self) -> &[Episode] {
        &self.episodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Override;

    /// Driving for two actions of 20 ms.
    fn short(count: usize, frame_skip: u32, threads: usize) -> Episodes {
        let keys = [Override::new("duration_s", 0.04)];
        let scenario = Scenario::load("flat", &keys).expect("valid");
        let mut episodes =
            Episodes::new(Task::Drive, &scenario, &[], frame_skip, count, threads).expect("valid");
        let seeds: Vec<_> = (0..count as u64).map(Some).collect();
        let begun = episodes.reset(&seeds, &[], &vec![true; count], || true);
        assert_eq!(begun.expect("seeds").expect("not stopped").len(), count);
        episodes
    }

    fn step(episodes: &mut Episodes, autoreset: Autoreset) -> Result<Vec<Turn>, Error> {
        let actions = vec![0.3; 7 * episodes.episodes().len()];
        let turns = episodes.step(&actions, autoreset, || true)?;
        Ok(turns.expect("not stopped"))
    }

    #[test]
    fn an_episode_that_is_over_begins_anew_when_its_mode_says() {
        for autoreset in [Autoreset::Disabled, Autoreset::NextStep, Autoreset::SameStep] {
            let mut episodes = short(1, 20, 1);
            assert!(!step(&mut episodes, autoreset).expect("the first")[0].truncated);
            let last = &step(&mut episodes, autoreset).expect("the second")[0];
            // Time is up after 40 ms: that truncates and never terminates.
            assert!(last.truncated && !last.terminated);
            assert_eq!(last.last.is_some(), autoreset == Autoreset::SameStep);
            match (autoreset, step(&mut episodes, autoreset)) {
                (Autoreset::Disabled, Err(error)) => {
                    assert!(error.to_string().contains("only after reset()"), "{error}");
                }
                // The action that follows an end is left out, and rewarded with nothing.
                (Autoreset::NextStep, Ok(turns)) => assert_eq!(turns[0].reward, 0.0),
                (Autoreset::SameStep, Ok(turns)) => assert_ne!(turns[0].reward, 0.0),
                (mode, other) => panic!("{mode:?}: {other:?}"),
            }
        }
    }

    #[test]
    fn threads_and_company_change_no_number() {
        let alone: Vec<_> = (0..5)
            .map(|k| {
                let mut one = short(5, 20, 1);
                step(&mut one, Autoreset::NextStep)
                    .expect("stepped")
                    .swap_remove(k)
            })
            .collect();
        for threads in [1, 2, 3] {
            let turns = step(&mut short(5, 20, threads), Autoreset::NextStep).expect("stepped");
            assert_eq!(turns, alone, "{threads} threads");
        }
        assert_ne!(alone[0].observation, alone[1].observation); // other seeds, other twists to follow
    }

    #[test]
    fn a_refused_client_has_moved_nothing() {
        let mut episodes = short(2, 20, 1);
        let mut actions = vec![0.3; 14];
        actions[13] = f32::NAN;
        let refused = episodes.step(&actions, Autoreset::NextStep, || true);
        assert!(refused.expect_err("NaN").to_string().contains("finite"));
        let after = step(&mut episodes, Autoreset::NextStep).expect("stepped");
        assert_eq!(
            after,
            step(&mut short(2, 20, 1), Autoreset::NextStep).expect("stepped")
        );
    }

    #[test]
    fn a_stopped_learner_has_only_finished_episodes() {
        let mut episodes = short(200, 1000, 1); // three at once
        let mut looks = 0;
        let stopped = episodes.step(&[0.0; 1400], Autoreset::Disabled, || {
            looks += 1;
            looks < 3
        });
        assert!(stopped.expect("no error").is_none());
        assert_eq!(looks, 3);
        let error = step(&mut episodes, Autoreset::Disabled).expect_err("over");
        assert!(error.to_string().contains("only after reset()"), "{error}");
    }
}
