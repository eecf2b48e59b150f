//! Episodes for reinforcement learning: a vehicle, a task, random differences, many at once.
//!
//! Each [`Task`] documents its actions, observations, rewards and the end of an episode. Everything is plain numbers
//! here; Python's environments are a thin layer around [`Episodes`].

mod drive;
mod episodes;
mod rules;
mod step_climb;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::config::Scenario;
use crate::{Error, Simulation, control_periods};
pub use episodes::{Autoreset, Episodes};
pub use rules::Draw;
use rules::Rules;

/// The task to learn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Task {
    /// Get over a step; the action is the forward and the yaw command, and torques added to each row of wheels.
    StepClimb,
    /// Follow a twist; the action is the torque of every wheel.
    Drive,
}

impl Task {
    /// The task of that name, `step_climb` or `drive`.
    ///
    /// ```
    /// use omni_sim::learn::Task;
    /// assert_eq!((Task::named("drive"), Task::named("fly")), (Some(Task::Drive), None));
    /// ```
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "step_climb" => Some(Self::StepClimb),
            "drive" => Some(Self::Drive),
            _ => None,
        }
    }
}

/// Result of a step, or a reset, of one environment.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Turn {
    /// Readings of the sensors, each number within -1 to 1.
    pub observation: Vec<f32>,
    /// Reward of the step.
    pub reward: f64,
    /// The task is over: done, or failed.
    pub terminated: bool,
    /// The time is up.
    pub truncated: bool,
    /// Figures for people ([`Episode::info_names`]); NaN for unknown values.
    pub info: Vec<f64>,
    /// Observation and figures at the end of an episode if this step also began the next: [`Autoreset::SameStep`].
    pub last: Option<(Vec<f32>, Vec<f64>)>,
}

/// One environment: episodes of a task, one after the other.
///
/// ```
/// use omni_sim::{config::Scenario, learn::{Episode, Task}};
/// let mut episode = Episode::new(Task::Drive, &Scenario::load("flat", &[])?, &[], 20)?;
/// episode.reset(Some(7), &[])?;
/// let turn = episode.step(&[0.0; 7])?; // no torque at all, for 20 ms
/// assert!(turn.reward < 1.0 && !turn.terminated && !turn.truncated);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct Episode {
    /// As it was given.
    scenario: Scenario,
    /// With what was drawn for the present episode.
    present: Scenario,
    rules: Box<dyn Rules>,
    draws: Vec<Draw>,
    frame_skip: u32,
    rng: ChaCha8Rng,
    simulation: Simulation,
    /// The last action, within -1 to 1.
    action: Vec<f64>,
    /// Control periods until the time is up.
    left: u64,
    over: bool,
}

impl Episode {
    /// Episodes of a task in a scenario, whose duration is the longest of an episode. `ranges` replace those that
    /// differences are drawn from; an action is held for `frame_skip` control periods. [`Episode::reset`] comes first.
    ///
    /// # Errors
    /// [`Error::Config`] if the scenario does not suit the task; [`Error::Argument`] for a range or a `frame_skip` that
    /// is not valid.
    pub fn new(
        task: Task,
        scenario: &Scenario,
        ranges: &[(&str, [f64; 2])],
        frame_skip: u32,
    ) -> Result<Self, Error> {
        if !(1..=1000).contains(&frame_skip) {
            return Err(Error::Argument {
                name: "frame_skip",
                value: frame_skip.to_string(),
                allowed: "1 to 1000 control periods",
            });
        }
        let simulation = Simulation::new(scenario)?;
        let rules: Box<dyn Rules> = match task {
            Task::StepClimb => Box::new(step_climb::StepClimb::new(scenario, &simulation)?),
            Task::Drive => Box::new(drive::Drive::new(scenario)?),
        };
        let mut draws = rules.draws();
        for (name, range) in ranges {
            let draw = find(&mut draws, name)?;
            range.iter().try_for_each(|value| draw.check(*value))?;
            if range[0] > range[1] {
                return Err(Error::Argument {
                    name: draw.name,
                    value: format!("({}, {})", range[0], range[1]),
                    allowed: "the lower end first",
                });
            }
            draw.range = *range;
        }
        Ok(Self {
            action: vec![0.0; rules.actions()],
            scenario: scenario.clone(),
            present: scenario.clone(),
            rules,
            draws,
            frame_skip,
            rng: ChaCha8Rng::seed_from_u64(0),
            simulation,
            left: 0,
            over: true,
        })
    }

    /// Starts the next episode. With a seed, the same sequence of episodes follows; without one, the sequence of random
    /// numbers continues. Values in `fixed` are not drawn; all other values are unaffected.
    ///
    /// # Errors
    /// [`Error::Argument`] for an unknown name, or a value out of range; the present episode then continues.
    pub fn reset(&mut self, seed: Option<u64>, fixed: &[(&str, f64)]) -> Result<(), Error> {
        for (name, value) in fixed {
            find(&mut self.draws, name)?.check(*value)?;
        }
        if let Some(seed) = seed {
            self.rng = ChaCha8Rng::seed_from_u64(seed);
        }
        let mut drawn = Vec::with_capacity(self.draws.len());
        for draw in &self.draws {
            let [low, high] = draw.range;
            // 53 bits: uniform in 0..1.
            let part = (self.rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            let asked = fixed.iter().find(|(name, _)| *name == draw.name);
            drawn.push(asked.map_or(low + (high - low) * part, |(_, value)| *value));
        }
        let mut scenario = self.scenario.clone();
        scenario.seed = self.rng.next_u64() >> 1; // TOML's integers have a sign
        self.rules.begin(&drawn, &mut scenario);
        self.simulation = Simulation::new(&scenario)?;
        self.action.fill(0.0);
        self.left = control_periods(&scenario);
        self.present = scenario;
        self.over = false;
        Ok(())
    }

    /// Holds an action, clipped to -1 to 1, for `frame_skip` control periods, fewer at the end of the time.
    ///
    /// # Errors
    /// [`Error::Argument`] for another count of numbers, a number that is not finite, or if the episode is over;
    /// nothing happens then.
    pub fn step(&mut self, action: &[f32]) -> Result<Turn, Error> {
        self.check(action)?;
        for (own, given) in self.action.iter_mut().zip(action) {
            *own = f64::from(*given).clamp(-1.0, 1.0);
        }
        let mut failed = false;
        for _ in 0..u64::from(self.frame_skip).min(self.left) {
            self.left -= 1;
            match self.rules.control(&mut self.simulation, &self.action) {
                Ok(()) => {}
                Err(Error::Diverged { .. } | Error::FellApart { .. } | Error::Unsettled { .. }) => {
                    failed = true;
                    break;
                }
                Err(error) => return Err(error),
            }
        }
        let (reward, done) = self.rules.judge(&self.simulation, &self.action, failed);
        let terminated = done || failed;
        let truncated = !terminated && self.left == 0;
        self.over = terminated || truncated;
        Ok(Turn {
            reward: if reward.is_finite() { reward } else { 0.0 },
            terminated,
            truncated,
            ..self.seen()
        })
    }

    fn check(&self, action: &[f32]) -> Result<(), Error> {
        let refuse = |name, value: String, allowed| Err(Error::Argument { name, value, allowed });
        if self.over {
            let value = "called after the end of an episode or before the first".into();
            return refuse("step", value, "only after reset()");
        }
        if action.len() != self.action.len() {
            let value = format!("{} numbers", action.len());
            return refuse(
                "action",
                value,
                "one number for each dimension of the action space",
            );
        }
        match action.iter().find(|a| !a.is_finite()) {
            Some(bad) => refuse("action", bad.to_string(), "finite numbers, -1 to 1"),
            None => Ok(()),
        }
    }

    /// The present observation, without a reward.
    #[must_use]
    pub fn seen(&self) -> Turn {
        let mut seen = Vec::new();
        self.rules.observe(&self.simulation, &mut seen);
        let own = self.action.iter().map(|a| *a as f32);
        Turn {
            observation: seen.into_iter().map(scaled).chain(own).collect(),
            info: self.rules.info(&self.simulation),
            ..Turn::default()
        }
    }

    /// Size of an action.
    #[must_use]
    pub fn actions(&self) -> usize {
        self.action.len()
    }

    /// Names of the figures in [`Turn::info`].
    #[must_use]
    pub fn info_names(&self) -> &'static [&'static str] {
        self.rules.info_names()
    }

    /// The quantities that differ between episodes.
    #[must_use]
    pub fn draws(&self) -> &[Draw] {
        &self.draws
    }

    /// The scenario of the present episode, with what was drawn for it.
    #[must_use]
    pub fn present(&self) -> &Scenario {
        &self.present
    }

    /// The simulation of the present episode.
    #[must_use]
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// An action is held for so long \[s\].
    #[must_use]
    pub fn action_s(&self) -> f64 {
        f64::from(self.frame_skip) * self.scenario.period_s()
    }
}

fn find<'a>(draws: &'a mut [Draw], name: &str) -> Result<&'a mut Draw, Error> {
    let known: Vec<_> = draws.iter().map(|draw| draw.name).collect();
    match known.iter().position(|each| *each == name) {
        Some(k) => Ok(&mut draws[k]),
        None => Err(Error::Config(crate::config::Error::Key {
            file: "options".into(),
            key: name.into(),
            message: format!(
                "unknown{}, allowed: {}",
                crate::config::did_you_mean(name, known.iter().copied()),
                known.join(", ")
            ),
        })),
    }
}

/// A value over its scale, within -1 to 1 whatever the physics did.
fn scaled((value, scale): (f64, f64)) -> f32 {
    let part = (value / scale).clamp(-1.0, 1.0);
    if part.is_nan() { 0.0 } else { part as f32 }
}
